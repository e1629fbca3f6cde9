"""Pairs, ranks and corrections, against formulas worked out here and against SciPy."""

import itertools
import math

import numpy as np
import pytest
from scipy.stats import binom, binomtest, rankdata, wilcoxon

from quadstep.metrics.statistics import ordered_quantile, quantile
from quadstep.studies.comparison import words
from quadstep.studies.comparison.ranking import (
    ALPHA,
    CellFlights,
    by_chance,
    compare,
    corrected,
    differences,
    fewest,
    holm,
    losses,
    pair,
    signed_ranks,
    spread,
)

METRIC = "position_rmse"


def flown(values):
    """Flights with these errors; infinite: lost."""
    values = np.array(values, dtype=float)
    lost = np.isinf(values)
    return CellFlights(lost, {METRIC: np.where(lost, math.nan, values)})


def normal(mean, seed, count=60):
    return np.abs(np.random.default_rng(seed).normal(mean, 0.1, count))


def test_the_median_flight_is_one_that_was_flown_and_none_where_half_are_lost():
    assert flown([3.0, 1.0, 2.0]).middle(METRIC) == 2
    assert flown([3.0, 1.0, math.inf, 2.0]).middle(METRIC) == 3
    assert flown([3.0, math.inf, math.inf]).middle(METRIC) is None


def test_holm_as_his_paper_does_it():
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.5, 0.9]) == [1.0, 1.0]
    assert holm([]) == []


def test_the_correction_is_over_all_situations_of_a_study():
    one = compare({"a": flown(normal(1.0, 1)), "b": flown(normal(1.05, 2))}, METRIC)
    alone, together = corrected([one])[0], corrected([one] * 10)
    assert alone.pairs[0].p == one.pairs[0].p
    assert together[0].pairs[0].p == pytest.approx(min(1.0, 10 * one.pairs[0].p))
    assert {found.pairs[0].p for found in together} == {together[0].pairs[0].p}


@pytest.mark.parametrize(("pairs", "flights"), [(1, 6), (3, 7), (18, 10), (325, 14)])
def test_the_fewest_flights_that_can_decide_are_those_of_flights_that_agree_entirely(pairs, flights):
    def decided(count):
        a, b = flown(np.arange(1.0, 1.0 + count)), flown([math.inf] * count)
        found = pair("a", "b", a, b, METRIC)
        return [holm([p] + [1.0] * (pairs - 1))[0] < ALPHA for p in (found.p, found.p_lost)]

    assert fewest(pairs) == flights
    assert decided(flights) == [True, True]
    assert decided(flights - 1) == [False, False]


def test_a_pair_has_the_p_value_of_wilcoxon_and_the_median_of_the_flights_differences():
    a, b = normal(1.0, 1), normal(1.1, 2)
    found = pair("a", "b", flown(a), flown(b), METRIC)
    assert found.p == pytest.approx(wilcoxon(a - b, method="asymptotic").pvalue)
    assert found.difference.value == pytest.approx(np.median(a - b))
    assert found.difference.low < found.difference.value < found.difference.high
    assert found.better == pytest.approx(np.mean(a < b))
    assert (found.winner, found.keeper, found.p_lost) == ("a", None, 1.0)
    turned = pair("b", "a", flown(b), flown(a), METRIC)
    assert turned.effect == pytest.approx(-found.effect)
    assert turned.winner == "a"


@pytest.mark.parametrize("gap", [[1.0, 2.0, -3.0, 4.0], [1.0, 1.0, -1.0, 0.0, 2.0], [math.inf, 0.0, 2.0, 2.0, -1.0, math.inf]])
def test_of_few_flights_every_sign_of_every_difference_is_counted(gap):
    ranks = rankdata(np.abs(gap))[np.array(gap) != 0.0]
    sums = [abs(np.dot(signs, ranks)) for signs in itertools.product((-1.0, 1.0), repeat=len(ranks))]
    here = abs(np.dot(np.sign([one for one in gap if one]), ranks))
    assert signed_ranks(np.array(gap)) == pytest.approx(np.mean([one >= here for one in sums]))


def test_few_flights_are_as_exact_as_scipy_and_do_not_decide_what_they_cannot():
    gap = np.random.default_rng(5).normal(0.3, 1.0, 40)
    assert signed_ranks(gap) == pytest.approx(wilcoxon(gap, method="exact").pvalue)
    assert [pair("a", "b", flown([1.0] * n), flown([2.0] * n), METRIC).winner for n in (2, 4, 5, 6)] == [None, None, None, "a"]


