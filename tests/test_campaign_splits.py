"""A campaign says that failures go with a key only where that is so, and what it says is true of its flights."""

import re

import numpy as np
from scipy.stats import binom

from quadstep.studies.campaign.sensitivity import parts_of
from quadstep.studies.campaign.splits import bound, findings, splits
from quadstep.studies.campaign.varied import VariedKey

UNITS = {"vehicle.mass": "kg", "wind.mean.0": "m/s", "controller.nets.enabled": ""}
PART = r"([\d.]+) %(?: fail)? (below|from|with nets) ([\d.]+|on|off)(?: to ([\d.]+))?"


def drawn(random, flights):
    values = {"vehicle.mass": random.normal(1.0, 0.1, flights), "wind.mean.0": random.normal(6.0, 2.0, flights)}
    nets = random.integers(0, 2, flights)
    columns = {key: VariedKey(one, None, parts_of(one)) for key, one in values.items()}
    columns["controller.nets.enabled"] = VariedKey(nets, ("true", "false"), parts_of(nets.astype(float)))
    return columns


def test_flights_that_fail_at_random_depend_on_nothing():
    random, wrong = np.random.default_rng(3), 0
    for _ in range(400):
        flights = int(random.integers(50, 1500))
        failed = random.random(flights) < random.choice([0.01, 0.2, 0.9])
        wrong += bool(splits(failed, drawn(random, flights), UNITS))
    assert wrong <= 20, "5 % of 400"


def between(values, how, low, high):
    return values < float(low) if how == "below" else (values >= float(low)) & (values < float(high or np.inf))


def test_the_shares_that_are_told_are_those_of_the_flights():
    random, seen = np.random.default_rng(4), set()
    for turn in range(60):
        columns = drawn(random, 2000)
        mass, wind, nets = (one.values for one in columns.values())
        likely = (0.05 + 0.04 * wind.clip(0.0), 0.6 * (abs(mass - 1.0) > 0.1) * nets, np.full(2000, 0.2))[turn % 3]
        failed = random.random(2000) < likely
        for one in findings(failed, {}, columns, UNITS):
            if one.startswith("How many flights fail varies with "):
                for share, how, low, high in re.findall(PART, one.replace("\N{NO-BREAK SPACE}", " ")):
                    values = wind if "m/s" in one and float(low if low[0].isdigit() else 0.0) > 2.0 else mass
                    where = nets == (low == "off") if how == "with nets" else between(values, how, low, high)
                    assert abs(100.0 * failed[where].mean() - float(share)) <= 0.051, one
                seen.add(re.match(".*?with ([a-z ]+):", one)[1])
            elif one.startswith("With "):
                share = float(re.search(r"([\d.]+) % fail", one)[1])
                assert share > 100.0 * max(failed[nets == 1].mean(), failed.mean())
                seen.add("both")
    assert seen == {"mean wind along x", "vehicle mass", "both"}


def test_a_key_that_is_worst_at_both_ends_is_told_so():
    columns = drawn(np.random.default_rng(5), 2000)
    failed = abs(columns["vehicle.mass"].values - 1.0) > 0.12
    (one,) = splits(failed, columns, UNITS)
    assert re.fullmatch(
        r"vehicle mass: [\d.]+ % fail below [\d.]+.kg and [\d.]+ % from [\d.]+.kg on, but 0 % from .*kg", one.sentence
    )


def test_the_bound_is_never_below_the_probability():
    for many, share in ((20, 0.3), (7, 0.9)):
        for hit in range(many + 1):
            tail = binom.sf(hit - 1, many, share) if hit >= many * share else binom.cdf(hit, many, share)
            assert tail <= bound(hit, many, share) * (1.0 + 1e-12)
