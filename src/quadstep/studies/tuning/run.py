"""`quadstep tune`: from a mission to one with better gains."""

import contextlib
import itertools
import math
import os
import shutil
import tomllib
from collections.abc import Mapping, MutableMapping
from pathlib import Path
from typing import NamedTuple, TypeAlias, cast

import tomlkit
from tomlkit.exceptions import TOMLKitError
from tomlkit.items import Item

from quadstep.io import __version__
from quadstep.io.errors import UserError
from quadstep.io.files import is_file
from quadstep.io.parameter_files import FORMATS
from quadstep.io.parts import digest_of
from quadstep.io.places import place, sources
from quadstep.linear.grade import WORST_FIRST
from quadstep.metrics.registry import SOUND
from quadstep.mission.fields import unit, words
from quadstep.mission.schema import Grading, ungraded
from quadstep.report import units
from quadstep.report.drawing import FigureJob
from quadstep.report.evidence import Evidence, Figure
from quadstep.report.progress import SILENT, Progress
from quadstep.report.publish import publishing, write_csv
from quadstep.report.sheet import Sheet
from quadstep.studies.campaign.draws import DrawnColumn
from quadstep.studies.campaign.report import from_the_start
from quadstep.studies.campaign.schema import digests, strings
from quadstep.studies.tuning.before_after import picture
from quadstep.studies.tuning.convergence import draw_search, led
from quadstep.studies.tuning.ground import UNSEEN, CandidateFlyer, TuningRequest, read_request
from quadstep.studies.tuning.objective import Compared, compare
from quadstep.studies.tuning.report import broken, caution, evidence
from quadstep.studies.tuning.search import Candidate, Search, SearchResult, check_budget, shown_flights

TUNED, HISTORY, PICTURE = "tuned.toml", "history.csv", "convergence"
OBJECTIVE = "objective"
Drawn: TypeAlias = Mapping[str, DrawnColumn]

TOGETHER = 3
"""Most numbers whose ends are graded in every combination."""


class Tuned(NamedTuple):
    """Result of a tuning run. elsewhere: files that the mission names outside its folder."""

    asked: TuningRequest
    found: SearchResult
    compared: Compared
    elsewhere: list[str]
    evidence: Evidence

    @property
    def values(self) -> dict[str, float]:
        return self.found.best.values


def tune(
    path: Path, budget: int, folder: Path, seed: int = 1, overwrite: bool = False, progress: Progress = SILENT,
    sheet: Sheet | None = None, grading: Grading = ungraded,
) -> Tuned:  # fmt: skip
    """Tune the mission in `path` within a budget of flights, including the comparison, and write `folder`.

    grading: of the loop at rest. Raises UserError. On Ctrl-C nothing is written.
    """
    wanted = read_request(path)
    check_budget(wanted, budget)
    named = digests(wanted.content, path.parent)
    with publishing(folder, digest_of(wanted.text, named, budget, seed), overwrite, named=named) as out:
        ground = CandidateFlyer(wanted, seed)
        found = Search([ground], budget - 2 * wanted.unseen, seed, progress).run()
        drawn = ground.draws(UNSEEN, wanted.unseen).drawn
        compared, both = on_unseen(ground, found, drawn, progress)
        ground.flyer.say_slow()
        content = wanted.with_gains(found.best.values)
        tuned, current = (worst_grade(ground, drawn, one.values, grading) for one in (found.best, found.present))
        careful = caution(current, tuned)
        missed = broken(wanted, found, compared)
        first, loop = " ".join(filter(None, (missed, careful))), tuned if careful and not missed else {}
        elsewhere = write_mission(out, wanted, content, first)
        write_parameters(out, wanted, found.best.values)
        write_history(out / HISTORY, wanted, found.history)
        drawn_on = (sheet or Sheet()).shown()
        searched = [draw_search(out / PICTURE, wanted, found, drawn_on)] if led(found) else []
        if both:
            both.draw(out, drawn_on)
        record = as_json(wanted, found, compared, budget, seed)
        shown = evidence(wanted, found, compared, searched, record, first, loop)._replace(
            grade=tuned, told=bool(careful), figures=[Figure(both.name, both.caption)] if both else []
        )
        shown.write(out)
    return Tuned(wanted, found, compared, elsewhere, shown)


