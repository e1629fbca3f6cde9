"""What all failed flights of a kind have in common, where that is not chance: a value of a key, or that it lies beyond one."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from quadstep.metrics.statistics import LEVEL
from quadstep.mission.fields import words
from quadstep.report import units
from quadstep.studies.campaign.varied import VariedKey

FEWEST, MOST, DIGITS = 3, 0.6, 3
"""Fewest flights that have anything in common; most of all flights that may; digits of where a key begins or ends."""


def in_common(kinds: Mapping[str, NDArray[np.bool_]], columns: Mapping[str, VariedKey], unit: Mapping[str, str]) -> list[str]:
    """A sentence for each kind of flight that has something in common. kinds: which flights are of each, by what they are
    called. unit: of each key.

    So many flights of a kind would be among those that fit with at most this probability by chance (they are drawn without
    replacement); it counts as often as there are keys, values and kinds to choose from.
    """
    tests = len(kinds) * sum(2 if one.options is None else len(one.options) for one in columns.values())
    said = []
    for kind, chosen in kinds.items():
        found = [(fit, text) for key, one in columns.items() for fit, text in shared(key, one, chosen, unit[key])]
        count, flights = int(chosen.sum()), len(chosen)
        fit, text = min(found, key=lambda one: int(one[0].sum()), default=(np.ones(flights, bool), ""))
        if count >= FEWEST and fit.mean() <= MOST and tests * (fit.sum() / flights) ** count < 1.0 - LEVEL:
            said.append(f"All {count} {kind} had {text}, as {fit.sum()} of all {flights} flights did.")
    return said


def shared(key: str, one: VariedKey, chosen: NDArray[np.bool_], unit: str) -> list[tuple[NDArray[np.bool_], str]]:
    """What the chosen flights share in a key: all flights that fit, and how it is said."""
    values = one.values[chosen]
    if not len(values) or (one.options and np.ptp(values)):
        return []
    if one.options:
        text = one.options[int(values[0])]
        how = {"true": "on", "false": "off"}.get(text, f"= {text}")
        return [(one.values == values[0], f"{words(key)} {how}")]
    what = f"{'an' if words(key)[0] in 'aeio' else 'a'} {words(key)} of"
    low, high = units.rounded_down(float(values.min()), DIGITS), units.rounded_up(float(values.max()), DIGITS)
    return [(where, f"{what} {how} {units.number(end)}{units.unit_suffix(unit or '-')}") for where, how, end in (
        (one.values >= low, "at least", low), (one.values <= high, "at most", high))]  # fmt: skip
