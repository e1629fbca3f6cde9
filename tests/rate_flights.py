"""Random vehicles' rate loops about one axis, as PX4 has them: flown all at once, sample by sample, with known margins."""

import math
from typing import NamedTuple

import numpy as np

from quadstep.control.low_pass import low_pass

PERIOD = 0.001
"""Of the loop [s]."""


class Axis(NamedTuple):
    """Of n vehicles, each (n,): effect [rad/s^2] of the whole command, lag of the rotors [s], delay [samples]; cut-offs of the
    gyro and of its slope [Hz]; gains of rate and attitude loop.
    """

    effect: np.ndarray
    lag: np.ndarray
    delay: np.ndarray
    cut: np.ndarray
    slope: np.ndarray
    p: np.ndarray
    i: np.ndarray
    d: np.ndarray
    attitude: np.ndarray

    @property
    def shares(self):
        """Of a new sample in the rotors, and in the slope; and the filter of the gyro."""
        step = 2.0 * math.pi * self.slope * PERIOD
        return -np.expm1(-PERIOD / self.lag), step / (1.0 + step), low_pass(1.0, self.cut, PERIOD)

    def opened(self, omega):
        """L at the command, attitude loop included, at frequencies [rad/s] (m,): shape (n, m)."""
        one = Axis(*(field[:, None] for field in self))
        z = np.exp(1j * omega * PERIOD)
        rotors, share, by = one.shares
        turn = rotors * z**-one.delay / (1.0 - (1.0 - rotors) / z) * PERIOD * one.effect / (z - 1.0)
        filtered = by.b * (1.0 + 1.0 / z) ** 2 / (1.0 + by.a1 / z + by.a2 / z**2)
        slope = share / (1.0 - (1.0 - share) / z) * (1.0 - 1.0 / z) / PERIOD
        inner = one.p + one.i * PERIOD / (z - 1.0)
        return turn * (filtered * (inner + one.d * slope) + inner * one.attitude * PERIOD * z / (z - 1.0))

    def scaled(self, factor):
        """With the gains of the rate loop times a factor."""
        return self._replace(p=factor * self.p, i=factor * self.i, d=factor * self.d)


def random_axes(random: np.random.Generator, count: int) -> Axis:
    """Vehicles of all sizes, whose gains are a textbook's times a factor: some sound, some fragile, some unstable."""

    def between(low, high):
        return np.exp(random.uniform(np.log(low), np.log(high), count))

    lag, delay, cut = between(0.012, 0.07), random.integers(1, 8, count), between(25.0, 100.0)
    slow = lag + delay * PERIOD + 1.4 / (2.0 * math.pi * cut) + 0.5 * PERIOD
    crossover = between(0.25, 1.4) / slow
    effect = between(20.0, 400.0)
    p = crossover / effect
    d = p * random.uniform(0.0, 0.5, count) * lag
    return Axis(
        effect, lag, delay, cut, between(20.0, 60.0), p, p * crossover * between(0.02, 0.3), d, crossover * between(0.1, 0.3)
    )


def flown(axis: Axis, wanted: np.ndarray, noise=0.0, gust=0.0, seed=0, every=4):
    """Setpoint, filtered rate [rad/s] and command, each (samples, n), every so many periods. wanted (samples, n): exogenous
    part of the rate setpoint. noise: of the gyro [rad/s], gust: disturbance [rad/s^2], standard deviations at each sample.
    """
    random = np.random.default_rng(seed)
    count = len(axis.p)
    rotors, share, by = axis.shares
    speed, rate, angle, before, slope, integral, first, second = (np.zeros(count) for _ in range(8))
    waiting = np.zeros((8, count))
    rows = []
    for k, w in enumerate(wanted):
        told = rate + noise * random.normal(size=count)
        angle = angle + PERIOD * told  # as estimators have it, from the gyro
        new = told - first * by.a1 - second * by.a2
        smooth = by.b * (new + 2.0 * first + second)
        first, second = new, first
        slope += share * ((smooth - before) / PERIOD - slope)
        before = smooth
        r = w - axis.attitude * angle
        u = axis.p * (r - smooth) + integral - axis.d * slope
        integral = integral + axis.i * PERIOD * (r - smooth)
        waiting[k % 8] = u
        speed += rotors * (waiting[(k - axis.delay) % 8, np.arange(count)] - speed)
        rate = rate + PERIOD * (axis.effect * speed + gust * random.normal(size=count))
        if k % every == 0:
            rows.append((r, smooth, u))
    return tuple(np.array(column) for column in zip(*rows, strict=True))


def stepped(random: np.random.Generator, duration: float, size: float = 0.4):
    """Angles [rad] that a pilot's stick asks for, snapping to another place now and then, (samples,)."""
    time = np.arange(0.0, duration, PERIOD)
    moments = np.cumsum(random.uniform(0.3, 2.0, int(duration / 0.3) + 1))
    asked = random.uniform(-size, size, len(moments) + 1)[np.searchsorted(moments, time)]
    share, now, smooth = -math.expm1(-2.0 * math.pi * 5.0 * PERIOD), 0.0, np.empty_like(asked)
    for k, one in enumerate(asked):
        now += share * (one - now)
        smooth[k] = now
    return smooth
