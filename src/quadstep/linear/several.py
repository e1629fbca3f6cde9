"""`quadstep linear` for several loops, from file to folder: a mission under other laws, or at instants of its flight."""

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from quadstep.engines.fingerprint import fingerprint
from quadstep.io.errors import UserError
from quadstep.io.version import __version__
from quadstep.linear import tables, worst
from quadstep.linear.along import along
from quadstep.linear.analysis import Analysis
from quadstep.linear.laws import named, under_each
from quadstep.linear.picture import draw_over
from quadstep.linear.record import MARGIN_COLUMNS, margin_numbers, record
from quadstep.mission.read import plan_mission, read_mission
from quadstep.report import page
from quadstep.report.publish import MANIFEST, publishing, write_json
from quadstep.report.sheet import Sheet
from quadstep.report.tables import write_csv
from quadstep.report.terminal.progress import Progress

REPORT = "report.html"


class Several(NamedTuple):
    """name: of the mission. kind: what the loops are. found: the loops; at: their times [s] or numbers, none for laws."""

    name: str
    kind: str
    found: list[tuple[str, Analysis | str]]
    at: list[float]

    @property
    def refused(self) -> list[str]:
        """A line for each that cannot be linearised."""
        return worst.refused(self.found)


def laws(path: Path, text: str, folder: Path, overwrite: bool, sheet: Sheet, progress: Progress) -> Several:
    """The mission's loop under each controller that `text` names. Raises UserError."""
    mission = read_mission(path)
    names = named(mission, text, path.parent)
    plan = plan_mission(mission, path)
    with publishing(folder, f"linear-{'-'.join(names)}-" + fingerprint([plan]), overwrite) as out:
        done = Several(mission.name, "laws", collected(under_each(path, names), progress), [])
        write(out, done, path, sheet)
    return done


def instants(path: Path, count: int, folder: Path, overwrite: bool, sheet: Sheet, progress: Progress) -> Several:
    """The mission's loop at `count` instants of its flight. Raises UserError."""
    mission = read_mission(path)
    plan = plan_mission(mission, path)
    with publishing(folder, f"linear-along-{count}-" + fingerprint([plan]), overwrite) as out:
        try:
            found = collected(((f"t = {t:g} s", one) for t, one in along(mission, count)), progress)
        except UserError as error:
            raise UserError(f"{path}: {error}") from None
        done = Several(mission.name, "instants", found, [float(name.split()[2]) for name, _ in found])
        write(out, done, path, sheet)
    return done


def collected(made: Iterable[tuple[str, Analysis | str]], progress: Progress) -> list[tuple[str, Analysis | str]]:
    """All loops. Raises UserError if none can be linearised."""
    found = []
    for one in made:
        found.append(one)
        progress.to(len(found))
    if not any(isinstance(one, Analysis) for _, one in found):
        raise UserError(worst.refused(found)[0])
    return found


def about(done: Several, path: Path) -> dict[str, object]:
    """The content of `--json` and of `linear.json`."""
    loops = [
        {"name": name, **(record(one, []) if isinstance(one, Analysis) else {"refused": one})} for name, one in done.found
    ]
    least = [one._asdict() for one in worst.worst(done.found)]
    return {"name": done.name, "version": __version__, "file": str(path), "kind": done.kind, "worst": least, "loops": loops}


def write(out: Path, done: Several, path: Path, sheet: Sheet) -> None:
    """Write every file of the folder."""
    rows = [
        (name, channel.name, one.poles[0].real, *margin_numbers(margins))
        for name, one in worst.stable(done.found)
        for channel, margins in zip(one.channels, one.margins, strict=True)
    ]
    write_csv(out / "margins.csv", ("loop", "channel", "slowest_pole[1/s]", *MARGIN_COLUMNS), rows)
    full = about(done, path)
    write_json(out / "linear.json", full)
    body, drawn = [page.heading("Worst margins", "worst"), page.paragraph(tables.METHOD)], []
    body.append(page.table(worst.WORST_HEADER, worst.worst(done.found)))
    if done.at and rows:
        (out / "figures").mkdir()
        kept = [
            (at, one) for at, (_, one) in zip(done.at, done.found, strict=True) if isinstance(one, Analysis) and one.stable
        ]
        label = "t [s]" if done.kind == "instants" else "flight"
        draw_over(out / "figures" / "margins", done.name, label, np.array([at for at, _ in kept]), [one for _, one in kept],
                  sheet.with_svg())  # fmt: skip
        drawn.append(page.figure(out / "figures" / "margins.svg", f"Margins of each channel over {label}"))
    body += [page.heading("Every loop: smallest margins over its channels", "loops")]
    body.append(page.table(worst.ROW_HEADER, worst.rows(done.found)))
    if done.refused:
        body += [page.heading("Not linearised", "refused"), page.listing(done.refused)]
    page.write_page(
        out / REPORT, done.name, [page.summary(worst.grades(done.found), worst.facts(done.found), drawn), *body], "Linear"
    )
    write_json(out / MANIFEST, {key: value for key, value in full.items() if key != "loops"})
