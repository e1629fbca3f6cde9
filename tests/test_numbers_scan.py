"""A scan is the same to the bit as its turns one after the other, on every kind of number, however it is nested."""

import tempfile
from pathlib import Path

import numpy as np
import pytest
import sympy

from quadstep.numbers import Matrix, Vector, exp, matrix, scan, shortcut, sin, vector, where
from quadstep.numbers.noise import Key, normals
from tests.exports import COMPILERS, through_c
from tests.flights import through_lanes
from tests.pages import NODE
from tests.scripts import through_script
from tests.single import Single

RNG = np.random.default_rng(11)
COLUMNS = RNG.normal(size=(6, 13))


def turn_by_turn(step, carry, rows, times=None, backwards=False):
    """What `scan` should give: Python's own loop over the rows of one matrix."""
    count = times if rows == () else len(rows)
    made = {}
    for place in reversed(range(count)) if backwards else range(count):
        carry, made[place] = step(carry, () if rows == () else rows.rows[place])
    return carry, Matrix([made[place] for place in range(count)])


def agree(law, *columns):
    """The law of (`scan` or Python's loop, then numbers) on lanes of both kinds, on arrays and on floats."""
    for double in (True, False):
        looped, unrolled = (
            through_lanes(lambda *numbers, way=way: law(way, *numbers), *columns, double=double)
            for way in (scan, turn_by_turn)
        )
        np.testing.assert_array_equal(looped, unrolled)
    looped = np.atleast_2d(through_lanes(lambda *numbers: law(scan, *numbers), *columns))
    np.testing.assert_array_equal(looped, np.array(np.broadcast_arrays(*law(scan, *columns))))
    floats = np.array([law(turn_by_turn, *row) for row in np.array(columns).T.tolist()]).T
    np.testing.assert_array_equal(looped, floats)
    if COMPILERS:
        with tempfile.TemporaryDirectory() as folder:
            np.testing.assert_array_equal(
                through_c(Path(folder), lambda *numbers: list(law(scan, *numbers)), *columns), floats
            )
    if NODE is not None:
        np.testing.assert_array_equal(through_script(lambda *numbers: list(law(scan, *numbers)), *columns), floats)


def recursion(way, a, b, c, d, e, f, backwards=False):
    def step(carry, row):
        x, y = carry
        return (sin(x * row[0]) + d, y - row[1] * e), vector(x + y, row[0] * f, y)

    (x, y), made = way(step, (a, b), matrix((a, b), (c, d), (e, f), (b, c)), backwards=backwards)
    return [x, y, *(entry for row in made for entry in row)]


@pytest.mark.parametrize("backwards", [False, True])
def test_rows_in_and_out_in_both_directions(backwards):
    agree(lambda way, *numbers: recursion(way, *numbers, backwards=backwards), *COLUMNS)


def test_a_loop_within_a_loop_and_what_it_takes_from_around():
    def law(way, a, b, c, d, e, f):
        common = exp(d)

        def outer(carry, _):
            x, kept = carry
            shifted = x + common

            def inner(total, row):
                return where(row[0] > 0.0, total + row[0] * shifted, total - common), vector(row[1] * shifted, total)

            x, kept = way(inner, x, kept)
            return (0.5 * x, kept), vector(x)

        (x, kept), made = way(outer, (a, matrix((a, b), (c, d), (e, f))), (), times=4)
        again, _ = way(lambda total, row: (total + row[0] * row[1], row), x, kept, backwards=True)
        return [x, again, *(entry for row in kept for entry in row), *(row[0] for row in made)]

    agree(law, *COLUMNS)


def test_the_carry_passes_through_swaps_and_starts_from_a_constant():
    def law(way, a, b, c, d, e, f):
        def step(carry, row):
            first, second, count, same = carry
            return (second, first, count + 1.0, same), vector(count, 2.0, first)

        (first, second, count, same), made = way(step, (a, b, 0.0, c), matrix((a, b), (c, d), (e, f)))
        return [first, second, count, same, *(entry for row in made for entry in row)]

    agree(law, *COLUMNS)


