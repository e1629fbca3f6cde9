"""A class: students submit gains or missions, never code; each is flown on this machine and ranked by a metric.

A submission is a stranger's text. It is read, checked and flown by a process of its own, with limits of time, memory and file
size, which runs no code of users and opens no file that the submission names. All that is kept of a student are two flights.
"""

import contextlib
import errno
import hmac
import math
import multiprocessing
import os
import queue
import resource
import secrets
import threading
import time
from dataclasses import dataclass
from functools import partial
from http import HTTPStatus
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Annotated, NamedTuple, cast

from pydantic import BeforeValidator, Field

from quadstep.engines.fly import fly
from quadstep.interfaces.closed_loop import Outcome
from quadstep.io import files
from quadstep.io.documents import parse_toml, read_toml
from quadstep.io.errors import UserError, cut
from quadstep.io.files import replace_file
from quadstep.io.results_folder import opened
from quadstep.io.user_code import refuse
from quadstep.metrics.requirements import Requirement, with_full_names
from quadstep.metrics.verdict import graded, scalars
from quadstep.mission.check import check
from quadstep.mission.fields import Positive, Section, as_tuple, dotted, key_parts, plain, with_value
from quadstep.mission.listings import commented, learning_numbers, net_lines, rounded, written
from quadstep.mission.own_controller import PilotedSection
from quadstep.mission.read import check_mission, read_mission
from quadstep.mission.schema import Mission
from quadstep.page.build import write_mission_page
from quadstep.page.folder import manifest, names_files
from quadstep.report.pool import end_with_parent, starting
from quadstep.report.publish import MANIFEST, write_json, write_log
from quadstep.studies.fly import metric_names
from quadstep.studies.lessons import nested_values
from quadstep.studies.tuning.gains import filled_in

SUBMISSION = files.FileKind("a submission", 64_000)
SECRET = files.FileKind("the secret of a class", 64)
SECRET_NAME, MISSION_NAME = ".class", "mission.toml"
LARGEST_FILE, MEMORY = 100_000_000, 4 << 30
"""What the process of a flight may write in a file, and its address space [bytes]."""

SLOWER = 10
"""How many times longer than it computes a flight may take where the machine does other things, too."""

LONGEST_SENTENCE = 400

Student = Annotated[str, Field(pattern=r"^[^\W_][\w .,'-]{0,59}$")]
"""A name, or that of a group; also of its folder."""


class ClassSection(Section):
    """A file of `serve --class`. mission: what all fly, a file beside this one. metric: of its flight, least is best. free:
    keys in which a submission may differ from it. seconds: of computing that a flight may take. pause: from one submission of
    a student to the next [s].
    """

    mission: str
    students: Annotated[tuple[Student, ...], BeforeValidator(as_tuple), Field(min_length=1, max_length=500)]
    metric: str = "position_rmse"
    free: Annotated[tuple[str, ...], BeforeValidator(as_tuple), Field(min_length=1)] = ("controller",)
    seconds: Annotated[Positive, Field(ge=1.0)] = 30.0
    pause: Positive = 20.0


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
    """What came of a submission. flown: whether there is a flight. value: of the metric, unless it was lost."""

    message: str
    flown: bool = False
    value: float | None = None


class Refusal(Exception):  # noqa: N818 (an answer, not an error)
    """A submission that is not taken: an HTTP status and a sentence."""

    def __init__(self, status: HTTPStatus, sentence: str) -> None:
        super().__init__(sentence)
        self.status = status


@dataclass
class Member:
    """A student. best, latest: numbers of flights that are kept, 0 for none. last: when the last submission came [s]. text: of
    that submission.
    """

    name: str
    folder: Path
    text: str = ""
    message: str = "Nothing of yours has been flown yet."
    value: float | None = None
    best: int = 0
    latest: int = 0
    waits: bool = False
    last: float = -math.inf

    def counts(self, number: int, value: float | None) -> None:
        """A flight becomes the latest, and perhaps the best."""
        self.latest = number
        if value is not None and (self.value is None or value < self.value):
            self.value, self.best = value, number

    def tidy(self) -> None:
        """Remove what is neither, as far as possible: the class goes on."""
        with contextlib.suppress(OSError, UserError), opened(self.folder) as folder:
            for one in numbered(self.folder):
                if one not in (self.best, self.latest):
                    folder.remove_tree(f"{one}")


