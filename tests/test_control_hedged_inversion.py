"""Neural inversion with hedging: one sample against NumPy and SciPy, Lyapunov's rate on a rigid body, and flights."""

from functools import partial

import numpy as np
import pytest
from scipy.linalg import solve_continuous_lyapunov
from scipy.spatial.transform import Rotation

from quadstep.control.filters import FilteredAttitude, LedAttitude
from quadstep.control.hedged_inversion import HedgedInversion, HedgedInversionMemory
from quadstep.interfaces.learning import basis
from quadstep.interfaces.plant import Reference
from quadstep.mission.listings import load_preset
from quadstep.numbers import vector
from quadstep.numbers.rotations import IDENTITY
from tests.flights import array, column, same, weight_matrix
from tests.followed import EIGHT, FAST, HERE, followed
from tests.rigid import accelerations, moved, quaternion, told, turn

QUICK = {"R_p": 20.0, "R_d": 7.0, "K_p": (270.0, 270.0, 70.0), "K_d": (35.0, 35.0, 17.0)}
MODEL = load_preset("research-2.6kg").model()
LAW, GAINS = HedgedInversion(), HedgedInversion.gains(MODEL, QUICK)
MASS, INERTIA, G = MODEL.mass, array(MODEL.inertia), 9.81
LAG = 0.04
STILL = Reference(same(0.0), same(0.0), same(0.0), 0.0, 0.0)


def memory(rng, **changes):
    """Any: flying, everything different from everything else."""
    one = lambda size=1.0: column(rng.normal(size=3) * size)  # noqa: E731
    attitude = Rotation.from_rotvec(rng.normal(size=3) * 0.2)
    lean = quaternion(Rotation.from_rotvec(rng.normal(size=3) * 0.2))
    return HedgedInversionMemory(
        place=one(0.3), speed=one(), model=FilteredAttitude(quaternion(attitude), one(0.5), same(0.0)),
        weights_1=weight_matrix(rng.normal(size=(10, 3))), weights_2=weight_matrix(rng.normal(size=(10, 3))), flying=1.0,
        asked=one(2.0), force=vector(1.0, -2.0, MASS * G), wanted=LedAttitude(lean, one(0.5), one(3.0)), r1=one(),
        thrust=24.0, torque=one(0.1), asked_torque=one(0.1), asked_turn=one(5.0),
    )._replace(**changes)  # fmt: skip


def state(rng):
    return rng.normal(size=12) * np.repeat([0.3, 1.0, 0.3, 0.5], 3)


def path(rng):
    place, speed, pull, jerk, snap = (column(rng.normal(size=3)) for _ in range(5))
    return Reference(place, speed, pull, 0.3, 0.2, jerk, snap)


def lyapunov(stiffness, damping):
    """A, Q and the last column of P of an axis of the error, from SciPy."""
    a, q = np.array([[0.0, 1.0], [-stiffness, -damping]]), np.diag([damping * stiffness, damping])
    p = solve_continuous_lyapunov(a.T, -q)
    return a, q, p


