"""Peaks of the gyro's spectrum above the excited frequencies: how tall and wide they are, what covers them, whether they move
with the throttle, and why a fixed notch would not fit them.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from quadstep.identify.excited import FEWEST, Excited, motors
from quadstep.identify.logs.flight import Floats, spectrum
from quadstep.identify.rate_loops import RateLoop, notches
from quadstep.identify.response import Complex
from quadstep.identify.setpoint_response import EXPLAINED
from quadstep.metrics.statistics import Estimate, student_quantile

STANDS, AROUND, BESIDE, FEWEST_LINES = 10.0, 0.3, 0.06, 4
"""Least height of a peak over its surroundings [dB]; how far these reach, and how wide a peak may be, as shares of its
frequency; fewest lines on each side. What noise alone reaches is counted in tests/challenge/symptoms.py.
"""

WINDOW, CLEAR, FEWEST_WINDOWS = 1.0, 12.0, 20
"""Length of the windows in which a peak is followed [s], how far it must stand over their median to count [dB] (noise alone
reaches it in one window of a thousand), and the fewest windows that tell how it moves.
"""

MOVES = 0.25
"""Exponent of the throttle with which a peak moves from which on rotors make it: theirs lies between 0.5 (the throttle is a
thrust) and 1 (a speed), a resonance's is 0. Halfway.
"""

EVERY_SAMPLE = 0.9
"""A log with this share of the loop's samples, or more, holds all: what it shows is no alias that the log made."""


class Peak(NamedTuple):
    """at: of its highest line [Hz], tall: over its surroundings [dB]. middle, width: between the quarters of its power [Hz],
    the half-power bandwidth of a resonance.
    """

    at: float
    tall: float
    middle: float
    width: float


