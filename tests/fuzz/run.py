"""Many cases on many processes, and one again."""

import shutil
import tempfile
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from random import Random
from typing import NamedTuple

from tests.fuzz.inputs import Campaigns, Missions, Recordings, Vehicles
from tests.fuzz.judge import Verdict, judge, limit_memory
from tests.fuzz.logs import Logs
from tests.fuzz.stored import Campaigned, Flights, Weights

KINDS = {
    kind.name: kind for kind in (Missions(), Campaigns(), Vehicles(), Recordings(), Flights(), Weights(), Campaigned(), Logs())
}
SHARES = {
    "missions": 0.32, "campaigns": 0.15, "vehicles": 0.13, "recordings": 0.16, "flights": 0.06, "weights": 0.06,
    "campaign results": 0.04, "logs": 0.08,
}  # fmt: skip
"""Of all cases."""

A_TASK = 250
"""Cases that a process tries at a time."""


class Failure(NamedTuple):
    """A case that did not end as it must."""

    kind: str
    number: int
    said: str


class Found(NamedTuple):
    """Of one kind: how many cases ended in which way, and those that failed. seconds: of a processor; longest: of one case."""

    kind: str
    outcomes: Counter[str]
    failures: list[Failure]
    seconds: float
    longest: float


def one(kind: str, number: int, folder: Path, prepare: bool = True) -> Verdict:
    """Case `number` of a kind, in a folder of its own."""
    case = KINDS[kind]
    if prepare:
        case.prepare(folder)
    case.spoil(folder, Random(f"{kind} {number}"))
    return judge(lambda: case.use(folder), case.named(folder))


def some(kind: str, first: int, past: int) -> Found:
    """Cases of a kind, one after the other."""
    folder = Path(tempfile.mkdtemp(prefix="fuzz-"))
    began, longest = time.process_time(), 0.0
    outcomes: Counter[str] = Counter()
    failures = []
    try:
        for number in range(first, past):
            start = time.process_time()
            verdict = one(kind, number, folder, prepare=number == first)
            longest = max(longest, time.process_time() - start if number > first else 0.0)
            outcomes[verdict.outcome] += 1
            if verdict.outcome == "failed":
                failures.append(Failure(kind, number, verdict.said))
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return Found(kind, outcomes, failures, time.process_time() - began, longest)


def many(cases: int, processes: int = 2) -> list[Found]:
    """So many cases of all kinds together, by their shares; case n of a kind is always the same."""
    spans = [
        (kind, first, min(first + A_TASK, round(share * cases)))
        for kind, share in SHARES.items()
        for first in range(0, round(share * cases), A_TASK)
    ]
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn"), initializer=limit_memory) as pool:
        found = list(pool.map(some, *zip(*spans, strict=True)))
    return [together([one for one in found if one.kind == kind]) for kind in SHARES]


def together(found: list[Found]) -> Found:
    """Those of one kind."""
    return Found(
        found[0].kind,
        sum((one.outcomes for one in found), Counter()),
        [failure for one in found for failure in one.failures],
        sum(one.seconds for one in found),
        max(one.longest for one in found),
    )
