"""A verdict in words, its numbers with their units; and the report of a proof: the answer, the tube around the path, the boxes
over time, and what stayed open.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable
from enum import IntEnum
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure as Drawing

from quadstep.io.errors import DIVERGED, FAILED, UserError
from quadstep.io.files import write_beside
from quadstep.linear.states import quantity
from quadstep.proofs.prove.sampled import Array
from quadstep.proofs.prove.unknown import Unknown
from quadstep.report import canvas, markup, units
from quadstep.report.evidence import Evidence, Figure, Section, TableSection
from quadstep.report.sheet import COLUMN, PHONE, Sheet


class VerdictKind(IntEnum):
    """A verdict, with its exit code."""

    PROVED = 0
    OPEN = FAILED
    DISPROVED = DIVERGED


FROM_PATH = "from the path"


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
    columns: tuple[str, ...] = ("axis", "verdict", "from the flight", FROM_PATH)
    traced: TubeRecord | None = None


def millimetres(metres: float) -> str:
    return f"{up(1e3 * metres, 4):.4g}" if metres > 0.0 else "0"


def rounded_down(x: float, digits: int = 6) -> float:
    """Rounded down to this many digits."""
    if x == 0.0:
        return 0.0
    unit = 10.0 ** (math.floor(math.log10(abs(x))) - digits + 1)
    return math.floor(x / unit) * unit


def up(x: float, digits: int = 6) -> float:
    """Rounded up to this many digits."""
    return -rounded_down(-x, digits)


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
    """For which unknowns a statement holds, as it goes on after "every flight"."""
    pushes = [
        f"any force within {unknown.force:g} N" if unknown.force else "",
        f"any torque within {unknown.torque:g} N m per axis" if unknown.torque else "",
    ]
    pushed = units.listed([one for one in pushes if one])
    said = [
        f"{pushed} that may change at every sample" if pushed else "",
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

UNITS = {
    "position": "m", "velocity": "m/s", "attitude": "rad", "rates": "rad/s", "pitch": "rad", "rate": "rad/s",
    "rotor speeds": "rad/s", "the integral of r1": "m", "the integral of r2": "rad",
}  # fmt: skip
"""Of the quantities of vehicles, and of the paper's law."""

LARGEST = 8
"""Most quantities whose boxes are drawn."""


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
    others = verdict.says[1:]
    opened = [line for line in others if line.startswith("open: ")]
    drawn: list[Figure] = []
    shown = "What disproves it" if verdict.kind is VerdictKind.DISPROVED else "The bounds"
    sections: list[Section] = [TableSection(shown, "bounds", verdict.columns, verdict.rows)]
    if opened:
        sections += [markup.heading("What stayed open", "open"), markup.listing(map(sentence, opened))]
    sections += [markup.paragraph(line) for line in others if line not in opened]
    with tempfile.TemporaryDirectory() as folder:
        out, traced = Path(folder), verdict.traced
        if traced is not None and len(traced.time) > 1:
            widest_at, most = np.argmax(traced.bound.max(axis=1)), millimetres(float(traced.bound.max()))
            along = [axis for axis, one in zip(traced.axes, traced.bound.max(axis=0), strict=True) if millimetres(one) == most]
            caption = (
                "The position error of the mission's own flight, in a band that contains every flight, and half the width of "
                f"that band; it is largest along {units.listed(along)}, {most} mm at "
                f"{units.quantity(float(traced.time[widest_at]), 's')}."
            )
            drawn = [Figure("tube", caption)]
            draw(out / "tube", tube, traced)
            if len(traced.boxes):
                draw(out / "boxes", widths, traced)
                caption = (
                    "Half-widths, in SI units, of the boxes around the flight that contain every state; the widest of each "
                    "quantity. Where they grow, the enclosure loses more than the control law recovers."
                )
                sections += [markup.heading("Boxes over time", "boxes"), Figure("boxes", caption)]
                sections.append(TableSection(header=("quantity", "widest box, half-width"), rows=widest(traced)))
        if verdict.kind is not VerdictKind.DISPROVED:
            sections.append(CLOSING)
        found = Evidence(
            verdict.name, KIND, first_words(verdict), verdict.says, {}, facts(verdict), drawn, sections, fold=("boxes",)
        )
        write_beside(path, found.html(out), parents=True)


def draw(path: Path, picture: Callable[[TubeRecord], Drawing], traced: TubeRecord) -> None:
    sheet = Sheet(formats=("svg",))
    with canvas.drawing(sheet):
        canvas.write(picture(traced), path, sheet)


