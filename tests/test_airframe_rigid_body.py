"""The rigid body on quaternions: against the Lagrange form, against rotation matrices about the centre of gravity, and its
invariants."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from quadstep.engines.loop import runge_kutta_4
from quadstep.interfaces.plant import Kinematics
from quadstep.numbers import Matrix, Vector, cos, matrix, sin, vector
from quadstep.numbers.rotations import rotation_matrix
from quadstep.vehicle.paper import Disturbance, State, Vehicle, derivative, euler_rate_matrix
from quadstep.vehicle.rigid_body import MassProperties, Motion, motion_rate, renormalised
from tests.airframes import NOTHING, at, attitude_matrix, momenta
from tests.flights import array, column
from tests.rotations import papers_rotation

GRAVITY = 9.81
CALM = Disturbance(0.0, NOTHING, NOTHING)


def diagonal(inertia):
    x, y, z = inertia
    return matrix((x, 0.0, 0.0), (0.0, y, 0.0), (0.0, 0.0, z))


def body_rate(properties, motion, force, torque, spin=NOTHING, gravity=GRAVITY):
    return motion_rate(properties, rotation_matrix(motion.attitude), motion, force, torque, spin, gravity)


# Against the Lagrange form: many flights at once, each number a column of an array.

FLIGHTS, STEP = 40, 0.002


def random_inertias(rng, count):
    """Principal inertias from random masses, so that they keep the triangle inequality."""
    a, b, c = rng.uniform(0.5, 3.0, (3, count))
    return Vector((b + c, c + a, a + b))


def papers_quaternion(attitude):
    """Of R = Rx(-phi) Ry(-theta) Rz(-psi), by multiplying half angles out."""
    (cz, cy, cx), (sz, sy, sx) = ([f(-0.5 * angle) for angle in attitude] for f in (cos, sin))
    return vector(
        cx * cy * cz - sx * sy * sz, sx * cy * cz + cx * sy * sz, cx * sy * cz - sx * cy * sz, cx * cy * sz + sx * sy * cz
    )


def apart(kinematics, inertia, seconds=1.0, seed=5):
    """Largest difference in position and in attitude of two plants under the same thrust and torque, held for 0.2 s each.

    Only of flights that stay away from theta = +-90 degrees.
    """
    rng = np.random.default_rng(seed)
    mass = rng.uniform(0.5, 3.0, FLIGHTS)
    draw = lambda low, high: Vector(rng.uniform(low, high, (3, FLIGHTS)))  # noqa: E731
    euler = State(draw(-5, 5), draw(-3, 3), draw(-0.8, 0.8), draw(-1, 1))
    lagrange = Vehicle(mass, inertia, GRAVITY, None)
    properties = MassProperties(mass, NOTHING, diagonal(inertia))
    rates = euler_rate_matrix(euler.attitude, Kinematics.RIGID) @ euler.rates
    motion = Motion(euler.position, euler.velocity, papers_quaternion(euler.attitude), rates)
    steepest = np.zeros(FLIGHTS)
    for tick in range(round(seconds / STEP)):
        if tick % 100 == 0:
            thrust, torque = mass * rng.uniform(5.0, 15.0, FLIGHTS), inertia * draw(-2, 2)

        def lagrange_rate(now, u=thrust, tau=torque):
            generalised = euler_rate_matrix(now.attitude, Kinematics.RIGID).T @ tau
            return derivative(lagrange, CALM, kinematics, now, u, generalised)

        def quaternion_rate(now, u=thrust, tau=torque):
            return body_rate(properties, now, vector(0.0, 0.0, u), tau)

        euler = runge_kutta_4(lagrange_rate, euler, STEP)
        motion = renormalised(runge_kutta_4(quaternion_rate, motion, STEP))
        steepest = np.maximum(steepest, np.abs(euler.attitude[1]))
    calm = steepest < 1.3
    assert calm.sum() >= FLIGHTS // 2
    positions = np.array([*(euler.position - motion.position)])
    attitudes = [
        np.abs(papers_rotation([angle[i] for angle in euler.attitude]) - attitude_matrix(one(motion, i))).max()
        for i in np.flatnonzero(calm)
    ]
    return np.abs(positions[:, calm]).max(), max(attitudes)


def one(motion, flight):
    return Motion(*(Vector(float(np.broadcast_to(part, FLIGHTS)[flight]) for part in vector) for vector in motion))


def test_quaternion_and_lagrange_plant_agree_for_unequal_inertias():
    assert max(apart(Kinematics.RIGID, random_inertias(np.random.default_rng(1), FLIGHTS))) < 1e-9


def test_quaternion_and_lagrange_plant_agree_for_the_papers_equal_inertias_with_standard_kinematics():
    equal = Vector([np.full(FLIGHTS, 5.0)] * 3)
    assert max(apart(Kinematics.STANDARD, equal)) < 1e-9


@pytest.mark.parametrize("kinematics", [Kinematics.STANDARD, Kinematics.PRINTED])
def test_with_unequal_inertias_no_other_kinematics_agree(kinematics):
    assert min(apart(kinematics, random_inertias(np.random.default_rng(1), FLIGHTS), seconds=0.4)) > 1e-3


# Against Newton and Euler about the centre of gravity, on rotation matrices.

INERTIA = np.array([[0.020, 0.001, -0.002], [0.001, 0.041, 0.003], [-0.002, 0.003, 0.030]])
MASS = 1.3


def skewed(a):
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def reference(offset, start, force, torque, spin, seconds):
    """Position of the origin and R after a flight, from the motion of the centre of gravity and R_dot = R [omega]x."""
    c, r0, omega0 = np.array(offset), attitude_matrix(start), array(start.rates)

    def rate(t, y):
        velocity, r, omega = y[3:6], y[6:15].reshape(3, 3), y[15:]
        push, turn = force(t), torque(t)
        about_centre = turn - np.cross(c, push)
        omega_dot = np.linalg.solve(INERTIA, about_centre - np.cross(omega, INERTIA @ omega + spin))
        return np.concatenate([velocity, r @ push / MASS - [0, 0, GRAVITY], (r @ skewed(omega)).ravel(), omega_dot])

    centre = array(start.position) + r0 @ c
    velocity = array(start.velocity) + r0 @ np.cross(omega0, c)
    y0 = np.concatenate([centre, velocity, r0.ravel(), omega0])
    solved = solve_ivp(rate, (0, seconds), y0, "DOP853", rtol=1e-12, atol=1e-13)
    final = solved.y[:, -1]
    r = final[6:15].reshape(3, 3)
    return final[:3] - r @ c, r, final[15:]


@pytest.mark.parametrize("offset", [(0.0, 0.0, 0.0), (0.05, -0.03, 0.08)])
def test_a_body_tumbles_through_plus_and_minus_90_degrees_and_inverted(offset):
    start = at((1, 2, 3), (1, -1, 2), (0.8, 0.0, 0.0, 0.6), (0.1, 4.0, -0.2)).motion
    push, turn, spin = np.array([0.4, -0.6, 9.0]), np.array([0.002, 0.03, -0.004]), np.array([0.001, -0.002, 0.003])
    turn = turn + np.cross(offset, push)
    properties = MassProperties(MASS, column(offset), Matrix(column(row) for row in INERTIA))
    motion, up, pitch = start, [], []
    for tick in range(3000):
        if tick == 1500:
            turn = -turn
        motion = renormalised(
            runge_kutta_4(
                lambda now, tau=turn: body_rate(properties, now, column(push), column(tau), column(spin)), motion, 1e-3
            )
        )
        if tick == 1499:
            middle = motion
        r = attitude_matrix(motion)
        up.append(r[2, 2])
        pitch.append(-r[2, 0])
    assert max(pitch) > 0.99
    assert min(pitch) < -0.99
    assert min(up) < -0.95
    for begin, torque, end in [(start, -turn, middle), (middle, turn, motion)]:
        place, r, omega = reference(offset, begin, lambda t: push, lambda t, tau=torque: tau, spin, 1.5)
        np.testing.assert_allclose(array(end.position), place, atol=1e-9)
        np.testing.assert_allclose(attitude_matrix(end), r, atol=1e-9)
        np.testing.assert_allclose(array(end.rates), omega, atol=1e-8)


@pytest.mark.parametrize("offset", [(0.0, 0.0, 0.0), (0.05, -0.03, 0.08)])
def test_a_free_body_keeps_energy_and_momentum(offset):
    properties = MassProperties(MASS, column(offset), Matrix(column(row) for row in INERTIA))
    start = motion = at((0, 0, 50), (1, 2, 3), (0.5, 0.5, -0.5, 0.5), (3.0, -4.0, 2.0)).motion
    for _ in range(2000):
        motion = renormalised(runge_kutta_4(lambda now: body_rate(properties, now, NOTHING, NOTHING), motion, 1e-3))
    before, after = momenta(properties, start), momenta(properties, motion)
    height = [(array(m.position) + attitude_matrix(m) @ offset)[2] for m in (start, motion)]
    np.testing.assert_allclose(after[0], before[0] - [0, 0, MASS * GRAVITY * 2.0], rtol=1e-10)
    np.testing.assert_allclose(after[1], before[1], rtol=1e-9, atol=1e-10)
    assert after[2] + MASS * GRAVITY * height[1] == pytest.approx(before[2] + MASS * GRAVITY * height[0], rel=1e-10)
    assert np.abs(attitude_matrix(motion) - attitude_matrix(start)).max() > 0.3


def test_renormalising_makes_the_quaternion_one_long_and_leaves_all_else():
    state = at((1, 2, 3), (4, 5, 6), (1.2, 0.3, -0.4, 0.5), (1, 2, 3), (10, 20, 30, 40), 5.0)
    got = renormalised(state)
    assert got.attitude.norm() == pytest.approx(1.0, abs=1e-15)
    np.testing.assert_allclose(array(got.attitude) / got.attitude[0], array(state.attitude) / 1.2)
    assert got._replace(attitude=state.attitude) == state


def test_a_state_of_any_shape_is_integrated():
    state = at(position=(1, 0, 0), speeds=(1, 2, 3, 4), charge=2.0)

    def rate(now):
        return now._replace(
            position=now.velocity, velocity=-now.position, attitude=0.0 * now.attitude, rates=now.rates,
            speeds=-now.speeds, charge=-0.5 * now.charge,
        )  # fmt: skip

    for _ in range(100):
        state = runge_kutta_4(rate, state, 0.01)
    np.testing.assert_allclose(array(state.position), [np.cos(1), 0, 0], atol=1e-9)
    np.testing.assert_allclose(array(state.speeds), np.exp(-1) * np.arange(1, 5), rtol=1e-9)
    assert state.charge == pytest.approx(2 * np.exp(-0.5), rel=1e-10)
