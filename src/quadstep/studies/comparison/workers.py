"""Who works a study out: processes on all cores of this machine, or the nodes of a Ray cluster."""

import os
import pickle
import platform
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, wait
from itertools import islice

from quadstep.engines.engine import JOBS, Engine, loaded
from quadstep.report.pool import drawing_pool
from quadstep.studies.campaign.cluster import AHEAD, LOSSES, fetched, finished_tasks, needs, refuse_others
from quadstep.studies.campaign.cluster_connection import connected, cores
from quadstep.studies.comparison.jobs import Job, Worked, worked

LOOK = 0.5
"""Seconds from one look at what is being worked on to the next."""

Look = Callable[[], None]


def work(jobs: Sequence[Job[object]], engine: Engine, look: Look) -> Iterator[tuple[Job[object], Worked]]:
    """Jobs as they are done, in any order. look: called while others go on. Raises UserError where there is no cluster."""
    if not jobs:
        return iter(())
    done: Iterator[tuple[Job[object], Worked]] = loaded(JOBS, engine)(jobs, look)
    return done


def alone(jobs: Sequence[Job[object]]) -> Iterator[tuple[Job[object], Worked]]:
    """One after the other in this process, so that what is measured has the machine for itself."""
    return ((job, worked(job)) for job in jobs)


def on_cores(jobs: Sequence[Job[object]], look: Look) -> Iterator[tuple[Job[object], Worked]]:
    """On this machine. Those that take longest come first, so that all cores end together."""
    count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    with drawing_pool(min(count, len(jobs))) as pool:
        going = {pool.submit(worked, job): job for job in sorted(jobs, key=lambda job: -job.flights)}
        while going:
            done, _ = wait(going, LOOK, FIRST_COMPLETED)
            look()
            for future in done:
                yield going.pop(future), future.result()


def on_cluster(jobs: Sequence[Job[object]], _look: Look) -> Iterator[tuple[Job[object], Worked]]:
    """On a cluster: a task a job."""
    with connected() as ray:

        def quadstep_job(told: Sequence[tuple[str, str]], packed: bytes) -> tuple[bytes, str, str]:
            # Ray sends a function within another as it stands, so that even a worker without quadstep can say so.
            from quadstep.studies.comparison.workers import on_worker  # noqa: PLC0415 (on the worker)

            return on_worker(told, packed)

        task = ray.remote(num_cpus=1, max_retries=LOSSES)(quadstep_job)
        waiting = iter(jobs)
        going: dict[object, Job[object]] = {}
        while True:
            room = max(0, AHEAD * max(1, cores(ray)) - len(going))
            for job in islice(waiting, room):
                going[task.remote(needs(), pickle.dumps(job))] = job
            if not going:
                return
            for reference in finished_tasks(ray, list(going)):
                found = fetched(ray, reference, f"the flights of {going[reference].label}")
                yield going.pop(reference), Worked(*found)


def on_worker(told: Sequence[tuple[str, str]], packed: bytes) -> tuple[bytes, str, str]:
    """A job, on a node that has all it needs. Raises UserError."""
    refuse_others(f"--engine ray: node {platform.node()}", told)
    job: Job[object] = pickle.loads(packed)
    content, wrong, price = worked(job)
    return content, wrong, price
