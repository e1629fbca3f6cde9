"""Thrust vectoring: what laws share that turn the whole vehicle so that its thrust points along a wanted force.

    m v_dot = f R e3 - m g e3,    J Omega_dot = tau - Omega x J Omega

Position stiffness and damping ask for an acceleration, mass and gravity make a force of it, the attitude follows the force:
which thrust and attitude make it (kinematic inversion, Eq. 40 to Eq. 52), and what keeps it within bounds.
"""

from typing import NamedTuple, Protocol

from quadstep.interfaces.controller import Measured
from quadstep.interfaces.gain import believed, gain, given, usual
from quadstep.interfaces.plant import Reference
from quadstep.numbers import (
    Condition,
    Matrix,
    Number,
    Vector,
    absolute,
    atan2,
    clip,
    cos,
    either,
    exp,
    sin,
    sqrt,
    total,
    vector,
    where,
)
from quadstep.numbers.rotations import cross, quaternion_of, rotation_matrix, yaw_pitch_roll
from quadstep.numbers.scan import shortcut


class DesiredAttitude(NamedTuple):
    """rotation: R_c, body to world, shape (3, 3). rates: Omega_c [rad/s], acceleration: Omega_c_dot [rad/s^2], both in its
    own axes.
    """

    rotation: Matrix
    rates: Vector
    acceleration: Vector

    @property
    def angles(self) -> Vector:
        """Yaw, pitch and roll, as a command tells them [rad]."""
        return yaw_pitch_roll(quaternion_of(self.rotation))


class PositionIntegral(NamedTuple):
    """All that several laws remember. integral: of the position error, world axes [m s]."""

    integral: Vector = vector(0.0, 0.0, 0.0)


class Direction(NamedTuple):
    """A unit vector with its first and second rate."""

    value: Vector
    rate: Vector
    change: Vector


def direction(v: Vector, rate: Vector, change: Vector) -> Direction:
    """v / |v| and its rates, from those of v; straight up for no force at all."""
    length = v.norm()
    some = length > 1e-6
    over = 1.0 / where(some, length, 1.0)
    unit = either(some, over * v, vector(0.0, 0.0, 1.0))
    growth = unit @ rate
    unit_rate = over * (rate - growth * unit)
    unit_change = over * (change - (2.0 * growth) * unit_rate - (unit @ change + unit_rate @ rate) * unit)
    return Direction(unit, unit_rate, unit_change)


def crossed(a: Direction, b: Direction) -> tuple[Vector, Vector, Vector]:
    """a x b with its first and second rate."""
    bend = cross(a.change, b.value) + 2.0 * cross(a.rate, b.rate) + cross(a.value, b.change)
    return cross(a.value, b.value), cross(a.rate, b.value) + cross(a.value, b.rate), bend


def desired_attitude(force: Vector, rate: Vector, change: Vector, yaw: Number, yaw_rate: Number) -> DesiredAttitude:
    """The attitude whose third axis is along `force` [N] and whose first is nearest the heading `yaw` [rad].

    rate, change: of the force [N/s, N/s^2]. Lee, Leok, McClamroch (2010), Eqs 22 and 23. Undefined for a level force along
    the heading.
    """
    third = direction(force, rate, change)
    s, c = sin(yaw), cos(yaw)
    ahead = Direction(vector(c, s, 0.0), yaw_rate * vector(-s, c, 0.0), -(yaw_rate * yaw_rate) * vector(c, s, 0.0))
    second = direction(*crossed(third, ahead))
    first = Direction(*crossed(second, third))
    rotation = Matrix([axis.value for axis in (first, second, third)]).T
    # Omega_c from R_c^T R_c_dot = hat(Omega_c); its rate from R_c^T R_c_dd = hat(Omega_c_dot) + hat(Omega_c)^2
    rates = vector(third.value @ second.rate, first.value @ third.rate, second.value @ first.rate)
    p, q, r = rates
    acceleration = vector(
        third.value @ second.change - q * r, first.value @ third.change - p * r, second.value @ first.change - p * q
    )
    return DesiredAttitude(rotation, rates, acceleration)


def turning_attitude(force: Vector, reference: Reference) -> tuple[Vector, Number]:
    """The attitude for a force [N] that stands still while the path's heading turns: unit quaternion, and how fast it turns
    about its third axis [rad/s], all that is left of `desired_attitude`'s rates then.
    """
    rotation = desired_attitude(force, ZERO, ZERO, reference.yaw, 0.0).rotation
    x, y, z = up_axis(rotation)
    along = x * cos(reference.yaw) + y * sin(reference.yaw)
    return quaternion_of(rotation), reference.yaw_rate * z / (1.0 - along * along)


