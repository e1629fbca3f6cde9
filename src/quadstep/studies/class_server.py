"""`quadstep serve --class`: the board of a class, and what its students send.

A student's token is in the link that the teacher gives out. Whoever has none sees nothing; who has one sees the board, the
class's mission, and the page of the own latest flight. No request names a file or a student.
"""

import contextlib
import threading
from collections import Counter
from collections.abc import Callable
from html import escape
from http import HTTPStatus
from pathlib import Path
from urllib.parse import parse_qs

from quadstep.io import files
from quadstep.page.serve import KINDS, POLICY, Answer, Handler, Server, bound_server
from quadstep.page.sharing import Access
from quadstep.report import units
from quadstep.report.markup import heading, page_text, paragraph, table
from quadstep.studies.classroom import SUBMISSION, Member, Refusal, Room, first_text

MOST_AT_ONCE = 8
"""Requests of one address that are answered at the same time."""

BUSY = (
    b"HTTP/1.0 503 Service Unavailable\r\nContent-Type: text/plain; charset=utf-8\r\nRetry-After: 3\r\n\r\n"
    b"Too many requests at once from your address: reload the page in a moment.\n"
)
"""What further ones are told, whatever they ask."""

ENCODED = 3
"""How much longer a form is than its text, at most."""

FIELD = "mission"
FORM = (
    f'<form method="post" action="/submit"><textarea name="{FIELD}" rows="12" wrap="off" spellcheck="false" '
    'aria-label="Mission (TOML)">'
    "{}</textarea><button>Submit</button></form>"
)
STYLE = """<style>
textarea { width: 100%; font: 13px/1.5 monospace; padding: 10px 12px; }
textarea, button { color: inherit; background: var(--panel); border: 1px solid var(--line); border-radius: 8px; }
button { font: inherit; font-weight: 600; padding: 8px 18px; margin-top: 8px; cursor: pointer; }
@media print { #submit, #submit ~ * { display: none; } }
</style>"""


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
        token = wrong or self.token(lambda given: self.room.member(given) is not None)
        if isinstance(token, Answer):
            return token
        member = self.room.members[token]
        return self.submitted(member) if self.command == "POST" else self.shown(member)

    def submitted(self, member: Member) -> Answer:
        text = ""
        try:
            text = self.sent()
            self.room.submit(member, text)
        except Refusal as refusal:
            if "text/html" in self.headers.get("Accept", ""):
                return self.board(member, refusal, text)
            return Answer(refusal.status, KINDS[".txt"], f"{refusal}\n")
        return Answer(HTTPStatus.SEE_OTHER, KINDS[".txt"], "It will be flown.\n", headers={"Location": "/"})

    def shown(self, member: Member) -> Answer:
        """The answer to what a student asks to see."""
        path, page = self.path.partition("?")[0], member.folder / f"{member.latest}" / "page.html"
        if path in ("/", "/submit"):  # where a reader is whose submission was refused
            return self.board(member)
        if path == "/favicon.ico":  # what browsers ask for of themselves
            return Answer(HTTPStatus.NO_CONTENT, KINDS[".txt"])
        if path == "/mission.toml":
            return Answer(HTTPStatus.OK, KINDS[".toml"], self.room.text)
        if path == "/mine" and member.latest and files.is_file(page):
            return Answer(HTTPStatus.OK, KINDS[".html"], file=files.opened(page, files.PAGE, links=False))
        return Answer(HTTPStatus.NOT_FOUND, KINDS[".txt"], "There is nothing here. The board is at /\n")

    def board(self, member: Member, refusal: Refusal | None = None, text: str = "") -> Answer:
        policy = POLICY.replace("form-action 'none'", "form-action 'self'")
        status = refusal.status if refusal else HTTPStatus.OK
        return Answer(
            status, KINDS[".html"], board(self.room, member, refusal, text), headers={"Content-Security-Policy": policy}
        )

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


def board(room: Room, member: Member, refusal: Refusal | None = None, text: str = "") -> str:
    """The page of a student as HTML, every text escaped. refusal, text: of a submission that is not taken."""
    words, symbol = units.metric(room.ground.metric)
    rows = [
        [f"{place}", f"{one.name} (you)" if one is member else one.name, units.quantity(one.value or 0.0, symbol)]
        for place, one in enumerate(room.board(), 1)
    ]
    best = "" if member.value is None else f"Your best: {units.quantity(member.value, symbol)}. "
    mine = f'<p>{best}<a href="/mine">Your latest flight</a>, with a slider for every gain.</p>' if member.latest else ""
    free = ", ".join(room.ground.free)
    waits = member.waits and not refusal
    again = '<meta http-equiv="refresh" content="3; url=/">' if waits else ""
    written = text or member.text or first_text(room.mission, room.ground.free)
    why = f"<b>Not taken: {escape(str(refusal))}</b>{' Your text is below.' if text else ''}"
    body = [
        f'<p role="alert">{why} <a href="/">Back to the board</a></p>' if refusal else "",
        paragraph(f"{member.name}. {member.message}", escape), mine,
        table(("", "student", words), rows, escape) if rows else paragraph("Nobody has flown it yet."),
        heading("Submit", "submit"),
        paragraph(f"All fly the same mission; the smallest {words} wins. You may change only {free}.", escape),
        '<p>Remove the # before a gain and change it, or send a whole mission like <a href="/mission.toml">the '
        "class's</a>; what you leave out is taken from there. Code is never run.</p>",
        "" if waits else FORM.replace("{}", escape(written)),
    ]  # fmt: skip
    return page_text(room.mission.name, body, "Class", STYLE + again)


def class_server(room: Room, port: int, access: Access) -> Server:
    """A server of a class. Raises UserError."""
    shared = {"room": room, "access": access, "open": Counter(), "counting": threading.Lock()}
    return bound_server(port, access.host, type("RoomHandler", (ClassHandler,), shared))


def serve_class(file: Path, root: Path, port: int, access: Access, ready: Callable[[dict[str, str]], None]) -> None:
    """Serve a class until interrupted. root: where its flights are kept. ready: told each student's link. Raises UserError."""
    root.mkdir(parents=True, exist_ok=True)
    room = Room(file, root)
    with class_server(room, port, access) as running:
        where = running.server_address[1]
        ready({one.name: access._replace(token=token).link(where) for token, one in room.members.items()})
        threading.Thread(target=room.work, daemon=True).start()
        running.serve_forever(poll_interval=0.2)
