"""`quadstep study vehicles`: flown on all cores, written as one folder."""

import math
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, as_completed
from pathlib import Path
from typing import Any, NamedTuple

from quadstep import __version__
from quadstep.comparison import cell as flown
from quadstep.comparison.cell import Cell
from quadstep.comparison.flights import CONTROLLERS, FIRST_SEED, PUBLISHED, SENSORS, VEHICLES, WINDS
from quadstep.comparison.kept import Kept, key
from quadstep.errors import InterruptedRun
from quadstep.report import page
from quadstep.report.pool import drawing_pool
from quadstep.report.publish import MANIFEST, publishing, write_json
from quadstep.report.tables import write_csv

NAME = "Controllers on real vehicles"
WINDY = "research-2.6kg"
HARDEST = "vertical eight, wind 12.1"


class Comparison(NamedTuple):
    """Findings of the study."""

    seeds: int
    cells: list[Cell]

    def cell(self, vehicle: str, scenario: str, controller: str) -> Cell:
        """One of them."""
        wanted = (vehicle, scenario, controller)
        return next(cell for cell in self.cells if (cell.vehicle, cell.scenario, cell.controller) == wanted)


COLUMNS = (
    "vehicle", "scenario", "controller", "flights", "rmse[m]", "rmse_low[m]", "rmse_high[m]", "largest[m]",
    "activity[1/s]", "saturated_share", "lost_share", "lost_low", "lost_high",
)  # fmt: skip
"""Of cells.csv."""


def study_vehicles(
    folder: Path, seeds: int, vehicles: Sequence[str], overwrite: bool, progress: Callable[[int, int], None] | None = None
) -> Comparison:
    """Fly, and write `folder`: cells.csv, metrics.json, pictures, report.html. progress: told flights done, and of how many.

    Cells that an interrupted run left in the folder are not flown again. Raises UserError, and InterruptedRun on Ctrl-C.
    """
    from quadstep.comparison.picture import draw_vehicle, draw_wind  # noqa: PLC0415 (matplotlib loads only where it draws)

    with publishing(folder, f"vehicles {seeds} {','.join(vehicles)}", overwrite) as out, drawing_pool() as pool:
        kept = Kept(folder)
        try:
            cells = fly_cells(pool, kept, vehicles, seeds, progress or (lambda *_: None))
        except KeyboardInterrupt:
            raise InterruptedRun(f"{len(kept.cells)} cells are kept in {folder}; the same command continues") from None
        found = Comparison(seeds, cells)
        write_cells(out / "cells.csv", found.cells)
        write_json(out / MANIFEST, as_json(found))
        for vehicle in vehicles:
            draw_vehicle(out, vehicle, [cell for cell in found.cells if cell.vehicle == vehicle])
        if WINDY in vehicles:
            draw_wind(out, [cell for cell in found.cells if cell.vehicle == WINDY])
        page.write_page(out / "report.html", NAME, sections(out, found, vehicles))
    kept.remove()
    return found


def fly_cells(
    pool: Executor, kept: Kept, vehicles: Sequence[str], seeds: int, progress: Callable[[int, int], None]
) -> list[Cell]:
    """Every scenario of every vehicle under every controller, in this order; cells that are kept are not flown again."""
    asked = {
        key(vehicle, controller, scenario, seeds): (vehicle, controller, name, scenario)
        for vehicle in vehicles
        for controller in CONTROLLERS
        for name, scenario in flown.scenario_table(vehicle).items()
    }
    over = len(asked.keys() & kept.cells.keys())
    progress(over * seeds, len(asked) * seeds)
    flying = {pool.submit(flown.fly_cell, *asked[one], seeds): one for one in asked if one not in kept.cells}
    for future in as_completed(flying):
        kept.add(flying[future], future.result())
        over += 1
        progress(over * seeds, len(asked) * seeds)
    return [kept.cells[one] for one in asked]


def as_json(found: Comparison) -> dict[str, Any]:
    """The content of metrics.json; missing values are null."""

    def number(value: float) -> float | None:
        return value if math.isfinite(value) else None

    cells = [
        {
            "vehicle": cell.vehicle,
            "scenario": cell.scenario,
            "controller": cell.controller,
            "flights": cell.flights,
            "rmse[m]": [number(value) for value in cell.rmse],
            "largest[m]": number(cell.largest),
            "activity[1/s]": number(cell.activity),
            "saturated_share": number(cell.saturated),
            "lost": list(cell.lost),
        }
        for cell in found.cells
    ]
    seeds = {"first": FIRST_SEED, "count": found.seeds}
    return {"name": NAME, "version": __version__, "seeds": seeds, "sensors": SENSORS, "cells": cells}


