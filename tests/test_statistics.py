import numpy as np
import pytest
from scipy import special, stats

from quadstep.metrics.statistics import beta_quantile, incomplete_beta, mean, quantile, ranks_about, share, share_difference


@pytest.mark.parametrize(("x", "a", "b"), [(0.3, 2.0, 5.0), (0.99, 30.0, 0.5), (1e-4, 1.0, 1e4), (0.5, 4e5, 4.1e5)])
def test_the_incomplete_beta_function_is_scipys(x, a, b):
    assert incomplete_beta(x, a, b) == pytest.approx(special.betainc(a, b, x), rel=1e-9, abs=1e-14)


@pytest.mark.parametrize(("count", "total"), [(0, 30), (30, 30), (1, 1), (7, 30), (999_990, 1_000_000)])
def test_the_interval_of_a_share_is_exact(count, total):
    exact = stats.binomtest(count, total).proportion_ci(0.95, method="exact")
    found = share(count, total)
    assert (found.value, found.low, found.high) == pytest.approx((count / total, exact.low, exact.high), rel=1e-9)


def test_few_values_have_no_interval_of_their_mean_and_equal_ones_one_of_no_width():
    assert np.isnan(mean(np.array([1.0, 2.0, 4.0, 7.0, 3.0])).low)
    assert mean(np.full(10, 2.0)) == (2.0, 2.0, 2.0)


def test_the_interval_of_a_mean_leans_to_the_side_of_the_tail():
    values = np.random.default_rng(2).exponential(size=30)
    found = mean(values)
    assert found.high - found.value > 1.2 * (found.value - found.low)
    assert found == mean(values)


def test_a_gain_in_successes_is_certain_only_with_enough_flights():
    assert share_difference(8, 0, 8).low > 0.0
    assert share_difference(2, 0, 2).low < 0.0 < share_difference(2, 0, 2).value
    even = share_difference(3, 3, 100)
    assert (even.value, even.low) == (0.0, -even.high)
    assert even.high < 0.1


def test_the_beta_quantile_inverts():
    assert incomplete_beta(beta_quantile(0.025, 3.0, 9.0), 3.0, 9.0) == pytest.approx(0.025, rel=1e-12)


def test_intervals_of_mean_and_quantile_hold_the_truth_as_often_as_they_say():
    random, held = np.random.default_rng(3), np.zeros(2)
    for _ in range(200):
        values = random.exponential(size=60)
        about, median = mean(values), quantile(values, 0.5)
        held += [about.low <= 1.0 <= about.high, median.low <= np.log(2.0) <= median.high]
    assert (held / 200 > 0.88).all()
    assert (held / 200 < 0.995).all()


@pytest.mark.parametrize("q", [0.01, 0.5, 0.95, 0.999])
@pytest.mark.parametrize("count", [1, 5, 6, 71, 72, 1000, 999_983])
def test_the_ranks_about_a_quantile_are_those_of_the_binomial_distribution(count, q):
    below, above = stats.binom.ppf([0.025, 0.975], count, q)
    assert ranks_about(count, q, 0.025) == (below, above + 1)


def test_the_interval_of_a_mean_holds_it_where_a_few_values_lie_far_off_on_both_sides():
    """As changes of flights do by a gain that hardly acts: the studentised bootstrap alone holds 88 % of these."""
    random, held = np.random.default_rng(5), 0
    for _ in range(200):
        found = mean(np.where(random.random(150) < 0.02, 1.0, 1e-3) * random.normal(size=150))
        held += found.low <= 0.0 <= found.high
    assert held >= 0.93 * 200


def test_a_mean_has_no_bound_where_resamples_may_miss_all_that_differs_whatever_their_sums_round_to():
    values = np.full(200, np.sqrt(0.13))
    values[:2] = 0.37
    found = mean(values)
    assert found.high == np.inf
    assert 0.36 < found.low < found.value
