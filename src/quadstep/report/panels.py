"""What the figures of a flight show, of any plant: panels from the columns that its log has."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.interfaces.log import FlightLog
from quadstep.io.doors import Door
from quadstep.metrics.quantities import position_axes, position_errors, rotor_columns
from quadstep.report.captions import of_attitude, of_inputs, of_others, of_path, of_position
from quadstep.report.drawing import FigureJob
from quadstep.report.panel import COMMANDED, Panel, Track
from quadstep.report.sheet import Sheet

SPACE = frozenset("xyz")

LEARNING, VEHICLE = "lyapunov", "wind_x"
"""Columns of the paper's plant and of real vehicles, which name the figure of what is neither motion nor input."""


class Attitude(NamedTuple):
    """Angles as a log calls them, and the rates that go with them. errors: whether the errors are drawn too."""

    angles: tuple[str, ...]
    rates: tuple[str, ...] = ()
    errors: bool = False


ATTITUDES = (Attitude(("phi", "theta", "psi"), errors=True), Attitude(("roll", "pitch", "yaw"), ("p", "q", "r")))


def line(log: FlightLog, name: str) -> NDArray[np.float64]:
    values = log.column(name)
    return np.unwrap(values) if log.columns[name] == "rad" else values


def against(log: FlightLog, name: str, *others: str) -> Panel:
    """A column with those beside it that the log has."""
    return Panel(name, log.columns[name], {one: line(log, one) for one in (name, *others) if one in log.columns})


def position_panels(log: FlightLog) -> list[Panel]:
    """Each axis against its command, then its error."""
    axes, errors = position_axes(log), position_errors(log)
    tracks = [against(log, a, f"{a}_d") for a in axes]
    return tracks + [Panel(f"{a}_d - {a}", "m", {f"error in {a}": errors[:, i]}) for i, a in enumerate(axes)]


def attitude_panels(log: FlightLog, only: Sequence[str] | None = None) -> list[Panel]:
    """Angles against their commands, as far as the law says these, then errors or rates. only: of these angles."""
    for attitude in ATTITUDES:
        if any(log.columns.get(a) != "rad" for a in attitude.angles):  # a plant of one's own may call a torque roll
            continue
        angles = attitude.angles if only is None else only
        tracks = [against(log, a, f"{a}_d") for a in angles]
        said = [a for a in angles if attitude.errors and f"{a}_d" in log.columns]
        misses = [Panel(f"{a}_d - {a}", "rad", {f"error in {a}": log.column(f"{a}_d") - log.column(a)}) for a in said]
        return tracks + misses + [against(log, rate) for rate in attitude.rates if rate in log.columns]
    return []


def input_columns(log: FlightLog, efforts: Mapping[str, str]) -> tuple[str, ...]:
    """Thrust and torques: as the plant calls its inputs, or what the log has of those of the paper or of a real vehicle."""
    if efforts and all(name in log.columns for name in efforts):
        return tuple(efforts)
    return tuple(n for n in ("u", "tau_phi", "tau_theta", "tau_psi", "tau_x", "tau_y", "tau_z") if n in log.columns)


def input_panels(log: FlightLog, efforts: Mapping[str, str] | None = None) -> list[Panel]:
    """Thrust and torques; where the log tells them apart, commanded and within the limits."""
    panels = []
    for name in input_columns(log, efforts or {}):
        panel = against(log, name)
        if f"{name}_a" in log.columns:
            panel = panel._replace(lines={COMMANDED: log.column(name), "within limits": log.column(f"{name}_a")})
        panels.append(panel)
    return panels


def other_panels(log: FlightLog) -> list[Panel]:
    """Rotors, air, nets, errors of the law and battery.

    Those that the log does not have are left out, and those that are zero throughout: a law without nets, still air, an ideal
    battery.
    """
    drawn = (
        ("rotor thrust", "N", {name: name for name in rotor_columns(log.columns)}),
        ("wind", "m/s", {f"wind_{axis}": axis for axis in "xyz"}),
        ("norm of weights", "-", {"norm_W1": "W1", "norm_W2": "W2"}),
        ("filtered errors", "m/s, rad/s", {"norm_r1": "|r1|", "norm_r2": "|r2|"}),
        ("L without weights", "J", {"lyapunov": "L"}),
        ("battery", "V", {"voltage": "voltage"}),
    )
    found: list[Panel] = []
    for label, unit, names in drawn:
        lines = {shown: log.column(name) for name, shown in names.items() if name in log.columns}
        if len(lines) == len(names) and any(values.any() for values in lines.values()):
            found.append(Panel(label, unit, lines))
    return found


