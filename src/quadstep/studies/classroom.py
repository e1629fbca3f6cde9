"""A class: students submit gains or missions, never code; each is flown on this machine and ranked by a metric.

Of every student are kept the results of the submissions (`ATTEMPTS`), and two flights: the best and the latest.
"""

import contextlib
import hmac
import math
import os
import queue
import secrets
import threading
import time
import unicodedata
from dataclasses import dataclass, field
from functools import cached_property
from http import HTTPStatus
from pathlib import Path
from typing import Annotated, NamedTuple, cast

from pydantic import AfterValidator, Field, TypeAdapter

from quadstep.control.registry import names
from quadstep.io import files
from quadstep.io.documents import read_json, read_toml
from quadstep.io.errors import UserError, unknown_name
from quadstep.io.files import replace_file
from quadstep.io.results_folder import opened
from quadstep.metrics.requirements import Requirement, with_full_names
from quadstep.metrics.verdict import FlightGrade
from quadstep.mission.check import check
from quadstep.mission.fields import Positive, Section, Several, key_parts, plain
from quadstep.mission.read import CLASS, read_mission, refuse_others
from quadstep.mission.schema import Mission
from quadstep.page.sharing import Access
from quadstep.report.publish import as_text
from quadstep.studies.class_flight import (
    NO_MISSION,
    Ground,
    SubmissionResult,
    flown_apart,
    is_free,
    may_rank,
    reason_of,
    submitted,
)
from quadstep.studies.fly import metric_names

SUBMISSION = files.FileKind("a submission", 64_000)
SECRET = files.FileKind("the secret of a class", 64)
SECRET_NAME, ATTEMPTS, DRAFT, OWN = ".class", "attempts.json", ".flying", ".own"
MOST_ATTEMPTS = 100
"""Of a student that are kept, and the best one."""

MOST_LINES = 300
"""Of a submission that is checked before it waits: a longer one takes time, and is checked by the process of its flight."""


def check_student(name: str) -> str:
    """Refuses what is no name. Raises ValueError."""
    known = all(sign.isalnum() or sign in " .,'-_" or unicodedata.category(sign).startswith("M") for sign in name)
    if not (known and name[:1].isalnum() and len(name) <= 60):
        allowed = "at most 60 letters, digits, spaces and .,'-_, the first a letter or a digit"
        raise ValueError(f"should be a name: {allowed}")
    return name


Student = Annotated[str, AfterValidator(check_student)]
"""A name, or that of a group; also of its folder."""


class ClassSection(Section):
    """A file of `serve --class`. mission: what all fly, a file beside this one. metric: of its flight, least is best. free:
    keys in which a submission may differ from it. loop: the least grade at rest of a flight that is ranked. seconds: of
    computing that a flight may take. pause: from one submission of a student to the next [s].
    """

    mission: str
    students: Annotated[Several[Student], Field(min_length=1, max_length=500)]
    metric: str = "position_rmse"
    free: Annotated[Several[str], Field(min_length=1)] = ("controller",)
    loop: Annotated[str, Field(pattern="^(sound|fragile)?$")] = ""
    seconds: Annotated[Positive, Field(ge=1.0)] = 30.0
    pause: Positive = 20.0


class Refusal(Exception):  # noqa: N818 (an answer, not an error)
    """A submission that is not taken: an HTTP status and a sentence."""

    def __init__(self, status: HTTPStatus, sentence: str) -> None:
        super().__init__(sentence)
        self.status = status


class Attempt(NamedTuple):
    """A submission that was flown or refused. at: when [s since 1970]. said: what the student was told. grade, numbers, rest:
    as of a `SubmissionResult`.
    """

    number: int
    at: float
    text: str
    said: str
    grade: str
    numbers: dict[str, float]
    rest: dict[str, str] = {}  # noqa: RUF012 (never changed)


