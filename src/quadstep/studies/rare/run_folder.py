"""The folder of a run: rare.json, rewritten after each finished piece, so that an interrupted run can be resumed."""

import contextlib
from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from quadstep.io import __version__
from quadstep.io.run_record import RunRecord
from quadstep.io.run_record import opened as open_record
from quadstep.studies.campaign import draws
from quadstep.studies.campaign.manifest import cannot_continue, identity, machine
from quadstep.studies.campaign.schema import Campaign, Method

Count = Annotated[int, Field(ge=0)]
Probability = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]


class RareTable(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Nearest(RareTable):
    """The most likely failure of a kind that was found: its distance from the median, its values, the deviations of each."""

    failure: str = "any"
    deviations: float
    values: dict[str, object]
    deviations_by_key: dict[str, float]


class DoneEvent(RareTable):
    """Failures of one kind. score: the metrics that predicted them. levels: threshold, None for failure itself; probability.

    crude: flights drawn as the campaign draws, and how many of them failed; failures: all that were found at the end. options:
    by each value of a choice, the probability of failing with it, the crude flights that did, and its share.
    """

    failure: str
    score: list[str]
    probability: Probability
    crude: Count
    crude_failures: Count
    failures: Count
    options: dict[str, tuple[Probability, Count, Probability]] = {}
    levels: list[tuple[float | None, float]]
    nearest: Nearest | None = None


class RepeatedFailures(RareTable):
    """Failures that were flown again with different noise, and how many of them failed again."""

    flights: Count
    failures: Count


class FinishedPiece(RareTable):
    """A finished piece. kind: why it was flown."""

    kind: str
    method: Method
    probability: Probability
    flights: Count
    events: Annotated[list[DoneEvent], Field(min_length=1)]
    again: RepeatedFailures | None = None

    @property
    def score(self) -> str:
        """What predicted the failures, in words."""
        return " and ".join(f"by {', '.join(event.score)}" for event in self.events)


MANIFEST = "rare.json"


class RareManifest(BaseModel):
    """rare.json. decides: everything that determines a result; wanted: number of pieces; files: of the report."""

    model_config = ConfigDict(extra="forbid")
    name: str
    version: str
    decides: dict[str, object]
    named: dict[str, str] = {}
    seed: int
    precision: str
    campaign: str
    mission: str
    machine: dict[str, object]
    wanted: int
    complete: bool = False
    pieces: list[FinishedPiece] = []
    summary: dict[str, object] | None = None
    files: list[str] = []
    sha256: str = ""


class RareRecord(RunRecord):
    """The folder of one run, which has it for itself. Made by `opened`. pieces: that are finished, in order."""

    NAME, SCHEMA, WHAT, ITEMS = MANIFEST, RareManifest, "estimate", "replicates"

    @cached_property
    def pieces(self) -> list[FinishedPiece]:
        return RareManifest.model_validate(self.manifest).pieces

    @property
    def finished(self) -> int:
        return len(self.pieces)

    @property
    def count(self) -> int:
        return self.manifest["wanted"]

    def add(self, piece: FinishedPiece) -> None:
        """Keep one more. Raises UserError if it cannot be written."""
        self.pieces.append(piece)
        self.save(pieces=[one.model_dump(mode="json") for one in self.pieces])


@contextlib.contextmanager
def opened(folder: Path, campaign: Campaign, resume: bool, overwrite: bool) -> Iterator[RareRecord]:
    """The folder of a run, made or resumed, and locked while the block runs.

    Raises UserError for a folder that holds something else, another run, or a run that another process is writing, and
    InterruptedRun on Ctrl-C.
    """
    mine = new_manifest(campaign)

    def changed(manifest: Mapping[str, object]) -> list[str]:
        """Why a run cannot be resumed."""
        found = RareManifest.model_validate(manifest)
        reasons = cannot_continue({**found.decides, "named": found.named, "version": found.version}, campaign)
        return reasons if reasons or found.decides == mine["decides"] else ["the campaign has changed"]

    with open_record(RareRecord, folder, mine, changed, resume, overwrite) as (kept, resumed):
        if resumed:
            kept.save(complete=False)
        yield kept


def new_manifest(campaign: Campaign) -> dict[str, object]:
    file = campaign.file
    rare = file.rare.model_dump(mode="json")
    return RareManifest(
        name=file.name,
        version=__version__,
        decides={**identity(campaign), "draws": draws.VERSION, "failure": dict(file.failure), "rare": rare},
        named=campaign.named,
        seed=file.seed,
        precision=file.precision,
        campaign=campaign.text,
        mission=str(campaign.defaults["name"]),
        machine=machine(),
        wanted=file.rare.replicates + file.rare.opinions,
    ).model_dump(mode="json")
