"""What several commands share: options and arguments, and how a verdict is delivered: one JSON object on standard output, a
JUnit file, an exit code.
"""

import functools
import inspect
import json
import re
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, get_args, get_origin, get_type_hints

import typer
from typer.core import TyperCommand
from typer.exceptions import TyperException
from typer.models import ArgumentInfo

from quadstep.engines.engine import FLIGHTS, FLOWN_BY, WORDS, Engine
from quadstep.io.errors import UserError, signals_ignored
from quadstep.io.files import PAGE, check_place, read_bytes, write_beside
from quadstep.report.screen import complain, say, say_whole, show_table
from quadstep.report.sheet import FORMATS, ON_SCREEN, SCREEN, USUAL, Sheet, sheet

if TYPE_CHECKING:
    from typer._click import Context, HelpFormatter

    from quadstep.metrics.verdict import Verdict
    from quadstep.report.evidence import Evidence


def engine_option(work: str) -> object:
    """`--engine` of a command that does this kind of work."""
    allowed = FLOWN_BY[work]

    def engine(text: str) -> Engine:
        if text not in allowed:
            raise ValueError(f"{text!r} is not one of {', '.join(allowed.names)}.")
        return Engine(text)

    told = ". ".join(f"{name}: {WORDS[Engine(name)]}" for name in allowed.own)
    return typer.Option(
        parser=engine, metavar="|".join(allowed.own), autocompletion=lambda: list(allowed.names), help=f"{told}."
    )


EngineOption = Annotated[Engine, engine_option(FLIGHTS)]
ReplaceOption = Annotated[bool, typer.Option("--overwrite", help="Replace an existing file.")]
OverwriteOption = Annotated[bool, typer.Option("--overwrite", help="Replace the results already in the folder.")]
FiguresOption = Annotated[str, typer.Option("--figures", metavar="FORMATS", help="Figure formats: png, svg, pdf.")]


def millimetres(text: str) -> float:
    """88, 88mm or 88 mm."""
    try:
        return float(text.strip().removesuffix("mm"))
    except ValueError:
        raise UserError(f"--width: should be millimetres, like 88 or 88mm, not {text!r:.40}") from None


