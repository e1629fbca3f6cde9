"""The standard normal distribution: shares below a float, and the quantile function over numbers."""

from quadstep.numbers import Number, exp, minimum, sqrt, where
from quadstep.numbers.elementary import log

PEAK = 0.3989422804014326779
"""Density at the mean, 1 / sqrt(2 pi)."""

TERMS = 20
"""Terms of the series, used up to one deviation from the mean: the next term is below 1e-25."""

DEPTH = 500
"""Depth of the continued fraction used beyond; 400 suffice."""

# M. J. Wichura, "Algorithm AS 241: the percentage points of the normal distribution", 1988: numerators and denominators
CENTRE = (
    (3.3871328727963666080, 133.14166789178437745, 1971.5909503065514427, 13731.693765509461125,
     45921.953931549871457, 67265.770927008700853, 33430.575583588128105, 2509.0809287301226727),
    (1.0, 42.313330701600911252, 687.18700749205790830, 5394.1960214247511077,
     21213.794301586595867, 39307.895800092710610, 28729.085735721942674, 5226.4952788528545610),
)  # fmt: skip
NEAR = (
    (1.42343711074968357734, 4.63033784615654529590, 5.76949722146069140550, 3.64784832476320460504,
     1.27045825245236838258, 0.241780725177450611770, 0.0227238449892691845833, 7.74545014278341407640e-4),
    (1.0, 2.05319162663775882187, 1.67638483018380384940, 0.689767334985100004550,
     0.148103976427480074590, 0.0151986665636164571966, 5.47593808499534494600e-4, 1.05075007164441684324e-9),
)  # fmt: skip
FAR = (
    (6.65790464350110377720, 5.46378491116411436990, 1.78482653991729133580, 0.296560571828504891230,
     0.0265321895265761230930, 1.24266094738807843860e-3, 2.71155556874348757815e-5, 2.01033439929228813265e-7),
    (1.0, 0.599832206555887937690, 0.136929880922735805310, 0.0148753612908506148525,
     7.86869131145613259100e-4, 1.84631831751005468180e-5, 1.42151175831644588870e-7, 2.04426310338993978564e-15),
)  # fmt: skip


def inverse_normal(p: Number) -> Number:
    """x such that a standard normal number is below x with probability p in (0, 1); 16 digits in f64 (Wichura 1988)."""
    q = p - 0.5
    inside = 0.180625 - q * q
    centre = q * ratio(inside, CENTRE)
    tail = minimum(p, 1.0 - p)
    distance = sqrt(-log(where(inside >= 0.0, 0.5, tail)))
    outer = where(distance <= 5.0, ratio(distance - 1.6, NEAR), ratio(distance - 5.0, FAR))
    return where(inside >= 0.0, centre, where(q < 0.0, -outer, outer))


def ratio(x: Number, polynomials: tuple[tuple[float, ...], tuple[float, ...]]) -> Number:
    """A rational function by Horner's rule."""
    over, under = (horner(x, coefficients) for coefficients in polynomials)
    return over / under


def horner(x: Number, coefficients: tuple[float, ...]) -> Number:
    """Sum of coefficients[i] x^i."""
    value: Number = coefficients[-1]
    for coefficient in coefficients[-2::-1]:
        value = value * x + coefficient
    return value


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
