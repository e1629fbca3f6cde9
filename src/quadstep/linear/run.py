"""`quadstep linear`: one mission from file to folder."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from quadstep.engines.fingerprint import fingerprint
from quadstep.io.errors import UserError
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
from quadstep.report import page
from quadstep.report.publish import MANIFEST, publishing, write_json
from quadstep.report.sheet import Sheet
from quadstep.report.tables import write_csv

REPORT = "report.html"
DRAWN = 600
"""Number of frequencies in a plot."""

SLOWEST_SHOWN = 0.1
"""[rad/s]"""


class Done(NamedTuple):
    """The output of the command."""

    name: str
    studied: Studied
    steps: list[Step]
    sentences: list[str]
    record: dict[str, object]


def linear_mission(path: Path, folder: Path, overwrite: bool, sheet: Sheet) -> Done:
    """Linearise the mission in `path` where its path begins, and write `folder`. Raises UserError."""
    mission = read_mission(path)
    with publishing(folder, "linear-" + fingerprint([plan_mission(mission, path)]), overwrite) as out:
        found = of_file(mission, path)
        moves = steps(found.rest.period, found.analysis.poles) if found.analysis.stable else []
        said = tables.sentences(found.analysis)
        if not found.analysis.stable:
            said.append(flown_from_rest(mission))
        done = Done(mission.name, found, moves, said, {**about(mission, path, found, moves), "sentences": said})
        write(out, done, sheet)
    return done


def of_file(mission: Mission, path: Path) -> Studied:
    """The same, with the file named in errors."""
    try:
        return studied(mission)
    except UserError as error:
        raise UserError(f"{path}: {error}") from None


def about(mission: Mission, path: Path, found: Studied, moves: list[Step]) -> dict[str, object]:
    """The content of `--json` and of `linear.json`."""
    given = {"name": mission.name, "version": __version__, "mission": str(path), "controller": mission.controller.type}
    return {**given, **record(found.analysis, moves)}


def write(out: Path, done: Done, sheet: Sheet) -> None:
    """Write every file of the folder."""
    found = done.studied.analysis
    margins = zip(found.channels, found.margins, strict=False)
    rows = [(channel.name, *margin_numbers(one)) for channel, one in margins]
    write_csv(out / "margins.csv", ("channel", *MARGIN_COLUMNS), rows)
    write_csv(out / "poles.csv", ("real[1/s]", "imaginary[rad/s]", "states"), [pole.row for pole in found.poles])
    write_json(out / "linear.json", done.record)
    page.write_page(out / REPORT, done.name, sections(out, done, sheet), "Linear")
    write_json(out / MANIFEST, {**done.record, "states": len(found.loop.period.names)})


def sections(out: Path, done: Done, sheet: Sheet) -> list[str]:
    """The body of the report; draws the figures."""
    found = done.studied.analysis
    answer, *more = done.sentences
    poles = [page.heading("Poles", "poles"), page.table(tables.POLE_HEADER, tables.pole_rows(found.poles, None))]
    if not found.stable:
        return [page.summary(answer), *map(page.paragraph, more), *poles]
    figures = out / "figures"
    figures.mkdir()
    drawn = sheet.with_svg()
    shown = opened_loop(found)
    for name, draw in (("bode", draw_bode), ("nyquist", draw_nyquist)):
        draw(figures / name, done.name, shown, drawn)
    draw_steps(figures / "step", done.name, done.steps, drawn)
    captions = {
        "bode": "Bode plot of each channel opened",
        "step": "Response to a step of the path along each axis",
        "nyquist": "Nyquist plot of each channel opened",
    }
    glance = [page.figure(figures / f"{name}.svg", caption) for name, caption in captions.items()]
    return [
        page.summary(answer, worst.facts([("", found)]), glance),
        *map(page.paragraph, more),
        page.heading("Margins", "margins"),
        page.paragraph(tables.METHOD),
        page.table(tables.MARGIN_HEADER, tables.margin_rows(found)),
        *poles,
        page.heading("Steps of the path", "steps"),
        page.table(tables.STEP_HEADER, tables.step_rows(done.steps)),
    ]


def opened_loop(found: Analysis) -> Open:
    """The data of the plots: up to half the rate of the law."""
    ready = opened(found.loop)
    highest = np.pi * len(ready.due) / ready.length
    omega = np.geomspace(max(LOWEST, SLOWEST_SHOWN), highest, DRAWN)
    return Open(found.channels, omega, harmonic(ready, omega))
