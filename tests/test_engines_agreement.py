"""Floats, arrays and lanes fly the same flight; a flight does not depend on its batch; the integrator against SciPy."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from quadstep.control.backstepping import Backstepping
from quadstep.control.nested_saturation import NestedSaturation
from quadstep.engines.eager import always, fly_floats
from quadstep.engines.engine import Engine
from quadstep.engines.fly import FlightPlan, fly, fly_all
from quadstep.engines.kernel import fly_lanes
from quadstep.engines.loop import Loop
from quadstep.interfaces.closed_loop import Outcome, Ticks
from quadstep.interfaces.plant import Kinematics
from quadstep.numbers import Table, exp, flatten, rebuild, vector, where
from quadstep.vehicle.in_space import COLUMNS
from quadstep.vehicle.lagrange import Lagrange
from quadstep.vehicle.paper import Disturbance, derivative
from quadstep.world.paths import Orbit, OrbitParameters
from quadstep.world.pieces import Piecewise
from tests.array_flights import fly_arrays
from tests.flights import CASE_1, NESTED, gains, nested_gains, parameters, same, state, vehicle
from tests.sweeps import TICKS, TILTED, UNEQUAL, WAYPOINTS

pytestmark = pytest.mark.usefixtures("optimised")

SHORT = Ticks(0.004, (1,), 5, 300)
ORBIT = OrbitParameters(same(0.0), vector(1.0, 1.0, 0.1), same(0.7), vector(0.0, 1.57, 0.3), 0.2, 0.3, 1.0)


def agree(log, other):
    """Equal in every number."""
    assert log.outcome is other.outcome
    assert log.ended == other.ended
    differing = (log.rows != other.rows).sum(axis=0)
    assert {name: count for name, count in zip(COLUMNS, differing, strict=True) if count} == {}
    assert [float(leaf) for leaf in flatten(log.final)] == [float(leaf) for leaf in flatten(other.final)]


@pytest.mark.parametrize("quicker", [8, pytest.param(1, marks=pytest.mark.thorough)])
def test_engines_agree_in_every_column_of_case_1(quicker):
    """Of its path flown so many times as quickly; on arrays, which are slow with one flight, its beginning."""
    ticks = TICKS._replace(last=TICKS.last // quicker)
    numbers = parameters(40.0 / quicker)
    floats = fly_floats(CASE_1, numbers, state(), ticks)
    assert floats.outcome is Outcome.COMPLETED
    assert floats.rows.shape == (2000 // quicker + 1, len(COLUMNS))
    agree(fly_lanes(CASE_1, [numbers], [state()], ticks)[0], floats)
    part = ticks._replace(last=ticks.last // 10)
    arrays = fly_arrays(CASE_1, [numbers], [state()], part)[0]
    assert (arrays.outcome, arrays.ended) == (Outcome.COMPLETED, part.last * part.step)
    np.testing.assert_array_equal(arrays.rows, floats.rows[: part.last // 5 + 1])


FLIGHTS = {
    "backstepping": (CASE_1, parameters(6.0, vehicle=UNEQUAL), TILTED),
    "printed kinematics": (Loop(Lagrange(Kinematics.PRINTED), CASE_1.path, CASE_1.controller),
        parameters(6.0, vehicle=UNEQUAL), TILTED),
    "rotor limits": (Loop(Lagrange(rotor_limits=True), CASE_1.path, CASE_1.controller), parameters(6.0, vehicle=UNEQUAL),
        state()),
    "late learning": (CASE_1, parameters(6.0, gains=gains(start=1.0)), TILTED),
    "disturbed": (CASE_1, parameters(disturbance=Disturbance(0.7, vector(0.1, 0.2, 0.3), same(-0.2))), TILTED),
    "nested saturation": (NESTED, parameters(5.0, gains=nested_gains()), TILTED),
    "nested saturation, printed": (Loop(Lagrange(Kinematics.PRINTED), NESTED.path, NestedSaturation(Kinematics.PRINTED)),
        parameters(5.0, vehicle=UNEQUAL, gains=nested_gains(inertia=UNEQUAL.inertia)), TILTED),
    "waypoints": (Loop(Lagrange(), Piecewise(), Backstepping()), parameters(path=WAYPOINTS), state()),
    "orbit": (Loop(Lagrange(), Orbit(), Backstepping()), parameters(path=ORBIT), state((0.0, 1.0, 0.0))),
}  # fmt: skip


@pytest.mark.parametrize("name", FLIGHTS)
def test_engines_agree_on_other_laws_and_paths(name):
    loop, numbers, start = FLIGHTS[name]
    floats = fly_floats(loop, numbers, start, SHORT)
    assert len(floats.rows) > 20
    agree(fly_lanes(loop, [numbers], [start], SHORT)[0], floats)
    ticks = SHORT._replace(last=60)
    agree(fly_arrays(loop, [numbers, numbers], [start, start], ticks)[1], fly_floats(loop, numbers, start, ticks))


@pytest.mark.parametrize("ticks", [Ticks(0.002, (2,), 10, 300), Ticks(0.002, (5,), 3, 100), Ticks(0.001, (1,), 7, 50)])
def test_engines_agree_whatever_the_clock(ticks):
    start = TILTED
    floats = fly_floats(CASE_1, parameters(), start, ticks)
    assert len(floats.rows) == ticks.last // ticks.log + 1
    np.testing.assert_allclose(floats.column("t"), np.arange(len(floats.rows)) * ticks.step * ticks.log, atol=1e-12)
    agree(fly_lanes(CASE_1, [parameters()], [start], ticks)[0], floats)
    agree(fly_arrays(CASE_1, [parameters()], [start], ticks)[0], floats)


def test_floats_go_on_where_python_raises():
    law = always(lambda x, y: (where(x > 0.0, 1.0 / x, 2.0), vector(y / x, exp(1.0 / x)), y))
    with np.errstate(all="raise"):
        chosen, lost, kept = law(0.0, 3.0)
        assert (chosen, lost[0], lost[1], kept) == (2.0, np.inf, np.inf, 3.0)
        assert {type(leaf) for leaf in (chosen, *lost, kept)} == {float}
        assert law(0.5, 3.0)[0] == 2.0


def test_single_precision_lanes_stay_near_double():
    double, single = (fly_lanes(CASE_1, [parameters()], [state()], TICKS, double=d)[0] for d in (True, False))
    assert single.outcome is Outcome.COMPLETED
    places = [log.table("x", "y", "z", "theta", "phi") for log in (double, single)]
    np.testing.assert_allclose(*places, atol=1e-4)


def batch_of_seven():
    rng = np.random.default_rng(81)
    numbers = [
        parameters(
            float(rng.uniform(3, 8)),
            end=rng.normal(size=3),
            vehicle=vehicle(rng.uniform(4, 8, 3), mass=float(rng.uniform(0.8, 1.2))),
            gains=gains(start=float(rng.uniform(0, 1)), mass=float(rng.uniform(0.8, 1.2))),
            disturbance=Disturbance(float(rng.uniform()), same(float(rng.normal() / 10)), same(0.0)),
        )
        for _ in range(7)
    ]
    starts = [state(position=rng.normal(size=3) / 10, attitude=rng.normal(size=3) / 10) for _ in range(7)]
    return numbers, starts


def same_bits(one, other):
    assert one.outcome is other.outcome
    assert one.ended == other.ended
    assert one.rows.tobytes() == other.rows.tobytes()
    assert flatten(one.final) == flatten(other.final)


@pytest.mark.parametrize("double", [True, False], ids=["f64", "f32"])
def test_a_flight_on_lanes_is_the_same_to_the_bit_alone_in_a_batch_and_in_any_order(double):
    numbers, starts = batch_of_seven()
    together = fly_lanes(CASE_1, numbers, starts, SHORT, double=double)
    assert len({log.rows.tobytes() for log in together}) == 7
    for i, log in enumerate(together):
        same_bits(fly_lanes(CASE_1, [numbers[i]], [starts[i]], SHORT, double=double)[0], log)
    order = [4, 0, 6, 3, 5, 1, 2]
    shuffled = fly_lanes(CASE_1, [numbers[i] for i in order], [starts[i] for i in order], SHORT, double=double)
    for place, i in enumerate(order):
        same_bits(shuffled[place], together[i])


def test_plans_of_different_structure_fly_together_and_come_back_in_order():
    other_path = rebuild(WAYPOINTS, iter([Table(2.0 * leaf.array[::1]) for leaf in flatten(WAYPOINTS)]))
    numbers = {
        "seed 1": (CASE_1, parameters(gains=gains(seed=1)), SHORT),
        "nested": (NESTED, parameters(gains=nested_gains()), SHORT),
        "seed 2": (CASE_1, parameters(gains=gains(seed=2)), SHORT),
        "eight neurons": (CASE_1, parameters(gains=gains(neurons=8)), SHORT),
        "waypoints": (Loop(Lagrange(), Piecewise(), Backstepping()), parameters(path=WAYPOINTS), SHORT),
        "other waypoints": (Loop(Lagrange(), Piecewise(), Backstepping()), parameters(path=other_path), SHORT),
        "other clock": (CASE_1, parameters(gains=gains(seed=1)), SHORT._replace(last=200)),
    }
    plans = [FlightPlan(loop, one, TILTED, ticks) for loop, one, ticks in numbers.values()]
    together = fly_all(plans)
    assert len({log.rows.tobytes() for log in together}) == len(plans)
    for plan, log in zip(plans, together, strict=True):
        same_bits(fly(plan), log)
    for plan, log in zip(plans[1:4], fly_all(plans[1:4], Engine.PYTHON), strict=True):
        agree(fly(plan), log)


def test_closed_loop_agrees_with_scipy_on_the_same_held_commands():
    numbers = parameters(6.0, vehicle=vehicle((5, 8, 12)))
    log = fly_lanes(CASE_1, [numbers], [TILTED], Ticks(0.001, (4,), 4, 1600))[0]
    names = ["x", "y", "z", "x_dot", "y_dot", "z_dot", "psi", "theta", "phi", "psi_dot", "theta_dot", "phi_dot"]
    states, commands = log.table(*names), log.table("u", "tau_psi", "tau_theta", "tau_phi")
    now = states[0]
    for tick in range(400):
        u, *tau = commands[tick].tolist()

        def rate(_, leaves, u=u, tau=tau):
            motion = rebuild(TILTED, iter(leaves.tolist()))
            return flatten(derivative(numbers.vehicle, numbers.disturbance, Kinematics.STANDARD, motion, u, vector(*tau)))

        now = solve_ivp(rate, (0, 0.004), now, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
        np.testing.assert_allclose(states[tick + 1], now, atol=1e-9)


@pytest.mark.parametrize("duration", [40.0, 5.0])
def test_halving_the_step_of_the_integrator_moves_case_1_by_less_than_a_micrometre(duration):
    coarse, fine = (
        fly_lanes(CASE_1, [parameters(duration)], [state()], ticks)[0]
        for ticks in (Ticks(0.002, (2,), 10, 20000), Ticks(0.001, (4,), 20, 40000))
    )
    places = [log.table("x", "y", "z") for log in (coarse, fine)]
    assert np.abs(places[0] - places[1]).max() < 1e-6


@pytest.mark.parametrize(("duration", "error"), [(10.0, 0.9e-3), (6.0, 1.2e-2), (5.0, 4e-2), (4.0, 12.5e-2)])
def test_error_on_the_way_grows_with_haste_as_in_the_reading(duration, error):
    log = fly_lanes(CASE_1, [parameters(duration)], [state()], Ticks(0.002, (2,), 10, round(duration * 500)))[0]
    off = log.table("x", "y", "z") - log.table("x_d", "y_d", "z_d")
    assert np.sqrt(np.mean(np.sum(off**2, axis=1))) == pytest.approx(error, rel=0.06)
