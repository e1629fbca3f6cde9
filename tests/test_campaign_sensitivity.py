"""Sensitivity of a campaign's result to its keys: against functions whose indices are known, and at the edges."""

import numpy as np
import pyarrow as pa
import pytest

from quadstep.studies.campaign import sensitivity
from quadstep.studies.campaign.sensitivity import (
    ExplainedResult,
    FlightParts,
    certain,
    estimate,
    first_order,
    parts_of,
    strongest_interaction,
)
from quadstep.studies.campaign.varied import OTHERS, bins, merged, text_of, texts_of, varied
from tests.campaigns import distribution

ISHIGAMI = {"a": 0.3139, "b": 0.4424, "c": 0.0}
PAIR = 0.2437
"""Exact first-order indices of sin a + 7 sin^2 b + 0.1 c^4 sin a on [-pi, pi]^3, and the one of (a, c) together."""


def ishigami(flights, seed=5):
    a, b, c = x = np.random.default_rng(seed).uniform(-np.pi, np.pi, (3, flights))
    y = np.sin(a) + 7.0 * np.sin(b) ** 2 + 0.1 * c**4 * np.sin(a)
    return ExplainedResult(y), dict(zip("abc", map(parts_of, x), strict=True))


@pytest.mark.parametrize(("flights", "tolerance"), [(3000, 0.03), (300_000, 0.004)])
def test_indices_of_ishigamis_function_are_the_known_ones(flights, tolerance):
    found = first_order(*ishigami(flights))
    assert list(found) == ["b", "a", "c"]
    for key, known in ISHIGAMI.items():
        assert found[key].value == pytest.approx(known, abs=tolerance)
        assert found[key].low <= known + 0.001
        assert found[key].high >= known - 0.001
        assert found[key].low <= found[key].value <= found[key].high


def test_the_pair_that_acts_together_is_found_although_one_of_it_does_nothing_alone():
    found = strongest_interaction(*ishigami(30_000))
    assert found.keys == ("a", "c")
    assert found.pairs == 3
    assert found.share.value == pytest.approx(PAIR, abs=0.02)
    assert found.share.low > 0.2


def test_a_key_without_influence_explains_nothing_on_average_however_many_parts():
    shares = []
    for seed in range(100):
        random = np.random.default_rng(seed)
        shares.append(ExplainedResult(random.normal(size=400)).explained(parts_of(random.uniform(size=400)).at_most(40))[0])
    assert abs(np.mean(shares)) < 0.012  # 39 / 399 = 0.098 if chance were not taken off
    assert np.min(shares) < 0.0 < np.max(shares)


def test_intervals_hold_the_truth_about_as_often_as_they_say():
    hits, rare = 0, 0
    for seed in range(60):
        random = np.random.default_rng(seed)
        x, noise = random.normal(size=(2, 600))
        found = first_order(ExplainedResult(x + noise), {"x": parts_of(x)})["x"]
        hits += found.low <= 0.5 <= found.high
        group = random.integers(0, 2, 2000)
        failed = random.uniform(size=2000) < np.where(group == 1, 0.1, 0.02)
        mean = 0.06
        truth = (0.5 * (0.1 - mean) ** 2 + 0.5 * (0.02 - mean) ** 2) / (mean * (1.0 - mean))
        found = first_order(ExplainedResult(failed.astype(float)), {"x": FlightParts(group, 2, ordered=False)})["x"]
        rare += found.low <= truth <= found.high
    assert 52 <= hits < 60
    assert rare >= 52


def test_no_pair_of_many_keys_without_any_influence_is_certain():
    """Of 66 pairs the largest share is above zero by chance, in one campaign of eight at 95 % each."""
    alone = together = 0
    for seed in range(40):
        random = np.random.default_rng(seed)
        keys = {str(i): parts_of(random.random(400)) for i in range(12)}
        pair = strongest_interaction(ExplainedResult(random.normal(size=400)), keys)
        alone, together = alone + certain(pair.share, 1), together + certain(pair.share, pair.pairs)
    assert alone >= 2
    assert together == 0
    found = strongest_interaction(*ishigami(3000))
    assert certain(found.share, found.pairs)


