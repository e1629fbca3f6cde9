"""The result of the replicates: a probability with an interval from their scatter, and warnings."""

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from quadstep.io.grouping import by_first
from quadstep.metrics.registry import AT_REST
from quadstep.metrics.statistics import LEVEL, NORMAL, Estimate, exact_share, student_quantile
from quadstep.report import units
from quadstep.studies.campaign.schema import Method
from quadstep.studies.campaign.summary import within
from quadstep.studies.rare.mixture import Floats
from quadstep.studies.rare.point_flyer import Failure
from quadstep.studies.rare.replicates import PieceKind
from quadstep.studies.rare.run_folder import FinishedPiece, Nearest, RepeatedFailures

APART = 10.0
"""Ratio of the largest to the smallest replicate above which they disagree."""

MORE = 5.0
"""Ratio of a second opinion to the probability above which it contradicts the estimate."""

DOUBT = 0.01
"""Probability that an interval from crude flights misses the truth, where it is used as a check."""

CONFIDENCE = f"{100 * (1 - DOUBT):g} % confidence"

FEW_AGAIN = 0.1
"""Share of failures that fail again with different noise, below which noise dominates."""

HOW = {Failure.ABOVE.value: "exceeded a limit", Failure.EARLY.value: "ended early", Failure.ANY.value: "failed"}
"""Kinds of failure, as flights are said to fail."""


class Crude(NamedTuple):
    """Flights drawn as the campaign draws, and how many of them failed. rate: with its exact 99 % interval. kinds: of failure,
    how many flights were tested for it and how many of them failed so; the rate is the sum of theirs.
    """

    flights: int
    failures: int
    rate: Estimate
    kinds: Mapping[str, tuple[int, int]] = MappingProxyType({})

    @property
    def sentence(self) -> str:
        """What they show, and how many failed how."""
        kinds = self.kinds or {Failure.ANY.value: (self.flights, self.failures)}
        each = [f"{count_of(failed)} of {flown:,}{' others' * bool(place)} {HOW.get(kind, kind)}"
                for place, (kind, (flown, failed)) in enumerate(kinds.items())]  # fmt: skip
        return (
            f"{self.range_text} of flights fail, with {CONFIDENCE}: of flights drawn as in the campaign, {units.listed(each)}"
        )

    @property
    def range_text(self) -> str:
        return within(*self.rate[1:]) if self.failures else f"at most {units.percent(self.rate.high)}"


def count_of(flights: int) -> str:
    return f"{flights:,}" if flights else "none"


class RareSummary(NamedTuple):
    """probability: of failure, with its 95 % interval. replicates: those of each. flights: all that were flown.

    one_by_one: crude flights whose interval would be as wide. kinds: the probability of each kind of failure; by_choice: of
    flights with each value of a choice. opinions: by method and score; a single one has no interval.
    nearest: the most likely failure of each kind that was found, the likeliest first.
    """

    probability: Estimate
    replicates: tuple[float, ...]
    flights: int
    one_by_one: float | None
    kinds: Mapping[str, float]
    crude: Crude
    opinions: Mapping[str, Estimate]
    nearest: tuple[Nearest, ...]
    again: RepeatedFailures
    warnings: tuple[str, ...]
    rest: Mapping[str, str] = {}
    by_choice: Mapping[str, Estimate] = {}


def summarise(done: Sequence[FinishedPiece]) -> RareSummary:
    own = [one for one in done if one.kind == PieceKind.REPLICATE.value]
    probabilities = np.array([one.probability for one in own])
    crude = crude_of(own)
    probability = interval(probabilities, crude)
    by_choice = {name: with_it(own, name) for name in own[0].events[0].options}
    mean = probability.value
    half = (probability.high - probability.low) / (2.0 * mean) if mean > 0.0 else 0.0
    one_by_one = (1.0 - mean) / mean * (NORMAL / half) ** 2 if half > 0.0 else None
    kinds = dict[str, float]()
    for event in (event for one in own for event in one.events):
        kinds[event.failure] = kinds.get(event.failure, 0.0) + event.probability / len(own)
    others = by_first((f"{one.method.words}, {one.score}", one.probability) for one in done if one not in own)
    opinions = {name: interval(np.array(some), crude) for name, some in others.items()}
    near = sorted((event.nearest for one in done for event in one.events if event.nearest), key=lambda one: -one.deviations)
    nearest = tuple({one.failure: one for one in near if one.failure in kinds}.values())[::-1]
    again = [one.again for one in own if one.again]
    flown, failed = sum(one.flights for one in again), sum(one.failures for one in again)
    found = RareSummary(
        probability, tuple(probabilities.tolist()), sum(one.flights for one in done), one_by_one, kinds, crude,
        opinions, nearest, RepeatedFailures(flights=flown, failures=failed), (), by_choice=by_choice,
    )  # fmt: skip
    return found._replace(warnings=tuple(warnings(found)))


