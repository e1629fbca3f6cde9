"""What a setpoint alone made of a rate loop's command, from a flight in which nothing else was added to it."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from quadstep.identify.logs.flight import Flags, Floats, stretches
from quadstep.identify.logs.series import Columns, Series, Topics, refuse_backward
from quadstep.identify.rate_loops import AXES, RateLoop
from quadstep.identify.response import CYCLES, Complex, amplitudes
from quadstep.io.errors import UserError, errors_in

LANDED, LEVELLED, THROTTLE, STICK = (
    "vehicle_land_detected.landed", "vehicle_control_mode.flag_control_attitude_enabled", "RATE.AOut", "main.rcCommand[3]",
)  # fmt: skip
"""PX4's: on the ground; whether the attitude loop gives the rate setpoint. ArduPilot's throttle; Betaflight's, from 1000."""

ACRO = "acro"
"""Among the parameters of a log of Betaflight: 1 if the attitude was not held, 0 if it was."""

RAISED = 1200.0
"""Betaflight's throttle of a flight: it flies from the first time that it is above to the last."""

SHORTEST = 10.0
"""Shortest excitation [s]."""

SLOWEST = 0.02
"""Longest time between two logged commands [s]."""

LOGGING = {"px4": ("SDLOG_PROFILE", 4, "high rate"), "ardupilot": ("LOG_BITMASK", 0, "fast attitude")}
"""The parameter of an autopilot, and its bit, that logs the rate loops fast."""

FLYING = 0.1
"""Least throttle of a flight."""

LONGEST_GAP = 5.0
"""Longest time between two commands of a stretch, in their periods."""

OWN = 0.5
"""Least amplitude of what is left of a setpoint, as a share of the attitude loop's answer that was taken from it: below, it is
what the subtraction of the two left over.
"""

EXPLAINED = 0.9
"""Least share of a command that the logged gains make of the logged setpoint and rate."""


class Excitation(NamedTuple):
    """excitation: what the setpoint made of the command, both (n,), a `period` [s] apart. explained: share of the command's
    power that the loop's gains make of setpoint and rate. told: the lines of its spectrum that are no noise. late: how
    uncertain the setpoint's time is, a standard deviation [s]. levelled: whether the attitude loop gave the setpoint.
    begin: time of the first sample [s]; rate (n,): as logged [rad/s].
    """

    excitation: Floats
    command: Floats
    period: float
    explained: float
    told: Flags
    late: float
    levelled: bool
    begin: float
    rate: Floats


def autotune(axis: int) -> str:
    """PX4's own excitation of an axis, added to the rate setpoint; logged too rarely to be followed, it says when."""
    return f"autotune_attitude_control_status.rate_sp[{axis}]"


def columns_of(loops: tuple[RateLoop, ...]) -> list[str]:
    """What is read of a log."""
    signals = [name for loop in loops for name in (loop.setpoint, loop.rate, loop.command)]
    return [
        *signals,
        LANDED,
        LEVELLED,
        THROTTLE,
        STICK,
        *map(autotune, range(len(AXES))),
        *(n for one in loops for n in one.apart),
    ]


def axis_excitation(path: Path, topics: Topics, loop: RateLoop, place: int) -> Excitation:
    """Of one axis. Raises UserError."""
    r, y, u = (topics.columns[name] for name in (loop.setpoint, loop.rate, loop.command))
    refuse_backward(path, topics.columns, (loop.setpoint, loop.rate, loop.command))
    period, steps = (float(np.median(np.diff(one.time))) for one in (u, r))
    refuse_slow(path, f"{loop.setpoint}, {loop.command}", max(period, steps), loop.form, topics.parameters)
    if topics.parameters.get(ACRO, 1.0) < 0.5:
        raise UserError(f"{path}: flew in a mode other than acro; what controls the attitude there is unknown; fly acro")
    levelled = latest(topics.columns.get(LEVELLED), u.time, 1.0 if loop.attitude else 0.0)
    first, last = stretch(u.time, flown(topics.columns, place, u.time), levelled, LONGEST_GAP * period)
    if last - first < 2 or u.time[last] - u.time[first] < SHORTEST:
        gaps = int((np.diff(u.time) >= LONGEST_GAP * period).sum())
        missing = (
            f"; {gaps} gaps of {1e3 * LONGEST_GAP * period:.3g} ms or more: log less, or to a faster card" if gaps else ""
        )
        raise UserError(f"{path}: {loop.command}: no {SHORTEST:g} s of uninterrupted flight in one mode{missing}")
    time = np.arange(u.time[first], u.time[last], period)
    command = np.interp(time, u.time, u.value)
    setpoint, rate = (loop.unit * value for value in (latest(r, time + 0.25 * period, 0.0), np.interp(time, y.time, y.value)))
    refuse_not_finite(path, {loop.setpoint: setpoint, loop.rate: rate, loop.command: command})
    refuse_unchanged(path, {loop.setpoint: setpoint, loop.command: command})
    around = topics.parameters.get(loop.attitude) if levelled[first] else 0.0
    if around is None:
        raise UserError(f"{path}: {loop.attitude} is not among the log's parameters")
    s: Complex = (2j * np.pi * np.fft.rfftfreq(len(time), period)[1:]).astype(np.complex128)
    big_r, big_y, big_u = (spectral(one) for one in (setpoint, rate, command))
    with errors_in(path):
        f, k = loop.transfers(topics.parameters, s)
    added, damped = (
        spectral(np.interp(time, *topics.columns[name])) if name in topics.columns else 0.0 * big_u
        for name in loop.apart or ("", "")
    )
    judged = slice(CYCLES - 1, int((np.abs(s) < np.pi / (4.0 * period)).sum()))  # an integral's ends leak into slower lines
    fed = (big_u - added - damped)[judged]

    def left(by: Complex) -> float:
        """What setpoint and rate do not explain of the command, as a share of its power."""
        rest = fed - (by * big_r - k * big_y)[judged]
        return float((np.abs(rest) ** 2).sum() / max(float((np.abs(fed) ** 2).sum()), 1e-300))

    later = [f * np.exp(-period * s)] if loop.form == "px4" else []  # stamped alike, but used after: in PX4's simulators
    f, rest = min(((by, left(by)) for by in (f, *later)), key=lambda one: one[1])
    answer = around * loop.unfiltered(topics.parameters, s) * big_y / s
    given = big_r + answer
    excitation = np.fft.irfft(np.concatenate([[0.0], f * given + added]), len(time))
    told = np.concatenate([[False], amplitudes(given) > OWN * amplitudes(answer)])
    return Excitation(
        excitation, command, period, 1.0 - rest, told, steps / 12.0**0.5, bool(levelled[first]), float(time[0]), rate
    )


