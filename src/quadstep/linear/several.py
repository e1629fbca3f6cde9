"""`quadstep linear` for several loops, from file to folder: a mission under other laws, or at instants of its flight."""

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from quadstep.engines.fly import fingerprint
from quadstep.io.errors import UserError
from quadstep.io.results.record import FIGURES
from quadstep.io.version import __version__
from quadstep.linear import tables, worst
from quadstep.linear.along import along
from quadstep.linear.analysis import Analysis
from quadstep.linear.laws import named, under_each
from quadstep.linear.picture import draw_over
from quadstep.linear.record import MARGIN_COLUMNS, margin_numbers, record
from quadstep.mission.read import plan_mission, read_mission
from quadstep.report.evidence import Evidence, Figure, Table
from quadstep.report.publish import MANIFEST, publishing, write_json
from quadstep.report.sheet import Sheet
from quadstep.report.tables import write_csv
from quadstep.report.terminal.progress import Progress
from quadstep.report.terminal.screen import command


class Several(NamedTuple):
    """name: of the mission. kind: what the loops are. found: the loops; at: their times [s] or numbers, none for laws."""

    name: str
    kind: str
    found: list[tuple[str, Analysis | str]]
    at: list[float]


def laws(path: Path, text: str, folder: Path, overwrite: bool, sheet: Sheet, progress: Progress) -> Evidence:
    """The mission's loop under each controller that `text` names. Raises UserError."""
    mission = read_mission(path)
    names = named(mission, text, path.parent)
    plan = plan_mission(mission, path)
    with publishing(folder, f"linear-{'-'.join(names)}-" + fingerprint([plan]), overwrite) as out:
        done = Several(mission.name, "laws", collected(under_each(path, names), progress), [])
        return write(out, done, path, sheet)


def instants(path: Path, count: int, folder: Path, overwrite: bool, sheet: Sheet, progress: Progress) -> Evidence:
    """The mission's loop at `count` instants of its flight. Raises UserError."""
    mission = read_mission(path)
    plan = plan_mission(mission, path)
    with publishing(folder, f"linear-along-{count}-" + fingerprint([plan]), overwrite) as out:
        try:
            found = collected(((f"t = {t:g} s", one) for t, one in along(mission, count)), progress)
        except UserError as error:
            raise UserError(f"{path}: {error}") from None
        done = Several(mission.name, "instants", found, [float(name.split()[2]) for name, _ in found])
        return write(out, done, path, sheet)


def collected(made: Iterable[tuple[str, Analysis | str]], progress: Progress) -> list[tuple[str, Analysis | str]]:
    """All loops. Raises UserError if none can be linearised."""
    found = []
    for one in made:
        found.append(one)
        progress.to(len(found))
    if not any(isinstance(one, Analysis) for _, one in found):
        raise UserError(worst.refused(found)[0])
    return found


def write(out: Path, done: Several, path: Path, sheet: Sheet) -> Evidence:
    """Write every file of the folder; what they say."""
    rows = [
        (name, channel.name, one.poles[0].real, *margin_numbers(margins))
        for name, one in worst.stable(done.found)
        for channel, margins in zip(one.channels, one.margins, strict=True)
    ]
    write_csv(out / "margins.csv", ("loop", "channel", "slowest_pole[1/s]", *MARGIN_COLUMNS), rows)
    figures = []
    if done.at and rows:
        (out / FIGURES).mkdir()
        label = "t [s]" if done.kind == "instants" else "flight"
        figures.append(Figure(f"{FIGURES}/margins", f"Margins of each channel over {label}"))
        pairs = zip(done.at, done.found, strict=True)
        drawn = [(at, one) for at, (_, one) in pairs if isinstance(one, Analysis) and one.stable]
        times, stable = np.array([at for at, _ in drawn]), [one for _, one in drawn]
        draw_over(out / figures[0].name, label, times, stable, sheet.with_svg())
    found = evidence(done, path, figures)
    write_json(out / "linear.json", found.record)
    found.write_report(out)
    write_json(out / MANIFEST, {key: value for key, value in found.record.items() if key != "loops"})
    return found


def evidence(done: Several, path: Path, figures: list[Figure]) -> Evidence:
    """The loops for their readers: on the terminal of laws each, of others the worst."""
    least, answer, laws = worst.worst(done.found), worst.grades(done.found), done.kind == "laws"
    loops = [
        {"name": name, **(record(one, []) if isinstance(one, Analysis) else {"refused": one})} for name, one in done.found
    ]
    about = {"name": done.name, "version": __version__, "file": str(path), "kind": done.kind}
    refused = worst.refused(done.found)
    fly = [
        "To fly the draw with the smallest phase margin: " + command("fly", path, "--flight", one.where.split()[1])
        for one in least
        if done.kind == "draws" and one.margin == worst.PHASE
    ]
    each = f"{done.name}: smallest margins over all channels" if laws else ""
    shown = "" if laws else f"{done.name}: worst margins of {len(done.found)} loops"
    return Evidence(
        name=done.name,
        kind="Linear",
        answer=answer,
        sentences=[*([] if laws else worst.unstable(done.found)), answer, *(f"Not linearised: {line}" for line in refused)],
        record={**about, "worst": [one._asdict() for one in least], "loops": loops},
        facts=worst.facts(done.found),
        figures=figures,
        tables=[
            Table("Worst margins", "worst", worst.WORST_HEADER, least, tables.METHOD, shown=shown),
            Table(
                "Every loop: smallest margins over its channels", "loops", worst.ROW_HEADER, worst.rows(done.found), shown=each
            ),
            *([Table("Not linearised", "refused", ("",), [(line,) for line in refused])] if refused else []),
        ],
        commands=fly,
    )
