"""A verdict, its numbers with their units, and the words for its unknowns."""

from __future__ import annotations

import math
from enum import IntEnum
from pathlib import Path
from typing import NamedTuple

from quadstep.io.errors import DIVERGED, FAILED
from quadstep.proofs.prove.sampled import Array
from quadstep.proofs.prove.unknown import Unknown


class VerdictKind(IntEnum):
    """A verdict, with its exit code."""

    PROVED = 0
    OPEN = FAILED
    DISPROVED = DIVERGED


class TubeRecord(NamedTuple):
    """A tube over time, as far as it is closed. time: (samples + 1,) [s]. error: flown less desired position, and bound:
    of every flight about the flown one, (samples + 1, axes) [m]. boxes: half widths of each state, (blocks, states), from the
    times `blocks` on.
    """

    axes: tuple[str, ...]
    time: Array
    error: Array
    bound: Array
    states: tuple[str, ...]
    blocks: Array
    boxes: Array


class ProofVerdict(NamedTuple):
    """The result. rows: axis, verdict, and the bounds in millimetres. says: sentences. written: its certificate.
    traced: the tube, where one was followed.
    """

    name: str
    kind: VerdictKind
    rows: list[list[str]]
    says: list[str]
    written: Path | None = None
    columns: tuple[str, ...] = ("axis", "verdict", "from the flight", "from the path")
    traced: TubeRecord | None = None


def millimetres(metres: float) -> str:
    return f"{up(1e3 * metres, 4):.4g}" if metres > 0.0 else "0"


def down(x: float, digits: int = 6) -> float:
    """Rounded down to this many digits."""
    if x == 0.0:
        return 0.0
    unit = 10.0 ** (math.floor(math.log10(abs(x))) - digits + 1)
    return math.floor(x / unit) * unit


def up(x: float, digits: int = 6) -> float:
    """Rounded up to this many digits."""
    return -down(-x, digits)


def off(unknown: Unknown) -> list[str]:
    """How far a start may be from the mission's, part by part."""
    words = [
        f"{1e3 * unknown.start:g} mm" if unknown.start else "",
        f"{unknown.start_velocity:g} m/s" if unknown.start_velocity else "",
        f"{math.degrees(unknown.start_attitude):g}° of attitude" if unknown.start_attitude else "",
        f"{math.degrees(unknown.start_rates):g}°/s" if unknown.start_rates else "",
    ]
    return [one for one in words if one]


def under(unknown: Unknown) -> str:
    said = [
        f"any force within {unknown.force:g} N that may change at every sample" if unknown.force else "",
        f"any torque within {unknown.torque:g} N m per axis that may change at every sample" if unknown.torque else "",
        f"a mass within {100 * unknown.mass:g} %" if unknown.mass else "",
        f"inertias within {100 * unknown.inertia:g} %" if unknown.inertia else "",
        f"a start within {' and '.join(off(unknown))} of the mission's on each axis" if off(unknown) else "",
    ]
    words = [one for one in said if one]
    return "under " + ", ".join(words) if words else "from this start, with nothing unknown,"
