"""Metrics summed while flying, and very many flights at once: the same as from logs, on every engine, in every batch."""

from pathlib import Path

import numpy as np
import pytest

from quadstep import flight_metrics
from quadstep.control.backstepping import Backstepping
from quadstep.control.opaque import flying
from quadstep.engines.eager import fly_floats
from quadstep.engines.kernel import fly_lanes
from quadstep.engines.loop import Loop
from quadstep.engines.scored import Score, metrics, scored
from quadstep.engines.sweep import KERNELS, Sweep, number_names, places, prepare
from quadstep.interfaces.closed_loop import Outcome
from quadstep.metrics.reductions import Largest, LargestLength, Rms, RmsLength, Variation
from quadstep.mission.read import read_mission
from quadstep.numbers import Vector, flatten, rebuild, vector
from quadstep.vehicle.lagrange import Lagrange, Limits
from quadstep.world.pieces import Piecewise
from tests.array_flights import fly_arrays
from tests.flights import CASE_1, METRICS, NESTED, nested_gains, parameters, state
from tests.sweeps import CLOCK, LOOP, NUMBERS, PLACES, SWEEP_TICKS, TILTED, VARYING, WAYPOINTS, sweep, table, values

KINDS = pytest.mark.parametrize("double", [True, False], ids=["f64", "f32"])


def score_of(log):
    """The metrics of a flight of a scored loop, by name."""
    arrays = rebuild(log.final.score, iter([np.array([leaf], dtype=float) for leaf in flatten(log.final.score)]))
    return dict(zip(METRICS, metrics(arrays)[0].tolist(), strict=True))


def with_values(row):
    """(start, parameters) of one flight of a sweep."""
    leaves = flatten((TILTED, NUMBERS))
    for place, value in zip(PLACES, row, strict=True):
        leaves[place] = value
    return rebuild((TILTED, NUMBERS), iter(leaves))


ENGINES = {
    "floats": fly_floats,
    "arrays": lambda loop, numbers, start, ticks: fly_arrays(loop, [numbers] * 2, [start] * 2, ticks)[1],
    "lanes": lambda loop, numbers, start, ticks: fly_lanes(loop, [numbers], [start], ticks)[0],
}


@pytest.mark.parametrize("engine", ENGINES)
def test_a_score_is_what_the_log_of_the_same_flight_says(engine):
    log = ENGINES[engine](LOOP, NUMBERS, TILTED, CLOCK)
    score, wanted = score_of(log), flight_metrics(fly_floats(CASE_1, NUMBERS, TILTED, SWEEP_TICKS))
    assert log.outcome is Outcome.COMPLETED
    assert float(log.final.score.samples) == 61
    assert score["position_rmse[m]"] == pytest.approx(wanted["position_rmse[m]"], rel=1e-9)
    for ours, theirs, unit in zip(
        ("thrust[N]", "torque_1[N m]", "torque_2[N m]", "torque_3[N m]"),
        ("u", "tau_psi", "tau_theta", "tau_phi"),
        ("N", "N m", "N m", "N m"),
        strict=True,
    ):
        assert score[f"variation_{ours}"] == pytest.approx(wanted[theirs][f"total_variation[{unit}]"], rel=1e-8)


def test_largest_error_effort_and_weights_of_a_score():
    log = fly_lanes(CASE_1, [NUMBERS], [TILTED], SWEEP_TICKS)[0]
    score = score_of(fly_lanes(LOOP, [NUMBERS], [TILTED], CLOCK)[0])
    off = np.linalg.norm(log.table("x", "y", "z") - log.table("x_d", "y_d", "z_d"), axis=1)
    inputs = log.table("u", "tau_psi", "tau_theta", "tau_phi")
    assert score["largest_error[m]"] == pytest.approx(off.max(), rel=1e-9)
    efforts = [score[name] for name in METRICS if name.startswith("effort")]
    np.testing.assert_allclose(efforts, np.sqrt(np.mean(inputs**2, axis=0)), rtol=1e-9)
    for name in ("norm_W1", "norm_W2"):
        assert score[f"largest_{name}"] == pytest.approx(log.column(name).max(), rel=1e-9)