WidthOption = Annotated[
    float | None,
    typer.Option("--width", metavar="MM", parser=millimetres, help="Figure width: 88 for one column, 180 for two."),
]
StyleOption = Annotated[
    str, typer.Option("--style", help="screen, paper (serif, no titles), or a Matplotlib style file (.mplstyle).")
]
SignalsOption = Annotated[
    str | None,
    typer.Option(
        "--signals",
        metavar="NAMES",
        help="Draw only these figures or panels, such as position or z,z_d-z,u; an unknown name lists them all.",
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
JunitOption = Annotated[Path | None, typer.Option(metavar="FILE", help="Write the verdict as JUnit XML, for a CI service.")]
OpenOption = Annotated[bool, typer.Option("--open", help="Open it in the browser.")]


def check_range(option: str, value: float | None, least: float, most: float, told: str = "") -> None:
    """Refuses a number outside a range; None is none. told: the greatest, where digits do not show it. Raises UserError."""
    if value is not None and not least <= value <= most:
        numbers = (told or most, value) if isinstance(value, int) else (f"{most:g}", f"{value:g}")
        raise UserError("{}: should be from {:g} to {}, not {}".format(option, least, *numbers))


def check_seed(seed: int) -> None:
    """Raises UserError for a seed that cannot be one."""
    check_range("--seed", seed, 0, 2**63 - 1, "2^63 - 1")


@dataclass(frozen=True)
class Options:
    """Options that belong together: a command takes them as one parameter, whose type is a subclass."""


@dataclass(frozen=True)
class FigureOptions(Options):
    """How figures are drawn."""

    figures: FiguresOption = USUAL
    width: WidthOption = None
    style: StyleOption = SCREEN

    def sheet(self, signals: str | None = None) -> Sheet:
        """What they are drawn on. Raises UserError."""
        return sheet(self.figures, self.width, self.style, signals)


@dataclass(frozen=True)
class QuickFigureOptions(FigureOptions):
    """The same, of figures that are to be there at once."""

    figures: FiguresOption = ON_SCREEN


def expanded(command: Callable[..., object]) -> Callable[..., object]:
    """A command in which the options of each of its `Options` stand by themselves, as the command line has them."""
    signature = inspect.signature(command, eval_str=True)
    groups: dict[str, tuple[type[Options], dict[str, object]]] = {}
    parameters = []
    for name, one in signature.parameters.items():
        if not (isinstance(one.annotation, type) and issubclass(one.annotation, Options)):
            parameters.append(one)
            continue
        hints = get_type_hints(one.annotation, include_extras=True)
        options = {option: hint for option, hint in hints.items() if get_origin(hint) is Annotated}
        groups[name] = one.annotation, options
        for option, hint in options.items():
            parameters.append(one.replace(name=option, default=getattr(one.annotation, option), annotation=hint))

    @functools.wraps(command)
    def run(**given: object) -> object:
        for name, (group, options) in groups.items():
            given[name] = group(**{option: given.pop(option) for option in options})
        return command(**given)

    for one in parameters:
        name_value(one)
    vars(run)["__signature__"] = signature.replace(parameters=parameters)
    return run


VALUES = {Path: "FILE", int: "N", float: "NUMBER", str: "NAME"}
"""What the help calls the value of an option of this type that has no word of its own."""


def name_value(one: inspect.Parameter) -> None:
    """Give an option or argument what the help calls its value, where it is not told."""
    kind, *told = get_args(one.annotation)
    kinds = (kind, *get_args(kind))
    for info in told:
        if info.metavar or info.parser or bool in kinds:
            continue
        if isinstance(info, ArgumentInfo):
            info.metavar = one.name.upper()
        elif Path in kinds and info.help.startswith("Folder"):
            info.metavar = "DIR"
        else:
            info.metavar = next((word for kind, word in VALUES.items() if kind in kinds), None)


USUAL_CODES = "Exit code 0: done. 2: bad input. 130: interrupted."
"""Of a command that does not say otherwise."""


class PlainCommand(TyperCommand):
    """A command whose help shows arguments as it shows the values of options: FILE, where typer has {FILE} and FILE <path>;
    it says its exit codes.
    """

    def parse_args(self, ctx: "Context", args: list[str]) -> list[str]:
        """The parser leaves out of some errors which command they are of."""
        try:
            return super().parse_args(ctx, args)
        except TyperException as error:
            vars(error)["ctx"] = ctx
            raise

    def format_help_text(self, ctx: "Context", formatter: "HelpFormatter") -> None:
        if "Exit code" not in (self.help or ""):
            self.help = "\n\n".join(filter(None, (self.help, USUAL_CODES)))
        super().format_help_text(ctx, formatter)

    def collect_usage_pieces(self, ctx: "Context") -> list[str]:
        return [re.sub("[{}]", "", piece) for piece in super().collect_usage_pieces(ctx)]

    def records(self, ctx: "Context") -> list[tuple[str, str, str]]:
        """Kind, name and help of each."""
        found = [(one.param_type_name, *(one.get_help_record(ctx) or ("", ""))) for one in self.get_params(ctx)]
        return [(kind, re.sub(" <.*>", "", name), told) for kind, name, told in found]

    def format_options(self, ctx: "Context", formatter: "HelpFormatter") -> None:
        for kind, heading in (("argument", "Arguments"), ("option", "Options")):
            rows = [(name, told) for one, name, told in self.records(ctx) if one == kind]
            if rows:
                with formatter.section(heading):
                    formatter.write_dl(rows)


START = 4096
"""Bytes of a file by which a JUnit file is recognised."""


def print_json(content: object) -> None:
    """Print one object, whole or not at all."""
    text = json.dumps(content, indent=2, allow_nan=False) + "\n"
    with signals_ignored():
        sys.stdout.write(text)
        sys.stdout.flush()


@dataclass(frozen=True)
class Delivery(Options):
    """Where a verdict goes. started: when the command was. Raises UserError at once for a file that cannot be written."""

    as_json: JsonOption = False
    junit: JunitOption = None
    started: float = field(default_factory=time.perf_counter)

    def __post_init__(self) -> None:
        if not self.junit:
            return
        try:
            check_place(self.junit, parents=True)
            begin = read_bytes(self.junit, PAGE)[:START] if self.junit.is_file() else b""
        except UserError as error:
            raise UserError(f"--junit {error}") from None
        if begin and b"<testsuite" not in begin:
            raise UserError(f"--junit {self.junit}: exists and is not a JUnit file; choose another")

    def finish(self, evidence: "Evidence", command: str, folder: Path) -> None:
        """Say what a study has found, or print it as JSON, then exit."""
        if not self.as_json:
            show(evidence, folder)
        self.deliver(evidence.verdict(command, folder))

    def deliver(self, verdict: "Verdict") -> None:
        """Write and print what was requested, then exit with the verdict's exit code.

        With `as_json` unmet requirements are printed on standard error. Raises UserError where the file cannot be written.
        """
        if self.junit:
            from quadstep.metrics.verdict import junit_xml

            write_beside(self.junit, junit_xml(verdict, time.perf_counter() - self.started), parents=True)
        if self.as_json:
            print_json(verdict.as_json())
            for case in verdict.cases:
                if case.failure:
                    complain(case.sentence)
        if verdict.exit_code:
            raise typer.Exit(verdict.exit_code)


def show(evidence: "Evidence", folder: Path | None) -> None:
    """Say what a study has found, and where it is, if it is kept."""
    if evidence.opening:
        say(evidence.opening)
        say("")
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
