"""The delay margin of the sampled loop: how much later a command may come, with the commands under way counted exactly.

A command that is late by whole steps of the integrator is the command of an earlier tick, in this period or, by z^-1, in the
one before; a fraction of a step acts in proportion. With M(z) for what this adds to each tick, the loop has a pole where
an eigenvalue of T(z) M(z) is 1; delay and frequency of the first such pole on the unit circle follow by Newton's method from
those that the phase margin gives.
"""

import numpy as np

from quadstep.linear.states import Array
from quadstep.linear.transfer import Complex, Opened, eigenvalue_near, transfer

MOST_STEPS, FOUND, NUDGE = 20, 1e-10, 1e-6
"""Most steps of Newton's method; tolerance on the eigenvalue 1; relative step in delay and frequency for slopes."""

FAR = 0.2
"""A result that differs more than this from the phase margin's, as a share of it, is rejected."""


def added(one: Opened, z: complex, delay: float) -> Complex:
    """Contribution of a delay [s] to each tick of a period, from the law's samples in it; shape (ticks, samples)."""
    hold, steps = one.hold, delay / one.step
    whole, part = int(steps), steps - int(steps)
    return (1.0 - part) * earlier(hold, z, whole) + part * earlier(hold, z, whole + 1) - hold


def earlier(hold: Array, z: complex, ticks: int) -> Complex:
    """The command held so many ticks ago."""
    periods, place = np.divmod(np.arange(len(hold)) - ticks, len(hold))
    result: Complex = hold[place] * (z ** periods.astype(float))[:, None]
    return result


def excess(one: Opened, omega: float, delay: float) -> complex:
    """The eigenvalue of T M nearest to 1, less 1."""
    z = complex(np.exp(1j * omega * one.length))
    through = transfer(one, np.array([omega]), added(one, z, delay))[0, 0]
    return eigenvalue_near(through, 1.0) - 1.0


def delay_margin(one: Opened, omega: float, by_phase: float) -> float:
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
