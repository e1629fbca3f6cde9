"""Spans of a campaign's flights: drawn, built, flown, and returned as a table with one row per flight.

A graphics processor draws the varying values and the noise itself where it can. The same laws draw them: the mission is built
once more, with the processor's numbers in place of arrays.
"""

import logging
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from importlib import import_module
from importlib.abc import MetaPathFinder
from types import ModuleType
from typing import TYPE_CHECKING, NamedTuple, Protocol, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray

from quadstep.engines.cuda import Device
from quadstep.engines.fly import announce
from quadstep.engines.gpu_sweep import GpuSweep
from quadstep.engines.sweep import Sweep, SweepResults, joined
from quadstep.engines.sweep_trace import Generate
from quadstep.interfaces.closed_loop import Advance, Outcome
from quadstep.mission.distributions import Choice, Grid, Sobol
from quadstep.numbers import Number, Table, flatten
from quadstep.numbers.noise import flight_key, key
from quadstep.studies.campaign.draws import DrawnColumn, continuous, draw, shares
from quadstep.studies.campaign.planner import TYPICAL, PlannedBatch, Planner, planner
from quadstep.studies.campaign.schema import Campaign

if TYPE_CHECKING:
    import pyarrow as pa

MOST_SWEEPS = 256
"""Number of sweeps kept ready."""

FLIGHT, OUTCOME, TIME, SUCCESS = "flight", "outcome", "time_of_failure[s]", "success"
OUTCOMES = tuple(outcome.name.lower().replace("_", "-") for outcome in Outcome)

log = logging.getLogger(__name__)


class WithoutPandas(MetaPathFinder):
    """Hides pandas. At its first array pyarrow loads pandas where it is installed, which takes a second; if it finds none, it
    looks again only for what needs it, such as `to_pandas`.
    """

    def find_spec(self, name: str, path: object, target: object = None) -> None:
        if name == "pandas":
            raise ModuleNotFoundError(name, name=name)


@cache
def load_arrow() -> ModuleType:
    """pyarrow, loaded with the first table of flights, which `what-if` and `tune` do without: it takes a while."""
    arrow = import_module("pyarrow")
    sys.meta_path.insert(0, hidden := WithoutPandas())
    arrow.array([0])
    sys.meta_path.remove(hidden)
    return arrow


class Chunk(NamedTuple):
    """Flights from `first` up to `past`. file: that keeps them, if one does."""

    file: str
    first: int
    past: int


Fly: TypeAlias = Callable[[Sequence[Chunk], Advance], Iterator[tuple[Chunk, "pa.Table"]]]
"""Flies spans of a campaign, in any order, and yields each with its table as it finishes."""


class Sweeper(Protocol):
    """What flies a batch: `Sweep` or a class with its methods."""

    def fly(self, values: NDArray[np.float64], *, progress: Advance | None = None) -> SweepResults:
        """Fly a flight for each row of values."""
        ...