def test_matrices_that_stay_in_memory_change_places_and_grow():
    """Arrays of C: swapped, scaled and written over while others are still read."""

    def law(way, a, b, c, d, e, f):
        first = matrix((a, b), (b, c), (c, d), (d, e), (e, f), (f, a))
        second = 0.5 * first

        def step(carry, row):
            ours, theirs, total = carry
            grown = theirs + row[0] * ours
            return (grown, ours, total + grown[2, 1] * row[1]), vector(ours[0, 0] + total)

        (ours, theirs, total), made = way(step, (first, second, 0.0), first)
        both = ours + theirs
        return [total, *(one[0] for one in made), *(entry for row in both for entry in row)]

    agree(law, *COLUMNS)


def test_noise_drawn_in_a_loop_is_that_of_its_counter(tmp_path):
    words = RNG.integers(0, 65536, size=(4, 5)).astype(float)

    def law(way, *numbers):
        def step(tick, _):
            return tick + 1.0, normals(Key(Vector(numbers)), 7, tick, 3)

        tick, made = way(step, numbers[0], (), times=3)
        return [tick, *(entry for row in made for entry in row)]

    looped = through_lanes(lambda *numbers: law(scan, *numbers), *words)
    floats = np.array([law(turn_by_turn, *row) for row in words.T.tolist()]).T
    np.testing.assert_array_equal(looped, floats)
    if COMPILERS:
        np.testing.assert_array_equal(through_c(tmp_path, lambda *numbers: law(scan, *numbers), *words), floats)
    single = [[float(one) for one in law(turn_by_turn, *map(Single, row))] for row in words.T.tolist()]
    narrow = through_lanes(lambda *numbers: law(scan, *numbers), *words, double=False)
    np.testing.assert_array_equal(narrow, np.array(single, dtype=np.float32).T)


def test_symbols_get_the_turns_one_after_the_other():
    x = sympy.Symbol("x")
    carry, made = scan(lambda last, row: (last * x + row[0], vector(last)), x, matrix((1.0,), (2.0,)))
    assert sympy.expand(carry - (x**3 + x + 2.0)) == 0
    assert sympy.expand(made[1, 0] - (x**2 + 1.0)) == 0


def test_the_code_does_not_grow_with_the_turns():
    from llvmlite import ir

    from quadstep.program.emitter import Emitter
    from quadstep.program.recorded import RecordedNumber

    def size(times):
        function = ir.Function(ir.Module(), ir.FunctionType(ir.VoidType(), [ir.DoubleType()]), "probe")
        builder = ir.IRBuilder(function.append_basic_block("entry"))
        x = RecordedNumber(Emitter(builder, ir.DoubleType(), 1), function.args[0])
        scan(lambda last, _: (sin(last), ()), x, (), times=times)
        return len(str(function).splitlines())

    assert size(100) == size(2)


def test_what_is_no_scan_is_refused():
    def step(carry, row):
        return carry, row

    for wrong in ({}, {"times": 0}, {"rows": matrix((1.0,)), "times": 2}, {"rows": (matrix((1.0,)), matrix((1.0,), (2.0,)))}):
        with pytest.raises(ValueError, match="one number of turns"):
            scan(step, 0.0, **wrong)
    with pytest.raises(TypeError, match="had 1 numbers and has 2"):
        scan(lambda carry, row: ((carry, carry), row), 0.0, matrix((1.0,)))


@pytest.mark.parametrize("double", [True, False])
def test_a_shortcut_is_taken_only_where_it_holds_in_all_lanes(double):
    """Here its result is another one, so that it shows; what is known in the branch alone is computed again after it."""

    def law(x):
        found = shortcut((x, 2.0 * x), lambda both: (both[0] < 1.0, (-both[0], 0.5)), lambda both: (sin(both[1]), both[0]))
        return [*found, sin(2.0 * x)]

    columns = np.array([0.1, 0.2, 0.3, 0.9, 0.1, 0.2, 1.0, 0.4, 5.0, 6.0, 7.0, np.nan])
    lanes = through_lanes(law, columns, double=double)
    full = through_lanes(lambda x: [sin(2.0 * x), x, sin(2.0 * x)], columns, double=double)
    np.testing.assert_array_equal(lanes[:, 4:], full[:, 4:])
    np.testing.assert_array_equal(lanes[:2, :4], np.array([-full[1, :4], [0.5] * 4]))
    np.testing.assert_array_equal(lanes[2], full[2])
    if double:  # all others ignore it
        np.testing.assert_array_equal(np.array(law(columns)), full)
        np.testing.assert_array_equal(np.array([law(x) for x in columns.tolist()]).T, full)
        np.testing.assert_array_equal(through_lanes(law, columns, width=1), full)
