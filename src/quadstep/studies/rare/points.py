"""Flights as points: the values drawn for each as independent standard normal numbers, and the flight whose noise it gets."""

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from quadstep.numbers.noise import normals, uniforms
from quadstep.studies.campaign.draws import A_TICK, STREAM, noise_keys

FIRST = 2**31
"""The first flight's number, beyond those of campaigns."""

A_REPLICATE = 2**24
"""Flight numbers reserved for each replicate, more than it can use."""

LATENT, CHOSEN = STREAM + 1, STREAM + 2
"""Streams of random numbers: for the points, and for the choices made with them."""

Numbers: TypeAlias = NDArray[np.int64]
Floats: TypeAlias = NDArray[np.float64]


class Points(NamedTuple):
    """latent: shape (flights, dimensions); noise: the number of the flight whose noise each of them gets."""

    latent: Floats
    noise: Numbers

    def at(self, places: NDArray[np.bool_] | Numbers) -> "Points":
        return Points(self.latent[places], self.noise[places])


def joined(some: list[Points]) -> Points:
    return Points(np.concatenate([one.latent for one in some]), np.concatenate([one.noise for one in some]))


Evaluate: TypeAlias = Callable[[Points], Floats]
"""How close to each kind of failure each flight came, infinite where it failed so. Shape (events, flights)."""


class Random:
    """The random numbers of one replicate: each flight that it requests has a number, which determines all of them."""

    def __init__(self, seed: int, replicate: int, dimensions: int) -> None:
        self.seed, self.replicate, self.dimensions = seed, replicate, dimensions
        self.next = FIRST + replicate * A_REPLICATE

    def after(self, places: int) -> "Random":
        return Random(self.seed, self.replicate + places, self.dimensions)

    def points(self, count: int) -> Points:
        numbers = np.arange(self.next, self.next + count)
        self.next += count
        keys, ticks = noise_keys(self.seed, numbers), range(-(-self.dimensions // A_TICK))
        columns = [
            column
            for tick in ticks
            for column in normals(keys, LATENT, float(tick), min(A_TICK, self.dimensions - tick * A_TICK))
        ]
        return Points(np.stack(columns, axis=1), numbers)

    def uniform(self, points: Points) -> Floats:
        """A number in (0, 1) for each new point."""
        (chosen,) = uniforms(noise_keys(self.seed, points.noise), CHOSEN, 0.0, 1)
        return np.asarray(chosen, dtype=np.float64)
