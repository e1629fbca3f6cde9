"""`quadstep fly`: one mission from file to folder."""

import json
import math
from collections.abc import Callable, Sequence
from concurrent.futures import as_completed
from pathlib import Path
from typing import NamedTuple, TypeAlias, cast

import numpy as np

from quadstep.control.backstepping import BacksteppingMemory
from quadstep.control.completed_backstepping import CompletedMemory
from quadstep.control.hedged_backstepping import HedgedBacksteppingMemory
from quadstep.control.rotation_backstepping import RotationMemory
from quadstep.engines.engine import Engine
from quadstep.engines.fly import FlightPlan, fingerprint, fly, reason
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.log import REASONS, FlightLog
from quadstep.io import __version__
from quadstep.io.errors import DIVERGED, UNMET, UserError, unknown_name
from quadstep.io.files import write_beside
from quadstep.metrics.registry import Metrics, metric, with_unit
from quadstep.metrics.requirements import JudgedMetric, Requirement, judge, with_full_names
from quadstep.metrics.verdict import Case, Verdict, graded, scalars
from quadstep.mission.check import check
from quadstep.mission.own_controller import AUTOPILOTS, FIRST_WAIT, Matching, PilotedSection, piloted_section
from quadstep.mission.read import REAL, plan_mission, read_mission
from quadstep.mission.schema import Grading, Mission, ungraded
from quadstep.report.panels import jobs_to_draw, labels_of, left_path, with_quiet_marks
from quadstep.report.pool import DrawingPool, drawing_pool
from quadstep.report.publish import MANIFEST, publishing, write_json, write_log
from quadstep.report.sheet import Sheet
from quadstep.report.units import quantity
from quadstep.studies.flight_report import cut, error_table, errors_since, of_limits, own_facts, worst, write_report

REPORT = "report.html"

UNKNOWN_PATH = "Errors are measured from the mission's path, which the autopilot flies only if someone sends it."

StageProgress: TypeAlias = Callable[[str, int, int], None]
"""StageProgress a stage of the work, how much of it is done, and how much there is."""


class Piloting(NamedTuple):
    """Who flies instead of the controller. connect: where it is listened for. first_wait: for how long [s]. say: of what the
    user should know before. pilot: whether it is also armed, lifted and sent the path. where: it is reached for that; empty:
    where it usually is.
    """

    autopilot: str
    connect: str = ""
    first_wait: float = FIRST_WAIT
    say: Callable[[str], None] = lambda _: None
    pilot: bool = False
    where: str = ""


class FlightSummary(NamedTuple):
    """What the command line prints about a flight: a table, single numbers and a last line. judged: its requirements."""

    name: str
    header: list[str]
    rows: list[list[str]]
    facts: list[list[str]]
    ending: str
    completed: bool
    warnings: tuple[str, ...]
    metrics: Metrics
    judged: list[JudgedMetric]

    def verdict(self, about: Metrics) -> Verdict:
        """The verdict for machines. about: the run, as text."""
        cases = (Case("completed", None if self.completed else self.ending), *(one.case for one in self.judged))
        unmet = any(one.failure for one in self.judged)
        code = DIVERGED if not self.completed else UNMET if unmet else 0
        required = [one.as_json() for one in self.judged]
        content = {
            **about,
            "name": self.name,
            **graded(self.metrics).as_json(),
            "warnings": list(self.warnings),
            **self.metrics,
            "requirements": required,
        }
        return Verdict("fly", self.name, cases, content, code)


