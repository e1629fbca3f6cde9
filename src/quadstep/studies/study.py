"""Studies: one question asked of many flights. A new kind of study is a subclass of `Study`, in one file.

A study says which flights it needs (`campaign`, `flights`), folds their results into what it has found, and words that as
`Evidence`, which its report, metrics.json, table.tex, the terminal, `--json` and JUnit show. `run` does the rest: engines,
progress, and a folder that holds the whole result or the one before.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Generic, NamedTuple, TypeAlias, TypeVar

import pyarrow as pa

from quadstep.engines.engine import CAMPAIGNS, Engine, loaded
from quadstep.io.results.record import REPORT
from quadstep.io.version import __version__
from quadstep.metrics.judging.verdict import Case, Verdict
from quadstep.report import page
from quadstep.report.publish import MANIFEST, publishing, write_json
from quadstep.report.sheet import Sheet
from quadstep.report.symbols import rich
from quadstep.report.terminal.progress import SILENT, Count, Progress
from quadstep.studies.campaign.flown import Fly
from quadstep.studies.campaign.schema import Campaign

TABLE = "table.tex"

MOST_AT_ONCE = 2**18
"""Flights that are in memory together."""


class Span(NamedTuple):
    """Flights from `first` up to `past`."""

    first: int
    past: int


Flown: TypeAlias = Iterator[tuple[Span, pa.Table]]
"""Flights as they are finished, in any order: a row each, with what was drawn, the outcome, and every metric."""


class Table(NamedTuple):
    """A section of the report. text: a paragraph, before the table if there is one. set_as: how the table is set as HTML."""

    title: str
    anchor: str
    header: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()
    text: str = ""
    set_as: Callable[[str], str] = rich

    @property
    def html(self) -> list[str]:
        """Its parts."""
        text = [page.paragraph(self.text)] if self.text else []
        table = [page.table(self.header, self.rows, self.set_as)] if self.rows else []
        return [page.heading(self.title, self.anchor), *text, *table]


class Figure(NamedTuple):
    """A figure at the top of the report. name: of its file, without ending. coded: whether its colours are values.

    label: what it is, in a word.
    """

    name: str
    caption: str
    coded: bool = False
    label: str = "Figure"


class Evidence(NamedTuple):
    """What a study has found, for whoever reads it.

    name: of what was studied; kind: of study, in a word. answer: to its question, in a sentence; sentences: the same for the
    terminal. record: everything measured, as JSON can hold it. paper: a table of LaTeX. cases: the points on
    which it is judged.
    """

    name: str
    kind: str
    answer: str
    sentences: Sequence[str]
    record: dict[str, object]
    facts: Sequence[page.Fact] = ()
    figures: Sequence[Figure] = ()
    tables: Sequence[Table] = ()
    paper: str = ""
    cases: tuple[Case, ...] = (Case("flown"),)

    def write(self, out: Path) -> None:
        """Write report.html, metrics.json, and table.tex where there is one."""
        figures = [page.figure(out / one.name, one.caption, coded=one.coded) for one in self.figures]
        sections = [part for one in self.tables for part in one.html]
        page.write_page(out / REPORT, self.name, [page.summary(self.answer, self.facts, figures), *sections], self.kind)
        write_json(out / MANIFEST, self.record)
        if self.paper:
            (out / TABLE).write_text(self.paper, encoding="utf-8")

    def verdict(self, command: str, folder: Path) -> Verdict:
        """For `--json` and JUnit."""
        content = {**self.record, "folder": str(folder), "report": str(folder / REPORT), "answer": self.answer}
        return Verdict(command, self.name, self.cases, content, 0)


Found = TypeVar("Found")


class Study(ABC, Generic[Found]):
    """A kind of study. campaign: of which it flies the first `flights`; identity: a digest of all that decides its result."""

    campaign: Campaign
    flights: int
    identity: str

    @abstractmethod
    def fold(self, flown: Flown) -> Found:
        """What the flights show. Raises UserError for values that cannot be flown."""

    @abstractmethod
    def evidence(self, found: Found, out: Path, sheet: Sheet) -> Evidence:
        """The same for readers; draws its figures, and writes files of its own, into the folder `out`."""


class Done(NamedTuple, Generic[Found]):
    """A study that is over."""

    found: Found
    evidence: Evidence


def run(
    study: Study[Found], folder: Path, engine: Engine = Engine.LANES, overwrite: bool = False, progress: Progress = SILENT,
    sheet: Sheet | None = None,
) -> Done[Found]:  # fmt: skip
    """Fly a study and write its folder, all of it or nothing. sheet: what figures are drawn on. Raises UserError."""
    with publishing(folder, study.identity, overwrite) as out:
        count = Count(progress, study.flights)
        fly: Fly[Span] = loaded(CAMPAIGNS, engine)(study.campaign)
        starts = range(0, study.flights, MOST_AT_ONCE)
        spans = [Span(first, min(first + MOST_AT_ONCE, study.flights)) for first in starts]
        found = study.fold(fly(spans, count.add))
        evidence = study.evidence(found, out, (sheet or Sheet()).shown())
        about = {"name": evidence.name, "version": __version__, "engine": engine.value}
        evidence = evidence._replace(record={**about, **evidence.record})
        evidence.write(out)
    return Done(found, evidence)
