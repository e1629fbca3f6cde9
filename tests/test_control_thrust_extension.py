"""Laws that drive the thrust's rate, on a rigid body that is integrated here, by SciPy and rotation matrices alone."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from quadstep.control.dynamic_linearisation import DynamicLinearisation
from quadstep.control.thrust_extended_backstepping import (
    Push,
    ThrustExtendedBackstepping,
    backstepped,
    driven,
    inputs,
    motion,
    turning,
)
from quadstep.interfaces.controller import Measured
from quadstep.interfaces.plant import Reference
from quadstep.mission.listings import load_preset
from quadstep.numbers import Vector, vector

GRAVITY = 9.81
MODEL = load_preset("research-2.6kg").model()
RNG = np.random.default_rng(7)
ORBIT = 0.7


def reference(t):
    """An orbit whose derivatives are written out here."""
    size, phase = np.array([1.0, 0.8, 0.3]), np.array([0.0, 1.0, 2.0])
    turns = [size * ORBIT**n * np.sin(ORBIT * t + phase + n * np.pi / 2.0) for n in range(5)]
    return Reference(*(Vector(one) for one in turns[:3]), 0.4, 0.0, Vector(turns[3]), Vector(turns[4]))


def measured(position, velocity, rotation, rates):
    x, y, z, w = rotation.as_quat()
    return Measured(*map(Vector, (position, velocity, (w, x, y, z), rates)), 26.0, vector(0.0, 0.0, 0.0))


def any_state():
    rotation = Rotation.from_euler("xyz", RNG.uniform(-0.5, 0.5, 3))
    return RNG.normal(size=3), RNG.normal(size=3), rotation, RNG.normal(size=3), Push(RNG.uniform(6.0, 14.0), RNG.normal())


def flown(state, drive, times):
    """A rigid body and an extended thrust: drive(t, position, velocity, rotation, rates, push) -> push_dd, angular."""
    position, velocity, rotation, rates, push = state
    start = np.concatenate([position, velocity, rotation.as_matrix().ravel(), rates, push])

    def unpacked(y):
        return y[:3], y[3:6], Rotation.from_matrix(y[6:15].reshape(3, 3)), y[15:18], Push(*y[18:])

    def rate(t, y):
        parts = unpacked(y)
        change, angular = drive(t, *parts)
        p, q, r = parts[3]
        hat = np.array([[0.0, -r, q], [r, 0.0, -p], [-q, p, 0.0]])
        turn = y[6:15].reshape(3, 3) @ hat
        force = y[18] * y[6:15].reshape(3, 3)[:, 2] - [0.0, 0.0, GRAVITY]
        return np.concatenate([y[3:6], force, turn.ravel(), angular, [y[19], change]])

    found = solve_ivp(rate, (times[0], times[-1]), start, t_eval=times, rtol=1e-10, atol=1e-11, method="DOP853")
    return [unpacked(y) for y in found.y.T]


def pushed(state):
    """The specific force of the thrust."""
    return state[4].value * state[2].as_matrix()[:, 2]


def test_the_inputs_give_the_specific_force_the_second_rate_asked_for():
    for _ in range(20):
        state = any_state()
        snap = RNG.normal(size=3) * 20.0
        asked = inputs(measured(*state[:4]), state[4], Vector(snap))
        angular = np.array([asked.about_x, asked.about_y, 0.7])
        h = 1e-3
        path = flown(state, lambda *_, asked=asked, angular=angular: (asked.push, angular), np.linspace(0.0, 4 * h, 5))
        forces = np.array([pushed(one) for one in path])
        # forward differences of fourth and third order about t = 0
        second = (35 * forces[0] - 104 * forces[1] + 114 * forces[2] - 56 * forces[3] + 11 * forces[4]) / (12 * h * h)
        first = (-25 * forces[0] + 48 * forces[1] - 36 * forces[2] + 16 * forces[3] - 3 * forces[4]) / (12 * h)
        np.testing.assert_allclose(second, snap, atol=2e-2)
        np.testing.assert_allclose(first, list(motion(measured(*state[:4]), state[4]).force_rate), atol=1e-6)


def test_the_lyapunov_function_falls_as_the_proof_says():
    """V by its definition, its rate by differences along the motion: -sum k_i |e_i|^2 / c^(i - 1), also with e0."""
    values = {
        "k_0": [3.0, 4.0, 5.0],
        "k_1": [2.0, 2.5, 3.0],
        "k_2": [3.0, 3.5, 4.5],
        "k_3": [6.0, 7.0, 8.0],
        "k_4": [9.0, 8.0, 10.0],
    }
    c = 1.7
    gains = ThrustExtendedBackstepping.gains(MODEL, {**{key: tuple(value) for key, value in values.items()}, "c": c})
    k = [np.array(values[f"k_{i}"]) for i in range(5)]
    for _ in range(10):
        state, integral = any_state(), RNG.normal(size=3)

        def errors(t, state, integral=integral):
            known = measured(*state[:4])
            now = motion(known, state[4])
            return backstepped(gains, Vector(integral), known, reference(t), now.force, now.force_rate)

        def drive(t, *state):
            asked = inputs(measured(*state[:4]), state[4], errors(t, state, at(t)).snap)
            return asked.push, np.array([asked.about_x, asked.about_y, 0.3])

        first = np.array(list(errors(0.0, state).position))
        slope = np.array(list(state[1])) - np.array(list(reference(0.0).velocity))

        def at(t, integral=integral, first=first, slope=slope):
            return integral + first * t + 0.5 * slope * t * t

        h = 2e-4
        values_of = []
        for t, one in zip(np.linspace(0.0, 4 * h, 5), flown(state, drive, np.linspace(0.0, 4 * h, 5)), strict=True):
            e = [at(t), *(np.array(list(part)) for part in errors(t, one, at(t))[:4])]
            values_of.append(0.5 * (k[0] @ e[0] ** 2 + sum(part @ part / c**i for i, part in enumerate(e[1:]))))
        found = (-25 * values_of[0] + 48 * values_of[1] - 36 * values_of[2] + 16 * values_of[3] - 3 * values_of[4]) / (12 * h)
        falls = (k[i] @ (np.array(list(part)) ** 2) for i, part in enumerate(errors(0.0, state)[:4], start=1))
        wanted = -sum(fall / c**i for i, fall in enumerate(falls))
        assert found == pytest.approx(wanted, rel=1e-5, abs=1e-5 * values_of[0])


HERE = Reference(*(vector(0.0, 0.0, 0.0),) * 3, 0.0, 0.0)


def sampled(law, gains, offset, steps, period):
    """Where a vehicle without lag flies, whose thrust and torque are made at once; and its last command and memory."""
    state = (np.array(offset), np.zeros(3), Rotation.identity(), np.zeros(3))
    memory, command, path = law.start(measured(*state), gains), None, []
    inertia = np.array(list(MODEL.inertia))
    for i in range(steps):
        position, velocity, rotation, rates = state
        path.append(position)
        command, memory = law.law(memory, measured(*state), HERE, gains, i * period, period)
        angular = (np.array(list(command.torque)) - np.cross(rates, inertia * rates)) / inertia
        acceleration = command.thrust / MODEL.mass * rotation.as_matrix()[:, 2] - [0.0, 0.0, GRAVITY]
        turned = rotation * Rotation.from_rotvec(period * rates)
        state = (position + period * velocity, velocity + period * acceleration, turned, rates + period * angular)
    return np.array(path), state, command, memory


def test_position_is_a_linear_chain_under_dynamic_feedback():
    """The flight from an offset against the matrix exponential of the chain, gains as declared, the observer settled."""
    period, offset = 2e-4, np.array([0.3, -0.2, 0.1])
    gains = DynamicLinearisation.gains(MODEL)
    path, *_ = sampled(DynamicLinearisation(), gains, offset, 4000, period)
    chain = np.diag([1.0, 1.0, 1.0], 1)
    chain[3] = [-gains.position[0], -gains.velocity[0], -gains.acceleration[0], -gains.jerk[0]]
    wanted = [expm(chain * period * i)[0, 0] * offset for i in range(0, 4000, 250)]
    np.testing.assert_allclose(path[::250], wanted, atol=2e-3)


def test_errors_follow_one_another_under_backstepping():
    """e' = M e with k_i on the diagonal and -1, 1 beside it, from where position is off and all its rates are zero."""
    period, offset = 2e-4, np.array([0.3, -0.2, 0.1])
    gains = ThrustExtendedBackstepping.gains(MODEL)
    path, state, _, memory = sampled(ThrustExtendedBackstepping(), gains, offset, 4000, period)
    expected = []
    for axis in range(3):
        k = [one[axis] for one in (gains.integral, gains.position, gains.velocity, gains.force, gains.force_rate)]
        m = np.diag([0.0, *(-one for one in k[1:])]) + np.diag([1.0] * 4, 1) - np.diag([k[0], 1.0, 1.0, 1.0], -1)
        rows = [np.linalg.matrix_power(m, n)[1] for n in range(4)]
        start = np.linalg.solve(np.array([np.eye(5)[0], *rows]), [0.0, 1.0, 0.0, 0.0, 0.0]) * offset[axis]
        expected.append([expm(m * period * i) @ start for i in range(0, 4001, 250)])
    errors = np.array(expected)  # axis, time, error
    np.testing.assert_allclose(path[::250], errors[:, :-1, 1].T, atol=2e-3)
    np.testing.assert_allclose(list(memory.integral), errors[:, -1, 0], atol=1e-3)
    velocity = state[1] + list(gains.position) * state[0] + list(gains.integral) * np.array(list(memory.integral))
    np.testing.assert_allclose(velocity, errors[:, -1, 2], atol=5e-3)


