"""The open loop measured in flight: frequency responses from an excitation, by the local polynomial method.

An excitation d is added to a controller's command c, so that the actuators receive u = c + d. Then S = u / d is the loop's
sensitivity 1 / (1 + L), and L = 1 / S - 1 its open loop at that command, outer loops included, whatever the controller is: it
is opened where `quadstep linear` opens it. Feedback does not touch d: disturbances make S uncertain but do not bias it.

Around each frequency S and the transient are taken as polynomials of the second degree (Pintelon and Schoukens, "System
Identification: A Frequency Domain Approach", 2nd edition, 2012, chapter 7); what is left is noise, which gives the interval.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.identify.logs.flight import Flags, Floats, stretches
from quadstep.metrics.statistics import Estimate, student_quantile

Complex = NDArray[np.complex128]

DEGREE = 2
"""Of the polynomials."""

WIDTH = 0.06
"""Half of the band around a frequency, as a share of it."""

FEWEST, MOST = 8, 60
"""Fewest and most lines of the spectrum on each side of a frequency."""

CYCLES = 20
"""Fewest cycles of a frequency in the record: of slower ones, what was going on at its ends drowns the response."""

POINTS = 160
"""Frequencies at which the response is computed."""

NEAR = 6
"""Frequencies on each side over which slopes are taken."""

BESIDE = 2
"""Neighbours of a frequency on each side with which it is judged."""

VAGUE = 0.5
"""Standard deviation of L, as a share of it, from which on it is not told."""

FREE = 0.3
"""At the highest frequencies the loop no longer answers, and the command is the excitation: largest distance of S from 1."""

EVEN = 0.1
"""Frequencies count as excited where the excitation's smoothed amplitude is above this share of its largest."""

INEXACT = 0.005
"""Standard deviation of a sensitivity, as a share of it, that stays without any noise: a vehicle that is moved about is not at
rest, where the loop has one response.
"""

UNSURE = math.radians(10.0)
"""Half of a phase margin's interval from which on it counts as undetermined [rad]."""


class Response(NamedTuple):
    """The sensitivity measured at n frequencies. omega [rad/s]; sensitivity: complex; error: the standard deviation of its
    real and of its imaginary part; freedom: degrees of freedom behind it; coherence: share of the command's power that the
    excitation explains. rising: whether |L| is known to grow towards frequencies below these. late: standard deviation of
    the excitation's time [s], which the error holds.
    """

    omega: Floats
    sensitivity: Complex
    error: Floats
    freedom: Floats
    coherence: Floats
    rising: bool = False
    late: float = 0.0

    @property
    def opened(self) -> Complex:
        return 1.0 / self.sensitivity - 1.0

    @property
    def opened_error(self) -> Floats:
        """The standard deviation of its real and of its imaginary part: |dL| = |dS| / |S|^2."""
        return self.error / np.abs(self.sensitivity) ** 2

    def coherent(self, least: float, told: Flags) -> "Response":
        """The widest stretch that is told and whose coherence is above `least`. Where its upper end no longer answers the loop
        (S near 1), it ends there: what is coherent beyond is noise that the excitation holds too.
        """
        first, last = longest(told & (typical(self.coherence) > least), self.omega)
        free = np.flatnonzero(typical(np.abs(self.sensitivity - 1.0))[first : last + 1] < FREE)
        last = first + int(free[-1]) if len(free) else last
        return self.only(first, last)

    def only(self, first: int, last: int) -> "Response":
        kept = slice(first, last + 1)
        return self._replace(**{name: getattr(self, name)[kept] for name in self._fields[:5]})

    def blurred(self, late: float) -> "Response":
        """With the error of an excitation whose time is uncertain by a standard deviation [s], up to where L is told."""
        found = self._replace(error=np.hypot(self.error, np.abs(self.sensitivity) * self.omega * late), late=late)
        told = np.flatnonzero(typical(found.opened_error / np.abs(found.opened)) < VAGUE)
        return found.only(0, int(told[-1]) if len(told) else -1)

    def scaled(self, factor: float | Complex) -> "Response":
        """With the controller times a factor, or times one at each frequency."""
        opened = factor * self.opened
        sensitivity = 1.0 / (1.0 + opened)
        return self._replace(sensitivity=sensitivity, error=np.abs(factor) * self.opened_error * np.abs(sensitivity) ** 2)


