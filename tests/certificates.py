"""Flights to certify."""

from quadstep.mission.schema import Mission

LINE = {"type": "minimum-jerk", "end": [8.0, 2.0, 4.0], "duration": 5.0, "yaw_end": 0.6}


def plan(path=None, controller=None, **sections):
    content = {"path": path or LINE, "controller": {"type": "backstepping", **(controller or {})}, **sections}
    return Mission.model_validate(content).plan()


def still(law=None, **sections):
    """Hover on the spot, with gains for which a yaw error is outside b_r: large K_r1, small Lambda2, no nets."""
    controller = {"K_r1": 300.0, "Lambda2": 1.0, "nets": {"enabled": False}, **(law or {})}
    path = {"type": "minimum-jerk", "end": [0.0, 0.0, 0.0], "duration": 4.0}
    return plan(path=path, controller=controller, disturbance={"scale": 0.0}, **sections)
