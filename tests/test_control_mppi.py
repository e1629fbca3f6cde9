"""Path integral control against a rollout and an average written with arrays; its noise; as a law, term by term."""

import math

import numpy as np
import pytest

from quadstep import fly
from quadstep.control.mppi import FRESH, KEPT, MOST_DRAWS, SAMPLES, STAGE, STAGES, STREAM, Mppi
from quadstep.interfaces.controller import Measured
from quadstep.interfaces.plant import Reference
from quadstep.mission.multirotor import MultirotorMission
from quadstep.numbers import Matrix, Vector, vector
from quadstep.numbers.noise import key, normals
from quadstep.numbers.rotations import IDENTITY, from_rotation_vector
from tests.flights import array

ZERO = vector(0.0, 0.0, 0.0)
HERE = Reference(ZERO, ZERO, ZERO, 0.0, 0.0)
MASS, G = 2.644, 9.81
INERTIA = np.array([0.03, 0.03, 0.05])
KEY = key(5, 3)


def mission(vehicle="research-2.6kg", path=None, **content):
    step = {"type": "step", "start": [0.0, 0.0, 5.0], "end": [0.0, 0.0, 5.0], "duration": 3.0}
    return MultirotorMission.model_validate(
        {"vehicle": {"preset": vehicle}, "path": path or step, "controller": {"type": "mppi"}, **content}
    )


@pytest.fixture(scope="module")
def gains():
    return mission().plan().parameters.gains


def known(**changes):
    return Measured(ZERO, ZERO, IDENTITY, ZERO, MASS * G, ZERO, noise=KEY)._replace(**changes)


def ahead(reference, later=None):
    return reference._replace(ahead=(later or reference,) * (STAGES - 1))


def expected(gains, plan, away, wanted, drawn, period):
    """The next plan: every sample as its own rollout, all costs first, then one weighted mean."""
    share = period / STAGE
    plan = plan + share * (np.vstack([plan[1:], plan[-1:]]) - plan)
    noise = np.array([list(normals(KEY, STREAM, float(drawn + i), 3)) for i in range(SAMPLES * STAGES)])
    noise = noise.reshape(SAMPLES, STAGES, 3) * list(gains.deviation)
    noise[0] = 0.0
    tried = np.zeros_like(noise)
    for k in range(STAGES):
        tried[:, k] = KEPT * (tried[:, k - 1] if k else 0.0) + FRESH * noise[:, k]
    costs = np.zeros(SAMPLES)
    follows = 1.0 - math.exp(-STAGE / gains.lag)
    for sample in range(SAMPLES):
        p, v, a = away[0].copy(), away[1].copy(), plan[0].copy()
        for k in range(STAGES):
            asked = wanted[k] + plan[k] + tried[sample, k]
            most = gains.most_thrust / gains.mass
            lift = np.clip(asked[2], 0.1 * most, 0.95 * most)
            level, room = asked[:2], math.sqrt(most**2 - lift**2)
            had = np.array([*(level * min(1.0, room / np.hypot(*level))), lift]) - wanted[k]
            a = a + follows * (had - a)
            p = p + STAGE * v + STAGE**2 / 2.0 * a
            v = v + STAGE * a
            stage = gains.position * p @ p + gains.velocity * v @ v
            effort = plan[k] + tried[sample, k]
            costs[sample] += stage * (gains.last if k == STAGES - 1 else 1.0) + gains.effort * effort @ effort
    weights = np.exp((costs.min() - costs) / gains.temperature)
    return plan + np.einsum("s,ski->ki", weights / weights.sum(), tried)


@pytest.mark.parametrize("drawn", [0, 768])
def test_the_plan_is_the_weighted_mean_of_what_was_tried(gains, drawn):
    rng = np.random.default_rng(2)
    plan, away = rng.normal(size=(STAGES, 3)), (0.3 * rng.normal(size=3), rng.normal(size=3))
    accelerations, push = 6.0 * rng.normal(size=(STAGES, 3)), np.array([0.5, -0.4, 0.3])
    references = tuple(
        HERE._replace(position=vector(1.0, 2.0, 3.0), velocity=vector(0.1, 0.2, 0.3), acceleration=Vector(row))
        for row in accelerations
    )
    law = Mppi()
    memory = law.start(known(), gains)._replace(
        plan=Matrix(Vector(map(float, row)) for row in plan), drawn=float(drawn), push=Vector(push)
    )
    measured = known(position=Vector(away[0] + [1.0, 2.0, 3.0]), velocity=Vector(away[1] + [0.1, 0.2, 0.3]))
    after = law.guide(memory, measured, references[0]._replace(ahead=references[1:]), gains, 0.0, 0.02)
    wanted = accelerations - push + [0.0, 0.0, G]
    np.testing.assert_allclose(array(after.plan), expected(gains, plan, away, wanted, drawn, 0.02), atol=1e-9)
    assert after.drawn == drawn + SAMPLES * STAGES


def test_the_counter_of_draws_begins_anew_while_it_is_whole(gains):
    law = Mppi()
    memory = law.start(known(), gains)
    late, fresh = (law.guide(memory._replace(drawn=d), known(), ahead(HERE), gains, 0.0, 0.02) for d in (MOST_DRAWS, 0.0))
    assert array(late.plan).tolist() == array(fresh.plan).tolist()
    assert late.drawn == fresh.drawn == SAMPLES * STAGES


