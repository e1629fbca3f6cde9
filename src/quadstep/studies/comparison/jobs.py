"""The jobs of a study, each independent of the others: on a core of this machine, or on a node of a Ray cluster.

A piece gives the content of the file that keeps it. What goes wrong in it comes back as a line, so that others can go on.
"""

import json
import os
import pickle
import platform
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, wait
from functools import partial
from pathlib import Path
from typing import Generic, NamedTuple, TypeVar

import pyarrow as pa

from quadstep.engines.engine import JOBS, Engine, loaded
from quadstep.engines.fly import fly_all
from quadstep.engines.kernel import host
from quadstep.io.errors import UserError
from quadstep.io.parts import COSTS, FLIGHTS, GAINS, GRADES, JOURNALS, LINEAR, MARGINS, key
from quadstep.io.results_folder import RUNNING
from quadstep.io.user_code import blamed, user_error
from quadstep.report.pool import drawing_pool
from quadstep.studies.campaign.cluster import OneThread, done_on, needs, refuse_others
from quadstep.studies.campaign.cluster_connection import connected
from quadstep.studies.campaign.draws import draw
from quadstep.studies.campaign.flyer import Flyer, value_column
from quadstep.studies.campaign.single_flight import replay
from quadstep.studies.campaign.store import parquet
from quadstep.studies.comparison import cost, robustness, training
from quadstep.studies.comparison.cells import FIRST, StudyCell

DRAWN = "drawn"
"""Column of what was drawn for a flight, as JSON: what varies differs from scenario to scenario."""


Subject_co = TypeVar("Subject_co", covariant=True)


class JobResult(NamedTuple):
    """What a job gave: the content of its file, or what went wrong, in one line.

    price: of flights that were set up one by one, and why they were; empty where none was.
    """

    content: bytes
    wrong: str = ""
    price: str = ""


class Job(NamedTuple, Generic[Subject_co]):
    """A piece, and what it is about. kind, key: of the file that keeps it, and a digest of all that decides it.

    controller: vehicle and controller. work: does it. flights: that it takes, at most. by_itself: done
    in this process, after all others: an autopilot is there only once, and costs are measured when nothing else is done.
    journal: where a search notes what was flown; None where nobody could read it.
    """

    kind: str
    key: str
    label: str
    controller: tuple[str, str]
    subject: Subject_co
    work: Callable[[], JobResult]
    flights: int = 0
    by_itself: bool = False
    journal: training.JournalPlace | None = None


def flying(cell: StudyCell, seeds: int) -> Job[StudyCell]:
    decisive = key(cell.situation, cell.controller, cell.campaign.fingerprint, seeds)
    return Job(FLIGHTS, decisive, cell.label, cell.who, cell, partial(fly, cell, seeds), seeds, cell.law.one_at_a_time)


def tuning(task: training.TuningTask, folder: Path | None) -> Job[training.TuningTask]:
    """The gains of a controller for a vehicle. folder: of the study, for the journal, if one can be kept."""
    decisive = key("gains", *task.decisive)
    journal = training.JournalPlace(folder, f"{RUNNING}/{JOURNALS}/{decisive}.jsonl") if folder else None
    who, label = (task.vehicle, task.controller), f"tuning {task.label}"
    return Job(GAINS, decisive, label, who, task, partial(search, task, journal), task.budget, journal=journal)


def raising(rise: robustness.Raise) -> Job[robustness.Raise]:
    """What a controller bears of a disturbance, in about so many flights."""
    decisive, who = key("margin", *rise.decisive), (rise.vehicle, rise.controller)
    flights = rise.entry.flights * (robustness.HALVINGS + 3)
    return Job(MARGINS, decisive, rise.label, who, rise, partial(withstand, rise), flights, rise.law.one_at_a_time)


def grading(cell: StudyCell, flight: int) -> Job[StudyCell]:
    """What a flight of a cell is graded by, which takes its log."""
    decisive = key(GRADES, cell.campaign.fingerprint, flight)
    return Job(GRADES, decisive, cell.label, cell.who, cell, partial(measure_flight, cell, flight), 1)


def linearising(cell: StudyCell) -> Job[StudyCell]:
    """The loop of a cell at rest."""
    return Job(LINEAR, key(LINEAR, cell.campaign.fingerprint, ""), cell.label, cell.who, cell, partial(linearise, cell))


