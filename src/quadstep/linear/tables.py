"""Tables of an analysis in dB, degrees and milliseconds; Bode and Nyquist plots with each channel opened; steps."""

import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib import rcParams
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator, MultipleLocator

from quadstep.linear.analysis import Analysis, StepResponse
from quadstep.linear.margins import Margins
from quadstep.linear.modes import ALIKE, Pole, grouped
from quadstep.linear.states import Array, Channel, short
from quadstep.linear.transfer import Complex
from quadstep.report.axes import CLEAR, Powers, crossed, plain
from quadstep.report.canvas import LETTER, LINES, figure_at
from quadstep.report.sheet import COLUMN, PHONE, Sheet
from quadstep.report.units import listed

POLE_HEADER = ("pole [1/s]", "damping", "states")
METHOD = (
    "One loop is opened at a time, between the controller's command and the rotors. Margins say how far that command can be "
    "scaled, shifted in phase or delayed before the sampled loop becomes unstable. S is 1/(1 + L) and T is L/(1 + L); the "
    "peak of S is the inverse of the smallest distance of L from −1. Disk is for gain and phase that change together: a disk "
    "margin of d allows all complex factors (1 + δ/2)/(1 − δ/2) with |δ| < d, among them gains "
    "up to (2 + d)/(2 − d) and phases up to 2 arctan(d/2)."
)
PEAKS = "S is the factor by which disturbances are amplified, T that of measurement noise; peaks far above 2 are a warning."
ONE = " Curves, poles and steps show one of them."
DIGITS = ", without the digits that depend on this choice"
BENT = "The law has a kink at rest, so margins are the worst of {}." + ONE
NEAR = "The law has a kink close to rest ({}), so margins are the worst of rest and {}." + ONE
LATER = "The loop changes with time: this is the worst of the loops at the start and at t = {} s of the flight."

SHOWN = 10
"""Most poles in a table, the slowest first; the files have all."""


def pole_rows(poles: list[Pole], in_words: Callable[[Iterable[str]], str]) -> list[list[str]]:
    """A row for each distinct pole, the slowest first. in_words: states as people say them."""
    return [
        [
            f"{pole.real:.4g}" + (f" ± {pole.imaginary:.4g}j" if pole.imaginary > ALIKE * pole.frequency else ""),
            f"{pole.damping:.3f}" if pole.real < 0.0 else "",
            in_words(states),
        ]
        for pole, _, states in grouped(poles)[:SHOWN]
    ]


def sentences(analysis: Analysis) -> list[str]:
    """What else is to be known of a grade."""
    later = [LATER.format(listed([f"{t:.3g}" for t in analysis.later]))] if analysis.later else []
    tried = analysis.tried + DIGITS * analysis.kinked
    bent = [BENT.format(tried)] if analysis.bends else []
    if analysis.near and not bent:
        bent = [NEAR.format(analysis.in_words(short(analysis.near)), tried)]
    return [*later, *(bent if analysis.stable else [])]


def of_poles(analysis: Analysis) -> str:
    """What is constant in a loop, and how it is sampled."""
    period, kept = analysis.loop.period, len(analysis.loop.modes.staying)
    still = dict.fromkeys(name for pole in analysis.poles if not pole.frequency for name in pole.states)
    constant = "mode neither grows nor decays" if kept == 1 else "modes neither grow nor decay"
    felt = "" if analysis.not_held else f", without effect on {listed(period.pose.names)}"
    said = f"{kept} {constant}{felt}: {analysis.in_words(still)}. " if kept else ""
    gone = len(period.names) - sum(times for _, times, _ in grouped(analysis.poles))
    but = f" except {gone} that decay within one period" * (gone > 0)
    said += f"The loop has {len(period.names)} states and a common period of {1e3 * period.length:g} ms. "
    return f"{said}Shown are the slowest poles; poles.csv lists all{but}."


FAINTEST, LOUDEST = -60.0, 60.0
"""Range of a Bode plot [dB]."""

