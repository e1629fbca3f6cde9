"""A law written once and called several times gives the same in lanes as when inlined, whatever values it captures."""

import numpy as np
import pytest

from quadstep.numbers import Table, Vector, exp, sin, vector, where
from quadstep.numbers.functions import number, word
from quadstep.numbers.scan import repeated
from quadstep.numbers.vectors import matrix
from tests.flights import through_lanes

RNG = np.random.default_rng(5)
COLUMNS = RNG.normal(size=(4, 37))


def in_line(law):
    return law


def agree(law, *columns, **options):
    """The law of (`repeated` or nothing, then numbers) in both ways, and on floats."""
    called, inlined = (
        through_lanes(lambda *numbers, way=way: law(way, *numbers), *columns, **options) for way in (repeated, in_line)
    )
    np.testing.assert_array_equal(called, inlined)
    if "table" not in options:
        floats = np.array([law(repeated, *row) for row in np.array(columns).T.tolist()]).T
        np.testing.assert_array_equal(np.atleast_2d(called), np.atleast_2d(floats))


def test_a_law_that_is_called_three_times():
    def law(way, x, y, a, b):
        step = way(lambda v: vector(v[1] * a + sin(v[0]), v[0] - b))
        return list(step(step(step(vector(x, y)))))

    agree(law, *COLUMNS)


def test_what_is_computed_around_the_law_reaches_it_in_every_call():
    def law(way, x, y, a, b):
        common, chosen = exp(a) + b, a > b
        step = way(lambda v: vector(where(chosen, v[0] * common, v[1]), v[0] + common))
        first = step(vector(x, y))
        return list(step(first * y)) + list(first)

    agree(law, *COLUMNS)


def test_what_passes_through_unchanged_and_what_is_constant():
    def law(way, x, y, a, b):
        step = way(lambda v: (v[1], 3.0, Vector(v[0].entries[::-1])))
        first, three, turned = step((vector(x, y), a))
        again, _, _ = step((turned, b))
        return [first, again, three * x, *turned]

    agree(law, *COLUMNS)


def test_words_and_tables_from_around():
    table = Table(RNG.normal(size=16))

    def law(way, x, entries):
        bits = word(x)
        step = way(lambda v: entries.at(number((word(v) ^ bits) & 15)) + v)
        return [step(x), step(x + 3.0)]

    agree(law, RNG.integers(0, 16, 30).astype(float), table=table)


def test_a_law_within_a_law():
    def law(way, x, y, a, b):
        inner = way(lambda v: v * a + b)
        outer = way(lambda v: vector(inner(v[0]) + inner(v[1]), inner(v[1])))
        return list(outer(outer(vector(x, y))))

    agree(law, *COLUMNS)


def test_two_laws_and_a_law_of_matrices():
    def law(way, x, y, a, b):
        one, two = way(lambda m: m @ m), way(lambda m: m.T + m)
        m = matrix((x, y), (a, b))
        result = two(one(two(m)))
        return [entry for row in result for entry in row]

    agree(law, *COLUMNS)


@pytest.mark.parametrize("double", [True, False], ids=["f64", "f32"])
def test_both_kinds_of_numbers(double):
    def law(way, x, y):
        step = way(lambda v: vector(v[0] + 0.5 * v[1], x - v[0]))
        return list(step(step(vector(x, y))))

    called, inlined = (
        through_lanes(lambda *v, way=way: law(way, *v), *COLUMNS[:2], double=double) for way in (repeated, in_line)
    )
    np.testing.assert_array_equal(called, inlined)


def test_floats_and_arrays_just_call():
    law = repeated(lambda v: v + vector(1.0, 2.0))
    assert list(law(vector(1.0, 1.0))) == [2.0, 3.0]
    assert [entry.tolist() for entry in law(vector(np.zeros(2), np.ones(2)))] == [[1.0, 1.0], [3.0, 3.0]]
