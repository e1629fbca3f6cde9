"""What a claim of the paper is, and how it is judged."""

from collections.abc import Mapping
from enum import StrEnum
from typing import Any, NamedTuple


class Verdict(StrEnum):
    """What the flights say of a sentence."""

    HOLDS = "holds"
    FAILS = "fails"
    UNDECIDED = "cannot be decided from the text"


class Claim(NamedTuple):
    """name: short. sentence: the paper's. measured: one line with numbers. values: the same for machines."""

    name: str
    sentence: str
    measured: str
    verdict: Verdict
    values: Mapping[str, Any]


def judge(holds: bool) -> Verdict:
    """Holds or fails."""
    return Verdict.HOLDS if holds else Verdict.FAILS
