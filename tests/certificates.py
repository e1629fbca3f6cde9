"""Flights to certify."""

from quadstep.mission.schema import Mission

LINE = {"type": "minimum-jerk", "end": [8.0, 2.0, 4.0], "duration": 5.0, "yaw_end": 0.6}


def plan(path=None, controller=None, **sections):
    content = {"path": path or LINE, "controller": {"type": "backstepping", **(controller or {})}, **sections}
    return Mission.model_validate(content).plan()
