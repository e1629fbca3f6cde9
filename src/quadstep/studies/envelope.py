"""`quadstep envelope`: from a mission and two keys to the map of where it can be flown."""

import hashlib
import json
from collections.abc import Iterator, Mapping
from itertools import chain
from pathlib import Path
from typing import cast

import numpy as np

from quadstep.mission.fields import label, words
from quadstep.page.model import Cell
from quadstep.report import markup, units
from quadstep.report.evidence import Evidence, Figure, TableSection
from quadstep.report.publish import booktabs
from quadstep.report.sheet import Sheet
from quadstep.studies.campaign.single import FlownAgain, flown_again, lacking, write_flights
from quadstep.studies.campaign.store import parquet
from quadstep.studies.campaign.summary import graded
from quadstep.studies.campaign.varied import variation_text
from quadstep.studies.envelope_answer import Envelope, MapPanel, along, answer, caption, coloured_by, enough, mapped
from quadstep.studies.envelope_cells import CAUSES, FLYABLE, Cells, cells_of, table
from quadstep.studies.envelope_map import LOOKS, colours, draw_map, draw_slices
from quadstep.studies.envelope_request import Request, Value
from quadstep.studies.study import Flown, Study

DATA, PICTURE, SLICES = "envelope.parquet", "envelope", "slices"

HEADER = ("panel", "cells", "flyable", "success rate", "RMSE of flyable cells [{}]", "outcomes of failed flights")
MARKED = "Marked: fewer than half of the flights succeed; one that failed is shown."


class Map(Study[Envelope]):
    """Where a mission can be flown, over two of its keys."""

    def __init__(self, request: Request) -> None:
        self.asked, self.campaign, self.flights = request, request.campaign, request.cells * request.flights
        text = json.dumps(["envelope", self.campaign.fingerprint, request.flights, self.campaign.file.failure, keys(request)])
        self.identity = hashlib.sha256(text.encode()).hexdigest()[:16]

    def fold(self, flown: Flown) -> Envelope:
        """The flights of each cell, gathered."""
        cells = cells_of(self.asked, flown)
        return Envelope(self.asked, cells, list(panels(self.asked, cells)))

    def evidence(self, envelope: Envelope, out: Path, sheet: Sheet) -> Evidence:
        """The map, each panel in numbers, the results of every cell, and the first flights of some to watch."""
        (out / DATA).write_bytes(parquet(table(self.asked, envelope.cells)))
        cells = watched(self.asked)
        seen = {int(envelope.cells.shown.flat[cell]): int(envelope.cells.successes.flat[cell]) for cell in cells}
        again = zip(seen.items(), flown_again(self.campaign, [*seen]), strict=True)
        found = {flight: self.named(one, flight, successes) for (flight, successes), one in again}
        envelope = envelope._replace(cells=envelope.cells._replace(lacking=self.lacking(envelope, found)))
        drawn = colours(envelope.cells)
        places = {flight: self.place(cell, drawn[cell]) for flight, cell in zip(seen, cells, strict=True)}
        said = [*coloured_by(envelope.cells), *[MARKED] * (self.asked.flights > 1 and not all(drawn))]
        links = write_flights(out, self.campaign, found, places, intro=[" ".join(said)] if said else [])
        at = {flight % self.asked.cells: link for flight, link in links.items()}
        draw_map(out / PICTURE, self.asked, envelope.cells, sheet, at)
        lined = draw_slices(out / SLICES, self.asked, envelope.cells, sheet)
        unit, factor = units.handy("m", max((one.rmse[1] for one in envelope.panels if one.rmse), default=0.0))
        header, rows = [one.format(unit) for one in HEADER], [row(one, factor) for one in envelope.panels]
        return Evidence(
            name=self.campaign.file.name,
            kind="Envelope",
            answer=answer(envelope),
            sentences=[answer(envelope)],
            record=as_json(envelope),
            facts=mapped(envelope.cells),
            figures=[Figure(PICTURE, caption(envelope, bool(links)), label="Map"), *[Figure(SLICES, along(envelope))] * lined],
            sections=[
                *([TableSection("Panel by panel", "panels", header, rows)] if self.asked.by else []),
                TableSection("Settings", "flown", ("", ""), settings(self.asked), set_as=markup.own),
            ],
            paper=booktabs(header, [rows], [self.campaign.file.name]),
        )

    def lacking(self, envelope: Envelope, found: Mapping[int, FlownAgain]) -> dict[int, tuple[str, ...]]:
        """`Cells.lacking`, of those found and, with one flight a cell, of the worst; none judged by limits."""
        if self.campaign.file.failure:
            return {}
        ended = np.flatnonzero(envelope.cells.successes if self.asked.flights == 1 else 0)
        worst = ended[np.argsort(-envelope.cells.rmse.ravel()[ended], kind="stable")][:MOST_GRADED].tolist()
        more = [cell for cell in worst if cell not in found]
        blocks = (more[at : at + AT_ONCE] for at in range(0, len(more), AT_ONCE))
        again = (pair for block in blocks for pair in zip(block, flown_again(self.campaign, block), strict=True))
        return {flight % self.asked.cells: one for flight, one in lacking(chain(found.items(), again)).items()}

    def place(self, cell: int, colour: str) -> Cell:
        """Where the page has a flight in its table, and the map's colour there."""
        asked = self.asked
        panel, row, column = np.unravel_index(cell, asked.shape)
        block = asked.by.in_words(asked.by.values[panel]) if asked.by else ""
        at = asked.y.shown(asked.y.values[row]), asked.x.shown(asked.x.values[column])
        return Cell(block, at[0], at[1], words(asked.y.key), words(asked.x.key), colour)

    def named(self, one: FlownAgain, flight: int, successes: int) -> FlownAgain:
        """The same, called by the values of its cell, and of several flights by which it is and how many succeed there."""
        if one.replay is None:
            return one
        name = ", ".join(axis.in_words(cast("Value", one.replay.values[axis.key])) for axis in reversed(self.asked.axes))
        of = f"{flight // self.asked.cells + 1:,} of {self.asked.flights:,}"
        do = "succeed" if self.campaign.file.failure else "reach the end"
        name += f" (flight {of}, of which {successes:,} {do})" * (self.asked.flights > 1)
        return one._replace(replay=one.replay._replace(mission=one.replay.mission.model_copy(update={"name": name})))