@pytest.mark.parametrize("law", [ThrustExtendedBackstepping, DynamicLinearisation])
def test_torques_make_up_for_a_body_that_turns(law):
    """A wanted angular acceleration and the gyroscopic torque w x J w, whatever the rates."""
    gains = law.gains(MODEL)
    inertia, rates = np.array(list(MODEL.inertia)), np.array([0.5, -0.4, 0.8])
    known = measured(np.zeros(3), np.zeros(3), Rotation.identity(), rates)
    command, _ = law().law(law().start(known, gains), known, HERE, gains, 0.0, 0.002)
    still = known._replace(rates=vector(*rates[:2], 0.0))
    other, _ = law().law(law().start(still, gains), still, HERE, gains, 0.0, 0.002)
    turned = np.array(list(command.torque)) - np.array(list(other.torque))
    p, q, r = rates
    added = np.cross(rates, inertia * rates) - np.cross([p, q, 0.0], inertia * [p, q, 0.0])
    free = inertia * [q * r, -p * r, -gains.turning * r]  # what `inputs` and the damping of the heading add
    np.testing.assert_allclose(turned, added + free, atol=1e-12)


def test_the_observer_finds_a_steady_push():
    law, period = DynamicLinearisation(), 0.002
    gains = DynamicLinearisation.gains(MODEL)
    push, velocity = np.array([1.5, -0.8, 0.4]), np.zeros(3)
    memory = law.start(measured(np.zeros(3), velocity, Rotation.identity(), np.zeros(3)), gains)
    for i in range(2500):  # held level: all that it does not know of is the push
        known = measured(np.zeros(3), velocity, Rotation.identity(), np.zeros(3))
        _, memory = law.law(memory._replace(push=Push(GRAVITY, 0.0)), known, HERE, gains, i * period, period)
        velocity = velocity + period * push
    np.testing.assert_allclose(list(memory.disturbance), push, atol=0.05)


