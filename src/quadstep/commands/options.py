"""Options and arguments that several commands share, and what reads the logs that some take."""

import functools
import inspect
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, get_origin, get_type_hints

import typer

from quadstep.engines.engine import FLIGHTS, FLOWN_BY, WORDS, Engine
from quadstep.io.errors import UserError
from quadstep.report.sheet import ON_SCREEN, SCREEN, USUAL, Sheet, sheet

if TYPE_CHECKING:
    from quadstep.identify.logs.flight import FlightRecord
    from quadstep.mission.airframe import AirframeSection


def engine_option(work: str) -> object:
    """`--engine` of a command that does this kind of work."""
    allowed = FLOWN_BY[work]

    def engine(text: str) -> Engine:
        if text not in allowed:
            raise ValueError(f"{text!r} is not one of {', '.join(allowed.names)}.")
        return Engine(text)

    told = ". ".join(f"{name}: {WORDS[Engine(name)]}" for name in allowed.own)
    return typer.Option(
        parser=engine, metavar=f"<{'|'.join(allowed.own)}>", autocompletion=lambda: list(allowed.names), help=f"{told}."
    )


EngineOption = Annotated[Engine, engine_option(FLIGHTS)]
ReplaceOption = Annotated[bool, typer.Option("--overwrite", help="Replace an existing file.")]
OverwriteOption = Annotated[bool, typer.Option("--overwrite", help="Replace other results in the folder.")]
FiguresOption = Annotated[str, typer.Option("--figures", metavar="FORMATS", help="Figure formats: png, svg, pdf.")]


def millimetres(text: str) -> float:
    """88, 88mm or 88 mm."""
    try:
        return float(text.strip().removesuffix("mm"))
    except ValueError:
        raise UserError(f"--width: should be millimetres, like 88 or 88mm, not {text!r:.40}") from None


WidthOption = Annotated[
    float | None,
    typer.Option(
        "--width", metavar="MM", parser=millimetres, help="Figure width: 88 for one column, 180 for two.", show_default=False
    ),
]
StyleOption = Annotated[
    str, typer.Option("--style", help="screen; paper: serif, no titles; or a Matplotlib style file (.mplstyle).")
]
SignalsOption = Annotated[
    str | None,
    typer.Option(
        "--signals",
        metavar="NAMES",
        help="Draw only these: figures or panels, such as position or z,z_d-z,u; a wrong name lists them.",
        show_default=False,
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else; for machines.")]
JunitOption = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Write the verdict as JUnit XML, for a CI service.", show_default=False)
]
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
class Drawing(Options):
    """How figures are drawn."""

    figures: FiguresOption = USUAL
    width: WidthOption = None
    style: StyleOption = SCREEN

    def sheet(self, signals: str | None = None) -> Sheet:
        """What they are drawn on. Raises UserError."""
        return sheet(self.figures, self.width, self.style, signals)


@dataclass(frozen=True)
class QuickDrawing(Drawing):
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

    vars(run)["__signature__"] = signature.replace(parameters=parameters)
    return run


LogsArgument = Annotated[list[Path], typer.Argument(metavar="LOG...", help="Logs of flights.", show_default=False)]
MappingOption = Annotated[
    str | None,
    typer.Option(help="Meaning of a CSV's columns: nanobench, crazypad, idsia, or a mapping file (TOML).", show_default=False),
]


def vehicle_of(given: str) -> "AirframeSection":
    """A vehicle by the name of a preset, or in a file. Raises UserError."""
    from quadstep.mission.vehicle_list import load_preset, preset_names, read_vehicle

    return load_preset(given) if given in preset_names() or not given.endswith(".toml") else read_vehicle(Path(given))


def read_logs(logs: Sequence[Path], mapping: str | None) -> "list[FlightRecord]":
    """Flights, named like their files, with as much of their folders as tells them apart. Raises UserError."""
    from dataclasses import replace

    from quadstep.identify.logs.read import read_log

    paths = [Path(os.path.realpath(log)) for log in logs]  # Path.resolve raises for links in a circle
    if twice := next((log for log, path in zip(logs, paths, strict=True) if paths.count(path) > 1), None):
        raise UserError(f"{twice}: given twice; a flight counts once")
    stems = [path.with_suffix("") for path in paths]
    named = [(path if stems.count(stem) > 1 else stem).parts for path, stem in zip(paths, stems, strict=True)]
    flights = []
    for log, one in zip(logs, named, strict=True):
        depth = next(n for n in range(1, len(one) + 1) if sum(each[-n:] == one[-n:] for each in named) == 1)
        flights.append(replace(read_log(log, mapping), name="/".join(one[-depth:])))
    flown = [(flight.time.tobytes(), flight.motors.tobytes()) for flight in flights]
    for place, same in enumerate(flown):
        if same in flown[:place]:
            raise UserError(f"{logs[place]}: is the flight of {logs[flown.index(same)]} again; a flight counts once")
    return flights