MOST_GRADED, AT_ONCE = 300, 32  # beside those shown; so many logs in memory

MOST_WATCHED = 100
"""Cells whose flight can be seen."""


def watched(request: Request) -> list[int]:
    """All cells of a small map, every so many along both axes of a large one; as the map has them, from the top."""
    panels, rows, columns = request.shape
    every = next(n for n in range(1, rows + columns) if panels * -(-rows // n) * -(-columns // n) <= MOST_WATCHED)
    places = np.arange(request.cells).reshape(request.shape)
    return [int(one) for one in places[:, (every - 1) // 2 :: every, (every - 1) // 2 :: every][:, ::-1].flat]


def settings(request: Request) -> list[tuple[str, str]]:
    file = request.campaign.file
    spans = []
    for one in reversed(request.axes):
        some = [one.shown(value) for value in one.values]
        told = f"{len(some)} values of {one.key} from {some[0]} to {some[-1]}" if one.ranged else ", ".join(some)
        spans.append((words(one.key), told))
    return [
        ("mission", str(request.campaign.defaults["name"])),
        *spans,
        *((label(request.campaign.mission, key), variation_text(file, key)) for key in file.keys if key not in keys(request)),
        ("flights per cell", f"{request.flights:,}"),
        ("seed, precision", f"{file.seed}, {file.precision}"),
        ("a flight fails", request.campaign.failing),
        ("a cell can be flown", f"if {enough(request)} succeed" if request.flights > 1 else "if its flight succeeds"),
    ]


def panels(request: Request, cells: Cells) -> Iterator[MapPanel]:
    for place in range(request.shape[0]):
        flyable, rmse = cells.flyable[place], cells.rmse[place][cells.flyable[place]]
        counts = zip(CAUSES, cells.causes[place].reshape(-1, len(CAUSES)).sum(axis=0).tolist(), strict=True)
        yield MapPanel(
            request.by.in_words(request.by.values[place]) if request.by else "",
            flyable.size,
            int(flyable.sum()),
            float(cells.share[place].mean()),
            {cause: count for cause, count in counts if count},
            (float(rmse.min()), float(rmse.max())) if rmse.size else None,
        )


def as_json(envelope: Envelope) -> dict[str, object]:
    asked, file = envelope.asked, envelope.asked.campaign.file
    return {
        "precision": file.precision,
        "seed": file.seed,
        "flights_a_cell": asked.flights,
        "random": asked.random,
        "flyable_share": FLYABLE,
        "failure": file.failure,
        "axes": {
            axis.option.removeprefix("--"): {"key": axis.key, "values": list(axis.values)} for axis in reversed(asked.axes)
        },
        "vary": {key: one.model_dump(exclude_none=True) for key, one in file.vary.items() if key not in keys(asked)},
        "correlated": [one.model_dump(exclude_none=True) for one in file.correlated],
        "mission": json.loads(json.dumps(asked.campaign.defaults, default=str)),
        "panels": [dict(zip((*MapPanel._fields[:-1], "rmse[m]"), one, strict=True)) for one in envelope.panels],
        **({} if file.failure else {"graded": graded(envelope.cells.lacking)}),
    }


def keys(request: Request) -> list[str]:
    return [axis.key for axis in request.axes]


def row(one: MapPanel, factor: float) -> list[str]:
    """A panel in the table, whose errors are in one unit."""
    causes = ", ".join(f"{count:,} {LOOKS[name][2]}" for name, count in one.causes.items())
    rmse = " to ".join(units.number(factor * end) for end in one.rmse) if one.rmse else "–"
    return [one.name or "the map", f"{one.cells:,}", f"{one.flyable:,}", units.percent(one.success), rmse, causes or "–"]
