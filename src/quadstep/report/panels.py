"""What the figures of a flight show, of any plant: panels from the columns that its log has, and captions that say where it is
worst, when, and what stays.
"""

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.log import FlightLog
from quadstep.io.doors import Door
from quadstep.metrics.quantities import position_axes, position_errors, rotor_columns, shorter_way
from quadstep.metrics.registry import Metrics
from quadstep.metrics.verdict import LEFT_PATH, FlightGrade, Graded, graded
from quadstep.report.drawing import FigureJob
from quadstep.report.panel import COMMANDED, EventMark, Panel, Track
from quadstep.report.sheet import Sheet
from quadstep.report.units import listed, number, percent, quantity, suited, unit_suffix

Numbers = NDArray[np.float64]

BATTERY = "battery"
"""The panel of which the lowest value matters."""

MEANT = {
    "norm of weights": "W1 and W2 are the weights that the two nets have learned.",
    "filtered errors": "r1 and r2 are the filtered errors of position and attitude, which the law drives towards 0.",
    "L without weights": "L is the Lyapunov function without its term in the weights' errors, which nobody knows.",
}
"""What the symbols of a panel stand for."""

SPOKEN = {"phi": "roll phi", "theta": "pitch theta", "psi": "yaw psi"}
"""Angles of the paper's plant with their names."""

SAME = 1e-9
"""A command is within its limits where both differ by no more than this share of the largest command."""


def of_path(log: FlightLog, track: Track) -> str:
    """How far the vehicle was from its path, at worst and later; of a lost flight, since when it was far."""
    t, distance = log.column("t"), track.distance
    worst, lost = int(distance.argmax()), log.outcome is not Outcome.COMPLETED
    later = float(distance[t >= 0.5 * t[-1]].max())
    most = quantity(float(distance[worst]), "m")
    said = f"{'In the log, the' if lost else 'The'} vehicle is farthest from its path, {most}, at {at(t, worst)}"
    said += f", and in the second half of the flight at most {quantity(later, 'm')}" if later < 0.9 * distance[worst] else ""
    near = 10.0 ** (math.floor(math.log10(max(distance[worst], 1e-300))) - 2)  # a hundredth, or less
    if lost and distance[-1] > near:
        since = int(np.flatnonzero(np.append(True, distance <= near))[-1])
        said = f"The vehicle stays more than {quantity(near, 'm')} from its path from {at(t, since)} on"
    said = said if distance[worst] else "The vehicle never leaves its path"
    if not track.views:
        return f"{said}."
    crossed = any(not {"xyz"[one] for one in pair} & {*track.beyond} for pair in track.views)
    end = ", the cross the end" if crossed else "; the end"
    beyond = f"{', which' * crossed} is beyond the view along {listed(track.beyond)}" if track.beyond else ""
    return f"{said}. The circle marks the start{end}{beyond}."


def of_position(log: FlightLog) -> str:
    """The axis with the largest error."""
    t, axes, errors = log.column("t"), position_axes(log), position_errors(log)
    worst = [int(np.abs(errors[:, i]).argmax()) for i in range(len(axes))]
    sizes = [abs(float(errors[place, i])) for i, place in enumerate(worst)]
    i = int(np.argmax(sizes))
    return (
        "No axis has an error."
        if not sizes[i]
        else f"The largest error along one axis is that along {axes[i]}, {quantity(sizes[i], 'm')} at {at(t, worst[i])}."
    )


def in_view(log: FlightLog, track: Track) -> tuple[FlightLog, str]:
    """A lost flight as far as it is in the view of its path, as what follows would flatten all else; and until when."""
    low, high = track.view
    out = int(((track.flown < low) | (track.flown > high)).any(axis=1).argmax())
    if log.outcome is Outcome.COMPLETED or not out:
        return log, ""
    return log._replace(rows=log.rows[: out + 1]), at(log.column("t"), out)


def of_attitude(log: FlightLog, panels: list[Panel]) -> str:
    """The angle farthest from what the law asks for."""
    t = log.column("t")
    found = []
    for panel in panels:
        if panel.unit == "rad" and f"{panel.label}_d" in panel.lines:
            off = np.abs(shorter_way(panel.lines[f"{panel.label}_d"] - panel.lines[panel.label]))
            found.append((float(off.max()), int(off.argmax()), float(np.median(off)), panel.label))
    if not found:
        return "Attitude and rates."
    largest, place, usual, name = max(found)
    unit, factor = suited("rad", largest)
    most, half = (f"{number(factor * one)}{unit_suffix(unit)}" for one in (largest, usual))
    said = f"The attitude is farthest from its command in {SPOKEN.get(name, name)}, by {most} at {at(t, place)}"
    return f"{said}; half of the time this difference is at most {half}."


