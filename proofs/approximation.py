"""How far the polynomials of the own elementary functions are from the functions: exact rationals, branch and bound.

On each piece of the interval the polynomial less the series is expanded about the middle; what the series leaves off is
bounded by its remainder. Nothing is rounded but the bound that is printed, upwards.
"""

from fractions import Fraction
from math import comb

from proofs.kernels import Kernel

PIECES = 64


class Polynomial:
    """A polynomial in r with rational coefficients: a number that a kernel takes."""

    def __init__(self, coefficients: list[Fraction]) -> None:
        self.coefficients = coefficients

    @staticmethod
    def of(value: "Polynomial | float | Fraction") -> "Polynomial":
        """A number as one; a float is the fraction that it is."""
        return value if isinstance(value, Polynomial) else Polynomial([Fraction(value)])

    def __add__(self, other: "Polynomial | float") -> "Polynomial":
        a, b = self.coefficients, Polynomial.of(other).coefficients
        size = max(len(a), len(b))
        padded = [[*c, *[Fraction(0)] * (size - len(c))] for c in (a, b)]
        return Polynomial([x + y for x, y in zip(*padded, strict=True)])

    def __neg__(self) -> "Polynomial":
        return Polynomial([-c for c in self.coefficients])

    def __sub__(self, other: "Polynomial | float") -> "Polynomial":
        return self + -Polynomial.of(other)

    def __rsub__(self, other: float) -> "Polynomial":
        return Polynomial.of(other) - self

    def __mul__(self, other: "Polynomial | float") -> "Polynomial":
        a, b = self.coefficients, Polynomial.of(other).coefficients
        result = [Fraction(0)] * (len(a) + len(b) - 1)
        for i, x in enumerate(a):
            for j, y in enumerate(b):
                result[i + j] += x * y
        return Polynomial(result)

    __radd__, __rmul__ = __add__, __mul__

    def about(self, middle: Fraction) -> list[Fraction]:
        """Coefficients in powers of r - middle."""
        c = self.coefficients
        return [sum((comb(n, k) * c[n] * middle ** (n - k) for n in range(k, len(c))), Fraction(0)) for k in range(len(c))]


def largest_error(kernel: Kernel, double: bool) -> Fraction:
    """Bound of |polynomial - function| for |r| <= most; over |r| for a kernel whose error is relative."""
    r = Polynomial([Fraction(0), Fraction(1)])
    flown: Polynomial = kernel.whole(r, double)  # type: ignore[arg-type,assignment]  # a polynomial is a number here
    gap = (flown - Polynomial(list(kernel.series))).coefficients
    rest = kernel.remainder * kernel.most ** len(kernel.series)
    if kernel.relative:
        assert gap[0] == 0
        gap, rest = gap[1:], rest / kernel.most
    half = kernel.most / PIECES
    worst = Fraction(0)
    for piece in range(PIECES):
        middle = -kernel.most + (2 * piece + 1) * half
        bound = Fraction(0)
        for coefficient in reversed(Polynomial(gap).about(middle)):
            bound = bound * half + abs(coefficient)
        worst = max(worst, bound)
    return worst + rest
