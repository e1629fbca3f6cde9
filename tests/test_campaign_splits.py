"""A campaign says that failures go with a key only where that is so, and what it says is true of its flights."""

import re

import numpy as np
import pyarrow as pa
import pytest
from scipy.stats import hypergeom

from quadstep.report import units
from quadstep.studies.campaign.flyer import OUTCOME, OUTCOMES, SUCCESS
from quadstep.studies.campaign.report_text import of_key
from quadstep.studies.campaign.sensitivity import FlightParts, parts_of
from quadstep.studies.campaign.splits import failures_go_with, findings, splits, unlikely
from quadstep.studies.campaign.varied import VariedKey
from tests.campaigns import campaign

UNITS = {"vehicle.mass": "kg", "wind.mean.0": "m/s", "controller.nets.enabled": ""}
PART = r"(?:: |, | to )(?:from )?([\d.]+ %) (.*?) \(([\d,]+) flights\)"


def whole(text):
    """The number of flights that a text has."""
    return int(text.replace(",", ""))


def drawn(random, flights):
    values = {"vehicle.mass": random.normal(1.0, 0.1, flights), "wind.mean.0": random.normal(6.0, 2.0, flights)}
    nets = random.integers(0, 2, flights)
    columns = {key: VariedKey(one, None, parts_of(one)) for key, one in values.items()}
    columns["controller.nets.enabled"] = VariedKey(nets, ("on", "off"), FlightParts(nets, 2, False))
    return columns


def test_flights_that_fail_at_random_depend_on_nothing():
    random, wrong = np.random.default_rng(3), 0
    for _ in range(400):
        flights = int(random.integers(50, 1500))
        failed = random.random(flights) < random.choice([0.01, 0.2, 0.9])
        wrong += bool(splits(failed, drawn(random, flights), UNITS))
    assert wrong <= 20, "5 % of 400"


def inside(values, text):
    """The flights that the words for a range mean."""
    text = text.replace("\N{NO-BREAK SPACE}", " ")
    numbers = [float(one) for one in re.findall(r"[\d.]+", text)]
    low, high = (numbers[0], np.inf) if len(numbers) == 1 else numbers
    return values < low if text.startswith("below") else (values >= low) & (values < high)


def test_the_counts_that_are_told_are_those_of_the_flights():
    """Of causes at one end, at both, within one value of a choice, and none; every count is recomputed from the words."""
    random, seen = np.random.default_rng(4), set()
    for turn in range(40):
        columns = drawn(random, 2000)
        mass, wind, nets = (one.values for one in columns.values())
        likely = (0.05 + 0.04 * wind.clip(0.0), 0.9 * (abs(mass - 1.0) > 0.15) * nets + 0.001, np.full(2000, 0.2))[turn % 3]
        failed = random.random(2000) < likely
        for one in findings(failed, {}, columns, UNITS, {"vehicle.mass": 1.0})[1]:
            if "success rate" not in one:
                continue
            within = {"o": np.ones(2000, bool), "n": nets == 0, "f": nets == 1}
            part = within["f" if one.startswith("With nets off, ") else "n" if one.startswith("With nets on, ") else "o"]
            away = "varies with how far vehicle mass is from 1\N{NO-BREAK SPACE}kg:" in one
            key = "vehicle mass" if away else re.search("varies with ([a-z ]+)[,:]", one)[1]
            told = re.findall(PART, one)
            shares = [float(rate[:-2]) for rate, *_ in told]
            assert len(told) > 1 and shares == sorted(shares)
            for rate, text, size in told:
                where = (
                    nets == text.endswith("off")
                    if key == "nets"
                    else inside(abs(mass - 1.0) if away else mass if key == "vehicle mass" else wind, text)
                )
                count = (part & where).sum()
                assert (rate, whole(size)) == (units.percent(1.0 - (failed & part & where).sum() / count), count), one
            fails = [100.0 - one for one in shares]
            assert key == "nets" or fails[0] >= 1.4 * fails[-1] or fails[0] >= 9.9 + fails[-1], (
                "what hardly matters is not told"
            )
            seen.add((key, one.startswith("With ")))
    assert seen == {("mean wind along x", False), ("nets", False), ("vehicle mass", True)}