def test_pairing_decides_what_the_flights_alone_would_not():
    gusts = np.random.default_rng(3).normal(5.0, 2.0, 80)
    a, b = gusts, gusts + np.random.default_rng(4).normal(0.05, 0.05, 80)
    together, apart = (signed_ranks(x - y) for x, y in ((a, b), (a, np.roll(b, 7))))
    assert together < 1e-6
    assert apart > 0.05


def test_a_lost_flight_is_worse_than_any_other_and_never_counts_twice():
    a, b = normal(1.0, 1), normal(1.0, 1) + 0.001
    a[:10] = math.inf
    found = pair("a", "b", flown(a), flown(b), METRIC)
    assert found.better == pytest.approx(50 / 60)
    assert found.lost == pytest.approx(10 / 60)
    assert found.p_lost == pytest.approx(binomtest(10, 10).pvalue)
    assert found.keeper == "b"
    assert found.difference.value == pytest.approx(-0.001)  # of those that both complete
    both = differences(np.array([math.inf, math.inf, 1.0]), np.array([math.inf, 1.0, math.inf]))
    assert both.tolist() == [0.0, math.inf, -math.inf]


def test_the_losses_decide_by_the_flights_that_only_one_of_them_loses():
    a, b = np.ones(100), np.ones(100)
    a[:20] = b[:15] = math.inf
    found = pair("a", "b", flown(a), flown(b), METRIC)
    assert found.p_lost == pytest.approx(binomtest(5, 5).pvalue)  # 15 flights are lost by both and say nothing
    assert found.keeper is None


def test_the_winner_is_whom_the_ranks_of_the_differences_favour_not_who_wins_more_often():
    gap = np.array([-0.001] * 32 + [1.0 + 0.01 * i for i in range(28)])
    found = pair("a", "b", flown(1.0 + np.maximum(gap, 0.0)), flown(1.0 - np.minimum(gap, 0.0)), METRIC)
    assert found.better > 0.5
    assert found.effect > 0.0
    assert found.winner == "b"


def test_a_situation_has_every_pair_once():
    table = {name: normal(mean, place) for place, (name, mean) in enumerate({"a": 1.0, "b": 1.0, "c": 1.2}.items())}
    found = compare({name: flown(values) for name, values in table.items()}, METRIC)
    assert [(one.first, one.second) for one in found.pairs] == [("a", "b"), ("a", "c"), ("b", "c")]


def test_a_pair_is_decided_only_if_every_search_of_the_one_is_better_than_every_search_of_the_other():
    good, fair, poor = (flown(normal(mean, place)) for place, mean in enumerate((1.0, 1.5, 2.0)))
    both = good._replace(others=(fair,))
    assert corrected([compare({"a": both, "b": poor}, METRIC)])[0].pairs[0].winner == "a"
    scattered = good._replace(others=(poor,))
    found = compare({"a": scattered, "b": fair}, METRIC).pairs[0]
    assert (found.winner, found.p) == (None, 1.0)  # though its best gains are certainly better
    assert pair("a", "b", good, fair, METRIC).winner == "a"
    alone = pair("a", "b", good, fair, METRIC).difference
    assert found.difference.value == alone.value
    assert found.difference.low <= alone.low
    assert found.difference.high > 0.0 > alone.high
    losing = flown([math.inf] * 20 + [1.0] * 40)
    kept = compare({"a": good._replace(others=(losing,)), "b": losing}, METRIC).pairs[0]
    assert kept.keeper is None
    assert pair("a", "b", good, losing, METRIC).keeper == "a"


def test_intervals_hold_the_results_of_every_search():
    first, second = normal(1.0, 1), normal(1.4, 2)
    found = spread(flown(first)._replace(others=(flown(second),)), METRIC).median
    one, other = (ordered_quantile(each, 0.5) for each in (first, second))
    assert found == (one.value, one.low, other.high)


def test_equal_controllers_tuned_three_times_each_rank_the_same_way_one_time_in_ten():
    random = np.random.default_rng(5)
    draws = random.random((20_000, 2, 3))
    unanimous = (draws[:, 0].max(1) < draws[:, 1].min(1)) | (draws[:, 1].max(1) < draws[:, 0].min(1))
    assert by_chance(3) == pytest.approx(0.1)
    assert unanimous.mean() == pytest.approx(by_chance(3), abs=0.01)