def write_cells(path: Path, cells: Sequence[Cell]) -> None:
    """One row per cell."""
    rows = ((*cell[:4], *cell.rmse, cell.largest, cell.activity, cell.saturated, *cell.lost) for cell in cells)
    write_csv(path, COLUMNS, rows)


def shown(cell: Cell) -> str:
    """RMSE in centimetres with its interval, and what was lost."""
    text = "-"
    if math.isfinite(cell.rmse.value):
        value, low, high = (100.0 * part for part in cell.rmse)
        text = f"{value:.3g} [{low:.3g}, {high:.3g}]" if math.isfinite(low) else f"{value:.3g}"
    return f"{text}; lost {100 * cell.lost.value:.0f} %" if cell.lost.value else text


def sentences(found: Comparison, vehicles: Sequence[str]) -> list[str]:
    """The finding in words, with its numbers."""
    lines = []
    if WINDY in vehicles:
        with_nets, without, geometric, pid = (
            found.cell(WINDY, HARDEST, name) for name in ("adaptive, nets", "adaptive, no nets", "geometric", "PID")
        )
        lines.append(
            f"At 12.1 m/s wind the 2.6 kg vehicle keeps to the vertical figure eight within {shown(with_nets)} cm with nets, "
            f"{shown(without)} without, {shown(geometric)} geometric, {shown(pid)} PID."
        )
    lost_alone = [
        f"{cell.vehicle}, {cell.scenario}"
        for cell in found.cells
        if cell.controller == "adaptive, nets"
        and cell.lost.value > found.cell(cell.vehicle, cell.scenario, "geometric").lost.value
    ]
    lines.append(
        "The adaptive controller with nets loses more flights than the geometric one in: " + "; ".join(lost_alone) + "."
        if lost_alone
        else "Nowhere does the adaptive controller with nets lose more flights than the geometric one."
    )
    return lines


def sections(out: Path, found: Comparison, vehicles: Sequence[str]) -> list[str]:
    """The body of report.html."""
    noise = ", ".join(f"{key} {value:g}" for key, value in SENSORS.items())
    body = [
        *(page.paragraph(line) for line in sentences(found, vehicles)),
        page.paragraph(
            f"{found.seeds} seeds a cell, from {FIRST_SEED} on; gains were found on others, with about the same budget for "
            f"each controller. Every flight has noise and latency (SI units): {noise}. Turbulence: Dryden, MIL-F-8785C, its "
            "wind at 20 ft the mean wind. Cells: mean position RMSE [cm] over completed flights and its 95 % "
            "interval; share of flights lost."
        ),
    ]
    if WINDY in vehicles:
        body += [
            page.heading("In the wind", "wind"),
            page.figure(out / "wind.svg", "RMSE over the wind"),
            page.paragraph(
                "Real flights of a vehicle of that size and path, for the scale only: their air and sensors are not ours."
            ),
            page.table(("published [cm]", *WINDS), [[name, *map(str, values)] for name, values in PUBLISHED.items()]),
        ]
    for vehicle in vehicles:
        cells = [cell for cell in found.cells if cell.vehicle == vehicle]
        scenarios = list(dict.fromkeys(cell.scenario for cell in cells))
        body += [
            page.heading(vehicle, vehicle),
            page.figure(out / f"{vehicle}.svg", f"RMSE of every scenario and controller, {vehicle}"),
            page.table(
                ("scenario: RMSE [cm]", *CONTROLLERS),
                [[name, *(shown(cell) for cell in cells if cell.scenario == name)] for name in scenarios],
            ),
            page.table(
                ("scenario: largest error [m], activity [1/s], saturated", *CONTROLLERS),
                [
                    [
                        name,
                        *(
                            f"{cell.largest:.2g}, {cell.activity:.2g}, {100 * cell.saturated:.2g} %"
                            if math.isfinite(cell.largest)
                            else "-"
                            for cell in cells
                            if cell.scenario == name
                        ),
                    ]
                    for name in scenarios
                ],
            ),
        ]
    return body


def table_rows(found: Comparison, vehicle: str) -> list[list[str]]:
    """The rows for the screen."""
    cells = [cell for cell in found.cells if cell.vehicle == vehicle]
    scenarios = list(dict.fromkeys(cell.scenario for cell in cells))
    return [[name, *(shown(cell) for cell in cells if cell.scenario == name)] for name in scenarios]


__all__ = ["CONTROLLERS", "VEHICLES", "Comparison", "sentences", "study_vehicles", "table_rows"]
