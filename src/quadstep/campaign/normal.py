"""The distribution function of the normal distribution."""

from quadstep.numbers import exp

PEAK = 0.3989422804014326779
"""Density at the mean, 1 / sqrt(2 pi)."""

TERMS = 20
"""Terms of the series, used up to one deviation from the mean: the next term is below 1e-25."""

DEPTH = 500
"""Depth of the continued fraction used beyond; 400 suffice."""


def probability(x: float) -> float:
    """The share of a standard normal distribution below x; relative error below 1e-15, in the lower tail too.

    Near the mean density times the series x + x^3 / 3 + x^5 / (3 5) + ... (Marsaglia 2004), in the tails Laplace's continued
    fraction 1 / (x + 1 / (x + 2 / (x + ...))).
    """
    if x > 1.0:
        return 1.0 - probability(-x)
    if x > -1.0:
        total = 1.0
        for k in range(TERMS, 0, -1):
            total = 1.0 + x * x / (2 * k + 1) * total
        return 0.5 + density(x) * (x * total)
    fraction = -x
    for k in range(DEPTH, 0, -1):
        fraction = k / fraction - x
    return density(x) / fraction


def density(x: float) -> float:
    """Density of the standard normal distribution at x. The square is taken in two parts: its round-off would be magnified."""
    near = round(x * 64.0) / 64.0
    return PEAK * exp(-0.5 * (near * near)) * exp(-0.5 * ((x - near) * (x + near)))
