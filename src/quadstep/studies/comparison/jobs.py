"""The pieces that a study is worked out in, each by itself: on a core of this machine, or on a node of a cluster.

A piece gives the content of the file that keeps it. What goes wrong in it comes back as a line, so that others can go on.
"""

import json
from typing import NamedTuple

import pyarrow as pa

from quadstep.engines.kernel import host
from quadstep.io.errors import UserError
from quadstep.io.results.parts import COSTS, FLIGHTS, GAINS, MARGINS, key
from quadstep.io.user_code.blame import blamed, user_error
from quadstep.studies.campaign.cluster import OneThread
from quadstep.studies.campaign.draws import draw
from quadstep.studies.campaign.flown import Flyer, drawn_column
from quadstep.studies.campaign.store import parquet
from quadstep.studies.comparison import cost, linear, margins, training
from quadstep.studies.comparison.study import FIRST, Cell

DRAWN = "drawn"
"""Column of what was drawn for a flight, as JSON: what varies differs from scenario to scenario."""


class Fly(NamedTuple):
    """The flights of a cell."""

    cell: Cell
    seeds: int

    @property
    def kind(self) -> str:
        """Of its file."""
        return FLIGHTS

    @property
    def key(self) -> str:
        """What decides them."""
        return key(self.cell.situation, self.cell.controller, self.cell.campaign.fingerprint, self.seeds)

    @property
    def label(self) -> str:
        """In words."""
        return self.cell.label

    @property
    def flights(self) -> int:
        """How many."""
        return self.seeds

    @property
    def by_itself(self) -> bool:
        """Whether it is done in this process, after all others: an autopilot is there only once."""
        return self.cell.law.one_at_a_time

    @property
    def controller(self) -> tuple[str, str]:
        """Vehicle and controller."""
        return self.cell.situation.vehicle, self.cell.controller

    def work(self) -> bytes:
        """Fly: a row for each flight, the same columns whatever varies."""
        campaign = self.cell.campaign
        table = Flyer(campaign, OneThread).fly(FIRST, FIRST + self.seeds)
        values = {name: drawn_column(one).to_pylist() for name, one in draw(campaign.file, table["flight"].to_numpy()).items()}
        rows = [json.dumps({name: column[i] for name, column in values.items()}) for i in range(self.seeds)]
        whose = dict(
            zip(("vehicle", "path", "scenario", "controller"), (*self.cell.situation, self.cell.controller), strict=True)
        )
        columns = {name: pa.array([text] * self.seeds).dictionary_encode() for name, text in whose.items()}
        columns["tuning"] = pa.array([1 + self.cell.repeat] * self.seeds)
        columns |= {name: table[name] for name in table.column_names if name not in values}
        return parquet(pa.table({**columns, DRAWN: pa.array(rows)}))


class Tune(NamedTuple):
    """The gains of a controller for a vehicle. journal: where it notes what was flown; None where nobody could read it."""

    task: training.Task
    journal: training.Place | None

    @property
    def by_itself(self) -> bool:
        """No autopilot has gains to find."""
        return False

    @property
    def kind(self) -> str:
        """Of its file."""
        return GAINS

    @property
    def key(self) -> str:
        """What decides them."""
        return key("gains", *self.task.decisive)

    @property
    def label(self) -> str:
        """In words."""
        return f"tuning {self.task.label}"

    @property
    def flights(self) -> int:
        """At most."""
        return self.task.budget

    @property
    def controller(self) -> tuple[str, str]:
        """Vehicle and controller."""
        return self.task.vehicle, self.task.controller

    def work(self) -> bytes:
        """Search."""
        found = training.train(self.task, self.journal)
        return (json.dumps({"controller": self.task.label, **found._asdict()}, indent=1) + "\n").encode()


class Bear(NamedTuple):
    """What a controller bears of a disturbance."""

    asked: margins.Raise

    @property
    def kind(self) -> str:
        """Of its file."""
        return MARGINS

    @property
    def key(self) -> str:
        """What decides it."""
        return key("margin", *self.asked.decisive)

    @property
    def label(self) -> str:
        """In words."""
        return self.asked.label

    @property
    def flights(self) -> int:
        """About how many."""
        return self.asked.entry.flights * (margins.HALVINGS + 3)

    @property
    def by_itself(self) -> bool:
        """As of flights."""
        return self.asked.law.one_at_a_time

    @property
    def controller(self) -> tuple[str, str]:
        """Vehicle and controller."""
        return self.asked.vehicle, self.asked.controller

    def work(self) -> bytes:
        """Raise it."""
        return (json.dumps(margins.as_json(margins.find(self.asked)), indent=1) + "\n").encode()


class OfLaw(NamedTuple):
    """What is asked of a controller's law, without flights, in the first cell that it flies.

    kind: `LINEAR`, its loop at rest, or `COSTS`, what it takes to compute, on this machine.
    """

    kind: str
    cell: Cell

    @property
    def key(self) -> str:
        """What decides it."""
        return key(self.kind, self.cell.campaign.fingerprint, (host().name, cost.edition()) if self.kind == COSTS else "")

    @property
    def label(self) -> str:
        """In words."""
        return self.cell.label

    @property
    def flights(self) -> int:
        """None."""
        return 0

    @property
    def by_itself(self) -> bool:
        """Costs are measured when nothing else is done."""
        return self.kind == COSTS

    @property
    def controller(self) -> tuple[str, str]:
        """Vehicle and controller."""
        return self.cell.situation.vehicle, self.cell.controller

    def work(self) -> bytes:
        """Linearise, or measure."""
        found = cost.as_json(cost.cost_of(self.cell)) if self.kind == COSTS else linear.linear_of(self.cell)._asdict()
        return (json.dumps(found, indent=1) + "\n").encode()


Job = Fly | Tune | Bear | OfLaw


class Worked(NamedTuple):
    """What a job gave: the content of its file, or what went wrong, in one line."""

    content: bytes
    wrong: str = ""


def worked(job: Job) -> Worked:
    """Do a job; errors of the user's come back as lines."""
    try:
        return Worked(job.work())
    except UserError as error:
        return Worked(b"", str(error))
    except Exception as error:
        if blamed(error) is None:
            raise
        return Worked(b"", str(user_error(error)))