def numbered(folder: Path) -> list[int]:
    """The numbers of a student's flights."""
    with contextlib.suppress(OSError):
        return sorted(int(one.name) for one in os.scandir(folder) if one.name.isdecimal())
    return []


class Room:
    """A class and its queue. Raises UserError for a class, a mission or a metric that cannot be flown."""

    def __init__(self, file: Path, root: Path) -> None:
        self.section = check(ClassSection, read_toml(file), str(file), file.parent)
        place = file.parent / self.section.mission
        self.mission, self.text = read_mission(place), files.read_text(place, files.TOML)
        metric = Requirement(self.section.metric, math.inf)
        (full,) = with_full_names([metric], metric_names(self.mission, self.mission.plan()))
        usual = cast("dict[str, object]", plain(self.mission.model_dump(mode="json")))
        self.ground = Ground(read_toml(place), usual, place.parent, self.section.free, full.metric)
        key = secret(root)
        self.members: dict[str, Member] = {}
        self.waiting: queue.Queue[tuple[Member, str]] = queue.Queue()
        self.lock = threading.Lock()
        for name in self.section.students:
            self.members[hmac.digest(key, name.encode(), "sha256").hex()[:32]] = self.restored(Member(name, root / name))

    def restored(self, member: Member) -> Member:
        """A student with the flights that an earlier run kept."""
        for number in numbered(member.folder):
            content = manifest(member.folder / f"{number}")
            if content:
                completed = content.get("outcome") == Outcome.COMPLETED.name.lower()
                member.counts(number, scalars(content).get(self.ground.metric) if completed else None)
                member.message = (
                    "The class was restarted: your flights were kept. What was still waiting has to be sent again."
                )
                with contextlib.suppress(UserError):
                    member.text = files.read_text(member.folder / f"{number}" / MISSION_NAME, SUBMISSION, links=False)
        return member

    def member(self, token: str) -> Member | None:
        given = token.encode("utf-8", "replace")
        return next((one for known, one in self.members.items() if hmac.compare_digest(given, known.encode())), None)

    def submit(self, member: Member, text: str) -> None:
        """Put what a student sends into the queue, unless it is too soon. Raises Refusal."""
        with self.lock:
            self.check_turn(member)
            member.waits, member.last, member.message, member.text = True, time.monotonic(), "Waiting to be flown.", text
            self.waiting.put((member, text))

    def check_turn(self, member: Member) -> None:
        """Refuses a submission that comes too soon. Raises Refusal."""
        left = member.last + self.section.pause - time.monotonic()
        if member.waits:
            raise Refusal(HTTPStatus.TOO_MANY_REQUESTS, "Your last submission has not been flown yet.")
        if left > 0.0:
            raise Refusal(HTTPStatus.TOO_MANY_REQUESTS, f"You can submit again in {math.ceil(left)} s.")

    def work(self) -> None:
        """Fly what is submitted, one after another, without end."""
        while True:
            self.fly_next()

    def fly_next(self) -> None:
        """Fly the next submission, once there is one."""
        member, text = self.waiting.get()
        member.message = "Being flown."
        number = 1 + max(numbered(member.folder), default=0)
        try:
            result = flown_apart(text, self.ground, member.folder / f"{number}", self.section.seconds)
        except (OSError, UserError) as error:
            result = SubmissionResult(f"This machine could not fly it: {error}")
        with self.lock:
            if result.flown:
                member.counts(number, result.value)
            member.tidy()
            member.message, member.waits = result.message, False

    def board(self) -> list[Member]:
        """Who has flown, the best first."""
        return sorted((one for one in self.members.values() if one.best), key=lambda one: (one.value, one.name))


def first_text(mission: Mission, free: tuple[str, ...]) -> str:
    """What a student begins with: the class's free gains, commented out, with values, units and meanings; "" without any."""
    values, law = filled_in(mission), mission.controller.controller
    lines = [
        commented(f"# {key} = {written(rounded(values[key]), gain.stands_for_three)}", gain.unit, gain.meaning)
        for key, (_, gain) in law.by_key().items()
        if is_free(f"controller.{key}", free)
    ]
    nets = mission.controller.table
    if nets and is_free("controller.nets", free):
        derived = learning_numbers(law, mission.controller.gains(mission.modelled.model()))
        lines += ["", "[controller.nets]", *(one for one in net_lines(nets, derived) if not one.startswith("# weights"))]
    return "\n".join(("[controller]", f'type = "{mission.controller.type}"', *lines, "")) if lines else ""


