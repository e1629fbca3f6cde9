"""A verdict in words, its numbers with their units; and the report of a proof."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Sequence
from enum import IntEnum
from pathlib import Path
from typing import NamedTuple
from urllib.parse import quote

from quadstep.io.errors import DIVERGED, FAILED, UserError
from quadstep.io.files import write_beside
from quadstep.linear.grade import UNSTABLE
from quadstep.metrics.verdict import Case
from quadstep.proofs.prove.unknown import Unknown
from quadstep.report import markup, units
from quadstep.report.drawing import FigureJob
from quadstep.report.evidence import Evidence, Figure, Section, TableSection
from quadstep.report.sheet import Sheet


class VerdictKind(IntEnum):
    """A verdict, with its exit code."""

    PROVED = 0
    OPEN = FAILED
    DISPROVED = DIVERGED


FROM_PATH = "from the path"


class ProofVerdict(NamedTuple):
    """The result. rows: axis, and its bounds. says: sentences. written: its certificate. cards: the same as rows.
    settings: how it was computed, name and value. unstable: whether it is that hover is.
    """

    name: str
    kind: VerdictKind
    rows: list[list[str]]
    says: list[str]
    written: Path | None = None
    columns: tuple[str, ...] = ("axis", "from the flight", FROM_PATH)
    pictures: Sequence[FigureJob] = ()
    cards: Sequence[markup.Fact] = ()
    settings: Sequence[Sequence[str]] = ()
    unstable: bool = False


def length(metres: float, rounded: Callable[[float, int], float] = units.rounded_up, digits: int = 4) -> str:
    """A bound on a length, rounded up or down, below a metre in mm."""
    unit, factor = ("mm", 1e3) if metres < 1.0 else ("m", 1.0)
    return f"{rounded(factor * metres, digits) if metres > 0.0 else 0.0:.{digits}g} {unit}"


def within(axes: Sequence[str], bounds: Sequence[float]) -> str:
    """Bounds [m] in a sentence, axes that share one together."""
    said = [length(one) for one in bounds]
    along = {one: [axis for axis, other in zip(axes, said, strict=True) if other == one] for one in said}
    return units.listed([f"{one} along {units.listed(names)}" for one, names in along.items()])


def off(unknown: Unknown) -> list[str]:
    """How far a start may be from the mission's, part by part."""
    words = [
        length(unknown.start, digits=6) if unknown.start else "",
        f"{unknown.start_velocity:g} m/s" if unknown.start_velocity else "",
        f"{math.degrees(unknown.start_attitude):g}° of attitude" if unknown.start_attitude else "",
        f"{math.degrees(unknown.start_rates):g}°/s" if unknown.start_rates else "",
    ]
    return [one for one in words if one]


def under(unknown: Unknown) -> str:
    """For which unknowns a statement holds, as a part of a sentence."""
    pushes = [
        f"any force up to {unknown.force:g} N" if unknown.force else "",
        f"any torque up to {unknown.torque:g} N m" if unknown.torque else "",
    ]
    pushed = units.listed([one for one in pushes if one])
    said = [
        f"{pushed} on each axis (free to change at every sample)" if pushed else "",
        f"a mass within {100 * unknown.mass:g} %" if unknown.mass else "",
        f"inertias within {100 * unknown.inertia:g} %" if unknown.inertia else "",
    ]
    words = [one for one in said if one]
    starts = f"from any start within {' and '.join(off(unknown))} of the mission's on each axis" if off(unknown) else ""
    every = " and ".join(filter(None, [starts, f"under {units.listed(words)}" if words else ""]))
    return every or "from this start, with nothing unknown,"


KIND = "Proof"
UNTIL = " until "
"""Between a bound and the end of the time for which it is proved."""

MARK = f"quadstep · {KIND}"
"""By which a report of this kind is known before it is replaced."""


def place_beside(certificate: Path) -> Path:
    """Where the report of a certificate goes. Raises UserError for a file that is no such report."""
    path = certificate.with_suffix(".html")
    if path == certificate:
        raise UserError(f"{path}: the report is written there; give the certificate another file extension, such as .json")
    if path.exists() and (not path.is_file() or MARK not in path.read_text(encoding="utf-8", errors="replace")):
        raise UserError(f"{path}: exists and is not a report of `quadstep prove`; choose another --out")
    return path


CLOSING = markup.note(
    "The bounds hold at the samples of the law, for the plant's Runge-Kutta steps and rounding as flown, not between "
    "samples, and not for a vehicle that differs from the mission's beyond what is named above."
)


def write_report(path: Path, verdict: ProofVerdict) -> None:
    """Write it. Raises UserError."""
    first, *others = map(sentence, verdict.says)
    shown, failed = ("The bounds", None) if verdict.kind is not VerdictKind.DISPROVED else ("In numbers", "disproved")
    table = TableSection(shown, "bounds", verdict.columns, verdict.rows)
    sections: list[Section] = [] if verdict.cards or not verdict.rows else [table]
    sections += map(markup.paragraph, others)
    if verdict.rows and not failed:
        sections.append(CLOSING)
    if verdict.written:
        name = verdict.written.name
        said = f"The certificate, which `quadstep prove --check {name}` checks with independent code:"
        sections.append(markup.links([(quote(name), name)], said))
    if verdict.settings:
        sections.append(TableSection("How it was computed", "settings", ("", ""), verdict.settings))
    with tempfile.TemporaryDirectory() as folder:
        for one in verdict.pictures:
            one.draw(Path(folder), Sheet(formats=("svg",)))
        figures = [Figure(one.name, one.caption) for one in verdict.pictures]
        judged = (Case("proved", failed),)
        found = Evidence(
            verdict.name, KIND, first, verdict.says, {}, verdict.cards, figures, sections, cases=judged, fold=("settings",),
            grade={"grade": UNSTABLE} if verdict.unstable else {}, told=True,
        )  # fmt: skip
        write_beside(path, found.html(Path(folder)), parents=True)


def sentence(text: str) -> str:
    """`proved: every flight …` as a sentence of a report."""
    return text[0].upper() + text[1:]
