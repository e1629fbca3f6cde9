"""`quadstep what-if`: what a change of an autopilot's parameters does to a vehicle, before and after.

A step in calm air, the margins at rest, and the same flights in gusts with both sets of parameters: flight i has the same wind
and the same noise of the gyro with either, so that differences are paired.
"""

import hashlib
import io
import json
import math
from collections.abc import Mapping, Sequence
from operator import attrgetter
from pathlib import Path
from typing import NamedTuple

import numpy as np

from quadstep.control.registry import STOCK, controller
from quadstep.engines.fly import fingerprint, fly_all
from quadstep.interfaces.closed_loop import Advance
from quadstep.interfaces.controller import Controller, Measured
from quadstep.io import code_cache
from quadstep.io.errors import UserError, did_you_mean, number_in, shorten
from quadstep.io.parameter_files import FORMATS, read_parameters
from quadstep.io.parts import source_digest
from quadstep.linear.grade import whole_grade
from quadstep.metrics.registry import EFFORTS
from quadstep.mission.data_files import briefly
from quadstep.mission.listings import preset_names, vehicle_named
from quadstep.mission.read import check_mission
from quadstep.report import units
from quadstep.report.evidence import Evidence
from quadstep.report.pool import drawing_pool
from quadstep.report.progress import SILENT, Count, Progress
from quadstep.report.publish import publishing
from quadstep.report.sheet import Sheet
from quadstep.studies.tuning.gains import with_numbers
from quadstep.studies.tuning.ground import CandidateFlyer, tuning_request
from quadstep.studies.tuning.objective import CandidateFlights
from quadstep.studies.what_if_report import STEP, Question, Side, evidence, picture

HEIGHT, BEGIN, DURATION = 3.0, 1.0, 8.0
"""Of the step: where it is flown [m], its time, and the flights' [s]."""

GYRO_NOISE = 2.4e-4
"""Of the flights in gusts [rad/s/sqrt(Hz)]: a small vehicle's gyro (0.014 deg/s/sqrt(Hz))."""

MOST_KEPT = 10_000
"""Most flights before a change that are kept for the next one, 64 bytes each."""

Content = dict[str, object]


class Changed(NamedTuple):
    """values: of changed parameters. unmodelled: what else differs in another file of parameters, and no law uses. notes:
    which of the changed ones it does not have though the first file has them: defaults count, though a ground station that
    loads such a file leaves the vehicle's.
    """

    values: dict[str, float]
    unmodelled: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def changes_of(texts: Sequence[str], file: str) -> Changed:
    """`NAME=VALUE`, each name once; or another file of parameters, whose values are compared with those of `file`.

    Raises UserError.
    """
    if len(texts) == 1 and "=" not in texts[0]:
        return differences(file, texts[0])
    found: dict[str, float] = {}
    for text in texts:
        name, sign, value = text.partition("=")
        number = number_in(value)
        if not sign or not math.isfinite(number):
            raise UserError(f"{shorten(text)} should be NAME=VALUE, with a number, as pid_rate.roll_kp=200")
        if name in found:
            raise UserError(f"{name} is given twice")
        found[name] = number
    return Changed(found)


def differences(file: str, other: str) -> Changed:
    """What differs in another file of parameters, or in a law's defaults by its name. Raises UserError for nothing."""
    laws = laws_of(file)
    usual = {key: gain.fixed for law in laws for key, (_, gain) in law.by_key().items() if isinstance(gain.fixed, float)}
    before, after = (
        read_parameters(Path(one), laws[0].parameter_file).values if one not in STOCK else None for one in (file, other)
    )
    old, new = ({**usual, **(one or {})} for one in (before, after))
    found = {name: new[name] for name in usual if not equal(new[name], old[name])}
    more, lacking = [], []
    if before is not None and after is not None:
        used = {key for law in laws for key in (*law.by_key(), *law.supported)}
        more = [name for name in sorted({**before, **after}) if name not in used and before.get(name) != after.get(name)]
        lacking = [name for name in found if name in before and name not in after]
    if not found:
        said = f"; {briefly(more)} {'does, but is' if len(more) == 1 else 'do, but are'} not modelled" if more else ""
        raise UserError(f"{other}: no parameter of {', '.join(law.name for law in laws)} differs between it and {file}{said}")
    count = "its default counts" if len(lacking) == 1 else "their defaults count"
    return Changed(found, tuple(more), (f"{other} does not have {briefly(lacking)}: {count}",) if lacking else ())


