"""What a search for a contradiction is, and running several within a budget of time."""

import importlib
import pkgutil
import time
import traceback
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from multiprocessing import get_context
from typing import NamedTuple

import numpy as np
from scipy.stats import binom

import tests.challenge

LOOSE = 0.9
"""A bound that no attempt reaches to this share is loose: news, not a failure."""


class Attempt(NamedTuple):
    """One attempt at a verdict.

    reached: how close it came, as a share of what the verdict allows; above 1, or not a number, it contradicts the verdict.
        Where a verdict is right or wrong and nothing between, 0 or 2.
    case: what the attempt was, so that somebody can repeat it.
    """

    reached: float
    case: str

    @property
    def contradicts(self) -> bool:
        return not self.reached <= 1.0


class Search(NamedTuple):
    """A search for what contradicts one verdict.

    verdict: the promise that is attacked, as a sentence.
    attempts: from a seed, one attempt after another; the same ones for the same seed. It may go on for ever.
    bound: whether the verdict is a bound, so that attempts that stay far below it are news.
    slow: whether its first attempt takes ten seconds or more; such ones begin, so that the others share what time is left.
    """

    name: str
    verdict: str
    attempts: Callable[[int], Iterable[Attempt]]
    bound: bool = False
    slow: bool = False


class Outcome(NamedTuple):
    """The result of a search. nearest: the attempt that came closest; error: a traceback, if the search itself failed."""

    name: str
    tried: int
    nearest: Attempt | None
    seconds: float
    error: str = ""

    @property
    def failed(self) -> bool:
        return bool(self.error) or not self.tried or (self.nearest is not None and self.nearest.contradicts)


def modules() -> list[str]:
    """Those that have searches."""
    names = (info.name for info in pkgutil.iter_modules(tests.challenge.__path__) if info.name not in ("search", "__main__"))
    return [f"tests.challenge.{name}" for name in sorted(names)]


def searches() -> dict[str, Search]:
    """All searches by name."""
    every = [each for name in modules() for each in importlib.import_module(name).SEARCHES]
    found = {each.name: each for each in sorted(every, key=lambda one: not one.slow)}
    if len(found) < len(every):
        raise ValueError("two searches have the same name")
    return found


def closer(one: Attempt | None, other: Attempt) -> Attempt:
    """The attempt that came closer to a contradiction."""
    if one is None or (other.contradicts and not one.contradicts):
        return other
    return other if other.reached > one.reached else one


def attempted(search: Search, seed: int, seconds: float) -> Outcome:
    """Attempts until the time is up, the first contradiction, or the end of the search; at least one is made."""
    began, tried, nearest, error = time.perf_counter(), 0, None, ""
    try:
        for attempt in search.attempts(seed):
            tried, nearest = tried + 1, closer(nearest, attempt)
            if attempt.contradicts or time.perf_counter() - began > seconds:
                break
    except Exception:
        error = traceback.format_exc()
    return Outcome(search.name, tried, nearest, time.perf_counter() - began, error)


def attempted_by_name(name: str, seed: int, seconds: float) -> Outcome:
    """As `attempted`, in another process."""
    return attempted(searches()[name], seed, seconds)


def share(left: float, processes: int, waiting: int) -> float:
    """The seconds of the first of so many searches that wait, where so many seconds are left to all."""
    return max(0.0, left) * min(processes, waiting) / waiting


def challenge(names: list[str], seed: int, seconds: float, processes: int) -> Iterator[Outcome]:
    """Outcomes in the order in which they come. Each search has a process of its own, so that it finds by itself what it finds
    here; it is forked from one that has loaded all searches. What one search leaves of its time, or takes more for its first
    attempt, is shared by those after it.
    """
    context = get_context("forkserver")
    context.set_forkserver_preload(modules())
    ends, waiting, running = time.perf_counter() + seconds, names[::-1], set()
    with ProcessPoolExecutor(processes, mp_context=context, max_tasks_per_child=1) as pool:
        while waiting or running:
            while waiting and len(running) < processes:
                mine = share(ends - time.perf_counter(), processes, len(waiting))
                running.add(pool.submit(attempted_by_name, waiting.pop(), seed, mine))
            done, running = wait(running, return_when=FIRST_COMPLETED)
            yield from (one.result() for one in done)


def coverage(held: Iterable[bool], level: float = 0.95, batch: int = 200) -> Iterator[Attempt]:
    """Attempts at an interval: after each batch, misses as a share of the most that chance allows once in a million."""
    trials = misses = 0
    for each in held:
        trials, misses = trials + 1, misses + (not each)
        if trials % batch == 0:
            most = float(binom.ppf(1.0 - 1e-6, trials, 1.0 - level))
            yield Attempt(misses / most, f"{misses} of {trials} intervals miss, {most:.0f} allowed at {100 * level:g} %")


def covers(
    held: Callable[[np.random.Generator], Iterator[bool]], level: float = 0.95, batch: int = 200
) -> Callable[[int], Iterator[Attempt]]:
    """The attempts at an interval. held: of one random case after another, whether its interval holds the truth."""
    return lambda seed: coverage(held(np.random.default_rng(seed)), level, batch)
