"""Columns of drawn values: grouped where equal, checked at the corners of their ranges, compared with single flights."""

import itertools
from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from quadstep.numbers import Table
from quadstep.studies.campaign.draws import Drawn


def corners(low: NDArray[np.float64], high: NDArray[np.float64]) -> Iterator[list[float]]:
    """The corners of a box; if there are too many, its two ends and the corners next to them."""
    ends = [sorted({a.item(), b.item()}) for a, b in zip(low, high, strict=True)]
    if len(ends) <= 5:
        yield from map(list, itertools.product(*ends))
        return
    yield low.tolist()
    yield high.tolist()
    for i in range(len(ends)):
        yield [high[j].item() if i == j else low[j].item() for j in range(len(ends))]
        yield [low[j].item() if i == j else high[j].item() for j in range(len(ends))]


def groups(columns: list[NDArray[np.generic]], count: int) -> Iterator[tuple[tuple[int, ...], NDArray[np.int64]]]:
    """Flights grouped by equal places in these columns: the places, and the flights of each group."""
    if not columns:
        yield (), np.arange(count)
        return
    together = np.stack(columns, axis=1)
    found, which = np.unique(together, axis=0, return_inverse=True)
    order = np.argsort(which.ravel(), kind="stable")
    ends = np.cumsum(np.bincount(which.ravel(), minlength=len(found)))
    for place, members in zip(found, np.split(order, ends[:-1]), strict=True):
        yield tuple(place.tolist()), members


def numbers(drawn: Drawn) -> NDArray[np.float64]:
    """The values of a numeric column."""
    values = drawn.values if drawn.options is None else np.array(drawn.options, dtype=float)[drawn.values]
    result: NDArray[np.float64] = np.asarray(values, dtype=float)
    return result


def option(drawn: Drawn, place: int) -> object:
    """One of a column's options."""
    assert drawn.options is not None
    return drawn.options[place]


def same(alone: object, together: object, place: int) -> bool:
    """Whether a leaf of a single flight equals the arrays' value for it, to the bit."""
    if isinstance(alone, Table) or isinstance(together, Table):
        return isinstance(alone, Table) and isinstance(together, Table) and alone.values == together.values
    return bool(alone == (together[place] if isinstance(together, np.ndarray) else together))


def without(values: Mapping[str, object], name: str) -> dict[str, object]:
    """All entries but one."""
    return {key: value for key, value in values.items() if key != name}


def values_text(values: Mapping[str, object]) -> str:
    """Values on one line."""
    return ", ".join(f"{name} = {value!r:.40}" for name, value in itertools.islice(values.items(), 8))