def learnt(net, weights, inputs, e, e_dot, stiffness, damping, period):
    """What the net says, and its weights after a sample: F mu r^T - kappa |e| F W, r = B^T P e."""
    rows = np.array([list(row) for row in net.input_weights])
    mu = 1.0 / (1.0 + np.exp(-(rows[:, :-1] @ inputs + rows[:, -1])))
    pairs = zip(e, e_dot, stiffness, damping, strict=True)
    r = np.array([lyapunov(k, d)[2][1] @ [one, rate] for one, rate, k, d in pairs])
    size = np.linalg.norm(np.concatenate([e, e_dot]))
    rate = net.learning_rate * (np.outer(mu, r) - net.damping * size * weights)
    return weights.T @ mu, weights + period * rate, r


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("flying", [1.0, 0.0])
def test_a_sample_of_the_outer_loop(seed, flying):
    rng = np.random.default_rng(seed)
    x, reference, period = state(rng), path(rng), 0.01
    before = memory(rng, flying=flying)
    measured = told(x, thrust=26.0 if flying else 0.5 * MASS * G)
    after = LAW.guide(before, measured, reference, GAINS, 0.0, period)
    place, speed = (array(before.place), array(before.speed)) if flying else (x[:3], x[3:6])
    e, e_dot = place - x[:3], speed - x[3:6]
    axis = turn(measured.attitude).as_matrix()[:, 2]
    inputs = np.concatenate([x[3:6] / 5.0, axis, array(before.asked) / 10.0])
    stiffness, damping = np.full(3, 20.0), np.full(3, 7.0)
    said, weights, r = learnt(GAINS.force_net, array(before.weights_1), inputs, e, e_dot, stiffness, damping, period)
    if not flying:
        said, weights = 0.0, array(before.weights_1)
    a_r = (
        array(reference.acceleration) + 20.0 * (array(reference.position) - place) + 7.0 * (array(reference.velocity) - speed)
    )
    asked = a_r + 20.0 * e + 7.0 * e_dot + said
    np.testing.assert_allclose(array(after.asked), asked, rtol=1e-9)
    np.testing.assert_allclose(array(after.weights_1), weights, rtol=1e-9)
    np.testing.assert_allclose(array(after.r1), r, rtol=1e-9)
    hedge = array(before.asked) - (24.0 / MASS * axis - [0.0, 0.0, G])
    model_speed = speed + flying * period * (a_r - hedge)
    np.testing.assert_allclose(array(after.speed), model_speed, rtol=1e-9)
    np.testing.assert_allclose(array(after.place), place + period * model_speed, rtol=1e-9)
    assert after.flying == flying
    force = MASS * (asked + np.array([0.0, 0.0, G]))
    lift = np.clip(force[2], 0.1 * GAINS.most_thrust, 0.95 * GAINS.most_thrust)
    level = force[:2] * min(1.0, np.sqrt(GAINS.most_thrust**2 - lift**2) / np.linalg.norm(force[:2]))
    np.testing.assert_allclose(array(after.force), [*level, lift], rtol=1e-9)
    points = turn(after.wanted.attitude).as_matrix()[:, 2]
    np.testing.assert_allclose(points, array(after.force) / np.linalg.norm(array(after.force)), rtol=1e-9)
    # the wanted attitude turns as the force does with the path's jerk: b3_dot = R (Omega x e3)
    unit, jerk = points, MASS * array(reference.jerk)
    spin = turn(after.wanted.attitude).apply(np.cross(array(after.wanted.rates), [0.0, 0.0, 1.0]))
    np.testing.assert_allclose(spin, (jerk - unit * (unit @ jerk)) / np.linalg.norm(array(after.force)), atol=1e-9)


def wanted_turning(after, reference):
    """The acceleration of b3 in the world, from the turning in the wanted axes."""
    rates, turning = array(after.wanted.rates), array(after.wanted.turning)
    up = np.array([0.0, 0.0, 1.0])
    return turn(after.wanted.attitude).apply(np.cross(turning, up) + np.cross(rates, np.cross(rates, up)))


def test_the_paths_snap_is_how_the_wanted_turn_changes():
    reference = STILL._replace(snap=vector(30.0, -20.0, 0.0))
    measured = told(np.zeros(12), thrust=MASS * G)
    after = LAW.guide(LAW.start(measured, GAINS), measured, reference, GAINS, 0.0, 0.01)
    np.testing.assert_allclose(wanted_turning(after, reference), [30.0 / G, -20.0 / G, 0.0], atol=1e-9)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("flying", [1.0, 0.0])
