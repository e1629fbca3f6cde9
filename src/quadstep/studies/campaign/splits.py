"""What failures go with, where that is not chance: the ranges of the keys in which more flights fail, or fewer, overall or
within one value of a choice, and what all flights of a kind have in common.

A part of the flights, chosen by their keys alone, would hold so many of the failures by chance with at most the probability
of Hoeffding's bound for draws without replacement (1963); it counts as often as there are parts and sides to choose from.
"""

import contextlib
import itertools
import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from quadstep.metrics.statistics import LEVEL
from quadstep.mission.fields import unit, words
from quadstep.report import units
from quadstep.studies.campaign.flyer import OUTCOME, OUTCOMES, SUCCESS
from quadstep.studies.campaign.schema import Campaign
from quadstep.studies.campaign.summary import DID
from quadstep.studies.campaign.varied import OFF, ON, VariedKey

Flights = NDArray[np.bool_]
Band = tuple[int, int, str]
"""Failures and flights of a range or a value, and what it is called."""

Findings = dict[str, tuple[str, ...]]
"""Sentences, each with the keys that it names; the first is the one that it is of."""

FEWEST, MOST, DIGITS = 3, 0.6, 3
"""Fewest flights that have anything in common; most of all flights that may; digits of where a key begins or ends."""

STEPS, A_GROUP, NAMED, BANDS = 40, 20, 3, 3
"""About how many ends of ranges a number is tried at; the fewest flights on either side; most keys and most ranges told."""

MOST_LINES = 3
"""Most values of a choice that have lines of their own over the other keys."""


class KeyOrder(NamedTuple):
    """An order of the flights by a key. places: of each flight between the ends that are tried; ends: as they are told; about:
    the value that distances count from, where they are the order. first: of the values, of a choice of numbers.
    """

    key: str
    places: NDArray[np.int64]
    ends: list[str]
    unit: str
    about: str = ""
    ordered: bool = True
    first: str = ""

    def range_text(self, low: int, high: int) -> str:
        """How flights from one place to before another are called."""
        if not self.ordered:
            return f"with {with_option(self.key, self.ends[low])}"
        if self.first:
            values = [self.first, *self.ends][low:high]
            between = " or " if len(values) == 2 else " to "
            return f"at {between.join(dict.fromkeys((values[0], values[-1])))}{self.unit}"
        if not low:
            return f"below {self.ends[high - 1]}{self.unit}"
        if high > len(self.ends):
            return f"at {self.ends[low - 1]}{self.unit} or more"
        return f"at {self.ends[low - 1]} to {self.ends[high - 1]}{self.unit}"


class Split(NamedTuple):
    """Flights by a key. bands: failures and flights of each range or value, and what it is called; score: how much better they
    explain who fails than one share does, less what chance may do; above 0 where they differ by more than chance. within: the
    choice and the one of its values with which these flights are; none for all flights. choice: whether the bands are values.
    about: the value from which distances are the bands. worst: the flights, of all, of the range in which most fail; what it
    is called; and `cost` among all ranges.
    """

    key: str
    bands: list[Band]
    score: float
    within: tuple[str, ...] = ()
    choice: bool = False
    about: str = ""
    worst: tuple[Flights, str, float] | None = None

    @property
    def sentence(self) -> str:
        """How large a share of each band succeeds, the least first; only of the first and the last where there are many."""
        bands = sorted(self.bands, key=lambda one: -one[0] / one[1])
        said = [f"{units.percent(1.0 - hit / size)} {text} ({size:,} flights)" for hit, size, text in bands]
        if len(said) > BANDS:
            said = [f"from {said[0]} to {said[-1]}"]
        begin = f"With {with_option(*self.within)}, the" if self.within else "The"
        what = f"how far {words(self.key)} is from {self.about}" if self.about else words(self.key)
        return f"{begin} success rate varies with {what}: {', '.join(said)}."

    @property
    def faint(self) -> bool:
        """Whether the largest share that fails is below 1.5 times the least and less than 10 points above it: hardly news."""
        shares = [hit / size for hit, size, _ in self.bands]
        return max(shares) < min(1.5 * min(shares), 0.1 + min(shares))

    def successes(self, did: str, failed: Flights, lost: Flights, one: VariedKey, inner: Sequence["Split"]) -> str:
        """Of each value of a choice the share of flights that succeed; where the best one's is lower than another's, with
        doubt unless no range tried would show it by chance; and that more are lost with it, where that is no chance. Nothing
        where there are many values. did: as in `DID`. one: the choice; inner: within its values.
        """
        if not self.choice or len(self.bands) > BANDS:
            return ""
        parts = {f"with {text}": where for text, where in flights_with(self.key, one).items()}
        best = [text for *_, text in sorted(self.bands, key=lambda band: band[0] / band[1])]

        def contrast(bad: Flights, where: Flights | bool = True) -> tuple[list[Band], float, Band]:
            """The flights there with each value, the best one first; how unlikely it is by chance that with another fewer are
            bad, 0 where none is; and the one where it is least likely.
            """
            each = [(int((bad & some).sum()), int(some.sum()), text) for text in best if (some := parts[text] & where).any()]
            (hit, size, _), *others = each
            odds = [(hit * of > less * size) * unlikely(hit, size, hit + less, size + of) for less, of, _ in others]
            return each, *max(zip(odds, others, strict=True), default=(0.0, each[0]))

        def rates(found: Sequence[Band], did: str = "") -> str:
            each = [(f"{units.percent(1.0 - hit / size)} of {size:,}", text) for hit, size, text in found]
            return ", ".join(f"{rate}{did * (not i)} {text}" for i, (rate, text) in enumerate(each))

        said = f"{rates(contrast(failed)[0], f' flights {did}')}."
        worst = [part.worst for part in inner if part.worst and f"with {with_option(*part.within)}" == best[0]]
        for where, range_text, needed in worst:
            there, odds, _ = contrast(failed, where)
            if odds:
                sure = odds > needed + math.log(len(parts))
                doubt = "" if sure else ": too few flights to tell which is better there"
                said += f" {'But where' if sure else 'Where'} {range_text}, the rates are {rates(there)}{doubt}."
                break
        ((hit, size, text), *_), odds, (fewer, of, other) = contrast(lost)
        if odds > math.log(20.0 * len(parts)):
            said += f" But more flights are lost {text} ({hit:,} of {size:,}) than {other} ({fewer:,} of {of:,})."
        return said