NEAR_ENOUGH = 1.0
"""A curve is drawn no coarser than this about a gain margin [dB]."""

REACH = 3.0
"""Range of a Nyquist plot above and below the critical point, unless a curve crosses the real axis farther to the left."""

FARTHEST = 8.0
"""Crossings of the real axis beyond are off the plot."""


class OpenLoop(NamedTuple):
    """The opened loop as drawn. omega [rad/s]; loop: L, shape (frequencies, channels). unsure: half of the 95 % interval of
    the first channel's L, as a share of it, where that was measured. phases: phase margins to mark [°], by place
    of their channel, and where they are [rad/s]; gains: gain margins [dB], those downwards below 0. written: these as
    text.
    """

    channels: tuple[Channel, ...]
    omega: Array
    loop: Complex
    unsure: Array | None = None
    phases: Sequence[tuple[int, float, float]] = ()
    gains: Sequence[tuple[int, float]] = ()
    written: Callable[[float], str] = "{:.1f}".format


MEASURES: tuple[tuple[str, Callable[[Margins], float]], ...] = (
    ("phase [°]", lambda one: math.degrees(one.phase)),
    ("delay [ms]", lambda one: 1e3 * one.delay),
    ("disk", lambda one: one.disk),
)
"""Margins drawn over time or over draws."""


PLACES = {"thrust": 0, "z": 0, "yaw": 1, "pitch": 2, "x": 2, "roll": 3, "y": 3}
"""Of the lines of channels and of what each moves."""


def place_of(name: str, place: int) -> int:
    """The place of the style of a channel, or of what it moves, in every figure. place: for any other name."""
    return PLACES.get(name.partition(" and ")[0], place) % len(LINES)


ALIKE_CURVES = 0.005
"""Share by which curves differ that are drawn as one."""


def distinct(count: int, alike: Callable[[int, int], bool]) -> list[list[int]]:
    """The places of curves, those that look the same together."""
    found: list[list[int]] = []
    for i in range(count):
        same = next((those for those in found if alike(those[0], i)), None)
        if same is None:
            found.append(same := [])
        same.append(i)
    return found


def merged(shown: OpenLoop) -> OpenLoop:
    """With channels that look the same as one."""
    apart = ALIKE_CURVES * np.abs(shown.loop)
    groups = distinct(
        len(shown.channels), lambda a, b: bool((np.abs(shown.loop[:, a] - shown.loop[:, b]) <= apart[:, a]).all())
    )
    place = {i: k for k, those in enumerate(groups) for i in those}
    return shown._replace(
        channels=tuple(
            shown.channels[those[0]]._replace(name=listed([shown.channels[i].name for i in those])) for those in groups
        ),
        loop=shown.loop[:, [those[0] for those in groups]],
        phases=[(place[i], degrees, at) for i, degrees, at in shown.phases],
        gains=[(place[i], gain) for i, gain in shown.gains],
    )


def draw_bode(path: Path, shown: OpenLoop, sheet: Sheet) -> None:
    """Magnitude [dB] and phase [°] of L over frequency."""
    with figure_at(path, sheet, (COLUMN, 3.0, 3.6), 0.085, 0.165, 0.985, 0.96, 0.24) as figure:
        above, below = figure.subplots(1, 2, sharex=True)
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
            above.plot(shown.omega, size, label=channel.name, **LINES[place_of(channel.name, i)])
            below.plot(shown.omega, np.where(heard, phase, np.nan), **LINES[place_of(channel.name, i)])
        above.axhline(0.0, color="0.5", linewidth=0.8)
        below.axhline(-180.0, color="0.5", linewidth=0.8)
        above.set(xscale="log", ylim=(FAINTEST, LOUDEST), ylabel="|L| [dB]")
        below.yaxis.set_major_locator(
            MultipleLocator(next((step for step in (90.0, 45.0) if np.ptp(below.get_ylim()) > 3.0 * step), 15.0))
        )
        mark_margins(above, below, shown)
        below.set_ylabel("phase of L [°]")
        for axes in (above, below):
            axes.set_xlabel("frequency [rad/s]")
            axes.xaxis.set_major_formatter(Powers())
            axes.yaxis.set_major_formatter(plain())
        above.legend(loc="lower left")