@dataclass
class Member:
    """A student. metric, loop: by which attempts are ranked. last: when the last submission came [s]. text: of that one."""

    name: str
    folder: Path
    metric: str
    loop: str
    attempts: list[Attempt] = field(default_factory=list)
    text: str = ""
    message: str = "Nothing of yours has been flown yet."
    waits: bool = False
    last: float = -math.inf

    def value_of(self, attempt: Attempt) -> float | None:
        """Of the metric; a lost flight has none."""
        return None if attempt.grade == FlightGrade.LOST else attempt.numbers.get(self.metric)

    @property
    def best(self) -> Attempt | None:
        """One that may be ranked, if there is any: of these, or else of all, the one with the least value."""
        flown = [one for one in self.attempts if self.value_of(one) is not None]
        return min(
            flown, key=lambda one: (not may_rank(one.grade, one.rest, self.loop), self.value_of(one), one.number), default=None
        )

    @property
    def ranked(self) -> bool:
        return self.best is not None and may_rank(self.best.grade, self.best.rest, self.loop)

    @property
    def value(self) -> float | None:
        return self.value_of(self.best) if self.best else None

    @property
    def latest(self) -> Attempt | None:
        """The latest that has a flight."""
        return next((one for one in reversed(self.attempts) if one.grade), None)

    def counts(self, text: str, result: SubmissionResult, flight: Path | None = None) -> None:
        """Add an attempt, and write all of them down. flight: its draft, to be renamed. Raises OSError."""
        number = 1 + max([0, *numbered(self.folder), *(one.number for one in self.attempts)])
        if flight:
            with opened(self.folder) as folder:
                folder.move(flight.name, f"{number}")
        self.attempts.append(Attempt(number, time.time(), text, *result))
        self.attempts = [one for one in self.attempts[:-MOST_ATTEMPTS] if one is self.best] + self.attempts[-MOST_ATTEMPTS:]
        self.folder.mkdir(parents=True, exist_ok=True)
        replace_file(self.folder / ATTEMPTS, as_text([one._asdict() for one in self.attempts]))

    def tidy(self) -> None:
        """Remove the flights that are neither best nor latest, as far as possible: the class goes on."""
        kept = {one.number for one in (self.best, self.latest) if one}
        with contextlib.suppress(OSError, UserError), opened(self.folder) as folder:
            for number in numbered(self.folder):
                if number not in kept:
                    folder.remove_tree(f"{number}")


def cleared(place: Path) -> None:
    """Remove a flight, as far as possible."""
    with contextlib.suppress(OSError, UserError), opened(place.parent) as folder:
        folder.remove_tree(place.name)


def numbered(folder: Path) -> list[int]:
    """The numbers of a student's flights."""
    with contextlib.suppress(OSError):
        return sorted(int(one.name) for one in os.scandir(folder) if one.name.isdecimal())
    return []


