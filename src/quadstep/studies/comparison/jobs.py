"""The pieces that a study is worked out in, each by itself: on a core of this machine, or on a node of a cluster.

A piece gives the content of the file that keeps it. What goes wrong in it comes back as a line, so that others can go on.
"""

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Generic, NamedTuple, TypeVar

import pyarrow as pa

from quadstep.engines.kernel import host
from quadstep.io.errors import UserError
from quadstep.io.results.folder import RUNNING
from quadstep.io.results.parts import COSTS, FLIGHTS, GAINS, JOURNALS, LINEAR, MARGINS, key
from quadstep.io.user_code.blame import blamed, user_error
from quadstep.studies.campaign.cluster import OneThread
from quadstep.studies.campaign.draws import draw
from quadstep.studies.campaign.flown import Flyer, drawn_column
from quadstep.studies.campaign.store import parquet
from quadstep.studies.comparison import cost, linear, margins, training
from quadstep.studies.comparison.study import FIRST, Cell

DRAWN = "drawn"
"""Column of what was drawn for a flight, as JSON: what varies differs from scenario to scenario."""


Subject_co = TypeVar("Subject_co", covariant=True)


class Worked(NamedTuple):
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
    work: Callable[[], Worked]
    flights: int = 0
    by_itself: bool = False
    journal: training.Place | None = None


def flying(cell: Cell, seeds: int) -> Job[Cell]:
    decisive = key(cell.situation, cell.controller, cell.campaign.fingerprint, seeds)
    return Job(FLIGHTS, decisive, cell.label, cell.who, cell, partial(fly, cell, seeds), seeds, cell.law.one_at_a_time)


def tuning(task: training.Task, folder: Path | None) -> Job[training.Task]:
    """The gains of a controller for a vehicle. folder: of the study, for the journal, if one can be kept."""
    decisive = key("gains", *task.decisive)
    journal = training.Place(folder, f"{RUNNING}/{JOURNALS}/{decisive}.jsonl") if folder else None
    who, label = (task.vehicle, task.controller), f"tuning {task.label}"
    return Job(GAINS, decisive, label, who, task, partial(search, task, journal), task.budget, journal=journal)


def raising(asked: margins.Raise) -> Job[margins.Raise]:
    """What a controller bears of a disturbance, in about so many flights."""
    decisive, who = key("margin", *asked.decisive), (asked.vehicle, asked.controller)
    flights = asked.entry.flights * (margins.HALVINGS + 3)
    return Job(MARGINS, decisive, asked.label, who, asked, partial(bear, asked), flights, asked.law.one_at_a_time)


def linearising(cell: Cell) -> Job[Cell]:
    """The loop of a cell at rest."""
    return Job(LINEAR, key(LINEAR, cell.campaign.fingerprint, ""), cell.label, cell.who, cell, partial(linearise, cell))


def costing(cell: Cell) -> Job[Cell]:
    """What the law of a cell takes to compute, on this machine."""
    decisive = key(COSTS, cell.campaign.fingerprint, (host().name, cost.edition()))
    return Job(COSTS, decisive, cell.label, cell.who, cell, partial(measure, cell), by_itself=True)


def fly(cell: Cell, seeds: int) -> Worked:
    """A row for each flight, the same columns whatever varies."""
    campaign = cell.campaign
    flyer = Flyer(campaign, OneThread)
    table = flyer.fly(FIRST, FIRST + seeds)
    values = {name: drawn_column(one).to_pylist() for name, one in draw(campaign.file, table["flight"].to_numpy()).items()}
    rows = [json.dumps({name: column[i] for name, column in values.items()}) for i in range(seeds)]
    whose = dict(zip(("vehicle", "path", "scenario", "controller"), (*cell.situation, cell.controller), strict=True))
    columns = {name: pa.array([text] * seeds).dictionary_encode() for name, text in whose.items()}
    columns["tuning"] = pa.array([1 + cell.repeat] * seeds)
    columns |= {name: table[name] for name in table.column_names if name not in values}
    return Worked(parquet(pa.table({**columns, DRAWN: pa.array(rows)})), price=flyer.planner.price())


def search(task: training.Task, journal: training.Place | None) -> Worked:
    return as_text({"controller": task.label, **training.train(task, journal)._asdict()})


def bear(asked: margins.Raise) -> Worked:
    return as_text(margins.as_json(margins.find(asked)))


def linearise(cell: Cell) -> Worked:
    """The margins of the loop, or why there are none."""
    return as_text(linear.linear_of(cell)._asdict())


def measure(cell: Cell) -> Worked:
    return as_text(cost.as_json(cost.cost_of(cell)))


def as_text(content: object) -> Worked:
    return Worked((json.dumps(content, indent=1) + "\n").encode())


def worked(job: Job[object]) -> Worked:
    """Do a job; errors of the user's come back as lines."""
    try:
        return job.work()
    except UserError as error:
        return Worked(b"", str(error))
    except Exception as error:
        if blamed(error) is None:
            raise
        return Worked(b"", str(user_error(error)))
