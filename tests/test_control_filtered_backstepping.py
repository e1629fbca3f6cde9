"""Command-filtered adaptive backstepping: one sample against NumPy and SciPy, Lyapunov's rate on a rigid body, and flights."""

from functools import partial

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quadstep.control.filtered_backstepping import FilteredBackstepping, FilteredBacksteppingMemory
from quadstep.control.filters import Filtered, FilteredAttitude, LedAttitude
from quadstep.interfaces.learning import NODES, growth, hats, values
from quadstep.interfaces.plant import Reference
from quadstep.mission.listings import load_preset
from quadstep.numbers import vector
from tests.flights import array, column, same, weight_matrix
from tests.followed import EIGHT, FAST, error
from tests.rigid import accelerations, moved, quaternion, told, turn

QUICK = {
    "k_1": 2.5, "k_2": 6.0, "k_3": (8.0, 8.0, 4.0), "k_4": (28.0, 28.0, 14.0), "c_1": 4.0, "c_2": 1.0, "c_3": 60.0,
    "speed_filter": 30.0, "turn_filter": (31.0, 31.0, 15.5), "spin_filter": 100.0, "learning_1": 16.0, "learning_2": 80.0,
}  # fmt: skip
MODEL = load_preset("research-2.6kg").model()
LAW, GAINS = FilteredBackstepping(), FilteredBackstepping.gains(MODEL, QUICK)
MASS, INERTIA, G, UP = MODEL.mass, array(MODEL.inertia), 9.81, np.array([0.0, 0.0, 1.0])
K1, K2, K3, K4 = 2.5, 6.0, np.array([8.0, 8.0, 4.0]), np.array([28.0, 28.0, 14.0])
C1, C3, TURN_FILTER = 4.0, 60.0, np.array([31.0, 31.0, 15.5])
NODES_AT = np.arange(NODES) - (NODES - 1) / 2
STILL = Reference(same(0.0), same(0.0), same(0.0), 0.0, 0.0)


def memory(rng, size=1.0, **changes):
    """Any: flying, everything different from everything else."""
    one = lambda scale=1.0: column(rng.normal(size=3) * scale * size)  # noqa: E731
    lean = lambda: quaternion(Rotation.from_rotvec(rng.normal(size=3) * 0.2 * size))  # noqa: E731
    return FilteredBacksteppingMemory(
        speed_fed=Filtered(one(0.5), one()), spin_fed=Filtered(one(0.5), one()),
        attitude=FilteredAttitude(lean(), one(0.5), same(0.0)), xi_1=one(0.2), xi_2=one(0.3), xi_3=one(0.1), xi_4=one(0.2),
        weights_1=weight_matrix(rng.normal(size=(NODES, 3))), weights_2=weight_matrix(rng.normal(size=(NODES, 3))), flying=1.0,
        asked=one(), force=vector(1.0, -2.0, MASS * G), wanted=LedAttitude(lean(), one(0.5), one(3.0)), compensated=one(),
        asked_torque=one(0.1),
    )._replace(**changes)  # fmt: skip


def path(rng, size=1.0):
    place, speed, pull, jerk, snap = (column(rng.normal(size=3) * size) for _ in range(5))
    return Reference(place, speed, pull, 0.3 * size, 0.2 * size, jerk, snap)


def interpolated(weights, places):
    """Piecewise linear through the weights, by NumPy; and the slopes of that in the weights."""
    said = np.array([np.interp(place, NODES_AT, weights[:, i]) for i, place in enumerate(places)])
    phi = np.array([[np.interp(place, NODES_AT, unit) for place in places] for unit in np.eye(NODES)])
    return said, phi


def critically_damped(filtered, command, frequency, h):
    """The second-order filter by the matrix exponential's series, to fourth order in h."""
    value, rate = array(filtered.value), array(filtered.rate)
    terms = [value, rate]
    for k in range(12):
        forced = frequency**2 * command if k == 0 else 0.0
        terms.append(forced - frequency**2 * terms[k] - 2 * frequency * terms[k + 1])
    factor = np.cumprod([1.0, *(h / np.arange(1, 14))])
    return sum(f * x for f, x in zip(factor, terms, strict=True))