def mark_margins(above: Axes, below: Axes, shown: OpenLoop) -> None:
    """The phase margins where curves cross 0 dB, and the gain margins where they cross -180°, each with its number."""
    marks: list[tuple[Axes, int, float, float, float, str]] = []
    for place, degrees, at in shown.phases:
        turned = np.array(np.interp(at, shown.omega, np.asarray(below.lines[place].get_ydata())))
        marks.append((below, place, at, float(whole_turns(turned)), float(turned), f"{shown.written(degrees)}°"))
        above.plot([at], [0.0], "o", markersize=4, color=above.lines[place].get_color())
    for place, gain in shown.gains:
        size, phase = (np.asarray(axes.lines[place].get_ydata()) for axes in (above, below))
        off = phase - whole_turns(phase)
        found = np.flatnonzero((off[:-1] * off[1:] <= 0.0) & (np.abs(off[:-1] - off[1:]) < 90.0))
        near = int(min(found, key=lambda k: abs(size[k] + gain), default=-1))
        if near >= 0 and abs(size[near] + gain) < NEAR_ENOUGH:
            marks.append((above, place, shown.omega[near], 0.0, -gain, f"{shown.written(abs(gain))} dB"))
            below.plot(
                [shown.omega[near]], [whole_turns(phase[near])], "o", markersize=4, color=below.lines[place].get_color()
            )
    for axes, place, at, *ends, _ in marks:
        axes.plot([at, at], ends, color=axes.lines[place].get_color(), linewidth=2.0, marker="_", markersize=7)
    taken = [axes.transData.transform([(at, one) for one in ends]) for axes, _, at, *ends, _ in marks]
    taken += [axes.transData.transform([(end, line) for end in axes.get_xlim()]) for axes, _, _, line, *_ in marks]
    for axes, place, at, *ends, text in marks:
        taken.append(label(axes, place, at, 0.5 * sum(ends), text, taken))


def whole_turns(phase: Array) -> Array:
    """-180°, or what is whole turns from it and nearer."""
    return 360.0 * np.asarray(np.round((phase + 180.0) / 360.0)) - 180.0


def label(axes: Axes, place: int, at: float, middle: float, text: str, taken: Sequence[Array]) -> Array:
    """The number of a margin, beside the middle of its bar where the fewest curves are; returns the ends of its box. taken:
    ends of bars, lines and boxes that it should not cover, in pixels.
    """
    x, y = axes.transData.transform((at, middle))
    point = axes.figure.dpi / 72.0
    wide, high = (size * rcParams["font.size"] * point for size in (LETTER * len(text), 1.2))

    def box(aside: float, up: float) -> Array:
        near, low = x + aside * point, y + up * point - 0.5 * high
        return np.array([sorted([near, near + math.copysign(wide, aside)]), [low, low + high]]).T

    def behind(place: tuple[float, float]) -> int:
        ends = box(*place)
        hidden = [(one.max(axis=0) >= ends[0]).all() and (one.min(axis=0) <= ends[1]).all() for one in taken]
        outside = not axes.bbox.x0 < ends[0, 0] < ends[1, 0] < axes.bbox.x1
        return crossed(axes, *ends.T) + 100 * (sum(hidden) + outside)

    aside, up = best = min(((side, up) for up in (0.0, 14.0, -14.0, 28.0, -28.0, 42.0) for side in (6.0, -6.0)), key=behind)
    axes.annotate(
        text, (at, middle), (aside, up), textcoords="offset points", ha="left" if aside > 0.0 else "right", va="center",
        color=axes.lines[place].get_color(), bbox=CLEAR, zorder=1.5,
    )  # fmt: skip
    return box(*best)


