"""What a map of an envelope shows, in sentences: how much of it can be flown, where, and how well."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.metrics.statistics import TAIL, exact_share, share
from quadstep.mission.fields import words
from quadstep.report import units
from quadstep.studies.envelope_map import FLYABLE, LEAST, Cells, by_success, coloured
from quadstep.studies.envelope_request import MapAxis, Request


class MapPanel(NamedTuple):
    """A panel of the map in numbers. name: the value of --by, empty without it.

    flyable: cells of so many. success: share of all flights. causes: flights that did not succeed, by why. rmse: the
    least and the largest of the flyable cells [m], None if there is none.
    """

    name: str
    cells: int
    flyable: int
    success: float
    causes: dict[str, int]
    rmse: tuple[float, float] | None


ALIKE = 0.01
"""Relative difference of errors up to which they are the same: where the least is, is told of what all such cells share."""


class Envelope(NamedTuple):
    asked: Request
    cells: Cells
    panels: list[MapPanel]


def answer(envelope: Envelope) -> str:
    """How much of the map can be flown, in a sentence."""
    asked, cells = envelope.asked, envelope.panels[0].cells
    over = f"combinations of {words(asked.x.key)} and {words(asked.y.key)}"
    same = "" if asked.random or asked.flights == 1 else " Nothing is random here: all flights of a cell are identical."
    how, more = f"{asked.campaign.meaning}{most_of(asked)}", f"{same}{either_way(envelope)}{ends(envelope)}{idle(envelope)}"
    names = [f" with {one.name}" if one.name else "" for one in envelope.panels]
    if asked.cells == 1:
        at = f"{asked.x.in_words(asked.x.values[0])} and {asked.y.in_words(asked.y.values[0])}{names[0]}"
        can = "can" if envelope.cells.flyable.all() else "cannot"
        return f"The one combination of this map, {at}, {can} be flown{how}.{more}"
    if envelope.cells.flyable.all():
        return f"Every one of the {cells} {over} can be flown{units.listed(names)}{how}: the map shows no limit.{more}"
    if not envelope.cells.flyable.any():
        return none_flyable(envelope, f"None of the {cells} {over}", units.listed(names), more)
    first, *others = [f"{one.flyable} of {cells}" for one in envelope.panels]
    parts = [f"{first} {over} can be flown{names[0]}", *map("".join, zip(others, names[1:], strict=True))]
    counts = f" A combination that can be flown succeeded in {enough(asked)[0]}{sure(asked)}.{close(envelope)}"
    alone, judged = (most_of(asked), "") if asked.flights == 1 else ("", counts)
    return f"{', '.join(parts)}{alone}{asked.campaign.meaning}{borders(envelope)}{frontier(envelope)}.{judged}{more}"


def close(envelope: Envelope) -> str:
    """In how many cells the flights do not decide whether enough succeed, in a sentence after a blank."""
    ends = [share(int(one), envelope.asked.flights) for one in envelope.cells.successes.flat] if envelope.asked.random else []
    count = sum(one.low < FLYABLE <= one.high for one in ends)
    said = f" In {count} of {len(ends)} combinations the interval holds {units.percent(FLYABLE)}"
    return f"{said}: more flights may change the verdict." if count else ""


def frontier(envelope: Envelope) -> str:
    """Up to which value of y a map of one panel can be flown at the first, the middle and the last x between none and all of
    it, if that grows or falls with x, in a clause after a semicolon; else nothing.
    """
    asked, rows = envelope.asked, envelope.cells.flyable[0]
    counts, fit = rows.sum(axis=0), asked.x.ranged and asked.y.ranged and not (asked.by or asked.random)
    part, steps = np.flatnonzero((counts > 0) & (counts < len(rows))), np.diff(counts)
    whole = (rows == (np.arange(len(rows))[:, None] < counts)).all() and ((steps >= 0).all() or (steps <= 0).all())
    if not (fit and whole and len(part) > 2 and np.ptp(counts[part])):
        return ""
    told = [f"{asked.y.shown(asked.y.values[counts[at] - 1])} at {asked.x.shown(asked.x.values[at])}"
            for at in part[[0, len(part) // 2, -1]]]  # fmt: skip
    return f"; between, up to a {words(asked.y.key)} of {units.listed(told)}"


def none_flyable(envelope: Envelope, none: str, names: str, more: str) -> str:
    """That no cell is flyable, and of several flights each how many succeed where most do."""
    asked, successes = envelope.asked, envelope.cells.successes
    if asked.flights == 1:
        return f"{none} can be flown{names}{asked.campaign.meaning}{most_of(asked)}.{more}"
    said = f"{none} is flyable{names}{asked.campaign.meaning}, that is, succeeds in {enough(asked)[0]}"
    best = int(successes.max())
    if not best:
        return f"{said}; no flight succeeded at all.{more}"
    where = zip((asked.by, asked.y, asked.x), np.argwhere(successes == best)[0], strict=True)
    at = units.listed([axis.in_words(axis.values[place]) for axis, place in where if axis][::-1])
    such = "the best" if (successes == best).sum() == 1 else "one of the best"
    ends = exact_share(best, asked.flights, TAIL / successes.size)[1:]
    between = f" (95 % interval {' to '.join(map(units.percent, ends))}, widened for choosing it from {successes.size})"
    return f"{said}; {such}, {at}, succeeds in {best} of {asked.flights}{between * asked.random}.{more}"


def either_way(envelope: Envelope) -> str:
    """Of two panels, which has the smaller errors where both can be flown, in a sentence after a blank."""
    if len(envelope.panels) != 2:
        return ""
    both = envelope.cells.flyable.all(axis=0)
    first, second = envelope.cells.rmse[:, both]
    smaller = int((first < second).sum()), int((second < first).sum())
    if smaller[0] == smaller[1]:
        return ""
    count, name = max(smaller), envelope.panels[smaller[1] > smaller[0]].name
    what = f"{'median ' if envelope.asked.flights > 1 else ''}position RMSE"
    shared = f"Where both can be flown ({units.counted(int(both.sum()), 'combination')})"
    larger, less = (second, first) if smaller[0] > smaller[1] else (first, second)
    low, middle, high = (units.number(float(one)) for one in np.quantile(larger / np.maximum(less, LEAST), (0.0, 0.5, 1.0)))
    many = "all" if count == both.sum() else count
    worse = envelope.panels[smaller[0] >= smaller[1]].name
    by = f"in the median it is {middle} times as large with {worse}, in all from {low} to {high} times"
    return f" {shared}, the {what} is smaller with {name} in {many} of them; {by}."


def borders(envelope: Envelope) -> str:
    """Where along the axes of numbers all of the map can be flown and where none of it, in a clause after a colon."""
    asked, flyable = envelope.asked, envelope.cells.flyable
    axes = [(one, flyable.swapaxes(place, 0).reshape(len(one.values), -1)) for one, place in ((asked.x, 2), (asked.y, 1))]
    parts = []
    for what, good in (("all", True), ("none", False)):
        found = [span(axis, (cells == good).all(axis=1), asked.random) for axis, cells in axes if axis.ranged]
        where = [one for one in found if one]
        parts += [f"{what} where {units.listed(where, 'or')}"] if where else []
    whole = {1: "", 2: "with both, "}.get(len(envelope.panels), "with each, ")
    return f": {whole}{', '.join(parts)}" if parts else ""


def span(axis: MapAxis, line: NDArray[np.bool_], chance: bool) -> str:
    """The values at which a line holds, if they follow one another, in a clause; else nothing. chance: whether those between
    others that do not may be so by chance, which is no range.
    """
    at, last = np.flatnonzero(line), len(axis.values) - 1
    if not at.size or at[-1] - at[0] >= at.size or (chance and at[0] > 0 and at[-1] < last):
        return ""
    low, high = axis.shown(axis.values[at[0]]), axis.shown(axis.values[at[-1]])
    if at.size == 1:
        return f"the {words(axis.key)} is {low}"
    how = f"at most {high}" if at[0] == 0 else f"at least {low}" if at[-1] == last else f"from {low} to {high}"
    return f"the {words(axis.key)} is {how}"


def ends(envelope: Envelope) -> str:
    """Where the error is least and where it is largest, of cells that can be flown, in a sentence after a blank."""
    asked, cells = envelope.asked, envelope.cells
    shown = np.where(cells.flyable, cells.rmse, np.nan)
    if np.isfinite(shown).sum() < 2 or np.nanmin(shown) == np.nanmax(shown):
        return ""
    axes, told = [(one, place) for place, one in ((2, asked.x), (1, asked.y), (0, asked.by)) if one], list[str]()
    for found in (np.nanargmin(shown), np.nanargmax(shown)):
        alike = np.argwhere(np.isclose(shown, shown.flat[found], rtol=ALIKE, atol=LEAST))
        at = units.listed([one.in_words(one.values[alike[0, place]]) for one, place in axes if not np.ptp(alike[:, place])])
        told.append(f"{units.quantity(float(shown.flat[found]), 'm')}{f' ({at})' * bool(at)}")
    what = f"{'median ' if asked.flights > 1 else ''}position RMSE"
    return f" Where it can be flown, the {what} ranges from {told[0]} to {told[1]}."


def idle(envelope: Envelope) -> str:
    """Which axes make no difference to any result, as wind to a vehicle without drag, in a sentence after a blank."""
    asked, cells = envelope.asked, envelope.cells
    results = [cells.causes, cells.rmse, cells.mean, cells.largest]
    keys = [
        words(axis.key)
        for place, axis in enumerate((asked.by, asked.y, asked.x))
        if axis
        and len(axis.values) > 1
        and cells.completed.any()  # else only outcomes are compared
        and all(np.array_equal(one, np.broadcast_to(one.take([0], place), one.shape), equal_nan=True) for one in results)
    ]
    return f" No result depends on {units.listed(keys, 'or')}." if keys else ""


def most_of(request: Request) -> str:
    """How many of a point's flights count for all, where there are several, and how much so many show."""
    if request.flights > 1:
        return f", that is, {enough(request)[0]} of each succeeded{sure(request)}"
    return " in the one flight of each, whose outcome is partly chance" if request.random else ""


