"""Backstepping in state space: Madani and Benallegue (2006), the paper's [5].

Three subsystems: height and heading, each with an input of its own; and the level position, whose acceleration s h is made by
leaning, s the specific thrust and h the level part of the thrust's direction. With gains A_i, and e0 the integral of e1,

    e1 = p_d - p,  e2 = v_1 - v,  e3 = a_1 - s h,  e4 = w_1 - w

are the errors of what each step asks for, w = (p, q) the rates of roll and pitch, and V = 1/2 sum W_i |e_i|^2 falls at
sum W_i A_i |e_i|^2. The ratios of weights are W_1 / W_2 = W_2 / W_3 = c_2 and W_3 / W_4 = c_4 / g^2, W_1 = 1: with the
paper's, 1, the errors would drive each other at 1 and at g rad/s, however slow the vehicle. The rate of w_1 is its difference
along the motion that the model predicts from one sample to the next.
"""

from dataclasses import dataclass
from typing import NamedTuple

from quadstep.control.thrust_extended_backstepping import turning
from quadstep.control.vectoring import PositionIntegral, project, torque_for, up_axis
from quadstep.interfaces.controller import Command, Controller, Measured
from quadstep.interfaces.gain import believed, gain, given, usual
from quadstep.interfaces.plant import Reference
from quadstep.numbers import Matrix, Number, Vector, clip, maximum, vector
from quadstep.numbers.rotations import from_rotation_vector, multiply, rotation_matrix

LEAST = 0.2
"""Share of gravity below which the specific thrust is not taken, and cosine of the tilt that is not divided by less."""


class StateSpaceGains(NamedTuple):
    """The vehicle parameters that the controller assumes; gains of each step, level and upward."""

    mass: Number = believed("mass")
    inertia: Vector = believed("inertia")
    gravity: Number = given(lambda model: model.gravity)
    most_thrust: Number = given(lambda model: model.most_thrust)
    integral: Vector = gain(usual(7.6, 2), "1/s^2", "gain of the integral of the position error", key="A_0", zero=True)
    position: Vector = gain(usual(2.75, 1), "1/s", "gain of e1, of position", key="A_1")
    velocity: Vector = gain(usual(2.57, 1), "1/s", "gain of e2, of velocity", key="A_2")
    lean: Number = gain(usual(4.48, 1), "1/s", "gain of e3, of the horizontal acceleration", key="A_3")
    rate: Number = gain(usual(5.65, 1), "1/s", "gain of e4, of the roll and pitch rates", key="A_4")
    share: Number = gain(usual(1.0, 2), "1/s^2", "weight of e1 against e2, and of e2 against e3; the paper's is 1", key="c_2")
    coupling: Number = gain(usual(7.5, 2), "1/s^2", "weight of e3 against e4, times g^2; the paper's is 1", key="c_4")
    integral_bound: Number = gain(5.0, "m s", "bound on the integral of the position error")
    heading: Number = gain(usual(30.0, 2, "yaw"), "1/s^2", "stiffness of the heading", key="k_psi")
    turning: Number = gain(usual(10.0, 1, "yaw"), "1/s", "damping of the heading", key="k_r")


class Climb(NamedTuple):
    """Specific thrust s [m/s^2] and its rate [m/s^3]."""

    push: Number
    rate: Number


class Steps(NamedTuple):
    """e1 to e3 along x, y, z (e3 level only), and w_1: the rates of roll and pitch asked for."""

    e1: Vector
    e2: Vector
    e3: Vector
    w_1: Vector


def wanted_acceleration(gains: StateSpaceGains, integral: Vector, measured: Measured, reference: Reference) -> Vector:
    """a_1 = c_2 e1 + v_1' + A_2 e2 [m/s^2], where v_1 = v_d + A_1 e1 + A_0 e0."""
    e1 = reference.position - measured.position
    e1_d = reference.velocity - measured.velocity
    e2 = e1_d + gains.position * e1 + gains.integral * integral
    return gains.share * e1 + reference.acceleration + gains.position * e1_d + gains.integral * e1 + gains.velocity * e2


def acceleration_rate(gains: StateSpaceGains, measured: Measured, reference: Reference, made: Vector) -> Vector:
    """Rate of a_1 [m/s^3] while the vehicle accelerates as `made` [m/s^2]."""
    e1 = reference.position - measured.position
    e1_d = reference.velocity - measured.velocity
    e1_dd = reference.acceleration - made
    e2_d = e1_dd + gains.position * e1_d + gains.integral * e1
    return gains.share * e1_d + reference.jerk + gains.position * e1_dd + gains.integral * e1_d + gains.velocity * e2_d


def climb(gains: StateSpaceGains, measured: Measured, wanted: Number, change: Number, rotation: Matrix) -> Climb:
    """s = (g + a_z) / R_33, and its rate while a_z changes at `change` and the vehicle turns as it does."""
    p, q, _ = measured.rates
    cosine = maximum(rotation[2, 2], LEAST)
    push = clip((gains.gravity + wanted) / cosine, LEAST * gains.gravity, gains.most_thrust / gains.mass)
    return Climb(push, (change - push * (q * rotation[2, 0] - p * rotation[2, 1])) / cosine)


