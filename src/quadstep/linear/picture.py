"""Figures of a linear loop: Bode and Nyquist plots with each channel opened, and the step responses."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from quadstep.linear.analysis import Analysis, StepResponse
from quadstep.linear.margins import Margins
from quadstep.linear.states import Array, Channel
from quadstep.linear.transfer import Complex
from quadstep.report.axes import plain, powers
from quadstep.report.canvas import LINES, drawing, margins, new_figure, write
from quadstep.report.sheet import Sheet

FAINTEST, LOUDEST = -60.0, 60.0
"""Range of a Bode plot [dB]."""

REACH = 3.0
"""Range of a Nyquist plot on either side of the critical point."""


class Open(NamedTuple):
    """The opened loop as drawn. omega [rad/s]; loop: L, shape (frequencies, channels). unsure: half of the 95 % interval of
    the first channel's L, as a share of it, where that was measured.
    """

    channels: tuple[Channel, ...]
    omega: Array
    loop: Complex
    unsure: Array | None = None


MEASURES: tuple[tuple[str, Callable[[Margins], float]], ...] = (
    ("phase [°]", lambda one: math.degrees(one.phase)),
    ("delay [ms]", lambda one: 1e3 * one.delay),
    ("disk", lambda one: one.disk),
)
"""Margins drawn over time or over draws."""


def draw_bode(path: Path, shown: Open, sheet: Sheet) -> None:
    """Magnitude [dB] and phase [°] of L over frequency."""
    with drawing(sheet):
        figure = new_figure(sheet, 8.0, 5.6, 3.6)
        above, below = figure.subplots(2, 1, sharex=True)
        margins(figure, sheet, 0.09, 0.09, 0.98, 0.98, 0.2, 0.08)
        for i, channel in enumerate(shown.channels):
            size = 20.0 * np.log10(np.maximum(np.abs(shown.loop[:, i]), 1e-12))
            phase = np.degrees(np.unwrap(np.angle(shown.loop[:, i])))
            phase -= 360.0 * round((phase[len(phase) // 2] + 180.0) / 360.0)
            heard = size > FAINTEST
            if shown.unsure is not None and i == 0:
                ends = (20.0 * np.log10(np.maximum(1.0 + sign * shown.unsure, 1e-12)) for sign in (-1.0, 1.0))
                above.fill_between(
                    shown.omega, *(size + end for end in ends), color="0.75", linewidth=0.0, label="95 % interval"
                )
                turn = np.where(shown.unsure < 1.0, np.degrees(np.arcsin(np.minimum(shown.unsure, 1.0))), 180.0)
                below.fill_between(shown.omega, phase - turn, phase + turn, color="0.75", linewidth=0.0)
            above.plot(shown.omega, size, label=channel.name, **LINES[i % len(LINES)])
            below.plot(shown.omega, np.where(heard, phase, np.nan), **LINES[i % len(LINES)])
        above.axhline(0.0, color="0.5", linewidth=0.8)
        below.axhline(-180.0, color="0.5", linewidth=0.8)
        above.set_ylim(FAINTEST, LOUDEST)
        above.set_xscale("log")
        below.xaxis.set_major_formatter(powers())
        above.set_ylabel("|L| [dB]")
        below.set_ylabel("phase of L [°]")
        below.set_xlabel("frequency [rad/s]")
        for axes in (above, below):
            axes.yaxis.set_major_formatter(plain())
        above.legend(loc="upper right", ncols=2)
        write(figure, path, sheet)


def draw_nyquist(path: Path, shown: Open, sheet: Sheet) -> None:
    """L in the complex plane around -1, with the unit circle, on which only the phase differs from -1."""
    with drawing(sheet):
        figure = new_figure(sheet, 5.4, 5.0, 3.4)
        axes = figure.subplots()
        margins(figure, sheet, 0.11, 0.09, 0.97, 0.98)
        turn = np.linspace(0.0, 2.0 * math.pi, 361)
        axes.plot(np.cos(turn), np.sin(turn), color="0.6", linewidth=0.8)
        for i, channel in enumerate(shown.channels):
            axes.plot(shown.loop[:, i].real, shown.loop[:, i].imag, label=channel.name, **LINES[i % len(LINES)])
        axes.plot([-1.0], [0.0], "+", color="black", markersize=9)
        axes.set_xlim(-1.0 - 0.8 * REACH, -1.0 + 1.2 * REACH)
        axes.set_ylim(-REACH, REACH)
        axes.set_aspect("equal")
        axes.set_xlabel("real part of L")
        axes.set_ylabel("imaginary part of L")
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter(plain())
        axes.legend(loc="upper right")
        write(figure, path, sheet)


def draw_steps(path: Path, steps: Sequence[StepResponse], sheet: Sheet) -> None:
    """Response of each stepped quantity to its step of the path."""
    with drawing(sheet):
        figure = new_figure(sheet, 8.0, 4.0, 2.8)
        axes = figure.subplots()
        margins(figure, sheet, 0.08, 0.13, 0.98, 0.97)
        for i, step in enumerate(steps):
            axes.plot(step.t, step.value, label=f"{step.name} [{step.unit}]", **LINES[i % len(LINES)])
        axes.axhline(1.0, color="0.5", linewidth=0.8)
        axes.set_xlim(0.0, max(float(step.t[-1]) for step in steps))
        axes.set_xlabel("t [s]")
        axes.set_ylabel("response to a step of 1")
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter(plain())
        axes.legend(loc="lower right")
        write(figure, path, sheet)


def draw_over(path: Path, label: str, at: Array, loops: Sequence[Analysis], sheet: Sheet) -> None:
    """Phase, delay and disk margins of each channel over time, or over the draws as points."""
    with drawing(sheet):
        figure = new_figure(sheet, 8.0, 6.4, 4.4)
        grid = figure.subplots(len(MEASURES), 1, sharex=True)
        margins(figure, sheet, 0.09, 0.08, 0.98, 0.98, 0.2, 0.1)
        for axes, (title, of) in zip(grid, MEASURES, strict=True):
            for i, channel in enumerate(loops[0].channels):
                values = np.array([of(one.margins[i]) for one in loops])
                drawn = (
                    LINES[i % len(LINES)]
                    if label == "t [s]"
                    else {"color": LINES[i % len(LINES)]["color"], "marker": "o+x^"[i % 4], "linestyle": ""}
                )
                axes.plot(at, np.where(np.isfinite(values), values, np.nan), label=channel.name, markersize=4, **drawn)
            axes.set_ylabel(title)
            axes.set_ylim(bottom=0.0)
            axes.yaxis.set_major_formatter(plain())
        grid[-1].set_xlabel(label)
        grid[-1].xaxis.set_major_formatter(plain())
        grid[0].legend(loc="upper right", ncols=4)
        write(figure, path, sheet)
