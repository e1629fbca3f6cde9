"""Backstepping in state space, on a rigid body that is integrated here by rotation matrices alone."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from quadstep.control.state_space_backstepping import StateSpaceBackstepping, predicted, steps
from quadstep.control.vectoring import PositionIntegral
from quadstep.interfaces.controller import Measured
from quadstep.interfaces.plant import Reference
from quadstep.mission.listings import load_preset
from quadstep.numbers import Vector, vector

GRAVITY = 9.81
MODEL = load_preset("research-2.6kg").model()
RNG = np.random.default_rng(11)
KEYS = {
    "A_0": (3.0, 4.0, 5.0), "A_1": (2.0, 2.5, 3.0), "A_2": (3.0, 3.5, 4.5), "A_3": 6.0, "A_4": 9.0, "c_2": 1.7, "c_4": 12.0,
    "integral_bound": 50.0,
}  # fmt: skip
GAINS = StateSpaceBackstepping.gains(MODEL, KEYS)
WEIGHTS = 1.0, 1.0 / 1.7, 1.0 / 1.7**2, GRAVITY**2 / 12.0 / 1.7**2


def reference(t):
    """An orbit whose derivatives are written out here."""
    size, phase, pace = np.array([1.0, 0.8, 0.3]), np.array([0.0, 1.0, 2.0]), 0.7
    turns = [size * pace**n * np.sin(pace * t + phase + n * np.pi / 2.0) for n in range(5)]
    return Reference(*(Vector(one) for one in turns[:3]), 0.4, 0.0, Vector(turns[3]), Vector(turns[4]))


def measured(y):
    x_q, y_q, z_q, w = Rotation.from_matrix(y[6:15].reshape(3, 3)).as_quat()
    return Measured(Vector(y[:3]), Vector(y[3:6]), vector(w, x_q, y_q, z_q), Vector(y[15:18]), 26.0, vector(0.0, 0.0, 0.0))


def array(v):
    return np.array(list(v))


def rate(t, y):
    """Position, velocity, rotation, body rates, e0, under the law sampled all the time."""
    command, _ = StateSpaceBackstepping().law(PositionIntegral(Vector(y[18:21])), measured(y), reference(t), GAINS, t, 1e-6)
    rotation, rates, inertia = y[6:15].reshape(3, 3), y[15:18], array(MODEL.inertia)
    p, q, r = rates
    turn = rotation @ np.array([[0.0, -r, q], [r, 0.0, -p], [-q, p, 0.0]])
    acceleration = command.thrust / MODEL.mass * rotation[:, 2] - [0.0, 0.0, GRAVITY]
    angular = (array(command.torque) - np.cross(rates, inertia * rates)) / inertia
    return np.concatenate([y[3:6], acceleration, turn.ravel(), angular, array(reference(t).position) - y[:3]])


def errors(t, y):
    found, _ = steps(GAINS, Vector(y[18:21]), measured(y), reference(t))
    return array(found.e1), array(found.e2), array(found.e3), array(found.w_1) - y[15:17]


def value(t, y):
    squares = [e @ e for e in errors(t, y)]
    return 0.5 * (np.array(KEYS["A_0"]) @ y[18:21] ** 2 + np.dot(WEIGHTS, squares))


@pytest.fixture
def state():
    def made():
        rotation = Rotation.from_euler("xyz", RNG.uniform(-0.4, 0.4, 3)).as_matrix()
        near = array(reference(0.0).position), array(reference(0.0).velocity)  # where no limit of the thrust is met
        moved = [one + 0.1 * RNG.normal(size=3) for one in near]
        return np.concatenate([*moved, rotation.ravel(), 0.5 * RNG.normal(size=3), 0.1 * RNG.normal(size=3)])

    return made


def test_the_lyapunov_function_falls_as_the_proof_says(state):
    for _ in range(8):
        y, h = state(), 1e-3
        path = solve_ivp(rate, (0.0, 4 * h), y, t_eval=np.linspace(0.0, 4 * h, 5), rtol=1e-9, atol=1e-10)
        v = [value(t, one) for t, one in zip(path.t, path.y.T, strict=True)]
        found = (-25 * v[0] + 48 * v[1] - 36 * v[2] + 16 * v[3] - 3 * v[4]) / (12 * h)
        e1, e2, e3, e4 = errors(0.0, y)
        falls = np.array(KEYS["A_1"]) @ e1**2, np.array(KEYS["A_2"]) @ e2**2, 6.0 * e3 @ e3, 9.0 * e4 @ e4
        wanted = -np.dot(WEIGHTS, falls)
        assert found == pytest.approx(wanted, rel=2e-4, abs=2e-4)


def test_the_thrust_makes_the_wanted_climb_at_any_tilt(state):
    for _ in range(5):
        y = state()
        found, thrust = steps(GAINS, Vector(y[18:21]), measured(y), reference(0.0))
        e1, e2 = array(found.e1), array(found.e2)
        e1_d = array(reference(0.0).velocity) - y[3:6]
        k = {key: np.array(one) for key, one in KEYS.items()}
        a_1 = 1.7 * e1 + array(reference(0.0).acceleration) + k["A_1"] * e1_d + k["A_0"] * e1 + k["A_2"] * e2
        assert thrust.push * y[14] - GRAVITY == pytest.approx(a_1[2])


def test_the_prediction_is_that_of_a_rigid_body(state):
    y, h = state(), 1e-5
    later = predicted(measured(y), 12.0, GRAVITY, h)
    rotation = y[6:15].reshape(3, 3)
    np.testing.assert_allclose((array(later.velocity) - y[3:6]) / h, 12.0 * rotation[:, 2] - [0.0, 0.0, GRAVITY], atol=1e-6)
    turned = Rotation.from_matrix(rotation) * Rotation.from_rotvec(h * y[15:18])
    np.testing.assert_allclose(np.abs(array(later.attitude)), np.abs(np.roll(turned.as_quat(), 1)), atol=1e-12)


def test_it_asks_for_no_less_than_a_share_of_gravity_and_no_more_than_the_rotors_have():
    for height, push in ((100.0, 0.2 * GRAVITY), (-100.0, MODEL.most_thrust / MODEL.mass)):
        y = np.concatenate([[0.0, 0.0, height], np.zeros(3), np.eye(3).ravel(), np.zeros(6)])
        assert steps(GAINS, vector(0.0, 0.0, 0.0), measured(y), reference(0.0))[1].push == pytest.approx(push)