def signal_panels(log: FlightLog, drawn: Sequence[Panel]) -> list[Panel]:
    """All columns that are not drawn yet, those of one unit together."""
    shown = {"t", *(name for panel in drawn for name in panel.lines)}
    units = dict.fromkeys(unit for name, unit in log.columns.items() if name not in shown)
    rest = {unit: [name for name in log.columns if log.columns[name] == unit and name not in shown] for unit in units}
    return [Panel(", ".join(names), unit, {name: log.column(name) for name in names}) for unit, names in rest.items()]


def path_job(log: FlightLog, name: str, caption: str) -> FigureJob:
    """Of a log with at least two rows."""
    distance = np.linalg.norm(position_errors(log), axis=1)
    return FigureJob(name, caption, log.column("t"), [], track=Track(distance, in_space(log, "_d"), in_space(log)))


def in_space(log: FlightLog, suffix: str = "") -> NDArray[np.float64]:
    """x, y and z, shape (samples, 3); 0 along an axis that the plant does not have."""
    columns = [log.column(f"{axis}{suffix}") if axis in log.columns else np.zeros(len(log.rows)) for axis in "xyz"]
    return np.stack(columns, axis=1)


FIGURES = Door("quadstep.figures", {"flight": "quadstep.report.panels:panel_jobs"})
"""What draws figures of a flight: each is given what `flight_jobs` is, and returns jobs."""


def flight_jobs(log: FlightLog, name: str, efforts: Mapping[str, str] | None = None) -> list[FigureJob]:
    """All figures of a flight. efforts: columns of the plant's inputs. Raises UserError."""
    return [job for one in FIGURES.names for job in FIGURES.load(one)(log, name, efforts)]


def chosen_jobs(jobs: Sequence[FigureJob], sheet: Sheet) -> list[FigureJob]:
    """What is drawn of a flight's figures: all, or one of the sheet's signals, where it has panels of these."""
    if not sheet.signals or not jobs:
        return [*jobs]
    t = jobs[0].t
    alone = [job for job in jobs if not joins(job, t)]
    panels = sheet.chosen((job.name, panel.label, panel) for job in jobs if joins(job, t) for panel in job.panels)
    one = [FigureJob("signals", of_others(panels, t), t, panels, min(2, len(panels)))] if panels else []
    return [*sheet.chosen((job.name, job.name, job) for job in alone), *one]


def joins(job: FigureJob, t: NDArray[np.float64]) -> bool:
    """Whether its panels can stand below others over the time t [s]; not so a path in space."""
    return bool(job.panels) and np.array_equal(job.t, t)


def labels_of(jobs: Sequence[FigureJob]) -> dict[str, list[str]]:
    """What can be chosen of a flight's figures: the labels of the panels that can stand with others, by figure."""
    return {job.name: [panel.label for panel in job.panels] if joins(job, jobs[0].t) else [] for job in jobs}


def panel_jobs(log: FlightLog, _name: str, efforts: Mapping[str, str] | None = None) -> list[FigureJob]:
    """The package's figures of a flight: its path in space, position, attitude, inputs, and the rest. efforts: columns of the
    plant's inputs.

    The rest is called learning of the paper's plant, vehicle of a real one, and signals, all that is left, of any other.
    """
    position, attitude, inputs = position_panels(log), attitude_panels(log), input_panels(log, efforts)
    if LEARNING in log.columns or VEHICLE in log.columns:
        rest = "learning" if LEARNING in log.columns else "vehicle"
        others = other_panels(log)
    else:
        rest, others = "signals", signal_panels(log, [*position, *attitude, *inputs])
    t = log.column("t")
    figures = (
        ("position", position, partial(of_position, log)),
        ("attitude", attitude, partial(of_attitude, log, attitude)),
        ("inputs", inputs, partial(of_inputs, log, inputs)),
        (rest, others, partial(of_others, others, t)),
    )
    path = [path_job(log, "path", of_path(log))] if len(SPACE & {*position_axes(log)}) > 1 else []
    return [*path, *(FigureJob(file, said(), t, panels, 2) for file, panels, said in figures if panels)]
