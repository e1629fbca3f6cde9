"""`quadstep compare` of missions side by side."""

from collections.abc import Sequence
from itertools import chain
from pathlib import Path

from quadstep.io.documents import read_toml
from quadstep.io.errors import UserError
from quadstep.io.parts import code_digest, digest_of, parts_in
from quadstep.metrics.registry import EFFORTS
from quadstep.mission.check import check
from quadstep.mission.fields import label
from quadstep.mission.presets import is_airframe
from quadstep.mission.read import MISSION, check_mission, refuse_others
from quadstep.mission.schema import Mission
from quadstep.report.publish import publishing
from quadstep.report.units import listed
from quadstep.studies.campaign.schema import CampaignFile, campaign_of, digests
from quadstep.studies.campaign.varied import leaves, text_of
from quadstep.studies.comparison.answer import SAME
from quadstep.studies.comparison.cells import Situation, StudyCell
from quadstep.studies.comparison.entrants import Comparison, Entrant
from quadstep.studies.comparison.run import ComparisonRun, FinishedComparison, How, concluded, fly, reported

MISSION_METRICS = ("position_rmse", "largest_error")


def compare_missions(paths: Sequence[Path], folder: Path, seeds: int, how: How) -> FinishedComparison:
    """Missions that may differ in anything but their path, each flown with the same draws.

    Raises UserError, and InterruptedRun on Ctrl-C.
    """
    with parts_in(folder) as kept:
        return compared(paths, folder, seeds, ComparisonRun(kept, how))


def compared(paths: Sequence[Path], folder: Path, seeds: int, run: ComparisonRun) -> FinishedComparison:
    """The comparison, its parts kept by the run."""
    found_cells: list[StudyCell] = []
    names = names_of(paths)
    places = dict(zip(names, paths, strict=True))
    for name, path in places.items():
        with run.problem_of("", name):
            found_cells.append(cell_of(name, path, seeds))
    times = [counted(one.mission) for one in found_cells]
    for one, time in zip(found_cells[1:], times[1:], strict=False):
        pair = " and ".join(str(places[cell.controller]) for cell in (found_cells[0], one))
        if path_of(one) != path_of(found_cells[0]):
            raise UserError(f"{pair} fly different paths, so their errors do not say which is better; give both one path")
        if time != times[0]:
            raise UserError(
                f"{pair} count their errors over different times, so these do not say which is better; give both one "
                "simulation.duration and one score_from"
            )
    identity = digest_of([(cell.controller, cell.campaign.fingerprint) for cell in found_cells], seeds)
    with publishing(folder, identity, run.how.overwrite, code=code_digest()) as out:
        for one in found_cells:
            beside = places[one.controller].parent
            run.kept.note({str(beside / name): digest for name, digest in one.campaign.named.items()})
        flights, flown = fly(run, found_cells, seeds)
        about = Comparison(
            name=listed(names) if len(names) < 4 else f"{len(names)} missions",
            source=", ".join(map(str, paths)),
            seeds=seeds,
            seed=1,
            unlike=unlike(found_cells),
            metrics=reported("missions", MISSION_METRICS, found_cells),
            entrants=tuple(
                Entrant("", one.controller, one.campaign.defaults["controller"], f"as in {places[one.controller]}", one.law)
                for one in found_cells
            ),
        )
        return concluded(run, out, folder, about, flights, flown)


def path_of(cell: StudyCell) -> tuple[object, ...]:
    """A mission's path, with the content of the files that it names: relative names in two folders may be two paths."""
    path = cell.campaign.defaults.get("path")
    return path, *digests([path], cell.campaign.folder).values()


NO_CONDITIONS = "name", "seed", "metrics", "tune", "margins"
"""Keys of a mission that change no flight of a comparison."""

NAMED = 3
"""Keys of a section that a sentence names; more are counted."""


def unlike(cells: Sequence[StudyCell]) -> str:
    """In what missions differ, with their values in the missions' order: a sentence."""
    sides = [one.campaign.defaults for one in cells]
    found: list[str] = []
    for section in dict.fromkeys(name for side in sides for name in side if name not in NO_CONDITIONS):
        tables = [values_in(section, side.get(section)) for side in sides]
        keys = unequal(tables)
        kinds = [key for key in keys if key in (f"{section}.type", f"{section}.preset")]
        if kinds:  # whose other keys differ anyway, but for those that were written
            tables = [values_in(section, one.campaign.content.get(section)) for one in cells]
            keys = unequal(tables)
        rest = [key for key in keys if key not in kinds]
        for key in [*kinds, *(rest if len(rest) <= NAMED else ())]:
            values = (text_of(one[key]) if one.get(key) is not None else "unset" for one in tables)
            found.append(f"{label(cells[0].mission, key)} ({' against '.join(values)})")
        found += [f"{len(rest)} {'other ' if kinds else ''}keys of {section}"] if len(rest) > NAMED else []
    found = found or ["files that they name"] * any(one.campaign.named != cells[0].campaign.named for one in cells)
    return f"They differ in {listed(found)}." if found else SAME if len(cells) > 1 else ""


def unequal(tables: Sequence[dict[str, object]]) -> list[str]:
    """Keys whose values are not the same in all."""
    return [key for key in dict.fromkeys(chain(*tables)) if any(one.get(key) != tables[0].get(key) for one in tables)]


def values_in(section: str, value: object) -> dict[str, object]:
    """Those of a section of a mission by dotted key, lists number by number."""
    found: dict[str, object] = {}
    for key, one in leaves(value).items():
        name = f"{section}.{key}" if key else section
        found.update({f"{name}.{i}": part for i, part in enumerate(one)} if isinstance(one, list | tuple) else {name: one})
    return found


def counted(mission: Mission) -> tuple[float, float]:
    """From when to when errors count [s]."""
    return mission.scored_from, mission.simulation.duration or mission.path.build(mission.folder).length


def cell_of(name: str, path: Path, seeds: int) -> StudyCell:
    """A mission as a cell: the flights of its own noise. Raises UserError."""
    content = read_toml(path)
    refuse_others(content, MISSION, str(path), "with several files, `quadstep compare` takes missions")
    given = content.get("metrics", [])
    own = list(given) if isinstance(given, list) else []
    if is_airframe(content.get("vehicle")):
        content = {**content, "metrics": [*own, *(one for one in EFFORTS if one not in own)]}
    check_mission(content, str(path), path.parent)
    file = check(CampaignFile, {"mission": content, "flights": seeds}, str(path))
    return StudyCell(Situation("", "", ""), name, campaign_of(file, "", content, str(path), path.parent.resolve()))


def names_of(paths: Sequence[Path]) -> list[str]:
    """What the missions are called: by their own names, or by their files' where a name is missing or not its own."""
    own = [name_in(path) for path in paths]
    return own if all(own) and len(set(own)) == len(own) else unique([path.stem for path in paths])


def name_in(path: Path) -> str:
    """The name that a mission file states; empty where it states none, or cannot be read."""
    try:
        name = read_toml(path).get("name")
    except UserError:
        return ""
    return name if isinstance(name, str) else ""


def unique(names: Sequence[str]) -> list[str]:
    """Names with a number where one comes twice."""
    found: list[str] = []
    for name in names:
        candidates = [name, *(f"{name} ({number})" for number in range(2, len(names) + 2))]
        found.append(next(one for one in candidates if one not in found))
    return found