@pytest.mark.parametrize("every", [1, 7])
def test_a_score_of_another_period(every):
    loop, ticks = scored(CASE_1, SWEEP_TICKS, 0.004 * every)
    score = score_of(fly_floats(loop, NUMBERS, TILTED, ticks._replace(last=60)))
    wanted = flight_metrics(fly_floats(CASE_1, NUMBERS, TILTED, SWEEP_TICKS._replace(log=every, last=60)))
    assert score["position_rmse[m]"] == pytest.approx(wanted["position_rmse[m]"], rel=1e-12)
    assert score["variation_thrust[N]"] == pytest.approx(wanted["u"]["total_variation[N]"], rel=1e-12)


def test_a_controller_without_nets_scores_no_weights():
    loop, ticks = scored(NESTED, SWEEP_TICKS._replace(last=50), 0.02)
    log = fly_lanes(loop, [parameters(5.0, gains=nested_gains())], [TILTED], ticks)[0]
    assert list(log.final.score.sums[-1].so_far) == [0.0, 0.0]


def test_a_loop_may_say_itself_what_is_scored():
    class Own(Loop):
        def position_error(self, cycle, parameters, time):
            return vector(3.0, 4.0, 0.0)

        def inputs(self, cycle):
            return vector(2.0, -1.0)

        def weight_norms(self, cycle):
            return vector(7.0, 8.0)

    loop, ticks = scored(Own(CASE_1.plant, CASE_1.path, CASE_1.controller), SWEEP_TICKS._replace(last=50), 0.02)
    score = fly_lanes(loop, [NUMBERS], [TILTED], ticks)[0].final.score
    assert [float(leaf) for leaf in flatten(score)] == [11, 275, 25, 44, 11, 0, 0, 2, -1, 7, 8]


def test_what_is_not_scored_is_logged_as_before():
    loop, ticks = scored(CASE_1, SWEEP_TICKS, 0.02)
    plain = fly_lanes(CASE_1, [NUMBERS], [TILTED], SWEEP_TICKS)[0]
    both = fly_lanes(loop, [NUMBERS], [TILTED], ticks._replace(log=5))[0]
    assert both.columns == plain.columns
    np.testing.assert_array_equal(both.rows, plain.rows)
    assert len(fly_lanes(loop, [NUMBERS], [TILTED], ticks)[0].rows) == 1


# Very many flights


@KINDS
def test_a_sweep_scores_as_single_flights_do(double):
    rows = values(11)
    swept = sweep(double).fly(rows)
    for i, row in enumerate(rows):
        start, numbers = with_values(row)
        log = fly_floats(LOOP, numbers, start, CLOCK) if i < 1 else None
        log = log or fly_lanes(LOOP, [numbers], [start], CLOCK)[0]
        assert (Outcome(swept.outcome[i]), swept.ended[i]) == (log.outcome, pytest.approx(log.ended))
        wanted = list(score_of(log).values())
        if double:
            np.testing.assert_array_equal(swept.metrics[i], wanted)
        np.testing.assert_allclose(swept.metrics[i], wanted, rtol=2e-3, atol=1e-5)


def test_what_only_a_score_shows_is_known_when_it_is_due_whatever_the_law_s_rate():
    loop, ticks = scored(CASE_1, SWEEP_TICKS._replace(every=(3,), last=40), 0.004 * 7)
    rows = values(2)
    swept = sweep(loop=loop, ticks=ticks).fly(rows)
    for flight, row in enumerate(rows):
        start, numbers = with_values(row)
        alone = flatten(fly_floats(loop, numbers, start, ticks).final.score)
        assert [float(leaf[flight]) for leaf in flatten(swept.score)] == [float(leaf) for leaf in alone]


@KINDS
def test_a_flight_of_a_sweep_is_the_same_to_the_bit_in_any_batch_order_and_number_of_threads(double):
    rows, one = values(203), sweep(double)
    together = table(one.fly(rows, threads=2))
    assert len({row.tobytes() for row in together}) == 203
    order = np.random.default_rng(1).permutation(203)
    np.testing.assert_array_equal(table(one.fly(rows[order], threads=1)), together[order])
    for count in (1, 2, 7, 16, 17, 64):
        np.testing.assert_array_equal(table(one.fly(rows[:count])), together[:count])
    np.testing.assert_array_equal(table(one.fly(rows[100:150], threads=5)), together[100:150])