def test_a_sample_of_the_inner_loop(seed, flying):
    rng = np.random.default_rng(seed)
    x, period, before = state(rng), 0.002, memory(rng, flying=flying)
    thrust, torque = 27.0, rng.normal(size=3) * 0.1
    measured = told(x, thrust, torque)
    command, after = LAW.law(before, measured, STILL, GAINS, 0.0, period)
    body, model, wanted = turn(measured.attitude), turn(before.model.attitude), turn(before.wanted.attitude)
    stiffness, damping = np.array([270.0, 270.0, 70.0]), np.array([35.0, 35.0, 17.0])

    # all in world axes, which no step of the law uses
    spin_r, spin_d, spin = model.apply(array(before.model.rates)), wanted.apply(array(before.wanted.rates)), body.apply(x[9:])
    seen_from = lambda frame, rates, v: frame.inv().apply(v)  # noqa: E731
    turning_d = wanted.apply(array(before.wanted.turning))
    away = (model.inv() * wanted).as_rotvec()
    # d/dt of omega_d's entries in turning axes: R^T (alpha_d - omega x omega_d)
    entering = seen_from(model, None, turning_d - np.cross(spin_r, spin_d))
    turn_r = entering + stiffness * away + damping * (seen_from(model, None, spin_d) - array(before.model.rates))
    e, e_dot = (body.inv() * model).as_rotvec(), seen_from(body, None, spin_r) - x[9:]
    inputs = np.concatenate([seen_from(body, None, x[3:6]) / 5.0, x[9:] / 5.0, array(before.asked_turn) / 50.0])
    said, weights, r = learnt(GAINS.torque_net, array(before.weights_2), inputs, e, e_dot, stiffness, damping, period)
    if not flying:
        said, weights = 0.0, array(before.weights_2)
    seen = seen_from(body, None, model.apply(turn_r) - np.cross(spin, spin_r))
    asked = seen + stiffness * e + damping * e_dot + said
    _, angular = accelerations(x, 0.0, array(command.torque), MASS, INERTIA)
    np.testing.assert_allclose(angular, asked, rtol=1e-8)
    np.testing.assert_allclose(array(after.asked_turn), asked, rtol=1e-8)
    np.testing.assert_allclose(array(after.asked_torque), array(command.torque))
    np.testing.assert_allclose(array(after.weights_2), weights, rtol=1e-8)
    np.testing.assert_allclose(array(command.r2), r, rtol=1e-8)
    share = 1.0 - np.exp(-period / LAG) if flying else 1.0
    made = array(before.torque) + share * (torque - array(before.torque))
    np.testing.assert_allclose(array(after.torque), made, rtol=1e-9)
    assert after.thrust == pytest.approx(24.0 + share * 3.0)
    hedge = model.inv().apply(body.apply((array(before.asked_torque) - made) / INERTIA))
    rates = array(before.model.rates) + period * (turn_r - hedge)
    np.testing.assert_allclose(array(after.model.rates), rates, rtol=1e-9)
    np.testing.assert_allclose(
        (model * Rotation.from_rotvec(period * rates)).as_matrix(), turn(after.model.attitude).as_matrix()
    )
    assert command.thrust == pytest.approx(array(before.force) @ body.as_matrix()[:, 2])
    np.testing.assert_allclose(array(command.desired_attitude), wanted.as_euler("ZYX"), atol=1e-12)
    assert list(command.weight_norms) == pytest.approx(
        [np.linalg.norm(array(before.weights_1)), np.linalg.norm(array(before.weights_2))]
    )


def test_it_starts_with_the_weight_and_learns_from_its_start_on():
    measured = told(np.zeros(12), MASS * G)
    assert list(LAW.start(measured, GAINS).force) == pytest.approx([0.0, 0.0, MASS * G])
    rng, late = np.random.default_rng(3), GAINS._replace(learning_start=5.0)
    before = memory(rng)
    for t, learns in ((4.99, False), (5.0, True)):
        after = LAW.guide(before, measured, STILL, late, t, 0.01)
        _, later = LAW.law(before, measured, STILL, late, t, 0.01)
        assert bool((array(after.weights_1) != array(before.weights_1)).any()) is learns
        assert bool((array(later.weights_2) != array(before.weights_2)).any()) is learns
        said = array(after.asked) - array(LAW.guide(before, measured, STILL, late, 0.0, 0.01).asked)
        assert bool(np.abs(said).max() > 0.1) is learns


@pytest.mark.parametrize(("share", "flies"), [(0.78, 0.0), (0.82, 1.0)])
def test_it_flies_once_the_rotors_have_carried_most_of_its_weight(share, flies):
    measured = told(np.zeros(12), share * MASS * G)
    assert LAW.guide(LAW.start(measured, GAINS), measured, STILL, GAINS, 0.0, 0.01).flying == flies


def test_weights_keep_their_bounds():
    measured, before = told(np.zeros(12), MASS * G), memory(np.random.default_rng(4))
    tight = GAINS._replace(weight_bounds=vector(0.5, 0.7))
    assert LAW.guide(before, measured, STILL, tight, 0.0, 0.01).weights_1.norm() == pytest.approx(0.5)
    assert LAW.law(before, measured, STILL, tight, 0.0, 0.002)[1].weights_2.norm() == pytest.approx(0.7)


