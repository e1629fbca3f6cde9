"""What to see in the figures of a flight, in a sentence or two: where it is worst, when, and what stays."""

import numpy as np
from numpy.typing import NDArray

from quadstep.interfaces.log import FlightLog
from quadstep.metrics.quantities import position_axes, position_errors
from quadstep.report.panel import Panel
from quadstep.report.units import after, listed, number, of_angle, percent, quantity

Numbers = NDArray[np.float64]

SAME = 1e-9
"""A command is within its limits where both differ by no more than this share of the largest command."""


def of_path(log: FlightLog) -> str:
    """How far the vehicle was from its path, at worst and later."""
    t, distance = log.column("t"), np.linalg.norm(position_errors(log), axis=1)
    worst = int(distance.argmax())
    later = float(distance[t >= 0.5 * t[-1]].max())
    said = f"Farthest from its path: {quantity(float(distance[worst]), 'm')}, at {at(t, worst)}"
    said += f"; in the second half at most {quantity(later, 'm')}" if later < 0.9 * distance[worst] else ""
    return f"{said}. Circle: start; cross: end."


def of_position(log: FlightLog) -> str:
    """The axis with the largest error."""
    t, axes, errors = log.column("t"), position_axes(log), position_errors(log)
    worst = [int(np.abs(errors[:, i]).argmax()) for i in range(len(axes))]
    sizes = [abs(float(errors[place, i])) for i, place in enumerate(worst)]
    i = int(np.argmax(sizes))
    final = ", ".join(f"{axis} {quantity(float(errors[-1, k]), 'm')}" for k, axis in enumerate(axes))
    return f"Largest error along an axis: {axes[i]}, {quantity(sizes[i], 'm')} at {at(t, worst[i])}; at the end: {final}."


def of_attitude(log: FlightLog, panels: list[Panel]) -> str:
    """The angle farthest from what the law asks for."""
    t = log.column("t")
    found = []
    for panel in panels:
        if panel.unit == "rad" and f"{panel.label}_d" in panel.lines:
            off = np.abs(panel.lines[f"{panel.label}_d"] - panel.lines[panel.label])
            found.append((float(off.max()), int(off.argmax()), float(np.median(off)), panel.label))
    if not found:
        return "Attitude and rates."
    largest, place, usual, name = max(found)
    return (
        f"Farthest from the law's command: {name}, by {angle(largest)} at {at(t, place)}; "
        f"by less than {angle(usual)} half of the time."
    )


def of_inputs(log: FlightLog, panels: list[Panel]) -> str:
    """The thrust at most, and how often the limits cut what the law commands."""
    t, first = log.column("t"), panels[0]
    values = next(iter(first.lines.values()))
    place = int(np.abs(values).argmax())
    said = f"Most {first.label}: {quantity(float(values[place]), first.unit)}, at {at(t, place)}."
    pairs = [[*panel.lines.values()] for panel in panels if len(panel.lines) == 2]
    if pairs:
        cut = [np.abs(a - b) > SAME * max(float(np.abs(a).max()), 1e-300) for a, b in pairs]
        share = float(np.mean(np.any(cut, axis=0)))
        said += f" The limits cut the law's command {percent(share)} of the time." if share else " No limit is reached."
    return said


def of_others(panels: list[Panel], t: Numbers) -> str:
    """The largest value of each panel."""
    found = []
    for panel in panels:
        name, values = max(panel.lines.items(), key=lambda one: float(np.abs(one[1]).max()) if len(one[1]) else 0.0)
        if len(values):
            place = int(np.abs(values).argmax())
            value = float(values[place])
            size = number(value) if panel.unit == "-" or "," in panel.unit else quantity(value, panel.unit)
            found.append(f"{panel.label}{f', {name}' if len(panel.lines) > 1 else ''}: {size} at {at(t, place)}")
    return f"Largest values: {'; '.join(found)}." if found else listed([panel.label for panel in panels])


def angle(value: float) -> str:
    """An angle [rad] in what people see it in."""
    unit, factor = of_angle("rad", value)
    return number(factor * value) + after(unit)


def at(t: Numbers, place: int) -> str:
    """A time [s]."""
    return quantity(float(t[place]), "s") if 0.0 < t[place] < 1.0 else f"{t[place]:.3g} s"