def sure(request: Request) -> str:
    """How much it shows that so many succeeded, in brackets after a blank."""
    return f" (95 % interval from {units.percent(enough(request)[1])})" if request.random else ""


def enough(request: Request) -> tuple[str, float]:
    """How many flights must succeed for a cell to count as flyable, and where the 95 % interval of so many begins."""
    flights = request.flights
    least = next(count for count in range(flights + 1) if count / flights >= FLYABLE)
    return f"{'all' if least == flights else f'at least {least} of'} {flights} flights", share(least, flights).low


def caption(envelope: Envelope, linked: bool) -> str:
    """What the map shows. linked: whether cells with a dot are links."""
    cells, seen = envelope.cells, coloured(envelope.cells)
    several = envelope.asked.flights > 1
    seen_there = "a flight of that cell, which ends as at least half do there" if several else "the flight of that cell"
    parts = [f"Click a circle to see {seen_there}; its page may warn of more than the limits of this map."] * linked
    if (struck := seen & ~cells.flyable).any() and cells.flyable.any():
        parts = [f"Struck through: {units.counted(int(struck.sum()), 'cell')} in which too few succeed.", *parts]
    if not seen.all():
        few = "in which fewer than half of the flights succeed" if several else "whose flight fails"
        look = "Hatched by cause" if cells.cause[~seen].any() else "Dotted"
        parts = [f"{look}: {units.counted(int((~seen).sum()), 'cell')} {few}.", *parts]
    least, most = (float(end(cells.rmse[seen])) if seen.any() else 0.0 for end in (np.min, np.max))
    what = f"{'median ' if several else ''}position RMSE"
    if by_success(cells):
        ends = [units.percent(float(end(cells.share))) for end in (np.min, np.max)]
        parts = [f"Colour: share of flights that succeed, from {ends[0]} to {ends[1]}; lighter means more.", *parts]
    elif seen.any():
        told = [units.quantity(one, "m") for one in (least, most)]
        ranges = f"from {told[0]} to {told[1]}; lighter means larger" if least < most else told[0]
        parts = [f"Colour: {what}, {ranges}.", *parts]
    return " ".join(parts)
