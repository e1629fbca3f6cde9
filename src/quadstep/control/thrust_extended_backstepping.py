"""Thrust with its first rate as states of the controller, so that snap can be commanded: position is then a chain of four
integrators in each axis, by a change of inputs that is exact wherever there is thrust.

Mistler, Benallegue, M'Sirdi (2001), the paper's [20]; Mahony, Hamel, Dzul (1999), its [26].

Backstepping through the thrust's rate: Mahony, Hamel, Dzul (1999) and Mahony, Hamel (2005), the paper's [26] and [13].

The paper turns the wanted force into thrust and tilt, and its proof loses the force that is missing while the vehicle still
leans. Here the force itself is a state, driven through the thrust's second rate and the tilting torques, so that backstepping
is exact over all four integrators. With e1 = p - p_d, e0 its integral, and further errors e2, e3, e4 of velocity, specific
force and its rate,

    V = 1/2 (k_0 |e0|^2 + sum_i |e_i|^2 / c^(i - 1)),    V_dot = -sum_i k_i |e_i|^2 / c^(i - 1).

The papers have c = 1: their errors drive each other at 1 rad/s, however slow the vehicle.
"""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

from quadstep.control.vectoring import desired_attitude, project, torque_for, up_axis
from quadstep.interfaces.controller import Command, Controller, Measured
from quadstep.interfaces.gain import believed, gain, given, usual
from quadstep.interfaces.plant import Body, Reference
from quadstep.numbers import Number, Vector, clip, maximum, minimum, vector, where
from quadstep.numbers.rotations import rotation_matrix

LEAST, MOST = 0.2, 0.95
"""Specific thrust held between these shares of gravity and of what a position loop may ask for."""


class Push(NamedTuple):
    """value [m/s^2]: specific thrust u / m. rate [m/s^3]: of the value."""

    value: Number
    rate: Number


class ThrustMotion(NamedTuple):
    """Third axis of the body, and the specific force that the thrust makes [m/s^2] with its rate [m/s^3]; world axes."""

    axis: Vector
    force: Vector
    force_rate: Vector


class ExtendedGains(Body, Protocol):
    """Gains of a law that drives the thrust's rate: what it believes of the vehicle, and those of the heading."""

    @property
    def most_thrust(self) -> Number: ...
    @property
    def heading(self) -> Number: ...
    @property
    def turning(self) -> Number: ...


class Driving(NamedTuple):
    """Thrust [N] and torque [N m] now, and the extended thrust one period later."""

    thrust: Number
    torque: Vector
    push: Push


class Inputs(NamedTuple):
    """Second rate of the specific thrust [m/s^4]; angular acceleration about body x and y [rad/s^2]."""

    push: Number
    about_x: Number
    about_y: Number


def motion(measured: Measured, push: Push) -> ThrustMotion:
    """What the extended thrust does now: d/dt (push b3) = rate b3 + push R (Omega x e3)."""
    rotation, (p, q, _) = rotation_matrix(measured.attitude), measured.rates
    axis = up_axis(rotation)
    return ThrustMotion(axis, push.value * axis, push.rate * axis + push.value * (rotation @ vector(q, -p, 0.0)))


def inputs(measured: Measured, push: Push, snap: Vector) -> Inputs:
    """What gives the specific force this second rate [m/s^4], world axes:

    R^T snap = push_dd e3 + 2 push_d (Omega x e3) + push (Omega (Omega . e3) - |Omega|^2 e3 + Omega_d x e3).
    """
    p, q, r = measured.rates
    along_x, along_y, along_z = rotation_matrix(measured.attitude).T @ snap
    over = 1.0 / push.value
    return Inputs(
        push=along_z + push.value * (p * p + q * q),
        about_x=q * r - over * (along_y + 2.0 * push.rate * p),
        about_y=over * (along_x - 2.0 * push.rate * q) - p * r,
    )


def driven(push: Push, change: Number, gravity: Number, most: Number, period: Number) -> Push:
    """The specific thrust one period [s] later, within its limits; at a limit its rate does not lead beyond it.

    change: its second rate [m/s^4]. most: the largest specific thrust that the rotors can make [m/s^2].
    """
    rate = push.rate + period * change
    free = push.value + period * push.rate + 0.5 * period * period * change
    lower, upper = LEAST * gravity, MOST * most
    held = where(free > upper, minimum(rate, 0.0), where(free < lower, maximum(rate, 0.0), rate))
    return Push(clip(free, lower, upper), held)


def turning(measured: Measured, axis: Vector, reference: Reference, stiffness: Number, damping: Number) -> Number:
    """Angular acceleration about body z [rad/s^2] that turns the heading to the wanted one; the third axis stays."""
    zero = vector(0.0, 0.0, 0.0)
    wanted = desired_attitude(axis, zero, zero, reference.yaw, 0.0).rotation
    across = rotation_matrix(measured.attitude).T @ wanted
    error = 0.5 * (across[1, 0] - across[0, 1])
    return stiffness * error + damping * (axis[2] * reference.yaw_rate - measured.rates[2])


def driving(
    push: Push, snap: Vector, measured: Measured, reference: Reference, gains: ExtendedGains, period: Number
) -> Driving:
    """What a wanted snap [m/s^4] makes of the extended thrust, with the heading turned to the wanted one."""
    asked = inputs(measured, push, snap)
    axis = up_axis(rotation_matrix(measured.attitude))
    around = turning(measured, axis, reference, gains.heading, gains.turning)
    return Driving(
        thrust=gains.mass * push.value,
        torque=torque_for(vector(asked.about_x, asked.about_y, around), measured, gains),
        push=driven(push, asked.push, gains.gravity, gains.most_thrust / gains.mass, period),
    )


