"""Sine, exponential and friends for lanes, straight-line and without calls.

Each is a reduction to a short interval and a polynomial, fitted there by Chebyshev interpolation in 40 digits
(`mpmath.chebyfit`); the tests hold them to a few units in the last place of `math`.
"""

import math
import struct
from fractions import Fraction
from typing import Any

from llvmlite import ir

from quadstep.numbers.lane import Condition, Emitter, Lane
from quadstep.numbers.lane_calls import call
from quadstep.numbers.lane_words import LaneWord

PI = Fraction("3.14159265358979323846264338327950288419716939937510")
LN2 = Fraction("0.69314718055994530941723212145817656807550013436026")

# (sin r - r) / r^3, (cos r - 1 + r^2/2) / r^4 over r^2; (exp r - 1 - r) / r^2 over r; (atan r - r) / r^3 over r^2;
# (log((1 + s) / (1 - s)) - 2 s) / s^3 over s^2
SINE = {
    True: (-0.16666666666666666, 0.0083333333333307, -0.00019841269836387345, 2.755731591191116e-06,
           -2.5051092507061385e-08, 1.59153232122714e-10),
    False: (-0.16666664539989612, 0.008332724732630293, -0.0001958285585078999),
}  # fmt: skip
COSINE = {
    True: (0.041666666666666664, -0.0013888888888887241, 2.4801587298533456e-05, -2.755731715246704e-07,
           2.087612165887116e-09, -1.1380876948169717e-11),
    False: (0.04166666453694609, -0.0013888279449649538, 2.454289633694463e-05),
}  # fmt: skip
EXPONENTIAL = {
    True: (0.5, 0.1666666666666667, 0.04166666666666667, 0.008333333333325544, 0.0013888888888883327,
           0.00019841269876864356, 2.4801587327007187e-05, 2.755725283351691e-06, 2.75572718102198e-07,
           2.5106274733573296e-08, 2.0915442297780116e-09),
    False: (0.5, 0.16666573381900845, 0.04166655011030512, 0.008363773874405574, 0.0013926926614021907),
}  # fmt: skip
ARCTANGENT = {
    True: (-0.3333333333333333, 0.19999999999999785, -0.14285714285654638, 0.11111111104652255, -0.09090908728587459,
           0.07692295658327873, -0.06666412077725274, 0.058787824694439814, -0.0522938047378184, 0.045467195095551666,
           -0.034445844423577385, 0.016148228546771868),
    False: (-0.33333331686451945, 0.1999952339722771, -0.1426336657972561, 0.1073739696716272, -0.06431038710715442),
}  # fmt: skip

LOGARITHM = {
    True: (0.666666666666667, 0.39999999999899505, 0.28571428625975487, 0.2222221113479508, 0.18182889125261723,
           0.15331721600556042, 0.14616449685043406),
    False: (0.6666668503957586, 0.3998878056602198, 0.2957994939197279),
}  # fmt: skip


def parts(value: Fraction, bits: int, count: int) -> list[float]:
    """`value` as a sum of floats of `bits` bits each, so that a small integer times each but the last is exact."""
    result = []
    for _ in range(count - 1):
        scale = Fraction(2) ** (bits - 1 - math.floor(math.log2(value)))
        part = Fraction(math.floor(value * scale)) / scale
        result.append(float(part))
        value -= part
    return [*result, float(value)]


