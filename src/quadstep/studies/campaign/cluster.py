"""A campaign on a Ray cluster: spans of flights flown wherever a core is free, assembled as on one machine.

A span that is lost with its worker or its node is flown again elsewhere; a flight depends on its number only, so this changes
nothing. `docs/cluster.md` explains how to run one and gives measurements.
"""

import pickle
import platform
import re
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing
from functools import partial
from importlib import import_module
from importlib.metadata import version
from itertools import islice
from types import ModuleType
from typing import Any, NamedTuple, NoReturn, TypeVar

import pyarrow as pa
from numpy.typing import ArrayLike

from quadstep.engines.sweep import Sweep, SweepResults
from quadstep.interfaces.closed_loop import Advance
from quadstep.io import __version__
from quadstep.io.errors import UserError
from quadstep.io.parts import code_digest
from quadstep.studies.campaign.cluster_connection import connected, cores, first_line
from quadstep.studies.campaign.flyer import Chunk, Fly, Flyer
from quadstep.studies.campaign.schema import Campaign

T = TypeVar("T")

SPAN = 16_384
"""Most flights of one task: some seconds of work, two megabytes of results."""

SMALLEST_SPAN = 256
"""With fewer flights, a task costs more than flying them."""

AHEAD = 2
"""Tasks waiting or running per core, so that no core is idle and the driver is not flooded."""

LOSSES = 20
"""How often a span may be lost with its worker or node; beyond this, the span itself is taken to bring them down."""

PATIENCE = 60.0
"""How long a cluster may be without any core [s]: nodes come and go."""

FLYERS: dict[object, Flyer] = {}
"""This worker's flyer, by its order; at most one."""


class OneThread(Sweep):
    """A sweep on one core: the cluster has a task for each."""

    def fly(self, values: ArrayLike, threads: int | None = 1, progress: Advance | None = None) -> SweepResults:
        """Fly a flight for each row of values."""
        return super().fly(values, threads, progress)


# What a worker does


class Order(NamedTuple):
    """Instructions for workers.

    needs: what determines a flight's bits. fingerprint: of the campaign. campaign: pickled, since only a worker that has all
    of `needs` can unpickle it.
    """

    needs: tuple[tuple[str, str], ...]
    fingerprint: str
    campaign: bytes


def order(campaign: Campaign) -> Order:
    return Order(needs(), campaign.fingerprint, pickle.dumps(campaign._replace(folder=campaign.folder.resolve())))


def needs() -> tuple[tuple[str, str], ...]:
    """What determines a flight's bits on a machine, besides the campaign: names, and their values here."""
    packages = [(name, version(name)) for name in ("numpy", "llvmlite")]
    return (("quadstep", __version__), ("code of quadstep", code_digest()), *packages)


def fly_span(told: tuple[tuple[tuple[str, str], ...], str, bytes], first: int, past: int) -> pa.Table:
    """The flights of a span; the laws stay compiled for the worker's next span. told: an `Order`. Raises UserError."""
    if told not in FLYERS:
        FLYERS.clear()
        FLYERS[told] = Flyer(unpacked(Order(*told)), OneThread)
    return FLYERS[told].fly(first, past)


def unpacked(told: Order) -> Campaign:
    """The campaign to fly. Raises UserError where flights would differ from those on the requesting machine."""
    here = f"--engine ray: node {platform.node()}"
    refuse_others(here, told.needs)
    campaign: Campaign = pickle.loads(told.campaign).digested()
    if campaign.fingerprint != told.fingerprint:
        raise UserError(f"{here}: files named by the mission are missing or differ: share {campaign.folder} between nodes")
    return campaign


def refuse_others(here: str, expected: Sequence[tuple[str, str]]) -> None:
    """Refuses a machine whose `needs` differ. here: names the machine. Raises UserError."""
    for (name, mine), (_, theirs) in zip(needs(), expected, strict=False):
        if mine != theirs:
            raise UserError(
                f"{here} has {name} {mine}, the driver's machine {theirs}: results could differ in the last "
                "bits; all nodes need the same versions"
            )


# What the driver does


class ChunkSpan(NamedTuple):
    """Flights from `first` up to `past` of a chunk."""

    chunk: Chunk
    first: int
    past: int


def on_cluster(campaign: Campaign) -> Fly:
    """What flies a campaign on the cluster. Raises UserError for one that cannot be flown."""
    Flyer(campaign).rehearse()
    return partial(flown_on_cluster, campaign)


