"""Delivering a verdict: one JSON object on standard output, a JUnit file, an exit code."""

import json
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from quadstep.commands.options import JsonOption, JunitOption, Options
from quadstep.io.errors import UserError, signals_ignored
from quadstep.io.files import PAGE, check_place, read_bytes
from quadstep.metrics.verdict import Verdict
from quadstep.report.screen import complain, say, say_whole, show_table
from quadstep.report.sheet import FORMATS

if TYPE_CHECKING:
    from quadstep.report.evidence import Evidence

START = 4096
"""Bytes of a file by which a JUnit file is recognised."""


def check_junit(path: Path) -> None:
    """Raises UserError at once where a JUnit file cannot or should not be written."""
    try:
        check_place(path, parents=True)
        begin = read_bytes(path, PAGE)[:START] if path.is_file() else b""
    except UserError as error:
        raise UserError(f"--junit {error}") from None
    if begin and b"<testsuite" not in begin:
        raise UserError(f"--junit {path}: exists and is not a JUnit file; choose another")


@dataclass(frozen=True)
class Delivery(Options):
    """Where a verdict goes. started: when the command was. Raises UserError at once for a file that cannot be written."""

    as_json: JsonOption = False
    junit: JunitOption = None
    started: float = field(default_factory=time.perf_counter)

    def __post_init__(self) -> None:
        if self.junit:
            check_junit(self.junit)

    def finish(self, evidence: "Evidence", command: str, folder: Path) -> None:
        """Say what a study has found, or print it as JSON, then exit."""
        if not self.as_json:
            show(evidence, folder)
        self.deliver(evidence.verdict(command, folder))

    def deliver(self, verdict: Verdict) -> None:
        """Write and print what was requested, then exit with the verdict's exit code.

        With `as_json` unmet requirements are printed on standard error. Raises UserError where the file cannot be written.
        """
        if self.junit:
            from quadstep.metrics.verdict import write_junit

            write_junit(self.junit, verdict, time.perf_counter() - self.started)
        if self.as_json:
            text = json.dumps(verdict.as_json(), indent=2, allow_nan=False) + "\n"
            with signals_ignored():  # an object is printed whole or not at all
                sys.stdout.write(text)
                sys.stdout.flush()
            for case in verdict.cases:
                if case.failure:
                    complain(case.sentence)
        if verdict.exit_code:
            raise typer.Exit(verdict.exit_code)


def show(evidence: "Evidence", folder: Path | None) -> None:
    """Say what a study has found, and where it is, if it is kept."""
    for table in evidence.shown:
        rows = [[cell if isinstance(cell, str) else cell[0] for cell in row] for row in table.rows[: table.most]]
        show_table(table.shown, table.header, rows)
    for sentence in evidence.lines:
        say(sentence)
    for line in evidence.commands:
        say_whole(line)
    if folder:
        for one in evidence.figures:
            drawn = next((path for ending in FORMATS if (path := folder / f"{one.name}.{ending}").is_file()), None)
            if drawn and one.label:
                say_whole(f"{one.label}: {drawn}")
        say_whole(f"Report: {folder / 'report.html'}")
    for case in evidence.cases[1:]:
        say(case.sentence)
