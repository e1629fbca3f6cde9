"""`[rare]` of a campaign file: how a small probability is estimated."""

from enum import StrEnum
from typing import Annotated

from pydantic import BeforeValidator, Field

from quadstep.mission.fields import Quantity, Section, as_tuple


class Method(StrEnum):
    """The method by which a replicate makes failures frequent."""

    CROSS_ENTROPY = "cross-entropy"
    SUBSET = "subset"

    @property
    def words(self) -> str:
        """Its name in a sentence."""
        return "cross-entropy" if self is Method.CROSS_ENTROPY else "subset simulation"

    @property
    def other(self) -> "Method":
        """The other method, which gives a second opinion."""
        return Method.SUBSET if self is Method.CROSS_ENTROPY else Method.CROSS_ENTROPY


def as_method(value: object) -> object:
    """The method of a name in TOML. Raises ValueError for an unknown name."""
    if value not in tuple(Method):
        raise ValueError(f"should be {' or '.join(Method)}, not {value!r:.60}")
    return Method(str(value))


def as_names(value: object) -> object:
    """One name stands for a list of one."""
    return (value,) if isinstance(value, str) else as_tuple(value)


class RareSection(Section):
    """How a small probability is estimated."""

    method: Annotated[Method, BeforeValidator(as_method), Quantity("", "how flights are steered towards failure")] = (
        Method.CROSS_ENTROPY
    )
    score: Annotated[
        Annotated[tuple[str, ...], BeforeValidator(as_names), Field(min_length=1)] | None,
        Quantity("", "metrics that predict failure; default: the largest ratio to a limit in failure, or input variations"),
    ] = None
    flights: Annotated[int, Field(ge=200, le=200_000), Quantity("", "flights per level or fit")] = 1000
    replicates: Annotated[int, Field(ge=5, le=50), Quantity("", "independent estimates")] = 5
    opinions: Annotated[
        int, Field(ge=0, le=10), Quantity("", "estimates by the other method, with other scores; they must agree")
    ] = 2