def test_blocks_of_flights_give_the_intervals_of_single_flights(monkeypatch):
    blocks, _ = ishigami(4000)
    wide = {key: estimate(blocks.explained(parts)) for key, parts in ishigami(4000)[1].items()}
    monkeypatch.setattr(sensitivity, "BLOCKS", 4000)
    single, keys = ishigami(4000)
    for key, parts in keys.items():
        alone = estimate(single.explained(parts))
        assert alone.value == wide[key].value
        assert wide[key].high - wide[key].low == pytest.approx(alone.high - alone.low, rel=0.25)


def test_a_choice_that_decides_all_explains_all_and_its_order_does_not_matter():
    places = np.arange(300) % 3
    y = np.array([5.0, -1.0, 2.0])[places]
    for shuffled in (places, np.array([2, 0, 1])[places]):
        found = first_order(ExplainedResult(y), {"k": FlightParts(shuffled, 3, ordered=False)})["k"]
        assert found == pytest.approx((1.0, 1.0, 1.0))


def test_results_do_not_depend_on_scale_or_offset_and_are_the_same_every_time():
    random = np.random.default_rng(1)
    x, noise = random.normal(size=(2, 500))
    keys = {"x": parts_of(x)}
    found = first_order(ExplainedResult(x + noise), keys)
    assert found == first_order(ExplainedResult(x + noise), keys)
    assert found["x"] == pytest.approx(first_order(ExplainedResult(1e6 + 1e-3 * (x + noise)), keys)["x"], abs=1e-6)


@pytest.mark.parametrize("y", [np.full(100, 0.1), np.zeros(100), np.full(1, 3.0), np.full(100, 1e-300)])
def test_what_does_not_vary_is_explained_by_nothing(y):
    result, keys = (
        ExplainedResult(y),
        {"a": parts_of(np.linspace(0.0, 1.0, len(y))), "b": parts_of(np.linspace(0.0, 1.0, len(y)) ** 2)},
    )
    assert first_order(result, keys) == {}
    assert strongest_interaction(result, keys) is None


def test_as_many_parts_as_flights_say_nothing_and_a_constant_key_explains_nothing():
    y = np.random.default_rng(0).normal(size=30)
    assert first_order(ExplainedResult(y), {"k": FlightParts(np.arange(30), 30, ordered=False)}) == {}
    assert first_order(ExplainedResult(y), {"k": FlightParts(np.zeros(30, dtype=int), 1, ordered=True)})["k"] == (
        0.0,
        0.0,
        0.0,
    )


def test_no_value_is_outside_0_to_1_or_not_finite_even_where_failures_are_rare():
    y = np.zeros(50)
    y[7] = 1.0  # many resamples have no failure at all
    found = first_order(ExplainedResult(y), {"k": parts_of(np.linspace(0.0, 1.0, 50))})
    assert all(np.isfinite(one).all() and 0.0 <= one.low <= one.value <= one.high <= 1.0 for one in found.values())


def test_parts_of_numbers_are_of_nearly_equal_count_and_in_order():
    values = np.random.default_rng(3).lognormal(size=250_000)
    parts = parts_of(values)
    counts = np.bincount(parts.places, minlength=parts.size)
    assert parts.size == sensitivity.PARTS
    assert 2000 < counts.min() < counts.max() < 3000
    order = np.argsort(values)
    assert (np.diff(parts.places[order]) >= 0).all()


def test_neighbours_are_joined_only_where_there_are_neighbours():
    places = np.repeat(np.arange(100), 3)
    joined = FlightParts(places, 100, ordered=True).at_most(7)
    assert joined.size == 7
    assert sorted(set(joined.places)) == list(range(7))
    assert (np.diff(joined.places) >= 0).all()
    assert FlightParts(places, 100, ordered=False).at_most(7).size == 100
    assert FlightParts(places, 100, ordered=True).at_most(200).size == 100


def column(values):
    """A column in two chunks, as a store gives it."""
    half = len(values) // 2
    return pa.chunked_array([pa.array(values[:half]), pa.array(values[half:])])


