"""What a study has found, worded once for all readers: the terminal, report.html, metrics.json, `--json`, JUnit, LaTeX."""

from collections.abc import Callable, Collection, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import NamedTuple, TypeAlias

from quadstep.io.errors import UNMET
from quadstep.io.run_record import REPORT
from quadstep.metrics.registry import AT_REST, WRITTEN, at_rest_sentences
from quadstep.metrics.requirements import JudgedShare
from quadstep.metrics.verdict import Case, Verdict
from quadstep.report import markup
from quadstep.report.publish import MANIFEST, write_json
from quadstep.report.units import numerals, rich

TABLE = "table.tex"


class TableSection(NamedTuple):
    """A section of the report; without a title, more of the one before. text: a paragraph, before the table if there is one.

    set_as: how its texts are set as HTML. shown: its title on the terminal, which leaves it out without one, shows only these
    columns, if not all, and at most this many rows.
    """

    title: str = ""
    anchor: str = ""
    header: Sequence[str] = ()
    rows: Sequence[Sequence[markup.Cell]] = ()
    text: str = ""
    set_as: Callable[[str], str] = rich
    shown: str = ""
    most: int | None = None
    columns: Sequence[int] = ()

    def html(self, _: Path) -> str:
        title = markup.heading(self.title, self.anchor, self.set_as) if self.title else ""
        text = markup.paragraph(self.text, self.set_as) if self.text else ""
        return title + text + (markup.table(self.header, self.rows, self.set_as) if self.rows else "")


class Figure(NamedTuple):
    """A figure. name: of its file in the folder, without ending. label: what it is, in a word, for the terminal, which names
    it only then. set_as: how its caption is set as HTML.
    """

    name: str
    caption: str
    label: str = ""
    set_as: Callable[[str], str] = rich

    def html(self, out: Path) -> str:
        return markup.figure(out / self.name, self.caption, self.set_as)


Section: TypeAlias = TableSection | Figure | str
"""A part of the report; a string is markup of `report/markup.py`, which only the report shows."""


class Evidence(NamedTuple):
    """What a study has found.

    name: of what was studied; kind: of study, in a word. answer: to its question, in a sentence; points: more of it, as a
    list; sentences: both for the terminal, or `opening`, which says the grade too, above the tables. record: all measured, as
    JSON can hold it.
    figures: at the top; sections: below them. paper: a table of LaTeX. cases: the points on which it is judged. more:
    paragraphs below the answer. warnings: what speaks against it. grade: "grade" and "why" of the loop at rest, if known;
    told: whether a sentence has it already; whose: which loop that is. commands: lines for the terminal with something to
    copy. fold: anchors of the sections that only a specialist reads. A case or a fact that fails makes its answer bad news.
    """

    name: str
    kind: str
    answer: str
    sentences: Sequence[str]
    record: dict[str, object]
    facts: Sequence[markup.Fact] = ()
    figures: Sequence[Figure] = ()
    sections: Sequence[Section] = ()
    paper: str = ""
    cases: tuple[Case, ...] = (Case("flown"),)
    more: Sequence[str] = ()
    warnings: Sequence[str] = ()
    grade: Mapping[str, str] = {}
    told: bool = False
    whose: str = WRITTEN
    commands: Sequence[str] = ()
    opening: str = ""
    fold: Collection[str] = ("flown", "reading")
    points: Sequence[str] = ()

    @property
    def graded(self) -> list[str]:
        """The grade as a sentence, if it is known and not told."""
        return [] if self.told else at_rest_sentences(self.grade, self.whose)

    @property
    def lines(self) -> list[str]:
        warned = [f"Warning: {one}" for one in self.warnings]
        return [*self.sentences, *([] if self.opening else self.graded), *warned]

    @property
    def shown(self) -> list[TableSection]:
        """The tables of the terminal, without the columns that the report leaves out too, or for which it has no room."""
        tables = [one for one in self.sections if isinstance(one, TableSection) and one.shown]
        kept = [one.columns or range(len(one.header)) for one in tables]
        cut = [
            markup.without_blank([one.header[i] for i in places], [[row[i] for i in places] for row in one.rows])
            for one, places in zip(tables, kept, strict=True)
        ]
        return [one._replace(header=header, rows=rows) for one, (header, rows) in zip(tables, cut, strict=True)]

    @property
    def content(self) -> dict[str, object]:
        warned = {"warnings": list(self.warnings)} if self.warnings else {}
        return {**warned, **self.record, **({AT_REST: dict(self.grade)} if self.grade else {})}

    def required(self, share: JudgedShare | None) -> "Evidence":
        """The same, judged by the share of flights that has to succeed; None where nothing is required."""
        cases = (*self.cases, share.case) if share else self.cases
        return self._replace(cases=cases, record={**self.record, "requirement": share.as_json() if share else None})

    def html(self, out: Path) -> str:
        """report.html. out: where its figures are."""
        texts = [
            *map(markup.paragraph, self.more),
            *(markup.paragraph(numerals(f"Warning: {one}"), escape) for one in self.warnings),
        ]
        failed = any(case.failure for case in self.cases) or any(fact.kind == "fails" for fact in self.facts)
        figures = [one.html(out) for one in self.figures]
        summary = markup.summary(" ".join([self.answer, *self.graded]), self.facts, figures, failed, self.points)
        sections = [one if isinstance(one, str) else one.html(out) for one in self.sections]
        return markup.page_text(
            self.name, [summary, *texts, *sections], self.kind, fold=self.fold, grade=self.grade.get("grade", "")
        )

    def write_report(self, out: Path) -> None:
        """Write report.html, and table.tex where there is one. Its figures are in the folder."""
        (out / REPORT).write_text(self.html(out), encoding="utf-8")
        if self.paper:
            (out / TABLE).write_text(self.paper, encoding="utf-8")

    def write(self, out: Path) -> None:
        self.write_report(out)
        write_json(out / MANIFEST, self.content)

    def verdict(self, command: str, folder: Path) -> Verdict:
        """For `--json` and JUnit."""
        content = {**self.content, "folder": str(folder), "report": str(folder / REPORT), "answer": self.answer}
        unmet = any(case.failure for case in self.cases)
        return Verdict(command, self.name, self.cases, content, UNMET if unmet else 0)
