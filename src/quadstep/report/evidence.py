"""What a study has found, worded once for all readers: the terminal, report.html, metrics.json, `--json`, JUnit, LaTeX."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from quadstep.io.errors import UNMET
from quadstep.io.results.record import REPORT
from quadstep.metrics.judging.share import JudgedShare
from quadstep.metrics.judging.verdict import Case, Verdict
from quadstep.metrics.margins import AT_REST, WRITTEN, at_rest_sentences
from quadstep.report import page
from quadstep.report.publish import MANIFEST, write_json
from quadstep.report.symbols import rich

TABLE = "table.tex"


class Table(NamedTuple):
    """A section of the report; without a title, more of the one before. text: a paragraph, before the table if there is one.

    set_as: how the table is set as HTML. shown: its title on the terminal, which leaves it out without one. most: rows there.
    """

    title: str = ""
    anchor: str = ""
    header: Sequence[str] = ()
    rows: Sequence[Sequence[page.Cell]] = ()
    text: str = ""
    set_as: Callable[[str], str] = rich
    shown: str = ""
    most: int | None = None

    @property
    def html(self) -> list[str]:
        title = [page.heading(self.title, self.anchor)] if self.title else []
        text = [page.paragraph(self.text)] if self.text else []
        table = [page.table(self.header, self.rows, self.set_as)] if self.rows else []
        return [*title, *text, *table]


class Figure(NamedTuple):
    """A figure at the top of the report. name: of its file, without ending. coded: whether its colours are values.

    label: what it is, in a word, for the terminal, which does not name it without one.
    """

    name: str
    caption: str
    coded: bool = False
    label: str = ""


class Evidence(NamedTuple):
    """What a study has found.

    name: of what was studied; kind: of study, in a word. answer: to its question, in a sentence; sentences: the same for the
    terminal. record: everything measured, as JSON can hold it. paper: a table of LaTeX. cases: the points on
    which it is judged. more: paragraphs below the answer. warnings: what speaks against it. grade: "grade" and "why" of the
    loop at rest, if known; whose: which loop that is. commands: lines for the terminal with something to copy.
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
    more: Sequence[str] = ()
    warnings: Sequence[str] = ()
    grade: Mapping[str, str] = {}
    whose: str = WRITTEN
    commands: Sequence[str] = ()

    @property
    def graded(self) -> list[str]:
        """The grade as a sentence, if it is known."""
        return at_rest_sentences(self.grade, self.whose)

    @property
    def lines(self) -> list[str]:
        warned = [f"Warning: {one}" for one in self.warnings]
        return [*self.sentences, *self.graded, *warned]

    @property
    def content(self) -> dict[str, object]:
        return {**self.record, **({AT_REST: dict(self.grade)} if self.grade else {})}

    def required(self, share: JudgedShare | None) -> "Evidence":
        """The same, judged by the share of flights that has to succeed; None where nothing is required."""
        cases = (*self.cases, share.case) if share else self.cases
        return self._replace(cases=cases, record={**self.record, "requirement": share.as_json() if share else None})

    def write_report(self, out: Path) -> None:
        """Write report.html, and table.tex where there is one. Its figures are in the folder."""
        figures = [page.figure(out / one.name, one.caption, coded=one.coded) for one in self.figures]
        texts = map(page.paragraph, [*self.more, *(f"Warning: {one}" for one in self.warnings)])
        sections = [part for one in self.tables for part in one.html]
        summary = page.summary(" ".join([self.answer, *self.graded]), self.facts, figures)
        page.write_page(out / REPORT, self.name, [summary, *texts, *sections], self.kind)
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