def test_what_is_said_of_the_best_choice_is_counted_whatever_the_campaign():
    """And where another value does better is said where it clearly does, else with doubt; the range is that of the finding."""
    random, seen = np.random.default_rng(7), set()
    for turn in range(120):
        columns = drawn(random, int(random.integers(500, 2000)))
        nets, wind = columns["controller.nets.enabled"].values, columns["wind.mean.0"].values
        often = random.choice([0.02, 0.3, 0.8], 2)[nets]
        failed = random.random(len(nets)) < (often if turn % 2 else np.where(nets == 1, 0.2, 0.9 * (wind > 8.0)))
        said, more = findings(failed, {"lost flights": failed}, columns, UNITS)
        said, more = said.replace("\N{NO-BREAK SPACE}", " "), " ".join(more).replace("\N{NO-BREAK SPACE}", " ")
        if not said:
            continue
        best, other = ((nets == ["on", "off"].index(one)) for one in re.findall(r"with nets (on|off)", said)[:2])
        told = re.search(r" (?:But w|W)here the mean wind along x is (.*?), the rates are ", said)
        sure = "But where" in said
        assert bool(told) == (sure or "too few flights to tell which is better there." in said)
        where = inside(wind, told[1]) if told else np.ones(len(nets), bool)
        parts = [best, other, best & where, other & where][: 4 if told else 2]
        rates = [(units.percent(1.0 - failed[some].mean()).replace("\N{NO-BREAK SPACE}", " "), some.sum()) for some in parts]
        assert [(one, whole(size)) for one, size in re.findall(r"([\d.]+ %) of ([\d,]+)", said)] == rates
        assert failed[best].mean() <= failed[other].mean()
        if told:
            assert failed[best & where].mean() > failed[other & where].mean() + 0.03 * sure
            assert told[1] in more, "one range, told twice alike"
        seen.add((turn % 2, sure))
    assert {(0, True), (1, False)} <= seen <= {(0, True), (0, False), (1, False)}


def test_that_another_value_does_better_in_a_range_is_not_said_of_chance():
    """The range is where most flights with nets fail, and so rather one in which they failed too often by chance."""
    random = np.random.default_rng(8)
    for likely, off, often in ((0.4, 0.4, False), (0.9, 0.2, True)):
        told = 0
        for _ in range(100):
            columns = drawn(random, 3000)
            nets, wind = columns["controller.nets.enabled"].values == 0, columns["wind.mean.0"].values > 9.0
            failed = random.random(3000) < np.where(wind, np.where(nets, likely, off), np.where(nets, 0.0, 0.2))
            said = findings(failed, {}, columns, UNITS)[0]
            assert re.match(r"[\d.]+ % of [\d,]+ flights succeeded with nets on, ", said.replace("\N{NO-BREAK SPACE}", " "))
            told += "But where" in said
        assert told == 100 * often


def test_that_more_flights_are_lost_with_the_better_choice_is_said_where_it_is_no_chance():
    """With nets most flights stay below the limit; whether more of them are lost is another question."""
    random = np.random.default_rng(9)
    for likely, off, most in ((0.02, 0.02, 10), (0.05, 0.005, 100)):
        told = 0
        for _ in range(100):
            columns = drawn(random, 3000)
            nets = columns["controller.nets.enabled"].values == 0
            lost = random.random(3000) < np.where(nets, likely, off)
            above = ~lost & (random.random(3000) < np.where(nets, 0.0, 0.3))
            said = findings(lost | above, {"flights above a limit": above, "lost flights": lost}, columns, UNITS)[0]
            counts = (
                f"({(lost & nets).sum()} of {nets.sum():,}) than with nets off ({(lost & ~nets).sum()} of {(~nets).sum():,})."
            )
            more = f" But more flights are lost with nets on {counts}"
            assert ("are lost" in said) == said.replace("\N{NO-BREAK SPACE}", " ").endswith(more)
            told += "are lost" in said
        assert told <= most and (most < 100 or told == 100)


def test_a_finding_has_the_keys_that_it_is_of_also_where_the_words_of_one_key_are_in_those_of_another():
    random = np.random.default_rng(6)
    columns = drawn(random, 2000)
    columns = {
        "vehicle.motor": columns["vehicle.mass"],
        "vehicle.motor.lag": columns["wind.mean.0"],
        "vehicle.motor.on": [*columns.values()][2],
    }
    lag, on = columns["vehicle.motor.lag"].values, columns["vehicle.motor.on"].values == 0
    late = findings(lag > 8.0, {"lost flights": lag > 8.0}, columns, dict.fromkeys(columns, ""))[1]
    assert {*late.values()} == {("vehicle.motor.lag",)}
    assert of_key(late, "vehicle.motor.lag") == [*late]
    assert not of_key(late, "vehicle.motor")
    both = findings(on & (lag > 8.0), {}, columns, dict.fromkeys(columns, ""))[1]
    assert ("vehicle.motor.lag", "vehicle.motor.on") in both.values()
    assert all(one.startswith("The success rate varies with vehicle motor on") for one in of_key(both, "vehicle.motor.on"))


