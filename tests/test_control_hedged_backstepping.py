"""Adaptive backstepping with hedging: what it adds to the law, one sample against NumPy and SciPy, and flights."""

from functools import partial

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quadstep.control.filters import FilteredAttitude
from quadstep.control.hedged_backstepping import LAW, HedgedBackstepping
from quadstep.interfaces.plant import Reference
from quadstep.mission.listings import load_preset
from quadstep.numbers import Matrix, flatten
from tests.flights import array, column, same
from tests.followed import EIGHT, FAST, HERE, followed
from tests.rigid import accelerations, quaternion, told, turn

QUICK = {
    "Lambda1": 3.6,
    "K_r1": 12.0,
    "Lambda2": (10.0, 10.0, 5.0),
    "K_r2": (40.0, 40.0, 20.0),
    "P": 10.0,
    "filter_frequency": (20.0, 20.0, 10.0),
}
MODEL = load_preset("research-2.6kg").model()
HEDGED, GAINS = HedgedBackstepping(), HedgedBackstepping.gains(MODEL, QUICK)
MASS, INERTIA, G, LAG = MODEL.mass, array(MODEL.inertia), 9.81, 0.04
SLOPE, GAIN, FREQUENCY = 3.6, 12.0, np.array([20.0, 20.0, 10.0])


def memory(rng, measured, flying):
    """Any: everything different from everything else."""
    one = lambda size=1.0: column(rng.normal(size=3) * size)  # noqa: E731
    lean = lambda: quaternion(Rotation.from_rotvec(rng.normal(size=3) * 0.2))  # noqa: E731
    start = HEDGED.start(measured, GAINS)
    weights = [Matrix([one() for _ in range(10)]) for _ in range(2)]
    law = start.law._replace(
        integral_1=one(0.1), integral_2=one(0.1), weights_1=weights[0], weights_2=weights[1], flying=flying, wanted=lean(),
        filtered=FilteredAttitude(lean(), one(0.5), one(2.0)), force=column([1.0, -2.0, MASS * G]), asked_torque=one(0.1),
        asked_thrust=26.0,
    )  # fmt: skip
    made = start.made._replace(thrust=24.0, torque=one(0.1))
    return start._replace(law=law, place=one(0.3), speed=one(), made=made, rates=one(0.5), turning=one(3.0), asked=one(2.0))


def sample(seed, flying):
    rng = np.random.default_rng(seed)
    x = rng.normal(size=12) * np.repeat([0.3, 1.0, 0.3, 0.5], 3)
    measured = told(x, 26.0, rng.normal(size=3) * 0.1)
    reference = Reference(*(column(rng.normal(size=3)) for _ in range(3)), 0.3, 0.2, column(rng.normal(size=3)), same(0.5))
    return x, measured, reference, memory(rng, measured, flying)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("flying", [1.0, 0.0])