def flown_on_cluster(campaign: Campaign, chunks: Sequence[Chunk], progress: Advance) -> Iterator[tuple[Chunk, pa.Table]]:
    """The flights of each chunk, as they arrive. Raises UserError for a cluster that is absent or cannot fly."""
    with connected() as ray:
        size = span_size(sum(chunk.past - chunk.first for chunk in chunks), cores(ray))
        pieces = Pieces()
        with closing(flown_spans(ray, order(campaign), spans(chunks, size))) as flown:
            for span, table in flown:
                progress(table.num_rows)
                whole = pieces.add(span, table)
                if whole is not None:
                    yield span.chunk, whole


def span_size(flights: int, cores: int) -> int:
    """Flights per task: few enough that every core gets several and all finish together. No result depends on it."""
    even = -(-flights // (4 * max(1, cores)))
    return min(max(even, SMALLEST_SPAN), SPAN)


def spans(chunks: Sequence[Chunk], size: int) -> Iterator[ChunkSpan]:
    """The chunks in order, cut into spans."""
    for chunk in chunks:
        for first in range(chunk.first, chunk.past, size):
            yield ChunkSpan(chunk, first, min(first + size, chunk.past))


def flown_spans(
    ray: ModuleType, order: Order, waiting: Iterator[ChunkSpan]
) -> Generator[tuple[ChunkSpan, pa.Table], None, None]:
    """Spans as they come back, in any order. Raises UserError."""
    told = ray.put(tuple(order))
    return done_on(
        ray, fly_span, waiting, lambda span: (told, span.first, span.past),
        lambda span: f"flights {span.first} to {span.past - 1}",
    )  # fmt: skip


def done_on(
    ray: ModuleType, function: Callable[..., object], waiting: Iterator[T], given: Callable[[T], tuple[object, ...]],
    said: Callable[[T], str],
) -> Generator[tuple[T, Any], None, None]:  # fmt: skip
    """What a function of a module makes of each on a worker, in any order. given: its arguments; said: it in words. Raises
    UserError.

    Tasks still running when this ends are ended with the connection: Ray aborts the driver where it cancels a task that
    ends at the same moment.
    """
    module, name = function.__module__, function.__name__

    def quadstep_task(*given: object) -> object:
        # Ray sends a nested function by value, so that even a worker without quadstep can report that it has none.
        return getattr(import_module(module), name)(*given)

    remote = ray.remote(num_cpus=1, max_retries=LOSSES)(quadstep_task)
    running: dict[object, T] = {}
    while True:
        room = max(0, AHEAD * max(1, cores(ray)) - len(running))
        for one in islice(waiting, room):
            running[remote.remote(*given(one))] = one
        if not running:
            return
        for reference in finished_tasks(ray, list(running)):
            found = fetched(ray, reference, said(running[reference]))
            yield running.pop(reference), found


def finished_tasks(ray: ModuleType, flying: list[object]) -> list[object]:
    """Finished tasks, at least one. Raises UserError for a cluster that has lost all its cores."""
    while not ray.wait(flying, num_returns=1, timeout=PATIENCE)[0]:
        if not cores(ray):
            raise UserError(
                f"--engine ray: no core has been free on the cluster for {PATIENCE:g} s; start nodes with CPUs, then "
                "repeat the command, a campaign with --resume"
            )
    return ray.wait(flying, num_returns=len(flying), timeout=0)[0]


def fetched(ray: ModuleType, reference: object, what: str) -> Any:
    """The result of a task. what: the task, in words. Raises what the task raised, or UserError for an unsuitable worker."""
    try:
        return ray.get(reference)
    except ray.exceptions.RayTaskError as error:
        refuse(error)
    except ray.exceptions.RayError as error:
        raise UserError(
            f"--engine ray: {what} were lost ({first_line(error)}); finished flights of a campaign are "
            "kept, --resume continues from there"
        ) from None


def refuse(error: Any) -> NoReturn:
    """Raise the exception that a task raised on its worker."""
    cause = error.cause
    if isinstance(cause, UserError):
        raise cause from None
    if isinstance(cause, ImportError):
        place = re.search(r"ip=([^\s,)]+)", str(error))
        raise UserError(
            f"--engine ray: the worker at {place[1] if place else 'some node'} cannot import what it needs "
            f"({first_line(cause)}); install quadstep[cluster] {__version__} on every node"
        ) from None
    raise cause from error


class Pieces:
    """Tables of spans, kept until their chunk is complete."""

    def __init__(self) -> None:
        self.tables: dict[Chunk, dict[int, pa.Table]] = {}

    def add(self, span: ChunkSpan, table: pa.Table) -> pa.Table | None:
        """The table of the chunk if this completes it."""
        parts = self.tables.setdefault(span.chunk, {})
        parts[span.first] = table
        if sum(part.num_rows for part in parts.values()) < span.chunk.past - span.chunk.first:
            return None
        del self.tables[span.chunk]
        return pa.concat_tables([parts[first] for first in sorted(parts)]).combine_chunks()
