"""`quadstep compare`: from a study to a folder with what was found."""

import contextlib
import itertools
import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple, TypeVar

import pyarrow as pa
import pyarrow.parquet as pq

from quadstep.engines.engine import Engine
from quadstep.io.documents import parse_json
from quadstep.io.errors import UserError, unknown_name
from quadstep.io.parts import COSTS, LINEAR, Parts, changed, code_digest, digest_of, parts_in
from quadstep.metrics.verdict import FlightGrade, Graded, error_limit, graded
from quadstep.report.evidence import Evidence
from quadstep.report.progress import SILENT, Progress
from quadstep.report.publish import publishing
from quadstep.report.sheet import Sheet
from quadstep.report.units import counted, listed
from quadstep.studies.campaign.planner import is_random
from quadstep.studies.campaign.schema import digests
from quadstep.studies.comparison import cost, robustness
from quadstep.studies.comparison.cells import FIRST, ComparisonStudy, Situation, StudyCell
from quadstep.studies.comparison.entrants import Comparison, Entrant, Problem, entrants, ranks, result, with_gains, write_gains
from quadstep.studies.comparison.jobs import Job, JobResult, costing, flying, grading, linearising, one_by_one, raising, work
from quadstep.studies.comparison.ranking import CellFlights, flown_of
from quadstep.studies.comparison.report import write_results
from quadstep.studies.comparison.robustness import Linear, Raise
from quadstep.studies.comparison.training import flown_in, read_lines
from quadstep.studies.comparison.words import large_errors

log = logging.getLogger(__name__)

Read = TypeVar("Read")


class How(NamedTuple):
    """engine: what flies. keep_going: whether others go on where one controller cannot. again: tune what the study has gains
    for. sheet: what figures are drawn on.
    """

    engine: Engine = Engine.LANES
    overwrite: bool = False
    keep_going: bool = False
    again: bool = False
    progress: Progress = SILENT
    sheet: Sheet = Sheet()


class FinishedComparison(NamedTuple):
    found: Comparison
    evidence: Evidence
    folder: Path


class ComparisonRun:
    """Working out the pieces of a comparison. problems: so far; whoever has one takes part no more."""

    def __init__(self, parts: Parts, how: How) -> None:
        self.kept, self.how = parts, how
        self.problems: list[Problem] = []
        self.priced: set[tuple[str, str]] = set()

    def report_problem(self, problem: Problem) -> None:
        """Something cannot go on. Raises UserError unless others shall."""
        if not self.how.keep_going:
            raise UserError(*problem.lines)
        self.problems.append(problem)

    @contextlib.contextmanager
    def problem_of(self, vehicle: str, controller: str) -> Iterator[None]:
        """What is wrong here is a problem of this controller."""
        try:
            yield
        except UserError as error:
            self.report_problem(Problem((vehicle, controller), error.lines))

    def out(self, vehicle: str, controller: str) -> bool:
        """Whether a controller takes part no more."""
        return any(one.controller == (vehicle, controller) for one in self.problems)

    def work(self, what: str, jobs: Sequence[Job[object]]) -> None:
        """Do these, but for what is kept; those that want the machine to themselves one after the other, after all others."""
        if not jobs:
            return
        counted = any(job.flights for job in jobs)
        self.how.progress.doing(what, "flights" if counted else "jobs")

        def size(job: Job[object]) -> int:
            return job.flights if counted else 1

        going = {job.key: job for job in jobs if self.kept.find(job.kind, job.key) is None or self.failed(job)}
        missing = list(going.values())
        over = (total := sum(map(size, jobs))) - sum(map(size, missing))
        self.how.progress.to(over, total)

        def look() -> None:
            self.how.progress.to(min(total, over + sum(map(so_far, going.values()))), total)

        single = [job for job in missing if job.by_itself]
        others = [job for job in missing if job not in single]
        for job, worked in itertools.chain(work(others, self.how.engine, look), one_by_one(single)):
            del going[job.key]
            over += size(job)
            for one in (other for other in jobs if other.key == job.key) if worked.wrong else (job,):
                self.keep(one, worked)
            self.how.progress.to(over, total)

    def failed(self, job: Job[object]) -> bool:
        """Whether what is kept is a cost that lacks its instructions because a tool failed: by now it may work."""
        found = self.read(job, cost.from_json) if job.kind == COSTS else None
        return found is not None and found.failed

    def keep(self, job: Job[object], worked: JobResult) -> None:
        """Keep what a job gave; say once of each controller which keys make its flights be set up one by one."""
        if worked.price and job.controller not in self.priced:
            self.priced.add(job.controller)
            log.warning("quadstep: note: %s: %s", job.label, worked.price)
        if worked.wrong and self.out(*job.controller):
            return  # of which enough has been said
        if worked.wrong:
            self.report_problem(Problem(job.controller, [f"{job.label}: {worked.wrong}"]))
        else:
            self.kept.add(job.kind, job.key, worked.content)

    def read(self, job: Job[object], made: Callable[..., Read]) -> Read | None:
        """What a job gave, from its file of JSON; None where it gave nothing. Raises UserError for a file that was changed."""
        content = self.kept.read(job.kind, job.key)
        if content is None:
            return None
        path = self.kept.folder.path / str(self.kept.find(job.kind, job.key))
        try:
            return made(parse_json(content, str(path)))
        except (KeyError, TypeError, ValueError):
            raise changed(path) from None

    def publish(self, out: Path, jobs: Sequence[Job[object]]) -> None:
        """Put what these jobs gave into the folder of a finished study."""
        self.kept.publish(out, [(job.kind, job.key) for job in jobs if self.kept.find(job.kind, job.key)])