def with_it(own: Sequence[FinishedPiece], name: str) -> Estimate:
    """The probability of failure of flights with a value of a choice."""
    names, some = ("probability", "crude_failures"), list[FinishedPiece]()
    for one in own:
        found = [event.model_copy(update=dict(zip(names, event.options[name], strict=False))) for event in one.events]
        some.append(one.model_copy(update={"events": found, "probability": sum(event.probability for event in found)}))
    rate = interval(np.array([one.probability for one in some]), crude_of(some))
    return Estimate(*(min(1.0, end / own[0].events[0].options[name][-1]) for end in rate))


def interval(probabilities: Floats, crude: Crude) -> Estimate:
    """The mean of independent estimates with its 95 % interval.

    Estimates of small probabilities scatter by factors: they are assumed log-normal, and the interval is Cox's for the mean
    (Zhou and Gao 1997) with Student's quantile. If some are 0, it begins at 0 and ends at Student's for the numbers
    themselves; if all are, it is that of the crude flights. A single estimate has none.
    """
    count, mean = len(probabilities), float(probabilities.mean())
    if count == 1:
        return Estimate(mean, math.nan, math.nan)
    if mean == 0.0:
        return Estimate(0.0, 0.0, crude.rate.high)
    quantile = student_quantile(0.5 * (1.0 + LEVEL), count - 1)
    if probabilities.min() == 0.0:
        return Estimate(mean, 0.0, mean + quantile * float(probabilities.std(ddof=1)) / math.sqrt(count))
    logs = np.log(probabilities)
    middle, variance = float(logs.mean()), float(logs.var(ddof=1))
    half = quantile * math.sqrt(variance / count + variance**2 / (2.0 * (count - 1)))
    low, high = (math.exp(middle + 0.5 * variance + side) for side in (-half, half))
    return Estimate(mean, min(low, mean), min(max(high, mean), 1.0))


def crude_of(own: Sequence[FinishedPiece]) -> Crude:
    """The flights that replicates begin with, over all events: each adds its own rate."""
    rates: dict[str, tuple[int, int]] = {}
    for event in (event for one in own for event in one.events):
        flown, failed = rates.get(event.failure, (0, 0))
        rates[event.failure] = (flown + event.crude, failed + event.crude_failures)
    tail = 0.5 * DOUBT / len(rates)
    ends = [exact_share(failed, flown, tail) for flown, failed in rates.values()]
    rate = Estimate(*(min(1.0, sum(part)) for part in zip(*ends, strict=True)))
    flown, failed = (sum(part) for part in zip(*rates.values(), strict=True))
    return Crude(flown, failed, rate, rates)


def warnings(summary: RareSummary) -> list[str]:
    """Warnings against the estimate, in sentences."""
    said, own = [], np.array(summary.replicates)
    none = int((own == 0.0).sum())
    if none:
        said.append(
            f"{none} of {len(own)} replicates found no failure: the score does not lead to one, or hardly any flight fails. "
            "Use another score (rare.score) or more flights per level (rare.flights)."
        )
    elif own.max() > APART * own.min():
        said.append(
            f"The replicates disagree: the largest is {own.max() / own.min():.3g} times the smallest. Use more flights "
            "per level (rare.flights) or another score (rare.score)."
        )
    if summary.crude.rate.low > summary.probability.high or summary.crude.rate.high < summary.probability.low:
        said.append(f"Plain Monte Carlo flights disagree: {summary.crude.sentence}.")
    what, second = max(summary.opinions.items(), key=lambda one: one[1].value, default=("", Estimate(0.0, 0.0, 0.0)))
    if second.value > (max(MORE * summary.probability.value, summary.probability.high) if none < len(own) else 0.0):
        sure = f"95 % interval {second.low:.3g} to {second.high:.3g}" if second.bounded else "one estimate, without interval"
        said.append(
            f"A second opinion finds more failures: {second.value:.3g} ({what}; {sure}). The estimate may have missed a "
            "failure mode; name the metrics that predict it (rare.score)."
        )
    again = summary.again
    if again.failures < FEW_AGAIN * again.flights:
        said.append(
            f"Chance decides here: {count_of(again.failures)} of {again.flights} failed flights failed again when their noise "
            "was redrawn, which is not steered towards failure."
        )
    return said


