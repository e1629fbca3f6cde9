"""The cost of flights, computed by hand."""

import math
import re

import numpy as np
import pytest

from quadstep.engines.scored import names_without_units
from quadstep.interfaces.closed_loop import Outcome
from quadstep.metrics.statistics import Estimate
from quadstep.mission.check import check
from quadstep.mission.tune import TuneSection
from quadstep.studies.tuning.objective import CandidateFlights, Judge, Row, compare
from quadstep.studies.tuning.report import answer, facts, measured_rows, moved, success_but
from tests.flights import METRICS

GAINS = {"controller.K_r1": {"low": 1.0, "high": 2.0}}


def judge(**content):
    return Judge(check(TuneSection, {"gains": GAINS, **content}, "m.toml"), 10.0)


def flown(rmse, largest=None, ended=None):
    """Flights with these errors; those that end before 10 s are lost."""
    count = len(rmse)
    metrics = np.zeros((count, len(METRICS)))
    metrics[:, 0], metrics[:, 1] = rmse, rmse if largest is None else largest
    metrics[:, METRICS.index("variation_thrust[N]")] = np.arange(count)
    ended = np.full(count, 10.0) if ended is None else np.array(ended, dtype=float)
    outcome = np.where(ended < 10.0, Outcome.OFF_PATH, Outcome.COMPLETED).astype(np.int8)
    return CandidateFlights(outcome, ended, metrics, names_without_units(METRICS))


@pytest.mark.parametrize(("aggregate", "wanted"), [("mean", 2.5), ("p95", 3.85), ("worst", 4.0)])
def test_the_objective_is_the_aggregate_of_weighted_metrics(aggregate, wanted):
    flights = flown([1.0, 2.0, 3.0, 4.0])
    assert judge(aggregate=aggregate).judge(flights).objective == pytest.approx(wanted)
    weighted = judge(objective={"position_rmse": 2.0, "variation_thrust": 0.5}).judge(flights)
    assert weighted.objective == pytest.approx(2.0 * 2.5 + 0.5 * 1.5)
    assert weighted.parts["variation_thrust"] == pytest.approx(1.5)


def test_the_order_of_costs():
    ordered = [
        flown([0.1, 0.1, 0.1], [0.5, 0.5, 0.5]),
        flown([0.2, 0.2, 0.2], [0.5, 0.5, 0.5]),
        flown([900.0, 900.0, 900.0], [0.9, 0.9, 0.9]),  # keeps the constraint, badly as it flies
        flown([0.1, 0.1, 0.1], [0.5, 0.5, 1.1]),
        flown([0.1, 0.1, 0.1], [0.5, 0.5, 1.5]),
        flown([900.0, 900.0, 900.0], [900.0, 900.0, 900.0]),
        flown([0.01, 0.01, 0.01], [0.1, 0.1, 0.1], [10.0, 10.0, 9.9]),  # lost, well as it flew
        flown([0.02, 0.02, 0.01], [0.1, 0.1, 0.1], [10.0, 10.0, 9.9]),
        flown([0.01, 0.01, 0.01], [0.1, 0.1, 0.1], [10.0, 10.0, 4.0]),
        flown([0.01, 0.01, 0.01], [0.1, 0.1, 0.1], [10.0, 9.0, 9.0]),
        flown([0.01, 0.01, 0.01], [0.1, 0.1, 0.1], [9.0, 9.0, 9.0]),
        flown([0.01, 0.01, 0.01], [0.1, 0.1, 0.1], [0.0, 0.0, 0.0]),
    ]
    for unit in (1.0, 1e-6, 1e6):
        costs = [judge(constraints={"largest_error": 1.0})._replace(unit=unit).judge(one).cost for one in ordered]
        assert costs == sorted(costs)
        assert len(set(costs)) == len(costs)


