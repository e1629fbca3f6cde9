"""How keys vary: the quantile functions against scipy's, ranges, weights, and invalid input."""

import tomllib

import mpmath
import numpy as np
import pytest
import scipy.special
import scipy.stats

from quadstep.io.errors import UserError
from quadstep.mission.check import check
from quadstep.mission.distributions import CorrelatedKeys
from quadstep.numbers.noise import inverse_normal, probability
from quadstep.studies.campaign.schema import CampaignFile
from tests.campaigns import distribution, of
from tests.flights import through_lanes

LEAST, GREATEST = 2.0**-33, 1.0 - 2.0**-33
"""Of all uniform numbers that are drawn."""

U = np.concatenate([[LEAST, 1e-9, 1e-6], np.linspace(0.001, 0.999, 999), [1 - 1e-6, 1 - 1e-9, GREATEST]])
P = np.concatenate([10.0 ** np.linspace(-300, -1, 600), np.linspace(0.05, 0.95, 1001), 1 - 10.0 ** np.linspace(-15, -1, 200)])


def test_the_inverse_normal_is_scipys_in_every_branch():
    wanted = scipy.special.ndtri(P)
    np.testing.assert_allclose(inverse_normal(P), wanted, rtol=4e-15, atol=1e-16)
    np.testing.assert_allclose([inverse_normal(float(p)) for p in P], wanted, rtol=4e-15, atol=1e-16)


def test_the_normal_distribution_is_right_to_the_last_digits_far_into_its_lower_tail():
    x = [*np.linspace(-37.0, 8.0, 901).tolist(), *np.linspace(-1.1, -0.9, 41).tolist(), -1.0, 1.0, 0.0, 1e-300]
    with mpmath.workdps(40):
        wrong = [float(abs(probability(one) / mpmath.ncdf(one) - 1)) for one in x]
    assert max(wrong) < 1e-15
    assert [probability(end) for end in (-1e18, -45.0, 0.0, 45.0, 1e18)] == [0.0, 0.0, 0.5, 1.0, 1.0]


def test_the_inverse_normal_is_odd_and_rises():
    p = np.linspace(0.0, 0.5, 2001)[1:]
    exact = p[p * 2**40 == np.round(p * 2**40)]
    np.testing.assert_array_equal(inverse_normal(1.0 - exact), -inverse_normal(exact))
    assert inverse_normal(0.5) == 0.0
    for edge in (0.075, 0.925, np.exp(-25.0)):
        near = edge * (1.0 + np.arange(-200, 201) * 1e-12)
        assert (np.diff(inverse_normal(near)) > -1e-15).all()


@pytest.mark.parametrize(("double", "tolerance"), [(True, 1e-14), (False, 3e-6)])
def test_the_inverse_normal_on_lanes(double, tolerance):
    p = np.concatenate([10.0 ** np.linspace(-30, -1, 40), np.linspace(0.05, 0.95, 32)])
    p = p.astype(np.float64 if double else np.float32).astype(float)
    ours = through_lanes(lambda x: [inverse_normal(x)], p, double=double)
    np.testing.assert_allclose(ours, scipy.special.ndtri(p), rtol=tolerance, atol=tolerance)


QUANTILES = {
    "uniform": ({"type": "uniform", "low": -2.0, "high": 5.0}, scipy.stats.uniform(-2, 7)),
    "sobol": ({"type": "sobol", "low": 1.0, "high": 1.5}, scipy.stats.uniform(1, 0.5)),
    "normal": ({"type": "normal", "mean": 3.0, "deviation": 0.5}, scipy.stats.norm(3, 0.5)),
    "cut on both sides": ({"type": "normal", "mean": 1.0, "deviation": 0.2, "low": 0.9, "high": 1.5},
        scipy.stats.truncnorm(-0.5, 2.5, 1, 0.2)),
    "cut below": ({"type": "normal", "mean": -1.0, "deviation": 2.0, "low": 0.0}, scipy.stats.truncnorm(0.5, np.inf, -1, 2)),
    "cut above": ({"type": "normal", "mean": 0.0, "deviation": 1.0, "high": -1.0}, scipy.stats.truncnorm(-np.inf, -1, 0, 1)),
    "log-normal": ({"type": "log-normal", "median": 2.0, "sigma": 0.7}, scipy.stats.lognorm(0.7, scale=2.0)),
}  # fmt: skip