class Crossing(NamedTuple):
    """Where a response crosses a line: at [rad/s], and what is measured there, with 95 % intervals."""

    at: Estimate
    value: Estimate


def amplitudes(spectrum: Complex) -> Floats:
    """Of the lines of a spectrum, smoothed over a tenth of the frequency."""
    power = np.concatenate([[0.0], np.cumsum(np.abs(spectrum) ** 2)])
    line = np.arange(len(spectrum))
    low, high = (np.clip(np.round(line * factor).astype(int), 0, len(line) - 1) for factor in (0.95, 1.05))
    return np.sqrt((power[high + 1] - power[low]) / (high + 1 - low))


def band(spectrum: Complex) -> tuple[int, int]:
    """First and last line of the longest excited stretch."""
    smooth = amplitudes(spectrum)
    return longest(smooth > EVEN * smooth.max(), np.maximum(np.arange(len(smooth)), 1))


def longest(heard: Flags, at: Floats | NDArray[np.int_]) -> tuple[int, int]:
    """First and last of the stretch that is heard over the widest ratio of frequencies; the last before the first: nowhere."""
    first, past = max(stretches(heard), key=lambda one: at[one[1] - 1] / at[one[0]], default=(0, 0))
    return first, past - 1


def typical(values: Floats) -> Floats:
    """Medians over neighbours."""
    if not len(values):
        return values
    padded = np.pad(values, BESIDE, "edge")
    return np.median(np.lib.stride_tricks.sliding_window_view(padded, 2 * BESIDE + 1), axis=1)


def response(
    excitation: Floats, command: Floats, period: float, least: float = 0.0, lines_told: Flags | None = None
) -> Response:
    """The sensitivity from samples (n,) of the excitation and of the command that holds it, a period [s] apart, where it is
    excited. lines_told: where the spectrum of an excitation that was not made to be one is not noise; it counts as far as its
    coherence is above `least`.
    """
    count = len(excitation)
    d, u = (np.fft.rfft(one - one.mean()) for one in (excitation, command))
    first, last = band(d) if lines_told is None else (1, len(d))
    first, last = max(first, CYCLES), min(last, len(d) - FEWEST - 1)
    lines = np.unique(np.round(np.geomspace(first, max(last, first + 1), POINTS)).astype(int))
    rows = [local(d, u, int(line)) for line in lines]
    sensitivity, error, freedom, coherence = (np.array(column) for column in zip(*rows, strict=True))
    found = Response(2.0 * math.pi * lines / (count * period), sensitivity, error, freedom, coherence)
    return found if lines_told is None else found.coherent(least, lines_told[lines])


def halves(lines: Floats) -> Floats:
    """Of how many lines of the spectrum on each side the response at each of some is made (n,)."""
    return np.clip(np.round(WIDTH * lines), FEWEST, MOST)


def local(d: Complex, u: Complex, line: int) -> tuple[complex, float, float, float]:
    """The response at one line of the spectra, the standard deviation of each of its parts, degrees of freedom, coherence."""
    half = int(halves(np.array([float(line)]))[0])
    place = np.arange(max(line - half, 1), min(line + half, len(d) - 1) + 1)
    powers = ((place - line) / half)[:, None] ** np.arange(DEGREE + 1)
    matrix = np.concatenate([powers * d[place, None], powers * np.abs(d[place]).mean()], axis=1)
    inverse = np.linalg.pinv(matrix)
    solution = inverse @ u[place]
    rest = u[place] - matrix @ solution
    freedom = len(place) - matrix.shape[1]
    noise = float((np.abs(rest) ** 2).sum()) / freedom
    spread = float((np.abs(inverse[0]) ** 2).sum()) * noise
    power = float((np.abs(u[place]) ** 2).mean())
    error = math.hypot(math.sqrt(0.5 * spread), INEXACT * abs(solution[0]))
    return complex(solution[0]), error, 2.0 * freedom, max(0.0, 1.0 - noise / max(power, 1e-300))