def draw_nyquist(path: Path, shown: OpenLoop, sheet: Sheet) -> None:
    """L in the complex plane around -1, with the unit circle, on which only the phase differs from -1."""
    with figure_at(path, sheet, (PHONE, 3.7, 3.4), 0.15, 0.115, 0.965, 0.97) as figure:
        axes = figure.subplots()
        turn = np.linspace(0.0, 2.0 * math.pi, 361)
        axes.plot(np.cos(turn), np.sin(turn), color="0.6", linewidth=0.8)
        for i, channel in enumerate(shown.channels):
            axes.plot(shown.loop[:, i].real, shown.loop[:, i].imag, label=channel.name, **LINES[place_of(channel.name, i)])
        axes.plot([-1.0], [0.0], "+", color="black", markersize=9)
        shape, left = figure.get_figwidth() / figure.get_figheight(), -shown.loop.real[1:]
        crossed = left[(np.diff(np.signbit(shown.loop.imag), axis=0) != 0) & (left < FARTHEST)]
        reach = max(REACH, (float(crossed.max(initial=0.0)) - 0.8) / (0.9 * shape))
        across = reach * shape
        axes.set(xlabel="real part of L", ylabel="imaginary part of L", aspect="equal")
        axes.set(xlim=(-1.0 - 0.9 * across, -1.0 + 1.1 * across), ylim=(-reach, reach))
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter(plain())
        axes.legend(loc="upper right")


SETTLINGS = 2.5
"""The time drawn of steps that settle, in multiples of the last settling time."""


def draw_steps(path: Path, steps: Sequence[StepResponse], sheet: Sheet) -> None:
    """Response of each stepped quantity to its step of the path."""
    with figure_at(path, sheet, (PHONE, 3.7, 3.4), 0.15, 0.14, 0.965, 0.97) as figure:
        axes = figure.subplots()
        most = ALIKE_CURVES * max(float(np.abs(step.value).max()) for step in steps)
        for those in distinct(
            len(steps),
            lambda a, b: steps[a].unit == steps[b].unit and float(np.abs(steps[a].value - steps[b].value).max()) <= most,
        ):
            step, name = steps[those[0]], listed([steps[i].name for i in those])
            axes.plot(step.t, step.value, label=f"{name} [{step.unit}]", **LINES[place_of(name, those[0])])
        axes.axhline(1.0, color="0.5", linewidth=0.8)
        axes.set_xlim(0.0, min(SETTLINGS * max(step.settling for step in steps), max(float(step.t[-1]) for step in steps)))
        axes.set(xlabel="time [s]", ylabel="response to a step of 1")
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter(plain())
        axes.legend(loc="best")


def draw_over(path: Path, label: str, at: Array, loops: Sequence[Analysis], sheet: Sheet) -> None:
    """Phase, delay and disk margins of each channel over time, or over the draws as points, those of a draw side by side."""
    with figure_at(path, sheet, (PHONE, 4.4), 0.17, 0.115, 0.965, 0.935, 0.2, 0.1) as figure:
        grid = figure.subplots(len(MEASURES), 1, sharex=True)
        for axes, (title, of) in zip(grid, MEASURES, strict=True):
            for i, channel in enumerate(loops[0].channels):
                values = np.array([of(one.margins[i]) for one in loops])
                drawn, aside = LINES[place_of(channel.name, i)], 0.0
                if label != "time [s]":
                    drawn = {"color": drawn["color"], "marker": "o+x^"[i % 4], "linestyle": ""}
                    aside = 0.1 * (i - 0.5 * (len(loops[0].channels) - 1))
                axes.plot(at + aside, np.where(np.isfinite(values), values, np.nan), label=channel.name, markersize=4, **drawn)
            axes.set(ylabel=title, ylim=(0.0, None))
            axes.yaxis.set_major_formatter(plain())
        grid[-1].set_xlabel(label)
        if label != "time [s]":
            grid[-1].xaxis.set_major_locator(MaxNLocator(integer=True))
        grid[-1].xaxis.set_major_formatter(plain())
        grid[0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.0, ncols=4)
