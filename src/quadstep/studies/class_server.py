"""`quadstep serve --class`: the board of a class, and what its students send.

A token is in the link that the teacher gives out. Whoever has none sees nothing; a student sees the board, the class's mission
and the own attempts; the teacher sees everybody's. No request names a file: a flight is asked for by its student's place in
the class and by its number.
"""

import contextlib
import csv
import io
import re
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable
from http import HTTPStatus
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

from quadstep.io import files
from quadstep.io.errors import UserError
from quadstep.page.answers import KINDS, LISTED, THEIRS, Answer, stamp
from quadstep.page.serve import Handler, Server, bound_server
from quadstep.page.sharing import Access
from quadstep.studies.class_flight import LOG_NAME, MISSION_NAME, PAGE_NAME
from quadstep.studies.class_pages import FIELD, Asked, laws_page, live, place, student_page, teacher_page
from quadstep.studies.classroom import SUBMISSION, Attempt, Member, Refusal, Room

MOST_AT_ONCE = 32
"""Requests of one address that are answered at the same time: a class may be behind one."""

BUSY = (
    b"HTTP/1.0 503 Service Unavailable\r\nContent-Type: text/plain; charset=utf-8\r\nRetry-After: 3\r\n\r\n"
    b"Too many requests at once from your address: reload the page in a moment.\n"
)
"""What further ones are told, whatever they ask."""

ENCODED = 3
"""How much longer a form is than its text, at most."""

FLIGHT = re.compile(rf"/(mine|[0-9]{{1,3}})/([0-9]{{1,9}})/({MISSION_NAME}|{PAGE_NAME}|{LOG_NAME})")
"""Where a flight's files are: whose, of which attempt, and which file."""


class ClassHandler(Handler):
    room: Room
    timeout = 10
    open: Counter[str]
    counting: threading.Lock

    def handle(self) -> None:
        """Few requests of one address at once, so that none can keep the others out."""
        address = str(self.client_address[0])
        with self.counting:
            full = self.open[address] >= MOST_AT_ONCE
            self.open[address] += 1
        try:
            if full:
                with contextlib.suppress(OSError):
                    self.wfile.write(BUSY)
            else:
                super().handle()
        finally:
            with self.counting:
                self.open[address] -= 1
                if not self.open[address]:
                    del self.open[address]

    def do_POST(self) -> None:  # noqa: N802 (the library's name)
        self.reply(self.answer())

    def answer(self) -> Answer:
        wrong = None if self.access.shared else self.misdirected()
        teacher = Access(token=self.room.teacher)
        token = wrong or self.token(lambda given: self.room.member(given) is not None or teacher.opens(given))
        if isinstance(token, Answer):
            return token
        member = self.room.member(token)
        if self.command == "POST":
            return self.submitted(member) if member else refused(HTTPStatus.FORBIDDEN, "The teacher submits nothing.")
        path = self.path.partition("?")[0]
        shared = {  # the first is what browsers ask for of themselves
            "/favicon.ico": lambda: Answer(HTTPStatus.NO_CONTENT, KINDS[".txt"]),
            "/mission.toml": lambda: Answer(HTTPStatus.OK, KINDS[".toml"], self.room.text),
            "/live": lambda: self.page(live(self.room, member, parse_qs(urlsplit(self.path).query).get("unfolded", ()))),
            "/try": lambda: file_answer(self.room.own_folder / PAGE_NAME),
            "/path.svg": lambda: self.path_picture(member),
        }
        if path in shared:
            return shared[path]()
        if found := FLIGHT.fullmatch(path):
            return self.flight(member, *found.groups())
        return self.shown(member, path) if member else self.of_teacher(path)

    def submitted(self, member: Member) -> Answer:
        text = ""
        try:
            text = self.sent()
            self.room.submit(member, text)
        except Refusal as refusal:
            if "text/html" in self.headers.get("Accept", ""):
                return self.page(student_page(self.room, member, Asked(refusal, text)), refusal.status)
            return refused(refusal.status, str(refusal))
        return Answer(HTTPStatus.SEE_OTHER, KINDS[".txt"], "It will be flown.\n", headers={"Location": "/"})

    def shown(self, member: Member, path: str) -> Answer:
        """The answer to what a student asks to see."""
        if path in ("/", "/submit"):  # where a reader is whose submission was refused
            query = parse_qs(urlsplit(self.path).query)
            again, law = (query.get(key, [""])[0] for key in ("again", "law"))
            return self.page(student_page(self.room, member, Asked(again=again, law=law)))
        if path == "/laws":
            return self.page(laws_page(self.room))
        if path == "/mine" and member.latest:
            return self.flight(member, "mine", f"{member.latest.number}", PAGE_NAME)
        return NOTHING

    def of_teacher(self, path: str) -> Answer:
        """The answer to what the teacher asks to see."""
        if path == "/":
            return self.page(teacher_page(self.room))
        tables = {"/board.csv": board_csv, "/attempts.csv": attempts_csv, "/links.csv": self.links_csv}
        if path in tables:
            return Answer(HTTPStatus.OK, KINDS[".csv"], f"\ufeff{tables[path](self.room)}")  # by which Excel knows UTF-8
        return NOTHING

    def links_csv(self, room: Room) -> str:
        own = f"http://{self.headers.get('Host', '')}/?token="  # the name by which the teacher reached it
        links = student_links(room, self.access, self.port) if self.access.shared else {}
        rows = [(one.name, links.get(one.name, f"{own}{token}")) for token, one in room.members.items()]
        return as_csv(("student", "link"), rows)

    def flight(self, member: Member | None, whose: str, number: str, name: str) -> Answer:
        """A file of a flight: of the own for a student, of any for the teacher."""
        others = list(self.room.members.values()) if member is None else []
        of = member if whose == "mine" else others[int(whose) - 1] if 0 < int(whose) <= len(others) else None
        attempt = next((one for one in of.attempts if f"{one.number}" == number), None) if of else None
        if of and attempt and name == MISSION_NAME:
            return Answer(HTTPStatus.OK, KINDS[".txt"], attempt.text)
        return file_answer(of.folder / number / name) if of and attempt else NOTHING

    def path_picture(self, member: Member | None) -> Answer:
        """A student's latest flight over that of the class's mission as it is, as far as there are such."""
        mine = [member.folder / f"{member.latest.number}"] if member and member.latest else []
        try:
            return Answer(HTTPStatus.OK, KINDS[".svg"], stamp(*mine, self.room.own_folder))
        except (UserError, ValueError, OSError):  # not flown yet, or a path that cannot be drawn
            return NOTHING

    def page(self, text: str, status: HTTPStatus = HTTPStatus.OK) -> Answer:
        policy = LISTED.replace("form-action 'none'", "form-action 'self'")
        return Answer(status, KINDS[".html"], text, headers={"Content-Security-Policy": policy})

    def sent(self) -> str:
        """The text of a submission: the body, or the field of the form. Raises Refusal."""
        if status := self.refused_length(SUBMISSION.most * ENCODED):
            unsaid, longer = "A submission says how long it is.", f"A submission has at most {SUBMISSION.most} bytes."
            raise Refusal(status, unsaid if status is HTTPStatus.LENGTH_REQUIRED else longer)
        length = int(self.headers["Content-Length"])
        body = self.rfile.read(length)
        with contextlib.suppress(ValueError):  # other bytes than UTF-8, or more fields
            text = body.decode("utf-8")
            text = parse_qs(text, max_num_fields=1, errors="strict")[FIELD][0] if text.startswith(f"{FIELD}=") else text
            if text.strip() and len(text.encode()) <= SUBMISSION.most and len(body) == length:
                return text
        said = f"A submission is a mission in TOML, text in UTF-8 of at most {SUBMISSION.most} bytes."
        raise Refusal(HTTPStatus.BAD_REQUEST, said)