class Flyer:
    """Flies spans of a campaign's flights. sweeper: what flies a batch, `Sweep` by its arguments."""

    def __init__(self, campaign: Campaign, sweeper: Callable[..., Sweeper] = Sweep) -> None:
        self.campaign, self.sweeper = campaign, sweeper
        self.planner = planner(campaign)
        self.sweeps: dict[object, Sweeper] = {}

    def fly(self, first: int, past: int, progress: Advance | None = None) -> "pa.Table":
        """The flights from `first` up to `past`. Raises UserError for values that cannot be flown."""
        flights = np.arange(first, past)
        return self.fly_values(flights, draw(self.campaign.file, flights), progress)

    def fly_spans(self, spans: Sequence[Chunk], progress: Advance) -> Iterator[tuple[Chunk, "pa.Table"]]:
        """One after the other. Raises UserError for values that cannot be flown."""
        return ((span, self.fly(span.first, span.past, progress)) for span in spans)

    def fly_values(
        self, flights: NDArray[np.int64], columns: dict[str, DrawnColumn], progress: Advance | None = None
    ) -> "pa.Table":
        """Flights with these values and the noise of these numbers. Raises UserError for values that cannot be flown."""
        return table(self.campaign, flights, columns, *self.sweep_all(flights, columns, progress))

    def sweep_all(
        self, flights: NDArray[np.int64], columns: dict[str, DrawnColumn], progress: Advance | None
    ) -> tuple[NDArray[np.int8], NDArray[np.float64], NDArray[np.float64]]:
        """Outcome, end [s] and metrics of all of them. Raises UserError for values that cannot be flown."""
        outcome, ended = np.empty(len(flights), dtype=np.int8), np.empty(len(flights))
        metrics = np.empty((len(flights), len(self.campaign.metrics)))
        for batch in self.planner.batches(flights, columns):
            swept = self.swept(batch, progress)
            outcome[batch.members], ended[batch.members] = swept.outcome, swept.ended
            metrics[batch.members] = swept.metrics
        return outcome, ended, metrics

    def swept(self, batch: PlannedBatch, progress: Advance | None) -> SweepResults:
        """The flights of a batch. Raises what an opaque controller raised."""
        sweep, loop = self.sweep(batch), batch.loop.loop
        if not loop.controller.one_at_a_time:
            found = sweep.fly(batch.rows, progress=progress)
            loop.controller.after_flight(batch.parameters.gains)
            return found
        flights = []
        for row in batch.rows:
            start, parameters = batch.flight(row)
            announce(loop, parameters, start)
            flights.append(sweep.fly(row[None], progress=progress))
            loop.controller.after_flight(parameters.gains)
        return joined(flights)

    def rehearse(self) -> Self:
        """Build the first flights, so that impossible ones are refused before anything is written, and slow ones are
        announced. Raises UserError.
        """
        flights = np.arange(TYPICAL)
        for _ in self.planner.batches(flights, self.planner.typical):
            pass
        self.say_slow()
        return self

    def say_slow(self) -> None:
        """Say which keys made flights be set up one by one so far, if any did, and what that costs."""
        if price := self.planner.price():
            log.warning("quadstep: note: %s", price)

    def sweep(self, batch: PlannedBatch) -> Sweeper:
        """The sweep for a batch, kept for the next one like it."""
        leaves, varying = flatten((batch.start, batch.parameters)), set(batch.places)
        constants = tuple(
            tuple(leaf.values) if isinstance(leaf, Table) else leaf
            for place, leaf in enumerate(leaves)
            if place not in varying
        )
        key = (batch.loop, batch.ticks, batch.places, constants)
        if key not in self.sweeps:
            if len(self.sweeps) >= MOST_SWEEPS:
                self.sweeps.pop(next(iter(self.sweeps)))
            self.sweeps[key] = self.sweeper(
                batch.loop, batch.ticks, batch.start, batch.parameters, batch.places, self.campaign.double
            )
        return self.sweeps[key]


def on_lanes(campaign: Campaign) -> Fly:
    """What flies a campaign on the cores of this machine. Raises UserError for one that cannot be flown."""
    return Flyer(campaign).rehearse().fly_spans


def table(
    campaign: Campaign, flights: NDArray[np.int64], drawn: dict[str, DrawnColumn], outcome: NDArray[np.int8],
    ended: NDArray[np.float64], metrics: NDArray[np.float64],
) -> "pa.Table":  # fmt: skip
    """One row per flight; missing values are null, never NaN."""
    pa, number = load_arrow(), np.float64 if campaign.double else np.float32
    lost = outcome != Outcome.COMPLETED
    columns: dict[str, object] = {FLIGHT: pa.array(flights)}
    columns |= {name: value_column(column) for name, column in drawn.items()}
    columns[OUTCOME] = pa.DictionaryArray.from_arrays(pa.array(outcome), pa.array(OUTCOMES))
    columns[TIME] = pa.array(ended, mask=~lost)
    for name, values in zip(campaign.metrics, metrics.T, strict=True):
        known = np.isfinite(values)
        with np.errstate(over="ignore", invalid="ignore"):
            columns[name] = pa.array(values.astype(number), mask=~known)
    return judged(pa.table(columns), campaign)