def equal(one: float, other: float) -> bool:
    """Whether an autopilot, which keeps parameters in f32, takes two values for the same."""
    return bool(np.float32(one) == np.float32(other))


def laws_of(file: str) -> list[type[Controller]]:
    """The stock law of this name, with those of the same autopilot; or those whose parameters such a file has.

    Raises UserError for another file.
    """
    laws = [law for name in STOCK if (law := controller(Measured, name))]
    whose = [law.parameter_file for law in laws if file == law.name or Path(file).suffix in suffixes(law)]
    if not whose:
        known = ", ".join(dict.fromkeys(one for law in laws for one in suffixes(law)))
        raise UserError(f"{file}: should be a file of an autopilot's parameters ({known}), or one of {', '.join(STOCK)}")
    return [law for law in laws if law.parameter_file == whose[0]]


def suffixes(law: type[Controller]) -> tuple[str, ...]:
    """Of the files in which its autopilot's parameters are kept."""
    return FORMATS.load(law.parameter_file).suffixes


def law_of(question: Question) -> type[Controller]:
    """The stock law whose parameters change. Raises UserError where there is none."""
    laws = laws_of(question.file)
    known, named = [key for law in laws for key in law.by_key()], ", ".join(law.name for law in laws)
    for name in question.changes:
        if name not in known:
            raise UserError(f"{name} is not a parameter of {named}{did_you_mean(name, known)}")
    fitting = [law for law in laws if all(name in law.by_key() for name in question.changes)]
    if not fitting:
        raise UserError(f"{units.listed(list(question.changes))} are not parameters of the same law")
    if question.file in STOCK and question.file not in (law.name for law in fitting):
        raise UserError(f"{question.file} has no parameter {next(iter(question.changes))}, which belongs to {fitting[0].name}")
    return next((law for law in fitting if law.name == question.file), fitting[0])


def question(asked: Question, law: type[Controller], folder: Path) -> Content:
    """The calm mission, before. folder: of the parameter file and the vehicle's. Raises UserError."""
    rest = [0.0, 0.0, HEIGHT]
    table: Content = {"type": law.name}
    if asked.file != law.name:
        table["parameters"] = str(folder / asked.file)
    vehicle_named(asked.vehicle)  # whose fault is named as that of what was typed
    in_file = asked.vehicle.endswith(".toml") and asked.vehicle not in preset_names()
    place = {"file": str(folder / asked.vehicle)} if in_file else {"preset": asked.vehicle}
    return {
        "name": f"{Path(asked.file).stem}: {', '.join(f'{name} = {value:g}' for name, value in asked.changes.items())}",
        "vehicle": place,
        "path": {"type": "step", "start": rest, "end": [STEP, STEP, HEIGHT], "time": BEGIN, "duration": DURATION},
        "controller": table,
        "simulation": {"duration": DURATION},
        "metrics": list(EFFORTS),
    }


def in_gusts(content: Content, question: Question, before: Mapping[str, float]) -> Content:
    """The mission in wind from every side, whose gains are those that change; before: what they are, by key."""
    rest, wind = [0.0, 0.0, HEIGHT], question.wind
    ends = {key: sorted((one, question.changes[key.removeprefix("controller.")])) for key, one in before.items()}
    drawn = {"type": "uniform", "low": -wind, "high": wind}
    return {
        **content,
        "path": {"type": "step", "start": rest, "end": rest, "time": 0.0, "duration": DURATION},
        "wind": {"turbulence": {"wind_20": wind, "airspeed": max(wind, 1.0)}},
        "sensors": {"gyro_noise": GYRO_NOISE},
        "limits": {"distance": question.within},
        "tune": {
            "gains": {key: {"low": low, "high": high, "scale": "linear"} for key, (low, high) in ends.items()},
            "vary": {"wind.mean.0": drawn, "wind.mean.1": drawn} if wind > 0.0 else {},
            "unseen": question.flights,
            "precision": "f32",  # as the autopilots compute
        },
    }