def is_free(key: str, free: tuple[str, ...]) -> bool:
    """Whether a submission may differ in a key."""
    return any(f"{key}.".startswith(f"{one}.") for one in free)


def secret(root: Path) -> bytes:
    """What the tokens of a class are made from; it stays in the folder, so that links stay valid. Raises UserError."""
    place = root / SECRET_NAME
    try:
        if not place.exists():
            replace_file(place, secrets.token_bytes(32), 0o600)
    except OSError as error:
        raise UserError(f"{place}: cannot be written: {error.strerror or error}") from None
    found = files.read_bytes(place, SECRET, links=False)
    if len(found) != 32:
        raise UserError(f"{place}: is not the secret of a class; remove it (all links will change)")
    return found


def no_value(_: object) -> bool:
    """No table counts as a value."""
    return False


def submitted(text: str, ground: Ground) -> Mission:
    """The class's mission with what a submission says; that may differ in free keys only. Raises UserError, also for files."""
    given = parse_toml(text, "your mission")
    content, leaves = ground.content, dotted(given, no_value)
    wanted = {**dotted(ground.usual, no_value), **dotted(content, no_value)}
    for key, value in leaves.items():
        if wanted.get(key) == value or key == "name":
            continue
        if not is_free(key, ground.free):
            raise UserError(f"{cut(key, 60)}: only {', '.join(ground.free)} may differ from the class's mission")
        if names_files({key.rpartition(".")[2]: value}):
            raise UserError(f"{cut(key, 60)}: names a file, which a class does not read")
    for key in ground.free:
        kind, own = (nested_values(table, [*key_parts(key), "type"]) for table in (given, ground.usual))
        if kind not in (None, own):  # of another type, nothing of the class's table is left
            content = with_value(content, key, {"type": kind}, ground.usual)
    for key, value in leaves.items():
        content = with_value(content, key, value, ground.usual)
    mission = check_mission(content, "your mission", ground.folder)
    if isinstance(mission.controller, PilotedSection):
        raise UserError("controller.type: a class cannot be flown by an autopilot")
    return mission


def fly_submission(text: str, ground: Ground, out: Path) -> SubmissionResult:
    """Fly a submission and write its flight into the new folder `out`. Raises UserError."""
    mission = submitted(text, ground)
    plan = mission.plan()
    log = fly(plan)
    metrics, warnings = mission.flight_metrics(log)
    out.mkdir(parents=True)
    (out / MISSION_NAME).write_text(text, encoding="utf-8")
    write_log(out / "flight.csv", log)
    write_mission_page(out / "page.html", mission, plan, log, ground.folder, (metrics, warnings))
    verdict = graded(metrics)
    about = {"name": mission.name, "warnings": [*plan.warnings, *warnings], **verdict.as_json()}
    write_json(out / MANIFEST, {**about, **metrics, "mission": mission.model_dump(mode="json")})
    if log.outcome is not Outcome.COMPLETED:
        return SubmissionResult(f"Your flight was lost at {log.ended:g} s.", True)
    said = verdict.sentence or "Your submission was flown to its end."
    return SubmissionResult(said, True, scalars(metrics).get(ground.metric))


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
        result = SubmissionResult(f"Your submission was not flown: {cut(str(error), LONGEST_SENTENCE)}")
    except MemoryError:
        result = SubmissionResult(f"Your submission was not flown: it takes more than {MEMORY >> 30} GB of memory.")
    except OSError as error:
        large = f"its files are larger than {LARGEST_FILE // 10**6} MB: log less often, or for a shorter time."
        said = large if error.errno == errno.EFBIG else f"this machine could not store its flight: {error.strerror or error}."
        result = SubmissionResult(f"Your submission was not flown: {said}")
    except Exception:  # whatever a stranger's text does ends here
        result = SubmissionResult("Your submission was not flown: it is not a mission that can be flown.")
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
    ended = SubmissionResult(f"Your submission was not flown: it takes more memory, or more than {seconds:g} s of computing.")
    try:
        return ours.recv() if ours.poll(SLOWER * seconds) else ended
    except EOFError:
        return ended
    finally:
        process.kill()
        process.join()
        ours.close()
