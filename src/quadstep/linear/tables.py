"""An analysis as tables for people: dB, degrees, milliseconds."""

import math
from collections.abc import Iterable
from typing import NamedTuple

from quadstep.linear.analysis import Analysis, StepResponse
from quadstep.linear.grade import graded
from quadstep.linear.margins import Margins
from quadstep.linear.modes import Pole
from quadstep.linear.states import short
from quadstep.report.units import listed

MARGIN_HEADER = ("", "gain up [dB]", "gain down [dB]", "phase [°]", "at [rad/s]", "delay [ms]", "disk", "S", "T")
POLE_HEADER = ("pole [1/s]", "time constant [s]", "damping", "frequency [rad/s]", "count", "states")
STEP_HEADER = ("step of 1", "overshoot [%]", "settling time to 2 % [s]")
METHOD = (
    "One loop is opened at a time, between the controller's command and the rotors. Margins say how far that command can be "
    "scaled, shifted in phase or delayed before the sampled loop becomes unstable. S and T are the largest sensitivity and "
    "complementary sensitivity."
)

BENT = (
    "The loop has a kink at rest: its slopes differ from side to side. The margins are the worst of {}, each as if the loop "
    "stayed there; the kink is at one or more of these places"
)

NEAR = (
    "The loop has a kink near its rest, beyond which its slopes differ ({}). The margins are the worst of those at rest "
    "and of {}."
)

LATER = "The loop changes with time: this is the worst of what it is at the start and at t = {} s of the flight."

SHOWN = 10
"""Most poles in a table, the slowest first; the files have all."""

NAMED = 4
"""Most states named in a row."""

ALIKE = 1e-4
"""Poles that differ by less than this share share a row."""


class Group(NamedTuple):
    """Poles that are equal up to rounding. times: multiplicity; a pair counts as two. states: of any of them."""

    pole: Pole
    times: int
    states: tuple[str, ...]


def decibels(factor: float) -> str:
    """A factor in dB; "none" if infinite (beyond 60 dB)."""
    return "none" if factor in (0.0, math.inf) else f"{20.0 * math.log10(factor):.1f}"


def number(value: float, digits: str = ".1f") -> str:
    """A margin as text, if there is one."""
    return f"{value:{digits}}" if math.isfinite(value) else "none"


def margin_cells(one: Margins) -> list[str]:
    """A row of `MARGIN_HEADER` without its name."""
    return [
        decibels(one.gain_up),
        decibels(one.gain_down),
        number(math.degrees(one.phase)),
        number(one.phase_at),
        number(1e3 * one.delay),
        f"{one.disk:.2f}",
        f"{one.sensitivity:.2f}",
        f"{one.complementary:.2f}",
    ]


def margin_rows(found: Analysis) -> list[list[str]]:
    return [[channel.name, *margin_cells(one)] for channel, one in zip(found.channels, found.margins, strict=False)]


def grouped(poles: list[Pole]) -> list[Group]:
    """Poles in order, equal ones merged."""
    groups: list[Group] = []
    for pole in poles:
        twice = 2 if pole.imaginary else 1
        for place, (first, count, states) in enumerate(groups):
            if math.hypot(pole.real - first.real, pole.imaginary - first.imaginary) <= ALIKE * first.frequency:
                groups[place] = Group(first, count + twice, tuple(dict.fromkeys((*states, *pole.states))))
                break
        else:
            groups.append(Group(pole, twice, pole.states))
    return groups


def pole_rows(poles: list[Pole], most: int | None = SHOWN) -> list[list[str]]:
    """A row for each distinct pole, the slowest first."""
    return [
        [
            f"{pole.real:.4g}" + (f" ± {pole.imaginary:.4g}j" if pole.imaginary > ALIKE * pole.frequency else ""),
            number(pole.time_constant, ".4g"),
            f"{pole.damping:.3f}",
            f"{pole.frequency:.4g}",
            str(count),
            first(states),
        ]
        for pole, count, states in grouped(poles)[:most]
    ]


def sentences(found: Analysis) -> list[str]:
    """The opening lines, before any number."""
    grade, period = graded(found), found.loop.period
    later = [LATER.format(listed([f"{t:.3g}" for t in found.later]))] if found.later else []
    if not found.stable:
        return [grade.sentence, *later]
    slowest = f"The slowest mode has a time constant of {number(found.poles[0].time_constant, '.3g')} s."
    still = dict.fromkeys(name for pole in found.poles if not pole.real and not pole.imaginary for name in pole.states)
    if still:
        slowest = f"A mode neither grows nor decays: {first(still)} keep any value they are given."
    sampled = (
        f"Sampled: {len(period.names)} states, every loop at its own rate, with a common period of {1e3 * period.length:g} ms."
    )
    bent = [f"{BENT.format(found.tried)} ({', '.join(found.bends)})."] if found.bends else []
    if found.near and not bent:
        bent = [NEAR.format(first(short(found.near)), found.tried)]
    return [grade.sentence, *later, slowest, sampled, *bent]


def first(names: Iterable[str]) -> str:
    every = list(names)
    return ", ".join(every[:NAMED]) + (f" and {len(every) - NAMED} more" if len(every) > NAMED else "")


def step_rows(steps: list[StepResponse]) -> list[list[str]]:
    """A row of `STEP_HEADER` for each step."""
    return [[one.name, f"{100.0 * one.overshoot:.1f}", number(one.settling, ".2f")] for one in steps]
