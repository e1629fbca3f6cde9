"""A mission flown on RotorPy's vehicle instead of ours: same path, controller, rates and limits, and a log alike.

A vehicle is also written as RotorPy 3.0.0 describes one. It has one lag for rising and falling rotors,
four rotors that push along body z, and neither gyroscopic torque nor battery nor ground effect. Its `rotor_directions` are
signs of the torque on the body, the opposite of a spin; its flapping moment has the opposite sign too.
"""

import math
from importlib import import_module
from typing import Protocol, cast

import numpy as np
from numpy.typing import NDArray

from quadstep.bridges.rotorpy import Adapter, RotorPyControl, State, Trajectory, array, column
from quadstep.engines.fly import FlightPlan
from quadstep.engines.loop import Loop
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.log import FlightLog, finished
from quadstep.io.doors import needed_by
from quadstep.io.errors import UserError
from quadstep.mission.airframe import BuiltAirframe
from quadstep.sensing.suite import Suite
from quadstep.vehicle.airframe_plant import Events
from quadstep.vehicle.multirotor import AirframeParameters, Multirotor, Spun
from quadstep.vehicle.rigid_body import AirframeState
from quadstep.world.air import MovingAir, start_turbulence, wind_at

GRAVITY = 9.81
"""RotorPy's, everywhere [m/s^2]."""

UP = (0.0, 0.0, 1.0)


def to_quad_params(vehicle: BuiltAirframe) -> dict[str, object]:
    """RotorPy's `quad_params` of a vehicle, SI units. Raises UserError for what RotorPy cannot describe."""
    mounts, effects, airframe = vehicle.geometry.mounts, vehicle.effects, vehicle.airframe
    rotor, drag = airframe.rotor, airframe.drag
    gyroscopic = effects.gyroscopic and rotor.inertia > 0.0
    lacking = {
        "has only vehicles with four rotors": len(mounts) != 4,
        "has only rotors that push along body z": any(mount.axis != UP for mount in mounts),
        "has a single rotor lag; set vehicle.rotor.rise_time and fall_time to the same value": rotor.rise != rotor.fall,
        f"uses a gravity of {GRAVITY} m/s^2; set vehicle.gravity to that": airframe.gravity != GRAVITY,
        "has no gyroscopic rotor torque; set vehicle.effects.gyroscopic = false": gyroscopic,
        "has no battery; set vehicle.effects.battery = false": effects.battery,
        "has no ground effect; set vehicle.effects.ground = false": effects.ground,
        "has no ground to stand on; leave out vehicle.legs": bool(airframe.contact),
    }
    for what, lacks in lacking.items():
        if lacks:
            raise UserError(f"RotorPy {what}")
    air = float(effects.drag)
    x, y, z = airframe.inertia
    c_x, c_y, c_z = air * drag.parasitic
    k_d, _, k_z = air * drag.rotor
    return {
        "mass": airframe.mass,
        **{"Ixx": x, "Iyy": y, "Izz": z, "Ixy": 0.0, "Ixz": 0.0, "Iyz": 0.0},
        "num_rotors": len(mounts),
        "rotor_radius": rotor.radius,
        "rotor_pos": {f"r{i}": np.array(mount.position) for i, mount in enumerate(mounts, start=1)},
        "rotor_directions": np.array([-mount.spin for mount in mounts]),
        "rI": np.zeros(3),
        **{"c_Dx": c_x, "c_Dy": c_y, "c_Dz": c_z},
        "k_eta": rotor.thrust,
        "k_m": rotor.torque,
        **{"k_d": k_d, "k_z": k_z, "k_h": air * drag.translational_lift, "k_flap": -air * drag.flapping},
        "tau_m": rotor.rise,
        **{"rotor_speed_min": rotor.slowest, "rotor_speed_max": rotor.fastest, "motor_noise_std": 0.0},
    }


STILL = start_turbulence()


class RotorPyVehicle(Protocol):
    def step(
        self, state: dict[str, NDArray[np.float64]], control: RotorPyControl, t_step: float
    ) -> dict[str, NDArray[np.float64]]:
        """Its state one step [s] later."""
        ...


def multirotor(quad_params: dict[str, object], integrator: dict[str, object] | None = None) -> RotorPyVehicle:
    """RotorPy's vehicle, told rotor speeds. integrator: keywords for SciPy's solve_ivp; RotorPy's own if left out.

    Raises UserError without RotorPy.
    """
    with needed_by("flying on RotorPy's vehicle"):
        module = import_module("rotorpy.vehicles.multirotor")
    return module.Multirotor(quad_params, control_abstraction="cmd_motor_speeds", integrator_kwargs=integrator)


def fly_on_rotorpy(plan: FlightPlan, integrator: dict[str, object] | None = None) -> FlightLog:
    """The log of a mission flown on RotorPy's vehicle; the wind is held from step to step.

    final: RotorPy's last state. Raises UserError without RotorPy, and for what it has no like of: see `to_quad_params`, and
    events, turbulence, sensors.
    """
    controller, trajectory, ticks = Adapter(plan), Trajectory(plan), plan.ticks
    loop, parameters = controller.loop, controller.parameters
    plant = cast(Multirotor, loop.plant)
    check(loop, parameters)
    built = BuiltAirframe(plant.geometry, plant.effects, parameters.airframe, parameters.allocation, 0.0)
    vehicle = multirotor(to_quad_params(built), integrator)
    stride = math.gcd(ticks.log, ticks.last, *(every for every in ticks.every))
    step, state = stride * ticks.step, rotorpy_state(plan.start)
    rows: list[list[float]] = []
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


def check(loop: Loop, parameters: AirframeParameters) -> None:
    """Raises UserError for parts of a mission that would be left out."""
    lacking = {
        "turbulence, and no wind of one's own": loop.air != MovingAir(),
        "sensors": loop.sensing != Suite(),
        "events": parameters.events != Events(),
    }
    for what, has in lacking.items():
        if has:
            raise UserError(f"a flight on RotorPy's vehicle has no {what}; take them out of the mission")


def rotorpy_state(state: AirframeState) -> dict[str, NDArray[np.float64]]:
    position, velocity, attitude, rates, speeds = map(array, state[:5])
    parts = {"x": position, "v": velocity, "q": np.roll(attitude, -1), "w": rates}
    return {**parts, "wind": np.zeros(3), "rotor_speeds": speeds}


def airframe_state(state: State) -> AirframeState:
    position, velocity, rates, speeds = (column(state[key]) for key in ("x", "v", "w", "rotor_speeds"))
    return AirframeState(position, velocity, column(np.roll(state["q"], 1)), rates, speeds, charge=0.0)
