"""Low-pass filters, sampled, as autopilots filter gyros and D parts: of first order, and Butterworth's of second."""

import math
from typing import NamedTuple

from quadstep.numbers import Number, Vector, cos, sin, vector, where


def share_of(cut: Number, period: Number) -> Number:
    """Of a new sample in a low-pass filter of first order. cut: its cut-off [Hz]; 0: no filter."""
    some = cut > 0.0
    return where(some, period / (period + 1.0 / (2.0 * math.pi * where(some, cut, 1.0))), 1.0)


class LowPass(NamedTuple):
    """Coefficients by the bilinear transform, right at the cut-off. on: above 0.5, or it does nothing."""

    on: Number
    b: Number
    a1: Number
    a2: Number


def low_pass(on: Number, cut: Number, period: Number) -> LowPass:
    """cut: its cut-off [Hz]."""
    angle = math.pi * cut * period
    tangent = sin(angle) / cos(angle)
    square = tangent * tangent
    over = 1.0 + math.sqrt(2.0) * tangent + square
    return LowPass(on, square / over, 2.0 * (square - 1.0) / over, (1.0 - math.sqrt(2.0) * tangent + square) / over)


def smoothed(by: LowPass, delays: Vector, value: Number) -> tuple[Number, Vector]:
    """One sample, and the new delays, shape (2,): direct form II."""
    first, second = delays
    new = value - first * by.a1 - second * by.a2
    smooth = new * by.b + first * (2.0 * by.b) + second * by.b
    return where(by.on > 0.5, smooth, value), vector(new, first)
