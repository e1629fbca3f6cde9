"""The varying keys of a campaign, read back from its files: one key at a time, as numbers or as a few values."""

import contextlib
import json
from collections.abc import Sequence
from typing import Any, NamedTuple, cast

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from quadstep.mission.distributions import Choice, CorrelatedKeys, Distribution, Grid, LogNormal, Normal, Sobol, Uniform
from quadstep.mission.fields import dotted, words
from quadstep.report import units
from quadstep.studies.campaign.schema import CampaignFile
from quadstep.studies.campaign.sensitivity import FlightParts, parts_of
from quadstep.studies.campaign.store import Store

MOST_VALUES = 40
"""Most values of a key shown one by one. More numbers are divided into ranges; of more texts the rarest are merged."""

OTHERS = "all others"
WIDTH = 48
"""Most characters of a value's text."""

BINS, A_BIN = 24, 20
"""Number of ranges of equal width that a number is shown in, and the fewest flights in a range at either end."""

ON, OFF = "on", "off"
"""How true and false are called."""

DECADES = 20.0
"""Ratio of the ends above which an axis is logarithmic."""


class VariedKey(NamedTuple):
    """A key. values: one number per flight, or the place of its value among `options`, texts; parts: for its index."""

    values: NDArray[Any]
    options: tuple[str, ...] | None
    parts: FlightParts


class Bins(NamedTuple):
    """Flights by a key's value, for a picture. places: the bin of each flight. edges: of ranges, or None for `labels`."""

    places: NDArray[np.int64]
    edges: NDArray[np.float64] | None
    labels: tuple[str, ...]
    log: bool = False

    @property
    def size(self) -> int:
        return len(self.labels) if self.edges is None else len(self.edges) - 1


def varied(column: pa.ChunkedArray, distribution: Distribution | None) -> VariedKey:
    """A key from its column. distribution: None for a key that is correlated with others."""
    if not isinstance(distribution, Choice | Grid):
        return numbers(column)
    encoded = column.combine_chunks().dictionary_encode()
    places, found = encoded.indices.to_numpy().astype(np.int64), encoded.dictionary.to_pylist()
    ordered = not isinstance(found[0], bool | str)
    if ordered and len(found) > MOST_VALUES:
        return numbers(column)
    order = np.argsort(found) if ordered else np.argsort(-np.bincount(places), kind="stable")
    rank = np.empty(len(found), dtype=np.int64)
    rank[order] = np.arange(len(found))
    places, texts = rank[places], texts_of([found[i] for i in order])
    if len(texts) > MOST_VALUES:
        places, texts = np.minimum(places, MOST_VALUES - 1), [*texts[: MOST_VALUES - 1], OTHERS]
    return VariedKey(places, tuple(texts), FlightParts(places, len(texts), ordered))


def varied_keys(store: Store, file: CampaignFile) -> dict[str, VariedKey]:
    """All keys of a campaign's flights."""
    return {key: varied(store.read([key])[key], file.vary.get(key)) for key in file.keys}


def numbers(column: pa.ChunkedArray) -> VariedKey:
    values = column.to_numpy().astype(float)
    return VariedKey(values, None, parts_of(values))


def texts_of(values: Sequence[object]) -> list[str]:
    """The values of a column for an axis; for tables, only the entries in which they differ, or that there is none."""
    tables = [leaves(read_back(value)) for value in values]
    common = set.intersection(*({(name, repr(one)) for name, one in table.items()} for table in tables))
    if len(values) > 1:
        tables = [{name: one for name, one in table.items() if (name, repr(one)) not in common} for table in tables]
    if set().union(*tables) <= {"", "type"}:
        return [", ".join(map(text_of, table.values())) or "plain" for table in tables]
    return [text_of(table) or "plain" for table in tables]


def read_back(value: object) -> object:
    """A value of a column, in which tables and lists are JSON."""
    if isinstance(value, str) and value[:1] in ("{", "["):
        with contextlib.suppress(ValueError, RecursionError):
            return json.loads(value)
    return value


def leaves(value: object) -> dict[str, object]:
    """The values in a table by dotted key; a value that is not a table has an empty key."""
    return dotted(value) if isinstance(value, dict) else {"": value}