def failures_go_with(flown: pa.Table, campaign: Campaign, columns: Mapping[str, VariedKey]) -> tuple[str, Findings]:
    """`findings` of a campaign's flights."""
    failed, early = ~flown[SUCCESS].to_numpy(), pc.not_equal(flown[OUTCOME].cast("string"), OUTCOMES[0]).to_numpy()
    kinds = {"flights above a limit": failed & ~early, "lost flights": early}
    nominal = {key: value_at(campaign.mission, key) for key in columns}
    unit_of, did = {key: unit(campaign.mission, key) for key in columns}, DID[bool(campaign.file.failure)]
    return findings(failed, kinds, columns, unit_of, nominal, did)


def value_at(section: object, key: str) -> float:
    """The number at a key of a mission; NaN where there is none."""
    with contextlib.suppress(AttributeError, IndexError, TypeError, ValueError):
        for part in key.split("."):
            section = section[int(part)] if part.isdecimal() else getattr(section, part)  # type: ignore[index]
        return float(section)  # type: ignore[arg-type]
    return math.nan


def findings(
    failed: Flights, kinds: Mapping[str, Flights], columns: Mapping[str, VariedKey], unit_of: Mapping[str, str],
    nominal: Mapping[str, float] = {}, did: str = DID[True],
) -> tuple[str, Findings]:  # fmt: skip
    """What failures go with, in sentences, and `successes` by the choice that explains most, if one does, which the first is
    of. kinds, unit_of: as `in_common` has them; nominal: values of keys in the mission; did: as in `DID`.
    """
    found, shared_by = splits(failed, columns, unit_of, nominal), in_common(kinds, columns, unit_of)
    said = {one.sentence: (one.key, *one.within[:1]) for one in found if one.choice or not one.faint}
    one, by = columns[found[0].key] if found else None, ""
    if one and one.options:
        lost = kinds.get("lost flights", np.zeros_like(failed))
        by = found[0].successes(did, failed, lost, one, [other for other in found if other.within])
    told = {one.key for one in found if one.within}
    return by, said | {text: (part.key,) for text, part in shared_by.items() if part.key not in told}


def splits(
    failed: Flights, columns: Mapping[str, VariedKey], unit_of: Mapping[str, str], nominal: Mapping[str, float] = {}
) -> list[Split]:
    """The keys over which the share of failures differs, those first that explain most; if one key and, within each of its
    values, one other explain more, these, and the others that do there.
    """
    scales = [scale for key, one in columns.items() for scale in scales_of(key, one, unit_of[key], nominal.get(key, math.nan))]
    choices = [(key, one, one.options) for key, one in columns.items() if one.options is not None]
    tried = sum(len(one.ends) + 1 for one in scales) * (1 + sum(len(options) for *_, options in choices))
    alone = best_of_keys(failed, np.ones(len(failed), bool), scales, tried)
    found, most = alone, max((one.score for one in alone), default=0.0)
    for key, one, options in choices:
        others = [scale for scale in scales if scale.key != key]
        each = [
            [best._replace(within=(key, text)) for best in best_of_keys(failed, one.values == place, others, tried)[:NAMED]]
            for place, text in enumerate(f"{option}{suffix_of(one, unit_of[key])}" for option in options)
        ]
        inner, own = [best for some in each for best in some[:1]], [split for split in alone if split.key == key]
        score = sum(split.score for split in (*own, *inner)) - (0.0 if own else cost(tried))
        if inner and score > most:
            inner = sorted((best for some in each for best in some), key=lambda one: -one.score)
            used = {key, *(split.key for split in inner)}
            found, most = [*own, *inner, *(split for split in alone if split.key not in used)], score
    return found[: max(NAMED, sum(bool(one.within) for one in found) + 1)]


