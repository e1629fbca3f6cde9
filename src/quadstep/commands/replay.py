"""`quadstep replay`."""

from pathlib import Path
from typing import Annotated

import typer

from quadstep.commands.logs import LogsArgument, MappingOption, check_names, show_compared, vehicle_of
from quadstep.errors import UserError
from quadstep.terminal.screen import complain, say


def replay(
    logs: LogsArgument,
    vehicle: Annotated[str, typer.Option(help="A preset's name, or a vehicle file (TOML).", show_default=False)],
    mapping: MappingOption = None,
    commands_only: Annotated[bool, typer.Option("--commands-only", help="Do not look at setpoints.")] = False,
    starts: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help='Rows to predict from: {"flight": [row, ...]} (JSON).', show_default=False),
    ] = None,
    predictions: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Where to write these predictions (JSON).", show_default=False)
    ] = None,
) -> None:
    """Predict logged flights from their measured states and commands, and say how wrong that is.

    Mean errors 1, 10 and 50 samples ahead stand beside those of two guesses: velocity and rates stay what they are
    ("constant"), or the rates are zero.
    """
    from quadstep.atomic import write_beside
    from quadstep.identify.replay import as_json, read_starts, ready
    from quadstep.identify.replay import predictions as predicted
    from quadstep.identify.table import compare
    from quadstep.logs.judge import judge
    from quadstep.logs.read import read_log

    if (starts is None) != (predictions is None):
        raise UserError("--starts and --predictions belong together: rows to predict from, and where to write")
    check_names(logs)
    section = vehicle_of(vehicle)
    flights = [read_log(log, mapping) for log in logs]
    for flight in flights:
        for one in judge(flight, section.geometry()):
            if one.wrong:
                complain(f"warning: {flight.name}: {one.text}")
    numbers, guided = ready(flights, section, commands_only)
    if starts and predictions:
        rows = read_starts(starts, flights)
        content = predicted(flights, section, numbers, rows, guided)
        write_beside(predictions, as_json(content))
        count = sum(len(one) for one in rows.values())
        say(f"{count} predictions of {len(rows)} {'flight' if len(rows) == 1 else 'flights'} in {predictions}")
        return
    found = compare(flights, section, numbers, guided)
    knows = "commands and setpoints" if guided else "commands alone"
    show_compared(f"{found.starts} predictions of {found.predicted.shape[2]} flights from {knows}", found)