@KINDS
def test_a_flight_is_the_same_to_the_bit_whichever_other_numbers_vary(double):
    rows = values(37)
    together, leaves = table(sweep(double).fly(rows)), flatten((TILTED, NUMBERS))
    everything = np.repeat(np.array([leaves]), len(rows), axis=0)
    everything[:, PLACES] = rows
    for varying in (PLACES[::-1], range(len(leaves))):
        one = Sweep(LOOP, CLOCK, TILTED, NUMBERS, varying, double)
        np.testing.assert_array_equal(table(one.fly(everything[:, varying])), together)
    start, numbers = with_values(rows[5])
    alone = Sweep(LOOP, CLOCK, start, numbers, PLACES[1:2], double).fly(rows[5:6, 1:2])
    np.testing.assert_array_equal(table(alone), together[5:6])


@KINDS
def test_flights_that_fail_are_outcomes_and_harm_no_other(double):
    rows = values(24)
    well = table(sweep(double).fly(rows))
    ill = rows.copy()
    ill[::3, 1] = 0.3  # far too fast
    ill[1, 2] = np.nan
    ill[4, 2] = 500.0
    swept = sweep(double).fly(ill)
    spared = [i for i in range(24) if i % 3 and i not in (1, 4)]
    np.testing.assert_array_equal(table(swept)[spared], well[spared])
    assert Outcome(swept.outcome[1]) is Outcome.NOT_FINITE
    assert Outcome(swept.outcome[4]) is Outcome.OFF_PATH
    assert swept.ended[1] == swept.ended[4] == 0.0
    assert np.isnan(swept.metrics[[1, 4]]).all()
    for i in range(0, 24, 3):
        start, numbers = with_values(ill[i])
        log = fly_lanes(LOOP, [numbers], [start], CLOCK)[0]
        assert log.outcome is not Outcome.COMPLETED
        assert Outcome(swept.outcome[i]) is log.outcome
        assert swept.ended[i] == pytest.approx(log.ended, abs=1e-6 if double else 0.009)
        assert np.isfinite(swept.metrics[i]).all()
        if double:
            np.testing.assert_array_equal(swept.metrics[i], list(score_of(log).values()))


def test_a_block_whose_flights_are_all_over_stops():
    one = sweep(ticks=CLOCK._replace(last=2**40))
    rows = values(64)
    rows[:, 2] = 500.0
    assert set(one.fly(rows).outcome) == {Outcome.OFF_PATH}


def test_paths_with_tables_and_other_outcomes_in_a_sweep():
    numbers = parameters(path=WAYPOINTS, limits=Limits(100.0, 100.0, 0.06))
    loop, ticks = scored(Loop(Lagrange(), Piecewise(), Backstepping()), SWEEP_TICKS, 0.02)
    one = Sweep(loop, ticks, state(), numbers, places(state(), numbers, ["parameters.limits.pitch"]))
    pitches = np.array([[0.06], [1.5], [0.01], [1.0]])
    swept = one.fly(pitches)
    for i, pitch in enumerate(pitches[:, 0]):
        log = fly_floats(loop, numbers._replace(limits=Limits(100.0, 100.0, pitch)), state(), ticks)
        assert Outcome(swept.outcome[i]) is log.outcome
        assert swept.ended[i] == pytest.approx(log.ended)
    assert len(set(swept.outcome)) == 2


@pytest.fixture(scope="module")
def bad_day():
    """A vehicle with wind, noise, an estimator, a payload and a rotor fault, for three seconds."""
    path = Path("examples/a_bad_day.toml")
    plan = read_mission(path).plan(path.parent)
    return plan, *scored(plan.loop, plan.ticks._replace(last=1500), 0.02)