def on_unseen(
    ground: CandidateFlyer, result: SearchResult, drawn: Drawn, progress: Progress
) -> tuple[Compared, FigureJob | None]:
    """Compare the present and the tuned gains on flights that the search has not seen, and lay one over the other."""
    flights = result.history[-1].flights

    def advance(more: int) -> None:
        nonlocal flights
        flights += more
        shown_flights(progress, flights, result.best.judged.objective)

    both = [result.present.values, result.best.values]
    present, tuned = (
        flown.with_values(ground.margins(values, ground.asked.section.margins))
        for flown, values in zip(ground.fly(both, UNSEEN, ground.asked.unseen, advance), both, strict=True)
    )
    largest = tuned.metric("largest_error")
    said = from_the_start(ground.asked.mission, drawn, lambda key: drawn[key].values.astype(float), largest, tuned.completed)
    found = compare(result.judge, present, tuned, changed=both[0] != both[1])
    drawing, lacking = (picture(ground, both, (present, tuned)) if both[0] != both[1] else None) or (None, ())
    starts = f"With the tuned gains: {said[:1].lower()}{said[1:]}" if said else ""
    return found._replace(from_the_start=starts, lacking=lacking), drawing


def worst_grade(ground: CandidateFlyer, drawn: Drawn, values: Mapping[str, float], grading: Grading) -> Mapping[str, str]:
    """Of the loop at rest with these gains: as the mission is written, or where numbers of its vehicle and controller are the
    least or largest of the unseen flights, up to `TOGETHER` in every combination, more one by one, whichever is worst, and
    where that is. drawn: for these.
    """
    planner = ground.flyer.planner
    mission, graded = planner.mission(values), []
    keys = [key for key in drawn if key.startswith(("vehicle.", "controller.")) and drawn[key].options is None]
    ends = [[(key, "smallest", drawn[key].values.min()), (key, "largest", drawn[key].values.max())] for key in keys]
    corners = itertools.product(*ends) if len(keys) <= TOGETHER else zip(itertools.chain(*ends), strict=True)
    for corner in corners if keys else ():
        said = [f"the {which} {words(key)} flown, {end:.4g} {unit(mission, key)}".strip() for key, which, end in corner]
        with contextlib.suppress(UserError):  # a corner may be no vehicle
            there = planner.mission({**values, **{key: float(end) for key, _, end in corner}})
            graded.append((f"at {units.listed(said)}", grading(there)))
    written = grading(mission)
    where, worst = min([("", written), *graded], key=lambda one: WORST_FIRST.index(one[1].get("grade", SOUND)))
    if where and written:
        return {**worst, "why": f"{where}, {worst['why']}; as the mission is written, it is {written['grade']}"}
    if not (keys and written):
        return written
    how = "" if len(keys) == 1 else ", in every combination" if len(keys) <= TOGETHER else ", one at a time"
    ends_too = f"with the least and the largest {units.listed([words(key) for key in keys])} that fly, too{how}"
    return {**worst, "why": f"{worst['why']}; {worst['grade']} {ends_too}"}


def named_files(request: TuningRequest) -> tuple[list[str], list[str]]:
    """The files that a mission names from its folder: those inside it, and those elsewhere, which stay where they are."""
    folder = request.path.parent
    names = sorted({name for name in strings(request.content) if "." in name and is_file(folder / name)} | own_files(request))
    inside = [name for name in names if not Path(name).is_absolute() and ".." not in Path(name).parts]
    return inside, [name for name in names if name not in inside and not Path(name).is_absolute()]


def own_files(request: TuningRequest) -> set[str]:
    """The Python files beside a mission that it names or that these import, from its folder."""
    folder = request.path.parent
    found: set[str] = set()
    for own in filter(None, map(place, strings(request.content))):
        with contextlib.suppress(UserError):  # only a text that looks like one: the mission has been checked
            path = own.file(folder)
            found |= {os.path.relpath(one, folder.resolve()) for one in (sources(path) if path else ())}
    return found