def fly_mission(
    path: Path, folder: Path, engine: Engine, overwrite: bool, progress: StageProgress = lambda *_: None,
    flight: int | None = None, required: Sequence[Requirement] = (), results: Path | None = None,
    sheet: Sheet | None = None, piloting: Piloting | None = None, grading: Grading = ungraded,
) -> FlightSummary:  # fmt: skip
    """Fly the mission in `path`, write `folder`, and return a summary. progress: of every stage.

    flight: where `path` is a campaign, the number of one of its flights; results: the folder where that campaign was
    flown. sheet: what the figures are drawn on. piloting: an autopilot instead of its controller. grading: of
    the loop at rest. Raises UserError, also for a
    requirement of a metric that no such flight has.
    """
    mission, plan, beside = planned(path, flight, results)
    if piloting is not None:
        mission = under(piloting, mission)
        plan = plan_mission(mission, path)
    found = mission.controller.matching(plan) if isinstance(mission.controller, PilotedSection) else None
    pilot = piloting or Piloting("")
    if found is not None:
        pilot.say(f"{found.sentence()}.{' ' + found.note if found.note else ''}")
        keep(found, path.parent, pilot.say)
        section = cast(PilotedSection, mission.controller)
        section.watch(lambda stage: progress(stage, 0, 1), pilot.first_wait)
        if pilot.pilot:
            section.lead(plan, mission.modelled.model(), pilot.where, pilot.say)
    required = with_full_names(required, metric_names(mission, plan)) if required else []
    if sheet and sheet.signals:
        sheet.check_signals(labels_of(mission.figures(log_before_flight(plan, 1.0))))  # before it is flown
    with publishing(folder, fingerprint([plan]), overwrite) as out, drawing_pool() as pool:
        log = fly_logged(plan, engine, progress)
        why = "" if log.outcome is Outcome.COMPLETED else reason(plan, log)
        ending = ending_state(plan, log)
        metrics, warnings = write_results(out, pool, mission, plan, log, engine, beside, ending, progress, sheet, why, grading)
    diverged = None if log.outcome is Outcome.COMPLETED else f"was lost at {log.ended:g} s"
    judged = [judge(one, scalars(metrics), diverged) for one in required]
    summary = summarise(mission.name, log, metrics, warnings, judged, mission, why)
    summary = summary._replace(facts=[*summary.facts, *([one.what, one.value] for one in own_facts(mission, metrics))])
    if lost := plan.loop.controller.why_lost(plan.parameters.gains):
        return summary._replace(ending=f"{lost}. The log up to that point is kept.")
    if found is not None and not pilot.pilot:
        return summary._replace(ending=f"{summary.ending} {UNKNOWN_PATH}")
    return summary


def keep(matching: Matching, folder: Path, say: Callable[[str], None]) -> None:
    """Write what an autopilot must be told beside the mission, so that it can be loaded before it flies. say: why not."""
    place, text = folder / matching.file, matching.text()
    try:
        mine = not place.exists() or place.read_text(encoding="utf-8").startswith(text.partition("\n")[0])
    except (OSError, UnicodeDecodeError):
        mine = False
    if not mine:
        say(f"warning: {place}: was not written by quadstep, and is left as it is")
        return
    try:
        write_beside(place, text)
    except UserError as error:
        say(f"warning: {error}")


def under(piloting: Piloting, mission: Mission) -> Mission:
    """The mission with an autopilot in its controller's place. Raises UserError."""
    autopilot, connect = piloting.autopilot, piloting.connect
    if not isinstance(mission, REAL.load()):
        raise UserError("--autopilot: needs a mission for a real vehicle (docs/vehicles.md)")
    if autopilot not in AUTOPILOTS:
        raise UserError(f"--autopilot: {unknown_name('value', autopilot, AUTOPILOTS.names)}")
    section = check(piloted_section(autopilot), {"type": autopilot, "connect": connect}, "--autopilot")
    return mission.model_copy(update={"controller": section})


def write_results(
    out: Path, pool: DrawingPool, mission: Mission, plan: FlightPlan, log: FlightLog, engine: Engine,
    beside: Path, ending: Metrics, progress: StageProgress = lambda *_: None, sheet: Sheet | None = None, why: str = "",
    grading: Grading = ungraded,
) -> tuple[Metrics, tuple[str, ...]]:  # fmt: skip
    """Tables, page and figures of a flight; gives its metrics and warnings. beside: where files of the mission are. ending:
    the state that ended it. why: it ended early, if known.
    """
    (out / "figures").mkdir()
    sheet = (sheet or Sheet()).shown()
    figures = mission.figures(log) if len(log.rows) > 1 else []
    jobs = with_quiet_marks(jobs_to_draw(figures, sheet))
    drawn = [pool.submit(job.draw, out / "figures", sheet) for job in jobs]
    measured = mission.flight_metrics(log, grading)  # while processes draw
    zero = [f"--signals: {one} has nothing to show, and is not drawn" for one in sheet.lacking(labels_of(figures)) if figures]
    metrics, warnings = measured[0], (*plan.warnings, *measured[1], *zero)
    progress("writing tables", 0, 1)
    write_log(out / "flight.csv", log)
    write_weights(out / "weights.json", mission, log)
    progress("writing the page", 0, 1)
    from quadstep.page.build import write_mission_page  # noqa: PLC0415 (0.1 s, while processes draw)

    write_mission_page(out / "page.html", mission, plan, log, beside, measured)
    about = {"name": mission.name, "version": __version__, "engine": engine, "warnings": list(warnings)}
    described = {**({"ending": ending} if ending else {}), "mission": json.loads(mission.model_dump_json())}
    write_json(out / MANIFEST, {**about, **graded(metrics).as_json(), **metrics, **described})
    progress("drawing figures", 0, len(jobs))
    for done, figure in enumerate(as_completed(drawn), 1):
        figure.result()
        progress("drawing figures", done, len(jobs))
    captions = {f"figures/{job.name}": job.caption for job in jobs}
    write_report(out / REPORT, mission, log, metrics, warnings, captions, why)
    return metrics, warnings


