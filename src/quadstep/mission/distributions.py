"""How a key of the mission varies from flight to flight, as the user writes it, with its quantile function."""

import math
from itertools import accumulate
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field

from quadstep.mission.fields import Finite, Positive, Quantity, Section, Several, dotted
from quadstep.numbers import Number, exp, log, maximum, minimum, total
from quadstep.numbers.functions import evenly_spaced
from quadstep.numbers.noise import inverse_normal, probability
from quadstep.numbers.solve import cholesky

MOST_OPTIONS = 100_000
"""Most options of a choice or a grid."""


def ordered(low: float | None, high: float | None) -> None:
    """Refuses an empty range."""
    if low is not None and high is not None and low >= high:
        raise ValueError(f"low = {low:g} must be below high = {high:g}")


class Uniform(Section):
    """Uniform between low and high."""

    type: Literal["uniform"]
    low: Annotated[Finite, Quantity("", "lower bound, in the key's unit")]
    high: Annotated[Finite, Quantity("", "upper bound")]

    def model_post_init(self, context: object) -> None:
        ordered(self.low, self.high)

    def quantile(self, u: Number) -> Number:
        """The quantile function: the value below which a draw lies with probability u."""
        return self.low + (self.high - self.low) * u


class Sobol(Uniform):
    """Uniform, but evenly spread: the next dimension of one Sobol sequence that all such keys share."""

    type: Literal["sobol"]  # type: ignore[assignment]


class Normal(Section):
    """Normal with this mean and standard deviation, truncated at low and high where given."""

    type: Literal["normal"]
    mean: Annotated[Finite, Quantity("", "mean, in the key's unit")]
    deviation: Annotated[Positive, Quantity("", "standard deviation")]
    low: Annotated[Finite | None, Quantity("", "truncated below this value")] = None
    high: Annotated[Finite | None, Quantity("", "truncated above this value")] = None

    def model_post_init(self, context: object) -> None:
        ordered(self.low, self.high)
        below, above = self.shares
        if above - below < 1e-9:
            raise ValueError("almost no value lies between low and high: they are too far from the mean")

    @property
    def shares(self) -> tuple[float, float]:
        """The shares below low and below high of the untruncated distribution."""
        below = 0.0 if self.low is None else probability((self.low - self.mean) / self.deviation)
        above = 1.0 if self.high is None else probability((self.high - self.mean) / self.deviation)
        return below, above

    def quantile(self, u: Number) -> Number:
        """The quantile function: the value below which a draw lies with probability u."""
        if self.low is not None and self.low > self.mean:  # shares close to 1 have few digits left: use the other tail
            high = None if self.high is None else 2.0 * self.mean - self.high
            other = self.model_copy(update={"low": high, "high": 2.0 * self.mean - self.low})
            return within(2.0 * self.mean - other.quantile(1.0 - u), self.low, self.high)
        below, above = self.shares
        value = self.mean + self.deviation * inverse_normal(below + (above - below) * u)
        return within(value, self.low, self.high)


class LogNormal(Section):
    """Log-normal, truncated at low and high where given."""

    type: Literal["log-normal"]
    median: Annotated[Positive, Quantity("", "median, in the key's unit")]
    sigma: Annotated[Positive, Quantity("", "standard deviation of the logarithm")]
    low: Annotated[Positive | None, Quantity("", "truncated below this value")] = None
    high: Annotated[Positive | None, Quantity("", "truncated above this value")] = None

    def model_post_init(self, context: object) -> None:
        ordered(self.low, self.high)
        _ = self.logarithm

    @property
    def logarithm(self) -> Normal:
        low, high = (None if end is None else log(end) for end in (self.low, self.high))
        return Normal(type="normal", mean=log(self.median), deviation=self.sigma, low=low, high=high)

    def quantile(self, u: Number) -> Number:
        """The quantile function: the value below which a draw lies with probability u."""
        return within(exp(self.logarithm.quantile(u)), self.low, self.high)


class Choice(Section):
    """One of several values of any kind that the key accepts; equally likely, or by weights."""

    type: Literal["choice"]
    values: Annotated[
        Several[object], Field(min_length=1, max_length=MOST_OPTIONS), Quantity("", "any values that the key accepts")
    ]
    weights: Annotated[
        Several[Annotated[float, Field(ge=0.0, allow_inf_nan=False)]] | None,
        Quantity("", "relative probabilities; default: equal"),
    ] = None

    def model_post_init(self, context: object) -> None:
        if self.weights is not None:
            if len(self.weights) != len(self.values):
                raise ValueError(f"{len(self.weights)} weights for {len(self.values)} values; there must be one for each")
            if not 0.0 < total(self.weights) < math.inf:
                raise ValueError("weights: their sum must be above 0")

    @property
    def options(self) -> tuple[object, ...]:
        return self.values

    def place(self, u: Number) -> NDArray[np.int64]:
        """The index of the option, for an array of u."""
        weights = self.weights or (1.0,) * len(self.values)
        *ends, last = accumulate(weights)
        return np.searchsorted(np.array(ends) / last, np.asarray(u), side="right")