def costing(cell: StudyCell) -> Job[StudyCell]:
    """What the law of a cell takes to compute, on this machine."""
    decisive = key(COSTS, cell.campaign.fingerprint, (host().name, cost.edition()))
    return Job(COSTS, decisive, cell.label, cell.who, cell, partial(measure, cell), by_itself=True)


def fly(cell: StudyCell, seeds: int) -> JobResult:
    """A row for each flight, the same columns whatever varies."""
    campaign = cell.campaign
    flyer = Flyer(campaign, OneThread)
    table = flyer.fly(FIRST, FIRST + seeds)
    values = {name: value_column(one).to_pylist() for name, one in draw(campaign.file, table["flight"].to_numpy()).items()}
    rows = [json.dumps({name: column[i] for name, column in values.items()}) for i in range(seeds)]
    whose = dict(zip(("vehicle", "path", "scenario", "controller"), (*cell.situation, cell.controller), strict=True))
    columns = {name: pa.array([text] * seeds).dictionary_encode() for name, text in whose.items()}
    columns["tuning"] = pa.array([1 + cell.repeat] * seeds)
    columns |= {name: table[name] for name in table.column_names if name not in values}
    return JobResult(parquet(pa.table({**columns, DRAWN: pa.array(rows)})), price=flyer.planner.price())


def search(task: training.TuningTask, journal: training.JournalPlace | None) -> JobResult:
    return as_text({"controller": task.label, **training.train(task, journal)._asdict()})


def withstand(rise: robustness.Raise) -> JobResult:
    return as_text(robustness.as_json(robustness.find(rise)))


def measure_flight(cell: StudyCell, flight: int) -> JobResult:
    """The metrics of a flight that was flown again."""
    one = replay(cell.campaign, flight)
    (log,) = fly_all([one.plan])
    return as_text({"flight": flight, **one.mission.flight_metrics(log)[0]})


def linearise(cell: StudyCell) -> JobResult:
    """The margins of the loop, or why there are none."""
    return as_text(robustness.linear_of(cell)._asdict())


def measure(cell: StudyCell) -> JobResult:
    return as_text(cost.as_json(cost.cost(cell.mission.plan(cell.campaign.folder, warn=False))))


def as_text(content: object) -> JobResult:
    return JobResult((json.dumps(content, indent=1) + "\n").encode())


def do_job(job: Job[object]) -> JobResult:
    """Do a job; errors of the user's come back as lines."""
    try:
        return job.work()
    except UserError as error:
        return JobResult(b"", str(error))
    except Exception as error:
        if blamed(error) is None:
            raise
        return JobResult(b"", str(user_error(error)))


LOOK = 0.5
"""Seconds from one look at what is being worked on to the next."""

Look = Callable[[], None]


def work(jobs: Sequence[Job[object]], engine: Engine, look: Look) -> Iterator[tuple[Job[object], JobResult]]:
    """Jobs as they are done, in any order. look: called while others go on. Raises UserError where there is no cluster."""
    if not jobs:
        return iter(())
    return loaded(JOBS, engine)(jobs, look)


def one_by_one(jobs: Sequence[Job[object]]) -> Iterator[tuple[Job[object], JobResult]]:
    """One after the other in this process, so that what is measured has the machine for itself."""
    return ((job, do_job(job)) for job in jobs)


def on_cores(jobs: Sequence[Job[object]], look: Look) -> Iterator[tuple[Job[object], JobResult]]:
    """On this machine. Those that take longest come first, so that all cores end together."""
    count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    with drawing_pool(min(count, len(jobs))) as pool:
        going = {pool.submit(do_job, job): job for job in sorted(jobs, key=lambda job: -job.flights)}
        while going:
            done, _ = wait(going, LOOK, FIRST_COMPLETED)
            look()
            for future in done:
                yield going.pop(future), future.result()


def on_cluster(jobs: Sequence[Job[object]], _look: Look) -> Iterator[tuple[Job[object], JobResult]]:
    with connected() as ray:
        asked = needs()
        given, said = (lambda job: (asked, pickle.dumps(job))), (lambda job: f"the flights of {job.label}")
        for job, found in done_on(ray, on_worker, iter(jobs), given, said):
            yield job, JobResult(*found)


def on_worker(told: Sequence[tuple[str, str]], packed: bytes) -> tuple[bytes, str, str]:
    """A job, on a node that has all it needs. Raises UserError."""
    refuse_others(f"--engine ray: node {platform.node()}", told)
    job: Job[object] = pickle.loads(packed)
    content, wrong, price = do_job(job)
    return content, wrong, price