def text_of(value: object, digits: int = 6) -> str:
    """A value for an axis or a table of the page: numbers to so many digits, a table's type first, and its keys in words."""
    if isinstance(value, bool):
        text = ON if value else OFF
    elif isinstance(value, int | float):
        text = units.numerals(f"{value:.{digits}g}")
    elif isinstance(value, dict):
        parts = {name: text_of(one, digits) for name, one in leaves(value).items()}
        kind = {"type": parts.pop("type")} if "type" in parts else {}
        text = ", ".join([*kind.values(), *(f"{words(name)} = {one}" for name, one in parts.items())])
    else:
        text = value if isinstance(value, str) else f"[{', '.join(text_of(one, digits) for one in cast(list[object], value))}]"
    return text if len(text) <= WIDTH else f"{text[: WIDTH - 1]}…"


def spans_decades(low: float, high: float) -> bool:
    """Whether an axis between these ends is better logarithmic."""
    return low > 0.0 and high > DECADES * low


def bins(one: VariedKey, distribution: Distribution | None) -> Bins:
    """The flights of a key in ranges of equal width, those at the ends merged until they have enough flights; or by value."""
    if one.options is not None:
        return Bins(one.values, None, one.options)
    low, high = float(one.values.min()), float(one.values.max())
    log = isinstance(distribution, LogNormal) and 0.0 < low < high
    edges = np.geomspace(low, high, BINS + 1) if log else np.linspace(low, high, BINS + 1)
    edges = merged(edges, np.bincount(np.searchsorted(edges[1:-1], one.values, side="right"), minlength=BINS))
    return Bins(np.searchsorted(edges[1:-1], one.values, side="right"), edges, (), log)


def merged(edges: NDArray[np.float64], counts: NDArray[np.int64]) -> NDArray[np.float64]:
    """The edges without those that would leave a range with fewer than A_BIN flights."""
    kept, gathered = [edges[0]], 0
    for edge, count in zip(edges[1:], counts, strict=True):
        gathered += int(count)
        if gathered >= A_BIN:
            kept.append(edge)
            gathered = 0
    if len(kept) == 1:
        return edges[[0, -1]]
    kept[-1] = edges[-1]
    return np.array(kept)


def variation_text(file: CampaignFile, key: str) -> str:
    """How a key varies, in words."""
    if key in file.vary:
        return in_words(file.vary[key])
    group = next(one for one in file.correlated if key in one.keys)
    return jointly(group, group.keys.index(key))


def in_words(one: Distribution) -> str:
    if isinstance(one, Uniform):
        return f"{'Sobol sequence' if isinstance(one, Sobol) else 'uniform'} from {one.low:g} to {one.high:g}"
    if isinstance(one, Choice):
        weights = f", weights {listed(one.weights)}" if one.weights else ""
        return f"one of {listed(one.values)}{weights}"
    if isinstance(one, Grid):
        values = listed(one.options) if one.values else f"{one.count} from {one.low:g} to {one.high:g}"
        return f"each of {values} in turn"
    if isinstance(one, LogNormal):
        return f"log-normal, median {one.median:g}, σ {one.sigma:g}{cut_off(one)}"
    return f"normal, mean {one.mean:g}, deviation {one.deviation:g}{cut_off(one)}"


def jointly(group: CorrelatedKeys, place: int) -> str:
    """How a key of a correlated group varies, in words."""
    others = ", ".join(key for key in group.keys if key != group.keys[place])
    deviation = float(np.linalg.norm(group.factor[place]))
    return f"normal, mean {group.mean[place]:g}, deviation {deviation:.6g}, correlated with {others}"


def cut_off(one: Normal | LogNormal) -> str:
    """The truncation of a distribution, in words."""
    ends = [f"{word} {end:g}" for word, end in (("below", one.low), ("above", one.high)) if end is not None]
    return f", nothing {' or '.join(ends)}" if ends else ""


def listed(values: tuple[object, ...]) -> str:
    texts = [text_of(one) for one in values[:10]]
    return ", ".join(texts) + (f" ... ({len(values)})" if len(values) > len(texts) else "")
