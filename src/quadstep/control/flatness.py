"""Differential flatness with rotor drag: Faessler, Franchi, Scaramuzza, "Differential flatness of quadrotor dynamics subject
to rotor drag for accurate tracking of high-speed trajectories" (2018).

    v_dot = -g z_W + c z_B - R D R^T v,     D = diag(d_x, d_y, d_z)

Position, heading and their rates decide attitude, thrust c and body rates of a vehicle with such drag. The law feeds these
forward, asks for an acceleration back to the path, and leaves the body rates to the shared rate loop. Two things differ from
the paper: the feedback has an integral, as other laws have (0 takes it away), and the thrust gained by moving across the air
goes with the square of the speed across, v_x^2 + v_y^2, not of v_x + v_y.
"""

from dataclasses import dataclass
from typing import NamedTuple

from quadstep.control.vectoring import ZERO, project, up_axis, within
from quadstep.interfaces.controller import BodyRates, Controller, Measured
from quadstep.interfaces.gain import BELIEF, believed, gain, given, usual
from quadstep.interfaces.plant import Reference
from quadstep.numbers import Matrix, Number, Vector, absolute, cos, maximum, sin, vector, where
from quadstep.numbers.rotations import (
    conjugate,
    cross,
    multiply,
    quaternion_of,
    rotation_matrix,
    rotation_vector,
    yaw_pitch_roll,
)

UP = vector(0.0, 0.0, 1.0)


class FlatnessGains(NamedTuple):
    """Assumed vehicle parameters, and its gains: over mass in x, y, z, of attitude about body x, y, z."""

    mass: Number = believed("mass")
    gravity: Number = given(lambda model: model.gravity)
    most_thrust: Number = given(lambda model: model.most_thrust)
    drag: Vector = gain(
        lambda model: tuple(model.drag), "1/s", "rotor drag along body x, y, z over mass; default: the vehicle's",
        symbol="D", zero=True, tunable=False, group=BELIEF,
    )  # fmt: skip
    lift: Number = gain(
        lambda model: model.lift, "1/m", "thrust gained by moving across the air, over mass; default: the vehicle's",
        symbol="k_h", zero=True, tunable=False, group=BELIEF,
    )  # fmt: skip
    stiffness: Vector = gain(usual(14.35, 2), "1/s^2", "stiffness of position, over mass", key="k_x")
    damping: Vector = gain(usual(6.6, 1), "1/s", "damping of position, over mass", key="k_v")
    integral: Vector = gain(usual(5.8, 3), "1/s^3", "integral gain of position, over mass", key="k_i", zero=True)
    integral_bound: Number = gain(15.0, "m/s^2", "largest acceleration from the integral", tunable=False)
    attitude: Vector = gain(usual((5.9, 5.9, 5.0), 1, "body"), "1/s", "P gain of attitude")


class FlatnessMemory(NamedTuple):
    """integral: what it adds [m/s^2], world."""

    integral: Vector


class Flat(NamedTuple):
    """What flatness says. rotation: R, shape (3, 3). rates: about the body's axes [rad/s]."""

    rotation: Matrix
    rates: Vector


def flat(reference: Reference, drag: Vector, gravity: Number) -> Flat:
    """Attitude and body rates of a vehicle with rotor drag that flies a path exactly."""
    velocity, acceleration, jerk = reference.velocity, reference.acceleration, reference.jerk
    d_x, d_y, d_z = drag
    s, c = sin(reference.yaw), cos(reference.yaw)
    x_c, y_c = vector(c, s, 0.0), vector(-s, c, 0.0)
    pushed = acceleration + gravity * UP
    x_b = unit(cross(y_c, pushed + d_x * velocity))
    y_b = unit(cross(pushed + d_y * velocity, x_b))
    z_b = cross(x_b, y_b)
    thrust = z_b @ (pushed + d_z * velocity)
    u, v, w = x_b @ velocity, y_b @ velocity, z_b @ velocity
    b_1, c_1, e_1 = thrust - (d_z - d_x) * w, -(d_x - d_y) * v, x_b @ jerk + d_x * (x_b @ acceleration)
    a_2, c_2, e_2 = thrust + (d_y - d_z) * w, (d_x - d_y) * u, -(y_b @ jerk) - d_y * (y_b @ acceleration)
    b_3, c_3, e_3 = -(y_c @ z_b), cross(y_c, z_b).norm(), reference.yaw_rate * (x_c @ x_b)
    over = away_from_zero(b_1 * c_3 - b_3 * c_1)
    q, r = (c_3 * e_1 - c_1 * e_3) / over, (b_1 * e_3 - b_3 * e_1) / over
    p = (e_2 - c_2 * r) / away_from_zero(a_2)
    return Flat(Matrix([x_b, y_b, z_b]).T, vector(p, q, r))


def unit(v: Vector) -> Vector:
    """v at length one; finite for no length."""
    return v / maximum(v.norm(), 1e-6)


def away_from_zero(x: Number) -> Number:
    """x at a size of at least 0.1."""
    return where(absolute(x) < 0.1, where(x < 0.0, -0.1, 0.1), x)


@dataclass(frozen=True)
class Flatness(Controller):
    """Position and attitude at the rate loop's rate."""

    name = "flatness"
    label = "flatness with rotor drag"
    source = "Faessler, Franchi, Scaramuzza 2018"
    Gains = FlatnessGains
    commands = BodyRates

    def start(self, measured: Measured, gains: FlatnessGains) -> FlatnessMemory:
        return FlatnessMemory(ZERO)

    def law(
        self, memory: FlatnessMemory, measured: Measured, reference: Reference, gains: FlatnessGains, t: Number, period: Number
    ) -> tuple[BodyRates, FlatnessMemory]:
        fed = flat(reference, gains.drag, gains.gravity)
        dragged = fed.rotation @ (gains.drag * (fed.rotation.T @ reference.velocity))
        e, e_dot = reference.position - measured.position, reference.velocity - measured.velocity
        back = gains.stiffness * e + gains.damping * e_dot + memory.integral
        wanted = reference.acceleration + back + dragged + gains.gravity * UP
        force = within(gains.mass * wanted, gains.most_thrust)

        z_b = unit(force)
        y_c = vector(-sin(reference.yaw), cos(reference.yaw), 0.0)
        x_b = unit(cross(y_c, z_b))
        attitude = quaternion_of(Matrix([x_b, cross(z_b, x_b), z_b]).T)
        turn = rotation_vector(multiply(conjugate(measured.attitude), attitude))
        rotation = rotation_matrix(measured.attitude)
        u, v, _ = rotation.T @ measured.velocity
        across = rotation.T @ fed.rotation  # from the path's body axes into the body's
        command = BodyRates(
            thrust=force @ up_axis(rotation) - (gains.mass * gains.lift) * (u * u + v * v),
            rates=gains.attitude * turn + across @ fed.rates,
            desired_attitude=yaw_pitch_roll(attitude),
        )
        return command, FlatnessMemory(project(memory.integral + period * (gains.integral * e), gains.integral_bound))
