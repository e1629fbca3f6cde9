"""What failures go with, where that is not chance: what all flights of a kind have in common, and the keys over which the
share of failures differs.

A part of the flights, chosen by their keys alone, would hold so many of the failures by chance with at most the probability
of Hoeffding's bound for draws without replacement (1963); it counts as often as there are parts and sides to choose from.
"""

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pyarrow.compute as pc
from numpy.typing import NDArray

from quadstep.metrics.statistics import LEVEL
from quadstep.mission.fields import unit, words
from quadstep.report import units
from quadstep.studies.campaign.flyer import OUTCOME, OUTCOMES, SUCCESS
from quadstep.studies.campaign.schema import Campaign
from quadstep.studies.campaign.store import Store
from quadstep.studies.campaign.varied import VariedKey, varied_keys

Flights = NDArray[np.bool_]

FEWEST, MOST, DIGITS = 3, 0.6, 3
"""Fewest flights that have anything in common; most of all flights that may; digits of where a key begins or ends."""

GROUPS, A_GROUP, NAMED = 5, 20, 3
"""Groups of equal count by a number, the fewest flights of one that is told, and the most keys."""


class Split(NamedTuple):
    """Flights by a key. groups: by its values, in order, and what they are called; ranged: whether by ranges; shares: of them
    that fail; more: whether more than can be chance; clear: whether any are more, or fewer.
    """

    key: str
    ranged: bool
    groups: list[tuple[Flights, str]]
    shares: list[float]
    more: list[bool]
    clear: bool

    @property
    def worst(self) -> int:
        return int(np.argmax(self.shares))

    @property
    def between(self) -> float:
        """How much the shares differ: their variance, times the number of flights."""
        sizes = [int(part.sum()) for part, _ in self.groups]
        return float(np.cov(self.shares, fweights=sizes, ddof=0)) * sum(sizes) if len(sizes) > 1 else 0.0

    @property
    def sentence(self) -> str:
        """Where most fail and where fewest; both ends of the key, where more fail at both."""
        best, last = int(np.argmin(self.shares)), len(self.shares) - 1
        ends = [0, last] if self.ranged and 0 < best < last and self.more[0] and self.more[last] else [self.worst]
        said = [
            f"{units.percent(self.shares[one])} {'' if self.ranged else 'with '}{self.groups[one][1]}" for one in (*ends, best)
        ]
        said[0] = said[0].replace("%", "% fail", 1)
        return f"{words(self.key)}: {units.listed(said[:-1])}, but {said[-1]}"

    @property
    def at_worst(self) -> str:
        return f"{words(self.key)} {self.groups[self.worst][1]}" if self.ranged else self.groups[self.worst][1]


def failures_go_with(store: Store, campaign: Campaign) -> list[str]:
    """`findings` of a campaign's flights."""
    flown, columns = store.read([OUTCOME, SUCCESS]), varied_keys(store, campaign.file)
    failed, early = ~flown[SUCCESS].to_numpy(), pc.not_equal(flown[OUTCOME].cast("string"), OUTCOMES[0]).to_numpy()
    kinds = {"flights above a limit": failed & ~early, "lost flights": early}
    return findings(failed, kinds, columns, {key: unit(campaign.mission, key) for key in columns})


def findings(
    failed: Flights, kinds: Mapping[str, Flights], columns: Mapping[str, VariedKey], unit_of: Mapping[str, str]
) -> list[str]:
    """What failures go with, in sentences. kinds, unit_of: as `in_common` has them."""
    found = splits(failed, columns, unit_of)[:NAMED]
    said = [f"How many flights fail varies with {'; with '.join(one.sentence for one in found)}."] if found else []
    said += [*joint(failed, found[:2], groups_of(columns) ** 2), *in_common(kinds, columns, unit_of)]
    if said and not any(key.startswith("controller") for key in columns):
        said.append("No gain varies here, so these flights do not say which gains would help.")
    return said


def groups_of(columns: Mapping[str, VariedKey]) -> int:
    return sum(GROUPS if one.options is None else len(one.options) for one in columns.values())


def splits(failed: Flights, columns: Mapping[str, VariedKey], unit_of: Mapping[str, str]) -> list[Split]:
    """The keys over which the share of failures differs, those first whose groups differ most."""
    tried = groups_of(columns)
    found = [split(failed, key, one, unit_of[key], tried) for key, one in columns.items()]
    return sorted([one for one in found if one.clear], key=lambda one: -one.between)