class ThrustExtendedGains(NamedTuple):
    """The vehicle parameters that the controller assumes; gains of each error, in x, y, z."""

    mass: Number = believed("mass")
    inertia: Vector = believed("inertia")
    gravity: Number = given(lambda model: model.gravity)
    most_thrust: Number = given(lambda model: model.most_thrust)
    integral: Vector = gain(
        usual((22.0, 22.0, 2.5), 2), "1/s^2", "gain of the integral of the position error", key="k_0", zero=True
    )
    position: Vector = gain(usual((1.5, 1.5, 4.0), 1), "1/s", "gain of e1, of position", key="k_1")
    velocity: Vector = gain(usual((1.8, 1.8, 8.0), 1), "1/s", "gain of e2, of velocity", key="k_2")
    force: Vector = gain(usual((1.7, 1.7, 12.0), 1), "1/s", "gain of e3, of the specific force", key="k_3")
    force_rate: Vector = gain(usual((23.0, 23.0, 20.0), 1), "1/s", "gain of e4, of the rate of the specific force", key="k_4")
    coupling: Number = gain(usual(1.0, 2), "1/s^2", "weight of each error against the next; the papers' is 1", key="c")
    integral_bound: Number = gain(5.0, "m s", "bound on the integral of the position error")
    heading: Number = gain(usual(30.0, 2, "yaw"), "1/s^2", "stiffness of the heading", key="k_psi")
    turning: Number = gain(usual(10.0, 1, "yaw"), "1/s", "damping of the heading", key="k_r")


class ThrustExtendedMemory(NamedTuple):
    """push: the extended thrust. integral: of the position error [m s]."""

    push: Push
    integral: Vector


class BacksteppingErrors(NamedTuple):
    """e1 [m], e2 [m/s], e3 [m/s^2], e4 [m/s^3], and the snap that they ask for [m/s^4]."""

    position: Vector
    velocity: Vector
    force: Vector
    force_rate: Vector
    snap: Vector


def backstepped(
    gains: ThrustExtendedGains, integral: Vector, measured: Measured, reference: Reference, force: Vector, force_rate: Vector
) -> BacksteppingErrors:
    """The errors, each of what the one before it asks for, and the snap. The rates of an error follow from the errors:

    e1' = e2 - k_1 e1 - k_0 e0,    e2' = e3 - c e1 - k_2 e2,    e3' = e4 - c e2 - k_3 e3.
    """
    k_0, k_1, k_2, k_3, k_4 = gains.integral, gains.position, gains.velocity, gains.force, gains.force_rate
    c = gains.coupling
    e1 = measured.position - reference.position
    e1_d = measured.velocity - reference.velocity
    e2 = e1_d + k_1 * e1 + k_0 * integral
    wanted_rate = reference.acceleration - k_1 * e1_d - k_0 * e1  # of the wanted velocity
    e3 = force - (vector(0.0, 0.0, gains.gravity) + wanted_rate - c * e1 - k_2 * e2)
    e2_d = e3 - c * e1 - k_2 * e2
    e1_dd = e2_d - k_1 * e1_d - k_0 * e1
    wanted_jerk = reference.jerk - k_1 * e1_dd - k_0 * e1_d
    desired_force_rate = wanted_jerk - c * e1_d - k_2 * e2_d
    e4 = force_rate - (desired_force_rate - c * e2 - k_3 * e3)
    e3_d = e4 - c * e2 - k_3 * e3
    e2_dd = e3_d - c * e1_d - k_2 * e2_d
    e1_ddd = e2_dd - k_1 * e1_dd - k_0 * e1_d
    wanted_snap = reference.snap - k_1 * e1_ddd - k_0 * e1_dd
    wanted_change = wanted_snap - c * e1_dd - k_2 * e2_dd
    return BacksteppingErrors(e1, e2, e3, e4, wanted_change - c * e2_d - k_3 * e3_d - c * e3 - k_4 * e4)


@dataclass(frozen=True)
class ThrustExtendedBackstepping(Controller):
    """Position and attitude in one, at the attitude loop's rate."""

    name = "thrust-extended-backstepping"
    label = "backstepping through the thrust's rate"
    source = "Mahony, Hamel, Dzul 1999; Mahony, Hamel 2005"
    Gains = ThrustExtendedGains

    def start(self, measured: Measured, gains: ThrustExtendedGains) -> ThrustExtendedMemory:
        return ThrustExtendedMemory(Push(gains.gravity, 0.0), vector(0.0, 0.0, 0.0))

    def law(
        self, memory: ThrustExtendedMemory, measured: Measured, reference: Reference,
        gains: ThrustExtendedGains, t: Number, period: Number,
    ) -> tuple[Command, ThrustExtendedMemory]:  # fmt: skip
        """One sample: the snap that backstepping asks for, and the inputs that make it."""
        now = motion(measured, memory.push)
        errors = backstepped(gains, memory.integral, measured, reference, now.force, now.force_rate)
        made = driving(memory.push, errors.snap, measured, reference, gains, period)
        return Command(made.thrust, made.torque), ThrustExtendedMemory(
            made.push, project(memory.integral + period * errors.position, gains.integral_bound)
        )
