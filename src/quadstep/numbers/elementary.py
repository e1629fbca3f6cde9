"""sin, cos, exp, sigmoid, log and atan2: of each what laws call, its steps, its enclosure, and its other rules.

Steps are written once for every kind of number from operations that IEEE 754 fixes to the bit: sums, products, quotients,
comparisons and `where` in the order written here, and four steps on the bits of a number. So the same argument gives the same
bits on every engine, processor and compiler. Each function is a reduction to a short interval and a polynomial there
(`operation.py`). Largest errors in units of the last place, measured without fused operations:
docs/decisions/0012-equal-bits.md.

A further function is one more such section here, and a name in `__all__`.
"""

import math
from fractions import Fraction

import numpy as np

from quadstep.numbers.affine import (
    ELEMENTARY,
    REDUCED,
    TINY,
    Array,
    Enclosure,
    Operand,
    Third,
    UndefinedError,
    added,
    curved,
    elementary_function,
    finite,
    merged,
    of_its_own,
    zeros_like,
)
from quadstep.numbers.kinds import ARRAYS, Number, functions_of
from quadstep.numbers.operation import (
    ARCTANGENT,
    COSINE,
    EXPONENTIAL,
    EXPONENTS,
    LN2,
    LOGARITHM,
    MOST_ANGLE,
    OCTAVE,
    PI,
    POWER_OF_TWO,
    QUARTER_TURN,
    SHIFTER,
    SINE,
    Kind,
    declare,
    place,
    polynomial,
)
from quadstep.numbers.undecided import lifted

__all__ = ["atan2", "cos", "exp", "log", "sigmoid", "sin"]

ROOT_HALF = 0.7071067811865476

QUARTERS = float(2 / PI)
"""Quarter turns of one radian."""


def sin(x: Number) -> Number:
    """Sine of an angle [rad], at most 1.6e6 (f32: 12867); NaN beyond. The same to the bit on every engine.

    >>> from quadstep.numbers import sin
    >>> sin(0.5)
    0.479425538604203
    """
    return functions_of(x).sin(x)


def cos(x: Number) -> Number:
    """Cosine of an angle [rad], at most 1.6e6 (f32: 12867); NaN beyond. The same to the bit on every engine.

    >>> from quadstep.numbers import cos
    >>> cos(0.0)
    1.0
    """
    return functions_of(x).cos(x)


def sin_steps(kind: Kind, x: float) -> float:
    """NaN beyond MOST_ANGLE."""
    sine, cosine, quarter = turn(kind, x)
    value = kind.where(kind.bit(quarter, 0), cosine, sine)
    return kind.where(kind.bit(quarter, 1), -value, value)


def cos_steps(kind: Kind, x: float) -> float:
    """NaN beyond MOST_ANGLE."""
    sine, cosine, quarter = turn(kind, x)
    value = kind.where(kind.bit(quarter, 0), sine, cosine)
    return kind.where(kind.bit(quarter + 1.0, 1), -value, value)


def turn(kind: Kind, x: float) -> tuple[float, float, float]:
    """Sine and cosine of the remainder of x after whole quarter turns, and the number of these plus SHIFTER."""
    double = kind.precise(x)
    x = kind.where(abs(x) <= MOST_ANGLE[double], x, math.nan)
    quarter = x * QUARTERS + SHIFTER[double]
    count = quarter - SHIFTER[double]
    high, middle, low = QUARTER_TURN[double]
    r = x - count * high - count * middle - count * low
    z = r * r
    sine = r + (r * z) * polynomial(z, SINE[double])
    cosine = 1.0 - (0.5 * z - (z * z) * polynomial(z, COSINE[double]))
    return sine, cosine, quarter


def wave(x: Enclosure, value: Array, slope: Array) -> Enclosure:
    """A sine or cosine; its error, relative to 1, includes that of subtracting quarter turns from the angle."""
    third = Third(-0.5 * value, x.tight**3 / 6.0)
    reduction = np.where(np.abs(x.centre) + x.tight > 0.78, REDUCED, 0.0)
    return elementary_function(x, finite(value), slope, 0.5 * x.tight * x.tight, reduction, third)


declare(
    sin,
    sin_steps,
    tangents=(lambda t, x, _: t * cos(x),),
    enclosure=lambda x: wave(x, ARRAYS.sin(x.centre), ARRAYS.cos(x.centre)),
    exact=lambda x: Fraction(0) if x == 0 else None,
)
declare(
    cos,
    cos_steps,
    tangents=(lambda t, x, _: t * -sin(x),),
    enclosure=lambda x: wave(x, ARRAYS.cos(x.centre), -ARRAYS.sin(x.centre)),
    exact=lambda x: Fraction(1) if x == 0 else None,
)


