"""The values of varying keys: from the flight's number alone, distributed as the file says, the same in any span."""

import itertools

import numpy as np
import pytest
import scipy.stats
from scipy.stats import qmc

from quadstep.numbers.noise import key
from quadstep.studies.campaign.draws import draw, many_uniforms, noise_keys, sobol
from tests.campaigns import of

COUNT = 20_000
EVERYTHING = """
seed = 9
[vary]
"a.uniform" = {type="uniform", low=-1.0, high=3.0}
"a.normal" = {type="normal", mean=2.0, deviation=0.5}
"a.cut" = {type="normal", mean=2.0, deviation=0.5, low=1.9, high=2.6}
"a.lognormal" = {type="log-normal", median=2.0, sigma=0.4}
"a.sobol" = {type="sobol", low=0.0, high=10.0}
"a.sobol2" = {type="sobol", low=-1.0, high=1.0}
"a.choice" = {type="choice", values=["x", "y", "z"], weights=[1.0, 2.0, 5.0]}
"a.grid" = {type="grid", values=[1, 2, 3]}
"a.table" = {type="choice", values=[{type="p", k=1.0}, {type="q"}]}
"a.flag" = {type="grid", values=[true, false]}
[[correlated]]
keys = ["b.first", "b.second"]
mean = [1.0, -1.0]
covariance = [[0.04, -0.03], [-0.03, 0.09]]
"""


def columns(text, first=0, past=COUNT):
    return {name: column.column() for name, column in draw(of(text), np.arange(first, past)).items()}


def uniform_columns(seed, flights, count):
    return many_uniforms(noise_keys(seed, flights), count)


@pytest.fixture(scope="module")
def drawn():
    return columns(EVERYTHING)


DISTRIBUTED = {
    "a.uniform": scipy.stats.uniform(-1, 4),
    "a.normal": scipy.stats.norm(2, 0.5),
    "a.cut": scipy.stats.truncnorm(-0.2, 1.2, 2, 0.5),
    "a.lognormal": scipy.stats.lognorm(0.4, scale=2),
    "a.sobol": scipy.stats.uniform(0, 10),
    "a.sobol2": scipy.stats.uniform(-1, 2),
    "b.first": scipy.stats.norm(1, 0.2),
    "b.second": scipy.stats.norm(-1, 0.3),
}


@pytest.mark.parametrize("name", DISTRIBUTED)
def test_each_column_is_distributed_as_it_says(drawn, name):
    assert scipy.stats.kstest(drawn[name], DISTRIBUTED[name].cdf).pvalue > 1e-3
    assert drawn[name].mean() == pytest.approx(DISTRIBUTED[name].mean(), abs=5 * DISTRIBUTED[name].std() / np.sqrt(COUNT))
    assert drawn[name].std() == pytest.approx(DISTRIBUTED[name].std(), rel=0.05)


def test_choices_come_as_often_as_they_weigh(drawn):
    names, counts = np.unique(drawn["a.choice"], return_counts=True)
    assert names.tolist() == ["x", "y", "z"]
    assert scipy.stats.chisquare(counts, COUNT * np.array([1, 2, 5]) / 8).pvalue > 1e-3


def test_columns_are_independent_of_each_other_but_for_the_correlated(drawn):
    names = [name for name in DISTRIBUTED if not name.startswith("a.sobol")]
    matrix = np.corrcoef([drawn[name] for name in names])
    wanted = np.eye(len(names))
    wanted[-1, -2] = wanted[-2, -1] = -0.5
    np.testing.assert_allclose(matrix, wanted, atol=4.5 / np.sqrt(COUNT))
    joint = np.cov(drawn["b.first"], drawn["b.second"])
    np.testing.assert_allclose(joint, [[0.04, -0.03], [-0.03, 0.09]], atol=0.004)


def test_flights_that_follow_each_other_are_independent(drawn):
    for name in ("a.uniform", "b.second"):
        for lag in (1, 2, 64):
            assert abs(np.corrcoef(drawn[name][:-lag], drawn[name][lag:])[0, 1]) < 4.5 / np.sqrt(COUNT)
        assert len(np.unique(drawn[name])) > COUNT - 3


def test_what_is_neither_number_nor_text_is_written_as_json(drawn):
    assert set(drawn["a.table"]) == {'{"k": 1.0, "type": "p"}', '{"type": "q"}'}
    assert drawn["a.flag"].dtype == bool
    assert drawn["a.grid"].dtype.kind == "i"
    assert list(drawn) == of(EVERYTHING).keys


def test_options_themselves_are_what_a_flight_gets():
    column = draw(of(EVERYTHING), np.arange(50))
    assert column["a.table"].at(0) in ({"type": "p", "k": 1.0}, {"type": "q"})
    assert [type(column[name].at(3)) for name in ("a.uniform", "a.choice", "a.grid", "a.flag")] == [float, str, int, bool]
    assert [column["a.grid"].at(i) for i in range(50)] == column["a.grid"].column().tolist()


# From the number alone


@pytest.mark.parametrize(("first", "past"), [(0, 1), (1, 2), (63, 65), (7, 1000), (4095, 4100), (19_999, 20_000)])
def test_a_span_is_the_same_as_in_the_whole(drawn, first, past):
    for name, column in columns(EVERYTHING, first, past).items():
        np.testing.assert_array_equal(column, drawn[name][first:past], err_msg=name)


