"""Kinds of values in a mission file."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import PurePath
from typing import Annotated, TypeVar

import numpy as np
from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field

from quadstep.numbers import Vector

Numbers = TypeVar("Numbers")


class Section(BaseModel):
    """A table of the mission file: unknown keys and wrong types are refused."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    def as_numbers(self, kind: Callable[..., Numbers], **others: object) -> Numbers:
        """The structure of laws whose fields have the names of these keys. others: those that have other names."""
        same = {name: one for name, one in kind.__annotations__.items() if name not in others and hasattr(self, name)}
        values = {name: getattr(self, name) for name in same}
        return kind(**{name: Vector(value) if same[name] is Vector else value for name, value in values.items()}, **others)


def plain(value: object) -> object:
    """Keys given in Python as TOML would give them: tuples and arrays as lists, NumPy's numbers as Python's, paths as text."""
    if isinstance(value, dict):
        return {key: plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return str(value) if isinstance(value, PurePath) else value


def as_tuple(value: object) -> object:
    """TOML has lists, the models hold tuples."""
    return tuple(value) if isinstance(value, list) else value


def as_triple(value: object) -> tuple[object, ...]:
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise ValueError(f"should be a list of three numbers, not {value!r:.60}")
    return tuple(value)


def as_diagonal(value: object) -> tuple[object, ...]:
    """One number stands for three equal ones."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return (value, value, value)
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise ValueError(f"should be a number or a list of three, not {value!r:.60}")
    return tuple(value)


def non_negative(values: tuple[float, ...]) -> tuple[float, ...]:
    if min(values) < 0.0:
        raise ValueError("every entry must be zero or more")
    return values


def positive(values: tuple[float, ...]) -> tuple[float, ...]:
    """Refuses an entry that is not above zero."""
    if min(values) <= 0.0:
        raise ValueError("every entry must be greater than 0")
    return values


LEAST, MOST = 1e-9, 1e9
"""Magnitudes a flight can be computed with: they may be squared, divided by, and counted in steps."""


def at_least(least: float) -> AfterValidator:
    """Refuses a value above zero but below this."""

    def large_enough(value: float) -> float:
        if 0.0 < value < least:
            raise ValueError(f"should be at least {least:g}, not {value:g}")
        return value

    return AfterValidator(large_enough)


def long_enough(value: float) -> float:
    """Refuses a time below a millisecond."""
    if value < 1e-3:
        raise ValueError(f"should be at least 0.001 s, not {value:g}")
    return value


def as_pair(value: object) -> tuple[object, ...]:
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise ValueError(f"should be a list of two numbers, not {value!r:.60}")
    return tuple(value)


def in_radians(values: tuple[float, ...]) -> tuple[float, ...]:
    """Refuses angles of more than a turn, which are meant in degrees."""
    for value in values:
        if abs(value) > 2.0 * math.pi:
            radians = math.radians(value)
            raise ValueError(f"angles are in rad, and {value:g} is more than a turn; {value:g} degrees are {radians:.4g} rad")
    return values


Finite = Annotated[float, Field(ge=-MOST, le=MOST, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, le=MOST, allow_inf_nan=False), at_least(LEAST)]
Duration = Annotated[float, Field(gt=0.0, le=1e6, allow_inf_nan=False), AfterValidator(long_enough)]
"""Seconds that something takes; shorter is a slip of the pen, and its powers leave the range of numbers."""

NonNegative = Annotated[float, Field(ge=0.0, le=MOST, allow_inf_nan=False), at_least(LEAST)]

Triple = Annotated[tuple[Finite, Finite, Finite], BeforeValidator(as_triple)]
Pair = Annotated[tuple[Finite, Finite], BeforeValidator(as_pair)]
Angles = Annotated[Triple, AfterValidator(in_radians)]
Diagonal = Annotated[tuple[Finite, Finite, Finite], BeforeValidator(as_diagonal)]
PositiveDiagonal = Annotated[Diagonal, AfterValidator(positive)]
NonNegativeDiagonal = Annotated[Diagonal, AfterValidator(non_negative)]


def printable(name: str) -> str:
    """Refuses line breaks and other control characters."""
    if not name.isprintable():
        raise ValueError("must be printable text in one line")
    return name


Name = Annotated[str, Field(max_length=200), AfterValidator(printable)]

LEAST_COEFFICIENT = 1e-15

PositiveCoefficient = Annotated[float, Field(gt=0.0, le=MOST, allow_inf_nan=False), at_least(LEAST_COEFFICIENT)]
Coefficient = Annotated[float, Field(ge=0.0, le=MOST, allow_inf_nan=False), at_least(LEAST_COEFFICIENT)]
"""What multiplies a square of a speed, or an inertia: smaller than other numbers, never squared itself."""

Share = Annotated[float, Field(ge=0.0, le=1.0, allow_inf_nan=False)]
PositiveTriple = Annotated[Triple, AfterValidator(positive)]
NonNegativeTriple = Annotated[Triple, AfterValidator(non_negative)]


@dataclass(frozen=True)
class Quantity:
    """What a key means and its unit, for lists of parameters: `mass: Annotated[Positive, Quantity("kg", "mass")]`."""

    unit: str
    meaning: str
