"""Random numbers from a counter: each depends on seed, flight, stream and tick, and no state is kept between draws.

So a flight has the same noise in any batch, engine, thread or order. The generator is Threefry-2x32 with 20
rounds (Salmon, Moraes, Dror and Shaw, "Parallel random numbers: as easy as 1, 2, 3", 2011). Its 32-bit words are the same on
every kind of number, and so is what is made of them in f64.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

from quadstep.numbers.elementary import cos, log, sin
from quadstep.numbers.functions import number, sqrt, where, word
from quadstep.numbers.kinds import Number, Word
from quadstep.numbers.vectors import Vector

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