def of_inputs(log: FlightLog, panels: list[Panel]) -> str:
    """The thrust and the torque at most, and how often the limits cut what the law commands."""
    sizes = [(np.abs(next(iter(one.lines.values()))), one) for one in panels]
    torques = [pair for pair in sizes[1:] if pair[1].unit == "N m"]
    found, largest = [], [sizes[0], *sorted(torques, key=lambda pair: -pair[0].max())]
    for what, (size, one) in zip(("thrust" * (panels[0].label == "u"), "torque"), largest, strict=False):
        place = int(size.argmax())
        most = quantity(float(next(iter(one.lines.values()))[place]), one.unit)
        named = f"{what}, {one.label}," if what else one.label
        found.append(f"The largest {named} is {most}, at {at(log.column('t'), place)}.")
    said = " ".join(found)
    if (cut := limited(log, [one.label for one in panels])) is not None:
        share = float(cut.mean())
        said += f" The limits cut the law's command {percent(share)} of the time." if share else " No limit is reached."
    return said


def of_others(panels: list[Panel], t: Numbers, more: str = "") -> str:
    """What the symbols of these panels stand for, and when a battery is lowest. more: what no panel shows, after a blank."""
    said = [MEANT[panel.label] for panel in panels if panel.label in MEANT]
    for panel in panels:
        if panel.label == BATTERY:
            place = int((voltage := panel.lines["voltage"]).argmin())
            said.append(f"The battery's voltage is lowest at {at(t, place)}: {quantity(float(voltage[place]), 'V')}.")
    return f"{' '.join(said)}{more}".strip() or f"Over time: {listed([panel.label for panel in panels])}."


def at(t: Numbers, place: int) -> str:
    """A time [s]."""
    return quantity(float(t[place]), "s") if 0.0 < t[place] < 1.0 else f"{t[place]:.3g} s"


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
    """A column with those beside it that the log has; an angle's at most half a turn from it."""
    first, found = line(log, name), {one: log.column(one) for one in others if one in log.columns}
    if log.columns[name] == "rad":
        found = {one: values - 2.0 * np.pi * np.round((values - first) / (2.0 * np.pi)) for one, values in found.items()}
    return Panel(name, log.columns[name], {name: first, **found})


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
        errors = {a: shorter_way(log.column(f"{a}_d") - log.column(a)) for a in said}
        misses = [Panel(f"{a}_d - {a}", "rad", {f"error in {a}": miss}) for a, miss in errors.items()]
        return tracks + misses + [against(log, rate) for rate in attitude.rates if rate in log.columns]
    return []


def input_columns(log: FlightLog, efforts: Mapping[str, str]) -> tuple[str, ...]:
    """Thrust and torques: as the plant calls its inputs, or what the log has of those of the paper or of a real vehicle."""
    if efforts and all(name in log.columns for name in efforts):
        return tuple(efforts)
    return tuple(n for n in ("u", "tau_phi", "tau_theta", "tau_psi", "tau_x", "tau_y", "tau_z") if n in log.columns)


def input_panels(log: FlightLog, efforts: Mapping[str, str] | None = None) -> list[Panel]:
    """Thrust and torques; commanded and within the limits, where these cut any."""
    names = input_columns(log, efforts or {})
    panels = [against(log, name) for name in names]
    if not np.any(limited(log, names)):
        return panels
    both = ({COMMANDED: log.column(name), "within limits": log.column(f"{name}_a")} for name in names)
    return [one._replace(lines=lines) for one, lines in zip(panels, both, strict=True)]


def limited(log: FlightLog, names: Sequence[str]) -> NDArray[np.bool_] | None:
    """At which samples limits cut any of these inputs; None where the log does not tell."""
    if not names or not all(f"{name}_a" in log.columns for name in names):
        return None
    wanted, made = log.table(*names), log.table(*(f"{name}_a" for name in names))
    return np.any(np.abs(wanted - made) > SAME * np.maximum(np.abs(wanted).max(axis=0), 1e-300), axis=1)


