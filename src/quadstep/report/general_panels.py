"""What the figures of a flight of any plant show: its position, then all other columns, those of one unit together."""

from quadstep.analysis.metrics import position_axes, position_errors
from quadstep.flight.log import FlightLog
from quadstep.report.drawing import FigureJob
from quadstep.report.panel import Panel


def general_jobs(log: FlightLog, name: str) -> list[FigureJob]:
    """The figures of a flight: position, signals."""
    t, columns = log.column("t"), log.columns
    axes, error = position_axes(log), position_errors(log)
    tracks = [Panel(a, "m", {a: log.column(a), f"{a}_d": log.column(f"{a}_d")}) for a in axes]
    errors = [Panel(f"{a}_d - {a}", "m", {f"error in {a}": error[:, i]}) for i, a in enumerate(axes)]
    shown = {"t", *axes, *(f"{a}_d" for a in axes)}
    units = dict.fromkeys(unit for one, unit in columns.items() if one not in shown)
    rest = {unit: [one for one in columns if columns[one] == unit and one not in shown] for unit in units}
    signals = [Panel(", ".join(names), unit, {one: log.column(one) for one in names}) for unit, names in rest.items()]
    return [
        FigureJob("position", f"{name}: position", t, [*tracks, *errors], 2),
        *([FigureJob("signals", f"{name}: all other signals", t, signals, 2)] if signals else []),
    ]