def test_values_of_a_choice_are_told_apart_numbers_in_order_others_by_frequency():
    choice = distribution(type="choice", values=[1, 2])
    found = varied(column([20.0, 5.0, 10.0, 5.0]), choice)
    assert found.options == ("5", "10", "20")
    assert found.values.tolist() == [2, 0, 1, 0]
    found = varied(column([True, False, True, True]), choice)
    assert (found.options, found.values.tolist()) == (("on", "off"), [0, 1, 0, 0])
    found = varied(column(['{"type": "pid"}', '{"type": "lqr"}', '{"type": "lqr"}']), choice)
    assert (found.options, found.values.tolist()) == (("lqr", "pid"), [1, 0, 0])
    assert not found.parts.ordered
    nets = ['{"type": "backstepping"}', '{"nets": {"enabled": false}, "type": "backstepping"}']
    assert varied(column(nets), choice).options == ("plain", "nets enabled = off")


def test_a_key_of_very_many_values_is_looked_at_in_ranges_or_with_the_rare_ones_together():
    grid = distribution(type="grid", low=0.0, high=1.0, count=500)
    assert varied(column(np.linspace(0.0, 1.0, 500)), grid).options is None
    assert len(varied(column(np.linspace(0.0, 1.0, 40)), grid).options) == 40
    texts = [f"t{i}" for i in range(100) for _ in range(1 + (i < 39))]
    found = varied(column(texts), distribution(type="choice", values=["a"]))
    assert len(found.options) == 40
    assert found.options[-1] == OTHERS
    assert np.bincount(found.values).tolist() == [2] * 39 + [61]


def test_few_flights_of_a_continuous_key_are_numbers_still():
    found = varied(column([0.9, 1.1]), distribution(type="uniform", low=0.0, high=2.0))
    assert found.options is None
    cut = bins(found, None)
    assert cut.size == 1
    assert cut.edges.tolist() == [0.9, 1.1]


def test_bins_are_of_equal_width_or_ratio_and_hold_the_flights_they_say():
    values = np.random.default_rng(2).lognormal(sigma=1.0, size=4000)
    for kind in (distribution(type="log-normal", median=1.0, sigma=1.0), distribution(type="normal", mean=1.0, deviation=1.0)):
        cut = bins(varied(column(values), kind), kind)
        assert cut.log == (kind.type == "log-normal")
        inside = (values >= cut.edges[cut.places]) & (values <= cut.edges[cut.places + 1])
        assert inside.all()
        assert np.bincount(cut.places, minlength=cut.size).min() >= 20
        steps = np.diff(np.log(cut.edges) if cut.log else cut.edges)
        assert steps[1:-1].min() == pytest.approx(np.median(steps))


def test_ranges_of_few_flights_are_joined_with_the_next():
    assert merged(np.arange(6.0), np.array([3, 30, 30, 5, 5])).tolist() == [0.0, 2.0, 5.0]
    assert merged(np.arange(4.0), np.array([3, 0, 3])).tolist() == [0.0, 3.0]
    assert merged(np.arange(4.0), np.array([20, 20, 20])).tolist() == [0.0, 1.0, 2.0, 3.0]


def test_tables_are_named_by_what_tells_them_apart():
    assert texts_of(['{"type": "pid", "mass": 2.0}', '{"type": "lqr", "mass": 2.0}']) == ["pid", "lqr"]
    assert texts_of(['{"type": "b", "nets": {"enabled": true}}', '{"type": "b", "nets": {"enabled": false}}']) == [
        "nets enabled = on",
        "nets enabled = off",
    ]
    assert texts_of(['{"type": "b"}']) == ["b"]
    assert texts_of(["[1.0, 2.0]", "[1.0, 3.0]", '"x"']) == ["[1, 2]", "[1, 3]", '"x"']
    assert texts_of(["{no json", "plain"]) == ["{no json", "plain"]
    assert text_of({"mass": 2.644, "type": "geometric"}) == "geometric, mass = 2.644"
    assert len(text_of("x" * 100)) == 48