def test_python_is_asked_about_no_flight_gone_astray(bad_day):
    plan, _, _ = bad_day
    asked = []

    def controller(t, measured, reference):
        asked.append(np.isfinite(measured.position).all() and abs(measured.position).max() < 1e3)
        return 1e6 if t > 0.05 else 9.0, (1e6, 0.0, 0.0)

    with flying(controller) as (law, gains):
        flown = plan.with_controller(law, gains)
        loop, ticks = scored(flown.loop, plan.ticks._replace(last=400), 0.02)
        names = ["start.position.0"]
        one = Sweep(loop, ticks, plan.start, flown.parameters, places(plan.start, flown.parameters, names), True)
        swept = one.fly([[x] for x in (0.0, 0.01, 0.02, 0.03, 300.0)])
    assert Outcome.COMPLETED not in set(swept.outcome.tolist())
    assert len(asked) > 3
    assert all(asked)


def test_no_flights_at_all():
    swept = sweep().fly(np.zeros((0, 4)))
    assert swept.outcome.shape == swept.ended.shape == (0,)
    assert swept.metrics.shape == (0, len(METRICS))


def test_progress_adds_up_to_the_flights():
    told = []
    sweep().fly(values(1203), progress=told.append)
    assert sum(told) == 1203
    assert len(told) > 1


@pytest.mark.parametrize("shape", [(3,), (3, 3), (3, 4, 1)])
def test_values_of_another_shape_are_refused(shape):
    with pytest.raises(ValueError, match="4 varying"):
        sweep().fly(np.zeros(shape))


def test_names_give_places_and_what_cannot_vary_is_refused():
    assert [number_names(TILTED, NUMBERS)[place] for place in PLACES] == list(VARYING)
    with pytest.raises(ValueError, match="nothing"):
        places(TILTED, NUMBERS, ["nothing"])
    numbers = parameters(path=WAYPOINTS)
    loop, ticks = scored(Loop(Lagrange(), Piecewise(), Backstepping()), SWEEP_TICKS, 0.02)
    for wrong in (places(state(), numbers, ["parameters.path.knots"]), [-1], [10**6], [3, 3]):
        with pytest.raises(ValueError, match="each once"):
            Sweep(loop, ticks, state(), numbers, wrong)


def test_weights_of_the_nets_can_vary_too():
    names = ["parameters.gains.force_net.input_weights.3.2", "parameters.gains.weights_1.4.1"]
    one = Sweep(LOOP, CLOCK, TILTED, NUMBERS, places(TILTED, NUMBERS, names), True)
    swept = one.fly([[0.3, 0.1], [-0.9, 0.0]])
    for i, (weight, initial) in enumerate(((0.3, 0.1), (-0.9, 0.0))):
        leaves = flatten((TILTED, NUMBERS))
        for place, value in zip(one.varying, (weight, initial), strict=True):
            leaves[place] = value
        start, numbers = rebuild((TILTED, NUMBERS), iter(leaves))
        log = fly_lanes(LOOP, [numbers], [start], CLOCK)[0]
        np.testing.assert_array_equal(swept.metrics[i], list(score_of(log).values()))


def test_a_program_is_compiled_once_for_all_values_but_not_for_other_leaves():
    sweep()
    before = set(KERNELS)
    Sweep(LOOP, CLOCK._replace(last=7), state(), parameters(3.0), PLACES, True)
    assert set(KERNELS) == before
    Sweep(LOOP, CLOCK, TILTED, NUMBERS, PLACES[:1], True)
    assert len(set(KERNELS) - before) == 1


def test_scalar_code_and_code_of_many_lanes_are_not_taken_for_each_other():
    lanes, shared = sweep(), frozenset(PLACES)
    scalar = prepare(LOOP, TILTED, NUMBERS, shared, True, 1)
    assert scalar is not lanes.kernel
    assert prepare(LOOP, TILTED, NUMBERS, shared, True, lanes.width) is lanes.kernel


def test_metrics_of_known_sums():
    four, (efforts, variations, inputs) = np.array([4.0, 0.0]), (Vector([np.array([k, 0.0])] * 4) for k in (36.0, 5.0, 1.0))
    norms = Largest(Vector([np.array([2.0, 0.0])] * 2))
    score = Score(four, (RmsLength(four), LargestLength(four), Rms(efforts), Variation(variations, inputs), norms))
    assert metrics(score)[0].tolist() == [1.0, 2.0, 3.0, 3.0, 3.0, 3.0, 5.0, 5.0, 5.0, 5.0, 2.0, 2.0]
    assert np.isnan(metrics(score)[1]).all()
