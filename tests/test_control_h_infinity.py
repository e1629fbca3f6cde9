"""Laws by H-infinity synthesis: Riccati equations against SciPy, least gains against SLICOT, promised gains over frequency."""

import math

import numpy as np
import pytest
import slycot
from scipy.linalg import expm, solve_continuous_are
from scipy.spatial.transform import Rotation

from quadstep.control.h_infinity_linearisation import HInfinityLinearisation, feedback, least_gamma, solution
from quadstep.control.loop_shaping import LoopShaping, robust, shaped
from quadstep.interfaces.controller import Measured
from quadstep.interfaces.plant import Reference
from quadstep.mission.listings import load_preset
from quadstep.numbers import flatten, vector
from quadstep.numbers.solve import inverse, riccati

MODEL = load_preset("research-2.6kg").model()
FREQUENCIES = np.geomspace(1e-3, 1e3, 4000)
ZERO = vector(0.0, 0.0, 0.0)
HERE = Reference(ZERO, ZERO, ZERO, 0.0, 0.0)
WEIGHTS = [(1.0, 3.0, 3.0, 3.0, 1.0), (1.0, 1.0, 1.0, 1.0, 1.0), (20.0, 1.0, 0.2, 5.0, 0.05)]


def largest_gain(a, b, c, d):
    """The largest singular value of c (jw - a)^-1 b + d over all frequencies."""
    identity = np.eye(len(a))
    return max(np.linalg.svd(c @ np.linalg.solve(1j * w * identity - a, b) + d, compute_uv=False)[0] for w in FREQUENCIES)


@pytest.mark.parametrize("size", [1, 3, 6])
def test_the_inverse_and_the_riccati_equation_are_those_of_lapack(size):
    random = np.random.default_rng(size)
    for _ in range(5):
        a, b, c = random.normal(size=(3, size, size))
        np.testing.assert_allclose(inverse(a.tolist()), np.linalg.inv(a), rtol=1e-8, atol=1e-10)
        s, q = b @ b.T, c @ c.T
        wanted = solve_continuous_are(a, b, q, np.eye(size))
        np.testing.assert_allclose(riccati(a.tolist(), s.tolist(), q.tolist()), wanted, rtol=1e-7, atol=1e-9)


def test_equations_without_a_stabilising_solution_are_refused():
    with pytest.raises(ValueError, match=r"stabilising|singular"):
        riccati([[1.0]], [[0.0]], [[1.0]])
    with pytest.raises(ValueError, match="singular"):
        inverse([[1.0, 2.0], [2.0, 4.0]])


def chain():
    return np.diag([1.0] * 4, 1), np.eye(5)[:, [2]], np.eye(5)[:, [4]]


@pytest.mark.parametrize("weights", WEIGHTS)
@pytest.mark.parametrize("margin", [1.05, 1.5, 4.0])
def test_the_gain_from_a_push_to_what_is_weighed_stays_below_gamma(weights, margin):
    a, b_w, b_u = chain()
    k = np.array(feedback(weights, margin, 1.0))[None, :]
    closed = a - b_u @ k
    assert np.linalg.eigvals(closed).real.max() < 0.0
    output = np.vstack([np.diag(np.sqrt(weights)), -k])
    gamma = margin * least_gamma(weights)
    found = largest_gain(closed, b_w, output, np.zeros((6, 1)))
    assert found < gamma
    assert found > 0.5 * least_gamma(weights)


@pytest.mark.parametrize("weights", WEIGHTS)
def test_no_state_feedback_does_better_than_the_least_gamma(weights):
    """The least is where the solution ends; near it the bound is met, and other feedbacks, as those of LQR, are above it."""
    a, b_w, b_u = chain()
    least = least_gamma(weights)
    assert solution(weights, 1.001 * least) is not None
    assert solution(weights, 0.999 * least) is None
    for price in (0.03, 0.3, 1.0, 3.0):
        x = solve_continuous_are(a, b_u, np.diag(weights), np.array([[price]]))
        k = b_u.T @ x / price
        output = np.vstack([np.diag(np.sqrt(weights)), -k])
        assert largest_gain(a - b_u @ k, b_w, output, np.zeros((6, 1))) > 0.999 * least


def slicot_gamma(a, b, c, d, commands, measured):
    """The least gain over all output feedbacks that SLICOT's SB10AD finds; the last inputs and outputs are the law's."""
    return slycot.sb10ad(len(a), b.shape[1], len(c), commands, measured, 100.0, a, b, c, d, job=1, gtol=1e-10, actol=0.0)[0]


