"""Studies: one question asked of many flights. A new kind of study is a subclass of `Study`, in one file.

A study says which flights it needs (`campaign`, `flights`), folds their results into what it has found, and words that as
`Evidence`, which its report, metrics.json, table.tex, the terminal, `--json` and JUnit show. `run` does the rest: engines,
progress, and a folder that holds the whole result or the one before.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from html import escape
from pathlib import Path
from typing import Generic, NamedTuple, TypeAlias, TypeVar

import pyarrow as pa

from quadstep.engines.engine import CAMPAIGNS, Engine, loaded
from quadstep.io.results.record import REPORT
from quadstep.io.version import __version__
from quadstep.metrics.judging.verdict import Case, Verdict
from quadstep.report import page
from quadstep.report.latex import booktabs
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
    """A table of the report. title, anchor: of its section. paper: whether it is in table.tex too.

    verbatim: whether its names are left as they are.
    """

    title: str
    anchor: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    paper: bool = False
    verbatim: bool = False


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
    terminal. record: everything measured, as JSON can hold it. cases: the points on which it is judged.
    """

    name: str
    kind: str
    answer: str
    sentences: Sequence[str]
    record: dict[str, object]
    facts: Sequence[page.Fact] = ()
    figures: Sequence[Figure] = ()
    tables: Sequence[Table] = ()
    cases: tuple[Case, ...] = (Case("flown"),)

    def write(self, out: Path) -> None:
        """Write report.html, metrics.json, and table.tex where a table is for a paper."""
        figures = [page.figure(out / one.name, one.caption, coded=one.coded) for one in self.figures]
        sections = [
            part
            for one in self.tables
            for part in (
                page.heading(one.title, one.anchor),
                page.table(one.header, one.rows, escape if one.verbatim else rich),
            )
        ]
        page.write_page(out / REPORT, self.name, [page.summary(self.answer, self.facts, figures), *sections], self.kind)
        write_json(out / MANIFEST, self.record)
        papers = [booktabs(one.header, [one.rows], [f"{self.name}: {one.title}"]) for one in self.tables if one.paper]
        if papers:
            (out / TABLE).write_text("\n".join(papers), encoding="utf-8")

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
