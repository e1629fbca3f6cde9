"""A claim of the paper, and how it is judged."""

from collections.abc import Mapping
from enum import StrEnum
from typing import Any, NamedTuple


class Verdict(StrEnum):
    """The verdict of the flights on a sentence of the paper."""

    HOLDS = "holds"
    FAILS = "fails"
    UNDECIDED = "undecidable from the paper"


class Claim(NamedTuple):
    """A claim. name: short. sentence: the paper's. measured: one line with numbers. values: the same for machines."""

    name: str
    sentence: str
    measured: str
    verdict: Verdict
    values: Mapping[str, Any]


def judge(holds: bool) -> Verdict:
    """The verdict for a condition: holds or fails."""
    return Verdict.HOLDS if holds else Verdict.FAILS
