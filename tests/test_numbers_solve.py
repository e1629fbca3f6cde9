"""Small linear systems against NumPy and against arithmetic of many digits, ill-conditioned ones among them."""

import mpmath
import numpy as np
import pytest

from quadstep.numbers import Vector
from quadstep.numbers.functions import evenly_spaced
from quadstep.numbers.solve import cholesky, factored, least_norm_inverse, rank, solve_definite, solve_square

RNG = np.random.default_rng(20)
EPSILON = np.finfo(float).eps


def rows_of(matrix):
    return [Vector(row) for row in matrix.tolist()]


def lower(matrix):
    return [row[: i + 1] for i, row in enumerate(matrix.tolist())]


def hilbert(count):
    """A symmetric positive definite matrix that is the worse conditioned the larger it is: 1e13 for ten rows."""
    i = np.arange(count)
    return 1.0 / (i[:, None] + i + 1.0)


def banded(count, width):
    matrix = RNG.normal(size=(count, count))
    matrix[np.abs(np.subtract.outer(np.arange(count), np.arange(count))) > width] = 0.0
    return matrix @ matrix.T  # of twice the width


def exact(matrix, right):
    with mpmath.workdps(60):
        solved = mpmath.lu_solve(mpmath.matrix(matrix.tolist()), mpmath.matrix(right.tolist()))
        return np.array([float(value) for value in solved])


DEFINITE = {
    "one": np.array([[3.0]]), "six": banded(6, 6), "sixty": banded(60, 40), "hilbert 5": hilbert(5), "hilbert 9": hilbert(9),
}  # fmt: skip


@pytest.mark.parametrize("name", DEFINITE)
def test_a_definite_system_is_solved_as_well_as_its_condition_allows(name):
    matrix = DEFINITE[name]
    right = RNG.normal(size=(2, len(matrix)))
    solved = np.array(solve_definite(lower(matrix), right.tolist()))
    for x, b in zip(solved, right, strict=True):
        assert np.linalg.norm(matrix @ x - b) < 4.0 * EPSILON * len(b) * np.linalg.norm(matrix) * np.linalg.norm(x)
        assert np.linalg.norm(x - exact(matrix, b)) < 4.0 * EPSILON * np.linalg.cond(matrix) * np.linalg.norm(x)


def test_rows_that_begin_late_are_those_with_zeros_before():
    matrix, b = banded(30, 2), RNG.normal(size=30)
    ragged = [row[np.flatnonzero(row)[0] : i + 1] for i, row in enumerate(matrix)]
    assert max(map(len, ragged)) == 5
    assert solve_definite([row.tolist() for row in ragged], [b.tolist()]) == solve_definite(lower(matrix), [b.tolist()])


def test_rows_may_begin_before_those_above_them():
    arrow = np.diag([2.0, 3.0, 4.0, 9.0])
    arrow[3, :3] = arrow[:3, 3] = 1.0
    rows, b = [[2.0], [3.0], [4.0], [1.0, 1.0, 1.0, 9.0]], [1.0, -2.0, 0.5, 3.0]
    np.testing.assert_allclose(solve_definite(rows, [b])[0], np.linalg.solve(arrow, b), rtol=1e-14)


@pytest.mark.parametrize("matrix", [[[0.0]], [[-1.0]], [[1.0, 1.0], [1.0, 1.0]], [[1.0, 2.0], [2.0, 1.0]], [[np.nan]]])
def test_what_is_not_positive_definite_is_refused(matrix):
    with pytest.raises(ValueError, match="positive definite"):
        factored(lower(np.array(matrix)))


@pytest.mark.parametrize("name", DEFINITE)
def test_cholesky_is_numpys_and_multiplies_back(name):
    matrix = DEFINITE[name]
    factor = np.array(cholesky(matrix.tolist()))
    assert (np.triu(factor, 1) == 0.0).all()
    np.testing.assert_allclose(factor @ factor.T, matrix, rtol=1e-14, atol=1e-14 * np.abs(matrix).max())
    apart = EPSILON * np.linalg.cond(matrix) * np.abs(factor).max()
    np.testing.assert_allclose(factor, np.linalg.cholesky(matrix), atol=apart)