@pytest.mark.parametrize("weights", WEIGHTS)
def test_the_least_gamma_of_the_linearised_loop_is_slicots(weights):
    """SLICOT asks for noise on every measurement and a push on every chain: its gain falls to ours as these vanish."""
    a, b_w, b_u = chain()

    def found(noise):
        b = np.hstack([b_w, noise * b_u, np.zeros((5, 5)), b_u])
        c = np.vstack([np.diag(np.sqrt(weights)), np.zeros((1, 5)), np.eye(5)])
        d = np.zeros((11, 8))
        d[5, 7] = 1.0
        d[6:, 2:7] = noise * np.eye(5)
        return slicot_gamma(a, b, c, d, 1, 5)

    coarse, fine = found(1e-3), found(1e-4)
    assert (10.0 * fine - coarse) / 9.0 == pytest.approx(least_gamma(weights), rel=2e-6)


@pytest.mark.parametrize(("corner", "lag"), [(0.25, 5.5 / 14.0), (0.1, 0.3), (0.5, 0.8)])
def test_the_least_gamma_of_loop_shaping_is_slicots(corner, lag):
    """Normalised coprime factors: pushes on the plant's input and output, to both."""
    _, *plant = shaped(corner, lag)
    a, b, c = np.array(plant[0]), np.array(plant[1])[:, None], np.array(plant[2])[None, :]
    nothing = np.zeros((1, 4))
    d = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    wanted = slicot_gamma(a, np.hstack([nothing.T, b, b]), np.vstack([c, nothing, c]), d, 1, 1)
    assert robust(*plant, 1.0).gamma == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize("weights", WEIGHTS)
@pytest.mark.parametrize("margin", [1.05, 4.0])
def test_the_feedback_is_the_last_row_of_the_games_riccati_solution(weights, margin):
    a, b_w, b_u = chain()
    price = np.diag([-((margin * least_gamma(weights)) ** 2), 1.0])
    wanted = solve_continuous_are(a, np.hstack([b_w, b_u]), np.diag(weights), price)
    assert feedback(weights, margin, 1.0) == pytest.approx(list(wanted[-1]), rel=1e-9)


def test_a_margin_that_no_law_achieves_becomes_the_least_that_one_does():
    least = solution(WEIGHTS[0], (1.0 + 1e-6) * least_gamma(WEIGHTS[0]))
    assert feedback(WEIGHTS[0], 0.5, 1.0) == least[-1]


def test_a_faster_pace_is_the_same_law_in_shorter_seconds():
    slow, fast = feedback(WEIGHTS[0], 1.5, 1.0), feedback(WEIGHTS[0], 1.5, 3.0)
    assert fast == pytest.approx([one * 3.0 ** (5 - i) for i, one in enumerate(slow)])


def flown(law, gains, offset, steps, period, path_at=lambda _: HERE):
    """A vehicle without lag, whose commands are made at once, integrated here."""
    inertia, mass = np.array(list(MODEL.inertia)), MODEL.mass
    position, velocity, rates, rotation = np.array(offset), np.zeros(3), np.zeros(3), Rotation.identity()

    def told():
        x, y, z, w = rotation.as_quat()
        return Measured(vector(*position), vector(*velocity), vector(w, x, y, z), vector(*rates), 26.0, ZERO)

    memory, path = law.start(told(), gains), []
    for i in range(steps):
        path.append(position)
        command, memory = law.law(memory, told(), path_at(i * period), gains, i * period, period)
        if isinstance(law, LoopShaping):
            rates, angular = np.array(list(command.rates)), np.zeros(3)
        else:
            angular = (np.array(list(command.torque)) - np.cross(rates, inertia * rates)) / inertia
        acceleration = command.thrust / mass * rotation.as_matrix()[:, 2] - [0.0, 0.0, 9.81]
        rotation = rotation * Rotation.from_rotvec(period * rates)
        position, velocity, rates = position + period * velocity, velocity + period * acceleration, rates + period * angular
    return np.array(path)


def test_the_robust_law_on_the_vehicle_is_the_closed_chain():
    gains = HInfinityLinearisation().prepare(HInfinityLinearisation.gains(MODEL), MODEL)
    offset, period = np.array([0.2, -0.1, 0.15]), 2e-4
    path = flown(HInfinityLinearisation(), gains, offset, 3000, period)
    a, _, b_u = chain()
    closed = a - b_u @ np.array(list(gains.feedback))[None, :]
    closed[0, 1] = 1.0
    wanted = [(expm(closed * period * i) @ np.eye(5)[:, 1])[1] * offset for i in range(0, 3000, 300)]
    np.testing.assert_allclose(path[::300], wanted, atol=1.5e-3)


def test_the_robust_law_follows_a_path_whose_rates_it_is_given():
    """From rest along a t^5, up to 8.6 m/s^2, and further off by centimetres with any of the rates amiss."""
    gains = HInfinityLinearisation().prepare(HInfinityLinearisation.gains(MODEL), MODEL)
    reach, period, steps = np.array([2.0, -1.5, 1.0]), 2e-4, 3000

    def moving(t):
        rates = (t**5, 5.0 * t**4, 20.0 * t**3, 60.0 * t**2, 120.0 * t)
        position, velocity, acceleration, jerk, snap = (vector(*(one * reach)) for one in rates)
        return Reference(position, velocity, acceleration, 0.0, 0.0, jerk, snap)

    path = flown(HInfinityLinearisation(), gains, np.zeros(3), steps, period, moving)
    wanted = np.outer((period * np.arange(steps)) ** 5, reach)
    np.testing.assert_allclose(path, wanted, atol=1e-3)