def exp(x: Number) -> Number:
    """Exponential; infinite above 709.4 (f32: 88.3), zero below -708.7 (f32: -87.6).

    >>> from quadstep.numbers import exp
    >>> exp(0.0), exp(-800.0)
    (1.0, 0.0)
    """
    return functions_of(x).exp(x)


def exp_steps(kind: Kind, x: float) -> float:
    """Infinite above and zero below EXPONENTS."""
    double = kind.precise(x)
    x = limited(kind, x, *(float(LN2) * limit for limit in EXPONENTS[double]))
    octave = x * float(1 / LN2) + SHIFTER[double]
    count = octave - SHIFTER[double]
    high, low = OCTAVE[double]
    r = x - count * high - count * low
    return (1.0 + (r + (r * r) * polynomial(r, EXPONENTIAL[double]))) * kind.power(octave)


def exp_enclosed(x: Enclosure) -> Enclosure:
    value = ARRAYS.exp(x.centre)
    most = finite(ARRAYS.exp(x.high)) * (1.0 + ELEMENTARY)
    third = Third(0.5 * value, x.tight**3 * most / 6.0)
    return elementary_function(x, value, value, 0.5 * x.tight * x.tight * most, third=third)


declare(
    exp,
    exp_steps,
    tangents=(lambda t, _, value: t * value,),
    enclosure=exp_enclosed,
    exact=lambda x: Fraction(1) if x == 0 else None,
)


def sigmoid(x: Number) -> Number:
    """Logistic function 1 / (1 + exp(-x)), the activation of the paper's nets.

    >>> from quadstep.numbers import sigmoid
    >>> sigmoid(0.0)
    0.5
    """
    return functions_of(x).sigmoid(x)


def sigmoid_steps(kind: Kind, x: float) -> float:
    """1 / (1 + exp(-x)): its error is small relative to 1, as is that of -x / ln 2 where it matters."""
    double = kind.precise(x)
    octaves = limited(kind, x * -float(1 / LN2), *EXPONENTS[double])
    nearest = octaves + SHIFTER[double]
    r = octaves - (nearest - SHIFTER[double])
    return 1.0 / (1.0 + (1.0 + r * polynomial(r, POWER_OF_TWO[double])) * kind.power(nearest))


def limited(kind: Kind, x: float, least: float, most: float) -> float:
    """x between these limits; NaN stays."""
    x = kind.where(x < least, least, x)
    return kind.where(x > most, most, x)


def sigmoid_enclosed(x: Enclosure) -> Enclosure:
    value = ARRAYS.sigmoid(x.centre)
    bend = 0.0482 * x.tight * x.tight  # |s''| <= 1/(6 sqrt 3); |x s'| < 1/4, so that the exponent's rounding adds 2^-54
    return elementary_function(x, value, value * (1.0 - value), bend, REDUCED)


declare(
    sigmoid,
    sigmoid_steps,
    tangents=(lambda t, _, value: t * (value * (1.0 - value)),),
    enclosure=sigmoid_enclosed,
    exact=lambda x: Fraction(1, 2) if x == 0 else None,
    sympy=lambda sympy, x: 1 / (1 + sympy.exp(-x)),
)


def log(x: Number) -> Number:
    """Natural logarithm; -inf at zero, NaN below. It is constant below the smallest normal number.

    >>> from quadstep.numbers import log
    >>> log(1.0), log(-1.0)
    (0.0, nan)
    """
    return functions_of(x).log(x)


def log_steps(kind: Kind, x: float) -> float:
    """As in IEEE 754, except that numbers below the smallest normal one count as between half of it and it."""
    double = kind.precise(x)
    mantissa, exponent = kind.fraction(x), kind.exponent(x)
    small = mantissa < ROOT_HALF
    f = kind.where(small, 2.0 * mantissa, mantissa) - 1.0
    count = kind.where(small, exponent - 1.0, exponent)  # x = (1 + f) 2^count, 1 + f from 1/sqrt(2) to sqrt(2)
    s = f / (2.0 + f)
    z = s * s
    half = 0.5 * f * f
    high, low = OCTAVE[double]
    tail = count * low + s * (half + z * polynomial(z, LOGARITHM[double]))
    value = count * high + (f - (half - tail))  # s (f^2/2 + ...) - f^2/2 + f is log(1 + f)
    extreme = kind.where(x == 0.0, -math.inf, kind.where(x > 0.0, x, math.nan))
    return kind.where((x > 0.0) & (x < math.inf), value, extreme)


