"""Our controller on RotorPy's Hummingbird, and RotorPy's on ours, around the same figure eight.

Needs RotorPy; in the checkout: .venv/bin/python -m pip install -e '.[rotorpy]'
python examples/fly_rotorpy.py
"""

from rotorpy.controllers.quadrotor_control import SE3Control

from quadstep import flight_metrics, fly
from quadstep.bridges.rotorpy import from_rotorpy
from quadstep.bridges.rotorpy_flight import fly_on_rotorpy, to_quad_params
from quadstep.control.opaque import flying
from quadstep.mission.multirotor import MultirotorMission

MISSION = MultirotorMission.model_validate(
    {
        "vehicle": {"preset": "hummingbird", "effects": {"gyroscopic": False}},  # RotorPy's rotors have no inertia
        "path": {"type": "figure-eight", "length": 4.0, "width": 2.0, "period": 6.0, "turns": 1.0, "centre": [0.0, 0.0, 2.0]},
        "controller": {"type": "geometric"},
        "wind": {"mean": [2.0, -1.0, 0.0]},
        "simulation": {"control_period": 0.004, "guidance_period": 0.008, "log_period": 0.008},
    }
)


def show(name, plan):
    """Fly it on both vehicles."""
    for whose, log in (("our vehicle", fly(plan)), ("RotorPy's vehicle", fly_on_rotorpy(plan))):
        print(f"{name} on {whose}: position RMSE {1e3 * flight_metrics(log)['position_rmse[m]']:.3f} mm")


if __name__ == "__main__":
    show("our geometric control", MISSION.plan())
    with flying(from_rotorpy(SE3Control(to_quad_params(MISSION.vehicle.build())))) as (law, gains):
        show("RotorPy's SE3 control", MISSION.plan().with_controller(law, gains))