def refuse_slow(path: Path, columns: str, period: float, form: str, parameters: Mapping[str, float]) -> None:
    """Raises UserError for columns that are logged too slowly, every `period` [s], up to the rounding of their stamps."""
    if not 0.0 < period <= SLOWEST * (1.0 + 1e-6):
        raise UserError(
            f"{path}: {columns}: logged every {1e3 * period:.3g} ms; margins need {1e3 * SLOWEST:g} ms or less"
            f"{faster(form, parameters)}"
        )


def faster(form: str, parameters: Mapping[str, float]) -> str:
    """What makes an autopilot log its rate loops, and faster: after a colon; nothing where that is not known."""
    if form not in LOGGING:
        return ""
    name, bit, what = LOGGING[form]
    now = parameters.get(name)
    if now is None and parameters:
        return f"; {name}, with which later releases log it, is not among the log's parameters"
    more = f", {int(now) | 1 << bit} instead of {int(now)}" if now is not None and 0.0 <= now < 2.0**31 else ""
    return f": set bit {bit} of {name} ({what}{more})" if not (more and int(now or 0) >> bit & 1) else ""


def refuse_not_finite(path: Path, signals: Mapping[str, Floats]) -> None:
    """Raises UserError unless all signals, by column, are finite."""
    if not all(np.isfinite(one).all() for one in signals.values()):
        raise UserError(f"{path}: {', '.join(signals)}: contain numbers that are not finite")


def refuse_unchanged(path: Path, signals: Mapping[str, Floats]) -> None:
    """Raises UserError unless all signals, by column, change."""
    if not all(np.ptp(one) > 0.0 for one in signals.values()):
        raise UserError(f"{path}: {', '.join(signals)}: one of them never changes; nothing was excited")


def spectral(signal: Floats) -> Complex:
    """The spectrum of a signal without its mean and trend, from the first line on."""
    line = np.linspace(-1.0, 1.0, len(signal))
    level = signal - signal.mean()
    return np.fft.rfft(level - line * float(level @ line) / float(line @ line))[1:]


def latest(series: Series | None, time: Floats, otherwise: float) -> Floats:
    """The last value that was logged by each time."""
    if series is None or not len(series.time):
        return np.full(len(time), otherwise)
    return series.value[np.maximum(np.searchsorted(series.time, time, side="right") - 1, 0)]


def flown(columns: Columns, place: int, time: Floats) -> Flags:
    """When the vehicle flies, and its autotune, if there was one, excites this axis."""
    aloft: Flags = (latest(columns.get(LANDED), time, 0.0) < 0.5) & (latest(columns.get(THROTTLE), time, 1.0) > FLYING)
    stick = columns.get(STICK)
    if stick is not None:
        up = stick.time[stick.value > RAISED]
        aloft &= (time >= up[0]) & (time <= up[-1]) if len(up) else False
    excited = columns.get(autotune(place))
    if excited is not None and (excited.value != 0.0).any():
        on = excited.time[excited.value != 0.0]
        aloft &= (time >= on[0]) & (time <= on[-1])
    return aloft


def stretch(time: Floats, wanted: Flags, same: Floats, gap: float) -> tuple[int, int]:
    """First and last sample of the longest stretch that is wanted, in which nothing changes, without a gap [s]."""
    joined = wanted[1:] & wanted[:-1] & (np.diff(same) == 0.0) & (np.diff(time) < gap)
    return max(stretches(joined), key=lambda one: time[one[1]] - time[one[0]], default=(0, 0))
