"""Thrust vectoring: what laws share that turn the whole vehicle so that its thrust points along a wanted force.

    m v_dot = f R e3 - m g e3,    J Omega_dot = tau - Omega x J Omega

Position stiffness and damping ask for an acceleration, mass and gravity make a force of it, the attitude follows the force.
"""

from typing import NamedTuple, Protocol

from quadstep.control.wanted_attitude import WantedAttitude, up_axis, wanted_attitude, within
from quadstep.interfaces.controller import Measured
from quadstep.interfaces.gain import believed, gain, given, usual
from quadstep.interfaces.reference import Reference
from quadstep.numbers import Matrix, Number, Vector, clip, exp, vector, where
from quadstep.numbers.rotations import cross, rotation_matrix

ZERO = vector(0.0, 0.0, 0.0)


class BelievedBody(NamedTuple):
    """What a law believes of the vehicle. lag: time constant of the rotors [s]."""

    mass: Number = believed("mass")
    inertia: Vector = believed("inertia")
    gravity: Number = given(lambda model: model.gravity)
    most_thrust: Number = given(lambda model: model.most_thrust)
    lag: Number = given(lambda model: model.lag)


class Pull(NamedTuple):
    """Gains of the position loop, over mass."""

    stiffness: Vector = gain(usual(24.0, 2), "1/s^2", "stiffness of position, over mass", key="k_x")
    damping: Vector = gain(usual(7.0, 1), "1/s", "damping of position, over mass", key="k_v")


class Turn(NamedTuple):
    """Gains of the attitude loop, over inertia, about body x, y, z."""

    stiffness: Vector = gain(usual((270.0, 270.0, 70.0), 2, "body"), "1/s^2", "stiffness of attitude, over inertia", key="k_R")
    damping: Vector = gain(usual((30.0, 30.0, 15.0), 1, "rate"), "1/s", "damping of attitude, over inertia", key="k_Omega")


class TurningErrors(NamedTuple):
    """attitude: e_R [-]. rates: e_Omega [rad/s]. feed_forward: the angular acceleration [rad/s^2] that keeps both at zero."""

    attitude: Vector
    rates: Vector
    feed_forward: Vector


def vee_error(wanted: Matrix, rotation: Matrix) -> Vector:
    """e_R = 1/2 vee(R_c^T R - R^T R_c), body axes (Lee 2010, Eq. 10)."""
    e = wanted.T @ rotation
    return 0.5 * vector(e[2, 1] - e[1, 2], e[0, 2] - e[2, 0], e[1, 0] - e[0, 1])


def turning_errors(wanted: WantedAttitude, rotation: Matrix, rates: Vector) -> TurningErrors:
    """The errors of Lee, Leok, McClamroch (2010), Eqs 10 and 11, body axes. rates: of the body [rad/s]."""
    across = rotation.T @ wanted.rotation  # from the wanted body axes into the body's
    turning = across @ wanted.rates
    feed_forward = across @ wanted.acceleration - cross(rates, turning)
    return TurningErrors(vee_error(wanted.rotation, rotation), rates - turning, feed_forward)


def pulled(measured: Measured, reference: Reference, gains: Pull) -> Vector:
    """The acceleration [m/s^2] that is wanted: of the path, and back to it."""
    e, e_dot = reference.position - measured.position, reference.velocity - measured.velocity
    return reference.acceleration + gains.stiffness * e + gains.damping * e_dot


def force_for(acceleration: Vector, body: BelievedBody) -> Vector:
    """The thrust vector [N] for an acceleration [m/s^2], world axes, within the rotors' reach."""
    return within(body.mass * (acceleration + vector(0.0, 0.0, body.gravity)), body.most_thrust)


def attitude_for(force: Vector, reference: Reference, mass: Number) -> WantedAttitude:
    """The attitude that points the thrust along a force [N]; it turns as the path's jerk and snap ask, whatever the errors."""
    return wanted_attitude(force, mass * reference.jerk, mass * reference.snap, reference.yaw, reference.yaw_rate)