def test_hats_interpolate_between_their_nodes_and_hold_beyond():
    rng = np.random.default_rng(1)
    weights = rng.normal(size=(NODES, 3))
    for _ in range(20):
        x, spacing = rng.normal(size=3) * 6.0, rng.uniform(0.5, 3.0)
        said, phi = interpolated(weights, x / spacing)
        regressors = tuple(hats(float(one), spacing) for one in x)
        np.testing.assert_allclose(array(values(weight_matrix(weights), regressors)), said, atol=1e-12)
        errors = rng.normal(size=3)
        np.testing.assert_allclose(array(growth(regressors, column(errors))), phi * errors, atol=1e-12)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("flying", [1.0, 0.0])
def test_a_sample_of_place_and_speed(seed, flying):
    rng = np.random.default_rng(seed)
    x, reference, before, h = rng.normal(size=12) * 0.5, path(rng), memory(rng, flying=flying), 0.01
    thrust = 27.0 if flying else 0.5 * MASS * G
    measured = told(x, thrust)
    after = LAW.guide(before, measured, reference, GAINS, 0.0, h)
    v_c = array(reference.velocity) + array(before.speed_fed.value)
    e_1, e_2 = x[:3] - array(reference.position), x[3:6] - v_c
    left_1, left_2 = e_1 - array(before.xi_1), e_2 - array(before.xi_2)
    said, phi = interpolated(array(before.weights_1), x[3:6] / 3.0)
    asked = array(reference.acceleration) + array(before.speed_fed.rate) - K2 * e_2 - C1 * left_1 - said
    np.testing.assert_allclose(array(after.asked), asked, rtol=1e-9)
    np.testing.assert_allclose(array(after.compensated), left_2, rtol=1e-9)
    np.testing.assert_allclose(array(after.weights_1), array(before.weights_1) + flying * h * 16.0 * phi * left_2, rtol=1e-9)
    np.testing.assert_allclose(
        array(after.speed_fed.value), critically_damped(before.speed_fed, -K1 * e_1, 30.0, h), rtol=1e-6
    )
    could = thrust / MASS * turn(before.attitude.attitude).apply(UP) - G * UP
    sway = thrust / MASS * Rotation.from_rotvec(x[6:9]).apply(np.cross(array(before.xi_3), UP))
    xi_1 = -K1 * array(before.xi_1) + array(before.speed_fed.value) + K1 * e_1 + array(before.xi_2)
    xi_2 = -K2 * array(before.xi_2) + could - array(before.asked) + sway
    np.testing.assert_allclose(array(after.xi_1), array(before.xi_1) + flying * h * xi_1, rtol=1e-9)
    np.testing.assert_allclose(array(after.xi_2), array(before.xi_2) + flying * h * xi_2, rtol=1e-9)
    assert after.flying == flying
    force = MASS * (asked + G * UP)
    if np.linalg.norm(force) < GAINS.most_thrust and force[2] > 0.1 * GAINS.most_thrust:
        np.testing.assert_allclose(array(after.force), force, rtol=1e-9)
    unit = array(after.force) / np.linalg.norm(array(after.force))
    wanted = turn(after.wanted.attitude)
    np.testing.assert_allclose(wanted.apply(UP), unit, rtol=1e-9)
    jerk = MASS * array(reference.jerk) / np.linalg.norm(array(after.force))
    spin = wanted.apply(np.cross(array(after.wanted.rates), UP))
    np.testing.assert_allclose(spin, jerk - unit * (unit @ jerk), atol=1e-9)


def test_the_paths_snap_is_how_the_wanted_turn_changes():
    reference = STILL._replace(snap=vector(30.0, -20.0, 0.0))
    measured = told(np.zeros(12), thrust=MASS * G)
    begun = LAW.start(measured, GAINS)
    assert list(begun.force) == pytest.approx([0.0, 0.0, MASS * G])
    after = LAW.guide(begun, measured, reference, GAINS, 0.0, 0.01)
    bend = np.cross(array(after.wanted.turning), UP)
    np.testing.assert_allclose(bend, [30.0 / G, -20.0 / G, 0.0], atol=1e-9)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("flying", [1.0, 0.0])
