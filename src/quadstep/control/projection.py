"""Projection: keeping what integrates or learns within a bound."""

from quadstep.numbers import Matrix, Number, Vector, where


def project(entries: Vector, bound: Number) -> Vector:
    """The nearest vector of length at most `bound`."""
    return shrink(entries.norm(), bound) * entries


def project_weights(weights: Matrix, bound: Number) -> Matrix:
    """The nearest matrix of Frobenius norm at most `bound`."""
    return shrink(weights.norm(), bound) * weights


def shrink(length: Number, bound: Number) -> Number:
    """The factor, at most 1, that brings `length` down to `bound`."""
    long = length > bound
    return where(long, bound / where(long, length, 1.0), 1.0)