def ending_state(plan: FlightPlan, log: FlightLog) -> Metrics:
    """The columns of a lost flight's log in the state that ended it, as far as they are finite."""
    if log.outcome is Outcome.COMPLETED:
        return {}
    row = plan.loop.row(log.final, plan.parameters, log.ended)
    named = zip(plan.loop.columns.items(), map(float, row), strict=True)
    return {with_unit(*column): value for column, value in named if math.isfinite(value)}


def fly_logged(plan: FlightPlan, engine: Engine, told: StageProgress) -> FlightLog:
    over, steps = 0, plan.ticks.last + 1

    def progress(more: int) -> None:
        nonlocal over
        over += more
        told("flying", over, steps)

    told("compiling" if engine is Engine.LANES else "flying", 0, 1 if engine is Engine.LANES else steps)
    return fly(plan, engine, progress)


def metric_names(mission: Mission, plan: FlightPlan) -> list[str]:
    """The metrics of a flight before it is flown: those of a log of zeros."""
    metrics, _ = mission.plant_metrics(log_before_flight(plan, 0.0))
    return [*scalars(metrics), *(one.full_name for one in mission.own_metrics)]


def log_before_flight(plan: FlightPlan, value: float) -> FlightLog:
    """A log with the columns of a flight, before it is flown: its first row, of one value, and its last, of twice that."""
    columns, ticks = plan.loop.columns, plan.ticks
    rows = np.full((2, len(columns)), value) * [[1.0], [2.0]]
    rows[:, list(columns).index("t")] = 0.0, ticks.last * ticks.step
    return FlightLog(columns, rows, Outcome.COMPLETED, ticks.last * ticks.step, None)


def planned(path: Path, flight: int | None, results: Path | None = None) -> tuple[Mission, FlightPlan, Path]:
    """A mission, its flight, and where the files are that it names. Raises UserError."""
    if flight is None:
        if results is not None:
            raise UserError("--results: requires --flight")
        mission = read_mission(path)
        return mission, plan_mission(mission, path), path.parent
    from quadstep.studies.campaign.single_flight import replay_of  # noqa: PLC0415 (40 ms, only for --flight)

    campaign, one = replay_of(path, flight, results)
    return one.mission, one.plan, campaign.folder


def write_weights(path: Path, mission: Mission, log: FlightLog) -> None:
    """The trained weights, to warm-start another flight from; only of a controller with nets, and a flight that ended well."""
    memory = log.final.memory
    memory = memory.paper if isinstance(memory, CompletedMemory) else memory
    memory = memory.law if isinstance(memory, HedgedBacksteppingMemory) else memory
    if not isinstance(memory, BacksteppingMemory | RotationMemory) or log.outcome is not Outcome.COMPLETED:
        return
    nets = mission.controller.model_dump()["nets"]
    weights = {"W1": [list(row) for row in memory.weights_1], "W2": [list(row) for row in memory.weights_2]}
    write_json(path, {"neurons": nets["neurons"], "seed": nets["seed"], **weights})


def summarise(
    name: str, log: FlightLog, metrics: Metrics, warnings: tuple[str, ...], judged: list[JudgedMetric],
    mission: Mission | None, why: str = "",
) -> FlightSummary:  # fmt: skip
    """The table of errors, how close the vehicle came to its limits, and the closing line. mission, why: it ended early, if
    known.
    """
    header, errors = error_table(metrics, log)
    rows = [[f"{axis} [{unit}]", *values] for axis, *values, unit in errors]
    facts = [[one.what, one.value] for one in of_limits(metrics)]
    completed = log.outcome is Outcome.COMPLETED
    if completed:
        counted = errors_since(mission) + cut(mission) if mission else ""
        when = worst(log, mission.scored_from, mission.moments) if mission else ""
        error = f"; position RMSE {quantity(metric(metrics, 'position_rmse[m]'), 'm')}{counted}"
        if " after " in when:
            error += f"; largest error {quantity(metric(metrics, 'largest_error[m]'), 'm')}{when}"
        but = graded(metrics).sentence
        ending = " ".join(filter(None, (left_path(log, metrics), f"Completed {log.ended:g} s{error}.", but)))
    else:
        kept = "The log up to that point is kept." if len(log.rows) else "Its log is empty."
        ending = f"Lost at {log.ended:g} s: {why or REASONS[log.outcome]}. {kept}"
    return FlightSummary(name, [*header[1:-1]], rows, facts, ending, completed, warnings, metrics, judged)