def test_a_sample_of_attitude_and_rates(seed, flying):
    rng = np.random.default_rng(seed)
    x, before, h = rng.normal(size=12) * 0.5, memory(rng, flying=flying), 0.002
    thrust, torque = 27.0, rng.normal(size=3) * 0.1
    measured = told(x, thrust, torque)
    command, after = LAW.law(before, measured, STILL, GAINS, 0.0, h)
    body, model, wanted = Rotation.from_rotvec(x[6:9]), turn(before.attitude.attitude), turn(before.wanted.attitude)
    spin_r, spin_d, spin = (
        model.apply(array(before.attitude.rates)), wanted.apply(array(before.wanted.rates)), body.apply(x[9:])
    )  # fmt: skip
    away, ahead = (model.inv() * wanted).as_rotvec(), model.inv().apply(spin_d) - array(before.attitude.rates)
    entering = model.inv().apply(wanted.apply(array(before.wanted.turning)) - np.cross(spin_r, spin_d))
    turning = entering + TURN_FILTER**2 * away + 2.0 * TURN_FILTER * ahead
    fed = array(before.spin_fed.value)
    w_c = body.inv().apply(spin_r) + fed
    w_c_rate = body.inv().apply(model.apply(turning) - np.cross(spin, spin_r)) + array(before.spin_fed.rate)
    e_3, e_4 = (model.inv() * body).as_rotvec(), x[9:] - w_c
    left_3, left_4 = e_3 - array(before.xi_3), e_4 - array(before.xi_4)
    air = body.inv().apply(x[3:6])
    said, phi = interpolated(array(before.weights_2), [air[1] / 3.0, air[0] / 3.0, x[11]])
    asked = w_c_rate - K4 * e_4 - C3 * left_3 - said
    _, angular = accelerations(x, 0.0, array(command.torque), MASS, INERTIA)
    np.testing.assert_allclose(angular, asked, rtol=1e-8)
    np.testing.assert_allclose(array(after.asked_torque), array(command.torque))
    pull = thrust / MASS / C3 * np.cross(UP, body.inv().apply(array(before.compensated)))
    want = -K3 * e_3 - pull
    xi_3 = -K3 * array(before.xi_3) + fed - want + array(before.xi_4)
    xi_4 = -K4 * array(before.xi_4) + (torque - array(before.asked_torque)) / INERTIA
    np.testing.assert_allclose(array(after.xi_3), array(before.xi_3) + flying * h * xi_3, rtol=1e-9)
    np.testing.assert_allclose(array(after.xi_4), array(before.xi_4) + flying * h * xi_4, rtol=1e-9)
    np.testing.assert_allclose(array(after.weights_2), array(before.weights_2) + flying * h * 80.0 * phi * left_4, rtol=1e-9)
    np.testing.assert_allclose(array(after.spin_fed.value), critically_damped(before.spin_fed, want, 100.0, h), rtol=1e-6)
    rates = array(before.attitude.rates) + h * turning
    np.testing.assert_allclose(array(after.attitude.rates), rates, rtol=1e-9)
    later = model * Rotation.from_rotvec(h * rates)
    np.testing.assert_allclose(turn(after.attitude.attitude).as_matrix(), later.as_matrix(), atol=1e-12)
    assert command.thrust == pytest.approx(array(before.force) @ body.as_matrix()[:, 2])
    np.testing.assert_allclose(array(command.r2), -left_4, rtol=1e-9)
    np.testing.assert_allclose(array(command.r1), -array(before.compensated))
    np.testing.assert_allclose(array(command.desired_attitude), wanted.as_euler("ZYX"), atol=1e-12)
    norms = [np.linalg.norm(array(before.weights_1)), np.linalg.norm(array(before.weights_2))]
    assert list(command.weight_norms) == pytest.approx(norms)