def test_lyapunov_falls_as_theory_says_when_the_net_can_be_right():
    """V = sum_i e_i^T P e_i + |W - W*|^2 / F of the inner loop, over a short step of a rigid body under a torque W*^T mu."""
    rng = np.random.default_rng(17)
    gains = GAINS._replace(torque_net=GAINS.torque_net._replace(damping=0.0))
    h, x = 1e-7, np.zeros(12)
    x[6:9], x[9:] = rng.normal(size=3) * 1e-3, rng.normal(size=3) * 1e-2
    ideal = rng.normal(size=(10, 3))
    before = memory(
        rng, model=FilteredAttitude(IDENTITY, same(0.0), same(0.0)), wanted=LedAttitude(IDENTITY, same(0.0), same(0.0)),
        weights_2=weight_matrix(ideal + rng.normal(size=(10, 3))),
    )  # fmt: skip
    before = before._replace(torque=before.asked_torque)  # all that was asked for was made: no hedge
    stiffness, damping = array(gains.stiffness_2), array(gains.damping_2)

    def errors(model, x):
        body = Rotation.from_rotvec(x[6:9])
        between = body.inv() * turn(model.model.attitude)
        return between.as_rotvec(), between.apply(array(model.model.rates)) - x[9:]

    def energy(model, x):
        pairs = zip(*errors(model, x), stiffness, damping, strict=True)
        of_errors = sum(np.array([e, de]) @ lyapunov(k, d)[2] @ [e, de] for e, de, k, d in pairs)
        return of_errors + np.sum((array(model.weights_2) - ideal) ** 2) / gains.torque_net.learning_rate

    measured = told(x, MASS * G, array(before.asked_torque))
    command, after = LAW.law(before, measured, STILL, gains, 0.0, h)
    inputs = (
        *column(Rotation.from_rotvec(x[6:9]).inv().apply(x[3:6]) / 5.0),
        *column(x[9:] / 5.0),
        *(before.asked_turn * 0.02),
    )
    mu = array(basis(gains.torque_net, inputs))
    linear, angular = accelerations(x, MASS * G, array(command.torque), MASS, INERTIA, twist=-INERTIA * (ideal.T @ mu))
    later = moved(x, linear, angular, h)
    pairs = zip(*errors(before, x), stiffness, damping, strict=True)
    wanted = -sum(np.array([e, de]) @ lyapunov(k, d)[1] @ [e, de] for e, de, k, d in pairs)
    assert (energy(after, later) - energy(before, x)) / h == pytest.approx(wanted, rel=1e-2)
    assert abs(np.sum((ideal - array(before.weights_2)) * np.outer(mu, array(command.r2)))) > 0.05 * abs(wanted)


# Flights

flown = partial(followed, "hedged-inversion")


@pytest.mark.parametrize("preset", ["research-2.6kg", "crazyflie", "x500"])
def test_it_flies_a_figure_eight_and_a_fast_circle(preset):
    assert flown(EIGHT, preset).metrics()["position_rmse[m]"] < 0.06
    assert flown(FAST, preset).metrics()["position_rmse[m]"] < 0.12


def test_its_nets_make_up_for_a_wind_that_it_knows_nothing_of():
    wind = {"mean": [8.0, 0.0, 0.0]}
    errors = [flown(HERE, gains={"nets": {"enabled": on}}, wind=wind).metrics()["position_rmse[m]"] for on in (True, False)]
    assert errors[0] < 0.2 * errors[1]


def test_what_the_rotors_cannot_do_is_hardly_learnt():
    """A place 15 m above, out of reach at once: what is learnt from is small beside the error to the path."""
    jump = {"type": "step", "start": [0.0, 0.0, 5.0], "end": [0.0, 0.0, 20.0], "time": 1.0, "duration": 8.0}
    flight = flown(jump)
    off = flight.column("z_d") - flight.column("z")
    assert off.max() == pytest.approx(15.0, abs=0.1)
    assert flight.column("norm_r1").max() < 0.1 * 3.5 * off.max()  # r of the path's error: damping / 2 times it
    assert flight.column("norm_W1").max() < 6.0
    assert abs(off[-1]) < 0.05
