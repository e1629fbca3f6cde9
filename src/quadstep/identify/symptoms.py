"""What a log shows besides margins: motors at their limits and which axis took them there, peaks in the gyro's spectrum and
what covers them, oscillation in descents. Each with a number and its threshold, and only where the log carries it.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.identify.changes import NOISY, Advice, loud, why_no_notch
from quadstep.identify.excited import FEWEST, LOOPS_OF, Excited, motors
from quadstep.identify.logs.flight import Flags, Floats, stretches
from quadstep.identify.measured import MeasuredLoop
from quadstep.identify.peaks import STANDS, covering_notch, highest
from quadstep.identify.rate_loops import SINKING, RateLoop
from quadstep.identify.setpoint_response import latest
from quadstep.metrics.statistics import student_quantile

OFTEN = 0.01
"""Share of time from which on motors count as often at a limit. quadstep's own choice: autopilots name none."""

MIXED = 0.8
"""Least share of what motors do apart from one another that the commands of the axes must make, so that an axis is named."""

SINKS, SHORTEST_STRETCH, LEAST_STRETCHES = 1.0, 1.0, 5
"""Sink rate of a descent [m/s]; the shortest stretch that is compared [s], and fewest descents and others."""


class Symptom(NamedTuple):
    """name: what is looked at; sentence: what was found; measured, threshold: in words; shows: above threshold."""

    name: str
    sentence: str
    measured: str
    threshold: str
    shows: bool


def symptoms(flight: Excited, now: MeasuredLoop, advice: Advice | None) -> list[Symptom]:
    """All that the log carries. now, advice: what was measured, and is advised, of its loop."""
    return [*saturation(flight), *noise(flight), *peak(flight, now, advice), *wash(flight)]


def saturation(flight: Excited) -> Iterator[Symptom]:
    """How often motors are at a limit, and what took them there."""
    loop = flight.loop
    found = loop and motors(flight, loop)
    if not loop or not found:
        return
    time, shares = found
    for name, at in (("upper", shares >= 1.0 - 1e-3), ("lower", shares <= 1e-3)):
        share = float(at.any(axis=1).mean())
        shows = share > OFTEN
        text = f"{100.0 * share:.2g} % of the time"
        said = f"A motor was at its {name} limit for {text}"
        if shows and (by := demanded(flight, loop, time, shares, at, 1.0 if name == "upper" else -1.0)):
            said += "; what drove it there: " + ", ".join(f"{one} {100.0 * part:.0f} %" for one, part in by.items())
        yield Symptom(f"motors at the {name} limit", f"{said}.", text, f"{100.0 * OFTEN:g} %", shows)


def demanded(flight: Excited, loop: RateLoop, time: Floats, shares: Floats, at: Flags, sign: float) -> dict[str, float] | None:
    """Shares of the axes, and of thrust, in what took motors to a limit, the largest first; None where the log does not tell.
    Motors answer the axes' commands linearly where none is at a limit; thrust is what the others do besides, over its median.
    """
    axes = [one for one in LOOPS_OF[loop.form] if one.command in flight.columns and len(flight.columns[one.command].time)]
    if len(axes) < 3:
        return None
    commands = np.stack([latest(flight.columns[one.command], time, 0.0) for one in axes], axis=1)
    loose = (shares > 1e-3) & (shares < 1.0 - 1e-3)
    known: Flags = np.asarray(np.isfinite(commands).all(axis=1))
    free = loose.all(axis=1) & known
    if free.sum() < FEWEST:
        return None
    apart = shares - shares.mean(axis=1, keepdims=True)
    basis = np.hstack([commands, np.ones((len(time), 1))])
    mixer, *_ = np.linalg.lstsq(basis[free], apart[free], rcond=None)
    rest = apart[free] - basis[free] @ mixer
    if (rest**2).sum() > (1.0 - MIXED) * ((apart[free] - apart[free].mean(axis=0)) ** 2).sum():
        return None
    alike = (shares > 0.5).all(axis=1, keepdims=True) | (shares < 0.5).all(axis=1, keepdims=True)
    heard = loose | (~loose.any(axis=1, keepdims=True) & alike)  # all at one limit tell thrust, at both they do not
    level = np.where(heard, shares - loose * (basis @ mixer), 0.0).sum(axis=1) / np.maximum(heard.sum(axis=1), 1)
    level[~heard.any(axis=1)] = np.median(level)
    pushes = [commands[:, [place]] * mixer[place] for place in range(3)] + [(level - np.median(level))[:, None] + 0.0 * apart]
    held = known[:, None] & at
    sums = [float(np.maximum(sign * one[held], 0.0).sum()) for one in pushes]
    if sum(sums) <= 0.0:
        return None
    names = [*(one.axis for one in axes), "thrust"]
    return dict(sorted(((name, one / sum(sums)) for name, one in zip(names, sums, strict=True)), key=lambda one: -one[1]))