def test_lyapunov_falls_as_theory_says_through_filters_and_limits():
    """V = c1 |p|^2 + |v|^2 + c3 |a|^2 + |w|^2 of the compensated errors, halved, + |W - W*|^2 / 2 Gamma, over a short step.

    Neither the thrust nor the torque is what was asked for, the filters lag, and W*^T phi pushes and twists: V falls by k
    times the squares all the same.
    """
    rng, h = np.random.default_rng(8), 1e-7
    x, reference, before = rng.normal(size=12) * 0.01, path(rng, 0.01), memory(rng, 0.01)
    ideal_1, ideal_2 = (array(w) + rng.normal(size=(NODES, 3)) * 0.05 for w in (before.weights_1, before.weights_2))
    thrust, torque = 0.97 * MASS * G, rng.normal(size=3) * 1e-3
    measured = told(x, thrust, torque)
    guided = LAW.guide(before, measured, reference, GAINS, 0.0, h)
    command, _ = LAW.law(guided, measured, reference, GAINS, 0.0, h)
    before = before._replace(asked=guided.asked, asked_torque=command.torque)
    _, after = LAW.law(LAW.guide(before, measured, reference, GAINS, 0.0, h), measured, reference, GAINS, 0.0, h)

    def left(memory, x, reference):
        body, model = Rotation.from_rotvec(x[6:9]), turn(memory.attitude.attitude)
        w_c = body.inv().apply(model.apply(array(memory.attitude.rates))) + array(memory.spin_fed.value)
        v_c = array(reference.velocity) + array(memory.speed_fed.value)
        errors = (x[:3] - array(reference.position), x[3:6] - v_c, (model.inv() * body).as_rotvec(), x[9:] - w_c)
        return [e - array(xi) for e, xi in zip(errors, (memory.xi_1, memory.xi_2, memory.xi_3, memory.xi_4), strict=True)]

    def energy(memory, x, reference):
        errors = sum(c * e @ e for c, e in zip((C1, 1.0, C3, 1.0), left(memory, x, reference), strict=True))
        off_1, off_2 = array(memory.weights_1) - ideal_1, array(memory.weights_2) - ideal_2
        return 0.5 * (errors + np.sum(off_1**2) / 16.0 + np.sum(off_2**2) / 80.0)

    air = Rotation.from_rotvec(x[6:9]).inv().apply(x[3:6])
    push, _ = interpolated(ideal_1, x[3:6] / 3.0)
    twist, _ = interpolated(ideal_2, [air[1] / 3.0, air[0] / 3.0, x[11]])
    linear, angular = accelerations(x, thrust, torque, MASS, INERTIA, MASS * push, INERTIA * twist)
    later = moved(x, linear, angular, h)
    onward = reference._replace(
        position=reference.position + h * reference.velocity, velocity=reference.velocity + h * reference.acceleration
    )
    p, v, a, w = left(before, x, reference)
    wanted = -(C1 * K1 * p @ p + K2 * v @ v + C3 * (K3 * a) @ a + (K4 * w) @ w)
    got = (energy(after, later, onward) - energy(before, x, reference)) / h
    assert got == pytest.approx(wanted, rel=0.02)


def test_no_more_force_is_asked_for_than_there_is():
    x = np.zeros(12)
    x[:3] = [40.0, -60.0, -50.0]
    measured = told(x, MASS * G)
    assert LAW.guide(LAW.start(measured, GAINS), measured, STILL, GAINS, 0.0, 0.01).force.norm() <= GAINS.most_thrust * 1.001


@pytest.mark.parametrize(("share", "flies"), [(0.78, 0.0), (0.82, 1.0)])
def test_it_flies_once_the_rotors_have_carried_most_of_its_weight(share, flies):
    measured = told(np.zeros(12), share * MASS * G)
    assert LAW.guide(LAW.start(measured, GAINS), measured, STILL, GAINS, 0.0, 0.01).flying == flies


def test_weights_keep_their_bounds():
    measured, before = told(np.zeros(12), MASS * G), memory(np.random.default_rng(4))
    tight = GAINS._replace(weight_bounds=vector(0.5, 0.7))
    assert LAW.guide(before, measured, STILL, tight, 0.0, 0.01).weights_1.norm() == pytest.approx(0.5)
    assert LAW.law(before, measured, STILL, tight, 0.0, 0.002)[1].weights_2.norm() == pytest.approx(0.7)


# Flights

flown = partial(error, "filtered-backstepping")


@pytest.mark.parametrize("preset", ["research-2.6kg", "crazyflie", "x500"])
def test_it_flies_a_figure_eight_and_a_fast_circle(preset):
    assert flown(EIGHT, preset) < 0.15
    assert flown(FAST, preset) < 0.15


def test_what_it_learns_makes_up_for_a_wind_that_it_knows_nothing_of():
    wind, here = {"mean": [5.0, 2.0, 0.0]}, {"type": "step", "start": [0, 0, 5], "end": [0, 0, 5], "duration": 8.0}
    errors = [flown(here, wind=wind, gains=gains) for gains in ({}, {"learning_1": 0.0, "learning_2": 0.0})]
    assert errors[0] < 0.1 * errors[1]
