"""The record of a finished piece of a run, as stored in rare.json."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from quadstep.studies.campaign.schema import Method

Count = Annotated[int, Field(ge=0)]
Probability = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]


class Record(BaseModel):
    """A table of rare.json."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class DoneEvent(Record):
    """Failures of one kind. score: the metrics that predicted them. levels: threshold, None for failure itself; probability.

    crude: flights drawn as the campaign draws, and how many of them failed; failures: all that were found at the end.
    """

    failure: str
    score: list[str]
    probability: Probability
    crude: Count
    crude_failures: Count
    failures: Count
    levels: list[tuple[float | None, float]]


class Nearest(Record):
    """The most likely failure found: its distance from the median, its values, and the deviations of each."""

    deviations: float
    values: dict[str, object]
    deviations_by_key: dict[str, float]


class Again(Record):
    """Failures that were flown again with different noise, and how many of them failed again."""

    flights: Count
    failures: Count


class Done(Record):
    """A finished piece. kind: why it was flown."""

    kind: str
    method: Method
    probability: Probability
    flights: Count
    events: Annotated[list[DoneEvent], Field(min_length=1)]
    nearest: Nearest | None = None
    again: Again | None = None

    @property
    def score(self) -> str:
        """What predicted the failures, in words."""
        return " and ".join(f"by {', '.join(event.score)}" for event in self.events)