@pytest.mark.parametrize("count", [1, 2, 5, 12])
def test_a_square_system_is_solved_whatever_the_order_of_its_rows(count):
    matrix, b = RNG.normal(size=(count, count)) * 10.0 ** RNG.uniform(-3, 3, (count, 1)), RNG.normal(size=count)
    for order in (np.arange(count), np.arange(count)[::-1]):
        x = np.array(solve_square(matrix[order].tolist(), b[order].tolist()))
        assert np.linalg.norm(x - exact(matrix, b)) < 8.0 * EPSILON * np.linalg.cond(matrix) * np.linalg.norm(x)
    swapped = [[0.0, 1.0], [2.0, 0.0]]
    assert solve_square(swapped, [3.0, 4.0]) == [2.0, 3.0]


def test_a_singular_system_is_refused():
    with pytest.raises(ValueError, match="singular"):
        solve_square([[1.0, 2.0], [2.0, 4.0]], [1.0, 1.0])


@pytest.mark.parametrize("apart", [1.0, 1e-3, 1e-6])
def test_the_least_norm_inverse_is_the_pseudo_inverse_even_of_rows_that_are_almost_dependent(apart):
    for columns in (4, 5, 8):
        matrix = RNG.normal(size=(4, columns)) * np.array([[1.0], [0.1], [0.1], [0.01]])
        matrix[2] = matrix[1] + apart * matrix[2]
        ours = np.array([list(share) for share in least_norm_inverse(rows_of(matrix))])
        with mpmath.workdps(60):
            given = mpmath.matrix(matrix.tolist())
            wanted = np.array((given.T * (given * given.T) ** -1).tolist(), dtype=float)
        scale = matrix / np.linalg.norm(matrix, axis=1, keepdims=True)  # sizes of rows do not count
        wrong = np.abs(ours - wanted) / np.abs(wanted).max(axis=0)
        assert wrong.max() < 4.0 * EPSILON * np.linalg.cond(scale)
        assert np.linalg.norm(matrix @ ours - np.eye(4)) < 1e-11 / apart


def test_the_least_norm_inverse_of_arrays_is_that_of_each_element():
    matrices = RNG.normal(size=(7, 4, 6))
    together = least_norm_inverse([Vector(matrices[:, i, j] for j in range(6)) for i in range(4)])
    for place, matrix in enumerate(matrices):
        alone = least_norm_inverse(rows_of(matrix))
        assert [[entry[place] for entry in share] for share in together] == [list(share) for share in alone]


def test_the_rank_counts_rows_that_are_apart_whatever_their_size():
    rows = RNG.normal(size=(4, 6)) * np.array([[1e6], [1.0], [1e-9], [1e3]])
    assert rank(rows_of(rows), 1e-6) == 4
    rows[1] = 2.0 * rows[0] - rows[3]
    assert rank(rows_of(rows), 1e-6) == 3
    rows[2] = 0.0
    assert rank(rows_of(rows), 1e-6) == 2
    assert rank(rows_of(np.zeros((4, 5))), 1e-6) == 0
    near = np.eye(4, 6)
    near[3, :4] = [1.0, 0.0, 0.0, 1e-5]
    assert (rank(rows_of(near), 1e-6), rank(rows_of(near), 1e-4)) == (4, 3)


def test_evenly_spaced_numbers_are_numpys():
    for low, high in np.sort(RNG.normal(size=(50, 2)) * 10.0 ** RNG.uniform(-3, 6, (50, 1)), axis=1).tolist():
        for count in (1, 2, 3, 101):
            assert evenly_spaced(low, high, count) == np.linspace(low, high, count).tolist()
