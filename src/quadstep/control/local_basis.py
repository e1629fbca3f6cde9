"""Functions of one number as hats on evenly spaced nodes, a local basis: learning here forgets nothing there."""

from quadstep.numbers import Matrix, Number, Vector, absolute, clip, maximum, total

NODES = 9


def hats(x: Number, spacing: Number) -> Vector:
    """The hats at x: at most two are not 0, and all add up to 1. Nodes stand about 0; beyond the last, its value holds."""
    middle = 0.5 * (NODES - 1)
    place = clip(x / spacing, -middle, middle)
    return Vector(maximum(1.0 - absolute(place - (j - middle)), 0.0) for j in range(NODES))


def values(weights: Matrix, regressors: tuple[Vector, ...]) -> Vector:
    """The functions, one a column of the weights, each at its own regressor."""
    return Vector(
        total([row[i] * phi for row, phi in zip(weights, regressor, strict=True)]) for i, regressor in enumerate(regressors)
    )


def growth(regressors: tuple[Vector, ...], errors: Vector) -> Matrix:
    """phi_i e_i of every function i, a column each."""
    return Matrix(
        Vector(regressor[j] * error for regressor, error in zip(regressors, errors, strict=True)) for j in range(NODES)
    )
