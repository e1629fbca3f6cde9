"""`quadstep linear`: one mission from file to folder."""

from pathlib import Path

import numpy as np

from quadstep.engines.fly import fingerprint
from quadstep.io.errors import UserError
from quadstep.io.results.record import FIGURES
from quadstep.io.version import __version__
from quadstep.linear import tables, worst
from quadstep.linear.analysis import Analysis, Studied, studied
from quadstep.linear.cycle import flown_from_rest
from quadstep.linear.picture import Open, draw_bode, draw_nyquist, draw_steps
from quadstep.linear.record import MARGIN_COLUMNS, margin_numbers, record
from quadstep.linear.step import Step, steps
from quadstep.linear.transfer import LOWEST, harmonic, opened
from quadstep.mission.read import plan_mission, read_mission
from quadstep.mission.schema import Mission
from quadstep.report.evidence import Evidence, Figure, Table
from quadstep.report.publish import MANIFEST, publishing, write_json
from quadstep.report.sheet import Sheet
from quadstep.report.tables import write_csv

CAPTIONS = {
    "bode": "Bode plot of each channel opened",
    "step": "Response to a step of the path along each axis",
    "nyquist": "Nyquist plot of each channel opened",
}
DRAWN = 600
"""Number of frequencies in a plot."""

SLOWEST_SHOWN = 0.1
"""[rad/s]"""


def linear_mission(path: Path, folder: Path, overwrite: bool, sheet: Sheet) -> Evidence:
    """Linearise the mission in `path` where its path begins, and write `folder`. Raises UserError."""
    mission = read_mission(path)
    with publishing(folder, "linear-" + fingerprint([plan_mission(mission, path)]), overwrite) as out:
        found = of_file(mission, path)
        done = evidence(out, mission, path, found, sheet)
        write_csv(out / "margins.csv", ("channel", *MARGIN_COLUMNS), channel_rows(found.analysis))
        write_csv(out / "poles.csv", ("real[1/s]", "imaginary[rad/s]", "states"), [one.row for one in found.analysis.poles])
        write_json(out / "linear.json", done.record)
        done.write_report(out)
        write_json(out / MANIFEST, {**done.record, "states": len(found.analysis.loop.period.names)})
    return done


def of_file(mission: Mission, path: Path) -> Studied:
    """The same, with the file named in errors."""
    try:
        return studied(mission)
    except UserError as error:
        raise UserError(f"{path}: {error}") from None


def channel_rows(found: Analysis) -> list[tuple[object, ...]]:
    """The margins of each channel as numbers."""
    return [(channel.name, *margin_numbers(one)) for channel, one in zip(found.channels, found.margins, strict=False)]


def evidence(out: Path, mission: Mission, path: Path, studied: Studied, sheet: Sheet) -> Evidence:
    """The loop for its readers; draws the figures of a stable one into the folder `out`."""
    found = studied.analysis
    moves = steps(studied.rest.period, found.poles) if found.stable else []
    said = [*tables.sentences(found), *([] if found.stable else [flown_from_rest(mission)])]
    about = {"name": mission.name, "version": __version__, "mission": str(path), "controller": mission.controller.type}
    poles = Table(
        "Poles", "poles", tables.POLE_HEADER, tables.pole_rows(found.poles, None), shown="The slowest poles", most=tables.SHOWN
    )
    done = Evidence(
        name=mission.name,
        kind="Linear",
        answer=said[0],
        sentences=said,
        record={**about, **record(found, moves), "sentences": said},
        tables=[poles],
        more=said[1:],
    )
    if not found.stable:
        return done
    draw(out / FIGURES, found, moves, sheet.with_svg())
    margins = f"{mission.name}: margins, one loop opened at a time"
    return done._replace(
        facts=worst.facts([("", found)]),
        figures=[Figure(f"{FIGURES}/{name}", caption) for name, caption in CAPTIONS.items()],
        tables=[
            Table("Margins", "margins", tables.MARGIN_HEADER, tables.margin_rows(found), tables.METHOD, shown=margins),
            poles,
            Table("Steps of the path", "steps", tables.STEP_HEADER, tables.step_rows(moves)),
        ],
    )


def draw(folder: Path, found: Analysis, moves: list[Step], sheet: Sheet) -> None:
    """The figures: frequencies up to half the rate of the law."""
    folder.mkdir()
    ready = opened(found.loop)
    omega = np.geomspace(max(LOWEST, SLOWEST_SHOWN), np.pi * len(ready.due) / ready.length, DRAWN)
    shown = Open(found.channels, omega, harmonic(ready, omega))
    draw_bode(folder / "bode", shown, sheet)
    draw_nyquist(folder / "nyquist", shown, sheet)
    draw_steps(folder / "step", moves, sheet)