def best_of_keys(failed: Flights, where: Flights, scales: Sequence[KeyOrder], tried: int) -> list[Split]:
    """The keys over which the share of failures differs among some flights, the best scale of each."""
    found = sorted((split(failed, where, one, tried) for one in scales), key=lambda one: -one.score)
    return list({one.key: one for one in reversed(found) if one.score > 0.0}.values())[::-1]


def scales_of(key: str, one: VariedKey, unit: str, nominal: float) -> list[KeyOrder]:
    """The orders of a key: its values, in round steps and tenths of the flights; how far it is from the mission's."""
    suffix = suffix_of(one, unit)
    if one.options is not None:
        if one.parts.ordered:
            return [KeyOrder(key, one.values.astype(np.int64), [*one.options[1:]], suffix, first=one.options[0])]
        return [KeyOrder(key, one.values.astype(np.int64), [*one.options], "", ordered=False)]
    found = [(one.values, "")]
    off = np.sort(one.values - nominal)
    if len(off) >= A_GROUP and (reach := min(-off[A_GROUP - 1], off[-A_GROUP])) > 0.0:
        found.append((np.minimum(np.abs(one.values - nominal), reach), units.numerals(f"{nominal:.6g}")))
    return [KeyOrder(key, *cut(values), suffix, about) for values, about in found]


def suffix_of(one: VariedKey, unit: str) -> str:
    """What follows the values of a key: nothing where they are no numbers."""
    return units.unit_suffix(unit or "-") * (one.options is None or one.parts.ordered)


def cut(values: NDArray[np.float64]) -> tuple[NDArray[np.int64], list[str]]:
    """The places of numbers between round ones, and these."""
    rough = float(np.ptp(values)) / STEPS or 1.0
    digit = 10.0 ** math.floor(math.log10(rough))
    step = digit * min((1.0, 2.0, 5.0, 10.0), key=lambda many: abs(math.log(many * digit / rough)))
    round_ones = step * np.arange(math.ceil(values.min() / step), math.floor(values.max() / step) + 1)
    tenths = np.quantile(values, np.linspace(0.1, 0.9, 9))
    texts = {f"{end:.{DIGITS}g}" for end in (*round_ones, *tenths)}
    ends = sorted(float(text) for text in texts)
    return np.searchsorted(ends, values, side="right"), [units.numerals(f"{end:.{DIGITS}g}") for end in ends]


def cost(tried: int) -> float:
    """What a bound's exponent must exceed for one of so many parts, on two sides, at two stages, to be no chance."""
    return math.log(4.0 * tried / (1.0 - LEVEL))


def split(failed: Flights, where: Flights, scale: KeyOrder, tried: int) -> Split:
    """Some flights along a scale, cut where that explains most, as often as the parts then differ by more than chance. tried:
    the cuts of all scales, among all flights and within each value of a choice.
    """
    size = len(scale.ends) + scale.ordered
    flights = np.bincount(scale.places[where], minlength=size)
    hits = np.bincount(scale.places[where & failed], minlength=size)
    count, total = int(hits.sum()), int(flights.sum())
    if not scale.ordered:
        groups = [
            (int(hits[at]), int(flights[at]), scale.range_text(at, at + 1)) for at in range(size) if flights[at] >= A_GROUP
        ]
        clear = any(unlikely(hit, some, count, total) > cost(tried) for hit, some, _ in groups)
        gain = sum(some * divergence(hit / some, count / total) for hit, some, _ in groups)
        return Split(scale.key, groups, clear * max(gain - cost(tried), 1e-9), choice=True)
    n, h = np.concatenate([[0], np.cumsum(flights)]).tolist(), np.concatenate([[0], np.cumsum(hits)]).tolist()
    ends, score = [0, size], 0.0
    while len(ends) <= BANDS:
        needed = cost(tried * (1 if len(ends) == 2 else size**2))
        found = [
            (gained, at)
            for low, high in itertools.pairwise(ends)
            for at in range(low + 1, high)
            if (gained := gain_at(h, n, low, at, high, needed)) > needed
        ]
        if not found:
            break
        gained, at = max(found)
        ends, score = sorted([*ends, at]), score + gained - needed
    parts = itertools.pairwise(ends) if score else ()
    bands = [(h[high] - h[low], n[high] - n[low], scale.range_text(low, high)) for low, high in parts]
    about, worst = f"{scale.about}{scale.unit}" * bool(scale.about), None
    if score:
        low, high = max(itertools.pairwise(ends), key=lambda one: (h[one[1]] - h[one[0]]) / (n[one[1]] - n[one[0]]))
        text = f"the {words(scale.key)} is {scale.range_text(low, high).removeprefix('at ')}{f' from {about}' * bool(about)}"
        worst = (scale.places >= low) & (scale.places < high), text, cost(tried * size)
    return Split(scale.key, bands, score, about=about, worst=worst)