def sentence(text: str) -> str:
    """`proved: every flight …` as a sentence of a report."""
    return text[0].upper() + text[1:]


def first_words(verdict: ProofVerdict) -> str:
    """The answer, the bounds of a position first where all are proved throughout."""
    bounds = [f"{row[-1]} along {row[0]}" for row in verdict.rows[:3]]  # of the flights that the next sentence names
    if verdict.kind is not VerdictKind.PROVED or verdict.columns[-1] != FROM_PATH or any(UNTIL in one for one in bounds):
        return sentence(verdict.says[0])
    said = sentence(verdict.says[0].removeprefix("proved: "))
    return f"Proved: from the path at most {units.listed(bounds)}. {said}"


def facts(verdict: ProofVerdict) -> list[markup.Fact]:
    """The verdict, and the last column of the table for each row that is a position."""
    word = {VerdictKind.PROVED: "proved", VerdictKind.OPEN: "open", VerdictKind.DISPROVED: "disproved"}[verdict.kind]
    bounds = [(row[0], row[-1].partition(UNTIL)) for row in verdict.rows[:3]]
    return [
        markup.Fact("verdict", word),
        *(
            markup.Fact(f"{name}, {verdict.columns[-1]}", value, f"proved{UNTIL}{end}" if end else "")
            for name, (value, _, end) in bounds
        ),
    ]


def tube(traced: TubeRecord) -> Drawing:
    """Two panels for each axis, in millimetres: the flight off its path in its band, and half the width of the band."""
    figure = Drawing(figsize=(COLUMN, 1.25 * len(traced.axes) + 0.4), layout="constrained")
    panels = figure.subplots(len(traced.axes), 2, sharex=True, squeeze=False)
    for (path, band), axis, error, bound in zip(panels, traced.axes, 1e3 * traced.error.T, 1e3 * traced.bound.T, strict=True):
        top, low = (np.array(canvas.thin(traced.time, error + sign * bound)) for sign in (1.0, -1.0))
        path.fill(*np.hstack([top, low[:, ::-1]]), color=canvas.LINES[0]["color"], alpha=0.3, linewidth=0.0)
        path.plot(*canvas.thin(traced.time, error), label="off the path", **canvas.LINES[0])
        band.plot(*canvas.thin(traced.time, bound), label="at most off the flight", **canvas.LINES[0])
        path.set_ylabel(f"error in {axis} [mm]")
        band.set_ylabel("half-width [mm]")
        band.set_ylim(0.0, 1.08 * float(bound.max()) or None)  # a bound that stays the same is no edge of its axes
    for panel in panels[-1]:
        panel.set_xlabel("time [s]")
    return figure


def widths(traced: TubeRecord) -> Drawing:
    """The widest box of each quantity, on a logarithmic scale."""
    figure = Drawing(figsize=(PHONE, 3.4), layout="constrained")
    panel = figure.subplots()
    names, boxes = quantities(traced)
    order = [place for place in np.argsort(-boxes.max(axis=0), kind="stable") if boxes[:, place].max() > 0.0][:LARGEST]
    for turn, place in enumerate(order):
        style = {**canvas.LINES[turn % len(canvas.LINES)], "alpha": 1.0 if turn < len(canvas.LINES) else 0.5}
        panel.step(traced.blocks, np.maximum(boxes[:, place], 1e-18), where="post", label=units.label(names[place]), **style)
    panel.set_yscale("log")
    panel.set_xlabel("time [s]")
    panel.set_ylabel("half-width, SI units")
    for text in figure.legend(loc="outside upper left").get_texts():
        text.set_parse_math(True)
    return figure


def quantities(traced: TubeRecord) -> tuple[list[str], Array]:
    """Quantities in words, such as weights of the first net for `weights_1.0.0` to `weights_1.9.2`, and the widest of their
    boxes, (blocks, quantities).
    """
    names = [quantity(name) for name in traced.states]
    every = list(dict.fromkeys(names))
    columns = [traced.boxes[:, [i for i, name in enumerate(names) if name == one]].max(axis=1) for one in every]
    return every, np.stack(columns, axis=1)


def widest(traced: TubeRecord) -> list[tuple[str, str]]:
    """The widest box of each quantity that has one, in its unit, as far as one is known."""
    names, boxes = quantities(traced)
    most = zip(names, boxes.max(axis=0).tolist(), strict=True)
    known = UNITS if "attitude.3" not in traced.states else UNITS | {"attitude": "-"}  # of a quaternion
    return [(name, units.interval(one, math.nan, math.nan, known.get(name, "-"))) for name, one in most if one > 0.0]