class Room:
    """A class and its queue. Raises UserError for a class, a mission or a metric that cannot be flown."""

    def __init__(self, file: Path, root: Path) -> None:
        content = read_toml(file)
        refuse_others(content, CLASS, str(file))
        self.section = check(ClassSection, content, str(file), file.parent)
        check_names(file, self.section.students)
        place = file.parent / self.section.mission
        self.mission, self.text = read_mission(place), files.read_text(place, files.TOML)
        metric = Requirement(self.section.metric, math.inf)
        try:
            (full,) = with_full_names([metric], metric_names(self.mission, self.mission.plan()))
        except UserError as error:
            raise UserError(f"{file}: {str(error).replace('--require', 'metric', 1)}") from None
        usual = cast("dict[str, object]", plain(self.mission.model_dump(mode="json")))
        for free in self.section.free:
            if key_parts(free)[0] not in usual:
                raise UserError(f"{file}: free: {unknown_name('key', free, usual)}")
        self.ground = Ground(read_toml(place), usual, place.parent, self.section.free, full.metric)
        key, self.own, self.own_folder = secret(root), SubmissionResult(""), root / OWN
        self.teacher = token(key, "\0teacher")
        self.members: dict[str, Member] = {}
        self.waiting: queue.Queue[tuple[Member, str]] = queue.Queue()
        self.lock = threading.Lock()
        for name in self.section.students:
            self.members[token(key, name)] = restored(Member(name, root / name, full.metric, self.section.loop))

    @cached_property
    def laws(self) -> dict[str, Mission]:
        """The controllers that may be submitted, the class's own first, by name: its mission with the defaults of each."""
        found = {self.mission.controller.type: self.mission}
        for name in names(self.mission.measures) if is_free("controller.type", self.ground.free) else ():
            with contextlib.suppress(UserError, ValueError):  # one that this vehicle cannot fly
                found.setdefault(name, submitted(f'[controller]\ntype = "{name}"\n', self.ground))
        return found

    def member(self, given: str) -> Member | None:
        return next((one for known, one in self.members.items() if Access(token=known).opens(given)), None)

    def submit(self, member: Member, text: str) -> None:
        """Put what a student sends into the queue, unless it is too soon or no mission. Raises Refusal."""
        with self.lock:
            self.check_turn(member)
        if text.count("\n") < MOST_LINES:
            try:
                submitted(text, self.ground)
            except UserError as error:
                raise Refusal(HTTPStatus.UNPROCESSABLE_ENTITY, reason_of(error)) from None
            except Exception:  # whatever a stranger's text does ends here
                raise Refusal(HTTPStatus.UNPROCESSABLE_ENTITY, NO_MISSION) from None
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
        """Fly the class's own mission; then what is submitted, one after another, without end."""
        self.fly_own()
        while True:
            self.fly_next()

    def fly_own(self) -> None:
        """Fly the class's mission as it is, whose number is to be beaten."""
        cleared(self.own_folder)
        with contextlib.suppress(OSError, UserError):
            self.own = flown_apart("", self.ground, self.own_folder, self.section.seconds)

    def fly_next(self) -> None:
        """Fly the next submission, once there is one: beside its place, so that no part of a flight is ever there."""
        member, text = self.waiting.get()
        member.message, draft = "Being flown.", member.folder / DRAFT
        try:
            cleared(draft)
            result = flown_apart(text, self.ground, draft, self.section.seconds)
            with self.lock:
                member.counts(text, result, draft if result.grade else None)
        except (OSError, UserError) as error:
            result = SubmissionResult(f"This machine could not fly it: {error}")
        with self.lock:
            member.tidy()
            member.message, member.waits = result.message, False
        cleared(draft)

    def board(self) -> list[Member]:
        """Who has a flight that is ranked, the best first."""
        return sorted((one for one in self.members.values() if one.ranked), key=lambda one: (one.value, one.name))


def restored(member: Member) -> Member:
    """A student with the attempts that an earlier run wrote down. Raises UserError for a record that cannot be read."""
    cleared(member.folder / DRAFT)
    place = member.folder / ATTEMPTS
    if files.is_file(place):
        try:
            member.attempts = TypeAdapter(list[Attempt]).validate_python(read_json(place, links=False))
        except ValueError:
            raise UserError(
                f"{place}: is not the record of a student's attempts; move it away, and the student has none"
            ) from None
    if member.attempts:
        member.text = member.attempts[-1].text
        member.message = "The class was restarted: your attempts were kept. Please resend anything still waiting."
    return member


def check_names(file: Path, students: tuple[str, ...]) -> None:
    """Refuses names that readers cannot tell apart. Raises UserError."""
    seen: dict[str, str] = {}
    for name in students:
        alike = seen.setdefault(" ".join(unicodedata.normalize("NFKC", name).casefold().split()), name)
        if alike is not name:
            raise UserError(f"{file}: students: {alike!r} and {name!r} are the same name to a reader; make them differ")


def token(key: bytes, name: str) -> str:
    """What a link says of who has it: 128 bits."""
    return hmac.digest(key, name.encode(), "sha256").hex()[:32]


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