def test_flights_far_out_are_drawn_too():
    first = 99_000_000
    far = columns(EVERYTHING, first, first + 3)
    again = columns(EVERYTHING, first + 2, first + 3)
    assert [far[name][2] for name in far] == [again[name][0] for name in far]


def test_the_seed_decides_all_that_is_random():
    other = columns(EVERYTHING.replace("seed = 9", "seed = 10"), 0, 500)
    for name, column in columns(EVERYTHING, 0, 500).items():
        assert np.array_equal(column, other[name]) == (name in ("a.grid", "a.flag")), name


ADDED = {
    "uniform": '"z.more" = {type="uniform", low=0.0, high=1.0}\n',
    "sobol": '"z.more" = {type="sobol", low=0.0, high=1.0}\n',
    "choice": '"z.more" = {type="choice", values=[1, 2]}\n',
}


@pytest.mark.parametrize("kind", ADDED)
def test_a_key_added_last_leaves_the_values_of_all_before_it(kind):
    before = EVERYTHING.partition("[[correlated]]")[0]
    old, new = columns(before, 0, 300), columns(before + ADDED[kind], 0, 300)
    assert set(new) - set(old) == {"z.more"}
    for name, column in old.items():
        np.testing.assert_array_equal(new[name], column, err_msg=name)


def test_what_a_key_is_called_or_how_wide_it_is_changes_no_other():
    other = EVERYTHING.replace("a.uniform", "another").replace("high=3.0", "high=30.0").replace('"a.grid"', '"g"')
    old, new = columns(EVERYTHING, 0, 300), columns(other, 0, 300)
    for name in set(old) & set(new):
        np.testing.assert_array_equal(new[name], old[name], err_msg=name)


def test_more_columns_than_one_tick_of_the_counter_gives():
    many = uniform_columns(3, np.arange(2000), 300)
    few = uniform_columns(3, np.arange(2000), 130)
    for ours, theirs in zip(few, many[:130], strict=True):
        np.testing.assert_array_equal(ours, theirs)
    matrix = np.corrcoef(many)
    assert abs(matrix - np.eye(300)).max() < 5.5 / np.sqrt(2000)
    assert min(column.min() for column in many) > 0.0
    assert max(column.max() for column in many) < 1.0


# Grids


def test_grids_come_in_all_combinations_the_last_one_fastest():
    text = '[vary]\n"a" = {type="grid", values=["x", "y"]}\n"n" = {type="uniform", low=0, high=1}\n'
    text += '"b" = {type="grid", low=0.0, high=1.0, count=3}\n"c" = {type="grid", values=[7, 8]}\n'
    found = columns(text, 0, 25)
    wanted = list(itertools.product(["x", "y"], [0.0, 0.5, 1.0], [7, 8])) * 3
    assert list(zip(found["a"], found["b"].tolist(), found["c"].tolist(), strict=True)) == wanted[:25]


# Sobol


def test_a_sobol_sequence_is_scipys_shifted_digitally():
    count, dimensions = 1024, 5
    ours = np.array(sobol(4, np.arange(count), dimensions)).T
    plain = qmc.Sobol(dimensions, scramble=False, bits=32).random(count)
    bits, wanted = (((points * 2.0**32) // 1).astype(np.uint64) for points in (ours, plain))
    shift = bits ^ wanted
    assert (shift == shift[0]).all()
    assert len(set(shift[0].tolist())) == dimensions
    np.testing.assert_array_equal(ours * 2.0**32 % 1.0, 0.5)
    assert ours.min() > 0.0
    assert ours.max() < 1.0


def test_a_sobol_sequence_is_spread_more_evenly_than_chance():
    count = 1024
    ours = np.array(sobol(4, np.arange(count), 3)).T
    chance = np.array(uniform_columns(4, np.arange(count), 3)).T
    assert qmc.discrepancy(ours) < 0.05 * qmc.discrepancy(chance)
    for part in (ours[:, :1], ours[:, 1:2], ours[:, 2:]):  # one in each of as many equal intervals
        assert len(np.unique((part * count).astype(int))) == count


def test_sobol_keys_share_one_sequence_in_the_files_order():
    kinds = {"a": "sobol", "u": "uniform", "b": "sobol"}
    text = "[vary]\n" + "".join(f'{name} = {{type="{kind}", low=0, high=1}}\n' for name, kind in kinds.items())
    found, wanted = columns(text, 5, 90), sobol(1, np.arange(5, 90), 2)
    np.testing.assert_array_equal(found["a"], wanted[0])
    np.testing.assert_array_equal(found["b"], wanted[1])


def test_a_sobol_key_says_nothing_on_standard_error_or_output(capfd):
    columns('[vary]\n"a" = {type="sobol", low=0, high=1}', 3, 10)
    assert capfd.readouterr() == ("", "")


# Noise


@pytest.mark.parametrize("seed", [0, 1, 2**32, 2**62 + 12345])
def test_the_keys_of_the_flights_noise_are_those_of_single_flights(seed):
    numbers = np.array([0, 1, 2, 65_535, 65_536, 10**6 + 7, 10**9 - 1, 2**32 - 1])
    halves = np.array(list(noise_keys(seed, numbers).words))
    for i, flight in enumerate(numbers):
        assert halves[:, i].tolist() == list(key(seed, int(flight)).words)
    assert halves.dtype == float