class Grid(Section):
    """Every value in turn, in all combinations with the other grids: given one by one, or `count` from low to high."""

    type: Literal["grid"]
    values: Annotated[
        Annotated[Several[object], Field(max_length=MOST_OPTIONS)] | None, Quantity("", "the values, one by one")
    ] = None
    low: Annotated[Finite | None, Quantity("", "with high and count: first value")] = None
    high: Annotated[Finite | None, Quantity("", "last value")] = None
    count: Annotated[Annotated[int, Field(ge=1, le=MOST_OPTIONS)] | None, Quantity("", "number of values")] = None

    def model_post_init(self, context: object) -> None:
        ranged = (self.low is not None, self.high is not None, self.count is not None)
        if (self.values is None) == (not any(ranged)) or (self.values is None and not all(ranged)):
            raise ValueError("give either values, or low, high and count")
        if self.values is not None and not self.values:
            raise ValueError("values: give at least one")
        if self.count and self.count > 1:
            ordered(self.low, self.high)

    @property
    def options(self) -> tuple[object, ...]:
        if self.values is not None:
            return self.values
        assert self.low is not None and self.high is not None and self.count is not None
        return tuple(evenly_spaced(self.low, self.high, self.count))


Distribution = Annotated[Uniform | Sobol | Normal | LogNormal | Choice | Grid, Field(discriminator="type")]


def within(x: Number, low: float | None, high: float | None) -> Number:
    """The value kept inside the range despite round-off."""
    x = x if low is None else maximum(x, low)
    return x if high is None else minimum(x, high)


class CorrelatedKeys(Section):
    """Keys that are jointly normal, by deviations and correlation, or by covariance; positive definite in either case."""

    keys: Annotated[Several[str], Field(min_length=2, max_length=64), Quantity("", "keys of the mission")]
    mean: Annotated[Several[Finite], Quantity("", "means, one for each key")]
    covariance: Annotated[Several[Several[Finite]] | None, Quantity("", "matrix with one row for each key")] = None
    deviations: Annotated[Several[Positive] | None, Quantity("", "instead: standard deviations, one for each key")] = None
    correlation: Annotated[
        Several[Several[Finite]] | None,
        Quantity("", "with `deviations`: matrix with one row for each key, 1 on the diagonal"),
    ] = None

    def model_post_init(self, context: object) -> None:
        count = len(self.keys)
        if len(set(self.keys)) < count:
            raise ValueError("keys: name each only once")
        if (self.covariance is None) == (self.deviations is None and self.correlation is None) or (
            self.covariance is None and (self.deviations is None or self.correlation is None)
        ):
            raise ValueError("give either covariance, or deviations and correlation")
        for name in ("mean", "deviations", "covariance", "correlation"):
            given = getattr(self, name)
            rows = given if given and isinstance(given[0], tuple) else ()
            if given is not None and (len(given) != count or any(len(row) != count for row in rows)):
                shape = f"{count} rows of {count} entries each" if rows else f"{count} entries"
                raise ValueError(f"{name}: should have {shape}, one per key")
        if self.correlation and any(row[i] != 1.0 for i, row in enumerate(self.correlation)):
            raise ValueError("correlation: must be 1 on the diagonal")
        _ = self.factor

    @property
    def factor(self) -> tuple[tuple[float, ...], ...]:
        """Lower triangular L with L L^T the covariance. Raises ValueError where there is none."""
        name, matrix = "covariance", np.array(self.covariance)
        if self.covariance is None:
            deviations = np.array(self.deviations)
            name, matrix = "correlation", np.array(self.correlation) * deviations[:, None] * deviations
        if not np.allclose(matrix, matrix.T, rtol=1e-9, atol=0.0):
            raise ValueError(f"{name}: must be symmetric")
        try:
            return tuple(map(tuple, cholesky(matrix.tolist())))
        except ValueError:
            raise ValueError(f"{name}: must be positive definite") from None

    def quantiles(self, us: list[Number]) -> list[Number]:
        normal = [inverse_normal(u) for u in us]
        return [
            mean + total(weight * z for weight, z in zip(row[: i + 1], normal, strict=False))
            for i, (mean, row) in enumerate(zip(self.mean, self.factor, strict=True))
        ]


def by_key(table: object) -> object:
    """`vehicle.mass = {...}` in TOML is a table in a table; here it is a key. A table with a type is a distribution."""
    return dotted(table, is_value) if isinstance(table, dict) else table


def is_value(table: dict[str, object]) -> bool:
    """Whether a table is a distribution, or is meant as one, rather than a level of keys."""
    return not table or isinstance(table.get("type"), str) or not all(isinstance(one, dict) for one in table.values())


Varied = Annotated[
    dict[str, Distribution], BeforeValidator(by_key), Quantity("", "what varies from flight to flight, as in a campaign")
]
Together = Annotated[Several[CorrelatedKeys], Quantity("", "keys that vary jointly")]
"""Tables `vary` and `correlated` of files that fly many flights."""