def test_a_thrust_at_its_limit_waits_there_and_comes_back_at_once():
    push = Push(19.0, 30.0)
    for _ in range(100):
        push = driven(push, 50.0, GRAVITY, 20.0, 0.002)
        assert push.value <= 19.0
    assert push == (19.0, 0.0)
    assert driven(push, -50.0, GRAVITY, 20.0, 0.002).value < 19.0
    low = driven(Push(2.0, -30.0), -50.0, GRAVITY, 20.0, 0.02)
    assert low == (pytest.approx(0.2 * GRAVITY), 0.0)
    free = driven(Push(10.0, 2.0), 3.0, GRAVITY, 20.0, 0.1)
    assert free == (pytest.approx(10.0 + 0.2 + 0.015), pytest.approx(2.3))


@pytest.mark.parametrize("yaw", [0.3, -2.0, 3.0])
def test_the_heading_is_turned_by_the_shorter_way_and_damped(yaw):
    level = measured(np.zeros(3), np.zeros(3), Rotation.from_euler("z", yaw - 0.2), np.zeros(3))
    wanted = reference(0.0)._replace(yaw=yaw)
    assert turning(level, vector(0.0, 0.0, 1.0), wanted, 10.0, 4.0) == pytest.approx(10.0 * np.sin(0.2))
    spinning = level._replace(rates=vector(0.0, 0.0, 0.5))
    assert turning(spinning, vector(0.0, 0.0, 1.0), wanted._replace(yaw_rate=0.2), 0.0, 4.0) == pytest.approx(4.0 * -0.3)
