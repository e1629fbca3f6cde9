"""What a map of an envelope shows, in sentences: how much of it can be flown, where, and how well."""

import itertools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.metrics.statistics import share
from quadstep.mission.fields import words
from quadstep.report import units
from quadstep.report.markup import Fact
from quadstep.studies.campaign.summary import DID, as_commanded, as_sentence
from quadstep.studies.envelope_cells import FLYABLE, Cells, needed, too_few
from quadstep.studies.envelope_map import by_success, coloured
from quadstep.studies.envelope_request import NOISY_FLIGHTS, MapAxis, Request


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


class Envelope(NamedTuple):
    asked: Request
    cells: Cells
    panels: list[MapPanel]


def answer(envelope: Envelope) -> str:
    """In how much of the map enough flights succeed and where, in a sentence; what that means, and how sure it is."""
    asked, cells, flyable = envelope.asked, envelope.panels[0].cells, envelope.cells.flyable
    several, limited = asked.flights > 1, bool(asked.campaign.file.failure)
    over = f"combinations of {words(asked.x.key)} and {words(asked.y.key)}"
    names = [f" with {one.name}" if one.name else "" for one in envelope.panels]
    did, (do, can) = DID[limited], ("succeed", "can be flown") if limited else ["reach the end"] * 2
    if asked.cells == 1:
        said = f"With {asked.x.in_words(asked.x.values[0])} and {asked.y.in_words(asked.y.values[0])}{names[0]}, "
        said += f"{int(envelope.cells.successes.sum()):,} of {asked.flights:,} flights {did}"
    elif not flyable.any():
        over = f"the {cells:,} {over}"
        none = f"In none of {over} did {enough(asked)} flights {do}" if several else f"None of {over} {can}"
        said = f"{none}{units.listed(names)}{best(envelope, do)}"
    else:
        counts = [f"{'all' if flyable.all() else f'{one.flyable:,} of'} {cells:,}" for one in envelope.panels]
        parts = [f"{counts[0]} {over}{f' {can}' * (not several)}{names[0]}"]
        parts += [f"{count}{name}" for count, name in zip(counts[1:], names[1:], strict=True)]
        many = f"all {asked.flights:,}" if (envelope.cells.share[flyable] == 1.0).all() else enough(asked)
        said = f"In {units.listed(parts)}, {many} flights {did}" if several else ", ".join(parts)
        said += ": the map shows no limit" * limited if flyable.all() else borders(envelope)
    judged = "; ".join(asked.campaign.judged[not limited :])
    meant = as_sentence(f" ({judged})" * bool(judged))
    more = f"{how_sure(envelope)}{meant}{idle(envelope)}"
    if not limited:
        said += as_commanded(envelope.cells.lacking, int(envelope.cells.successes.sum()), asked.cells * asked.flights)
    return f"{said[0].upper()}{said[1:]}.{more}"


def how_sure(envelope: Envelope) -> str:
    """What the flights of a combination say of others, in a sentence after a blank: of how many combinations they are too few
    to tell whether `FLYABLE` of them succeed.
    """
    asked, good = envelope.asked, envelope.cells.flyable.ravel()
    if not asked.random:
        return " Nothing is random here: all flights of a combination are identical." * (asked.flights > 1)
    if asked.flights == 1:
        return " Each was flown once, so chance decides, too."
    ends = [share(int(one), asked.flights) for one in envelope.cells.successes.flat]
    open_ones = np.array([one.low < FLYABLE <= one.high for one in ends])
    shown, out = (int((open_ones & of).sum()) for of in (good, ~good))
    rate, one = f"a success rate of {units.percent(FLYABLE)}", good.size == 1
    told = [f"to show {rate}{'' if one else ' in any of these' if shown == good.sum() else f' in {shown:,} of these'}"] * bool(
        shown
    )
    where = "" if one else f" in {out:,} of the {'others' if good.any() else 'combinations'}"
    told += [f"to rule {'it out' if shown else f'out {rate}'}{where}"] * bool(out)
    return f" {asked.flights:,} flights are too few {units.listed(told, 'or')}." if told else ""


def best(envelope: Envelope, do: str) -> str:
    """Where most flights succeed, and how many, in a clause after a semicolon; nothing of one flight each."""
    asked, successes = envelope.asked, envelope.cells.successes
    most = int(successes.max())
    if asked.flights == 1 or not most:
        return ""
    where = zip((asked.by, asked.y, asked.x), np.argwhere(successes == most)[0], strict=True)
    at = units.listed([axis.in_words(axis.values[place]) for axis, place in where if axis][::-1])
    such = "the best" if (successes == most).sum() == 1 else "one of the best"
    return f"; in {such}, {at}, {most:,} of {asked.flights:,} flights {do}"


def borders(envelope: Envelope) -> str:
    """Where along the axes of numbers all of the map can be flown and where none of it, in a clause after a colon: over whole
    rows or columns, else from a corner on.
    """
    asked, flyable = envelope.asked, envelope.cells.flyable
    axes, parts = [(one, place) for one, place in ((asked.x, 2), (asked.y, 1)) if one.ranged], []
    for what, cells in (("all", flyable), ("none", ~flyable)):
        lines = [(axis, np.asarray(cells.all(axis=tuple({0, 1, 2} - {place})))) for axis, place in axes]
        where = " or ".join(filter(None, (span(axis, line, asked.random) for axis, line in lines)))
        if not where and len(axes) == len(asked.axes):
            rows, columns = corner(cells[0])
            where = " and ".join(filter(None, (span(asked.x, columns, asked.random), span(asked.y, rows, asked.random))))
        parts += [f"{'in ' * (asked.flights > 1)}{what} where {where}"] * bool(where)
    whole = {1: "", 2: "with both, "}.get(len(envelope.panels), "with each, ")
    return f": {whole}{', '.join(parts)}" if parts else ""