def so_far(job: Job[object]) -> int:
    """Flights that an unfinished search has noted."""
    lines = read_lines(job.journal) if job.journal else []
    return int(lines[-1]["flights"]) if lines else 0


def compare_study(study: ComparisonStudy, folder: Path, how: How) -> FinishedComparison:
    """Tune, fly, judge, and write `folder`. What was worked out is kept there, and the same command goes on from it.

    Raises UserError, and InterruptedRun on Ctrl-C.
    """
    identity = digest_of(study.file.model_dump(exclude={"name"}), study.text)
    with parts_in(folder) as kept, publishing(folder, identity, how.overwrite, code=code_digest()) as out:
        kept.note(digests(study.file.model_dump(), study.folder))
        run = ComparisonRun(kept, how)
        asked, problems, left_out = entrants(study, run.kept, how.again, how.engine is Engine.LANES)
        for problem in problems:
            run.report_problem(problem)
        if not asked:
            raise UserError(f"no controller is left to compare: {[*left_out, *(one.line for one in problems)][0]}")
        metrics = check_all(study, run, [one.entrant for one in asked])
        jobs = [job for one in asked for job in one.jobs if not run.out(*job.controller)]
        run.work("tuning", jobs)
        everybody = [with_gains(study, one, run.kept) for one in asked if not run.out(one.entrant.vehicle, one.entrant.name)]
        flights, flown = fly(run, cells(study, run, everybody), study.file.seeds)
        bears = raises(study, run, everybody)
        run.work("raising", bears)
        about = Comparison(
            name=study.file.name,
            source=study.source,
            seeds=study.file.seeds,
            seed=study.file.seed,
            metrics=metrics,
            entrants=tuple(everybody),
            margins={
                (one.subject.name, *one.controller): found for one in bears if (found := run.read(one, robustness.from_json))
            },
            raised=study.file.margins or {},
            tuned_in=frozenset(one for one in flown if study.file.tuning and one[1:] in flown_in(study)),
            notes=study.file.notes,
            left_out=tuple(left_out),
        )
        write_gains(out / "gains.json", everybody)
        return concluded(run, out, folder, about, flights, flown, [*jobs, *bears])


def concluded(
    run: ComparisonRun, out: Path, folder: Path, about: Comparison, flights: Sequence[Job[StudyCell]],
    flown: Mapping[Situation, Mapping[str, CellFlights]], others: Sequence[Job[object]] = (),
) -> FinishedComparison:  # fmt: skip
    """A comparison whose flights are flown: the laws linearised and costed, all of it judged, and written into `out`.

    about: what is known of it already. others: jobs whose parts belong to it too. Raises UserError.
    """
    best = [job.subject for job in flights if not job.subject.repeat]  # the flights with the best gains
    tried = [cell for cell in best if not cell.law.one_at_a_time]  # an autopilot may not be there any more
    middle = [(cell, flown[cell.situation][cell.controller].middle(about.metric)) for cell in tried]
    again, asked = [grading(cell, FIRST + place) for cell, place in middle if place is not None], laws(flights)
    run.work("grading", again)
    run.work("linearising and costing", asked)
    grades = {(one.subject.situation, one.subject.controller): run.read(one, graded) for one in again}
    every = {(place, name): one for place, many in flown.items() for name, one in many.items()}
    grades |= {cell: Graded(FlightGrade.LOST) for cell, one in every.items() if one.middle(about.metric) is None}
    found = about._replace(
        seeds=max(job.flights for job in flights),
        results=tuple(result(*cell, one, about.metrics, grades.get(cell)) for cell, one in every.items()),
        ranked=ranks(flown, about.metric),
        limits=large_errors([(one.subject.situation, run.read(one, error_limit) or 0.0) for one in again]),
        costs={one.controller: price for one in asked if one.kind == COSTS and (price := run.read(one, cost.from_json))},
        linear={
            one.controller: loop
            for one in asked
            if one.kind == LINEAR and (loop := run.read(one, lambda kept: Linear(**kept)))
        },
        problems=tuple(run.problems),
        left_out=(*about.left_out, *unpaired(flights)),
    )
    told = write_results(out, found, flights, run.how.sheet)
    run.publish(out, [*others, *flights, *again, *asked])
    return FinishedComparison(found, told, folder)


