"""Noise from a counter: the published words, the same words on every kind of number, and numbers that look random."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadstep.numbers import Vector, noise
from quadstep.numbers.functions import number, word
from quadstep.numbers.noise import EVERY_BIT, Key, draw, key, normals, threefry, uniforms
from tests.flights import array, through_lanes

SEED, TICKS = 20, 2000
KEYS = [key(SEED, flight) for flight in range(50)]
BATCH = Key(Vector(np.array([one.words.entries for one in KEYS]).T[:, :, None]))  # one flight a row
TICK = np.arange(TICKS, dtype=float)[None, :]  # one tick a column
KINDS = pytest.mark.parametrize("double", [True, False], ids=["f64", "f32"])


def halves(key, stream, tick, pairs):
    """The words as numbers that are exact in every kind."""
    return [number(half) for pair in draw(key, stream, tick, pairs) for bits in pair for half in (bits >> 16, bits & 0xFFFF)]


@pytest.mark.parametrize(("key", "counter", "wanted"), [
    ((0, 0), (0, 0), (0x6B200159, 0x99BA4EFE)),
    ((EVERY_BIT, EVERY_BIT), (EVERY_BIT, EVERY_BIT), (0x1CB996FC, 0xBB002BE7)),
    ((0x13198A2E, 0x03707344), (0x243F6A88, 0x85A308D3), (0xC4923A9C, 0x483DF7A0)),
])  # fmt: skip
def test_the_generator_gives_the_published_words(key, counter, wanted):
    assert threefry(key, [counter]) == [wanted]
    assert threefry(key, [(1, 2), counter, (3, 4)])[1] == wanted
    on_arrays = threefry(tuple(np.array([bits], dtype=np.uint64) for bits in key), [counter])
    assert [int(bits[0]) for bits in on_arrays[0]] == list(wanted)


def test_key_stream_tick_and_place_reach_the_generator_whole():
    halves = Key(Vector(map(float, (0x1319, 0x8A2E, 0x0370, 0x7344))))
    assert draw(halves, 5, float(0x243F6A), 8) == threefry(
        (0x13198A2E, 0x03707344), [(0x243F6A, 5 * 64 + pair) for pair in range(8)]
    )


@KINDS
def test_words_are_the_same_on_floats_arrays_and_lanes(double):
    ticks = np.array([0, 1, 2, 1000, 2**24 - 1, 65536, 12345, 77.0])
    keys = [key(0, 0), key(1, 0), key(2**63 - 1, 0), key(9, 1), key(9, 2), key(9, 2**32 - 1), key(10, 5), key(11, 6)]
    columns = np.array([one.words.entries for one in keys]).T
    wanted = np.array([halves(one, 3, tick, 3) for one, tick in zip(keys, ticks.tolist(), strict=True)]).T
    assert np.array_equal(halves(Key(Vector(columns)), 3, ticks, 3), wanted)
    got = through_lanes(lambda a, b, c, d, t: halves(Key(Vector((a, b, c, d))), 3, t, 3), *columns, ticks, double=double)
    assert np.array_equal(got, wanted)


@KINDS
def test_words_are_the_same_where_the_key_or_the_tick_is_a_constant(double):
    one, ticks = key(3, 4), np.array([5.0, 6.0, 70.0])
    wanted = np.array([halves(one, 1, tick, 2) for tick in ticks.tolist()]).T
    assert np.array_equal(halves(one, 1, ticks, 2), wanted)
    assert np.array_equal(through_lanes(lambda t: halves(one, 1, t, 2), ticks, double=double), wanted)
    columns = np.repeat(np.array(one.words.entries)[:, None], 3, axis=1)
    got = through_lanes(lambda *words: halves(Key(Vector(words)), 1, 6.0, 2), *columns, double=double)
    assert np.array_equal(got[:, 0], wanted[:, 1])


@KINDS
def test_numbers_on_lanes_are_those_on_floats_in_f32_to_rounding(double):
    ticks = np.arange(3000.0)
    columns = np.repeat(np.array(KEYS[1].words.entries)[:, None], len(ticks), axis=1)

    def both(*n):
        drawn = Key(Vector(n[:4])), 2, n[4]
        return [*uniforms(*drawn, 3), *normals(*drawn, 5)]

    got = through_lanes(both, *columns, ticks, double=double)
    wanted = np.array([both(*row) for row in np.concatenate([columns, ticks[None]]).T.tolist()]).T
    if double:
        np.testing.assert_array_equal(got, wanted)
    np.testing.assert_allclose(got[:3], wanted[:3], rtol=1.2e-7)
    np.testing.assert_allclose(got[3:], wanted[3:], rtol=1e-6, atol=5e-6)
    np.testing.assert_array_equal(both(*columns, ticks), wanted)


@KINDS
def test_the_rarest_words_still_give_uniforms_within_the_open_interval_and_finite_normals(monkeypatch, double):
    def law(*halves):
        first, second = ((word(high) << 16) | word(low) for high, low in (halves[:2], halves[2:]))
        monkeypatch.setattr(noise, "draw", lambda *_: [(first, second)])
        return [*uniforms(KEYS[0], 0, 0.0, 2), *normals(KEYS[0], 0, 0.0, 2)]

    columns = np.array([*itertools.product((0, 1, 0xFFFF), (0, 1, 0x7FFF, 0x8000, 0xFFFF), (0, 0xFFFF), (0, 0xFFFF))]).T
    u1, u2, n1, n2 = through_lanes(law, *columns, double=double)
    wanted = [(high * 65536 + low + 0.5) / 2**32 for high, low in (columns[:2], columns[2:])]
    for u, exact in ((u1, wanted[0]), (u2, wanted[1])):
        assert np.all((u > 0.0) & (u < 1.0))
        np.testing.assert_allclose(u, exact, rtol=1e-16 if double else 6e-8)
    radius = np.hypot(n1, n2)
    assert radius.max() == pytest.approx(math.sqrt(66 * math.log(2)))
    np.testing.assert_allclose(radius, np.sqrt(-2 * np.log(wanted[0])), atol=1e-12 if double else 4e-4)


@given(st.integers(0, 2**63), st.integers(0, 2**32 - 1))
def test_a_key_is_four_numbers_below_65536_that_f32_holds(seed, flight):
    words = key(seed, flight).words
    assert len(words) == 4
    assert all(0 <= half < 65536 and half == int(half) == float(np.float32(half)) for half in words)


def test_different_flights_and_different_seeds_have_different_keys():
    flights = [*range(2000), 65535, 65536, 2**31, 2**32 - 1]
    assert len({key(7, flight).words.entries for flight in flights}) == len(flights)
    seeds = [*range(2000), 2**32, 2**32 + 1, 2**33, 2**63, 2**64 - 1]
    assert len({key(seed, 0).words.entries for seed in seeds}) == len(seeds)
    assert len({key(seed, flight).words.entries for seed in range(40) for flight in range(40)}) == 1600


@pytest.mark.parametrize(("seed", "flight"), [(-1, 0), (2**64, 0), (0, -1), (0, 2**32)])
def test_a_seed_or_a_flight_out_of_range_is_refused(seed, flight):
    with pytest.raises(ValueError, match="from 0 to"):
        key(seed, flight)


@pytest.mark.parametrize(("stream", "count"), [(-1, 1), (2**26, 1), (0, 129)])
def test_a_stream_out_of_range_is_refused(stream, count):
    with pytest.raises(ValueError, match="stream"):
        normals(KEYS[0], stream, 0.0, count)
    assert len(normals(KEYS[0], 2**26 - 1, 0.0, 128)) == 128


def test_noise_stays_what_it_was_for_results_that_were_published():
    assert key(1, 2).words.entries == (20622.0, 64300.0, 49374.0, 16176.0)
    wanted = [-0.5428993332983901, -1.2021360375668018, 1.157368816636361]
    np.testing.assert_allclose(array(normals(key(1, 2), 3, 4.0, 3)), wanted, rtol=1e-13)
    np.testing.assert_allclose(array(uniforms(key(1, 2), 3, 4.0, 2)), [0.41897862718906254, 0.6824874525191262], rtol=1e-15)


def test_a_smaller_count_gives_the_first_of_the_same_numbers():
    everything = array(normals(KEYS[0], 1, 5.0, 7))
    assert len(set(everything.tolist())) == 7
    for count in range(8):
        assert array(normals(KEYS[0], 1, 5.0, count)).tolist() == everything[:count].tolist()
        assert len(uniforms(KEYS[0], 1, 5.0, count)) == count


def test_a_flights_noise_does_not_depend_on_the_batch():
    in_batch = np.array([*normals(BATCH, 4, TICK[:, :20], 3)])
    for flight in (0, 17, 49):
        alone = np.array([[*normals(key(SEED, flight), 4, tick, 3)] for tick in TICK[0, :20].tolist()]).T
        np.testing.assert_array_equal(in_batch[:, flight], alone)


def test_normals_have_the_moments_and_tails_of_the_normal_distribution():
    x = np.array([*normals(BATCH, 0, TICK, 4)])
    for each in (*x, x):
        n = each.size
        assert abs(each.mean()) < 4 / math.sqrt(n)
        assert abs(each.var() - 1) < 4 * math.sqrt(2 / n)
        assert abs((each**3).mean()) < 4 * math.sqrt(15 / n)
        assert abs((each**4).mean() - 3) < 4 * math.sqrt(96 / n)
        for bound in (0.5, 1.0, 2.0, 3.0, 4.0):
            p = math.erfc(bound / math.sqrt(2))
            for share in ((each > bound).mean(), (each < -bound).mean()):
                assert abs(share - p / 2) < 4.5 * math.sqrt(p / 2 / n)


def test_uniforms_fill_the_interval_evenly():
    u = np.array([*uniforms(BATCH, 0, TICK, 4)]).ravel()
    counts, _ = np.histogram(u, 256, (0.0, 1.0))
    chi_squared = ((counts - u.size / 256) ** 2).sum() / (u.size / 256)
    assert abs(chi_squared - 255) < 4 * math.sqrt(2 * 255)
    assert u.min() > 0.0
    assert u.max() < 1.0
    assert abs((u * u).mean() - 1 / 3) < 4 * math.sqrt(4 / 45 / u.size)


def test_streams_ticks_flights_and_places_are_uncorrelated():
    first, second = np.array([*normals(BATCH, 0, TICK, 3)]), np.array([*normals(BATCH, 1, TICK, 3)])
    n = first[0].size
    pairs = [*itertools.combinations((*first, *second), 2)]  # places and streams
    pairs += [(x[:, 1:], x[:, :-1]) for x in first]  # ticks
    pairs += [(x[1:], x[:-1]) for x in first]  # flights
    for a, b in pairs:
        assert abs((a * b).mean()) < 4.5 / math.sqrt(n)
        assert abs(((a * a - 1) * (b * b - 1)).mean()) < 4.5 * 2 / math.sqrt(n)


def test_neighbouring_seeds_are_uncorrelated():
    x = np.array([[*normals(key(seed, 0), 0, TICK, 2)] for seed in range(30)])[:, :, 0]
    assert abs((x[1:] * x[:-1]).mean()) < 4.5 / math.sqrt(x[1:].size)