def test_the_cost_in_numbers():
    found = judge(constraints={"largest_error": 1.0}).judge(flown([1.0, 1.0], [2.0, 1.0]))
    assert (found.lost, found.violation, found.feasible) == (0, 1.0, False)
    assert found.cost == pytest.approx(0.5 + 1.0 + 0.5)
    lost = judge().judge(flown([1.0, 5.0], ended=[10.0, 2.5]))
    assert lost.objective == 1.0
    assert lost.cost == pytest.approx(0.5 + 2.0 + (2.0 - 0.25))
    assert not lost.feasible
    assert judge().judge(flown([1.0], ended=[0.0])).cost == pytest.approx(1.0 + 2.0 + 2.0)


def test_a_constraint_may_be_broken_by_the_rest_of_a_share():
    flights = flown(np.full(10, 0.1), np.linspace(0.1, 1.0, 10))
    for share, exceeded in ((1.0, 1.0 / 0.5 - 1), (0.9, 0.9 / 0.5 - 1), (0.55, 0.6 / 0.5 - 1), (0.5, 0.0)):
        found = judge(constraints={"largest_error": {"most": 0.5, "share": share}}).judge(flights)
        assert found.violation == pytest.approx(exceeded)
        assert found.feasible == (share == 0.5)


def test_a_number_that_is_none_is_the_worst():
    one = judge().judge(flown([np.inf]))
    assert one.cost == 1.0 > judge().judge(flown([1e12])).cost


def test_the_comparison_in_numbers():
    random = np.random.default_rng(1)
    before = random.uniform(0.9, 1.1, 200)
    found = compare(judge(), flown(before), flown(before - 0.1))
    assert found.verdict == "The tuned gains are better on flights they were not tuned on."
    assert found.objective.difference == pytest.approx((-0.1, -0.1, -0.1))
    assert found.rows[0].difference == pytest.approx((-0.1, -0.1, -0.1))
    assert found.objective.present.low < before.mean() < found.objective.present.high
    assert found.success[0] == pytest.approx((1.0, 0.9817, 1.0), abs=1e-4)
    worse = answer(compare(judge(), flown(before), flown(before + 0.1))).replace("\N{NO-BREAK SPACE}", " ")
    assert re.search(r"WORSE on .* do not use them\. The objective rises by [\d.]+ %\.", worse)
    less = answer(compare(judge(), flown(before), flown(before * random.uniform(0.4, 0.6, 200))))
    assert re.search(r"not tuned on: the objective falls by [\d.]+ %\.$", less.replace("\N{NO-BREAK SPACE}", " "))
    noise = before + random.normal(0.0, 0.05, 200)
    assert "No firm evidence" in compare(judge(), flown(before), flown(noise - noise.mean() + before.mean())).verdict
    assert "No firm evidence" in compare(judge(), flown(before), flown(before * (1.0 - 1e-5))).verdict
    assert "No better gains" in compare(judge(), flown(before), flown(before), changed=False).verdict


def test_success_and_a_loop_that_became_bad_are_one_sentence():
    """Only where success decides, upwards; what the loop is like elsewhere is left to its own sentence."""
    lost = np.where(np.arange(100) < 20, 5.0, 10.0)
    why = {"grade": "fragile", "why": "at the largest vehicle mass flown, 3 kg, so; as the mission is written, it is sound"}
    rises = compare(judge(), flown(np.ones(100), ended=lost), flown(np.ones(100)))
    said = success_but(rises, why).replace("\N{NO-BREAK SPACE}", " ")
    assert said == (
        "Success on new flights rises from 80 % to 100 %, but the loop is fragile: "
        "at the largest vehicle mass flown, 3 kg, so."
    )
    falls = compare(judge(), flown(np.ones(100)), flown(0.5 * np.ones(100), ended=lost))
    alike = compare(judge(), flown(np.ones(100)), flown(0.5 * np.ones(100)))
    assert not any((success_but(rises, {}), success_but(falls, why), success_but(alike, why)))


