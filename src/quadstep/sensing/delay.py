"""Latency: a shift register of whole samples. What is pushed in comes out a fixed number of pushes later.

A line is a plain tuple of samples, oldest first; its length is structure, so that an empty one costs nothing.
"""

from typing import TypeVar

S = TypeVar("S")


def filled(sample: S, count: int) -> tuple[S, ...]:
    """A line of `count` samples that has seen only this one. A sample is any structure of numbers."""
    return (sample,) * count


def pushed(line: tuple[S, ...], sample: S) -> tuple[S, ...]:
    """The line one sample later; its oldest is gone."""
    return (*line, sample)[1:]


def passed(line: tuple[S, ...], sample: S) -> tuple[tuple[S, ...], S]:
    """The line one sample later, and the sample that comes out: the one pushed `len(line)` pushes ago."""
    return pushed(line, sample), (*line, sample)[0]
