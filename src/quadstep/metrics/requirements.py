"""What is required of a run: `quadstep fly --require METRIC=LIMIT`, an upper limit for a metric of one flight;
`quadstep campaign --require SHARE`, how large a share of flights must succeed for sure.
"""

import math
from collections.abc import Collection, Mapping
from typing import NamedTuple

from quadstep.io.errors import UserError, meant_of, number_in
from quadstep.metrics.statistics import LEVEL, Estimate
from quadstep.metrics.verdict import Case

OPTION = "--require"


class Requirement(NamedTuple):
    """metric: dotted name as in metrics.json, with or without its unit. most: its upper limit, in that unit."""

    metric: str
    most: float


BOUNDS = {"largest_tilt[rad]": math.pi, "overturned[rad]": math.pi, "heading_error[rad]": math.pi, "saturated_share": 1.0}
"""What no flight exceeds: a limit above it was meant in degrees or percent."""


class JudgedMetric(NamedTuple):
    """A requirement applied to a flight. metric: with its unit. measured: None where the flight has no such number."""

    metric: str
    most: float
    measured: float | None
    failure: str | None

    @property
    def case(self) -> Case:
        return Case(f"{without_unit(self.metric)} at most {quantity(self.most, unit(self.metric))}", self.failure)

    def as_json(self) -> dict[str, object]:
        return {"metric": self.metric, "most": self.most, "measured": self.measured, "met": self.failure is None}


def parsed(text: str) -> Requirement:
    """`position_rmse=0.05`. Raises UserError."""
    name, separator, number = (part.strip() for part in text.partition("="))
    most = number_in(number)
    if not (name and separator) or not (math.isfinite(most) and most >= 0.0):
        raise UserError(f"{OPTION} {text!r:.80}: should be METRIC=LIMIT, for instance position_rmse=0.05")
    return Requirement(name, most)


def unit(metric: str) -> str:
    """`m` of `position_rmse[m]`; empty for a number without a unit."""
    return metric.partition("[")[2].rstrip("]")


def without_unit(metric: str) -> str:
    """`position_rmse` of `position_rmse[m]`."""
    return metric.partition("[")[0]


def with_full_names(requirements: Collection[Requirement], names: Collection[str]) -> list[Requirement]:
    """The requirements with the full names of their metrics. Raises UserError for metrics that are not known."""
    full = {without_unit(metric): metric for metric in names} | {metric: metric for metric in names}
    for one in requirements:
        if one.metric not in full:
            allowed = "allowed: any number of its metrics.json, with or without the unit"
            said = f"is not a metric of this flight{meant_of(without_unit(one.metric), [*map(without_unit, names)], allowed)}"
            raise UserError(f"{OPTION}: {one.metric!r:.60} {said}")
        most = BOUNDS.get(full[one.metric], math.inf)
        if one.most > most:
            meant = (
                f"an angle is in rad ({one.most:g}° are {math.radians(one.most):.3g})"
                if most > 1.0
                else "a share is from 0 to 1"
            )
            raise UserError(f"{OPTION} {one.metric}={one.most:g}: every flight meets that: {meant}")
    return [one._replace(metric=full[one.metric]) for one in requirements]


def judge(one: Requirement, measured: Mapping[str, float | None], diverged: str | None) -> JudgedMetric:
    """Hold a requirement against the metrics of a flight. diverged: how it ended, if that was before its time."""
    value = measured.get(one.metric)
    number, most = quantity(value, unit(one.metric)), quantity(one.most, unit(one.metric))
    failure = None
    if diverged:
        until = f", {number} until then" if value is not None else ""
        failure = f"{without_unit(one.metric)} should be at most {most}, but the flight {diverged}{until}"
    elif value is None or not value <= one.most:
        failure = f"{without_unit(one.metric)} should be at most {most}, but is {number}"
    return JudgedMetric(one.metric, one.most, value, failure)


def quantity(value: float | None, unit: str) -> str:
    return "never reached" if value is None else f"{value:.6g} {unit}".rstrip()


def parsed_share(text: str) -> float:
    """A share between 0 and 1. Raises UserError.

    1 is refused with 0: no number of flights shows that none fails, the other needs no flight at all.
    """
    least = number_in(text)
    if not 0.0 < least < 1.0:
        raise UserError(f"--require {text!r:.40}: should be a share of flights between 0 and 1, like 0.999")
    return least


class JudgedShare(NamedTuple):
    """least: what was required. success: share of flights with its interval, of which the lower end counts.

    flights: that were counted; None where the share was estimated in another way. doubt: why the interval is not reliable.
    """

    least: float
    success: Estimate
    flights: int | None = None
    doubt: str = ""

    @property
    def met(self) -> bool:
        """Whether the lower end of the interval reaches what is required, and can be relied on."""
        return self.success.low >= self.least and not self.doubt

    @property
    def case(self) -> Case:
        name = f"at least {self.least:.10g} of all flights succeed, with {100 * LEVEL:g} % confidence"
        needed, (_, low, high) = flights_needed(self.least), self.success
        below = high < self.least
        end = f"below {math.ceil(1e4 * high) / 100:g} %" if below else f"above {math.floor(1e4 * low) / 100:g} %"
        failure = f"success rate of all flights should be at least {100 * self.least:.10g} %, but is "
        failure += f"{'only ' * (not below)}shown to be {end}"
        if low >= self.least:
            failure = f"the estimate is not reliable: {self.doubt}"
        elif not below and self.flights is not None and self.flights < needed:
            failure += f"; so few flights cannot show more; {needed} could, if none fails"
        return Case(name, None if self.met else failure)

    def as_json(self) -> dict[str, object]:
        return {"least": self.least, "measured": self.success.value, "shown": self.success.low, "met": self.met}


def flights_needed(least: float) -> int:
    """The fewest flights whose interval reaches `least` if all succeed: (1 - LEVEL) / 2 = least^n."""
    return math.ceil(math.log(0.5 * (1.0 - LEVEL)) / math.log(least))