class LaneFunctions:
    """The functions of `quadstep.numbers` for lanes."""

    def sqrt(self, x: Lane) -> Lane:
        return Lane(x.emitter, x.emitter.intrinsic("sqrt", x.value))

    def where(self, condition: Any, yes: Any, no: Any) -> Any:
        if not isinstance(condition, Condition):
            return yes if condition else no
        if yes is no:
            return yes
        emitter = condition.emitter
        a, b = emitter.value(yes), emitter.value(no)
        choose = emitter.builder.select
        return Lane(emitter, emitter.once(("select", condition.value, a, b), lambda: choose(condition.value, a, b)))

    def sin(self, x: Lane) -> Lane:
        sine, cosine, quarter = turn(x)
        return signed(x.emitter, pick_odd(x.emitter, quarter, cosine, sine), quarter, 0)

    def cos(self, x: Lane) -> Lane:
        sine, cosine, quarter = turn(x)
        return signed(x.emitter, pick_odd(x.emitter, quarter, sine, cosine), quarter, 1)

    def exp(self, x: Lane) -> Lane:
        """Saturates near the ends of the exponent's range instead of overflowing."""
        emitter = x.emitter
        low, high = (-708.0, 709.0) if emitter.double else (-87.0, 88.0)
        x = self.where(x > high, high, self.where(x < low, low, x))
        count, bits = nearest(x * float(1 / LN2))
        r = reduce(x, count, parts(LN2, 33 if emitter.double else 12, 2))
        value = 1.0 + (r + (r * r) * polynomial(r, EXPONENTIAL[emitter.double]))
        builder, bias, shift = emitter.builder, *((1023, 52) if emitter.double else (127, 23))
        exponent = builder.shl(builder.add(bits, emitter.whole_constant(bias)), emitter.whole_constant(shift))
        result: Lane = value * Lane(emitter, builder.bitcast(exponent, emitter.vector))
        return result

    def log(self, x: Lane) -> Lane:
        """As IEEE 754 has it, save that numbers below the smallest normal one count as between half of it and it."""
        emitter = x.emitter
        double = emitter.double
        f, exponent = mantissa(x)
        s = f / (2.0 + f)
        z = s * s
        half = 0.5 * f * f
        high, low = parts(LN2, 33 if double else 12, 2)
        tail = multiply_add(exponent, low, s * (half + z * polynomial(z, LOGARITHM[double])))
        value = multiply_add(exponent, high, f - (half - tail))  # s (f^2/2 + ...) - f^2/2 + f is log(1 + f)
        extreme = self.where(x == 0.0, -math.inf, self.where(x > 0.0, x, math.nan))
        return self.where((x > 0.0) & (x < math.inf), value, extreme)  # type: ignore[no-any-return]

    def atan2(self, y: Any, x: Any) -> Lane:
        emitter = y.emitter if isinstance(y, Lane) else x.emitter
        y, x = Lane(emitter, emitter.value(y)), Lane(emitter, emitter.value(x))
        rise, run = self.absolute(y), self.absolute(x)
        steep = rise > run
        small, large = self.where(steep, run, rise), self.where(steep, rise, run)
        eighth = small > large * (math.sqrt(2.0) - 1.0)  # above tan(pi/8), measure from pi/4
        over, under = self.where(eighth, small - large, small), self.where(eighth, small + large, large)
        r = over / self.where(under <= 0.0, 1.0, under)  # 1 at the origin; NaN stays
        z = r * r
        angle = r + r * (z * polynomial(z, ARCTANGENT[emitter.double]))
        angle = self.where(eighth, angle + math.pi / 4.0, angle)
        angle = self.where(steep, math.pi / 2.0 - angle, angle)
        angle = self.where(x < 0.0, math.pi - angle, angle)
        return self.where(y < 0.0, -angle, angle)  # type: ignore[no-any-return]

    def absolute(self, x: Lane) -> Lane:
        return Lane(x.emitter, x.emitter.intrinsic("fabs", x.value))

    call = staticmethod(call)

    def word(self, x: Lane) -> LaneWord:
        return LaneWord.of(x)

    def number(self, word: LaneWord) -> Lane:
        return word.number()


def polynomial(x: Lane, coefficients: tuple[float, ...]) -> Lane:
    """Sum of coefficients[i] x^i by Horner's rule."""
    emitter = x.emitter
    value = emitter.constant(coefficients[-1])
    for coefficient in coefficients[-2::-1]:
        value = emitter.intrinsic("fmuladd", value, x.value, emitter.constant(coefficient))
    return Lane(emitter, value)


def multiply_add(a: Lane, b: float, c: Lane) -> Lane:
    """a b + c, not reassociated."""
    emitter = a.emitter
    return Lane(emitter, emitter.intrinsic("fmuladd", a.value, emitter.constant(b), c.value))


