"""One independent estimate of the probability of one kind of failure."""

from typing import NamedTuple

import numpy as np

from quadstep.studies.rare.points import Floats, Points

LEAST = 1e-12
"""Probability below which a replicate gives up."""

NEGLIGIBLE = 0.01
"""Share of the other events' probability below which an event need not be followed further."""

MOST_KEPT = 0.5
"""Share of flights beyond a threshold above which a score with few distinct values makes no progress."""


class Level(NamedTuple):
    """A nested event: the score is at least the threshold, or the flight fails; None: it fails. With its probability."""

    threshold: float | None
    probability: float


class Replicate(NamedTuple):
    """A replicate. probability: 0 if no failure was reached. crude: flights drawn as the campaign draws, and how many of them
    failed. failures: some flights that failed.
    """

    probability: float
    crude: int
    crude_failures: int
    levels: tuple[Level, ...]
    failures: Points


def beyond(scores: Floats, share: float) -> float:
    """A threshold that about this share of the scores reaches; equal scores all count or none, whichever is closer."""
    values, counts = np.unique(scores, return_counts=True)
    reached = np.cumsum(counts[::-1])[::-1] / len(scores)
    return float(values[np.argmin(np.abs(np.log(reached / share)))])