def write_mission(out: Path, request: TuningRequest, content: dict[str, object], first: str) -> list[str]:
    """The mission with the tuned gains, below what is to be read first, and the files it names beside it; gives those that it
    names elsewhere.
    """
    text = edited(request.text, request.content, content)
    if tomllib.loads(text) != content:
        raise UserError(f"{request.path}: could not be written with the tuned gains")
    inside, elsewhere = named_files(request)
    for name in inside:
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(request.path.parent / name, out / name)
    (out / TUNED).write_text(f"# {first}\n{text}" if first else text, encoding="utf-8")
    return elsewhere


def write_parameters(out: Path, request: TuningRequest, values: Mapping[str, float]) -> None:
    """For the law of an autopilot, a file of its own parameters: those that tuning changed, and no others."""
    law = request.mission.controller.controller
    if not law.parameter_file:
        return
    form, keys = FORMATS.load(law.parameter_file), law.by_key()
    defaults = {key: gain.fixed for key, (_, gain) in keys.items() if isinstance(gain.fixed, float)}
    changed = {key.removeprefix("controller."): one for key, one in values.items() if one != request.present[key]}
    text = form.write({key: one for key, one in changed.items() if key in defaults}, defaults)
    (out / f"tuned{form.suffixes[0]}").write_text(text, encoding="utf-8")


def write_history(path: Path, request: TuningRequest, history: list[Candidate]) -> None:
    keys, parts, names = list(request.present), list(history[0].judged.parts), request.names
    header: list[str] = ["run", "generation", "flights", *keys, OBJECTIVE, *(names[name] for name in parts)]
    header += ["lost", "violation", "cost", "feasible", "conditions", "moved", "whole"]
    rows: list[list[object]] = [
        [
            one.run, one.generation, one.flights, *(one.values[key] for key in keys), one.judged.objective,
            *(one.judged.parts[name] for name in parts), one.judged.lost, one.judged.violation, one.judged.cost,
            one.judged.feasible, math.isfinite(one.moved), one.moved,
            one.tried.whole is not None,
        ]
        for one in history
    ]  # fmt: skip
    write_csv(path, header, rows)


def as_json(request: TuningRequest, result: SearchResult, compared: Compared, budget: int, seed: int) -> dict[str, object]:
    estimates = ("present", "tuned", "difference")
    rows = [one._asdict() for one in (compared.objective, *compared.rows)]
    flown = result.history[-1].flights + 2 * request.unseen
    return {
        "name": request.mission.name,
        "version": __version__,
        "seed": seed,
        "budget": budget,
        "flights": flown,
        "present": result.present.values,
        "tuned": result.best.values,
        "unseen": {
            "first": UNSEEN,
            "flights": compared.flights,
            "success": dict(zip(estimates, (one.as_json() for one in compared.success), strict=False)),
            "success_difference": compared.success_difference.as_json(),
            "rows": [{**row, **{name: row[name] and row[name].as_json() for name in estimates}} for row in rows],
            "verdict": compared.verdict,
            "missed": compared.missed,
        },
    }


def edited(text: str, old: dict[str, object], new: dict[str, object]) -> str:
    """The text, whose content is `old`, with the content `new`."""
    try:
        content = tomlkit.parse(text)
        change(content, old, new)
        changed = content.as_string()
        good = tomllib.loads(changed) == new
    except (TOMLKitError, tomllib.TOMLDecodeError):
        good = False
    return changed if good else tomlkit.dumps(new)


def change(table: MutableMapping[str, object], old: dict[str, object], new: dict[str, object]) -> None:
    """Set every value in a table that is not as it was."""
    for name, value in new.items():
        before = old.get(name)
        if isinstance(value, dict) and isinstance(before, dict):
            change(cast(MutableMapping[str, object], table[name]), before, value)
        elif name not in old or value != before:
            if isinstance(value, dict) and isinstance(table, tomlkit.TOMLDocument):
                for _ in range(1 if table.as_string().endswith("\n") else 2):
                    table.add(tomlkit.nl())  # a blank line before a new table
            table[name] = value
            if isinstance(changed := table[name], Item):
                changed.trivia.comment = changed.trivia.comment_ws = ""  # it was about the value before
