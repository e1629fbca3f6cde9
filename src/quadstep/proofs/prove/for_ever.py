"""The verdict on hover that holds for all time, and on a certificate that claims it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from quadstep.linear.states import quantity
from quadstep.proofs.prove.certificate_file import SetCertificate, folder_from, write_set
from quadstep.proofs.prove.check_set import check_set
from quadstep.proofs.prove.hold import Departure, Hold, described, number_extents
from quadstep.proofs.prove.proof_pictures import of_set
from quadstep.proofs.prove.report import ProofVerdict, VerdictKind, length, off, under, within
from quadstep.proofs.prove.rest import LONGEST
from quadstep.proofs.prove.sampled import Array, SampledLoop
from quadstep.proofs.prove.unknown import Unknown
from quadstep.report.units import rounded_down, rounded_up

COLUMNS = ("", "begins within", "stays within")

NOTHING = 1e-15
"""Lengths [m] that are not told from zero."""


def hover_for_ever(
    name: str, path: Path, text: str, loop: SampledLoop, unknown: Unknown, kept: Hold, out: Path | None
) -> ProofVerdict:
    """Hover in a set that no flight leaves. path, text: the mission's file and what it says."""
    axes, start = loop.loop.plant.axes, kept.found.start
    position = kept.reach[: len(axes)] * 1.001
    at = kept.at
    if out is not None:
        names, found = tuple(loop.names), kept.found
        content = text, unknown, names, at.state, at.live, at.twins, at.unit, kept.modes.spread, kept.modes.pairs, found.radii
        write_set(out, SetCertificate(*content, kept.own, start, position, folder_from(out, path)))
    enough = start >= unknown.start
    rows = rows_of(axes, start, position)
    rows += [[part, "–", reach] for part, reach in described(loop, kept.reach)]
    begun = loop.at_rest(loop.like) if kept.own else at.state.tolist()
    says = [
        "proved: " + sentence(unknown, start, begun[: len(axes)], kept.own, loop.period, within(axes, position.tolist())),
        f"No larger set was found: {kept.found.limit}.",
    ]
    if not enough:
        says = [f"undecided: starts within {length(unknown.start, digits=6)} were requested, and less is proved.", *says]
    kind = VerdictKind.PROVED if enough else VerdictKind.OPEN
    return ProofVerdict(name, kind, rows, says, out, COLUMNS, of_set(loop, kept, position))


def left_hover(name: str, loop: SampledLoop, unknown: Unknown, leaves: Departure) -> ProofVerdict:
    """Hover that flights leave from a start close to it."""
    axes, begins, box = loop.loop.plant.axes, number_extents(loop, leaves.begun), number_extents(loop, leaves.reach)
    rows = [
        [axis, off_rest(float(one)), length(float(far), rounded_down, 3)]
        for axis, one, far in zip(axes, leaves.begun, leaves.reach, strict=False)
    ]
    for part, (far, unit) in box.items():
        begun, edges = f"{rounded_up(max(*begins[part][0], NOTHING), 3):.3g}", ", ".join(map(least, far))
        said = [f"{one} {unit}".replace(" °", "°") for one in (begun, edges)]
        rows.append([quantity(part), *said])
    others = f", {under(Unknown(*unknown[:4]))}" if any(unknown[:4]) else ""
    says = [
        f"hover is proved unstable{others}. There is a state, off its rest by no more than the first column of the table "
        f"says, from which the flight leaves the box of the second within {rounded_up(leaves.seconds, 3):g} s.",
        f"This holds for the law as flown, with rounding, at whichever sample from {loop.period:g} s on it is in that "
        "state; the law's memory is off its rest too. It leaves the box as soon as one number is farther off than the second "
        "column says, or one of the law's memory is beyond a bound of its own.",
    ]
    columns = "", "begins off the rest by at most", "leaves a box of"
    return ProofVerdict(name, VerdictKind.DISPROVED, rows, says, columns=columns, unstable=True)


def least(value: float) -> str:
    """A number rounded down; 0 for one that is not told from zero."""
    return f"{rounded_down(value, 3) if value >= NOTHING else 0.0:.3g}"


def rows_of(axes: Sequence[str], start: float, position: Array) -> list[list[str]]:
    return [[axis, length(start, rounded_down, 3), length(float(one))] for axis, one in zip(axes, position, strict=True)]


def off_rest(metres: float) -> str:
    return length(metres) if metres >= NOTHING else f"below {1e3 * NOTHING:g} mm"


def sentence(unknown: Unknown, start: float, begun: Sequence[float], own: bool, period: float, bounds: str) -> str:
    others = f" {under(Unknown(*unknown[:4]))}," if any(unknown[:4]) else ""
    also = off(unknown._replace(start=0.0))
    shown = [round(one, 3 - math.floor(math.log10(max(start, NOTHING)))) + 0.0 for one in begun]
    point = f"{'about ' * (shown != [*begun])}({', '.join(f'{one:.12g}' for one in shown)})"
    like = "the mission's" if own else "rest, the law's memory included (the mission's own start is too far from it)"
    near = f"within {' and '.join(also)} of " if also else "" if own else "at "
    return (
        f"every flight{others} whose start is within {length(start, rounded_down, 3)} of {point} m on each axis stays "
        f"within {bounds} of the loop's rest. All else at its start is {near}{like}; the bounds hold at all samples from "
        f"{period:g} s to {LONGEST:,.0f} s (11.6 days), the longest time that this proof covers."
    )


def check_for_ever(path: Path) -> ProofVerdict:
    """The verdict on a certificate. Raises UserError."""
    found = check_set(path)
    if found.failed:
        return ProofVerdict(found.name, VerdictKind.OPEN, [], [f"not confirmed: {found.failed}"], columns=COLUMNS)
    bounds = within(found.axes, found.position.tolist())
    says = "confirmed: " + sentence(found.unknown, found.start, found.begun.tolist(), found.own, found.seconds, bounds)
    return ProofVerdict(
        found.name, VerdictKind.PROVED, rows_of(found.axes, found.start, found.position), [says], columns=COLUMNS
    )
