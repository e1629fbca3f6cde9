"""The table `[tune]` of a mission: which gains `quadstep tune` may change, on which flights, and what counts as better."""

import math
from collections.abc import Sequence
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BeforeValidator, Field

from quadstep.io.errors import UserError
from quadstep.metrics.registry import MARGINS, UNITS, is_margin
from quadstep.mission.check import Checked, check
from quadstep.mission.distributions import Together, Varied, ordered
from quadstep.mission.fields import Finite, NonNegative, Positive, Quantity, Section, dotted
from quadstep.numbers import exp, log

MOST_SEEDS = 100_000


class Range(Section):
    """Search interval and scale of a gain."""

    low: Annotated[Finite, Quantity("", "lower bound, in the gain's unit")]
    high: Annotated[Finite, Quantity("", "upper bound")]
    scale: Annotated[Literal["log", "linear"], Quantity("", "scale of the search")] = "log"

    def model_post_init(self, context: object) -> None:
        ordered(self.low, self.high)
        if self.scale == "log" and self.low <= 0.0:
            raise ValueError(f'low = {self.low:g}: a logarithmic scale needs low above 0; or set scale = "linear"')

    def value(self, place: float) -> float:
        """What is at this place, 0 at low and 1 at high."""
        if self.scale == "log":
            return exp((1.0 - place) * log(self.low) + place * log(self.high))
        return (1.0 - place) * self.low + place * self.high

    def place(self, value: float) -> float:
        if self.scale == "log":
            return log(value / self.low) / log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)


class Constraint(Section):
    """A metric must be at most this, or at least this, in a share of the flights."""

    most: Annotated[Positive | None, Quantity("", "upper limit of a metric, in its unit")] = None
    least: Annotated[NonNegative | None, Quantity("", "lower limit of a margin; 0: it need not be kept")] = None
    share: Annotated[float, Field(gt=0.0, le=1.0), Quantity("", "share of the flights in which it must be met")] = 1.0

    def model_post_init(self, context: object) -> None:
        if (self.most is None) == (self.least is None):
            raise ValueError("give either most or least")

    @property
    def value(self) -> float:
        return self.most if self.most is not None else self.least or 0.0

    def keeps(self, values: NDArray[np.float64]) -> NDArray[np.bool_]:
        return values <= self.most if self.most is not None else values >= (self.least or 0.0)

    def slack(self, value: float) -> float:
        """How far one value is within the limit, as a share of it; below 0 where it misses it."""
        return 1.0 - value / self.most if self.most is not None else value / (self.least or math.inf) - 1.0

    def excess(self, values: NDArray[np.float64]) -> float:
        """By what share of the limit it is missed, by the flight that is just to keep it; 0 where it is kept."""
        place = math.ceil(self.share * len(values) - 1e-9) - 1
        if self.most is not None:
            return max(0.0, float(np.sort(values)[place]) / self.most - 1.0)
        return max(0.0, 1.0 - float(np.sort(values)[::-1][place]) / (self.least or math.inf))


def ranges_by_key(table: object) -> object:
    """`controller.K_r1 = {...}` in TOML is a table in a table; here it is a key. A range is what has an end or a scale."""
    if not isinstance(table, dict):
        return table
    return dotted(table, lambda inside: not inside or bool(Range.model_fields.keys() & inside.keys()))


def as_ranges(table: dict[str, object]) -> dict[str, Range | None]:
    """Ranges by key; None where `{}` asks for the one that the gain declares."""
    return {key: as_section(Range, one, key, "{ low = ..., high = ... }") if one else None for key, one in table.items()}


def as_constraints(table: dict[str, object]) -> dict[str, Constraint]:
    """Constraints by metric; a number stands for the most in all flights, of a margin for the least."""
    found = {}
    for key, one in table.items():
        limit = "least" if is_margin(key) else "most"
        given = {limit: one} if isinstance(one, int | float) and not isinstance(one, bool) else one
        found[key] = as_section(Constraint, given, key, f"a number or {{ {limit} = ..., share = ... }}")
        least = found[key].least or 0.0
        if key.startswith("phase_margin") and least > math.pi:
            raise ValueError(f"{key}: should be at most 3.14 rad; {least:g}° are {math.radians(least):.3g} rad")
    return found


def as_section(model: type[Checked], value: object, key: str, wanted: str) -> Checked:
    """A section checked; ValueError with one line on what is wrong."""
    if isinstance(value, model):
        return value
    if not isinstance(value, dict):
        raise ValueError(f"{key}: should be {wanted}, not {value!r:.40}")  # noqa: TRY004 (pydantic takes it for an answer)
    try:
        return check(model, value, key)
    except UserError as error:
        raise ValueError("; ".join(error.lines)) from None


class TuneSection(Section):
    """The task of `quadstep tune`; it affects no flight."""

    gains: Annotated[
        dict[str, Any],
        BeforeValidator(ranges_by_key),
        Field(min_length=1, max_length=64),
        AfterValidator(as_ranges),
        Quantity(
            "",
            "keys of the controller and their ranges: controller.k_x = { low = 2.0, high = 90.0 }, or {} for the declared one",
        ),
    ]
    vary: Varied = Field(default_factory=dict)
    correlated: Together = ()
    seeds: Annotated[int, Field(ge=1, le=MOST_SEEDS), Quantity("", "flights per candidate")] = 16
    unseen: Annotated[int, Field(ge=2, le=MOST_SEEDS), Quantity("", "flights per set of gains in the final comparison")] = 200
    objective: Annotated[
        dict[str, Positive], Field(min_length=1), Quantity("", "weight of each metric in the cost of a flight")
    ] = Field(default_factory=lambda: {"position_rmse": 1.0})
    aggregate: Annotated[
        Literal["mean", "p95", "worst"], Quantity("", "aggregate of the flights' costs that is minimised")
    ] = "mean"
    constraints: Annotated[
        dict[str, Any],
        AfterValidator(as_constraints),
        Quantity(
            "",
            "limits of metrics and margins: a number, or most or least, and share; {} for none; if no margin is named, "
            "also a sound loop's margins, or the current ones where smaller",
        ),
    ] = Field(default_factory=dict)
    theorem: Annotated[bool, Quantity("", "whether the controller's gain conditions must be met")] = True
    precision: Annotated[Literal["f32", "f64"], Quantity("", "floating-point precision of the flights")] = "f64"
    score_period: Annotated[Positive | None, Quantity("s", "sampling period of the metrics; default: the log period")] = None

    def check(self, scores: Sequence[str]) -> None:
        """Refuses what no flight of the mission is scored by. Raises ValueError."""
        for table, names in (("objective", self.objective), ("constraints", self.constraints)):
            unknown = [name for name in names if name not in scores and name not in MARGINS]
            if unknown:
                allowed = f"{', '.join(scores)}, and margins: {', '.join(UNITS)}, each with _roll and the like too"
                raise ValueError(f"tune: {table}.{unknown[0]}: unknown metric; allowed: {allowed}")
            if table == "objective" and any(map(is_margin, names)):
                margin = next(filter(is_margin, names))
                raise ValueError(
                    f"tune: objective.{margin}: larger is better; make it a constraint, or weight sensitivity_peak"
                )

    @property
    def of_flights(self) -> dict[str, Constraint]:
        return {name: one for name, one in self.constraints.items() if name not in MARGINS}

    @property
    def margins(self) -> list[str]:
        return [name for name in dict.fromkeys((*self.objective, *self.constraints)) if name in MARGINS]
