"""Projection: keeping what integrates or learns within a bound."""

from quadstep.numbers import Matrix, Number, Vector, where


def project(entries: Vector, bound: Number) -> Vector:
    """The nearest vector of length at most `bound`."""
    return shrink(entries.norm(), bound) * entries


def integral_for(part: Vector, gain: Vector, bound: Number) -> Vector:
    """The integral, within its bound, that adds `part` to a law with this gain; 0 along axes whose gain is 0."""
    return project(Vector(where(k > 0.0, one / where(k > 0.0, k, 1.0), 0.0) for one, k in zip(part, gain, strict=True)), bound)


def project_weights(weights: Matrix, bound: Number) -> Matrix:
    """The nearest matrix of Frobenius norm at most `bound`."""
    return shrink(weights.norm(), bound) * weights


def shrink(length: Number, bound: Number) -> Number:
    """The factor, at most 1, that brings `length` down to `bound`."""
    long = length > bound
    return where(long, bound / where(long, length, 1.0), 1.0)