def cells(study: ComparisonStudy, run: ComparisonRun, everybody: Sequence[Entrant]) -> list[StudyCell]:
    """Everybody in every situation, with the gains of each search."""
    found: list[StudyCell] = []
    for situation in study.situations():
        for one in everybody:
            if one.vehicle == situation.vehicle and not run.out(one.vehicle, one.name):
                with run.problem_of(one.vehicle, one.name):
                    found += [study.cell(situation, one.name, each.table, i) for i, each in enumerate((one, *one.others))]
    return found


def fly(
    run: ComparisonRun, cells: Sequence[StudyCell], seeds: int
) -> tuple[list[Job[StudyCell]], dict[Situation, dict[str, CellFlights]]]:
    """Fly all cells, and read them back. Raises UserError for a situation that nobody survives."""
    jobs = [flying(cell, seeds if is_random(cell.campaign) else 1) for cell in cells]
    run.work("flying", jobs)
    there = [job for job in jobs if not run.out(*job.controller)]
    flown: dict[Situation, dict[str, CellFlights]] = {}
    for job in there:
        row, one = flown.setdefault(job.subject.situation, {}), read_back(run.kept, job)
        first = row.get(job.subject.controller)
        row[job.subject.controller] = first._replace(others=(*first.others, one)) if first else one
    if not there:
        raise UserError(
            f"no controller is left to compare: {run.problems[0].line}" if run.problems else "there is nothing to fly"
        )
    for situation, many in list(flown.items()):
        if all(one.lost.all() for one in many.values()):
            where = situation.label or "the missions"
            run.report_problem(Problem(None, [f"{where}: no controller completes any of {counted(seeds, 'flight')}"]))
    return there, flown


def unpaired(flights: Sequence[Job[StudyCell]]) -> tuple[str, ...]:
    """A sentence where noise and gusts of the same flight differ between controllers: they are drawn step by step."""
    steps: dict[Situation, dict[float, dict[str, None]]] = {}
    for cell in (one.subject for one in flights if one.subject.mission.noisy):
        steps.setdefault(cell.situation, {}).setdefault(cell.mission.simulation.step, {})[cell.controller] = None
    apart = next((one for one in steps.values() if len(one) > 1), {})
    said = [f"{1e3 * step:g} ms ({listed(list(names))})" for step, names in apart.items()]
    return (f"Gusts and noise differ between controllers, as their simulation.step does: {listed(said)}.",) if said else ()


def read_back(parts: Parts, job: Job[StudyCell]) -> CellFlights:
    """The flights of a cell. Raises UserError for a file that is not what was written."""
    content = parts.read(job.kind, job.key)
    assert content is not None
    with contextlib.suppress(OSError, ValueError, KeyError):
        found = flown_of(pq.read_table(pa.BufferReader(content)), job.subject.campaign)
        if len(found.lost) == job.flights:
            return found._replace(same=not is_random(job.subject.campaign))
    raise changed(parts.folder.path / str(parts.find(job.kind, job.key)))


def check_all(study: ComparisonStudy, run: ComparisonRun, everybody: Sequence[Entrant]) -> dict[str, str]:
    """The metrics to report. Looks at every cell and margin before hours of tuning. Raises UserError."""
    run.how.progress.doing("checking")
    wanted = cells(study, run, everybody)
    for cell in wanted:
        if not run.out(*cell.who):
            with run.problem_of(*cell.who):
                study.check_cell(cell)
    raises(study, run, everybody)
    left = [cell for cell in wanted if not run.out(*cell.who)]
    return reported(study.source, study.reported(), left or wanted)


def raises(study: ComparisonStudy, run: ComparisonRun, everybody: Sequence[Entrant]) -> list[Job[Raise]]:
    jobs: list[Job[Raise]] = []
    for name, entry in (study.file.margins or {}).items():
        for one in everybody:
            if entry.suits(one.vehicle) and not run.out(one.vehicle, one.name):
                with run.problem_of(one.vehicle, one.name):
                    jobs.append(raising(robustness.raised(study, one.vehicle, name, one.name, one.table)))
    return jobs


def laws(flights: Sequence[Job[StudyCell]]) -> list[Job[StudyCell]]:
    """What is asked of each controller's law, in the first of its cells."""
    first: dict[tuple[str, str], StudyCell] = {}
    for job in flights:
        first.setdefault(job.controller, job.subject)
    return [made(cell) for made in (linearising, costing) for cell in first.values()]


def reported(source: str, names: Sequence[str], flown: Sequence[StudyCell]) -> dict[str, str]:
    """The metrics to report, with units. Raises UserError for one that not all flights have."""
    known = [cell.campaign.thresholds for cell in flown]
    common = {name: full for name, full in known[0].items() if all(name in one for one in known)}
    for name in names:
        if name not in common:
            raise UserError(f"{source}: metrics: {unknown_name('metric', name, common)}")
    return {name: common[name] for name in names}