def flights_before_and_after(
    ground: CandidateFlyer, before: Mapping[str, float], after: Mapping[str, float], count: int, progress: Advance
) -> list[CandidateFlights]:
    """The flights in gusts before and after. Those before are kept, and flown once for many changes: a flight depends on its
    own numbers only. Raises UserError.
    """
    planner, drawn = ground.flyer.planner, ground.drawing.model_dump_json()
    name = code_cache.key("flights", source_digest(), fingerprint([planner.plan({**ground.draws(0).at(0), **before})]), drawn,
                          repr(ground.asked.names), str(count))  # fmt: skip
    kept = code_cache.read(name) if count <= MOST_KEPT else None
    if kept is not None:
        progress(count)
        table = np.load(io.BytesIO(kept))
        old = CandidateFlights(table[:, 0].astype(np.int8), table[:, 1], table[:, 2:], ground.asked.names)
        return [old, *ground.fly([after], 0, count, progress)]
    found = ground.fly([before, after], 0, count, progress)
    if count <= MOST_KEPT:
        np.save(file := io.BytesIO(), np.column_stack([found[0].outcome, found[0].ended, found[0].metrics]))
        code_cache.write(name, file.getvalue())
    return found


def answer(
    asked: Question, out: Path, overwrite: bool = False, progress: Progress = SILENT, sheet: Sheet | None = None,
    paged: bool = False,
) -> Evidence:  # fmt: skip
    """Answer a question, and write the folder `out`. paged: with a page. Raises UserError."""
    law, here = law_of(asked), Path.cwd()
    content = question(asked, law, here)
    try:
        mission = check_mission(content, asked.file, here)
    except UserError as error:  # the file stands before all that is said of it, not in it again
        raise UserError(str(error).replace(f"controller.parameters: {here / asked.file}: ", "")) from None
    now = {name: float(str(attrgetter(name)(mission.controller))) for name in asked.changes}
    same = tuple(f"{name} is already {value:g}" for name, value in now.items() if equal(asked.changes[name], value))
    if len(same) == len(now):
        raise UserError(briefly(same))
    asked = asked._replace(
        changes={name: one for name, one in asked.changes.items() if not equal(one, now[name])}, notes=(*asked.notes, *same)
    )
    before = {f"controller.{name}": now[name] for name in asked.changes}
    after = {f"controller.{name}": value for name, value in asked.changes.items()}
    missions = (mission, check_mission(with_numbers(content, mission, after), asked.file, here))
    saved = {} if asked.file == law.name else read_parameters(here / asked.file, law.parameter_file).values
    identity = hashlib.sha256(json.dumps([asked, dict(saved), mission.model_dump(mode="json")]).encode()).hexdigest()[:16]
    with publishing(out, identity, overwrite) as draft, drawing_pool(1) as pool:
        steps = fly_all([one.plan(warn=False) for one in missions])
        step = picture(*steps)
        drawn = pool.submit(step.draw, draft, (sheet or Sheet()).shown())  # while all else is computed
        gusts = tuning_request(here / asked.file, "", in_gusts(content, asked, before), here, apart=False)
        ground = CandidateFlyer(gusts, asked.seed)
        flown = flights_before_and_after(ground, before, after, asked.flights, Count(progress, 2 * asked.flights).add)
        sides = tuple(Side(log, whole_grade(one), gusts) for log, one, gusts in zip(steps, missions, flown, strict=True))
        found = evidence(asked, law, mission, before, (sides[0], sides[1]), step)
        drawn.result()
        found.write(draft)
        if paged:
            from quadstep.studies.campaign.page import what_if_page  # noqa: PLC0415 (a tenth of a second, and seldom)

            text = what_if_page(gusts, asked.seed, law, asked.changes, found)
            (draft / "page.html").write_text(text, encoding="utf-8")
    return found