def test_more_flights_that_succeed_count_before_a_smaller_objective():
    rmse = np.full(100, 1.0)
    lost = np.where(np.arange(100) < 20, 5.0, 10.0)
    assert "WORSE" in compare(judge(), flown(rmse), flown(0.5 * rmse, ended=lost)).verdict
    better = compare(judge(), flown(0.5 * rmse, ended=lost), flown(rmse))
    assert better.verdict.startswith("The tuned gains are better")
    assert better.success_difference.value == pytest.approx(0.2)
    assert better.objective.difference.value == pytest.approx(0.5), "over those completed with both"


def test_a_better_objective_is_not_told_without_the_flights_that_fail_with_it():
    rmse, half = np.full(100, 1.0), np.where(np.arange(100) < 50, 5.0, 10.0)
    found = compare(judge(), flown(rmse, ended=half), flown(0.5 * rmse, ended=half))
    assert answer(found).endswith(": the objective falls by 50 %. With them 50 % of the flights succeed.")
    assert not answer(compare(judge(), flown(rmse), flown(0.5 * rmse))).endswith("succeed.")


def test_a_margin_is_missed_by_the_loop_and_by_no_flight():
    asked = judge(constraints={"largest_error": 0.6, "delay_margin": 0.04, "phase_margin": 0.5})

    def having(delay, rmse):
        one = flown(np.full(100, rmse))
        names = {**one.names, "delay_margin": "delay_margin[s]", "phase_margin": "phase_margin[rad]"}
        metrics = np.hstack([one.metrics, np.tile([delay, 0.6], (100, 1))])
        return one._replace(metrics=metrics, names=names)

    before, after = having(0.052, 1.0), having(0.0363, 0.4)
    found = compare(asked, before, after)
    assert [one.value for one in found.success] == [0.0, 1.0]
    assert found.missed == ["delay margin 36.3 ms, 40.0 ms asked"]
    assert answer(found).startswith("Though they do not keep every constraint, the tuned gains fly better on flights they")
    table = [[cell.replace("\N{NO-BREAK SPACE}", " ") for cell in row] for row in measured_rows(found)[-2:]]
    assert table[0] == [
        "delay margin of the nominal mission, at least 40.0 ms",
        "52.0 ms, met",
        "36.3 ms, not met",
        "−15.7 ms",
    ]
    assert table[1][:2] == ["phase margin of the nominal mission, at least 28.6°", "34.4°, met"]
    back = compare(asked, after, before)
    assert back.missed == ["largest error at most 600 mm in 0 [0, 3.6] % of 100 unseen flights, 100 % asked"]
    assert measured_rows(back)[0][:2] == [
        "success: largest error at most 600 mm, in 100 % of the flights flown",
        "100 [96.4, 100] %, met",
    ]
    assert measured_rows(back)[0][2].endswith(", not met") and "WORSE" in back.verdict
    kept = compare(asked, before, having(0.05, 0.4))
    assert kept.missed == [] and answer(kept).startswith("The tuned gains are better on")
    none = compare(asked, before, having(0.0363, 1.0))
    assert none.missed and "No firm evidence" in none.verdict
    worse = compare(asked, having(0.052, 0.4), having(0.0363, 0.5))
    assert worse.missed and "WORSE" in worse.verdict


