"""Kinds of values in a mission file."""

from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field


class Section(BaseModel):
    """A table of the mission file: unknown keys and wrong types are refused."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


def as_tuple(value: Any) -> Any:
    """TOML has lists, the models hold tuples."""
    return tuple(value) if isinstance(value, list) else value


def as_diagonal(value: Any) -> Any:
    """One number stands for three equal ones."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return (value, value, value)
    return as_tuple(value)


def non_negative(values: tuple[float, ...]) -> tuple[float, ...]:
    """Refuses an entry below zero."""
    if min(values) < 0.0:
        raise ValueError("every entry must be zero or more")
    return values


def positive(values: tuple[float, ...]) -> tuple[float, ...]:
    """Refuses an entry that is not above zero."""
    if min(values) <= 0.0:
        raise ValueError("every entry must be greater than 0")
    return values


Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Duration = Annotated[float, Field(ge=1e-3, le=1e6)]
"""Seconds that something takes; shorter or longer is a slip of the pen, and its powers leave the range of numbers."""

NonNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]

Triple = Annotated[tuple[Finite, Finite, Finite], BeforeValidator(as_tuple)]
Diagonal = Annotated[tuple[Finite, Finite, Finite], BeforeValidator(as_diagonal)]
PositiveDiagonal = Annotated[Diagonal, AfterValidator(positive)]
NonNegativeDiagonal = Annotated[Diagonal, AfterValidator(non_negative)]
