"""Metrics of where a flight starts, whose distribution is known: the starts of these cases are drawn, nothing else."""

from collections.abc import Mapping
from typing import ClassVar, NamedTuple

from quadstep.interfaces.log import Metric
from quadstep.numbers import Number, absolute, minimum, sqrt, where

UNIT = 0.01
"""Deviation of the starts [m]."""


class First(NamedTuple):
    """What the first sample gave. seen: 0 before it."""

    seen: Number
    value: Number


class FirstSample(Metric):
    """What `of` makes of the first sample's position, in units of 0.01 m."""

    def start(self) -> First:
        return First(0.0, 0.0)

    def add(self, sums: First, sample: Mapping[str, Number]) -> First:
        now = self.of(sample["x"] / UNIT, sample["y"] / UNIT, sample["z"] / UNIT)
        return First(1.0, where(sums.seen > 0.0, sums.value, now))

    def value(self, sums: First) -> Number:
        return sums.value

    def of(self, x: Number, y: Number, z: Number) -> Number:
        raise NotImplementedError


class Sum(FirstSample):
    """In the direction (1, 1, 1): standard normal."""

    name: ClassVar[str] = "sum"

    def of(self, x: Number, y: Number, z: Number) -> Number:
        return (x + y + z) / sqrt(3.0)


class Side(FirstSample):
    """To either side: |x|."""

    name: ClassVar[str] = "side"

    def of(self, x: Number, y: Number, z: Number) -> Number:
        return absolute(x)


class Corner(FirstSample):
    """Into a corner: the lesser of x and y."""

    name: ClassVar[str] = "corner"

    def of(self, x: Number, y: Number, z: Number) -> Number:
        return minimum(x, y)


class Radius(FirstSample):
    """In any direction: the square of the distance, chi-squared with three degrees of freedom."""

    name: ClassVar[str] = "radius"

    def of(self, x: Number, y: Number, z: Number) -> Number:
        return x * x + y * y + z * z


class Edge(FirstSample):
    """The sum of x, y and z: of three uniform numbers, Irwin and Hall's distribution."""

    name: ClassVar[str] = "edge"

    def of(self, x: Number, y: Number, z: Number) -> Number:
        return x + y + z