def as_json(summary: RareSummary) -> dict[str, object]:
    return {
        "probability": summary.probability._asdict(),
        "by_choice": {name: one._asdict() for name, one in summary.by_choice.items()},
        "kinds": dict(summary.kinds),
        "replicates": list(summary.replicates),
        "flights": summary.flights,
        "flights_one_by_one": summary.one_by_one,
        "crude": {**summary.crude._asdict(), "kinds": dict(summary.crude.kinds), "rate": summary.crude.rate._asdict()},
        "opinions": {what: one.as_json() for what, one in summary.opinions.items()},
        "nearest_failures": [one.model_dump() for one in summary.nearest],
        "fail_again_with_other_noise": summary.again.failures / summary.again.flights if summary.again.flights else None,
        "warnings": list(summary.warnings),
        AT_REST: dict(summary.rest),
    }


def rounded(flights: float, digits: int = 2) -> str:
    """A number of flights to so many digits."""
    return f"{float(f'{flights:.{digits}g}'):,.0f}" if flights < 1e9 else units.number(flights, digits)


def by_kind(kinds: Mapping[str, float]) -> str:
    """The probability of each kind of failure, where there are several, in a sentence before a blank."""
    found = [(units.number(share), HOW.get(kind, kind)) for kind, share in kinds.items() if share]
    if len(kinds) > len(found) == 1:
        return f"All failures found {found[0][1]}. "
    return f"It is the sum of {units.listed([f'{share} for flights that {how}' for share, how in found])}. " * bool(found[1:])


def sentences(summary: RareSummary, method: Method, meaning: str = "") -> list[str]:
    """What was found, the answer first. meaning: as `Campaign` has it."""
    kinds, (value, low, high) = by_kind(summary.kinds), (units.number(part) for part in summary.probability)
    often = (
        f" (about 1 flight in {rounded(1.0 / summary.probability.value)})" if 0.0 < summary.probability.value < 0.01 else ""
    )
    estimate = f"{value}{often}, with 95 % confidence {low} to {high},"
    if summary.by_choice:
        kinds = f"Over all flights of the campaign it is {estimate[:-1]}. {kinds}"
        estimate = f"{units.listed([in_words(one, name) for name, one in summary.by_choice.items()])},"
    check = f"{summary.crude.sentence[0].upper()}{summary.crude.sentence[1:]}."
    source = f"From {len(summary.replicates)} independent estimates (replicates) by {method.words}{meaning}."
    lines = [f"A flight fails with probability {estimate} if no kind of failure was missed. {kinds}{source}"]
    if summary.warnings:
        see = f"see the warning{'s' * bool(summary.warnings[1:])}"
        lines = [f"{check} The estimate, {estimate} is doubtful: {see}. {kinds}{source}"]
    if not summary.probability.value and not summary.crude.failures:
        lines = [f"{check} No replicate found a failure. {source}"]
    if summary.one_by_one and summary.one_by_one < summary.flights and not summary.by_choice:
        plain = f"about {rounded(summary.one_by_one, 1)} instead of {summary.flights:,} for an interval as wide"
        lines[0] += f" A plain campaign needs fewer flights, {plain}."
    if summary.opinions:  # in the order of `pieces`
        scores = zip(("the same score", "another"), summary.opinions.values(), strict=False)
        each = [in_words(one, score, "by") for score, one in scores]
        lines.append(f"Second opinion{'s' * bool(each[1:])} by {method.other.words}, as a check: {units.listed(each)}.")
    if not summary.warnings:
        lines.append(f"Plain Monte Carlo, as a check: {summary.crude.sentence}.")
        if again := summary.again.flights:
            failed = summary.again.failures
            share = "most" if failed < 0.5 * again else "some"
            why = (
                f"noise decides too: with other noise, {share} of them succeeded"
                if failed < again
                else "it made no difference to them"
            )
            lines.append(f"{failed} of {again} failures failed again when flown with different noise, so {why}.")
    return lines


def in_words(one: Estimate, name: str, by: str = "with") -> str:
    """The probability of flights with a value of a choice, or by a score; at most what plain flights leave where no failure
    was found. A single estimate has no interval.
    """
    value, low, high = map(units.number, one)
    ends = f" (95 % interval {low} to {high})" * one.bounded
    return f"{value} {by} {name}{ends}" if one.value or not one.bounded else f"at most {high} {by} {name}"