@pytest.mark.parametrize(("share", "good", "wanted"), [
    (0.9, 97, "met"), (0.9, 95, "undecided"), (0.9, 88, "undecided"), (0.9, 80, "not met"),
    (1.0, 100, "met"), (1.0, 99, "not met"),
])  # fmt: skip
def test_a_share_is_met_or_not_only_where_its_interval_shows_it(share, good, wanted):
    """Of all flights that is those flown."""
    asked = judge(constraints={"largest_error": {"most": 0.6, "share": share}})
    before = flown(np.ones(100), np.where(np.arange(100) < 60, 0.5, 0.7))
    found = compare(asked, before, flown(np.full(100, 0.5), np.where(np.arange(100) < good, 0.5, 0.7)))
    assert re.search(r"\%, ([a-z ]+)$", measured_rows(found)[0][2])[1] == wanted
    assert len(found.missed) == (wanted == "not met")
    begins = {"met": "The tuned gains are better", "not met": "Though they do not keep every constraint, the tuned gains fly"}
    assert answer(found).startswith(
        begins.get(wanted, "Though they are not shown to keep every constraint, the tuned gains fly")
    )
    alone = compare(asked, flown([1.0]), flown([0.5]))
    assert measured_rows(alone)[0][1:3] == ["0 %, not met", "100 %, met"], "all flights are alike"


def test_better_gains_are_not_praised_without_their_price():
    """What the objective weighs and rises, and margins that fall, nothing else."""
    asked = judge(
        objective={"position_rmse": 1.0, "variation_thrust": 1e-6}, constraints={"phase_margin": 0.5, "delay_margin": 0.01}
    )

    def having(rmse, thrust, phase, delay):
        one = flown(np.full(100, rmse))
        one.metrics[:, METRICS.index("variation_thrust[N]")] = thrust
        names = {**one.names, "phase_margin": "phase_margin[rad]", "delay_margin": "delay_margin[s]"}
        return one._replace(metrics=np.hstack([one.metrics, np.tile([phase, delay], (100, 1))]), names=names)

    def said(*tuned):
        return answer(compare(asked, having(1.0, 10.0, 0.9, 0.09), having(*tuned))).partition(" The price: ")[2]

    assert said(0.5, 30.0, 0.6, 0.1) == "more thrust variation and less phase margin."
    assert said(0.5, 5.0, 0.6, 0.1) == "less phase margin."
    assert said(0.5, 5.0, 1.0, 0.05) == "less delay margin.", "far from its limit, too"
    assert said(0.5, 5.0, 0.6, 0.05) == "smaller margins."
    assert said(0.5, 5.0, 1.0, 0.1) == ""
    assert said(2.0, 30.0, 0.6, 0.05) == "", "which are not better"
    table = measured_rows(
        compare(judge(constraints={"phase_margin": 0.9}), having(1.0, 1.0, 0.9, 0.1), having(0.5, 1.0, 1.0, 0.1))
    )
    assert table[-1][0] == "phase margin of the nominal mission, not below the current"


def test_a_difference_of_shares_has_its_interval():
    before, after = flown(np.full(100, 0.5), ended=[10.0] * 80 + [5.0] * 20), flown(np.full(100, 0.4))
    found = compare(judge(), before, after)
    low, high = (100.0 * one for one in found.success_difference[1:])
    assert measured_rows(found)[0] == [
        "success rate",
        "80.0 [70.8, 87.3] %",
        "100 [96.4, 100] %",
        f"+20 [{low:+.3g}, {high:+.3g}] points",
    ]


def test_a_better_objective_is_not_told_without_the_error_that_rises_with_it():
    tighter = judge(objective={"variation_thrust": 1.0})
    before, after = flown(np.full(100, 0.19)), flown(np.full(100, 0.6))
    after.metrics[:, METRICS.index("variation_thrust[N]")] *= 0.7
    said = answer(compare(tighter, before, after))
    assert "better" in said
    assert "The mean position RMSE rises from 190 mm to 600 mm. The mean largest error rises from 190 mm to 600 mm." in said
    assert "rises" not in answer(compare(judge(), after, before))


def test_gains_that_lose_flights_are_not_better_by_those_that_are_left():
    rmse, some = np.full(200, 1.0), np.where(np.arange(200) < 3, 5.0, 10.0)
    found = compare(judge(), flown(rmse), flown(0.5 * rmse, ended=some))
    assert found.success_difference.low < 0.0 < found.success_difference.high  # three of 200 decide nothing
    assert found.verdict.startswith("No firm evidence")
    assert answer(found).endswith("With them 98.5 % of the flights succeed, 100 % with the current gains.")
    assert compare(judge(), flown(rmse, ended=some), flown(0.5 * rmse)).verdict.startswith("The tuned gains are better")


