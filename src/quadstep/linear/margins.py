"""Stability margins of one channel, from the factors on its command that put a sampled pole on the unit circle.

The delay margin, how much later a command may come, counts the commands under way exactly. A command that is late by whole
steps of the integrator is the command of an earlier tick, in this period or, by z^-1, in the one before; a fraction of a step
acts in proportion. With M(z) for what this adds to each tick, the loop has a pole where an eigenvalue of T(z) M(z) is 1; delay
and frequency of the first such pole on the unit circle follow by Newton's method from those that the phase margin gives.
"""

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.linear.states import Array
from quadstep.linear.transfer import FEW, Complex, OpenedLoop, eigenvalue_near, loci, loci_near, mode_frequency, transfer
from quadstep.metrics.registry import LEAST_GAIN, LEAST_PHASE

MOST_STEPS, FOUND, NUDGE = 20, 1e-10, 1e-6
"""Most steps of Newton's method; tolerance on the eigenvalue 1; relative step in delay and frequency for slopes."""

FAR = 0.2
"""A result that differs more than this from the phase margin's, as a share of it, is rejected."""


def delay_contribution(one: OpenedLoop, z: complex, delay: float) -> Complex:
    """Contribution of a delay [s] to each tick of a period, from the law's samples in it; shape (ticks, samples)."""
    hold, steps = one.hold, delay / one.step
    whole, part = int(steps), steps - int(steps)
    return (1.0 - part) * earlier(hold, z, whole) + part * earlier(hold, z, whole + 1) - hold


def earlier(hold: Array, z: complex, ticks: int) -> Complex:
    """The command held so many ticks ago."""
    periods, place = np.divmod(np.arange(len(hold)) - ticks, len(hold))
    return hold[place] * (z ** periods.astype(float))[:, None]


def excess(one: OpenedLoop, omega: float, delay: float) -> complex:
    """The eigenvalue of T M nearest to 1, less 1."""
    z = complex(np.exp(1j * omega * one.length))
    through = transfer(one, np.array([omega]), delay_contribution(one, z, delay))[0, 0]
    return eigenvalue_near(through, 1.0) - 1.0


def delay_margin(one: OpenedLoop, omega: float, by_phase: float) -> float:
    """The delay [s] of one channel's command that puts a pole on the unit circle.

    omega, by_phase: the frequency [rad/s] and the delay [s] by the phase margin.
    """
    at, delay = omega, by_phase
    for _ in range(MOST_STEPS):
        now = excess(one, at, delay)
        if abs(now) < FOUND:
            break
        by_frequency = (excess(one, at * (1.0 + NUDGE), delay) - now) / (at * NUDGE)
        by_delay = (excess(one, at, delay * (1.0 + NUDGE)) - now) / (delay * NUDGE)
        slopes = np.array([[by_frequency.real, by_delay.real], [by_frequency.imag, by_delay.imag]])
        change = np.linalg.solve(slopes, [-now.real, -now.imag])
        at, delay = at + float(change[0]), delay + float(change[1])
        if not (abs(delay - by_phase) < FAR * by_phase and abs(at - omega) < FAR * omega):
            return by_phase
    return delay


FAINT = 1e-3
"""Smaller loop gains are ignored: gain margins of more than 60 dB count as infinite."""

REAL = {0: 1e-2, -1: 1e-6}
"""Relative distance from the real axis within which a value counts as real at the lowest and at the highest frequency: in a
period one of these stands for half of the law's rate, where the loop's response is real.
"""

REFINED, ZOOMS, ZOOMED = 30, 4, 9
"""Most steps to a crossing; number of refinements of a minimum, and frequencies in each."""


class MarginLimits(NamedTuple):
    """Least margins of a sound loop: gain [dB] both ways, phase [rad], delay [s]."""

    gain: float
    phase: float
    delay: float


TEXTBOOK = MarginLimits(LEAST_GAIN, LEAST_PHASE, 0.0)
"""Without latency."""


class Margins(NamedTuple):
    """Margins of one channel; infinite where no factor, phase shift or delay makes the loop unstable.

    gain_up, gain_down: factors on the command, above and below 1. phase [rad] at phase_at [rad/s]: allowed phase shift,
    the smaller of lead and lag. delay [s]: allowed extra delay. disk: smallest |d| of a factor (1 + d/2) / (1 - d/2) (Seiler,
    Packard and Gahinet, "An introduction to disk margins", 2020, without skew). sensitivity, complementary: largest
    |1 / (1 + L)| and |L / (1 + L)|.
    """

    gain_up: float
    gain_down: float
    phase: float
    phase_at: float
    delay: float
    disk: float
    sensitivity: float
    complementary: float

    @property
    def up(self) -> float:
        """How far the gain may rise [dB]."""
        return 20.0 * math.log10(self.gain_up)

    @property
    def down(self) -> float:
        """How far the gain may fall [dB], above 0."""
        return -20.0 * math.log10(self.gain_down) if self.gain_down else math.inf