def interval(value: float, error: float, freedom: float) -> Estimate:
    half = student_quantile(0.975, freedom) * error
    return Estimate(value, value - half, value + half)


def crossovers(response: Response) -> list[Crossing]:
    """Where |L| crosses 1, and the phase margin there [rad], the phase of L above -180 degrees."""
    level, phase = np.log(np.abs(response.opened)), np.unwrap(np.angle(-response.opened))
    seen = zeros(response, level, np.flatnonzero(np.diff(level > 0.0)), level, phase)
    return joined([Crossing(grown(at), interval(math.remainder(margin, 2.0 * math.pi), *off)) for at, margin, *off in seen])


def zeros(
    response: Response, over: Floats, places: NDArray[np.intp], along: Floats, read: Floats
) -> Iterator[tuple[Estimate, float, float, float]]:
    """For each place at which `over` crosses zero: the logarithm of the frequency, what is read there, the error of that, and
    its degrees of freedom. along: `over`, but without jumps by whole turns.

    The error along the crossing counts too: a loop gain that is off moves the crossing, and the phase with it.
    """
    x, relative = np.log(response.omega), response.opened_error / np.abs(response.opened)
    for i in places:
        share = float(over[i] / (over[i] - over[i + 1]))
        near = slice(max(i - NEAR, 0), i + NEAR + 2)
        slope, turn = (float(np.polyfit(x[near], one[near], 1)[0]) for one in (along, read))
        at, value, error = (float(one[i] + share * (one[i + 1] - one[i])) for one in (x, read, relative))
        freedom, steep = float(response.freedom[i]), max(abs(slope), 1e-9)
        yield interval(at, error / steep, freedom), value, error * math.hypot(1.0, turn / steep), freedom


def grown(logarithm: Estimate) -> Estimate:
    return Estimate(*(math.exp(min(one, 700.0)) for one in logarithm))


def joined(crossings: list[Crossing]) -> list[Crossing]:
    """Crossings whose intervals of frequency overlap as one, at their mean, with an interval that holds all of theirs: noise
    makes several of a single one.
    """
    groups: list[list[Crossing]] = []
    for one in sorted(crossings, key=lambda one: one.at.value):
        if groups and max(other.at.high for other in groups[-1]) > one.at.low:
            groups[-1].append(one)
        else:
            groups.append([one])
    return [Crossing(hull([one.at for one in group]), hull([one.value for one in group])) for group in groups]


def hull(several: list[Estimate]) -> Estimate:
    """Their mean, and an interval that holds theirs."""
    return Estimate(
        float(np.mean([one.value for one in several])), min(one.low for one in several), max(one.high for one in several)
    )


def gain_margins(response: Response) -> list[Crossing]:
    """Where the phase of L crosses -180 degrees, and by which factor the gain may grow there until the loop is unstable; below
    1 by which it may fall.
    """
    level, phase = np.log(np.abs(response.opened)), np.unwrap(np.angle(-response.opened))
    off = phase - 2.0 * math.pi * np.round(phase / (2.0 * math.pi))
    places = np.flatnonzero(np.diff(off > 0.0) & (np.abs(np.diff(off)) < math.pi))
    seen = zeros(response, off, places, phase, level)
    return joined([Crossing(grown(at), grown(interval(-gain, *error))) for at, gain, *error in seen])


def margin(crossings: list[Crossing]) -> Crossing | None:
    """The crossing with the smallest phase margin, of those where it is determined; None if there is none."""
    told = [one for one in crossings if determined(one)]
    return min(told, key=lambda one: abs(one.value.value), default=None)


def determined(one: Crossing) -> bool:
    """Whether the phase margin at a crossing is known closely enough to act upon."""
    return one.value.high - one.value.low < 2.0 * UNSURE