def other_panels(log: FlightLog) -> list[Panel]:
    """Rotors, air, nets, errors of the law and battery.

    Those that the log does not have are left out, and those with nothing to see: weights of a law without nets, filtered
    errors of a law that defines none, a steady wind, an ideal battery.
    """
    drawn = (
        ("rotor thrust", "N", {name: name for name in rotor_columns(log.columns)}),
        ("wind", "m/s", {f"wind_{axis}": axis for axis in "xyz"}),
        ("norm of weights", "-", {"norm_W1": "W1", "norm_W2": "W2"}),
        ("filtered errors", "m/s, rad/s", {"norm_r1": "|r1|", "norm_r2": "|r2|"}),
        ("L without weights", "J", {"lyapunov": "L"}),
        (BATTERY, "V", {"voltage": "voltage"}),
    )
    found: list[Panel] = []
    for label, unit, names in drawn:
        lines = {shown: log.column(name) for name, shown in names.items() if name in log.columns}
        shows = np.ptp if label == "wind" else np.any
        if lines and len(lines) == len(names) and any(shows(values) for values in lines.values()):
            found.append(Panel(label, unit, lines))
    return found


def steady_wind(log: FlightLog) -> str:
    """A wind that is always the same, in a sentence after a blank: a figure has nothing to show of it."""
    wind = {axis: log.column(f"wind_{axis}") for axis in "xyz" if f"wind_{axis}" in log.columns}
    blows = [f"{quantity(float(values[0]), 'm/s')} along {axis}" for axis, values in wind.items() if values.any()]
    return f" Steady wind: {listed(blows)}." if blows and not any(np.ptp(values) for values in wind.values()) else ""


def signal_panels(log: FlightLog, panels: Sequence[Panel]) -> list[Panel]:
    """All columns that are not drawn yet, those of one unit together."""
    shown = {"t", *(name for panel in panels for name in panel.lines)}
    units = dict.fromkeys(unit for name, unit in log.columns.items() if name not in shown)
    rest = {unit: [name for name in log.columns if log.columns[name] == unit and name not in shown] for unit in units}
    return [Panel(", ".join(names), unit, {name: log.column(name) for name in names}) for unit, names in rest.items()]


def track_of(log: FlightLog, begin: float = 0.0) -> Track:
    """Of a log with at least two rows. begin: from when errors count [s]."""
    return Track(np.linalg.norm(position_errors(log), axis=1), in_space(log, "_d"), in_space(log), begin)


def in_space(log: FlightLog, suffix: str = "") -> NDArray[np.float64]:
    """x, y and z, shape (samples, 3); 0 along an axis that the plant does not have."""
    columns = [log.column(f"{axis}{suffix}") if axis in log.columns else np.zeros(len(log.rows)) for axis in "xyz"]
    return np.stack(columns, axis=1)


def left_path(log: FlightLog, metrics: Metrics) -> str:
    """That a flight, if not as commanded, left its path or the point to hold (docs/metrics.md), in a sentence; or ""."""
    largest, share = metrics.get("largest_error[m]"), metrics.get("relative_error")
    if graded(metrics).grade is not FlightGrade.FLEW_BUT or not isinstance(largest, float) or not len(log.rows):
        return ""
    wanted = in_space(log, "_d")
    size, begun = float(np.linalg.norm(np.ptp(wanted, axis=0))), float(np.linalg.norm(in_space(log)[0] - wanted[0]))
    if largest <= 1.01 * max(size, begun) or not (size or (isinstance(share, float) and share > 1.0)):
        return ""
    low = float(log.column("z").min()) if {"z", "z_d"} <= log.columns.keys() and log.column("z_d").min() >= 0.0 else 0.0
    off, away, sank = LEFT_PATH
    said = (off if size else away).format(*(quantity(one, "m") for one in (largest, size)))
    return f"{said}{sank.format(quantity(low, 'm')) if low < 0.0 else ''}."


def grade_of(log: FlightLog, metrics: Metrics) -> Graded:
    """The grade of a flight, with that it left its path first among what is wrong."""
    found = graded(metrics)
    return found._replace(labels=("left its path", *found.labels)) if left_path(log, metrics) else found


