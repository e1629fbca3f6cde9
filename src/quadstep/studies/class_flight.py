"""What a class does with one submission, a stranger's text: it is read, checked and flown by a process of its own, with limits
of time, memory and file size, which runs no code of users and opens no file that the submission names.
"""

import contextlib
import errno
import math
import multiprocessing
import resource
import threading
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from typing import NamedTuple

from quadstep.engines.fly import fly
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.log import REASONS
from quadstep.io.documents import parse_toml
from quadstep.io.errors import UserError, cut
from quadstep.io.user_code import refuse
from quadstep.linear.grade import FRAGILE, quick_grade
from quadstep.metrics.registry import SOUND, at_rest_sentences, rest_of
from quadstep.metrics.verdict import FlightGrade, graded, scalars
from quadstep.mission.fields import dotted, key_parts, with_value
from quadstep.mission.own_controller import PilotedSection
from quadstep.mission.read import check_mission
from quadstep.mission.schema import Mission
from quadstep.page.build import write_mission_page
from quadstep.page.folder import names_files
from quadstep.report.pool import end_with_parent, starting
from quadstep.report.publish import MANIFEST, write_json, write_log
from quadstep.studies.lessons import nested_values

MISSION_NAME, LOG_NAME, PAGE_NAME = "mission.toml", "flight.csv", "page.html"
LARGEST_FILE, MEMORY = 100_000_000, 4 << 30
"""What the process of a flight may write in a file, and its address space [bytes]."""

SLOWER = 10
"""How many times longer than it computes a flight may take where the machine does other things, too."""

LONGEST_SENTENCE = 400
NO_MISSION = "it is not a mission that can be flown."
SOURCE = "your mission"
"""What an error calls a submission."""


class Ground(NamedTuple):
    """What every submission is held against. content, usual: the class's mission as it is written, and with all keys. folder:
    where it is. free: keys that may differ. metric: its full name.
    """

    content: dict[str, object]
    usual: dict[str, object]
    folder: Path
    free: tuple[str, ...]
    metric: str


class SubmissionResult(NamedTuple):
    """grade: of the flight; empty where there is none. numbers: its metrics by dotted name. rest: `rest_of` these."""

    message: str
    grade: str = ""
    numbers: dict[str, float] = {}  # noqa: RUF012 (never changed)
    rest: dict[str, str] = {}  # noqa: RUF012


RANKED = {"": "", FRAGILE: " with a stable loop", SOUND: " with a sound loop"}
"""What a class may ask of a loop at rest, by the value of `loop` in its file, in words."""


def may_rank(grade: str, rest: dict[str, str], loop: str) -> bool:
    """Whether a flight is as commanded (one that tumbled may have a small error, too), with a loop that the class asks for."""
    enough = [FRAGILE, SOUND] if loop == FRAGILE else [loop]
    return grade == FlightGrade.AS_COMMANDED and (not loop or rest.get("grade") in enough)


def is_free(key: str, free: tuple[str, ...]) -> bool:
    """Whether a submission may differ in a key."""
    return any(f"{key}.".startswith(f"{one}.") for one in free)


def submitted(text: str, ground: Ground) -> Mission:
    """The class's mission with what a submission says; that may differ in free keys only. Raises UserError, also for files."""
    given = parse_toml(text, SOURCE)
    content, leaves = ground.content, dotted(given)
    wanted = {**dotted(ground.usual), **dotted(content)}
    for key, value in leaves.items():
        if wanted.get(key) == value or key == "name":
            continue
        known = key_parts(key)[0] in ground.usual  # of what no mission has, its check below says what was meant
        if known and not is_free(key, ground.free):
            raise UserError(f"{cut(key, 60)}: only {', '.join(ground.free)} may differ from the class's mission")
        if names_files({key.rpartition(".")[2]: value}):
            raise UserError(f"{cut(key, 60)}: names a file, which a class does not read")
    for key in ground.free:
        kind, own = (nested_values(table, [*key_parts(key), "type"]) for table in (given, ground.usual))
        if kind not in (None, own):  # of another type, nothing of the class's table is left
            content = with_value(content, key, {"type": kind}, ground.usual)
    for key, value in leaves.items():
        content = with_value(content, key, value, ground.usual)
    mission = check_mission(content, SOURCE, ground.folder)
    if isinstance(mission.controller, PilotedSection):
        raise UserError("controller.type: a class cannot be flown by an autopilot")
    return mission


