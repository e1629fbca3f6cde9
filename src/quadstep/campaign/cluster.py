"""A campaign on a Ray cluster: spans of flights flown wherever a core is free, put together as one machine would have them.

A span that is lost with its worker or its node is flown again elsewhere; a flight depends on its number only, so nobody can
tell.
"""

import logging
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from quadstep import __version__
from quadstep.campaign.flown import Flyer, Progress
from quadstep.campaign.schema import Campaign
from quadstep.campaign.store import Chunk
from quadstep.errors import UserError
from quadstep.flight.sweep import Sweep, Swept

SPAN = 16_384
"""Flights of one task at most: a second or so of work, some megabytes of results."""

AHEAD = 2
"""Tasks that wait or run for each core, so that none is idle and the driver is not flooded."""

FLYERS: dict[str, Flyer] = {}
"""Of this worker, by campaign."""


class OneThread(Sweep):
    """A sweep on one core: the cluster has a task for each."""

    def fly(self, values: NDArray[np.float64], progress: Callable[[int], None] | None = None) -> Swept:  # type: ignore[override]
        """Fly a flight for each row of values."""
        return super().fly(values, 1, progress)


class Span(NamedTuple):
    """Flights from `first` up to `past` of a chunk."""

    chunk: Chunk
    first: int
    past: int


def fly_span(campaign: Campaign, identity: str, version: str, first: int, past: int) -> pa.Table:
    """On a worker: flights of a campaign, whose laws stay compiled for the next span. Raises UserError."""
    if version != __version__:
        raise UserError(f"--engine ray: a worker has quadstep {__version__}, here is {version}; install the same everywhere")
    if identity not in FLYERS:
        FLYERS.clear()
        FLYERS[identity] = Flyer(campaign, OneThread)
    return FLYERS[identity].fly(first, past)


def spans(chunks: Sequence[Chunk]) -> Iterator[Span]:
    """The chunks in order, cut to pieces."""
    for chunk in chunks:
        for first in range(chunk.first, chunk.past, SPAN):
            yield Span(chunk, first, min(first + SPAN, chunk.past))


def flown_on_cluster(campaign: Campaign, chunks: Sequence[Chunk], progress: Progress) -> Iterator[tuple[Chunk, pa.Table]]:
    """The flights of each chunk, as they come. Raises UserError for a cluster that is not there or cannot fly."""
    with connected() as ray:
        from ray import exceptions  # noqa: PLC0415 (an extra, loaded where it is used)

        task = ray.remote(num_cpus=1, max_retries=-1)(fly_span)
        given = ray.put(campaign._replace(folder=campaign.folder.resolve()))
        waiting, done = spans(chunks), Pieces()
        flying: dict[Any, Span] = {}
        again: list[Span] = []
        more = True
        while more or flying:
            room = AHEAD * cores(ray)
            while more and len(flying) < room:
                span = again.pop() if again else next(waiting, None)
                more = span is not None
                if span is not None:
                    flying[task.remote(given, campaign.fingerprint, __version__, span.first, span.past)] = span
            ready, _ = ray.wait(list(flying), num_returns=1)
            span = flying.pop(ready[0])
            try:
                table = ray.get(ready[0])
            except exceptions.RayTaskError as error:
                raise refused(error) from None
            except (exceptions.ObjectLostError, exceptions.WorkerCrashedError, exceptions.NodeDiedError):
                again.append(span)  # its result went down with a node before it was fetched
                more = True
                continue
            progress(table.num_rows)
            whole = done.add(span, table)
            if whole is not None:
                yield span.chunk, whole


class Pieces:
    """Tables of spans until their chunk is whole."""

    def __init__(self) -> None:
        self.tables: dict[Chunk, dict[int, pa.Table]] = {}

    def add(self, span: Span, table: pa.Table) -> pa.Table | None:
        """The table of the chunk if this was what it lacked."""
        parts = self.tables.setdefault(span.chunk, {})
        parts[span.first] = table
        if sum(part.num_rows for part in parts.values()) < span.chunk.past - span.chunk.first:
            return None
        del self.tables[span.chunk]
        return pa.concat_tables([parts[first] for first in sorted(parts)]).combine_chunks()


@contextmanager
def connected() -> Iterator[Any]:
    """The module of Ray, connected to the cluster of RAY_ADDRESS, or to one of this machine's cores. Raises UserError."""
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    import ray  # noqa: PLC0415 (an extra, loaded where it is used)

    address = os.environ.get("RAY_ADDRESS")
    mine = not ray.is_initialized()
    try:
        if mine:
            quiet: dict[str, Any] = {"log_to_driver": False, "logging_level": logging.ERROR}
            own: dict[str, Any] = {} if address else {"include_dashboard": False}
            ray.init(address=address or "local", **own, **quiet)
        cores(ray)
        yield ray
    except (ConnectionError, TimeoutError) as error:
        where = f"the cluster at RAY_ADDRESS = {address}" if address else "a cluster of this machine's cores"
        raise UserError(f"--engine ray: {where} cannot be reached: {first_line(error)}") from None
    finally:
        if mine:
            ray.shutdown()


def cores(ray: Any) -> int:
    """Of all nodes. Raises UserError where there are none."""
    count = int(ray.cluster_resources().get("CPU", 0))
    if count < 1:
        raise UserError("--engine ray: the cluster has no free core; start nodes with at least one CPU")
    return count


def refused(error: Any) -> UserError:
    """What went wrong on a worker, in one line."""
    cause = error.cause
    return cause if isinstance(cause, UserError) else UserError(f"--engine ray: a worker failed: {first_line(cause)}")


def first_line(error: BaseException) -> str:
    """What an error says first."""
    return f"{type(error).__name__}: {error}".strip().partition("\n")[0][:300]