def noise(flight: Excited) -> Iterator[Symptom]:
    """RMS above the excited frequencies: of the gyro, of the D part of the command, and of the command."""
    loop = flight.loop
    if loop is None or flight.rate is None:
        return
    omega = 2.0 * math.pi * np.fft.rfftfreq(len(flight.rate), flight.period)
    above = omega > flight.beyond
    gyro = np.fft.rfft(flight.rate - flight.rate.mean())[above]
    share = loud(flight)
    text = f"gyro {rms(gyro, len(flight.rate)):.2g} rad/s"
    slope = f"{loop.stem}D"
    if flight.parameters.get(slope, 0.0) > 0.0:
        s = (1j * omega[above]).astype(np.complex128)
        d = loop.transfers(flight.parameters, s)[1] - loop.transfers({**flight.parameters, slope: 0.0}, s)[1]
        text += f", D part {100.0 * rms(d * gyro, len(flight.rate)) / loop.whole:.2g} % of the whole command"
    text += f", command {100.0 * share:.2g} %"
    said = f"Noise above the excited frequencies (RMS): {text}."
    yield Symptom("noise", said, text, f"{100.0 * NOISY:g} % of the whole command", share > NOISY)


def rms(lines: NDArray[np.complex128], count: int) -> float:
    """Of what lines of the spectrum of so many samples make, without the mean."""
    return math.sqrt(2.0 * float((np.abs(lines) ** 2).sum())) / count


def peak(flight: Excited, now: MeasuredLoop, advice: Advice | None) -> Iterator[Symptom]:
    """The highest peak in the gyro's spectrum above the excited frequencies, and why no notch is advised, if none is."""
    found = highest(flight)
    if flight.loop is None or found is None:
        return
    at, shows = found.at, found.tall > STANDS
    text = f"{found.tall:.0f} dB at {at:.3g} Hz"
    said = f"Above the excited frequencies no peak of the gyro's spectrum rises {STANDS:g} dB above its surroundings"
    if shows:
        alias = f"such as {1.0 / flight.period - at:.3g} Hz, since the log has a sample every {1e3 * flight.period:.3g} ms"
        why = why_no_notch(flight, found, now, advice)
        said = f"The gyro's spectrum has a peak at {at:.3g} Hz, {found.tall:.0f} dB above its surroundings: "
        said += f"a resonance or rotors, at that frequency or an alias of it, {alias}; " if why else "a resonance; "
        said += (
            f"{covering_notch(flight.loop, flight.parameters, at)}; {f'none is advised: {why}' if why else 'one is advised'}"
        )
    yield Symptom("peak of the gyro", f"{said}.", text, f"{STANDS:g} dB", shows)


def wash(flight: Excited) -> Iterator[Symptom]:
    """How much stronger what no setpoint explains is in descents than elsewhere."""
    name = flight.loop and SINKING.get(flight.loop.form)
    if not name or name not in flight.columns:
        return
    time: Floats = flight.begin + flight.period * np.arange(len(flight.command), dtype=np.float64)
    sinks = latest(flight.columns[name], time, 0.0)
    rest = unexplained(flight)
    descents, others = (levels(rest, flight.period, one) for one in (sinks > SINKS, sinks < 0.5 * SINKS))
    if min(len(descents), len(others)) < LEAST_STRETCHES:
        return
    parts = [float(one.var(ddof=1)) / len(one) for one in (descents, others)]
    error = math.sqrt(sum(parts))
    counts = len(descents), len(others)
    freedom = sum(parts) ** 2 / max(sum(part**2 / (count - 1) for part, count in zip(parts, counts, strict=True)), 1e-300)
    middle, half = float(descents.mean() - others.mean()), student_quantile(0.975, freedom) * error
    low, value, high = (math.exp(one) for one in (middle - half, middle, middle + half))
    text = f"{value:.2g} times ({low:.2g} to {high:.2g})"
    shows = low > 1.0
    said = (
        f"In descents of more than {SINKS:g} m/s the part of the command that no setpoint explains is {text} that of the rest"
    )
    more = ": propeller wash, or gusts met there" if shows else ": it shows no propeller wash"
    yield Symptom("oscillation in descents", f"{said}{more}.", text, "1, at the lower end of the interval", shows)


def levels(rest: Floats, period: float, wanted: Flags) -> Floats:
    """Logarithms of the RMS in each stretch that is wanted and long enough, each one sample: gusts come in spells."""
    found = [rest[first:past] for first, past in stretches(wanted) if (past - first) * period >= SHORTEST_STRETCH]
    return np.array([0.5 * math.log(float(np.mean(one**2)) + 1e-300) for one in found])


def unexplained(flight: Excited) -> Floats:
    """What the excitation does not explain of the command (n,), within the excited frequencies."""
    omega = 2.0 * math.pi * np.fft.rfftfreq(len(flight.command), flight.period)
    d, u = (np.fft.rfft(one - one.mean()) for one in (flight.excitation, flight.command))
    found = flight.measured
    parts = [np.interp(omega, found.omega, one) for one in (found.sensitivity.real, found.sensitivity.imag)]
    heard = (omega >= found.omega[0]) & (omega <= found.omega[-1])
    return np.fft.irfft(np.where(heard, u - (parts[0] + 1j * parts[1]) * d, 0.0), len(flight.command))