def split(failed: Flights, key: str, one: VariedKey, unit: str, tried: int) -> Split:
    """tried: groups of all keys."""
    groups = [group for group in grouped(key, one, unit) if group[0].sum() >= A_GROUP]
    clear = [2 * tried * chance(failed, part) < 1.0 - LEVEL for part, _ in groups]
    shares = [float(failed[part].mean()) for part, _ in groups]
    more = [sure and share > failed.mean() for sure, share in zip(clear, shares, strict=True)]
    return Split(key, one.options is None, groups, shares, more, any(clear))


def joint(failed: Flights, found: Sequence[Split], tried: int) -> list[str]:
    """That most fail where two keys are at their worst, if more do than can be chance where either is."""
    if len(found) < 2:
        return []
    either = [one.groups[one.worst][0] for one in found]
    both = either[0] & either[1]
    share = float(failed[both].mean()) if both.sum() >= A_GROUP else 0.0
    if any(share <= failed[part].mean() or tried * chance(failed[part], both[part]) >= 1.0 - LEVEL for part in either):
        return []
    return [f"With {found[0].at_worst} and {found[1].at_worst} together, {units.percent(share)} fail."]


def chance(failed: Flights, part: Flights) -> float:
    """At most how likely it is that a part of the flights, drawn at random, holds as many of the failures, or as few."""
    flights, count, size, hit = len(failed), int(failed.sum()), int(part.sum()), int((failed & part).sum())
    return min(bound(hit, count, size / flights), bound(hit, size, count / flights))


def bound(hit: int, drawn: int, share: float) -> float:
    """On how likely it is that so many of those drawn are of a share of all."""
    if not drawn or share in (0.0, 1.0):
        return 1.0
    sides = ((hit / drawn, share), (1.0 - hit / drawn, 1.0 - share))
    return math.exp(-drawn * sum(p * math.log(p / q) for p, q in sides if p > 0.0))


def grouped(key: str, one: VariedKey, unit: str) -> list[tuple[Flights, str]]:
    """All flights by the values of a key: each, or about a fifth of the flights; and what the group is called."""
    if one.options is not None:
        return [(one.values == place, with_option(key, text)) for place, text in enumerate(one.options)]
    ends = np.quantile(one.values, np.linspace(0.0, 1.0, GROUPS + 1)[1:-1])
    edges = np.unique([units.rounded_down(float(end), DIGITS) for end in ends])
    places, shown = np.searchsorted(edges, one.values, side="right"), [units.number(float(edge)) for edge in edges]
    between = [f"from {low} to {high}" for low, high in itertools.pairwise(shown)]
    told = [f"below {shown[0]}", *between, f"from {shown[-1]}"]
    return [
        (places == at, f"{text}{units.unit_suffix(unit or '-')}{' on' * (at == len(edges))}") for at, text in enumerate(told)
    ]


def with_option(key: str, text: str) -> str:
    return f"{words(key)} {({'true': 'on', 'false': 'off'}).get(text, f'= {text}')}"


def in_common(kinds: Mapping[str, Flights], columns: Mapping[str, VariedKey], unit_of: Mapping[str, str]) -> list[str]:
    """A sentence for each kind of flight that has something in common. kinds: which flights are of each, by what they are
    called. unit_of: each key.

    So many flights of a kind would be among those that fit with at most this probability by chance (they are drawn without
    replacement); it counts as often as there are keys, values and kinds to choose from.
    """
    tests = len(kinds) * sum(2 if one.options is None else len(one.options) for one in columns.values())
    said = []
    for kind, chosen in kinds.items():
        found = [(fit, text) for key, one in columns.items() for fit, text in shared(key, one, chosen, unit_of[key])]
        count, flights = int(chosen.sum()), len(chosen)
        fit, text = min(found, key=lambda one: int(one[0].sum()), default=(np.ones(flights, bool), ""))
        if count >= FEWEST and fit.mean() <= MOST and tests * (fit.sum() / flights) ** count < 1.0 - LEVEL:
            said.append(f"All {count} {kind} had {text}, as {fit.sum()} of all {flights} flights did.")
    return said


def shared(key: str, one: VariedKey, chosen: Flights, unit: str) -> list[tuple[Flights, str]]:
    """What the chosen flights share in a key: all flights that fit, and how it is said."""
    values = one.values[chosen]
    if not len(values) or (one.options and np.ptp(values)):
        return []
    if one.options:
        return [(one.values == values[0], with_option(key, one.options[int(values[0])]))]
    what = f"{'an' if words(key)[0] in 'aeio' else 'a'} {words(key)} of"
    low, high = units.rounded_down(float(values.min()), DIGITS), units.rounded_up(float(values.max()), DIGITS)
    return [(where, f"{what} {how} {units.number(end)}{units.unit_suffix(unit or '-')}") for where, how, end in (
        (one.values >= low, "at least", low), (one.values <= high, "at most", high))]  # fmt: skip