def errors_to(wanted: WantedAttitude, measured: Measured) -> TurningErrors:
    """How far a vehicle is from a wanted attitude."""
    return turning_errors(wanted, rotation_matrix(measured.attitude), measured.rates)


def turned(errors: TurningErrors, gains: Turn) -> Vector:
    """The angular acceleration [rad/s^2] that is wanted, about the body's axes."""
    return errors.feed_forward - gains.stiffness * errors.attitude - gains.damping * errors.rates


class Inert(Protocol):
    """Anything that says which inertia a law believes in: diagonal [kg m^2]."""

    @property
    def inertia(self) -> Vector: ...


def torque_for(angular: Vector, measured: Measured, body: Inert) -> Vector:
    """The torque [N m] for an angular acceleration [rad/s^2], about the body's axes."""
    return body.inertia * angular + cross(measured.rates, body.inertia * measured.rates)


def angular_of(torque: Vector, measured: Measured, body: Inert) -> Vector:
    """The angular acceleration [rad/s^2] that a torque [N m] is for, about the body's axes."""
    left = torque - cross(measured.rates, body.inertia * measured.rates)
    return Vector(torque / inertia for torque, inertia in zip(left, body.inertia, strict=True))


class Heavy(Protocol):
    """Anything that says which mass [kg] and gravity [m/s^2] a law believes in."""

    @property
    def mass(self) -> Number: ...

    @property
    def gravity(self) -> Number: ...


def push_against(measured: Measured, reference: Reference, body: Heavy) -> Vector:
    """What the present thrust is for beyond weight and present motion, over mass [m/s^2], world axes: wind, a wrong mass."""
    axis = up_axis(rotation_matrix(measured.attitude))
    return (measured.thrust / body.mass) * axis - vector(0.0, 0.0, body.gravity) - reference.acceleration


def followed(rate: Number, period: Number) -> Number:
    """The share of a step that a low-pass filter of first order with this cut-off [rad/s] follows in a period [s]."""
    return 1.0 - exp(-(rate * period))


def boxed(entries: Vector, bound: Number) -> Vector:
    """Every entry between -bound and bound."""
    return Vector(clip(entry, -bound, bound) for entry in entries)


class AchievedCommand(NamedTuple):
    """What a law believes that the rotors make now: thrust [N], torque [N m] about the body's axes."""

    thrust: Number
    torque: Vector


def at_rest(body: BelievedBody) -> AchievedCommand:
    return AchievedCommand(body.mass * body.gravity, ZERO)


def commanded(measured: Measured) -> AchievedCommand:
    """What the rotors are asked for at present, once it is made."""
    return AchievedCommand(measured.thrust, measured.torque)


def lagged(made: AchievedCommand, measured: Measured, lag: Number, t: Number, period: Number) -> AchievedCommand:
    """At time t [s], a period [s] later, by what the rotors have been asked for since; lag: their time constant [s].

    At t = 0 nothing has been asked for yet.
    """
    share = where(t > 0.0, followed(1.0 / lag, period), 0.0)
    thrust = made.thrust + share * (measured.thrust - made.thrust)
    return AchievedCommand(thrust, made.torque + share * (measured.torque - made.torque))


def of_speeds(speeds: Vector, per_speed: Number, mixing: tuple[Vector, ...]) -> AchievedCommand:
    """Of rotors that turn at `speeds` [rad/s]. per_speed, mixing: as in `Model`."""
    thrust, *torque = (row @ (per_speed * (speeds * speeds)) for row in mixing)
    return AchievedCommand(thrust, Vector(torque))


def accelerations(made: AchievedCommand, measured: Measured, body: BelievedBody) -> tuple[Vector, Vector]:
    """What the rotors and gravity alone would do: acceleration [m/s^2], world; angular acceleration [rad/s^2], body axes."""
    axis = up_axis(rotation_matrix(measured.attitude))
    upward = (made.thrust / body.mass) * axis - vector(0.0, 0.0, body.gravity)
    return upward, angular_of(made.torque, measured, body)
