"""What `compare`, `campaign`, its `--until` and `--rare` decide, on draws and limit states whose truth is known."""

import math
import re
import statistics
from collections import Counter
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
from quadstep.studies.comparison.answer import answer, decisions, leaders
from quadstep.studies.comparison.cells import Situation
from quadstep.studies.comparison.entrants import Comparison, ranks, result
from quadstep.studies.comparison.ranking import CellFlights, Pair
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
        found = Comparison("", "", flights, 1, METRICS, results, ranked)
        yield all(len(leaders(found, place)) != 1 for place in cells)


def middle(values: np.ndarray) -> float:
    """The median; of two middle values of which one is a lost flight's, the other."""
    usual = statistics.median(values.tolist())
    return usual if math.isfinite(usual) else statistics.median_low(values.tolist())


def lopsided(seed: int) -> Iterator[Attempt]:
    """Controllers of which some win most flights and some the median, some are alike, and some lose flights: no sentence says
    anything that flights and pairs do not.
    """
    random = np.random.default_rng(seed)
    for place in count():
        flights, cells = int(random.integers(1, 80)), {}
        for where in range(int(random.integers(1, 4))):
            own, same = {}, np.exp(random.normal(size=80))
            humps, losing = random.random() < 0.5, random.choice([0.0, 0.0, 0.1, 0.6], 6)
            for name in range(int(random.integers(2, 6)) if not cells else len(cells[Situation("", "", "s0")])):
                errors = same[:flights] * np.exp(
                    0.3 * random.normal(size=flights) * (random.random() < 0.8) + 0.2 * random.normal()
                )
                errors += 5.0 * (random.random(flights) < 0.5) * humps
                own[f"c{name}"] = flown(errors, random.random(flights) < losing[name])
            cells[Situation("", "", f"s{where}")] = own
        ranked = ranks(cells, METRIC)
        results = tuple(result(at, name, one, METRICS, None) for at, each in cells.items() for name, one in each.items())
        wrong = contradicted(Comparison("", "", flights, 1, METRICS, results, ranked), cells)
        yield Attempt(2.0 if wrong else 0.0, f"number {place} of seed {seed}: {wrong}")


def contradicted(found: Comparison, cells: dict[Situation, dict[str, CellFlights]]) -> str:  # noqa: PLR0912
    """What a comparison says against its flights and pairs: the first such sentence; empty where there is none."""
    best, lead = Counter[str](), Counter[str]()
    rows = decisions(found)
    for where, own in cells.items():
        medians = {name: middle(one.ranked(METRIC)) for name, one in own.items()}
        pairs = {frozenset(one[:2]): one for one in found.ranked[where].pairs}

        def beats(
            one: str, other: str, pairs: dict[frozenset[str], Pair] = pairs, medians: dict[str, float] = medians
        ) -> bool:
            pair = pairs[frozenset((one, other))]
            alike = pair.lost == 0.0 and abs(pair.difference.value) < 1e-3 * min(medians[one], medians[other])
            return pair.winner == one and pair.keeper != other and not alike and medians[one] <= medians[other]

        named = leaders(found, where)
        if not named:
            good = all(math.isinf(one) for one in medians.values())
        elif found.ranked[where].copies:
            good = all(medians[one] <= 1.001 * min(medians.values()) for one in named)
        else:
            good = all(any(beats(one, name) for one in own if one != name) for name in own if name not in named)
            good &= not any(beats(one, name) for name in named for one in own if one != name)
        for at, both, gap, said in rows:
            if at != where.scenario:
                continue
            one, other = both.split(", ")
            pair = pairs[frozenset((one, other))]
            good &= one == named[0] and (other in named or " is better" in said)
            good &= (f"{one} is better" == said) == (beats(one, other) or (found.ranked[where].copies and len(named) == 1))
            good &= ("do not tell" in said or "does not tell" in said) <= (pair.winner is None and pair.keeper is None)
            if match := re.fullmatch(r"(c\d) loses fewer flights", said):
                good &= pair.keeper == match[1]
            if match := re.fullmatch(r"(c\d) is better flight by flight, but .*", said):
                good &= pair.winner == match[1]
            apart = (own[other].metrics[METRIC] - own[one].metrics[METRIC])[~own[one].lost & ~own[other].lost]
            shown = float(gap.split()[0].replace("−", "-").replace(",", "")) if gap != "-" else math.nan
            good &= (gap == "-") == (not len(apart)) and not shown * float(np.median(apart) if len(apart) else 0.0) < 0.0
        if not good:
            return f"{where.scenario}: {named} {rows}"
        lead.update(named)
        best.update(named * (len(named) == 1))
    if len(cells) == 1:
        return ""
    every, most = answer(found), max(lead.values(), default=0)
    for where in cells:
        named = leaders(found, where)
        if " in both situations" in every or " in all " in every or " in each " in every:
            good = {name for name in lead if lead[name] == most} == set(re.findall(r"c\d", every))
            good &= "is best" not in every or best[named[0]] == len(cells)
        else:
            clauses = re.findall(
                r"(c\d[^;]*?|every controller) (?:is best|are tied|loses .*?|in) ?(?:in )?((?:s\d(?:, | and )?)+)", every
            )
            (who,) = (who for who, places in clauses if where.scenario in places)
            good = set(re.findall(r"c\d", who)) == set(named)
        if not good:
            return every
    return ""


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
        "no sentence on who is best, tied or nearer says what flights and pairs do not",
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