def up_axis(rotation: Matrix) -> Vector:
    """b3, the direction of the thrust in world axes."""
    return Vector(row[2] for row in rotation)


def within(force: Vector, most: Number) -> Vector:
    """The force at a length of at most `most` [N], pointing up; height goes before the way sideways."""
    x, y, z = force
    lift = clip(z, 0.1 * most, 0.95 * most)
    room = sqrt(most * most - lift * lift)
    sideways = shrink(sqrt(x * x + y * y), room)
    return vector(sideways * x, sideways * y, lift)


def tilted_within(force: Vector, most: Number) -> Vector:
    """A force that points up, tilted from the vertical by at most `most` [rad]; its height stays. 1.5 and more: no limit on
    what `within` returns.
    """
    x, y, z = force
    sideways = where(most < 1.5, shrink(sqrt(x * x + y * y), z * sin(most) / cos(most)), 1.0)
    return vector(sideways * x, sideways * y, z)


def invert_force(force: Vector) -> tuple[Number, Number, Number]:
    """(u_d [N], theta_d [rad], phi_d [rad]) with u_d (-sin theta_d, cos theta_d sin phi_d, cos theta_d cos phi_d) = force.

    `force` is F_d_hat [N], inertial. Eq. 52 prints atan(f_y / f_z), the wrong branch for f_z < 0; atan2 flies inverted too.
    theta_d lies in [-pi/2, pi/2], phi_d in (-pi, pi]. Where the force leaves an angle free it is zero: phi_d for a force
    along x, both for no force at all.
    """
    f_x, f_y, f_z = force
    b = sqrt(f_y * f_y + f_z * f_z)  # Eq. 45
    u_d = sqrt(f_x * f_x + b * b)  # Eq. 48
    theta_d = where(u_d > 0.0, atan2(-f_x, b), 0.0)  # Eq. 43, Eq. 50
    phi_d = where(b > 0.0, atan2(f_y, f_z), 0.0)  # Eq. 52
    return u_d, theta_d, phi_d


def project(entries: Vector, bound: Number) -> Vector:
    """The nearest vector of length at most `bound`."""
    return shortcut(entries, lambda them: (clearly(them @ them, bound), them), lambda them: shrink(them.norm(), bound) * them)


def integral_for(part: Vector, gain: Vector, bound: Number) -> Vector:
    """The integral, within its bound, that adds `part` to a law with this gain; 0 along axes whose gain is 0."""
    return project(Vector(where(k > 0.0, one / where(k > 0.0, k, 1.0), 0.0) for one, k in zip(part, gain, strict=True)), bound)


def project_weights(weights: Matrix, bound: Number) -> Matrix:
    """The nearest matrix of Frobenius norm at most `bound`."""
    return shortcut(
        weights,
        lambda them: (clearly(total(one * one for row in them.rows for one in row), bound), them),
        lambda them: shrink(them.norm(), bound) * them,
    )


def clearly(square: Number, bound: Number) -> Condition:
    """Whether a length, whose square this is, is below `bound` by more than its rounding."""
    return square < 0.999 * (bound * absolute(bound))


def shrink(length: Number, bound: Number) -> Number:
    """The factor, at most 1, that brings `length` down to `bound`."""
    long = length > bound
    return where(long, bound / where(long, length, 1.0), 1.0)


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


def turning_errors(wanted: DesiredAttitude, rotation: Matrix, rates: Vector) -> TurningErrors:
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


def attitude_for(force: Vector, reference: Reference, mass: Number) -> DesiredAttitude:
    """The attitude that points the thrust along a force [N]; it turns as the path's jerk and snap ask, whatever the errors."""
    return desired_attitude(force, mass * reference.jerk, mass * reference.snap, reference.yaw, reference.yaw_rate)


def errors_to(wanted: DesiredAttitude, measured: Measured) -> TurningErrors:
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
    return left / body.inertia


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


def boxed(entries: Vector, bound: Number | Vector) -> Vector:
    """Every entry between -bound and bound, or its own."""
    bounds = bound if isinstance(bound, Vector) else [bound] * len(entries)
    return Vector(clip(entry, -most, most) for entry, most in zip(entries, bounds, strict=True))


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