def margins(one: OpenedLoop, omega: Array, grid: Complex) -> Margins:
    """Margins of a stable loop. one: with a single channel; grid: its loci at the frequencies omega [rad/s]."""
    branches = continuous_loci(grid)
    real = list(crossings(one, omega, branches, lambda g: g.imag))
    ends = [g for end, near in REAL.items() for g in branches[end] if abs(g.imag) < near * abs(g)]
    factors = [1.0 / g.real for g in (*(g for _, g in real), *ends) if FAINT < g.real < 1.0 / FAINT]
    seen = crossings(one, omega, branches, lambda g: abs(g) - 1.0)
    signed = [(mode_frequency(one, at, g), -math.atan2(g.imag, g.real)) for at, g in seen]
    turns = [(at, turn) if at >= 0.0 else (-at, -turn) for at, turn in signed]  # at positive frequencies
    at, turn = min(turns, key=lambda one: abs(one[1]), default=(math.nan, math.inf))
    return Margins(
        gain_up=min((factor for factor in factors if factor > 1.0), default=math.inf),
        gain_down=max((factor for factor in factors if factor < 1.0), default=0.0),
        phase=abs(turn),
        phase_at=at,
        delay=min((delay_margin(one, at, -turn % (2.0 * math.pi) / at) for at, turn in turns), default=math.inf),
        disk=minimum(one, omega, grid, lambda g: np.abs(2.0 * (1.0 - g) / (1.0 + g))),
        sensitivity=1.0 / minimum(one, omega, grid, lambda g: np.abs(1.0 - g)),
        complementary=1.0 / minimum(one, omega, grid, lambda g: np.abs((1.0 - g) / g)),
    )


def continuous_loci(grid: Complex) -> Complex:
    """The loci sorted so that each continues from the previous frequency: the largest chooses first what is nearest to it."""
    rows, count = np.arange(len(grid) - 1), grid.shape[1]
    apart = np.abs(grid[1:, None, :] - grid[:-1, :, None])
    order = np.argsort(-np.abs(grid[:-1]), axis=1, kind="stable")
    onward = np.empty((len(rows), count), dtype=np.intp)
    for place in order.T:
        taken = apart[rows, place].argmin(axis=1)
        onward[rows, place] = taken
        apart[rows, :, taken] = np.inf
    places = np.empty(grid.shape, dtype=np.intp)
    places[0] = np.arange(count)
    for i, step in enumerate(onward):
        places[i + 1] = step[places[i]]
    return np.take_along_axis(grid, places, axis=1)


def crossings(
    one: OpenedLoop, omega: Array, branches: Complex, of: Callable[[Complex], NDArray[np.floating]]
) -> Iterator[tuple[float, complex]]:
    """Frequencies [rad/s] at which a branch g crosses of(g) = 0, and g there: all refined at once by regula falsi, which
    halves the value at an end that stays twice (Illinois).
    """
    signs = np.sign(of(branches))
    heard = np.maximum(np.abs(branches[:-1]), np.abs(branches[1:])) > FAINT
    places = np.nonzero((signs[:-1] * signs[1:] < 0.0) & heard)
    ats = np.array([omega[places[0]], omega[places[0] + 1]])
    ends = np.array([branches[places], branches[places[0] + 1, places[1]]])
    weights, stayed = np.ones(ats.shape), np.full(len(ats[0]), -1)
    at, g, left = ats[0].copy(), ends[0].copy(), np.arange(len(ats[0]))
    for _ in range(REFINED):
        if not len(left):
            break
        low, high = weights[:, left] * of(ends[:, left])
        share = low / (low - high)
        at[left], guesses = (pair[0, left] + share * (pair[1] - pair[0])[left] for pair in (ats, ends))
        g[left] = nearest(one, at[left], guesses)
        left = left[np.abs(of(g[left])) >= 1e-9]
        moved = np.where(of(g[left]) * of(ends[0, left]) > 0.0, 0, 1)
        stays = 1 - moved
        ats[moved, left], ends[moved, left], weights[moved, left] = at[left], g[left], 1.0
        weights[stays, left] = np.where(stayed[left] == stays, 0.5 * weights[stays, left], 1.0)
        stayed[left] = stays
    for i in np.flatnonzero(np.abs(of(g)) < 1e-4):  # at the others two branches were mistaken for one
        yield float(at[i]), complex(g[i])


def nearest(one: OpenedLoop, at: Array, guesses: Complex) -> Complex:
    """The loci of a single channel nearest to guesses, each at its own frequency [rad/s]."""
    if len(one.due) > FEW:
        return np.array([loci_near(one, at[i : i + 1], complex(guess))[0, 0] for i, guess in enumerate(guesses)])
    found = loci(one, at)[:, 0]
    return found[np.arange(len(at)), np.abs(found - guesses[:, None]).argmin(axis=1)]


def minimum(one: OpenedLoop, omega: Array, grid: Complex, of: Callable[[Complex], Array]) -> float:
    """The least of(g) over all frequencies and values: on the grid, then refined."""
    with np.errstate(all="ignore"):
        values = np.nan_to_num(of(grid), nan=np.inf)
        best, branch = (int(place) for place in np.unravel_index(values.argmin(), values.shape))
        found, g = float(values[best, branch]), complex(grid[best, branch])
        low, high = float(omega[max(best - 1, 0)]), float(omega[min(best + 1, len(omega) - 1)])
        for _ in range(ZOOMS):
            near = np.linspace(low, high, ZOOMED)
            closer = np.nan_to_num(of(loci_near(one, near, g)), nan=np.inf).min(axis=1)
            best = int(closer.argmin())
            found = min(found, float(closer[best]))
            low, high = float(near[max(best - 1, 0)]), float(near[min(best + 1, ZOOMED - 1)])
    return found