def corner(cells: NDArray[np.bool_]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """The rows and columns of the largest block at a corner in which all of these cells hold; of fewer than four, none."""
    rows, columns, most = np.zeros(len(cells), bool), np.zeros(len(cells.T), bool), 3
    sizes = np.outer(np.arange(1, len(cells) + 1), np.arange(1, len(cells.T) + 1))
    for up, right in itertools.product((1, -1), (1, -1)):
        areas = sizes * np.logical_and.accumulate(np.logical_and.accumulate(cells[::up, ::right], axis=0), axis=1)
        if areas.max() > most:
            row, column = np.unravel_index(areas.argmax(), areas.shape)
            most = areas.max()
            rows, columns = (np.arange(len(rows)) <= row)[::up], (np.arange(len(columns)) <= column)[::right]
    return rows, columns


def span(axis: MapAxis, line: NDArray[np.bool_], chance: bool) -> str:
    """The values at which a line holds, if they follow one another, in a clause; else nothing. chance: whether those between
    others that do not may be so by chance, which is no range.
    """
    at, last = np.flatnonzero(line), len(axis.values) - 1
    if at.size in (0, last + 1) or at[-1] - at[0] >= at.size or (chance and at[0] > 0 and at[-1] < last):
        return ""
    if at.size == 1:
        return f"the {words(axis.key)} is {axis.shown(axis.values[at[0]])}"
    low, high = axis.shown(axis.values[at[0]], -1), axis.shown(axis.values[at[-1]], 1)
    how = f"at most {high}" if at[0] == 0 else f"at least {low}" if at[-1] == last else f"from {low} to {high}"
    return f"the {words(axis.key)} is {how}"


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


def enough(request: Request) -> str:
    """How many of its flights must succeed for a combination to count as flyable."""
    flights = request.flights
    return f"all {flights:,}" if needed(flights) == flights else f"at least {needed(flights):,} of {flights:,}"


def caption(envelope: Envelope, linked: bool) -> str:
    """What the map shows, line by line. linked: whether cells with a circle are links."""
    cells, seen = envelope.cells, coloured(envelope.cells)
    several, lines = envelope.asked.flights > 1, coloured_by(envelope.cells)
    if not seen.all():
        causes = cells.cause[~seen]
        few = (
            "in which fewer than half of the flights succeed"
            if several
            else f"whose flight {'is lost' if causes.all() else 'fails'}"
        )
        look = "Hatched" if causes.all() else "Hatched or dotted" if causes.any() else "Dotted"
        lines.append(f"{look}: {units.counted(int((~seen).sum()), 'cell')} {few}.")
    if (struck := seen & ~cells.flyable).any() and cells.flyable.any():
        lines.append(f"Struck through: {units.counted(int(struck.sum()), 'cell')} in which {too_few(envelope.asked.flights)}.")
    if cells.crossed and len(cells.lacking) < cells.successes.sum():
        lines.append(f"Crosses: {len(cells.crossed):,} of the {len(cells.lacking):,} flights that are graded.")
    if linked:
        lines.append(f"Circles: click one to see {'a' if several else 'the'} flight of that cell.")
    return "\n".join(lines)


def along(envelope: Envelope) -> str:
    """The caption of the lines: where the last is surely above the first, outside what most flights there have, and below."""
    asked, y = envelope.asked, envelope.asked.y
    if asked.by:
        return f"The same errors where {y.in_words(y.values[len(y.values) // 2])}."
    low, middle, high = np.where(coloured(envelope.cells), envelope.cells.spread, np.nan)[:, 0]
    sides, sure = (middle[-1] > high[0], middle[-1] < low[0]), asked.flights >= NOISY_FLIGHTS or not asked.random
    ends = [one for side in sides if sure and (one := span(asked.x, side, asked.random))]
    last, first = (y.in_words(y.values[place]) for place in (-1, 0))
    said = f" With {last} they are larger than with {first} where {' and smaller where '.join(ends)}."
    return f"The same errors.{said * (len(ends) == 2)}"


def coloured_by(cells: Cells) -> list[str]:
    """What the colours of a map mean, in a sentence; none where there are none."""
    values, more = (cells.share, "more") if by_success(cells) else (cells.rmse[coloured(cells)], "larger")
    lighter = f"; lighter means {more}" * bool(values.size and np.ptp(values))
    return [f"Colour: {one.what}, {one.value}{lighter}." for one in mapped(cells)]


def mapped(cells: Cells) -> list[Fact]:
    """What the colours of a map show, from the least to the largest; none where it has no colours."""
    rmse, among = cells.rmse[coloured(cells)], "smallest to largest of the coloured combinations"
    if by_success(cells):
        return [Fact("share of flights that succeed", between(cells.share, units.percent), among)]
    if not rmse.size:
        return []
    unit, factor = units.handy("m", rmse.max())
    value = between(factor * rmse, units.number) + units.unit_suffix(unit)
    return [Fact(f"{'median ' * (cells.flights > 1)}position RMSE", value, among)]


def between(values: NDArray[np.float64], told: Callable[[float], str]) -> str:
    """The least and the largest of some numbers."""
    return " to ".join(dict.fromkeys((told(float(values.min())), told(float(values.max())))))
