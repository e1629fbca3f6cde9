"""sin, cos, exp, sigmoid, log and atan2, written once for every kind of number from operations that IEEE 754 fixes to the bit.

Sums, products, quotients, comparisons and `where` in the order written here, and four steps on the bits of a number: so the
same argument gives the same bits on every engine, processor and compiler. Each function is a reduction to a short interval and
a polynomial, fitted there by Chebyshev interpolation in 40 digits (`mpmath.chebyfit`). Largest errors in units of the last
place, measured without fused operations: docs/decisions/0012-equal-bits.md.
"""

import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

PI = Fraction("3.14159265358979323846264338327950288419716939937510")
LN2 = Fraction("0.69314718055994530941723212145817656807550013436026")

# (sin r - r) / r^3, (cos r - 1 + r^2/2) / r^4 over r^2; (exp r - 1 - r) / r^2 over r; (2^r - 1) / r over r;
# (atan r - r) / r^3 over r^2; (log((1 + s) / (1 - s)) - 2 s) / s^3 over s^2; each for f64 (True) and f32 (False)
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
POWER_OF_TWO = {
    True: (0.6931471805599462, 0.24022650695910075, 0.05550410866465167, 0.009618129107618665, 0.0013333558200794592,
           0.00015403530424776529, 1.5252672924850737e-05, 1.3215451633221434e-06, 1.0205905413765595e-07,
           7.070977866508138e-09),
    False: (0.6931471805599453, 0.2402234903802036, 0.05550381013796457, 0.009666368515385448, 0.0013381302537320797),
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


def parts(value: Fraction, bits: int, count: int) -> tuple[float, ...]:
    """`value` as a sum of floats of `bits` bits each, so that a small integer times each but the last is exact."""
    result = []
    for _ in range(count - 1):
        scale = Fraction(2) ** (bits - 1 - math.floor(math.log2(value)))
        part = Fraction(math.floor(value * scale)) / scale
        result.append(float(part))
        value -= part
    return (*result, float(value))


QUARTER_TURN = {True: parts(PI / 2, 33, 3), False: parts(PI / 2, 11, 3)}
OCTAVE = {True: parts(LN2, 33, 2), False: parts(LN2, 12, 2)}

MOST_ANGLE = {True: 2.0**20 * (math.pi / 2.0), False: 2.0**13 * (math.pi / 2.0)}
"""Up to here the reduction of an angle is exact except for its last step; sine and cosine beyond it are NaN [rad]."""

EXPONENTS = {True: (-1023.0, 1024.0), False: (-127.0, 128.0)}
"""Two to the first counts as zero, to the second as infinity, as in the bits that `power` makes."""

SHIFTER = {True: 1.5 * 2.0**52, False: 1.5 * 2.0**23}
"""A number plus this has no bits for a fraction: it is rounded to the nearest integer, which its low bits then contain."""

ROOT_HALF = 0.7071067811865476


class Elementary:
    """The functions for a kind of number that supplies

    where(condition, yes, no), abs(x), and `precise(x)`: f64, not f32?
    bit(x, place): whether the bit of this place, 0 the lowest, is set in x;
    power(m): 2^n for m = n + SHIFTER, n within EXPONENTS;
    fraction(x), exponent(x): x = fraction 2^exponent with fraction in [1/2, 1), for a normal x > 0; else meaningless.

    The type checker reads the resulting functions as over floats, as it does a law.
    """

    where: Callable[..., Any]
    bit: Callable[..., Any]
    power: Callable[..., Any]
    fraction: Callable[..., Any]
    exponent: Callable[..., Any]
    precise: Callable[..., bool]

    def sin(self, x: float) -> float:
        """NaN beyond MOST_ANGLE."""
        sine, cosine, quarter = self.turn(x)
        value = self.where(self.bit(quarter, 0), cosine, sine)
        result: float = self.where(self.bit(quarter, 1), -value, value)
        return result

    def cos(self, x: float) -> float:
        """NaN beyond MOST_ANGLE."""
        sine, cosine, quarter = self.turn(x)
        value = self.where(self.bit(quarter, 0), sine, cosine)
        result: float = self.where(self.bit(quarter + 1.0, 1), -value, value)
        return result

    def turn(self, x: float) -> tuple[float, float, float]:
        """Sine and cosine of the remainder of x after whole quarter turns, and the number of these plus SHIFTER."""
        double = self.precise(x)
        x = self.where(abs(x) <= MOST_ANGLE[double], x, math.nan)
        quarter = x * float(2 / PI) + SHIFTER[double]
        count = quarter - SHIFTER[double]
        high, middle, low = QUARTER_TURN[double]
        r = x - count * high - count * middle - count * low
        z = r * r
        sine = r + (r * z) * polynomial(z, SINE[double])
        cosine = 1.0 - (0.5 * z - (z * z) * polynomial(z, COSINE[double]))
        return sine, cosine, quarter

    def exp(self, x: float) -> float:
        """Infinite above and zero below EXPONENTS."""
        double = self.precise(x)
        x = self.held(x, *(float(LN2) * limit for limit in EXPONENTS[double]))
        octave = x * float(1 / LN2) + SHIFTER[double]
        count = octave - SHIFTER[double]
        high, low = OCTAVE[double]
        r = x - count * high - count * low
        result: float = (1.0 + (r + (r * r) * polynomial(r, EXPONENTIAL[double]))) * self.power(octave)
        return result

    def sigmoid(self, x: float) -> float:
        """1 / (1 + exp(-x)): its error is small relative to 1, as is that of -x / ln 2 where it matters."""
        double = self.precise(x)
        octaves = self.held(x * -float(1 / LN2), *EXPONENTS[double])
        nearest = octaves + SHIFTER[double]
        r = octaves - (nearest - SHIFTER[double])
        result: float = 1.0 / (1.0 + (1.0 + r * polynomial(r, POWER_OF_TWO[double])) * self.power(nearest))
        return result

    def held(self, x: float, least: float, most: float) -> float:
        """x between these limits; NaN stays."""
        x = self.where(x < least, least, x)
        result: float = self.where(x > most, most, x)
        return result

    def log(self, x: float) -> float:
        """As in IEEE 754, except that numbers below the smallest normal one count as between half of it and it."""
        double = self.precise(x)
        mantissa, exponent = self.fraction(x), self.exponent(x)
        small = mantissa < ROOT_HALF
        f = self.where(small, 2.0 * mantissa, mantissa) - 1.0
        count = self.where(small, exponent - 1.0, exponent)  # x = (1 + f) 2^count, 1 + f from 1/sqrt(2) to sqrt(2)
        s = f / (2.0 + f)
        z = s * s
        half = 0.5 * f * f
        high, low = OCTAVE[double]
        tail = count * low + s * (half + z * polynomial(z, LOGARITHM[double]))
        value = count * high + (f - (half - tail))  # s (f^2/2 + ...) - f^2/2 + f is log(1 + f)
        extreme = self.where(x == 0.0, -math.inf, self.where(x > 0.0, x, math.nan))
        result: float = self.where((x > 0.0) & (x < math.inf), value, extreme)
        return result

    def atan2(self, y: float, x: float) -> float:
        """Zero at the origin, whose zeros' signs do not count; NaN where both are infinite."""
        rise, run = abs(y), abs(x)
        steep = rise > run
        small, large = self.where(steep, run, rise), self.where(steep, rise, run)
        eighth = small > large * (math.sqrt(2.0) - 1.0)  # above tan(pi/8), measure from pi/4
        over, under = self.where(eighth, small - large, small), self.where(eighth, small + large, large)
        r = over / self.where(under <= 0.0, 1.0, under)  # 1 at the origin; NaN stays
        z = r * r
        angle = r + r * (z * polynomial(z, ARCTANGENT[self.precise(r)]))
        angle = self.where(eighth, angle + math.pi / 4.0, angle)
        angle = self.where(steep, math.pi / 2.0 - angle, angle)
        angle = self.where(x < 0.0, math.pi - angle, angle)
        result: float = self.where(y < 0.0, -angle, angle)
        return result


def polynomial(x: float, coefficients: tuple[float, ...]) -> float:
    """Sum of coefficients[i] x^i by Horner's rule."""
    value: float = coefficients[-1]
    for coefficient in coefficients[-2::-1]:
        value = value * x + coefficient
    return value