def test_the_target_moves_as_the_loop_would_less_what_is_not_made(seed, flying):
    x, measured, reference, before = sample(seed, flying)
    period = 0.01
    after = HEDGED.guide(before, measured, reference, GAINS, 0.0, period)
    place, speed = (array(before.place), array(before.speed)) if flying else (x[:3], x[3:6])
    path = [array(part) for part in (reference.position, reference.velocity, reference.acceleration)]
    wanted = path[2] + SLOPE * (GAIN - SLOPE) * (path[0] - place) + GAIN * (path[1] - speed)
    made = 24.0 / MASS * turn(measured.attitude).as_matrix()[:, 2] - [0.0, 0.0, G]
    later = speed + flying * period * (wanted - (array(before.asked) - made))
    np.testing.assert_allclose(array(after.speed), later, rtol=1e-9)
    np.testing.assert_allclose(array(after.place), place + period * later, rtol=1e-9)

    # the law, about that target instead of the path
    target = reference._replace(position=column(place), velocity=column(speed), acceleration=column(wanted))
    law = LAW.guide(before.law, measured, target, GAINS.law, 0.0, period)
    np.testing.assert_allclose(list(flatten(after.law)), list(flatten(law)), rtol=1e-9)
    e1, e1_dot = place - x[:3], speed - x[3:6]
    r1 = e1_dot + SLOPE * e1
    np.testing.assert_allclose(array(law.r1), r1, rtol=1e-9)
    net = array(after.asked) - (wanted - SLOPE**2 * e1 + GAIN * r1 + array(GAINS.law.integral_1 * before.law.integral_1))
    rows = np.array([list(row) for row in GAINS.law.force_net.input_weights])
    axis = turn(measured.attitude).as_matrix()[:, 2]
    inputs = np.concatenate([x[3:6] / 5.0, axis, array(before.law.force) / (MASS * 10.0)])
    mu = 1.0 / (1.0 + np.exp(-(rows[:, :-1] @ inputs + rows[:, -1])))
    said = np.array([list(row) for row in before.law.weights_1]).T @ mu
    np.testing.assert_allclose(net, said, atol=1e-9)  # measured.thrust carries the weight: it flies now
    direction = turn(law.wanted).as_matrix()[:, 2]
    jerk, force = MASS * array(reference.jerk), np.linalg.norm(array(law.force))
    spin = turn(law.wanted).apply(np.cross(array(after.rates), [0.0, 0.0, 1.0]))
    np.testing.assert_allclose(spin, (jerk - direction * (direction @ jerk)) / force, atol=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_the_filter_is_led_and_waits_for_lagging_rotors(seed):
    x, measured, reference, before = sample(seed, 1.0)
    period = 0.002
    command, after = HEDGED.law(before, measured, reference, GAINS, 1.0, period)
    body, model, wanted = (turn(q) for q in (measured.attitude, before.law.filtered.attitude, before.law.wanted))
    share = 1.0 - np.exp(-period / LAG)
    made = array(before.made.torque) + share * (array(measured.torque) - array(before.made.torque))
    np.testing.assert_allclose(array(after.made.torque), made, rtol=1e-9)
    assert after.made.thrust == pytest.approx(24.0 + share * 2.0)

    # all in world axes, which no step of the law uses
    spin_m, spin_d = model.apply(array(before.law.filtered.rates)), wanted.apply(array(before.rates))
    led = model.inv().apply(wanted.apply(array(before.turning)) - np.cross(spin_m, spin_d))
    away = (model.inv() * wanted).as_rotvec()
    turning = led + FREQUENCY**2 * away + 2.0 * FREQUENCY * model.inv().apply(spin_d - spin_m)
    hedge = model.inv().apply(body.apply((array(before.law.asked_torque) - made) / INERTIA))
    filtered = after.law.filtered
    np.testing.assert_allclose(array(filtered.acceleration), turning, rtol=1e-8)
    np.testing.assert_allclose(array(filtered.rates), array(before.law.filtered.rates) + period * (turning - hedge), rtol=1e-8)
    moved = model * Rotation.from_rotvec(period * array(filtered.rates))
    np.testing.assert_allclose(turn(filtered.attitude).as_matrix(), moved.as_matrix(), atol=1e-12)

    # Eq. 35 about that filter: the angular acceleration of a rigid body under the torque
    e2 = (body.inv() * moved).as_rotvec()
    rates = body.inv().apply(moved.apply(array(filtered.rates)))
    slope, gain = np.array([10.0, 10.0, 5.0]), np.array([40.0, 40.0, 20.0])
    r2 = rates - x[9:] + slope * e2
    np.testing.assert_allclose(array(command.r2), r2, rtol=1e-8)
    rigid = body.inv().apply(moved.apply(turning)) - np.cross(x[9:], rates) + slope * (rates - x[9:])
    feedback = gain * r2 + array(GAINS.law.integral_2 * before.law.integral_2) + 10.0 * e2
    _, angular = accelerations(x, 0.0, array(command.torque), MASS, INERTIA)
    said = angular - rigid - feedback
    rows = np.array([list(row) for row in GAINS.law.torque_net.input_weights])
    inputs = np.concatenate([body.inv().apply(x[3:6]) / 5.0, x[9:] / 5.0, (rigid - slope * (rates - x[9:])) / 50.0])
    mu = 1.0 / (1.0 + np.exp(-(rows[:, :-1] @ inputs + rows[:, -1])))
    np.testing.assert_allclose(said, np.array([list(row) for row in before.law.weights_2]).T @ mu, atol=1e-8)


# Flights

flown = partial(followed, "hedged-backstepping")


@pytest.mark.parametrize("preset", ["research-2.6kg", "crazyflie", "x500"])
def test_it_flies_a_figure_eight_and_a_fast_circle(preset):
    assert flown(EIGHT, preset).metrics()["position_rmse[m]"] < 0.06
    assert flown(FAST, preset).metrics()["position_rmse[m]"] < 0.12


def test_what_the_rotors_cannot_do_is_hardly_learnt():
    """A place 15 m above, out of reach at once: what is learnt from is small beside the error to the path."""
    flight = flown({"type": "step", "start": [0.0, 0.0, 5.0], "end": [0.0, 0.0, 20.0], "time": 1.0, "duration": 8.0})
    off = flight.column("z_d") - flight.column("z")
    assert off.max() == pytest.approx(15.0, abs=0.1)
    assert flight.column("norm_r1").max() < 0.1 * SLOPE * off.max()
    assert abs(off[-1]) < 0.05


def test_its_nets_make_up_for_a_wind_that_it_knows_nothing_of():
    wind, alone = {"mean": [8.0, 0.0, 0.0]}, {"K_i1": 0.0}
    errors = [
        flown(HERE, gains={"nets": {"enabled": on}, **alone}, wind=wind).metrics()["position_rmse[m]"] for on in (True, False)
    ]
    assert errors[0] < 0.2 * errors[1]