def test_a_quantile_is_compared_as_a_quantile():
    before, after = np.full(200, 1.0), np.full(200, 1.1)
    before[:40] = 9.0
    found = compare(judge(aggregate="p95"), flown(before), flown(after))
    assert found.verdict.startswith("The tuned gains are better")
    assert found.objective.difference == pytest.approx((-7.9, -7.9, -7.9))
    assert "WORSE" in compare(judge(), flown(before * 0.01), flown(after)).verdict
    before[:40] = 1.2
    assert "WORSE" in compare(judge(), flown(before), flown(after)).verdict


def test_the_largest_of_flights_decides_nothing():
    before = np.random.default_rng(1).exponential(size=200)
    found = compare(judge(aggregate="worst"), flown(before), flown(0.5 * before))
    assert "No firm evidence" in found.verdict
    assert not found.objective.present.bounded
    assert found.objective.difference.value == pytest.approx(-0.5 * before.max())


def test_flights_that_are_all_lost_leave_no_numbers():
    found = compare(judge(), flown([1.0] * 8, ended=[1.0] * 8), flown([1.0] * 8))
    assert found.objective.present is None
    assert found.objective.difference is None
    assert found.verdict.startswith("The tuned gains are better")
    single = compare(judge(), flown([1.0]), flown([0.5]))
    assert single.verdict == "The tuned gains are better on the one flight that they were tuned on."


def test_how_many_flights_complete_is_said_where_any_is_lost_and_cards_compare_only_gains_that_differ():
    asked, before = judge(constraints={"largest_error": 0.6}), flown([1.0] * 8, ended=[1.0] * 4 + [10.0] * 4)
    found = compare(asked, before, flown([0.5] * 8))
    rows = {row[0]: row[1:3] for row in measured_rows(found)}
    assert rows["completed"] == ["50.0 [15.7, 84.3] %", "100 [63.1, 100] %"] and "success rate" in rows
    assert "completed" not in {row[0] for row in measured_rows(compare(asked, flown([1.0] * 8), flown([0.5] * 8)))}
    assert "completed" not in {row[0] for row in measured_rows(compare(judge(), before, flown([0.5] * 8)))}, (
        "as success has it"
    )
    assert facts(found)[0].value == "1.00\u00a0m → 500\u00a0mm"
    same = compare(asked, before, before, changed=False)
    assert facts(same) == []


def test_a_change_that_is_only_rounding_is_zero_and_one_that_no_digit_shows_is_not_told():
    margin, rest = Estimate(30.0, math.nan, math.nan), Estimate(3.6e-15, math.nan, math.nan)
    assert Row("gain_margin_up[dB]", margin, margin, rest).texts[1:] == ["30.0\u00a0dB", "30.0\u00a0dB", "0\u00a0dB"]
    before, after, change = (Estimate(one, one, one) for one in (1.0011, 1.0044, 0.0033))
    single = compare(judge(), flown([1.0]), flown([0.5]))
    assert moved(single, Row("position_rmse[m]", before, after, change)) == ""
    later = Estimate(1.02, 1.0, 1.1)
    assert moved(single, Row("position_rmse[m]", before, later, change)) == "position RMSE rises from 1.00 m to 1.02 m"


def test_a_number_has_the_same_digits_in_a_row_and_in_its_sentence():
    spread, alone = Estimate(0.36078, 0.3606, 0.3613), Estimate(0.35058, 0.35058, 0.35058)
    row = Row("largest_error[m]", spread, alone, Estimate(-0.0102, -0.0107, -0.01))
    assert row.texts[1:3] == ["360.8 [360.6, 361.3]\u00a0mm", "350.6\u00a0mm"]
    found = compare(judge(), flown([1.0] * 8), flown([0.5] * 8))
    assert moved(found, row) == "mean largest error falls from 360.8 mm to 350.6 mm"