def highest(flight: Excited) -> Peak | None:
    """The tallest peak above the excited frequencies, significant or not; None where the log has no spectrum there."""
    if flight.loop is None or flight.rate is None or len(flight.rate) < FEWEST:
        return None
    frequencies, density = spectrum(flight.rate[:, None], flight.period, min(2048, len(flight.rate) // 8))
    power = density[:, 0] ** 2
    places = np.flatnonzero(frequencies > flight.beyond / (2.0 * math.pi))
    tall, place = max(((height(frequencies, power, int(one)), int(one)) for one in places), default=(-math.inf, 0))
    if not math.isfinite(tall):
        return None
    at = float(frequencies[place])
    near = np.abs(frequencies / at - 1.0) < 2.0 * BESIDE
    beside = np.median(power[(np.abs(frequencies / at - 1.0) < AROUND) & (np.abs(frequencies / at - 1.0) > BESIDE)])
    own = np.cumsum(np.maximum(power[near] - beside, 0.0))
    low, middle, high = np.interp(np.array([0.25, 0.5, 0.75]) * own[-1], own, frequencies[near])
    return Peak(at, tall, float(middle), max(float(high - low), float(frequencies[0])))


def height(frequencies: Floats, power: Floats, place: int) -> float:
    """How far a line stands over its surroundings, the higher of both sides [dB]; -inf where these are too few, or where it is
    not the highest nearby.
    """
    off = (frequencies - frequencies[place]) / frequencies[place]
    sides = [power[(sign * off > BESIDE) & (sign * off < AROUND)] for sign in (-1.0, 1.0)]
    if min(map(len, sides)) < FEWEST_LINES or power[place] < power[np.abs(off) <= BESIDE].max():
        return -math.inf
    return 10.0 * math.log10(float(power[place]) / max(*(float(np.median(one)) for one in sides), 1e-300))


def covering_notch(loop: RateLoop, parameters: Mapping[str, float], at: float) -> str:
    """Which notch of the parameters covers a frequency [Hz], in words."""
    found = notches(loop.form, parameters)
    covers = next((one for one in found if one.low <= at <= one.high), None)
    if covers is None:
        return f"no notch of the log's parameters covers {at:.3g} Hz"
    return f"{covers.name} {'may follow' if covers.follows else 'covers'} {at:.3g} Hz"


def unfit(flight: Excited, peak: Peak) -> str:
    """Why a fixed notch would not fit a peak, whatever the margins; empty where it would."""
    loop = flight.loop
    assert loop
    return unset(flight, loop, peak) or strange(flight, loop, peak) or adrift(flight, loop, peak)


def unset(flight: Excited, loop: RateLoop, peak: Peak) -> str:
    """Why the autopilot has no notch for a peak."""
    parameters = flight.parameters
    if any(one.low <= peak.at <= one.high for one in notches(loop.form, parameters)):
        return "one covers it already"
    if not loop.notches.stems:
        return f"how notches of {loop.form} change the loop is not modelled"
    if free_notch(loop, parameters) is None:
        wanted = ", ".join(f"{one}{loop.notches.off}" for one in loop.notches.stems)
        return f"of {wanted} the log's parameters have none that is 0"
    return ""


def strange(flight: Excited, loop: RateLoop, peak: Peak) -> str:
    """Why a peak may lie elsewhere, or not be the gyro's in the command."""
    name = loop.notches.rate
    rate = flight.parameters.get(name, 0.0)
    if not 0.0 < EVERY_SAMPLE * rate <= 1.0 / flight.period:
        known = f"{name} is {rate:g} Hz" if rate > 0.0 else f"{name} is not among its parameters"
        return f"an alias is not excluded, since the log has {1.0 / flight.period:.3g} samples a second and {known}"
    made = power_from_gyro(flight, loop, peak)
    if made < EXPLAINED:
        share = f"{100.0 * max(made, 0.0):.0f} %, less than {100.0 * EXPLAINED:g} %,"
        return f"the gains explain {share} of the command there"
    return ""


def adrift(flight: Excited, loop: RateLoop, peak: Peak) -> str:
    """Why a peak may not stay in its place."""
    slope = throttle_dependence(flight, loop, peak)
    if slope is None:
        return "the log does not show whether it moves with the throttle (for that it needs the motors and a varying throttle)"
    spelled = f"the throttle to the power of {slope.value:.2f} ({slope.low:.2f} to {slope.high:.2f})"
    if slope.low > MOVES:
        return f"it moves with {spelled}, as rotors do"
    return f"it may move with {spelled}: vary the throttle more in flight" if slope.high >= MOVES else ""


def free_notch(loop: RateLoop, parameters: Mapping[str, float]) -> str | None:
    """The first notch that is off, by what its names begin with."""
    names = loop.notches
    return next((one for one in names.stems if parameters.get(f"{one}{names.off}") == 0.0), None)


def power_from_gyro(flight: Excited, loop: RateLoop, peak: Peak) -> float:
    """The share of the command's power at a peak that the gains make of the gyro."""
    assert flight.rate is not None
    window = np.hanning(len(flight.rate))
    y, u = (np.fft.rfft(window * (one - one.mean())) for one in (flight.rate, flight.command))
    frequencies = np.fft.rfftfreq(len(flight.rate), flight.period)
    band = np.abs(frequencies - peak.middle) <= peak.width
    turned = np.exp(-2j * math.pi * frequencies[band] * flight.period)
    s: Complex = (1.0 - turned) / flight.period  # as the loop differentiates, sums and filters from sample to sample
    rest = u[band] + loop.transfers(flight.parameters, s)[1] * y[band]
    return 1.0 - float((np.abs(rest) ** 2).sum() / max(float((np.abs(u[band]) ** 2).sum()), 1e-300))


def throttle_dependence(flight: Excited, loop: RateLoop, peak: Peak) -> Estimate | None:
    """The power of the throttle, the mean of all motors, with which a peak's frequency goes, with its 95 % interval."""
    found = motors(flight, loop)
    if found is None or flight.rate is None:
        return None
    time, throttle = found[0], found[1].mean(axis=1)
    count = round(WINDOW / flight.period)
    rows = []
    for first in range(0, len(flight.rate) - count + 1, count):
        begin = flight.begin + first * flight.period
        held = throttle[(time >= begin) & (time < begin + WINDOW)]
        piece = flight.rate[first : first + count]
        frequencies, density = spectrum(piece[:, None], flight.period, count)
        near = np.abs(frequencies / peak.at - 1.0) < AROUND
        power = density[near, 0] ** 2
        if len(held) and held.mean() > 0.0 and power.max() > 10.0 ** (0.1 * CLEAR) * np.median(power):
            rows.append((math.log(held.mean()), math.log(frequencies[near][power.argmax()])))
    if len(rows) < FEWEST_WINDOWS:
        return None
    x, y = (column - column.mean() for column in np.array(rows).T)
    spread = float(x @ x)
    if spread < 1e-12:
        return None
    slope = float(x @ y) / spread
    # the resolution of a window counts as its own error: a line that never leaves its place has one too
    error = max(float(((y - slope * x) ** 2).sum()) / (len(rows) - 2), (1.0 / (WINDOW * peak.at)) ** 2 / 12.0)
    half = student_quantile(0.975, len(rows) - 2) * math.sqrt(error / spread)
    return Estimate(slope, slope - half, slope + half)
