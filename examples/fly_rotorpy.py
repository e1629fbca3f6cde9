"""Our controller on RotorPy's Hummingbird, and RotorPy's on ours, around the same figure eight.

Needs RotorPy; in the checkout: .venv/bin/python -m pip install -e '.[rotorpy]'
python examples/fly_rotorpy.py
"""

import math

import numpy as np
from rotorpy.controllers.quadrotor_control import SE3Control
from rotorpy.vehicles.multirotor import Multirotor

from quadstep import UserError, flight_metrics, fly
from quadstep.bridges.rotorpy import (
    Adapter,
    Trajectory,
    airframe_state,
    array,
    from_rotorpy,
    rotorpy_state,
    to_quad_params,
)
from quadstep.control.opaque import flying
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.log import finished
from quadstep.mission.airframe import BuiltAirframe
from quadstep.mission.multirotor import MultirotorMission
from quadstep.sensing.suite import Suite
from quadstep.vehicle.airframe_plant import Events
from quadstep.vehicle.multirotor import Spun
from quadstep.world.air import MovingAir, start_turbulence, wind_at

STILL = start_turbulence()

MISSION = MultirotorMission.model_validate(
    {
        "vehicle": {"preset": "hummingbird", "effects": {"gyroscopic": False}},  # RotorPy's rotors have no inertia
        "path": {"type": "figure-eight", "length": 4.0, "width": 2.0, "period": 6.0, "turns": 1.0, "centre": [0.0, 0.0, 2.0]},
        "controller": {"type": "geometric"},
        "wind": {"mean": [2.0, -1.0, 0.0]},
        "simulation": {"control_period": 0.004, "guidance_period": 0.008, "log_period": 0.008},
    }
)


def fly_on_rotorpy(plan, integrator=None):
    """The log of a mission flown on RotorPy's vehicle instead of ours: same path, controller, rates, limits, a log alike.

    The wind is held from step to step. integrator: keywords for SciPy's solve_ivp. Raises UserError for what RotorPy has no
    like of: see `to_quad_params`, and events, turbulence, sensors.
    """
    controller, trajectory, ticks = Adapter(plan), Trajectory(plan), plan.ticks
    loop, parameters = controller.loop, controller.parameters
    plant = loop.plant
    check(loop, parameters)
    built = BuiltAirframe(plant.geometry, plant.effects, parameters.airframe, parameters.allocation, 0.0)
    params = to_quad_params(built)
    vehicle = Multirotor(params, control_abstraction="cmd_motor_speeds", integrator_kwargs=integrator)
    stride = math.gcd(ticks.log, ticks.last, *(every for every in ticks.every))
    step, state = stride * ticks.step, rotorpy_state(plan.start)
    rows = []
    code, tick = 0.0, 0
    for tick in range(0, ticks.last + 1, stride):
        t = tick * ticks.step
        try:
            answer = controller.update(t, state, trajectory.update(t))
            now, reference = airframe_state(state), loop.path.reference(t, parameters.path)
            code = plant.outcome(parameters, now, controller.command, reference)
            if code:
                break
            if tick % ticks.log == 0:
                measured, wind = controller.measured(state), wind_at(parameters.wind, STILL, t)
                held = Spun(now.speeds, controller.thrust, controller.torque)
                rows.append(plant.row(parameters, now, measured, controller.command, held, reference, wind, t))
            if tick < ticks.last:
                state["wind"] = array(wind_at(parameters.wind, STILL, t + 0.5 * step))
                state = vehicle.step(state, answer, step)
        except (ArithmeticError, ValueError):  # as on floats
            code = float(Outcome.NOT_FINITE)
            break
    return finished(loop.columns, np.array(rows).reshape(-1, len(loop.columns)), code, tick, ticks, state)


def check(loop, parameters):
    """Raises UserError for parts of a mission that would be left out."""
    lacking = {
        "turbulence, and no wind of your own": loop.air != MovingAir(),
        "sensors": loop.sensing != Suite(),
        "events": parameters.events != Events(),
    }
    for what, has in lacking.items():
        if has:
            raise UserError(f"a flight on RotorPy's vehicle has no {what}; take them out of the mission")


def show(name, plan):
    """Fly it on both vehicles."""
    for whose, log in (("our vehicle", fly(plan)), ("RotorPy's vehicle", fly_on_rotorpy(plan))):
        print(f"{name} on {whose}: position RMSE {1e3 * flight_metrics(log)['position_rmse[m]']:.3f} mm")


if __name__ == "__main__":
    show("our geometric control", MISSION.plan())
    with flying(from_rotorpy(SE3Control(to_quad_params(MISSION.vehicle.build())))) as (law, gains):
        show("RotorPy's SE3 control", MISSION.plan().with_controller(law, gains))
