"""Any Python callable as a controller, asked at every sample, not compiled: `python examples/opaque_controller.py`."""

from pathlib import Path

import numpy as np

from quadstep import flight_metrics, fly, read_mission
from quadstep.control.opaque import flying

MASS, INERTIA = 2.644, np.array([0.03, 0.03, 0.05])


def controller(_, measured, reference):
    """Thrust [N] and torque [N m] at a time, for what is measured and desired: arrays."""
    w, x, y, z = measured.attitude
    up = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
    pull = 6 * (reference.position - measured.position) + 4 * (reference.velocity - measured.velocity)
    force = MASS * (reference.acceleration + pull + [0, 0, 9.81])
    lean = np.cross(up, force / np.linalg.norm(force))  # the turn that is missing, world axes
    rotation = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z)], [2 * (x * y + w * z), 1 - 2 * (x * x + z * z)],
                         [2 * (x * z - w * y), 2 * (y * z + w * x)]])  # fmt: skip
    turn = np.append(rotation.T @ lean, reference.yaw - np.arctan2(rotation[1, 0], rotation[0, 0]))
    return force @ up, INERTIA * ([120, 120, 30] * turn - [18, 18, 9] * measured.rates)


if __name__ == "__main__":
    mission = read_mission(Path(__file__).parent / "wind_tunnel.toml")
    with flying(controller) as (law, gains):
        log = fly(mission.plan().with_controller(law, gains))
    print(log.outcome.name, flight_metrics(log, mission.score_from)["position_rmse[m]"])