def test_a_change_is_one_of_the_same_flights():
    """Search: what the answer says of random flights, some lost, holds for them; a fall is never by more than everything."""
    random, said = np.random.default_rng(3), 0
    for _ in range(400):
        count = int(random.integers(4, 24))
        hard = random.random(count) < 0.5
        before = np.where(hard, 10.0, 0.1) * random.uniform(0.8, 1.2, count)
        after = before * random.uniform(0.05, 1.2) * random.uniform(0.9, 1.1, count)
        one, other = (np.where(random.random(count) < risk, 5.0, 10.0) for risk in random.uniform(0.0, 0.4, 2))
        by = judge(aggregate=str(random.choice(["mean", "p95", "worst"])))
        found = compare(by, flown(before, ended=one), flown(after, ended=other))
        words = answer(found).replace("\N{NO-BREAK SPACE}", " ")
        through = (one == 10.0) & (other == 10.0)
        for sign, share in re.findall(r"objective (falls|rises) by ([\d.]+)", words):
            said += 1
            assert sign == "rises" or float(share) <= 100.0
        for sign, low, high in re.findall(r"position RMSE (falls|rises) from ([\d.]+ m?m) to ([\d.]+ m?m)", words):
            means = [values[ended == 10.0].mean() for values, ended in ((before, one), (after, other))]
            units = [1e-3 if text.endswith("mm") else 1.0 for text in (low, high)]
            told = [float(text.split()[0]) * unit for text, unit in zip((low, high), units, strict=True)]
            for text, value, mean, unit in zip((low, high), told, means, units, strict=True):
                last = unit * 10.0 ** -len(text.split()[0].partition(".")[2])
                assert abs(value - mean) <= 0.501 * last, "rounded to its last digit"
                assert last <= 0.1 * value, "two digits at least"
            assert (sign == "falls") == (told[1] < told[0]) == bool((after - before)[through].mean() < 0.0)
            said += 1
    assert said > 200


@pytest.mark.parametrize("aggregate", ["mean", "p95", "worst"])
def test_an_objective_falls_by_a_share_of_that_of_the_flights_completed_with_both(aggregate):
    before, ended = np.array([0.1] * 7 + [10.0] * 3), np.array([10.0] * 10)
    lost = np.where(np.arange(10) < 4, 5.0, 10.0)
    found = compare(judge(aggregate=aggregate), flown(before, ended=ended), flown(0.1 * before, ended=lost))
    assert found.change.value == pytest.approx(-0.9)


@pytest.mark.parametrize("aggregate", ["mean", "p95"])
def test_the_share_by_which_the_objective_falls_is_as_sure_as_both_objectives(aggregate):
    """Search: its interval excludes 0 where that of the difference does, and never reaches beyond the ends of both objectives,
    as that of the difference divided by a fixed mean did.
    """
    random = np.random.default_rng(0)
    for _ in range(100):
        count, lift = int(random.choice([30, 100, 200])), random.uniform(0.0, 1.5)
        hard = random.gamma(4.0, 0.25, count)
        before, after = hard**lift + 0.1, random.uniform(0.05, 1.1) * (hard**0.3 + random.uniform(0.0, 0.5, count))
        found = compare(judge(aggregate=aggregate), flown(before), flown(after))
        change, first, second = found.change, found.objective.present, found.objective.tuned
        signs = [np.sign(one[1:]) for one in (change, found.objective.difference)]
        assert np.array_equal(*signs, equal_nan=True)
        if aggregate == "mean":
            assert second.low / first.high - 1.0 <= change.low + 2e-3 < change.high - 2e-3 <= second.high / first.low - 1.0
