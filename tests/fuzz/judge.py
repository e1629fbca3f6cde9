"""The verdict on one case: accepted, refused with one clean line, or a failure."""

import resource
import signal
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import NamedTuple

from quadstep.io.errors import LONGEST, UserError

SECONDS = 60
"""A case may take; it is long, as the machine may be busy."""

MEMORY = 3 << 30
"""Bytes a process may take beyond what it has at first."""


class Verdict(NamedTuple):
    """outcome: "accepted", "refused" or "failed". said: the line, or what went wrong."""

    outcome: str
    said: str = ""


class Endless(BaseException):
    """A case that took too long."""


def limit_memory() -> None:
    """Let this process fail where it takes too much."""
    size = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * resource.getpagesize()
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (size + MEMORY, hard))


def judge(case: Callable[[], object], named: str) -> Verdict:
    """Run a case. named: what a refusal has to name."""

    def stop(_number: int, _frame: FrameType | None) -> None:
        raise Endless

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, SECONDS)
    try:
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            case()
        return Verdict("failed", f"a warning: {told[0].message}") if told else Verdict("accepted")
    except UserError as error:
        return clean(str(error), named)
    except Endless:
        return Verdict("failed", f"more than {SECONDS} s")
    except Exception:
        return Verdict("failed", traceback.format_exc(limit=-4))
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def clean(line: str, named: str) -> Verdict:
    """Whether a refusal is one line that prints, is short, and says which file is meant."""
    for wrong, what in (
        (not line.isprintable(), "does not print, or not in one line"),
        (len(line) > LONGEST, "is too long"),
        (named not in line, "does not name the file"),
        ("Error(" in line or "Traceback" in line, "shows the inside"),
    ):
        if wrong:
            return Verdict("failed", f"the line {what}: {line!a:.300}")
    return Verdict("refused", line)
