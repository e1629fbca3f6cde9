"""What commands that read logs share."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quadstep.io.errors import UserError

if TYPE_CHECKING:
    from quadstep.identify.logs.flight import FlightRecord
    from quadstep.mission.airframe import AirframeSection

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