FIGURES = Door("quadstep.figures", {"flight": "quadstep.report.panels:panel_jobs"})
"""What draws figures of a flight: each is given what `flight_jobs` is, and returns jobs."""


def flight_jobs(log: FlightLog, name: str, efforts: Mapping[str, str] | None = None) -> list[FigureJob]:
    """All figures of a flight. efforts: columns of the plant's inputs. Raises UserError."""
    return [job for one in FIGURES.names for job in FIGURES.load(one)(log, name, efforts)]


def seen_moments(log: FlightLog, moments: Sequence[EventMark], since: float = 0.0) -> tuple[EventMark, ...]:
    """What figures over time mark: its loss, of these moments those that it lived to see, but its start, and until when
    errors do not count.
    """
    lost = [EventMark(log.ended, "", "lost")] if log.outcome is not Outcome.COMPLETED else []
    seen = [one for one in moments if 0.0 < one.time < log.ended]
    return *lost, *seen, *[EventMark(0.0, "", "not counted", since)] * (since > 0.0)


def of_marks(moments: Sequence[EventMark]) -> str:
    """What these look like over time, to follow a caption."""
    lasting = " Strips show how long something lasts; dashed lines, in every figure, where it begins and ends."
    return lasting if any(one.word and one.until > one.time for one in moments) else ""


def with_quiet_marks(jobs: Sequence[FigureJob]) -> list[FigureJob]:
    """Figures of one report, of which only the first writes what its lines over time mark."""
    return [*jobs[:1], *(one._replace(moments=[mark._replace(named=False) for mark in one.moments]) for one in jobs[1:])]


def jobs_to_draw(jobs: Sequence[FigureJob], sheet: Sheet) -> list[FigureJob]:
    """What is drawn of a flight's figures: all, or one of the sheet's signals, where it has panels of these."""
    if not sheet.signals or not jobs:
        return [*jobs]
    t = shared_time(jobs)
    alone = [job for job in jobs if not joins(job, t)]
    panels = sheet.chosen((job.name, panel.label, panel) for job in jobs if joins(job, t) for panel in job.panels)
    said, columns = of_others(panels, t), min(2, len(panels))
    one = [jobs[0]._replace(name="signals", caption=said, t=t, panels=panels, columns=columns, track=None)]
    return [*sheet.chosen((job.name, job.name, job) for job in alone), *one * bool(panels)]


def shared_time(jobs: Sequence[FigureJob]) -> NDArray[np.float64]:
    """The time of the first that has panels [s]; a path in space is drawn to the end of a lost flight, others are not."""
    return next((job.t for job in jobs if job.panels), jobs[0].t)


def joins(job: FigureJob, t: NDArray[np.float64]) -> bool:
    """Whether its panels can stand below others over the time t [s]; not so a path in space."""
    return bool(job.panels) and np.array_equal(job.t, t)


def labels_of(jobs: Sequence[FigureJob]) -> dict[str, list[str]]:
    """What can be chosen of a flight's figures: the labels of the panels that can stand with others, by figure."""
    return {job.name: [panel.label for panel in job.panels] if joins(job, shared_time(jobs)) else [] for job in jobs}


def panel_jobs(log: FlightLog, _name: str, efforts: Mapping[str, str] | None = None) -> list[FigureJob]:
    """The package's figures of a flight: its path in space, position, attitude, inputs, and the rest. efforts: columns of the
    plant's inputs.

    The rest is called learning of the paper's plant, vehicle of a real one, and signals, all that is left, of any other.
    """
    track = track_of(log)
    first = FigureJob("path", of_path(log, track), log.column("t"), [], track=track)
    path = [first] * (len(SPACE & {*position_axes(log)}) > 1)
    log, cut = in_view(log, track) if path else (log, "")
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
        (rest, others, partial(of_others, others, t, steady_wind(log))),
    )
    return [*path, *(FigureJob(file, shown(cut, file, said()), t, panels, 2) for file, panels, said in figures if panels)]


def shown(cut: str, file: str, said: str) -> str:
    """A caption of a figure that ends at `cut`, the end of what its view of the path shows, if it does."""
    if not cut:
        return said
    if file == "position":  # farthest where it is cut
        return f"Drawn until {cut}, when the vehicle leaves the view above."
    return f"Until {cut}, {said[0].lower()}{said[1:]}" if file in ("attitude", "inputs") else f"Drawn until {cut}. {said}"
