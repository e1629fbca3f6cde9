"""RotorPy 3.0.0: our controllers on its vehicles, and its controllers on ours. Needs no RotorPy to be imported.

    controller = Adapter(mission.plan())                                    # ours, for RotorPy to ask
    state = vehicle.step(state, controller.update(t, state, flat), 0.002)

    with flying(from_rotorpy(SE3Control(params))) as (law, gains):          # RotorPy's, in a mission of ours
        log = fly(plan.with_controller(law, gains))

Both have world z up, body x forward, y left, z up; RotorPy's quaternions are (i, j, k, w). A vehicle is written as RotorPy
has one: with one lag for rising and falling rotors, four rotors that push along body z, and neither gyroscopic torque nor
battery nor ground effect. Its `rotor_directions` are signs of the torque on the body, the opposite of a spin; its flapping
moment has the opposite sign too. `examples/fly_rotorpy.py` flies a mission on such a vehicle.
"""

import math
from collections.abc import Iterable, Mapping
from typing import NotRequired, Protocol, TypeAlias, TypedDict

import numpy as np
from numpy.typing import NDArray

from quadstep.control.opaque import Controller, MeasuredArrays, ReferenceArrays
from quadstep.engines.fly import FlightPlan
from quadstep.interfaces.controller import Command, Measured
from quadstep.interfaces.plant import Reference
from quadstep.io.errors import UserError
from quadstep.mission.airframe import BuiltAirframe
from quadstep.mission.clock import PERIODS
from quadstep.numbers import Number, Vector, vector
from quadstep.numbers.rotations import from_yaw_pitch_roll
from quadstep.vehicle.multirotor import Multirotor
from quadstep.vehicle.rigid_body import AirframeState

State: TypeAlias = Mapping[str, NDArray[np.float64]]
"""x [m], v [m/s]: world. q: (i, j, k, w), body to world. w [rad/s]: about the body's axes."""

Numbers: TypeAlias = Iterable[float]


class FlatOutput(TypedDict):
    """x [m] and its rates; yaw [rad] and its own."""

    x: Numbers
    x_dot: Numbers
    x_ddot: Numbers
    x_dddot: NotRequired[Numbers]
    x_ddddot: NotRequired[Numbers]
    yaw: float
    yaw_dot: float
    yaw_ddot: NotRequired[float]


class RotorPyControl(TypedDict, total=False):
    """What its controllers want: rotor speeds [rad/s], their thrusts [N], the total thrust [N], moment [N m], attitude."""

    cmd_motor_speeds: NDArray[np.float64]
    cmd_motor_thrusts: NDArray[np.float64]
    cmd_thrust: float
    cmd_moment: NDArray[np.float64]
    cmd_q: NDArray[np.float64]


class RotorpyControl(Protocol):
    def update(self, t: float, state: State, flat_output: FlatOutput) -> RotorPyControl:
        """What is to be done from time t [s] on."""
        ...


class Adapter:
    """The controller of a flight plan as RotorPy asks one: with its gains, its rates and its rotors' limits.

    It follows the path that RotorPy gives it and knows the state it is told. Asked more often than it runs it repeats its
    answer; it starts anew where time does not go on. command: what it last wanted. thrust [N], torque [N m]: what the rotors'
    limits left of that. Raises UserError for a mission on the paper's plant.
    """

    calls: int
    memory: object
    command: Command
    thrust: Number
    torque: Vector
    answer: RotorPyControl

    def __init__(self, plan: FlightPlan) -> None:
        if not isinstance(plan.loop.plant, Multirotor):
            raise UserError("RotorPy flies real vehicles: a mission whose [vehicle] has a preset, file, layout or rotors")
        self.loop, self.parameters = plan.loop, plan.parameters
        if plan.loop.controller.also_measures:
            raise UserError(f"RotorPy does not give controllers {', '.join(plan.loop.controller.also_measures)}")
        if plan.loop.controller.preview:
            raise UserError("RotorPy does not give controllers the path ahead")
        every = dict(zip((task.name for task in plan.loop.tasks), plan.ticks.every, strict=True))
        self.periods = {task.name: every[task.name] * plan.ticks.step for task in plan.loop.sampled}
        self.last = math.inf

    def update(self, t: float, state: State, flat_output: FlatOutput) -> RotorPyControl:
        """Rotor speeds [rad/s], the thrusts [N] of each and the thrust and moment [N m] of all that they make.

        Raises UserError where the mission's periods are no multiples of the steps from call to call.
        """
        if not t > self.last:
            self.begin(state)
        elif self.calls == 1:
            self.every = {
                name: whole_steps(period, t - self.last, PERIODS.get(name, name)) for name, period in self.periods.items()
            }
        law, gains = self.loop.controller, self.parameters.gains
        measured, reference = self.measured(state), reference_of(flat_output)
        due = [name for name, calls in self.every.items() if self.calls % calls == 0]
        for name in due:
            if name != "law":
                self.memory = law.slower(name, self.memory, measured, reference, gains, t, self.periods[name])
        if "law" in due:
            self.command, self.memory = law.law(self.memory, measured, reference, gains, t, self.periods["law"])
            self.attitude = measured.attitude
            self.allocate()
        self.calls, self.last = self.calls + 1, t
        return self.answer.copy()

    def begin(self, state: State) -> None:
        """Before the first call of a flight, at which all loops run."""
        self.calls, self.every = 0, dict.fromkeys(self.periods, 1)
        self.thrust, self.torque = 0.0, vector(0.0, 0.0, 0.0)
        self.command = Command(self.thrust, self.torque)
        self.memory = self.loop.controller.start(self.measured(state), self.parameters.gains)

    def measured(self, state: State) -> Measured:
        i, j, k, w = map(float, state["q"])
        position, velocity, rates = (column(state[key]) for key in ("x", "v", "w"))
        return Measured(position, velocity, vector(w, i, j, k), rates, self.thrust, self.torque)

    def allocate(self) -> None:
        command, allocation = self.command, self.parameters.allocation
        speeds, self.thrust, self.torque = self.loop.plant.actuate(self.parameters, command)
        said = math.isfinite(command.desired_attitude.norm())
        w, i, j, k = from_yaw_pitch_roll(command.desired_attitude) if said else self.attitude
        turning = np.array(list(speeds))
        self.answer = {
            "cmd_motor_speeds": turning,
            "cmd_motor_thrusts": allocation.thrust * turning**2,
            "cmd_thrust": self.thrust,
            "cmd_moment": np.array(list(self.torque)),
            "cmd_q": np.array([i, j, k, w]),
        }