def test_where_all_are_alike_nothing_is_decided():
    same = flown(np.ones(20))
    found = corrected([compare({"a": same, "b": same, "c": same}, METRIC)])[0]
    assert {one.winner for one in found.pairs} == {None}


def test_the_interval_of_a_median_difference_holds_it_as_often_as_it_says_whatever_the_distribution():
    random, held = np.random.default_rng(0), 0
    for _ in range(1000):
        found = quantile(random.exponential(1.0, 30) ** 2 - math.log(2.0) ** 2, 0.5)
        held += found.low <= 0.0 <= found.high
    assert 940 <= held <= 980
    assert quantile(np.ones(5), 0.5).value == 1.0
    assert math.isnan(quantile(np.ones(5), 0.5).low)  # five say too little
    lost, there = np.array([True, False]), np.array([math.nan, 1.0])
    apart = pair("a", "b", CellFlights(lost, {"e": there}), CellFlights(~lost, {"e": there[::-1]}), "e")
    assert math.isnan(apart.difference.value), "no flight is completed by both"


def test_quantiles_are_values_with_exact_intervals_and_losses_are_infinite():
    values = np.arange(1.0, 101.0)
    found = ordered_quantile(values, 0.5)
    assert found == (50.5, 40.0, 61.0)  # Conover (1999): ranks from the binomial distribution
    few = ordered_quantile(np.arange(1.0, 13.0), 0.95)
    assert few.value == 12.0
    assert math.isnan(few.high)  # 12 flights cannot bound a 95 % quantile from above, which is not to say that one is lost
    assert ordered_quantile(np.array([1.0] * 4 + [math.inf] * 3), 0.5) == (1.0, 1.0, math.inf)
    assert ordered_quantile(np.array([1.0] * 4 + [math.inf] * 4), 0.5).value == 1.0
    half = flown([1.0] * 94 + [math.inf] * 6)
    assert spread(half, METRIC).high.value == math.inf
    assert spread(half, METRIC).median.value == 1.0
    assert spread(half, METRIC).mean == 1.0
    assert losses(half).value == pytest.approx(0.06)
    assert math.isnan(spread(flown([math.inf] * 5), METRIC).mean)


@pytest.mark.parametrize("q", [0.05, 0.5, 0.95])
def test_the_interval_of_a_quantile_holds_it_as_often_as_the_binomial_distribution_says(q):
    random = np.random.default_rng(1)
    found = [ordered_quantile(random.random(100), q) for _ in range(2000)]
    held = np.mean([one.low <= q <= one.high for one in found])
    below = binom(100, q)
    low, high = (next(k for k in range(101) if below.cdf(k) >= share) for share in (0.025, 0.975))
    exact = below.cdf(high) - below.cdf(low - 1)
    assert exact >= 0.95
    assert held == pytest.approx(exact, abs=0.01)


def test_copies_of_one_flight_decide_nothing_and_leave_the_correction_of_others_alone():
    copies = compare({"a": flown([1.0] * 6), "b": flown([2.0] * 6), "c": flown([math.inf] * 6)}, METRIC)
    assert copies.copies
    assert [(pair.p, pair.p_lost, pair.winner, pair.keeper) for pair in copies.pairs] == [(1.0, 1.0, None, None)] * 3
    other = compare({"a": flown(normal(1.0, 1)), "b": flown(normal(1.1, 2))}, METRIC)
    assert not other.copies
    assert corrected([copies, other]) == [copies, *corrected([other])]
    assert not compare({"a": flown([1.0] * 6), "b": flown([2.0] * 5 + [2.1])}, METRIC).copies
    assert not compare({"a": flown([1.0]), "b": flown([2.0])}, METRIC).copies
    assert not compare({"a": flown([math.inf] * 6), "b": flown([math.inf] * 6)}, METRIC).copies


def test_a_sentence_names_few_controllers_and_counts_many():
    assert words.several(["PID"]) == "PID"
    assert words.several(["INDI", "adaptive, nets", "PID"]) == "INDI, “adaptive, nets” and PID"
    assert words.several([str(number) for number in range(9)]) == "9 others"
