"""What `compare`, `campaign`, its `--until` and `--rare` decide, on draws and limit states whose truth is known."""

import math
import re
from collections.abc import Iterator
from itertools import count, islice
from types import SimpleNamespace
from typing import cast

import numpy as np
from scipy.stats import norm

from quadstep.metrics.statistics import exact_share
from quadstep.studies.campaign.report import explained
from quadstep.studies.campaign.run import looks
from quadstep.studies.campaign.schema import Campaign
from quadstep.studies.campaign.sensitivity import ExplainedResult, certain, parts_of
from quadstep.studies.comparison.answer import answer
from quadstep.studies.comparison.cells import Situation
from quadstep.studies.comparison.entrants import Comparison, ranks, result
from quadstep.studies.comparison.ranking import CellFlights
from quadstep.studies.rare.cross_entropy import cross_entropy
from quadstep.studies.rare.mixture import Points, Random
from quadstep.studies.rare.summary import Crude, interval
from tests.challenge.search import Attempt, Search, covers

METRIC = "position_rmse"
METRICS = {METRIC: f"{METRIC}[m]"}


def flown(errors: np.ndarray, lost: np.ndarray) -> CellFlights:
    return CellFlights(lost, {METRIC: np.where(lost, math.nan, errors)})


def equal_controllers(random: np.random.Generator) -> Iterator[bool]:
    """Controllers that do not differ, in several situations: any pair that is decided, or said to be best, is wrong."""
    while True:
        situations, controllers, flights = (int(random.integers(*span)) for span in ((1, 5), (2, 6), (6, 80)))
        cells: dict[Situation, dict[str, CellFlights]] = {}
        for place in range(situations):
            gusts = np.exp(random.normal(size=flights))  # the same for all, and their own share of each
            cells[Situation("", "", str(place))] = {
                str(name): flown(gusts * np.exp(0.3 * random.normal(size=flights)), random.random(flights) < 0.05)
                for name in range(controllers)
            }
        ranked = ranks(cells, METRIC)
        pairs = [pair for one in ranked.values() for pair in one.pairs]
        # Tracking and losses are a family of tests each.
        yield all(pair.winner is None for pair in pairs)
        yield all(pair.keeper is None for pair in pairs)
        results = tuple(result(at, name, own, METRICS, None) for at, each in cells.items() for name, own in each.items())
        yield "is best" not in answer(Comparison("", "", flights, 1, METRICS, tuple(cells), results, ranked))


def lopsided(seed: int) -> Iterator[Attempt]:
    """Controllers of which some win most flights and some the median, some are alike, and some lose flights: who is best has
    the smallest median, wins against each other, and loses no more flights than any for sure.
    """
    random, where = np.random.default_rng(seed), Situation("", "", "")
    for place in count():
        flights, own, same = int(random.integers(1, 80)), {}, np.exp(random.normal(size=80))
        humps, losing = random.random() < 0.5, random.choice([0.0, 0.0, 0.1, 0.6], 6)
        for name in range(int(random.integers(2, 6))):
            errors = same[:flights] * np.exp(
                0.3 * random.normal(size=flights) * (random.random() < 0.8) + 0.2 * random.normal()
            )
            errors += 5.0 * (random.random(flights) < 0.5) * humps
            own[str(name)] = flown(errors, random.random(flights) < losing[name])
        ranked = ranks({where: own}, METRIC)
        results = tuple(result(where, name, one, METRICS, None) for name, one in own.items())
        said = answer(Comparison("", "", flights, 1, METRICS, (where,), results, ranked))
        medians = {name: float(np.sort(one.ranked(METRIC))[(flights - 1) // 2]) for name, one in own.items()}
        names = re.findall(r"\d+", said.partition(" is best" if " is best" in said else " smallest")[0])
        good = all(medians[name] == min(medians.values()) for name in names)
        for pair in ranked[where].pairs if names else ():
            if names[0] in pair[:2]:
                other = pair.second if pair.first == names[0] else pair.first
                good &= " is best" not in said or (pair.winner == names[0] and pair.keeper != other)
                unclear = re.split("flight|certainly", said.partition("not shown to be better")[2])[0]
                good &= other != pair.winner or f" {other} " not in unclear.replace(",", " ").replace(".", " ")
        yield Attempt(0.0 if good else 2.0, f"number {place} of seed {seed}: {said}")


def idle_keys(random: np.random.Generator) -> Iterator[bool]:
    """Keys that change nothing, beside one that does or none: no sentence of a campaign says that one of them does."""
    nothing = cast(Campaign, SimpleNamespace(file=SimpleNamespace(correlated=[])))
    while True:
        flights, keys = int(random.choice([100, 400, 1000])), int(random.choice([3, 12, 40]))
        x = random.random((keys, flights))
        y = random.normal(size=flights) if random.random() < 0.7 else (random.random(flights) < 0.1).astype(float)
        y = y + (3.0 * x[0] if (acts := random.random() < 0.5) else 0.0)
        shares, pair, _ = explained(ExplainedResult(y), {str(i): parts_of(one) for i, one in enumerate(x)}, nothing)
        idle = [one for name, one in shares.items() if not (acts and name == "0")]
        yield not any(certain(one, len(shares)) for one in idle) and not (pair and certain(pair.share, pair.pairs))


def looked_at(random: np.random.Generator) -> Iterator[bool]:
    """Flights that fail with some probability, counted at looks: none of the intervals of a run may miss it."""
    while True:
        target = float(random.choice([0.3, 0.1, 0.02]))
        p = float(target * random.choice([0.5, 0.999999, 1.0, 1.5]))
        before = failures = 0
        good = True
        for look in islice(looks(target), 6):
            failures += int(random.binomial(look.flights - before, p))
            before = look.flights
            found = exact_share(failures, look.flights, look.tail)
            good &= found.low <= p <= found.high
            if found.high <= target or found.low >= target:
                break
        yield good


def hidden_modes(random: np.random.Generator) -> Iterator[bool]:
    """Failures beyond planes, of which the score sees one: the interval of five replicates holds their probability."""
    while True:
        dimensions, modes = int(random.integers(2, 6)), int(random.integers(1, 3))
        limits = random.uniform(3.3, 4.5, modes)
        truth = 1.0 - math.prod(float(norm.cdf(limit)) for limit in limits)

        def evaluate(points: Points, limits: np.ndarray = limits) -> np.ndarray:
            axes = points.latent[:, : len(limits)]
            return np.where((axes > limits).any(axis=1), np.inf, axes[:, 0])[None]

        numbers = (Random(int(random.integers(2**31)), place, dimensions) for place in range(5))
        found = np.array([cross_entropy(evaluate, 1, each, 500)[0].probability for each in numbers])
        rate = interval(found, Crude(2500, 0, exact_share(0, 2500, 0.005)))
        yield rate.low <= truth <= rate.high


SEARCHES = [
    Search(
        "compare, equal controllers",
        "with 95 % confidence no pair that is decided is wrong",
        covers(equal_controllers, batch=100),
    ),
    Search(
        "compare, who is best",
        "who is best has the smallest median, wins against all and loses no more flights for sure",
        lopsided,
    ),
    Search(
        "campaign, keys that do nothing",
        "with 95 % confidence no key or pair is wrongly said to matter",
        covers(idle_keys, batch=20),
    ),
    Search("until, interim looks", "the intervals of all looks hold the share of failures jointly", covers(looked_at)),
    Search(
        "rare, hidden modes",
        "the interval of a rare probability holds it, also of a mode that no score sees",
        covers(hidden_modes, 0.88, batch=5),
    ),
]
