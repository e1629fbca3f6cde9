"""Random numbers from a counter: each depends on seed, flight, stream and tick, and no state is kept between draws.

So a flight has the same noise in any batch, engine, thread or order. The generator is Threefry-2x32 with 20
rounds (Salmon, Moraes, Dror and Shaw, "Parallel random numbers: as easy as 1, 2, 3", 2011). Its 32-bit words are the same on
every kind of number, and so is what is made of them in f64.
The quantile function of the standard normal distribution is a function over numbers, too.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

from quadstep.numbers.elementary import cos, exp, log, sin
from quadstep.numbers.functions import minimum, number, sqrt, where, word
from quadstep.numbers.kinds import Number, Word
from quadstep.numbers.operation import polynomial
from quadstep.numbers.vectors import Vector

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
    over, under = (polynomial(x, coefficients) for coefficients in polynomials)
    return over / under


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


EVERY_BIT = 0xFFFFFFFF
PARITY = 0x1BD11BDA
ROTATIONS = (13, 15, 26, 6, 17, 29, 16, 24)
ROUNDS = 20
MOST_PAIRS = 64
"""Pairs of words that a stream may draw in one tick."""

Words: TypeAlias = tuple[Word, Word]


class Key(NamedTuple):
    """The key of one flight's noise. words: 64 bits as four whole numbers below 65536, exact in every kind of number."""

    words: Vector


def key(seed: int, flight: int) -> Key:
    """The key of one flight of a batch with this seed, seed in [0, 2^64) and flight in [0, 2^32).

    The seed is mixed by the generator itself, which maps 64 bits one to one; the flight's number then changes the second word.
    So all flights of a seed have different keys, as have all seeds at one flight; any other two agree with a chance of 2^-64.
    """
    if not 0 <= seed < 2**64:
        raise ValueError(f"a seed is a whole number from 0 to 2^64 - 1, not {seed}")
    if not 0 <= flight <= EVERY_BIT:
        raise ValueError(f"a flight's number is from 0 to 2^32 - 1, not {flight}")
    ((first, second),) = threefry((0, 0), [(seed & EVERY_BIT, seed >> 32)])
    return Key(Vector(float(half) for bits in (first, second ^ flight) for half in (bits >> 16, bits & 0xFFFF)))


def flight_key(base: Vector, high: Number, low: Number) -> Key:
    """`key(seed, flight)` where the flight's number is a number too, high * 65536 + low, each whole and below 65536.

    base: `key(seed, 0).words`.
    """
    first, second, *rest = base
    changed = (number(word(ours) ^ word(theirs)) for ours, theirs in zip(rest, (high, low), strict=True))
    return Key(Vector([first, second, *changed]))


def threefry(key: Words, counters: Sequence[Words]) -> list[Words]:
    """Each counter, two words, encrypted under the key.

    All of them go through a round before the next: a processor then has independent work (up to a third less time in lanes).
    """
    keys = (*key, key[0] ^ key[1] ^ PARITY)
    left = [(first + keys[0]) & EVERY_BIT for first, _ in counters]
    right = [(second + keys[1]) & EVERY_BIT for _, second in counters]
    for turn in range(ROUNDS):
        distance = ROTATIONS[turn % 8]
        left = [(a + b) & EVERY_BIT for a, b in zip(left, right, strict=True)]
        turned = [((b << distance) | (b >> (32 - distance))) & EVERY_BIT for b in right]
        right = [a ^ b for a, b in zip(left, turned, strict=True)]
        if turn % 4 == 3:
            injection = turn // 4 + 1
            first, second = keys[injection % 3], (keys[(injection + 1) % 3] + injection) & EVERY_BIT
            left = [(a + first) & EVERY_BIT for a in left]
            right = [(b + second) & EVERY_BIT for b in right]
    return list(zip(left, right, strict=True))


def draw(key: Key, stream: int, tick: Number, pairs: int) -> list[Words]:
    """Pairs of random words, at most `MOST_PAIRS`. stream: 0 to 2^26 - 1. tick: a whole number below 2^31 (in f32: 2^24)."""
    if not (0 <= stream < 2**32 // MOST_PAIRS and 0 <= pairs <= MOST_PAIRS):
        raise ValueError(f"no {pairs} pairs of stream {stream}: at most {MOST_PAIRS} of a stream from 0 to 2^26 - 1")
    high_1, low_1, high_2, low_2 = (word(half) for half in key.words)
    secret = ((high_1 << 16) | low_1, (high_2 << 16) | low_2)
    return threefry(secret, [(word(tick), stream * MOST_PAIRS + pair) for pair in range(pairs)])


def fraction(bits: Word) -> Number:
    """(bits + 1/2) / 2^32, in (0, 1); in f32 rounded, so that it may be 1."""
    return number(bits >> 16) * 2.0**-16 + (number(bits & 0xFFFF) * 2.0**-32 + 2.0**-33)


def uniforms(key: Key, stream: int, tick: Number, count: int) -> Vector:
    """`count` independent numbers, uniform in (0, 1); at most 128. `normals` of the stream would use the same words."""
    pairs = draw(key, stream, tick, -(-count // 2))
    drawn = [fraction(bits) for pair in pairs for bits in pair][:count]
    return Vector(where(u < 1.0, u, 1.0 - 2.0**-24) for u in drawn)


def normals(key: Key, stream: int, tick: Number, count: int) -> Vector:
    """`count` independent numbers, normal with mean 0 and variance 1, none beyond 6.8 (Box and Muller 1958); at most 128.

    `stream` sets purposes apart; the same key, stream and tick give the same numbers, a smaller count the first of them.
    """
    drawn = []
    for first, second in draw(key, stream, tick, -(-count // 2)):
        radius, angle = sqrt(-2.0 * log(fraction(first))), (2.0 * math.pi) * fraction(second)
        drawn += [radius * cos(angle), radius * sin(angle)]
    return Vector(drawn[:count])