def file_answer(place: Path) -> Answer:
    """A page or log, if it is there."""
    if not files.is_file(place):
        return NOTHING
    opened = files.opened(place, files.PAGE if place.name == PAGE_NAME else files.LOG, links=False)
    return Answer(HTTPStatus.OK, KINDS[place.suffix], file=opened, headers=THEIRS)


def refused(status: HTTPStatus, sentence: str) -> Answer:
    return Answer(status, KINDS[".txt"], f"{sentence}\n")


NOTHING = refused(HTTPStatus.NOT_FOUND, "There is nothing here, or not yet. The board is at /")


def student_links(room: Room, access: Access, port: int) -> dict[str, str]:
    """The link of each student by name."""
    return {one.name: access._replace(token=token).link(port) for token, one in room.members.items()}


def class_server(room: Room, port: int, access: Access) -> Server:
    """A server of a class. Raises UserError."""
    shared = {"room": room, "access": access, "open": Counter(), "counting": threading.Lock()}
    return bound_server(port, access.host, type("RoomHandler", (ClassHandler,), shared))


def serve_class(file: Path, root: Path, port: int, access: Access, ready: Callable[[dict[str, str], str], None]) -> None:
    """Serve a class until interrupted. root: where its flights are kept. ready: told each student's link, and the teacher's.
    Raises UserError.
    """
    try:
        root.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"{root}: is no folder in which flights could be kept: {error.strerror or error}") from None
    room = Room(file, root)
    with class_server(room, port, access) as running:
        where = running.server_address[1]
        ready(student_links(room, access, where), access._replace(token=room.teacher).link(where))
        threading.Thread(target=room.work, daemon=True).start()
        threading.Thread(target=lambda: room.laws, daemon=True).start()  # which takes a second
        running.serve_forever(poll_interval=0.2)


def as_csv(header: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([header, *rows])
    return text.getvalue()


def board_csv(room: Room) -> str:
    ranked = room.board()
    rows = [
        [place(ranked, one), one.name, one.value, one.best.grade, iso(one.best), one.attempts[-1].number,
         one.best.rest.get("grade")]
        for one in ranked if one.best
    ]  # fmt: skip
    return as_csv(("rank", "student", room.ground.metric, "grade", "flown", "attempts", "loop"), rows)


def attempts_csv(room: Room) -> str:
    rows = [
        [one.name, each.number, iso(each), one.value_of(each), each.grade or "not flown", each.said, each.rest.get("grade")]
        for one in room.members.values() for each in one.attempts
    ]  # fmt: skip
    return as_csv(("student", "attempt", "flown", room.ground.metric, "grade", "said", "loop"), rows)


def iso(attempt: Attempt) -> str:
    return time.strftime("%Y-%m-%dT%H:%M:%S", time.localtime(attempt.at))