TILTED = "it tilted to"
"""How the reason of a flight that overturned begins (metrics/verdict.py)."""


def fly_submission(text: str, ground: Ground, out: Path) -> SubmissionResult:
    """Fly a submission and write its flight into the new folder `out`. Raises UserError."""
    mission = submitted(text, ground)
    log = fly(plan := mission.plan())
    metrics, warnings = mission.flight_metrics(log, quick_grade)
    out.mkdir(parents=True)
    (out / MISSION_NAME).write_text(text, encoding="utf-8")
    write_log(out / LOG_NAME, log)
    write_mission_page(out / PAGE_NAME, mission, plan, log, ground.folder, (metrics, warnings))
    verdict = graded(metrics)
    about = {"name": mission.name, "warnings": [*plan.warnings, *warnings], **verdict.as_json()}
    write_json(out / MANIFEST, {**about, **metrics, "mission": mission.model_dump(mode="json")})
    lost = f"Lost at {log.ended:g} s: {REASONS[log.outcome]}." if log.outcome is not Outcome.COMPLETED else ""
    numbers = {key: float(value) for key, value in scalars(metrics).items() if value is not None and math.isfinite(value)}
    reasons = sorted(verdict.reasons, key=lambda one: not one.startswith(TILTED))[:2]  # a tumble first
    but = " and ".join(reasons).replace(TILTED, "it tumbled, tilting to")
    told = lost or f"Flown to its end, {f'but {but}' if but else 'as commanded'}."
    rest = dict(rest_of(metrics))
    return SubmissionResult(" ".join([told, *at_rest_sentences(rest)]), verdict.grade, numbers, rest)


def reason_of(error: UserError) -> str:
    """Why a submission is none, as its student is told."""
    return cut("; ".join(line.removeprefix(f"{SOURCE}: ") for line in error.lines), LONGEST_SENTENCE)


def in_a_process(fly_it: "partial[SubmissionResult]", seconds: float, theirs: Connection) -> None:
    """What the process of a flight does: limits itself, flies, and sends a result."""
    threading.Thread(target=end_with_parent, daemon=True).start()
    limits = {"CPU": math.ceil(seconds), "FSIZE": LARGEST_FILE, "AS": MEMORY, "CORE": 0}
    for name, most in limits.items():
        with contextlib.suppress(ValueError, OSError):  # a system that has a lower one, or none
            resource.setrlimit(getattr(resource, f"RLIMIT_{name}"), (most, most))
    refuse("a class accepts gains and missions, never code")
    try:
        result = fly_it()
    except UserError as error:
        result = SubmissionResult(f"Not flown: {reason_of(error)}")
    except MemoryError:
        result = SubmissionResult(f"Not flown: it takes more than {MEMORY >> 30} GB of memory.")
    except OSError as error:
        large = f"its files are larger than {LARGEST_FILE // 10**6} MB: log less often, or for a shorter time."
        said = large if error.errno == errno.EFBIG else f"this machine could not store its flight: {error.strerror or error}."
        result = SubmissionResult(f"Not flown: {said}")
    except Exception:  # whatever a stranger's text does ends here
        result = SubmissionResult(f"Not flown: {NO_MISSION}")
    theirs.send(result)


def flown_apart(text: str, ground: Ground, out: Path, seconds: float) -> SubmissionResult:
    """What a process of its own makes of a submission; it ends when its time is over. Raises OSError if none starts."""
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(
        target=in_a_process, args=(partial(fly_submission, text, ground, out), seconds, theirs), daemon=True
    )
    with starting():
        process.start()
    theirs.close()
    ended = SubmissionResult(f"Not flown: it takes more memory, or more than {seconds:g} s of computing.")
    try:
        return ours.recv() if ours.poll(SLOWER * seconds) else ended
    except EOFError:
        return ended
    finally:
        process.kill()
        process.join()
        ours.close()