class Trajectory:
    """A mission's path as RotorPy asks one."""

    def __init__(self, plan: FlightPlan) -> None:
        self.path, self.parameters = plan.loop.path, plan.parameters.path
        self.duration = plan.ticks.last * plan.ticks.step

    def update(self, t: float) -> FlatOutput:
        """The flat output at time t [s]; RotorPy asks for that at infinity to know the end."""
        wanted = self.path.reference(float(t) if math.isfinite(t) else self.duration, self.parameters)
        return {**flat_output(*wanted[:5]), "x_dddot": array(wanted.jerk), "x_ddddot": array(wanted.snap)}


def from_rotorpy(controller: RotorpyControl) -> Controller:
    """A controller of RotorPy's for `quadstep.control.opaque.flying`; it must give cmd_thrust and cmd_moment.

    It is told no jerk and no snap of the path: zero.
    """

    def command(t: float, measured: MeasuredArrays, reference: ReferenceArrays) -> tuple[float, NDArray[np.float64]]:
        state = {"x": measured.position, "v": measured.velocity, "q": np.roll(measured.attitude, -1), "w": measured.rates}
        control = controller.update(t, state, flat_output(*reference))
        for key in ("cmd_thrust", "cmd_moment"):
            if key not in control:
                raise UserError(f"{type(controller).__name__} returns no {key}; it cannot fly here")
        return float(control["cmd_thrust"]), control["cmd_moment"]

    return command


def reference_of(flat: FlatOutput) -> Reference:
    """The wanted motion of a flat output; a jerk or snap it lacks is zero."""
    unknown = (0.0, 0.0, 0.0)
    position, velocity, acceleration = column(flat["x"]), column(flat["x_dot"]), column(flat["x_ddot"])
    jerk, snap = column(flat.get("x_dddot", unknown)), column(flat.get("x_ddddot", unknown))
    return Reference(position, velocity, acceleration, float(flat["yaw"]), float(flat["yaw_dot"]), jerk, snap)


def flat_output(position: Numbers, velocity: Numbers, acceleration: Numbers, yaw: float, yaw_rate: float) -> FlatOutput:
    """The flat output of a wanted motion, without jerk and snap."""
    return {
        "x": array(position),
        "x_dot": array(velocity),
        "x_ddot": array(acceleration),
        "x_dddot": np.zeros(3),
        "x_ddddot": np.zeros(3),
        "yaw": yaw,
        "yaw_dot": yaw_rate,
        "yaw_ddot": 0.0,
    }


def whole_steps(period: float, step: float, name: str) -> int:
    """How many steps [s] a period [s] takes. Raises UserError where it is no whole number."""
    steps = round(period / step)
    if steps < 1 or abs(period - steps * step) > 1e-6 * period:
        raise UserError(f"simulation.{name} = {period:g} s must be a whole multiple of RotorPy's step of {step:g} s")
    return steps


def column(values: Numbers) -> Vector:
    return Vector(float(value) for value in values)


def array(values: Numbers) -> NDArray[np.float64]:
    return np.array(list(values), dtype=float)


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


def rotorpy_state(state: AirframeState) -> dict[str, NDArray[np.float64]]:
    position, velocity, attitude, rates, speeds = map(array, state[:5])
    parts = {"x": position, "v": velocity, "q": np.roll(attitude, -1), "w": rates}
    return {**parts, "wind": np.zeros(3), "rotor_speeds": speeds}


def airframe_state(state: State) -> AirframeState:
    position, velocity, rates, speeds = (column(state[key]) for key in ("x", "v", "w", "rotor_speeds"))
    return AirframeState(position, velocity, column(np.roll(state["q"], 1)), rates, speeds, charge=0.0)
