"""Random vehicles' rate loops about one axis, as PX4 or ArduPilot has them: flown all at once, with known margins."""

import math
from typing import NamedTuple

import numpy as np

from quadstep.control.filters import low_pass
from quadstep.control.px4_loops import notch, notched
from quadstep.numbers import Vector

PERIOD, LONGER = 0.001, 0.0025
"""Of PX4's loop and of ArduPilot's [s]."""


class Axis(NamedTuple):
    """Of n vehicles, each (n,): effect [rad/s^2] of the whole command, lag of the rotors [s], delay [samples]; cut-offs of the
    gyro and of the slope [Hz]; gains of rate and attitude loop; period [s]; cut-offs of setpoint and error [Hz], inf: none.
    after: 1 where, as in ArduPilot, the slope is the error's and a sample's setpoint is made after its command; 0 in PX4.
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
    period: np.ndarray
    target: np.ndarray
    error: np.ndarray
    after: np.ndarray

    @property
    def shares(self):
        """Of a new sample in rotors, slope, setpoint and error; and the filter of the gyro."""
        slope, target, error = (
            1.0 / (1.0 + 1.0 / (2.0 * math.pi * cut * self.period)) for cut in (self.slope, self.target, self.error)
        )
        return -np.expm1(-self.period / self.lag), slope, target, error, low_pass(1.0, self.cut, self.period)

    def opened(self, omega, ring=None, stops=None):
        """L at the command, attitude loop included, at frequencies [rad/s] (m,): shape (n, m). ring: of the frame; stops:
        centre and band of a notch of the gyro [Hz].
        """
        one = Axis(*(field[:, None] for field in self))
        z = np.exp(1j * omega * one.period)
        rotors, *shares, by = one.shares
        shaken = 0.0 if ring is None else Ring(*(field[:, None] for field in ring)).shaken(z, one.period)
        turn = rotors * z**-one.delay / (1.0 - (1.0 - rotors) / z) * one.effect * (one.period / (z - 1.0) + shaken)
        filtered = by.b * (1.0 + 1.0 / z) ** 2 / (1.0 + by.a1 / z + by.a2 / z**2)
        if stops is not None:
            n = notch(*(one[:, None] for one in stops), one.period)
            by_notch = (n.b0 + n.b1 / z + n.b0 / z**2) / (1.0 + n.b1 / z + n.a2 / z**2)
            filtered = filtered * np.where(n.on > 0.5, by_notch, 1.0)
        slope, target, error = (share / (1.0 - (1.0 - share) / z) for share in shares)
        sloped = one.d * slope * (1.0 - 1.0 / z) / one.period
        inner = one.p + one.i * one.period * z**one.after / (z - 1.0)
        forward = target * error * (inner + one.after * sloped) * z**-one.after
        return turn * (filtered * error * (inner + sloped) + forward * one.attitude * one.period * z / (z - 1.0))

    def scaled(self, factor):
        """With the gains of the rate loop times a factor."""
        return self._replace(p=factor * self.p, i=factor * self.i, d=factor * self.d)


class Ring(NamedTuple):
    """A resonance of the frame of n vehicles, each (n,): frequency [Hz], damping, share of the command's torque that shakes
    it, and what else does [rad/s^2], standard deviation; exponent of the throttle with which it moves, 0 but for rotors.
    """

    at: np.ndarray
    damping: np.ndarray
    by_torque: np.ndarray
    by_wind: np.ndarray
    moves: np.ndarray

    def shaken(self, z, period):
        """From an acceleration to the rate that the gyro has of it."""
        grows, omega = z - 1.0, 2.0 * math.pi * self.at * period
        return self.by_torque * period * grows / (grows**2 + 2.0 * self.damping * omega * grows + omega**2 * z)


def random_axes(random: np.random.Generator, count: int, after: bool = False) -> Axis:
    """Vehicles of all sizes, whose gains are a textbook's times a factor: some sound, some fragile, some unstable."""

    def between(low, high):
        return np.exp(random.uniform(np.log(low), np.log(high), count))

    period = LONGER if after else PERIOD
    lag, delay, cut = between(0.012, 0.07), random.integers(1, 4 if after else 8, count), between(25.0, 100.0)
    slow = lag + delay * period + 1.4 / (2.0 * math.pi * cut) + 0.5 * period
    crossover = between(0.25, 1.4) / slow
    effect = between(20.0, 400.0)
    p = crossover / effect
    d = p * random.uniform(0.0, 0.5, count) * lag
    slope, i, attitude = between(20.0, 60.0), p * crossover * between(0.02, 0.3), crossover * between(0.1, 0.3)
    same, none = np.ones(count), np.full(count, np.inf)
    target, error = (
        (between(10.0, 60.0), np.where(random.random(count) < 0.5, none, between(20.0, 80.0))) if after else (none, none)
    )
    return Axis(effect, lag, delay, cut, slope, p, i, d, attitude, period * same, target, error, after * same)


