"""One independent estimate of a probability of failure."""

from typing import NamedTuple

import numpy as np

from quadstep.rare.points import Floats, Points

LEAST = 1e-12
"""A probability below which a replicate gives up."""

MOST_KEPT = 0.5
"""Share of the flights beyond a threshold above which a score that takes few values leads nowhere."""


class Level(NamedTuple):
    """A nested event: the score is at least the threshold, or the flight fails; None: it fails. With its probability."""

    threshold: float | None
    probability: float


class Replicate(NamedTuple):
    """probability: 0 where no failure was reached. flights: all that were flown; crude: drawn as the campaign draws, and how
    many of them failed. failures: some flights that failed.
    """

    probability: float
    flights: int
    crude: int
    crude_failures: int
    levels: tuple[Level, ...]
    failures: Points


def beyond(scores: Floats, share: float) -> float:
    """A threshold that about this share of the scores reaches; of equal scores all or none, whichever is closer."""
    values, counts = np.unique(scores, return_counts=True)
    reached = np.cumsum(counts[::-1])[::-1] / len(scores)
    return float(values[np.argmin(np.abs(np.log(reached / share)))])
