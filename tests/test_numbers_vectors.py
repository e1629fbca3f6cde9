"""Vectors, matrices and structures of numbers, against NumPy."""

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadstep.numbers import (
    Matrix,
    Table,
    Vector,
    flatten,
    in_matrix,
    leaf_names,
    matrix,
    outer,
    rebuild,
    solve_symmetric,
    total,
    vector,
)
from tests.flights import array, column, gains

RNG = np.random.default_rng(3)


def random_matrix(rows, columns):
    entries = RNG.normal(size=(rows, columns))
    return matrix(*entries.tolist()), entries


def test_vector_algebra_is_that_of_numpy():
    a, b = RNG.normal(size=(2, 5))
    v, w = column(a), column(b)
    for got, wanted in [
        (v + w, a + b),
        (v - w, a - b),
        (v * w, a * b),
        (v * 2.5, a * 2.5),
        (2.5 * v, 2.5 * a),
        (v / 4.0, a / 4.0),
        (-v, -a),
    ]:
        np.testing.assert_array_equal(array(got), wanted)
    assert v @ w == pytest.approx(a @ b, rel=1e-15)
    assert v.norm() == pytest.approx(np.linalg.norm(a), rel=1e-15)
    assert v[3] == a[3]
    assert len(v) == 5


def test_matrix_algebra_is_that_of_numpy():
    (m, a), (n, b), (p, c) = random_matrix(3, 4), random_matrix(3, 4), random_matrix(4, 2)
    v = RNG.normal(size=4)
    for got, wanted in [(m + n, a + b), (m - n, a - b), (m * 3.0, a * 3.0), (3.0 * m, 3.0 * a), (m.T, a.T)]:
        np.testing.assert_array_equal(array(got), wanted)
    np.testing.assert_allclose(array(m @ p), a @ c, rtol=1e-14, atol=1e-15)
    np.testing.assert_allclose(array(m @ column(v)), a @ v, rtol=1e-14, atol=1e-15)
    assert m.norm() == pytest.approx(np.linalg.norm(a), rel=1e-15)
    assert m[2, 1] == a[2, 1]
    assert len(m) == 3


def test_outer_product_has_the_first_vector_down_the_rows():
    a, b = RNG.normal(size=4), RNG.normal(size=3)
    np.testing.assert_array_equal(array(outer(column(a), column(b))), np.outer(a, b))


def test_total_adds_in_order_without_a_leading_zero():
    assert total([1e16, 1.0, -1e16]) == 0.0
    assert total(["a", "b"]) == "ab"


def test_sizes_that_do_not_agree_are_refused():
    for operation in (lambda: vector(1, 2) + vector(1, 2, 3), lambda: vector(1, 2) @ vector(1, 2, 3)):
        with pytest.raises(ValueError, match="vectors of 2 and 3 entries"):
            operation()


def test_an_array_or_a_numpy_number_times_a_vector_stays_a_vector():
    batch = np.array([1.0, 2.0])
    product = batch * vector(1.0, 3.0)
    assert isinstance(product, Vector)
    assert product[1].tolist() == [3.0, 6.0]
    assert isinstance(np.float64(2.0) * vector(1.0, 3.0), Vector)
    assert isinstance(batch * matrix((1.0, 2.0), (3.0, 4.0)), Matrix)


@given(st.lists(st.floats(-10, 10), min_size=9, max_size=9), st.lists(st.floats(-10, 10), min_size=3, max_size=3))
def test_symmetric_solver_agrees_with_numpy(entries, right):
    root = np.array(entries).reshape(3, 3)
    m = root @ root.T + np.eye(3)
    got = array(solve_symmetric(matrix(*m.tolist()), column(right)))
    wanted = np.linalg.solve(m, right)
    np.testing.assert_allclose(got, wanted, rtol=1e-8, atol=1e-9 * (1 + np.abs(wanted).max()))


def test_symmetric_solver_of_an_indefinite_matrix_by_hand():
    m = matrix((1.0, 2.0, 3.0), (2.0, -1.0, 4.0), (3.0, 4.0, 2.0))
    np.testing.assert_allclose(array(solve_symmetric(m, m @ vector(1.0, -2.0, 3.0))), [1, -2, 3], rtol=1e-14)


class Inner(NamedTuple):
    speed: float
    gain: Matrix


class Outer(NamedTuple):
    direction: Vector
    inner: Inner
    table: Table
    pair: tuple


def example():
    table = Table([1.0, 2.0, 4.0])
    return Outer(vector(1.0, 2.0), Inner(3.0, matrix((4.0, 5.0), (6.0, 7.0))), table, (8.0, vector(9.0)))


def test_a_structure_flattens_depth_first_and_rebuilds_in_the_same_shape():
    structure = example()
    leaves = flatten(structure)
    assert leaves == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, structure.table, 8.0, 9.0]
    copy = rebuild(structure, iter(leaves))
    assert flatten(copy) == leaves
    assert isinstance(copy, Outer)
    assert isinstance(copy.inner, Inner)
    assert isinstance(copy.inner.gain, Matrix)
    assert copy.inner.gain[1, 0] == 6.0
    assert isinstance(copy.pair, tuple)
    shifted = rebuild(structure, iter(range(10)))
    assert flatten(shifted) == list(range(10))


def test_every_leaf_has_a_dotted_name_in_the_order_of_the_leaves():
    assert leaf_names(example()) == [
        "direction.0",
        "direction.1",
        "inner.speed",
        "inner.gain.0.0",
        "inner.gain.0.1",
        "inner.gain.1.0",
        "inner.gain.1.1",
        "table",
        "pair.0",
        "pair.1.0",
    ]
    assert len(set(leaf_names(gains()))) == len(flatten(gains()))


def test_entries_of_matrices_are_told_from_other_leaves():
    assert in_matrix(example()) == [False, False, False, True, True, True, True, False, False, False]


def test_a_table_is_looked_up_by_floats_and_by_arrays():
    table = Table([1.0, 2.0, 4.0])
    assert table.size == 3
    assert table.at(2.0) == 4.0
    assert table.at(np.array([0.0, 2.0, 1.0])).tolist() == [1.0, 4.0, 2.0]