@pytest.mark.parametrize("name", QUANTILES)
def test_quantiles_are_scipys(name):
    content, wanted = QUANTILES[name]
    drawn = distribution(**content).quantile(U)
    np.testing.assert_allclose(drawn[:-3], wanted.ppf(U[:-3]), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(drawn[-3:], wanted.ppf(U[-3:]), rtol=1e-6)  # what is cut off below costs digits there


def test_a_log_normal_that_is_cut_off_is_the_log_normal_between_the_ends():
    one = distribution(type="log-normal", median=2.0, sigma=0.7, low=1.0, high=3.0)
    whole = scipy.stats.lognorm(0.7, scale=2.0)
    below, above = whole.cdf([1.0, 3.0])
    np.testing.assert_allclose(one.quantile(U), whole.ppf(below + (above - below) * U), rtol=1e-9)


RANGED = {
    "uniform": {"type": "uniform", "low": -0.1, "high": 0.2},
    "uniform, narrow": {"type": "uniform", "low": 1e9 - 1e-6, "high": 1e9},
    "normal": {"type": "normal", "mean": 0.3, "deviation": 0.1, "low": 0.1, "high": 0.7},
    "far above the mean": {"type": "normal", "mean": 0.0, "deviation": 1.0, "low": 5.9},
    "far below the mean": {"type": "normal", "mean": 0.0, "deviation": 1.0, "high": -5.9},
    "almost the mean": {"type": "normal", "mean": 0.0, "deviation": 1.0, "low": -1e-8, "high": 1e-8},
    "log-normal": {"type": "log-normal", "median": 3.0, "sigma": 0.1, "low": 2.9, "high": 3.1},
    "log-normal, far above": {"type": "log-normal", "median": 1.0, "sigma": 0.1, "low": float(np.exp(0.59))},
}


@pytest.mark.parametrize("name", RANGED)
def test_nothing_is_drawn_outside_the_range_or_not_a_number(name):
    one = distribution(**RANGED[name])
    drawn = one.quantile(U)
    assert np.isfinite(drawn).all(), U[~np.isfinite(drawn)]
    assert (np.diff(drawn) >= 0.0).all()
    assert one.low is None or drawn.min() >= one.low
    assert one.high is None or drawn.max() <= one.high
    ends = [one.quantile(float(u)) for u in (LEAST, GREATEST)]
    assert ends == [drawn[0], drawn[-1]]


def test_a_choice_follows_its_weights_and_never_takes_what_weighs_nothing():
    one = distribution(type="choice", values=["a", "b", "c", "d", "e"], weights=[0.0, 1.0, 0.0, 3.0, 0.0])
    places = one.place((np.arange(4000) + 0.5) / 4000)
    assert np.bincount(places, minlength=5).tolist() == [0, 1000, 0, 3000, 0]
    assert set(one.place(np.array([LEAST, GREATEST])).tolist()) == {1, 3}


def test_a_choice_without_weights_is_even():
    one = distribution(type="choice", values=[10.0, 20.0, 30.0])
    assert np.bincount(one.place((np.arange(300) + 0.5) / 300)).tolist() == [100, 100, 100]
    assert one.options == (10.0, 20.0, 30.0)


def test_a_grid_has_its_values_or_evenly_many_from_low_to_high():
    assert distribution(type="grid", values=["x", "y"]).options == ("x", "y")
    assert distribution(type="grid", low=-1.0, high=1.0, count=5).options == (-1.0, -0.5, 0.0, 0.5, 1.0)
    assert distribution(type="grid", low=2.0, high=2.0, count=1).options == (2.0,)


PAIR = {"keys": ["vehicle.mass", "vehicle.gravity"], "mean": [1.0, 9.8]}


def correlated(**content):
    file = check(CampaignFile, {"mission": "m.toml", "correlated": [{**PAIR, **content}]}, "c.toml")
    return file.correlated[0]


def test_a_correlated_set_has_its_covariance_in_either_notation():
    one = correlated(covariance=[[0.04, 0.03], [0.03, 0.09]])
    other = correlated(deviations=[0.2, 0.3], correlation=[[1.0, 0.5], [0.5, 1.0]])
    lower = np.array(one.factor)
    np.testing.assert_allclose(lower @ lower.T, [[0.04, 0.03], [0.03, 0.09]], rtol=1e-14)
    np.testing.assert_allclose(other.factor, one.factor, rtol=1e-14)
    u = np.array([0.1, 0.5, 0.8]), np.array([0.3, 0.5, 0.6])
    first, second = one.quantiles(list(u))
    z = [scipy.special.ndtri(column) for column in u]
    np.testing.assert_allclose(first, 1.0 + lower[0, 0] * z[0], rtol=1e-14)
    np.testing.assert_allclose(second, 9.8 + lower[1, 0] * z[0] + lower[1, 1] * z[1], rtol=1e-14)


def test_three_correlated_keys():
    matrix = np.array([[4.0, 1.0, -0.5], [1.0, 2.0, 0.3], [-0.5, 0.3, 1.0]])
    one = correlated(keys=["a", "b", "c"], mean=[0.0, 1.0, 2.0], covariance=matrix.tolist())
    assert isinstance(one, CorrelatedKeys)
    u = np.random.default_rng(5).uniform(size=(3, 200_000))
    drawn = np.array(one.quantiles(list(u)))
    np.testing.assert_allclose(np.cov(drawn), matrix, atol=0.04)
    np.testing.assert_allclose(drawn.mean(axis=1), [0, 1, 2], atol=0.02)


REFUSED = {
    "uniform, no range": ('type="uniform", low=1.0, high=1.0', ["below"]),
    "uniform, upside down": ('type="uniform", low=2.0, high=1.0', ["low = 2", "high = 1"]),
    "uniform, one end": ('type="uniform", low=2.0', ["high", "is required"]),
    "uniform, infinite": ('type="uniform", low=0.0, high=inf', ["high"]),
    "uniform, not a number": ('type="uniform", low=nan, high=1.0', ["low"]),
    "uniform, text": ('type="uniform", low="0", high=1.0', ["low"]),
    "sobol, no range": ('type="sobol", low=1.0, high=1.0', ["below"]),
    "normal, no deviation": ('type="normal", mean=1.0', ["deviation", "is required"]),
    "normal, zero": ('type="normal", mean=1.0, deviation=0.0', ["deviation", "greater than 0"]),
    "normal, negative": ('type="normal", mean=1.0, deviation=-1.0', ["deviation", "greater than 0"]),
    "normal, upside down": ('type="normal", mean=1.0, deviation=1.0, low=2.0, high=1.0', ["below"]),
    "normal, nothing left": ('type="normal", mean=0.0, deviation=1.0, low=40.0, high=41.0', ["too far from the mean"]),
    "log-normal, negative": ('type="log-normal", median=-1.0, sigma=1.0', ["median"]),
    "log-normal, upside down": ('type="log-normal", median=1.0, sigma=1.0, low=2.0, high=1.0', ["below"]),
    "log-normal, nothing left": ('type="log-normal", median=1.0, sigma=0.001, low=5.0', ["too far from the m"]),
    "choice, empty": ('type="choice", values=[]', ["values", "at least 1"]),
    "choice, missing": ('type="choice"', ["values", "is required"]),
    "choice, weights of another length": ('type="choice", values=[1.0, 2.0], weights=[1.0]', ["1 weights for 2"]),
    "choice, weights zero": ('type="choice", values=[1.0, 2.0], weights=[0.0, 0.0]', ["above 0"]),
    "choice, weight negative": ('type="choice", values=[1.0, 2.0], weights=[2.0, -1.0]', ["weights"]),
    "choice, weight not a number": ('type="choice", values=[1.0, 2.0], weights=[1.0, nan]', ["weights"]),
    "choice, weight infinite": ('type="choice", values=[1.0, 2.0], weights=[1.0, inf]', ["weights"]),
    "grid, empty": ('type="grid", values=[]', ["values: give at least one"]),
    "grid, none": ('type="grid"', ["either values, or low, high and count"]),
    "grid, both": ('type="grid", values=[1.0], low=1.0, high=2.0, count=3', ["either values"]),
    "grid, no count": ('type="grid", low=1.0, high=2.0', ["either values"]),
    "grid, count zero": ('type="grid", low=1.0, high=2.0, count=0', ["count"]),
    "grid, count broken": ('type="grid", low=1.0, high=2.0, count=2.5', ["count"]),
    "grid, count huge": ('type="grid", low=1.0, high=2.0, count=1000000000', ["count"]),
    "grid, upside down": ('type="grid", low=2.0, high=1.0, count=3', ["below"]),
    "another type": ('type="cauchy", low=2.0', ["cauchy", "uniform, sobol, normal, log-normal, choice, grid"]),
    "type of another type": ("type=5, low=2.0", ["type"]),
    "unknown key": ('type="uniform", low=0.0, high=1.0, mean=2.0', ["mean", "unknown key", "high, low, type"]),
    "misspelt": ('type="log-normal", median=1.0, deviation=2.0', ["deviation", "unknown key"]),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_nothing_can_be_drawn_from_is_one_line_naming_the_key(name):
    content, parts = REFUSED[name]
    with pytest.raises(UserError) as caught:
        of(f'[vary]\n"vehicle.mass" = {{{content}}}')
    text = str(caught.value)
    assert "\n" not in text
    for part in ["c.toml", "vehicle.mass", *parts]:
        assert part in text
    assert "validation error" not in text
    assert "pydantic" not in text


COVARIANCE = "covariance = [[1.0, 0.0], [0.0, 1.0]]"
KEYS = 'keys = ["vehicle.mass", "vehicle.gravity"]\nmean = [1.0, 9.8]\n'
REFUSED_SETS = {
    "singular": (KEYS + "covariance = [[1.0, 1.0], [1.0, 1.0]]", "positive definite"),
    "not symmetric": (KEYS + "covariance = [[1.0, 0.5], [0.2, 1.0]]", "symmetric"),
    "beyond one": (KEYS + "deviations = [1.0, 1.0]\ncorrelation = [[1.0, 1.5], [1.5, 1.0]]", "positive definite"),
    "diagonal": (KEYS + "deviations = [1.0, 1.0]\ncorrelation = [[2.0, 0.5], [0.5, 1.0]]", "diagonal"),
    "deviations only": (KEYS + "deviations = [1.0, 1.0]", "either covariance"),
    "both": (KEYS + COVARIANCE + "\ndeviations = [1.0, 1.0]", "either covariance"),
    "none": (KEYS, "either covariance"),
    "one mean": ('keys = ["a", "b"]\nmean = [1.0]\n' + COVARIANCE, "mean: should have 2"),
    "no mean": ('keys = ["a", "b"]\n' + COVARIANCE, "mean"),
    "too small": (KEYS + "covariance = [[1.0]]", "covariance: should have 2"),
    "empty": (KEYS + "covariance = []", "covariance: should have 2"),
    "ragged": (KEYS + "covariance = [[1.0, 0.0], [1.0]]", "covariance: should have 2"),
    "flat": (KEYS + "covariance = [1.0, 2.0]", "covariance"),
    "one key": ('keys = ["a"]\nmean = [1.0]\ncovariance = [[1.0]]', "keys"),
    "a key twice": ('keys = ["a", "a"]\nmean = [1.0, 1.0]\n' + COVARIANCE, "only once"),
    "unknown": (KEYS + COVARIANCE + "\nlow = 1.0", "unknown key"),
    "not a number": (KEYS + "covariance = [[nan, 0.0], [0.0, 1.0]]", "covariance"),
}


@pytest.mark.parametrize("name", REFUSED_SETS)
def test_a_correlated_set_that_is_none_is_one_line(name):
    content, part = REFUSED_SETS[name]
    with pytest.raises(UserError) as caught:
        of(f"[[correlated]]\n{content}")
    assert "correlated" in str(caught.value)
    assert part in str(caught.value)


@pytest.mark.parametrize("name", QUANTILES)
def test_quantiles_are_laws_that_run_on_lanes(name):
    one, u = distribution(**QUANTILES[name][0]), np.linspace(0.001, 0.999, 40)
    ours = through_lanes(lambda x: [one.quantile(x)], u)
    np.testing.assert_allclose(ours, one.quantile(u), rtol=1e-13, atol=1e-13)


def test_toml_of_every_distribution():
    text = tomllib.loads("a = {type='normal', mean=1, deviation=2}")
    assert distribution(**text["a"]).mean == 1.0  # a whole number is a number
