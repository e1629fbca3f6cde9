"""What the paper's plant and real vehicles have in common: three axes, a thrust and three torques, two nets. The columns of
their logs.
"""

from collections.abc import Mapping, Sequence
from typing import ClassVar, Generic, Protocol, TypeVar, cast

from quadstep.interfaces.controller import Command, Measured
from quadstep.interfaces.plant import Kinematics, Reference
from quadstep.numbers import Number, Vector, absolute, maximum
from quadstep.numbers.rotations import yaw_pitch_roll
from quadstep.vehicle.airframe_plant import Airframe, voltage
from quadstep.vehicle.paper import State, Vehicle, allocate, effective_inertia
from quadstep.vehicle.rigid_body import AirframeState, Effects

COLUMNS: dict[str, str] = {
    "t": "s",
    **dict.fromkeys(("x", "y", "z"), "m"),
    **dict.fromkeys(("psi", "theta", "phi"), "rad"),
    **dict.fromkeys(("x_dot", "y_dot", "z_dot"), "m/s"),
    **dict.fromkeys(("psi_dot", "theta_dot", "phi_dot"), "rad/s"),
    **dict.fromkeys(("x_d", "y_d", "z_d"), "m"),
    **dict.fromkeys(("psi_d", "theta_d", "phi_d"), "rad"),
    "u": "N",
    **dict.fromkeys(("tau_psi", "tau_theta", "tau_phi"), "N m"),
    **dict.fromkeys(("f1", "f2", "f3", "f4"), "N"),
    "norm_W1": "-",
    "norm_W2": "-",
    "lyapunov": "J",
    "norm_r1": "m/s",
    "norm_r2": "rad/s",
}
"""Name and unit of every logged column, in order."""


def log_row(
    vehicle: Vehicle, kinematics: Kinematics, wanted: Vector, state: State, command: Command, t: Number
) -> list[Number]:
    """One row, in the order of `COLUMNS`, at time t [s]: the state now, the command held. wanted: xi_d [m].

    lyapunov is Eq. 55 without its last term, which contains the unknown ideal weights.
    """
    r1, r2 = command.r1, command.r2
    inertia = effective_inertia(state.attitude, vehicle.inertia, kinematics)
    kinetic = 0.5 * (vehicle.mass * (r1 @ r1) + r2 @ (inertia @ r2))
    forces = allocate(vehicle.rotors, command.thrust, command.torque)
    motion = (*state.position, *state.attitude, *state.velocity, *state.rates, *wanted, *command.desired_attitude)
    inputs = (command.thrust, *command.torque, *forces)
    return [t, *motion, *inputs, *command.weight_norms, kinetic + command.stored, r1.norm(), r2.norm()]


def airframe_columns(rotors: int, failing: bool = False) -> dict[str, str]:
    """Name and unit of every column, for a vehicle with this many rotors.

    x .. r: the state, angles of R = Rz(yaw) Ry(pitch) Rx(roll), right-handed. x_m y_m z_m: the position as measured or
    estimated. u, tau: commanded; u_a, tau_a: what the rotors' limits leave of them. f: each rotor's k_f speed^2,
    less what a fault takes; f_whole, where rotors fail: without the fault.
    """
    return {
        "t": "s",
        **dict.fromkeys(("x", "y", "z"), "m"),
        **dict.fromkeys(("v_x", "v_y", "v_z"), "m/s"),
        **dict.fromkeys(("q_w", "q_x", "q_y", "q_z"), "-"),
        **dict.fromkeys(("yaw", "pitch", "roll"), "rad"),
        **dict.fromkeys(("p", "q", "r"), "rad/s"),
        **dict.fromkeys(("x_d", "y_d", "z_d"), "m"),
        "heading_d": "rad",
        **dict.fromkeys(("yaw_d", "pitch_d", "roll_d"), "rad"),
        **dict.fromkeys(("x_m", "y_m", "z_m"), "m"),
        "u": "N",
        **dict.fromkeys(("tau_x", "tau_y", "tau_z"), "N m"),
        "u_a": "N",
        **dict.fromkeys(("tau_x_a", "tau_y_a", "tau_z_a"), "N m"),
        **dict.fromkeys((f"f{i + 1}{which}" for which in ("", "_whole")[: 1 + failing] for i in range(rotors)), "N"),
        **dict.fromkeys(("wind_x", "wind_y", "wind_z"), "m/s"),
        "voltage": "V",
        "norm_W1": "-",
        "norm_W2": "-",
        "norm_r1": "m/s",
        "norm_r2": "rad/s",
    }


def airframe_row(
    airframe: Airframe, effects: Effects, reference: Reference, state: AirframeState, measured: Measured,
    command: Command, forces: Sequence[Number], wind: Vector, t: Number,
) -> list[Number]:  # fmt: skip
    """One row, in the order of `airframe_columns`, at time t [s]: the state now, the command held. wind [m/s]: world."""
    return [
        t,
        *state.position,
        *state.velocity,
        *state.attitude,
        *yaw_pitch_roll(state.attitude),
        *state.rates,
        *reference.position,
        reference.yaw,
        *command.desired_attitude,
        *measured.position,
        command.thrust,
        *command.torque,
        measured.thrust,
        *measured.torque,
        *forces,
        *wind,
        voltage(airframe, state) if effects.battery else 0.0,
        *command.weight_norms,
        command.r1.norm(),
        command.r2.norm(),
    ]


class Actuation(Protocol):
    """What the actuators make of a command: thrust [N], torque [N m]."""

    @property
    def thrust(self) -> Number: ...

    @property
    def torque(self) -> Vector: ...


class WithPosition(Protocol):
    """A state with a position [m]."""

    @property
    def position(self) -> Vector: ...


P = TypeVar("P")
"""The plant's parameters."""

X = TypeVar("X", bound=WithPosition)
"""Its state."""

C = TypeVar("C")
"""The commands that it takes."""


class InSpace(Generic[P, X, C]):
    """Part of a `Plant` whose state has a position and rates, three numbers each."""

    axes: ClassVar[tuple[str, ...]] = ("x", "y", "z")
    efforts: ClassVar[Mapping[str, str]] = {"thrust": "N", "torque_1": "N m", "torque_2": "N m", "torque_3": "N m"}
    norms: ClassVar[tuple[str, ...]] = ("norm_W1", "norm_W2")

    def error(self, state: X, reference: Reference) -> Vector:
        """e1 (Eq. 11)."""
        return reference.position - state.position

    def rotor_speeds(self, state: X) -> Vector:
        """Never asked, unless the rotors' speeds are states."""
        raise NotImplementedError

    def full_speed(self, state: X, p: P) -> Number:
        """Never asked, unless the rotors have a battery."""
        raise NotImplementedError

    def logged_command(self, p: P, command: C) -> Command:
        return cast(Command, command)

    def inputs(self, held: Actuation) -> Vector:
        """Thrust [N] and torque [N m]."""
        return Vector((held.thrust, *held.torque))

    def weight_norms(self, command: Command) -> Vector:
        """Frobenius norms of both nets' weights."""
        return command.weight_norms


def fastest(rates: Vector) -> Number:
    """The largest magnitude of three rates."""
    return maximum(maximum(absolute(rates[0]), absolute(rates[1])), absolute(rates[2]))