def test_a_key_that_is_worst_at_both_ends_is_told_by_its_distance_from_the_missions_value():
    columns = drawn(np.random.default_rng(5), 2000)
    failed = abs(columns["vehicle.mass"].values - 1.0) > 0.12
    (one,) = splits(failed, columns, UNITS, {"vehicle.mass": 1.0})
    said = one.sentence.replace("\N{NO-BREAK SPACE}", " ")
    count = failed.sum()
    assert said == (
        f"The success rate varies with how far vehicle mass is from 1 kg: 0 % at 0.12 kg or more ({count:,} flights), "
        f"100 % below 0.12 kg ({2000 - count:,} flights)."
    )
    (one,) = splits(failed, columns, UNITS)
    assert [text.replace("\N{NO-BREAK SPACE}", " ") for *_, text in one.bands] == [
        "below 0.88 kg",
        "at 0.88 to 1.12 kg",
        "at 1.12 kg or more",
    ]


@pytest.mark.parametrize("low", [-0.5, 0.0, 3.1])
def test_a_key_whose_distance_from_the_missions_value_has_one_side_is_told_by_its_values(low):
    wind = np.random.default_rng(6).uniform(low, 14.0, 400)
    one = VariedKey(wind, None, parts_of(wind))
    (found,) = splits(wind > 7.4, {"wind.mean.0": one}, {"wind.mean.0": "m/s"}, {"wind.mean.0": 3.0})
    assert not found.about
    assert found.sentence.startswith("The success rate varies with mean wind along x: ")


def test_the_bound_is_never_below_the_probability():
    for size, count, total in ((20, 30, 100), (7, 90, 100), (40, 3, 60)):
        for hit in range(max(0, size + count - total), min(size, count) + 1):
            law = hypergeom(total, count, size)
            tail = law.sf(hit - 1) if hit * total >= size * count else law.cdf(hit)
            assert tail <= np.exp(-unlikely(hit, size, count, total)) * (1.0 + 1e-12)


def test_another_key_is_told_beside_the_first_within_a_value_of_a_choice():
    """As a start far off its path is without nets, where the mass explains most."""
    columns = drawn(np.random.default_rng(9), 20_000)
    mass, wind, nets = (one.values for one in columns.values())
    failed = (nets == 1) & ((abs(mass - 1.0) > 0.15) | (np.random.default_rng(1).random(20_000) < 0.1 * (wind > 7.0)))
    by, said = findings(failed, {}, columns, UNITS, {"vehicle.mass": 1.0})
    assert [*said.values()][:3] == [
        ("controller.nets.enabled",),
        ("vehicle.mass", "controller.nets.enabled"),
        ("wind.mean.0", "controller.nets.enabled"),
    ]
    good = units.percent(1.0 - failed.sum() / (nets == 1).sum())
    on, off = (nets == 0).sum(), (nets == 1).sum()
    assert by == f"100 % of {on:,} flights succeeded with nets on, {good} of {off:,} with nets off."


@pytest.mark.parametrize(
    ("head", "did"), [("[failure]\nposition_rmse = 0.1", "flights succeeded with"), ("", "flights reached the end with")]
)
def test_without_limits_the_flights_with_the_best_choice_reach_the_end(tmp_path, head, did):
    key, places = "controller.nets.enabled", np.arange(200) % 2
    read = campaign(tmp_path, f'"{key}" = {{type="choice", values=[true, false]}}', head=head)
    ended = pa.DictionaryArray.from_arrays(pa.array(places, pa.int8()), OUTCOMES)
    flown = pa.table({OUTCOME: ended, SUCCESS: pa.array(places == 0)})
    by, _ = failures_go_with(flown, read, {key: VariedKey(places, ("on", "off"), FlightParts(places, 2, False))})
    assert did in by.replace("\N{NO-BREAK SPACE}", " ")


def test_the_values_of_a_choice_of_numbers_are_named_with_their_unit():
    random = np.random.default_rng(9)
    late, nets = random.integers(0, 4, 4000), random.integers(0, 2, 4000)
    columns = {
        "sensors.latency": VariedKey(late, ("0", "0.02", "0.04", "0.06"), FlightParts(late, 4, True)),
        "controller.nets.enabled": VariedKey(nets, ("on", "off"), FlightParts(nets, 2, False)),
    }
    units_of = {"sensors.latency": "s", "controller.nets.enabled": ""}
    failed = random.random(4000) < np.array([0.05, 0.5, 0.5, 0.95])[late] * (1.0 - 0.4 * nets * (late == 1))
    kinds = {"lost flights": (late == 2) & (nets == 0) & failed}
    said = " ".join(findings(failed, kinds, columns, units_of)[1]).replace("\N{NO-BREAK SPACE}", " ")
    for part in ("% at 0.06 s (", "% at 0 s (", "% at 0.02 or 0.04 s ("):
        assert part in said, said
    assert "below" not in said and "or more" not in said
    only = np.where(late == 1, 0.8 * nets, 0.4) > random.random(4000)
    said = " ".join(findings(only, {}, columns, units_of)[1]).replace("\N{NO-BREAK SPACE}", " ")
    assert "With sensor latency = 0.02 s, the success rate varies with nets" in said, said