def log_enclosed(x: Enclosure) -> Enclosure:
    low, high = x.low, x.high
    if not np.all(low > 1e-300):
        raise UndefinedError(f"a logarithm of a number that may be zero or negative ({place()})")
    near = x.centre < low  # a floor may lie above the centre, where the line is drawn: then all that lies between
    centre, least = np.where(near, high, x.centre), np.where(near, high, low)
    bend = np.where(near, 0.0, 0.5 * x.tight * x.tight / (least * least))
    smooth = elementary_function(x, ARRAYS.log(centre), 1.0 / centre, bend)
    if not np.any(near):
        return smooth
    least, most = ARRAYS.log(low), ARRAYS.log(high)
    middle, half = 0.5 * (least + most), 0.5 * (most - least)
    lost = ELEMENTARY * (np.abs(least) + np.abs(most) + half)
    return merged(near, x.made(middle, zeros_like(x.parts), half, half, lost), smooth)


declare(
    log,
    log_steps,
    tangents=(lambda t, x, _: t / x,),
    enclosure=log_enclosed,
    exact=lambda x: Fraction(0) if x == 1 else None,
    coq="ln",
    singular=(lambda x: x == 0.0, "a logarithm of zero"),
)


def atan2(y: Number, x: Number) -> Number:
    """Angle of the point (x, y), in (-pi, pi] [rad]; zero at the origin.

    >>> from quadstep.numbers import atan2
    >>> atan2(1.0, 0.0), atan2(0.0, 0.0)
    (1.5707963267948966, 0.0)
    """
    return functions_of(y, x).atan2(y, x)


def atan2_steps(kind: Kind, y: float, x: float) -> float:
    """Zero at the origin, whose zeros' signs do not count; NaN where both are infinite."""
    rise, run = abs(y), abs(x)
    steep = rise > run
    small, large = kind.where(steep, run, rise), kind.where(steep, rise, run)
    eighth = small > large * (math.sqrt(2.0) - 1.0)  # above tan(pi/8), measure from pi/4
    over, under = kind.where(eighth, small - large, small), kind.where(eighth, small + large, large)
    r = over / kind.where(under <= 0.0, 1.0, under)  # 1 at the origin; NaN stays
    z = r * r
    angle = r + r * (z * polynomial(z, ARCTANGENT[kind.precise(r)]))
    angle = kind.where(eighth, angle + math.pi / 4.0, angle)
    angle = kind.where(steep, math.pi / 2.0 - angle, angle)
    angle = kind.where(x < 0.0, math.pi - angle, angle)
    return kind.where(y < 0.0, -angle, angle)


def atan2_enclosed(y: Operand, x: Operand) -> Enclosure:
    """The angle's second derivative along a unit vector is 1 / distance^2 at most; its cut lies along negative x."""
    like = next(one for one in (y, x) if isinstance(one, Enclosure))
    y, x = lifted(y, like), lifted(x, like)
    across, along = y.tight, x.tight
    move = np.sqrt(across * across + along * along) * (1.0 + 1e-12)
    away = np.sqrt(y.centre * y.centre + x.centre * x.centre) * (1.0 - 1e-12) - move
    clear = (x.low > 0.0) | (y.low > 0.0) | (y.high < 0.0)
    if not (np.all(away > 1e-6 * move + TINY) and np.all(clear)):
        raise UndefinedError(f"an angle across its jump from -π to π, or of a point that may be the origin ({place()})")
    square = y.centre * y.centre + x.centre * x.centre
    slope_y, slope_x = x.centre / square, -y.centre / square
    value = ARRAYS.atan2(y.centre, x.centre)
    bend = 0.5 * (move * move) / (away * away) * (1.0 + 1e-12)
    size_y, size_x = np.abs(slope_y), np.abs(slope_x)
    parts = added(None if y.parts is None else slope_y * y.parts, None if x.parts is None else slope_x * x.parts)
    reach = size_y * y.reach + size_x * x.reach + bend
    lost = ELEMENTARY * (np.abs(value) + reach) + TINY
    if y.fresh is not None and y.fresh.second and y.parts is not None and x.parts is not None:
        along_both, across_both = slope_x * slope_y, slope_x * slope_x - slope_y * slope_y
        parts, bend_x = curved(parts, x, x, -along_both, bend)
        parts, bend_y = curved(parts, y, y, along_both, bend)
        parts, bend_xy = curved(parts, y, x, across_both, bend)
        bend = bend_x + bend_y + bend_xy + bend * (2.0 / 3.0) * move / away * (1.0 + 1e-12)
    return of_its_own(y.made(value, parts, size_y * y.rest + size_x * x.rest + bend, reach, lost))


declare(
    atan2,
    atan2_steps,
    tangents=(lambda t, y, x, _: t * (x / (y * y + x * x)), lambda t, y, x, _: t * -(y / (y * y + x * x))),
    enclosure=atan2_enclosed,
    exact=lambda y, x: Fraction(0) if y == 0 and x is not None and x >= 0 else None,
    singular=(lambda y, x: y * y + x * x == 0.0, "the angle of a point at the origin"),
)
