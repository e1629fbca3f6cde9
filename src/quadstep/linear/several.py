"""`quadstep linear` for several loops, from file to folder: a mission under other laws, or at instants of its flight."""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from quadstep.control.registry import controllers
from quadstep.engines.fly import FlightPlan, fingerprint
from quadstep.io import __version__
from quadstep.io.documents import read_toml
from quadstep.io.doors import CONTROLLERS
from quadstep.io.errors import UserError, errors_in
from quadstep.io.run_record import FIGURES
from quadstep.linear import tables, worst
from quadstep.linear.analysis import Analysis, analyse_rest, limits, of_even_rotors, of_loop, worst_of
from quadstep.linear.equilibrium import flown_to, quiet
from quadstep.linear.margins import MarginLimits
from quadstep.linear.modes import reduced
from quadstep.linear.run import MARGIN_COLUMNS, margin_numbers, record
from quadstep.linear.sampled import Loops, linearised, linearising
from quadstep.linear.states import NotLinearError
from quadstep.linear.tables import draw_over
from quadstep.mission.derived import ControllerSection
from quadstep.mission.own_controller import own_section
from quadstep.mission.own_thing import unknown_type
from quadstep.mission.read import check_mission, plan_mission, read_mission
from quadstep.mission.schema import Mission
from quadstep.report.evidence import Evidence, Figure, TableSection
from quadstep.report.progress import Progress
from quadstep.report.publish import MANIFEST, publishing, write_csv, write_json
from quadstep.report.screen import command
from quadstep.report.sheet import Sheet


def along(mission: Mission, instants: int) -> Iterator[tuple[float, Analysis | str]]:
    """Times [s] spread over the mission's noise-free flight, and the loop there, or why there is none. Raises UserError."""
    plans = of_even_rotors(quiet(mission.plan(warn=False)))
    period = Loops(plans[0]).count
    last = plans[0].ticks.last // period - 1
    if last < 1:
        raise UserError(f"the flight ends before the common period of its loops, {period * plans[0].ticks.step:g} s")
    for place in np.unique(np.linspace(1, last, instants).round().astype(int)):
        first = int(place) * period
        yield first * plans[0].ticks.step, at(plans, first, limits(mission))


def at(plans: list[FlightPlan], first: int, limits: MarginLimits) -> Analysis | str:
    try:
        with linearising():
            loops = [reduced(linearised(Loops(plan), flown_to(plan, first), first)) for plan in plans]
            return worst_of([of_loop(one, limits) for one in loops])
    except NotLinearError as error:
        return str(error)


ALL = "all"


def named(mission: Mission, text: str, folder: Path) -> list[str]:
    """The controllers that `--controllers` names: names separated by commas, or `all`. folder: of the user's own. Raises
    UserError.
    """
    known = list(controllers(mission.measures))
    if text.strip() == ALL:
        return known
    names = [name.strip() for name in text.split(",")]
    for name in names:
        if name not in known and own_section(name, mission.measures, folder) is None:
            raise UserError(f"--controllers: {unknown_type(name, (ALL, *known), CONTROLLERS)}")
    return list(dict.fromkeys(names))


def under_each(path: Path, names: Sequence[str]) -> Iterator[tuple[str, Analysis | str]]:
    """The mission in a file under each law, by name, and its loop, or why there is none."""
    content = read_toml(path)
    for name in names:
        try:
            other, nets = under(content, path, name)
            found: Analysis | str = analyse_rest(other).analysis
        except UserError as error:
            yield name, str(error).removeprefix(f"{path}: ")
            continue
        yield f"{name} (nets off)" if nets else name, found


def under(content: dict[str, object], path: Path, name: str) -> tuple[Mission, bool]:
    """A mission under the law of this name with declared gains and nets off, and whether it has nets. Raises UserError."""
    other = check_mission({**content, "controller": {"type": name}}, str(path), path.parent)
    section: ControllerSection = other.controller
    if section.table is None:
        return other, False
    off = section.model_copy(update={"nets": section.table.model_copy(update={"enabled": False})})
    return other.model_copy(update={"controller": off}), True


class Several(NamedTuple):
    """name: of the mission. kind: what the loops are. found: the loops; at: their times [s] or numbers, none for laws.

    but: what the mission's flight as written does that was not asked, of loops at rest.
    """

    name: str
    kind: str
    found: list[tuple[str, Analysis | str]]
    at: list[float]
    but: str = ""


def laws(path: Path, text: str, folder: Path, overwrite: bool, sheet: Sheet, progress: Progress) -> Evidence:
    """The mission's loop under each controller that `text` names. Raises UserError."""
    mission = read_mission(path)
    names = named(mission, text, path.parent)
    plan = plan_mission(mission, path)
    with publishing(folder, f"linear-{'-'.join(names)}-" + fingerprint([plan]), overwrite) as out:
        done = Several(mission.name, "laws", collected(under_each(path, names), progress), [], mission.shortfall(plan))
        return write(out, done, path, sheet)


def instants(path: Path, count: int, folder: Path, overwrite: bool, sheet: Sheet, progress: Progress) -> Evidence:
    """The mission's loop at `count` instants of its flight. Raises UserError."""
    mission = read_mission(path)
    plan = plan_mission(mission, path)
    with publishing(folder, f"linear-along-{count}-" + fingerprint([plan]), overwrite) as out:
        with errors_in(path):
            found = collected(((f"t = {t:g} s", one) for t, one in along(mission, count)), progress)
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
        label, over = ("time [s]", "over time") if done.kind == "instants" else ("flight", "in each flight")
        lowest = "the lowest curve has the least margin"
        figures.append(Figure(f"{FIGURES}/margins", f"Margins of each channel {over}: {lowest}."))
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
    least, answer = worst.worst(done.found), worst.grades(done.found, "" if done.kind == "instants" else " at rest")
    answer = f"{done.but[0].upper()}{done.but[1:]}. {answer}" if done.but else answer
    laws = done.kind == "laws"
    loops = [
        {"name": name, **(record(one, []) if isinstance(one, Analysis) else {"refused": one})} for name, one in done.found
    ]
    about = {"name": done.name, "version": __version__, "file": str(path), "kind": done.kind}
    refused = worst.refused(done.found)
    flights = [one.where.split()[1] for one in least if done.kind == "draws" and one.margin == worst.PHASE]
    fly = [f"To fly the draw with the smallest phase margin: {command('fly', path, '--flight', one)}" for one in flights]
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
        sections=[
            TableSection("Worst margins", "worst", worst.WORST_HEADER, least, tables.METHOD, shown=shown),
            TableSection(
                "Every loop: smallest margins over its channels", "loops", worst.ROW_HEADER, worst.rows(done.found), shown=each
            ),
            *([TableSection("Not linearised", "refused", ("",), [(line,) for line in refused])] if refused else []),
        ],
        commands=fly,
    )
