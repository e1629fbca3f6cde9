"""`quadstep envelope`: from a mission and two keys to a folder with the map."""

import hashlib
import json
from collections.abc import Iterator
from pathlib import Path

from quadstep.engines.engine import CAMPAIGNS, Engine, loaded
from quadstep.io.version import __version__
from quadstep.report.publish import MANIFEST, publishing, write_json
from quadstep.report.sheet import Sheet
from quadstep.report.terminal.progress import SILENT, Count, Progress
from quadstep.studies.campaign.store import parquet
from quadstep.studies.envelope.axes import Axis, shown
from quadstep.studies.envelope.cells import CAUSES, FLYABLE, Cells, fly_cells, table
from quadstep.studies.envelope.found import Envelope, Panel
from quadstep.studies.envelope.picture import draw_map
from quadstep.studies.envelope.report import write_report
from quadstep.studies.envelope.request import Request

DATA, PICTURE, REPORT = "envelope.parquet", "envelope", "report.html"


def fly_envelope(
    asked: Request,
    folder: Path,
    engine: Engine = Engine.LANES,
    overwrite: bool = False,
    progress: Progress = SILENT,
    sheet: Sheet | None = None,
) -> Envelope:
    """Fly the map and write `folder`: report.html, envelope.parquet, the map, metrics.json; all of it or nothing.

    sheet: what the map is drawn on. Raises UserError.
    """
    with publishing(folder, identity(asked), overwrite) as out:
        count = Count(progress, asked.cells * asked.flights)
        cells = fly_cells(asked, loaded(CAMPAIGNS, engine)(asked.campaign), count.add)
        found = Envelope(asked, cells, list(panels(asked, cells)))
        (out / DATA).write_bytes(parquet(table(asked, cells)))
        draw_map(out / PICTURE, asked, cells, (sheet or Sheet()).shown())
        write_report(out / REPORT, found, PICTURE)
        write_json(out / MANIFEST, as_json(found, engine))
    return found


def identity(asked: Request) -> str:
    """A digest of all that decides the map."""
    file = asked.campaign.file
    text = json.dumps(["envelope", asked.campaign.fingerprint, asked.flights, file.failure, [axis.key for axis in asked.axes]])
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def panels(asked: Request, cells: Cells) -> Iterator[Panel]:
    """The panels in numbers."""
    for place in range(asked.shape[0]):
        flyable, rmse = cells.flyable[place], cells.rmse[place][cells.flyable[place]]
        counts = zip(CAUSES, cells.causes[place].reshape(-1, len(CAUSES)).sum(axis=0).tolist(), strict=True)
        yield Panel(
            panel_name(asked.by, place),
            flyable.size,
            int(flyable.sum()),
            float(cells.share[place].mean()),
            {cause: count for cause, count in counts if count},
            (float(rmse.min()), float(rmse.max())) if rmse.size else None,
        )


def panel_name(by: Axis | None, place: int) -> str:
    """What a panel shows."""
    return f"{by.key} = {shown(by.values[place])}" if by else ""


def as_json(found: Envelope, engine: Engine) -> dict[str, object]:
    """The content of metrics.json."""
    asked, file = found.asked, found.asked.campaign.file
    return {
        "name": f"Envelope of {asked.campaign.defaults['name']}",
        "version": __version__,
        "engine": engine.value,
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
        "mission": json.loads(json.dumps(asked.campaign.content, default=str)),
        "panels": [panel_as_json(panel) for panel in found.panels],
    }


def panel_as_json(panel: Panel) -> dict[str, object]:
    """A panel with the unit in its key."""
    *others, _ = panel._asdict().items()
    return {**dict(others), "rmse[m]": panel.rmse}


def keys(asked: Request) -> list[str]:
    """Of the axes."""
    return [axis.key for axis in asked.axes]


def sentence(found: Envelope) -> str:
    """The flyable share of each panel, in words."""
    asked = found.asked
    parts = [
        f"{100.0 * panel.flyable / panel.cells:.3g} % ({panel.flyable} of {panel.cells} cells)"
        + (f" with {panel.name}" if panel.name else "")
        for panel in found.panels
    ]
    cell = (
        f" A cell counts if at least {100 * FLYABLE:g} % of its {asked.flights} flights succeed." if asked.flights > 1 else ""
    )
    same = "" if asked.random or asked.flights == 1 else " Nothing is random here: all flights of a cell are identical."
    return f"Flyable of {asked.x.key} and {asked.y.key}: {', '.join(parts)}.{cell}{same}"