def test_a_plan_leads_back_to_the_path(gains):
    law = Mppi()
    measured, memory = known(position=vector(0.5, -0.5, 0.2)), law.start(known(), gains)
    for _ in range(30):
        memory = law.guide(memory, measured, ahead(HERE), gains, 0.0, 0.02)
    assert [np.sign(one) for one in memory.plan.rows[0]] == [-1.0, 1.0, -1.0]


def asked(gains, reference=HERE, memory=None, **changes):
    law = Mppi()
    measured = known(**changes)
    return law.law(memory or law.start(measured, gains), measured, ahead(reference), gains, 0.0, 0.002)


def test_the_first_stage_becomes_thrust_and_attitude(gains):
    fresh = Mppi().start(known(), gains)
    rows = fresh.plan.rows
    command, _ = asked(
        gains, memory=fresh._replace(plan=Matrix([vector(0.0, 0.0, 2.0), *rows[1:]]), push=vector(0.0, 0.0, 0.5))
    )
    assert command.thrust == pytest.approx(MASS * (G + 1.5))
    command, _ = asked(gains, memory=fresh._replace(plan=Matrix([vector(1.0, -0.5, 0.0), *rows[1:]])))
    lean = np.array([0.5, 1.0]) / math.hypot(1.0, 0.5) * math.sin(math.atan(math.hypot(1.0, 0.5) / G))
    np.testing.assert_allclose(list(command.torque)[:2], INERTIA[:2] * 270.0 * lean, rtol=0.01)
    leaning, _ = asked(gains, attitude=from_rotation_vector(vector(0.3, 0.0, 0.0)))
    assert leaning.thrust == pytest.approx(MASS * G * math.cos(0.3))
    command, _ = asked(gains, HERE._replace(acceleration=vector(0.0, 0.0, 1.0)))
    assert command.thrust == pytest.approx(MASS * (G + 1.0))


def test_its_attitude_loop_feeds_forward_damps_and_knows_the_gyroscopic_torque(gains):
    rates = np.array([0.5, -0.4, 0.3])
    command, _ = asked(gains, rates=Vector(rates))
    torque = INERTIA * (-np.array([35.0, 35.0, 17.0]) * rates) + np.cross(rates, INERTIA * rates)
    np.testing.assert_allclose(list(command.torque), torque, rtol=1e-9)
    turn = np.array([0.01, -0.02, 0.03])
    command, _ = asked(gains, attitude=from_rotation_vector(Vector(turn)))
    np.testing.assert_allclose(list(command.torque), -INERTIA * [270.0, 270.0, 70.0] * turn, rtol=1e-3)
    command, _ = asked(gains, HERE._replace(snap=vector(3.0, -2.0, 0.0)))
    np.testing.assert_allclose(list(command.torque), INERTIA * [2.0 / G, 3.0 / G, 0.0], atol=1e-9)
    command, _ = asked(gains, HERE._replace(jerk=vector(2.0, 1.0, 0.0)))
    np.testing.assert_allclose(list(command.torque)[:2], INERTIA[:2] * 35.0 * [-1.0 / G, 2.0 / G], rtol=1e-9)
    turning, _ = asked(gains, HERE._replace(yaw_rate=0.5), rates=vector(0.2, 0.0, 0.0))
    assert turning.torque[1] == pytest.approx(0.03 * 0.2 * 0.5)


def test_the_observer_knows_thrust_gravity_and_lean(gains):
    lean = from_rotation_vector(vector(0.3, 0.0, 0.0))
    memory = Mppi().start(known(), gains)._replace(push=vector(0.1, 0.2, 0.3))
    _, after = asked(gains, memory=memory, attitude=lean, thrust=30.0)
    pulled = 30.0 / MASS * np.array([0.0, -math.sin(0.3), math.cos(0.3)]) - [0.0, 0.0, G]
    np.testing.assert_allclose(list(after.velocity), 0.002 * (pulled + np.array([0.1, 0.2, 0.3])), atol=1e-12)
    _, after = asked(gains, memory=memory, velocity=vector(0.0, 0.5, 0.0))
    assert list(after.push) == pytest.approx([0.1, 0.2 + 0.002 * 64.0 * 0.5, 0.3])


@pytest.mark.parametrize("vehicle", ["research-2.6kg", "crazyflie", "x500"])
def test_it_flies_a_vertical_figure_eight(vehicle):
    path = {"type": "figure-eight", "plane": "vertical", "centre": [0, 0, 5], "length": 2.0, "width": 1.0, "period": 5.0}
    flight = fly(mission(vehicle, path).plan())
    assert flight.metrics()["position_rmse[m]"] < 0.08


def test_a_flight_is_its_own_on_floats_and_lanes_and_another_seed_is_another():
    one, other = (mission(simulation={"duration": 0.06}, seed=seed).plan() for seed in (1, 2))
    lanes = fly(one)
    np.testing.assert_array_equal(lanes.rows, fly(one, engine="python").rows)
    assert not np.array_equal(lanes.rows, fly(other).rows)