def mantissa(x: Lane) -> tuple[Lane, Lane]:
    """f and a whole k with x = (1 + f) 2^k and 1 + f from 1/sqrt(2) to sqrt(2), for a normal x > 0; else of no meaning."""
    emitter, builder = x.emitter, x.emitter.builder
    size, bias, kind = (52, 1023, "d") if emitter.double else (23, 127, "f")
    lowest = int.from_bytes(struct.pack(">" + kind, math.sqrt(0.5)), "big")
    shifter = 1.5 * 2.0**size  # added to the bits of this, a whole number is added to its value
    offset, behind = bias << size, int.from_bytes(struct.pack(">" + kind, shifter), "big")

    def whole(value: int) -> ir.Constant:
        return emitter.whole_constant(value)

    def fraction() -> ir.Value:
        below = builder.and_(moved, whole((1 << size) - 1))
        return builder.bitcast(builder.add(below, whole(lowest)), emitter.vector)

    def exponent() -> ir.Value:
        count = builder.add(builder.lshr(moved, whole(size)), whole(behind))
        return builder.fsub(builder.bitcast(count, emitter.vector), emitter.constant(shifter + bias))

    bits = emitter.once(("bits", x.value), lambda: builder.bitcast(x.value, emitter.wholes))
    moved = emitter.once(("mantissa bits", bits), lambda: builder.add(bits, whole(offset - lowest)))
    one = Lane(emitter, emitter.once(("mantissa", moved), fraction))
    return one - 1.0, Lane(emitter, emitter.once(("exponent", moved), exponent))


def nearest(x: Lane) -> tuple[Lane, ir.Value]:
    """The nearest whole number, as a float and as the low bits of an integer; for |x| below 2^50 (f32: 2^21).

    Adding 1.5 * 2^52 leaves no room for a fraction; it is defined for every input, where a conversion is not.
    """
    emitter, builder = x.emitter, x.emitter.builder
    magic = emitter.constant(1.5 * 2.0 ** (52 if emitter.double else 23))

    def shifted() -> ir.Value:
        return builder.fadd(x.value, magic)  # no flags: must not be reassociated away

    moved = emitter.once(("nearest", x.value), shifted)
    count = emitter.once(("nearest back", moved), lambda: builder.fsub(moved, magic))
    bits = emitter.once(("nearest bits", moved), lambda: builder.bitcast(moved, emitter.wholes))
    return Lane(emitter, count), bits


def reduce(x: Lane, count: Lane, pieces: list[float]) -> Lane:
    """x - count * sum(pieces), piece by piece so that little is lost."""
    emitter = x.emitter
    value, negative = x.value, (-count).value
    for piece in pieces:
        value = emitter.intrinsic("fmuladd", negative, emitter.constant(piece), value)
    return Lane(emitter, value)


def turn(x: Lane) -> tuple[Lane, Lane, ir.Value]:
    """Sine and cosine of what is left of x after whole quarter turns, and the number of these (low bits)."""
    emitter = x.emitter
    count, quarter = nearest(x * float(2 / PI))
    r = reduce(x, count, parts(PI / 2, 33 if emitter.double else 11, 3))
    z = r * r
    sine = r + (r * z) * polynomial(z, SINE[emitter.double])
    cosine = 1.0 - (0.5 * z - (z * z) * polynomial(z, COSINE[emitter.double]))
    return sine, cosine, quarter


def pick_odd(emitter: Emitter, quarter: ir.Value, odd: Lane, even: Lane) -> Lane:
    """`odd` where the quarter turns are odd in number."""
    builder = emitter.builder
    bit = emitter.once(("odd", quarter), lambda: builder.and_(quarter, emitter.whole_constant(1)))
    condition = emitter.once(("is odd", bit), lambda: builder.icmp_signed("!=", bit, emitter.whole_constant(0)))
    return Lane(emitter, builder.select(condition, odd.value, even.value))


def signed(emitter: Emitter, x: Lane, quarter: ir.Value, ahead: int) -> Lane:
    """x with its sign changed where quarter + ahead has its second bit set."""
    builder, sign = emitter.builder, 62 if emitter.double else 30
    moved = builder.add(quarter, emitter.whole_constant(ahead)) if ahead else quarter
    bit = builder.shl(builder.and_(moved, emitter.whole_constant(2)), emitter.whole_constant(sign))
    return Lane(emitter, builder.bitcast(builder.xor(builder.bitcast(x.value, emitter.wholes), bit), emitter.vector))


Lane.functions = LaneFunctions()