def steps(gains: StateSpaceGains, integral: Vector, measured: Measured, reference: Reference) -> tuple[Steps, Climb]:
    """The errors of the first three steps, the rates that the third asks for, and the thrust.

    h' = J w with J = [[-R_12, R_11], [-R_22, R_21]], whose determinant is R_33.
    """
    rotation = rotation_matrix(measured.attitude)
    lean = up_axis(rotation)
    a_1 = wanted_acceleration(gains, integral, measured, reference)
    rough = climb(gains, measured, a_1[2], 0.0, rotation)
    made = rough.push * lean - vector(0.0, 0.0, gains.gravity)
    a_1_d = acceleration_rate(gains, measured, reference, made)
    thrust = climb(gains, measured, a_1[2], a_1_d[2], rotation)

    e1 = reference.position - measured.position
    e2 = reference.velocity - measured.velocity + gains.position * e1 + gains.integral * integral
    level = vector(lean[0], lean[1])
    e3 = vector(a_1[0], a_1[1]) - thrust.push * level
    asked = vector(a_1_d[0], a_1_d[1]) + gains.share * vector(e2[0], e2[1]) + gains.lean * e3 - thrust.rate * level
    (x, y), over = asked, 1.0 / (thrust.push * maximum(rotation[2, 2], LEAST))
    w_1 = over * vector(rotation[1, 0] * x - rotation[0, 0] * y, rotation[1, 1] * x - rotation[0, 1] * y)
    return Steps(e1, e2, e3, w_1), thrust


def coupled(measured: Measured, push: Number, e3: Vector) -> Vector:
    """s J^T e3: what makes e3' and e4' cancel in V'."""
    rotation = rotation_matrix(measured.attitude)
    return push * vector(-rotation[0, 1] * e3[0] - rotation[1, 1] * e3[1], rotation[0, 0] * e3[0] + rotation[1, 0] * e3[1])


def predicted(measured: Measured, push: Number, gravity: Number, period: Number) -> Measured:
    """The motion one period [s] later under this specific thrust [m/s^2], at the same body rates."""
    made = push * up_axis(rotation_matrix(measured.attitude)) - vector(0.0, 0.0, gravity)
    return measured._replace(
        position=measured.position + period * measured.velocity,
        velocity=measured.velocity + period * made,
        attitude=multiply(measured.attitude, from_rotation_vector(period * measured.rates)),
    )


def following(reference: Reference, period: Number) -> Reference:
    """The wanted motion one period [s] later, as its rates now say."""
    return reference._replace(
        position=reference.position + period * reference.velocity,
        velocity=reference.velocity + period * reference.acceleration,
        acceleration=reference.acceleration + period * reference.jerk,
        jerk=reference.jerk + period * reference.snap,
    )


def with_own_share(rotation: Matrix, asked: Vector) -> Vector:
    """w' [rad/s^2] from w_1' + s J^T e3 + A_4 e4 with w held in w_1'.

    Thrust makes up for tilt, so its rate, and with it w_1, depends on w: d w_1 / d w = -g g^T / R_33^2, g = (R_32, -R_31), and
    (1 + g g^T / R_33^2)^-1 = 1 - g g^T.
    """
    g = vector(rotation[2, 1], -rotation[2, 0])
    return asked - (g @ asked) * g


@dataclass(frozen=True)
class StateSpaceBackstepping(Controller):
    """Position and attitude in one, at the attitude loop's rate."""

    name = "state-space-backstepping"
    label = "backstepping in state space"
    source = "Madani, Benallegue 2006"
    Gains = StateSpaceGains

    def start(self, measured: Measured, gains: StateSpaceGains) -> PositionIntegral:
        return PositionIntegral()

    def law(
        self, memory: PositionIntegral, measured: Measured, reference: Reference, gains: StateSpaceGains,
        t: Number, period: Number,
    ) -> tuple[Command, PositionIntegral]:  # fmt: skip
        found, thrust = steps(gains, memory.integral, measured, reference)
        later = predicted(measured, thrust.push, gains.gravity, period)
        ahead, _ = steps(gains, memory.integral + period * found.e1, later, following(reference, period))
        coupling = gains.coupling / (gains.gravity * gains.gravity)
        e4 = found.w_1 - vector(measured.rates[0], measured.rates[1])
        asked = (ahead.w_1 - found.w_1) / period + coupling * coupled(measured, thrust.push, found.e3) + gains.rate * e4
        leaning = with_own_share(rotation_matrix(measured.attitude), asked)
        axis = up_axis(rotation_matrix(measured.attitude))
        angular = vector(leaning[0], leaning[1], turning(measured, axis, reference, gains.heading, gains.turning))
        command = Command(
            thrust=gains.mass * thrust.push,
            torque=torque_for(angular, measured, gains),
            r1=found.e2,
            r2=vector(e4[0], e4[1], axis[2] * reference.yaw_rate - measured.rates[2]),
        )
        return command, PositionIntegral(project(memory.integral + period * found.e1, gains.integral_bound))
