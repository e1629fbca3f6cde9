"""Studies: one question asked of many flights. A new kind of study is a subclass of `Study`, in one file.

A study says which flights it needs (`campaign`, `flights`), folds their results into what it has found, and words that as
`Evidence`, which its report, metrics.json, table.tex, the terminal, `--json` and JUnit show. `run` does the rest: engines,
progress, and a folder that holds the whole result or the one before.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from pathlib import Path
from typing import Generic, NamedTuple, TypeAlias, TypeVar

import pyarrow as pa

from quadstep.engines.engine import CAMPAIGNS, Engine, loaded
from quadstep.io import __version__
from quadstep.metrics.registry import SOUND
from quadstep.mission.schema import Grading, ungraded
from quadstep.report.evidence import Evidence
from quadstep.report.progress import SILENT, Count, Progress
from quadstep.report.publish import publishing
from quadstep.report.sheet import Sheet
from quadstep.studies.campaign.flyer import Chunk, Fly
from quadstep.studies.campaign.schema import Campaign

MOST_AT_ONCE = 2**18
"""Flights that are in memory together."""


Flown: TypeAlias = Iterator[tuple[Chunk, pa.Table]]
"""Flights as they are finished, in any order: a row each, with what was drawn, the outcome, and every metric."""


Result = TypeVar("Result")


class Study(ABC, Generic[Result]):
    """A kind of study. campaign: of which it flies the first `flights`; identity: a digest of all that decides its result."""

    campaign: Campaign
    flights: int
    identity: str

    @abstractmethod
    def fold(self, flown: Flown) -> Result:
        """What the flights show. Raises UserError for values that cannot be flown."""

    @abstractmethod
    def evidence(self, result: Result, out: Path, sheet: Sheet) -> Evidence:
        """The same for readers; draws its figures, and writes files of its own, into the folder `out`."""


class FinishedStudy(NamedTuple, Generic[Result]):
    found: Result
    evidence: Evidence


def run(
    study: Study[Result], folder: Path, engine: Engine = Engine.LANES, overwrite: bool = False, progress: Progress = SILENT,
    sheet: Sheet | None = None, grading: Grading = ungraded,
) -> FinishedStudy[Result]:  # fmt: skip
    """Fly a study and write its folder, all of it or nothing. sheet: what figures are drawn on. grading: of the loop at rest.

    Raises UserError.
    """
    with publishing(folder, study.identity, overwrite, named=study.campaign.named) as out:
        count = Count(progress, study.flights)
        fly: Fly = loaded(CAMPAIGNS, engine)(study.campaign)
        starts = range(0, study.flights, MOST_AT_ONCE)
        spans = [Chunk("", first, min(first + MOST_AT_ONCE, study.flights)) for first in starts]
        found = study.fold(fly(spans, count.add))
        evidence = study.evidence(found, out, (sheet or Sheet()).shown())
        about = {"name": evidence.name, "version": __version__, "engine": engine.value}
        grade = evidence.grade or grading(study.campaign.mission)
        told = evidence.told or grade.get("grade") == SOUND
        evidence = evidence._replace(record={**about, **evidence.record}, grade=grade, told=told)
        evidence.write(out)
    return FinishedStudy(found, evidence)
