"""Several loops (laws, instants of a flight, or draws): a row for each, and which of them has the least margins."""

import math
import re
from collections.abc import Callable, Sequence
from typing import NamedTuple

from quadstep.io.grouping import by_first
from quadstep.linear.analysis import Analysis, least
from quadstep.linear.grade import FALLS, FRAGILE, RISES, UNKNOWN, UNSTABLE, explained, graded
from quadstep.linear.margins import Margins
from quadstep.metrics.registry import SOUND
from quadstep.report.markup import Fact
from quadstep.report.units import counted

Loops = Sequence[tuple[str, Analysis | str]]
"""Loops by name; for one that cannot be linearised, the reason."""

ROW_HEADER = ("", "grade", "slowest pole [1/s]", "gain up [dB]", "gain down [dB]", "phase [°]", "delay [ms]", "disk")
WORST_HEADER = ("margin", "worst", "channel", "where")

PHASE, DISK, PEAKS = "phase [°]", "smallest disk margin", ("peak of S", "peak of T")

MEASURES: tuple[tuple[str, Callable[[Margins], float], bool, int], ...] = (
    ("gain up [dB]", lambda one: one.up, True, 1),
    ("gain down [dB]", lambda one: -one.down, False, 1),
    (PHASE, lambda one: math.degrees(one.phase), True, 1),
    ("delay [ms]", lambda one: 1e3 * one.delay, True, 1),
    ("disk", lambda one: one.disk, True, 2),
    ("peak of S", lambda one: one.sensitivity, False, 2),
    ("peak of T", lambda one: one.complementary, False, 2),
)
"""Name, value, whether smaller is worse, and its decimals."""


NUMBER = re.compile(r"(?<![\w.])[-+]?\d[\d.]*(?:e[-+]?\d+)?(?![\w.]*\w)")
"""A number in a reason: reasons that differ only in such numbers are the same; digits of a name do not count."""

NAMED = 3
"""Most loops with the same reason that are named."""


class LeastMargin(NamedTuple):
    """The least of one margin. where: the name of the loop."""

    margin: str
    text: str
    channel: str
    where: str


def by_channel(analysis: Analysis) -> tuple[list[str], list[list[str]]]:
    """Header and rows of a table: each margin of each channel."""
    header = ["", *(channel.name for channel in analysis.channels)]
    return header, [
        [title, *(analysis.written(value(one), places, title in PEAKS) for one in analysis.margins)]
        for title, value, _, places in MEASURES
    ]


def finding(analysis: Analysis, but: str = "") -> str:
    """The grade as a sentence; of a sound loop with the margin nearest to its limit, or with what its mission's flight does
    that was not asked.
    """
    grade = graded(analysis)
    asked = [one for one in grade.measures if one.limit > 0.0 and math.isfinite(one.value)]
    if grade.word == SOUND and asked:
        least = min(asked, key=lambda one: one.value / one.limit)
        grade = grade._replace(why=explained(analysis, [] if but else [least]))
    return f"{grade.sentence[:-1].removesuffix(': ')}. However, {but}." if but else grade.sentence


def stable(loops: Loops) -> list[tuple[str, Analysis]]:
    return [(name, one) for name, one in loops if isinstance(one, Analysis) and one.stable]


def grades(loops: Loops, where: str = "") -> str:
    """How many loops have each grade, as a sentence. where: they are, after a blank, as " at rest"."""
    words = [graded(one).word if isinstance(one, Analysis) else UNKNOWN for _, one in loops]
    first, *others = [(words.count(word), word) for word in (SOUND, FRAGILE, UNSTABLE, UNKNOWN) if word in words]
    counts = [f"{first[0]} of {counted(len(words), 'loop')}{where} {'are' if first[0] > 1 else 'is'} {first[1]}"]
    return f"{', '.join(counts + [f'{count} {word}' for count, word in others])}."


def unstable(loops: Loops) -> list[str]:
    """A sentence each on the loops that are unstable, and on those that do not hold something."""
    linearised = [(name, one) for name, one in loops if isinstance(one, Analysis)]
    growing = [name for name, one in linearised if not one.stable]
    loose = [(name, ", ".join(one.not_held)) for name, one in linearised if one.stable and one.not_held]
    lines = [f"Unstable: {len(growing)} of {len(loops)}, first {growing[0]}."] if growing else []
    if loose:
        lines.append(f"Not held: in {len(loose)} of {len(loops)}; {loose[0][0]} does not hold {loose[0][1]}.")
    return lines


def rows(loops: Loops) -> list[list[str]]:
    """A row of `ROW_HEADER` for each loop that could be linearised: the least margins of all its channels."""
    return [[name, *cells(one)] for name, one in loops if isinstance(one, Analysis)]


def cells(one: Analysis) -> list[str]:
    """The cells of a row after its name."""
    pole = ", ".join([f"{one.poles[0].real:.3g}", *(f"{name} not held" for name in one.not_held)])
    if not one.stable:
        return [graded(one).word, pole, *["-"] * 5]
    return [graded(one).word, pole, *(one.written(value(least(one.margins)), places) for _, value, _, places in MEASURES[:5])]


def refused(loops: Loops) -> list[str]:
    """A line for each reason why loops cannot be linearised: their names or, if many, their number and the first."""
    alike = by_first((NUMBER.sub("", one), (name, one)) for name, one in loops if isinstance(one, str))
    return [f"{whose([name for name, _ in those], len(loops))}: {those[0][1]}" for those in alike.values()]


def whose(names: Sequence[str], total: int) -> str:
    """Loops by name or, if many, by count."""
    return ", ".join(names) if len(names) <= NAMED else f"{len(names)} of {total}, first {names[0]}"


def worst(loops: Loops) -> list[LeastMargin]:
    """The least of each margin over all loops and channels."""
    made = []
    for title, value, less, places in MEASURES:
        every = [
            (value(margins), name, channel.name, one.written(value(margins), places, title in PEAKS))
            for name, one in stable(loops)
            for channel, margins in zip(one.channels, one.margins, strict=True)
        ]
        if every:
            best = (min if less else max)(every, key=lambda one: float(f"{one[0]:.6g}"))  # the first of equals
            made.append(LeastMargin(title, best[3], best[2], best[1]))
    return made


def facts(loops: Loops) -> list[Fact]:
    """The same for a report's summary: the least of the most common margins."""
    known, made = {one.margin: one for one in worst(loops)}, []
    up, down = (known.get(f"gain {way} [dB]") for way in ("up", "down"))
    ways = [(one, way) for one, way in ((up, RISES), (down, FALLS)) if one and one.text != "none"]
    gain = min(ways, key=lambda pair: abs(float(pair[0].text)), default=(up, ""))
    for what, one, unit, way in (
        ("gain", gain[0], "\u00a0dB", gain[1]), ("phase", known.get(PHASE), "°", ""),
        ("delay", known.get("delay [ms]"), "\u00a0ms", ""), ("disk", known.get("disk"), "", ""),
    ):  # fmt: skip
        if one:
            value = one.text if one.text == "none" else f"{one.text.removeprefix('-') if way else one.text}{unit}"
            made.append(
                Fact(f"smallest {what} margin", value, ", ".join(part for part in (one.channel, one.where, way) if part))
            )
    return made