def judged(table: "pa.Table", campaign: Campaign) -> "pa.Table":
    """The flights with a last column that says which succeed: those completed with every metric that has a limit known and
    not above it.
    """
    success = table[OUTCOME].to_numpy() == OUTCOMES[Outcome.COMPLETED]
    for name, most in campaign.file.failure.items():
        success &= table[campaign.thresholds[name]].to_numpy() <= most
    rest = table.drop_columns([SUCCESS]) if SUCCESS in table.column_names else table
    return rest.append_column(SUCCESS, load_arrow().array(success))


def value_column(column: DrawnColumn) -> "pa.Array":
    """A column of drawn values: numbers, booleans or text."""
    pa = load_arrow()
    if column.options is None:
        return pa.array(column.values)
    return pa.array(column.shown_options()).take(pa.array(column.values.astype(np.int64)))


def device_flyer(campaign: Campaign) -> Flyer:
    """A flyer for the graphics processor. Raises UserError where there is none."""
    Device()  # refuse before anything else is done
    flyer = Flyer(campaign, GpuSweep)
    only = generated_batch(flyer)
    return flyer if only is None else DeviceFlyer(campaign, flyer.planner, only)


def on_gpu(campaign: Campaign) -> Fly:
    """What flies a campaign there. Raises UserError where there is none, and for a campaign that cannot be flown."""
    return device_flyer(campaign).rehearse().fly_spans


def generated_batch(flyer: Flyer) -> PlannedBatch | None:
    """The one batch of a campaign whose values can be drawn on the device; None for any other campaign."""
    file = flyer.campaign.file
    if any(isinstance(one, Choice | Grid | Sobol) for one in file.vary.values()):
        return None
    flights = np.arange(TYPICAL)
    batches = list(flyer.planner.batches(flights, draw(file, flights)))
    direct = flyer.planner.direct[()]
    return batches[0] if len(batches) == 1 and len(direct) == len(file.keys) else None


def generate(campaign: Campaign, planner: Planner, batch: PlannedBatch) -> Generate:
    """The law that computes the varying numbers of a flight from its number."""
    base = key(campaign.file.seed, 0).words
    values = {name: column.at(0) for name, column in planner.typical.items()}

    def law(high: Number, low: Number) -> list[Number]:
        own = flight_key(base, high, low)
        plan = planner.built(values, continuous(campaign.file, shares(campaign.file, own)))
        if hasattr(plan.parameters, "key"):
            plan = plan._replace(parameters=plan.parameters._replace(key=own))
        leaves = flatten((plan.start, plan.parameters))
        return [leaves[place] for place in sorted(batch.places)]

    return law


class DeviceFlyer(Flyer):
    """Flies flights whose values are drawn on the device."""

    def __init__(self, campaign: Campaign, planner: Planner, batch: PlannedBatch) -> None:
        self.campaign, self.planner, self.batch = campaign, planner, batch
        law = generate(campaign, planner, batch)
        self.device = GpuSweep(
            batch.loop, batch.ticks, batch.start, batch.parameters, batch.places, campaign.double, generate=law
        )

    def fly(self, first: int, past: int, progress: Advance | None = None) -> "pa.Table":
        """The flights from `first` up to `past`. The drawn values are written as they are drawn here, in f64.

        Raises UserError for values that cannot be flown.
        """
        flights = np.arange(first, past)
        drawn = draw(self.campaign.file, flights)
        self.planner.check((), {}, {name: column.values for name, column in drawn.items()}, flights)
        swept, _ = self.device.generated(first, past, progress)
        return table(self.campaign, flights, drawn, swept.outcome, swept.ended, swept.metrics)