def test_the_integral_holds_a_steady_push_of_so_much_and_no_more():
    asked = HInfinityLinearisation.gains(MODEL)._replace(steady=5.0, margin=1.5, pace=6.0)
    gains = HInfinityLinearisation().prepare(asked, MODEL)
    assert list(gains.feedback) == feedback(tuple(asked.weights), 1.5, 6.0)
    assert gains.feedback[0] * gains.integral_bound == pytest.approx(5.0 * gains.feedback[3])
    law = HInfinityLinearisation()
    here = Measured(ZERO, vector(0.1, 0.2, 0.3), vector(1.0, 0.0, 0.0, 0.0), vector(0.4, 0.5, 0.6), 26.0, ZERO)
    assert [*flatten(law.start(here, gains))] == [gains.gravity, 0.0, 0.0, 0.0, 0.0]
    far = law.start(here, gains)._replace(integral=vector(3.0 * gains.integral_bound, 0.0, 0.0))
    _, memory = law.law(far, here, HERE, gains, 0.0, 1e-3)
    assert list(memory.integral) == pytest.approx([gains.integral_bound, 0.0, 0.0])


SHAPES = [(0.25, 0.4), (0.1, 0.2), (0.6, 0.8)]


@pytest.mark.parametrize(("corner", "lag"), SHAPES)
def test_the_shaped_plant_is_the_weight_times_the_lagged_double_integrator(corner, lag):
    k, a, b, c = shaped(corner, lag)
    for w in (0.1, 1.0, 7.0):
        s = 1j * w
        found = np.array(c) @ np.linalg.solve(s * np.eye(4) - np.array(a), np.array(b))
        assert found == pytest.approx(k * (1.0 + corner / s) / (s * s * (lag * s + 1.0)))
    assert abs(np.array(c) @ np.linalg.solve(1j * np.eye(4) - np.array(a), np.array(b))) == pytest.approx(1.0)


@pytest.mark.parametrize(("corner", "lag"), SHAPES)
@pytest.mark.parametrize("margin", [1.02, 1.1, 2.0])
def test_the_loop_stands_the_promised_error_of_its_coprime_factors(corner, lag, margin):
    """|| [K; 1] (1 - G K)^-1 [1, G] || is gamma at most, and at least the least gamma, over all frequencies."""
    _, a, b, c = shaped(corner, lag)
    a, b, c = np.array(a), np.array(b), np.array(c)
    law = robust(a.tolist(), b.tolist(), c.tolist(), margin)
    closed = np.block([[a, np.outer(b, law.c)], [np.outer(law.b, c), np.array(law.a)]])
    assert np.linalg.eigvals(closed).real.max() < 0.0
    gains = []
    for w in FREQUENCIES:
        s = 1j * w * np.eye(4)
        g, k = c @ np.linalg.solve(s - a, b), np.array(law.c) @ np.linalg.solve(s - np.array(law.a), np.array(law.b))
        gains.append(math.sqrt((1.0 + abs(k) ** 2) * (1.0 + abs(g) ** 2)) / abs(1.0 - g * k))
    assert max(gains) <= law.gamma * (1.0 + 1e-6)
    assert max(gains) >= law.gamma / margin * (1.0 - 1e-6)


@pytest.mark.parametrize(("axis", "made_at_once"), [(0, False), (1, False), (2, True)])
def test_the_position_law_on_the_vehicle_comes_back_as_its_loop_says(axis, made_at_once):
    """From an offset, against the linear loop: the attitude is a first-order lag, the weight an integrator beside 1."""
    law = LoopShaping()
    gains = law.prepare(LoopShaping.gains(MODEL), MODEL)
    offset, period, steps = 0.01 * np.eye(3)[axis], 2e-4, 3000
    path = flown(law, gains, offset, steps, period)
    pace, lag = gains.pace, gains.pace / gains.attitude
    drift = np.array([list(row) for row in gains.drift])
    entry, out = np.array(list(gains.entry)), np.array(list(gains.exit))

    def loop(lag):
        n = 3 + 1 + 4  # position, velocity, acceleration; integral; filter
        a = np.zeros((n, n))
        ask = np.zeros(n)
        ask[4:], ask[3] = gains.weight * out, gains.weight * gains.corner
        a[0, 1] = a[1, 2] = 1.0
        a[2] = ask / lag
        a[2, 2] -= 1.0 / lag
        a[3, 4:] = out
        a[4:, 0], a[4:, 4:] = entry, drift
        return a

    found = loop(1e-4 if made_at_once else lag) * pace * period
    wanted = [0.01 * expm(found * i)[0, 0] for i in range(0, steps, 300)]
    np.testing.assert_allclose(path[::300, axis], wanted, atol=1e-4)