def gain_at(h: list[int], n: list[int], low: int, at: int, high: int, needed: float) -> float:
    """How much better two shares explain the failures of a range than one does; 0 where it may be chance. h, n: failures and
    flights before each place.
    """
    hit, size, count, total = h[at] - h[low], n[at] - n[low], h[high] - h[low], n[high] - n[low]
    if min(size, total - size) < A_GROUP or unlikely(hit, size, count, total) <= needed:
        return 0.0
    other = total - size
    return size * divergence(hit / size, count / total) + other * divergence((count - hit) / other, count / total)


def unlikely(hit: int, size: int, count: int, total: int) -> float:
    """The logarithm of 1 / `chance` that so many of a part of the flights fail, where `count` of all do."""
    if not count or not size or total in (count, size):
        return 0.0
    return max(count * divergence(hit / count, size / total), size * divergence(hit / size, count / total))


def divergence(one: float, other: float) -> float:
    """Of Kullback and Leibler, between two outcomes with these shares."""
    sides = ((one, other), (1.0 - one, 1.0 - other))
    return sum(p * math.log(p / q) for p, q in sides if p > 0.0)


def with_option(key: str, text: str) -> str:
    return f"{words(key)} {text if text in (ON, OFF) else f'= {text}'}"


def few_values(one: VariedKey) -> bool:
    return one.options is not None and not one.parts.ordered and len(one.options) <= MOST_LINES


def values_of(key: str | None, columns: Mapping[str, VariedKey], flights: int) -> dict[str, Flights]:
    """The flights with each value of a choice; all without one."""
    if key is None:
        return {"": np.ones(flights, bool)}
    return flights_with(key, columns[key])


def flights_with(key: str, one: VariedKey) -> dict[str, Flights]:
    return {with_option(key, text): one.values == place for place, text in enumerate(one.options or ())}


class Common(NamedTuple):
    """What all flights of a kind have in common. flights: all that have it."""

    flights: Flights
    text: str
    key: str


def in_common(kinds: Mapping[str, Flights], columns: Mapping[str, VariedKey], unit_of: Mapping[str, str]) -> dict[str, Common]:
    """What each kind of flight has in common, by a sentence. kinds: which flights are of each, by what they are called.
    unit_of: each key.

    So many flights of a kind would be among those that fit with at most this probability by chance (they are drawn without
    replacement); it counts as often as there are keys, values and kinds to choose from.
    """
    tests = len(kinds) * sum(2 if one.options is None else len(one.options) for one in columns.values())
    said: dict[str, Common] = {}
    for kind, chosen in kinds.items():
        found = [part for key, one in columns.items() for part in shared(key, one, chosen, unit_of[key])]
        count, flights = int(chosen.sum()), len(chosen)
        least = min(found, key=lambda one: int(one.flights.sum()), default=Common(np.ones(flights, bool), "", ""))
        share_of_all = float(least.flights.mean())
        if count >= FEWEST and share_of_all <= MOST and tests * share_of_all**count < 1.0 - LEVEL:
            said[f"All {count:,} {kind} are among the {least.flights.sum():,} with {least.text}."] = least
    return said


def shared(key: str, one: VariedKey, chosen: Flights, unit: str) -> list[Common]:
    """What the chosen flights share in a key: all flights that fit, and how it is said."""
    values = one.values[chosen]
    if not len(values) or (one.options and np.ptp(values)):
        return []
    if one.options:
        return [Common(one.values == values[0], with_option(key, f"{one.options[int(values[0])]}{suffix_of(one, unit)}"), key)]
    what = f"{'an' if words(key)[0] in 'aeio' else 'a'} {words(key)} of"
    low, high = units.rounded_down(float(values.min()), DIGITS), units.rounded_up(float(values.max()), DIGITS)
    return [Common(where, f"{what} {how} {units.number(end)}{units.unit_suffix(unit or '-')}", key) for where, how, end in (
        (one.values >= low, "at least", low), (one.values <= high, "at most", high))]  # fmt: skip
