"""The planner with LQR following: its polynomials against NumPy's solution of the boundary conditions, and flights."""

from functools import partial

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.spatial.transform import Rotation

from quadstep.control.lqr import HORIZON, Lqr, PlannedLqr
from quadstep.interfaces.plant import Reference
from quadstep.mission.listings import load_preset
from quadstep.numbers import vector
from quadstep.world.paths import Point, along, quintic
from tests.flights import array, column
from tests.followed import EIGHT, FAST, HERE, error
from tests.rigid import told

MODEL = load_preset("research-2.6kg").model()
LAW = PlannedLqr()
GAINS = LAW.prepare(PlannedLqr.gains(MODEL), MODEL)


def joined(start, end, span):
    """The polynomials in time of fifth degree with these values and first two rates at 0 and at `span`, one an axis."""
    rows = []
    for t in (0.0, span):
        for order in range(3):
            units = [Polynomial(unit).deriv(order)(t) if order else Polynomial(unit)(t) for unit in np.eye(6)]
            rows.append(units)
    return [Polynomial(c) for c in np.linalg.solve(np.array(rows), np.array([*start, *end])).T]


@pytest.mark.parametrize("span", [0.3, 1.0, 4.0])
def test_a_quintic_joins_both_ends_and_knows_its_rates(span):
    rng = np.random.default_rng(5)
    for _ in range(5):
        start, end = rng.normal(size=(3, 4)), rng.normal(size=(3, 4))
        p = quintic(Point(*map(column, start)), Point(*map(column, end)), span)
        wanted = joined(start, end, span)
        for t in (0.0, 0.3 * span, 0.7 * span, span):
            got = along(p, t, span)
            for order, one in enumerate(got):
                exact = [(axis.deriv(order) if order else axis)(t) for axis in wanted]
                np.testing.assert_allclose(array(one), exact, rtol=1e-8, atol=1e-8 / span**order)


def reference(rng, yaw, **more):
    place, speed, pull, jerk, snap = (column(rng.normal(size=3)) for _ in range(5))
    return Reference(place, speed, pull, yaw, 0.3, jerk, snap, **more)


@pytest.mark.parametrize("turns", [0.0, 2.0 * np.pi, -4.0 * np.pi])
@pytest.mark.parametrize("yaw", [0.2, 3.0, -3.0])
def test_a_plan_goes_from_the_vehicle_to_the_path_ahead_on_its_turn_of_yaw(yaw, turns):
    rng = np.random.default_rng(6)
    x = rng.normal(size=12)
    x[6:9] = Rotation.from_euler("ZYX", [yaw, 0.1, -0.2]).as_rotvec()
    later = reference(rng, yaw + turns + 0.5)
    here = reference(rng, yaw + turns - 0.4, ahead=(later,))
    measured = told(x)
    ends = [Point(*(column(rng.normal(size=4)) for _ in range(3))) for _ in range(2)]
    memory = LAW.start(measured, GAINS)._replace(plan=quintic(*ends, 1.0), begun=2.0)
    changing = array(along(memory.plan, 0.4, HORIZON)[2])
    after = LAW.plan(memory, measured, here, GAINS, 2.4, 0.4)
    start = [[*x[:3], yaw + turns], [*x[3:6], x[11]], changing]
    end = [[*array(v), w] for v, w in ((later.position, yaw + turns + 0.5), (later.velocity, 0.3), (later.acceleration, 0.0))]
    wanted = joined(start, end, 1.0)
    for t in (0.0, 0.35, 1.0):
        np.testing.assert_allclose(array(along(after.plan, t, HORIZON)[0]), [axis(t) for axis in wanted], atol=1e-9)
    assert (after.begun, after.lqr) == (2.4, memory.lqr)


def test_the_regulator_follows_the_plan_and_integrates_the_error_to_the_path():
    rng = np.random.default_rng(7)
    x, here = rng.normal(size=12) * 0.3, reference(rng, 0.1)
    measured = told(x, 26.0)
    ends = rng.normal(size=(6, 4)) * 0.3
    plan = quintic(Point(*map(column, ends[:3])), Point(*map(column, ends[3:])), 1.0)
    memory = LAW.start(measured, GAINS)._replace(plan=plan, begun=3.0)
    memory = memory._replace(lqr=memory.lqr._replace(integral=vector(0.1, -0.2, 0.3)))
    command, after = LAW.law(memory, measured, here, GAINS, 3.25, 0.002)
    axes = joined(ends[:3], ends[3:], 1.0)
    rates = [np.array([(axis.deriv(k) if k else axis)(0.25) for axis in axes]) for k in range(3)]
    planned = Reference(*(column(one[:3]) for one in rates), float(rates[0][3]), float(rates[1][3]))
    same, _ = Lqr().law(memory.lqr, measured, planned, GAINS, 0.0, 0.002)
    assert command.thrust == pytest.approx(same.thrust)
    np.testing.assert_allclose(array(command.torque), array(same.torque), rtol=1e-9)
    integral = np.array([0.1, -0.2, 0.3]) + 0.002 * (x[:3] - array(here.position))
    np.testing.assert_allclose(array(after.lqr.integral), integral)
    assert (after.plan, after.begun) == (memory.plan, memory.begun)
    far = memory._replace(lqr=memory.lqr._replace(integral=vector(30.0, -40.0, 0.0)))
    _, held = LAW.law(far, measured, here, GAINS, 3.25, 0.002)
    assert held.lqr.integral.norm() == pytest.approx(5.0)


def test_it_begins_with_a_plan_to_stay():
    x = np.arange(12) * 0.1
    memory = LAW.start(told(x), GAINS)
    yaw = Rotation.from_rotvec(x[6:9]).as_euler("ZYX")[0]
    place, *rates = along(memory.plan, 0.7, HORIZON)
    np.testing.assert_allclose(array(place), [*x[:3], yaw], atol=1e-12)
    assert all(one.norm() == 0.0 for one in rates)


# Flights

flown = partial(error, "planned-lqr")


@pytest.mark.parametrize("preset", ["research-2.6kg", "crazyflie", "x500"])
def test_it_flies_a_figure_eight_and_a_fast_circle_and_hovers_in_wind(preset):
    assert flown(EIGHT, preset) < 0.05
    assert flown(FAST, preset) < 0.08
    assert flown({**HERE, "duration": 10.0}, preset, wind={"mean": [3.0, 1.0, 0.0]}) < 0.01
