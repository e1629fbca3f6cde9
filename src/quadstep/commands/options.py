"""Options and arguments that several commands share, and what reads the logs that some take."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quadstep.engines.engine import FLIGHTS, FLOWN_BY, WORDS, Engine
from quadstep.io.errors import UserError

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