FEW = 8
"""Vehicles that are flown sooner one by one, on Python's floats: arrays of so many numbers take ten times as long as one."""


def flown(axis: Axis, wanted: np.ndarray, noise=0.0, gust=0.0, seed=0, every=4, ring=None, stops=None, throttle=None,
          limit=math.inf):  # fmt: skip
    """Setpoint, filtered rate [rad/s] and command as logged, each (samples, n), every so many periods. wanted (samples, n):
    exogenous part of the rate setpoint. noise: of the gyro [rad/s], gust: disturbance [rad/s^2], standard deviations. ring,
    stops: as in `Axis.opened`; throttle (samples,): over the usual one; limit: the largest command that motors follow.
    """
    count = len(axis.p)
    stop = None if stops is None else notch(*stops, axis.period)
    rotors, *shares, by = axis.shares
    parts = axis, (rotors, *shares), by, stop, ring, (noise, gust)
    normal = noises(np.random.default_rng(seed), 2 if ring is None else 3, count)
    if count > FEW:
        many = np.where, lambda u: np.minimum(np.maximum(u, -limit), limit), np.zeros(count), np.arange(count)
        rows = rows_of(parts, wanted, normal, every, throttle, *many)
        return tuple(np.array(column) for column in zip(*rows, strict=True))
    drawn = np.array([one for _, one in zip(wanted, normal, strict=False)]).transpose(2, 0, 1).tolist()
    one = (lambda after, yes, no: yes if after else no), (lambda u: min(max(u, -limit), limit)), 0.0, None
    turns = None if throttle is None else throttle.tolist()
    alone = [
        rows_of(picked(parts, place, count), wanted[:, place].tolist(), drawn[place], every, turns, *one)
        for place in range(count)
    ]
    return tuple(np.array(alone).transpose(2, 1, 0))


def picked(part, place, count):
    """The numbers of one of so many vehicles."""
    if isinstance(part, tuple):
        inner = [picked(one, place, count) for one in part]
        return type(part)(*inner) if hasattr(part, "_fields") else tuple(inner)
    return None if part is None else np.broadcast_to(part, count)[place].item()


def noises(random, kinds, count):
    """Of every sample (kinds, count)."""
    while True:
        yield from random.normal(size=(100, kinds, count))


def rows_of(parts, wanted, normal, every, throttle, choose, limited, zero, places):
    """What is logged, of one vehicle or of many."""
    axis, (rotors, sloping, targeting, erring), by, stop, ring, (noise, gust) = parts
    period, after = axis.period, axis.after > 0.5
    speed = rate = angle = before = slope = integral = first = second = r = aim = e = sway = shake = zero
    waiting, past = [zero] * 8, Vector([zero] * 4)
    rows = []
    for k, (w, (felt, blown, *shaken)) in enumerate(zip(wanted, normal, strict=False)):
        told = rate + shake + noise * felt
        angle = angle + period * told  # as estimators have it, from the gyro
        quiet, past = (told, past) if stop is None else notched(stop, past, told)
        new = quiet - first * by.a1 - second * by.a2
        smooth = by.b * (new + 2.0 * first + second)
        first, second = new, first
        earlier, r = r, w - axis.attitude * angle
        aim = aim + targeting * (choose(after, earlier, r) - aim)
        last, e = e, e + erring * (aim - smooth - e)
        slope = slope + sloping * (choose(after, e - last, before - smooth) / period - slope)
        before = smooth
        grown = integral + axis.i * period * e
        u = axis.p * e + choose(after, grown, integral) + axis.d * slope
        integral = grown
        waiting[k % 8] = limited(u)
        late = waiting[int(k - axis.delay) % 8] if places is None else np.array(waiting)[(k - axis.delay) % 8, places]
        speed = speed + rotors * (late - speed)
        rate = rate + period * (axis.effect * speed + gust * blown)
        if ring is not None:
            omega = 2.0 * math.pi * ring.at * (1.0 if throttle is None else throttle[k] ** ring.moves)
            push = ring.by_torque * axis.effect * speed + ring.by_wind * shaken[0]
            shake = shake + period * (push - 2.0 * ring.damping * omega * shake - omega**2 * sway)
            sway = sway + period * shake
        if k % every == 0:
            rows.append((r, smooth, u))
    return rows


def stepped(random: np.random.Generator, duration: float, size: float = 0.4, period: float = PERIOD):
    """Angles [rad] that a pilot's stick asks for, snapping to another place now and then, (samples,)."""
    time = np.arange(0.0, duration, period)
    moments = np.cumsum(random.uniform(0.3, 2.0, int(duration / 0.3) + 1))
    asked = random.uniform(-size, size, len(moments) + 1)[np.searchsorted(moments, time)]
    share, now, smooth = -math.expm1(-2.0 * math.pi * 5.0 * period), 0.0, np.empty_like(asked)
    for k, one in enumerate(asked):
        now += share * (one - now)
        smooth[k] = now
    return smooth
