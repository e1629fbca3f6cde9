"""`quadstep serve`: results under a folder in the browser, for this machine, or with a token for others."""

import os
import re
import socket
import tempfile
import threading
from collections.abc import Callable
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import TypeAlias
from urllib.parse import parse_qs, quote, unquote, urlsplit

from quadstep.io import files
from quadstep.io.errors import UserError
from quadstep.page.answers import KINDS, POLICY, Answer, answer
from quadstep.page.sharing import COOKIE, LOCAL, Access, qr_drawing

CHUNK = 1 << 16
DROPPED, MOST_LETTERS = "/advise/", 60
"""Where a log is sent to, before its name, and letters of a name that are kept."""

Advise: TypeAlias = Callable[[Path, str, Path], Path]
"""Writes what a log advises, from its file, its name for readers, and the folder of results; gives the folder there. Raises
UserError for a log that carries no advice.
"""


class Handler(BaseHTTPRequestHandler):
    """Answers GET and HEAD of this machine's browser, or of those who have the token."""

    root: Path
    access: Access
    advise: Advise | None = None
    taking: threading.Lock
    timeout = 60
    server_version = "quadstep"
    sys_version = ""

    def do_GET(self) -> None:
        self.reply(self.answer())

    def do_HEAD(self) -> None:
        self.reply(self.answer(), body=False)

    def do_POST(self) -> None:
        self.close_connection = True  # whatever was not read of the request is no request
        self.reply(self.receive_log())

    def receive_log(self) -> Answer:
        """The answer to a log that is dropped on the list: where its report is, or why it carries no advice; one at a time."""
        refused = self.refused()
        if refused or self.advise is None:
            return refused or Answer(HTTPStatus.METHOD_NOT_ALLOWED, KINDS[".txt"], "Nothing can be sent here.\n")
        if not self.taking.acquire(blocking=False):
            said = "Another log is being read; try again when it is done.\n"
            return Answer(HTTPStatus.SERVICE_UNAVAILABLE, KINDS[".txt"], said)
        name = re.sub(r"[^\w.-]", "_", unquote(self.path.removeprefix(DROPPED)))[-MOST_LETTERS:].lstrip(".") or "log"
        try:
            with tempfile.TemporaryDirectory(prefix="quadstep-log-") as place:
                log = Path(place) / name
                self.keep(log, int(self.headers["Content-Length"]))
                found = self.advise(log, name, self.root)
        except (UserError, OSError) as error:
            said = f"{error}" if isinstance(error, UserError) else f"{name}: cannot be stored: {error.strerror or error}"
            return Answer(HTTPStatus.UNPROCESSABLE_ENTITY, KINDS[".txt"], f"{said}\n")
        finally:
            self.taking.release()
        address = f"/files/{quote(found.relative_to(self.root).as_posix())}/report.html"
        return Answer(HTTPStatus.CREATED, KINDS[".txt"], address, headers={"Location": address})

    def refused(self) -> Answer | None:
        """The answer to what is no log from this machine's list: pages of others send another origin."""
        refusal, listed = self.refused_length(files.LOG.most), f"http://{self.headers.get('Host')}"
        cases = (
            (self.access.shared or not self.path.startswith(DROPPED), 405, "Nothing can be sent here."),
            (self.headers.get("Origin") != listed, 403, "Logs can be sent only from this server's list."),
            (refusal == 411, 411, "The request must state the log's length in bytes."),
            (refusal == 413, 413, f"A log may have at most {files.LOG.most} bytes."),
        )
        first = next((Answer(HTTPStatus(status), KINDS[".txt"], f"{said}\n") for wrong, status, said in cases if wrong), None)
        return first if self.access.shared else self.misdirected() or first

    def refused_length(self, most: int) -> HTTPStatus | None:
        """With which status a request is refused that does not say how long it is, or that is longer than so many bytes."""
        length = self.headers.get("Content-Length", "")
        if not re.fullmatch("[0-9]{1,12}", length):
            return HTTPStatus.LENGTH_REQUIRED
        return HTTPStatus.REQUEST_ENTITY_TOO_LARGE if int(length) > most else None

    def keep(self, log: Path, length: int) -> None:
        """Write so many bytes of the request into a file. Raises UserError where there are fewer."""
        with log.open("wb") as file:
            while length > 0 and (chunk := self.rfile.read(min(CHUNK, length))):
                file.write(chunk)
                length -= len(chunk)
        if length:
            raise UserError(f"{log.name}: the upload ended early; send it again")

    def answer(self) -> Answer:
        if not self.access.shared:
            return self.misdirected() or answer(self.root, self.path)
        token = self.token(self.access.opens)
        if isinstance(token, Answer):
            return token
        drawing = qr_drawing(self.access.link(self.port))
        said = "Anyone who has the link and can reach this machine can see these results."
        return answer(self.root, self.path, f'<div class="qr">{drawing}<p>{said}</p></div>' if drawing else f"<p>{said}</p>")

    @property
    def port(self) -> int:
        return self.connection.getsockname()[1]

    def misdirected(self) -> Answer | None:
        """The answer to a page of another host that calls itself by ours (DNS rebinding)."""
        names = (LOCAL, "localhost")
        hosts = {f"{name}:{self.port}" for name in names} | (set(names) if self.port == 80 else set())
        asked = self.headers.get_all("Host", [])
        if asked and all(host.lower() in hosts for host in asked):
            return None
        said = "This server answers requests for 127.0.0.1 and localhost only.\n"
        return Answer(HTTPStatus.MISDIRECTED_REQUEST, KINDS[".txt"], said)

    def token(self, opens: Callable[[str], bool]) -> str | Answer:
        """The token of who asks; or what is answered instead: to the link the cookie that the rest needs, to others nothing.

        opens: whether a token is one.
        """
        try:
            given = parse_qs(urlsplit(self.path).query).get("token", [""])[0]
        except ValueError:  # an address that is none
            given = ""
        name = f"{COOKIE}-{self.port}"
        if given and opens(given):
            if self.command == "POST":
                return given
            cookie = f"{name}={given}; Path=/; HttpOnly; SameSite=Lax"
            return Answer(HTTPStatus.SEE_OTHER, KINDS[".txt"], headers={"Location": "/", "Set-Cookie": cookie})
        kept = [part.strip().partition("=") for part in self.headers.get("Cookie", "").split(";")]
        found = next((value for key, _, value in kept if key == name and opens(value)), None)
        said = "This page needs a complete link that is still valid, including its token.\n"
        return Answer(HTTPStatus.FORBIDDEN, KINDS[".txt"], said) if found is None else found

    def reply(self, answer: Answer, body: bool = True) -> None:
        content = answer.text.encode("utf-8", "replace")
        length = os.fstat(answer.file.fileno()).st_size if answer.file else len(content)
        self.send_response(answer.status)
        for name, value in {
            "Content-Type": answer.kind,
            "Content-Length": str(length),
            "Cache-Control": "no-store",
            "X-Content-Type-Options": "nosniff",
            "Referrer-Policy": "no-referrer",
            "Cross-Origin-Resource-Policy": "same-origin",
            "Content-Security-Policy": POLICY,
            **answer.headers,
        }.items():
            self.send_header(name, value)
        self.end_headers()
        if answer.file is None:
            if body:
                self.wfile.write(content)
            return
        with answer.file as file:
            while body and length > 0 and (chunk := file.read(min(CHUNK, length))):
                self.wfile.write(chunk)
                length -= len(chunk)

    def handle(self) -> None:
        """A browser that hangs up is not an error."""
        try:
            super().handle()
        except (ConnectionError, TimeoutError):
            self.close_connection = True

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002 (the library's name)
        """Nothing is logged."""


class Server(ThreadingHTTPServer):
    """One thread per request; none outlives the server."""

    daemon_threads = True
    allow_reuse_address = True
    request_queue_size = 128  # a class that opens its links at once

    def __init__(self, where: tuple[str, int], handler: type[BaseHTTPRequestHandler]) -> None:
        self.address_family = socket.AF_INET6 if ":" in where[0] else socket.AF_INET
        super().__init__(where, handler)


def server(folder: Path, port: int, access: Access = Access(), advise: Advise | None = None) -> Server:  # noqa: B008 (frozen)
    """A server of the results under `folder`. advise: of dropped logs. Raises UserError where that is impossible."""
    if not os.path.isdir(folder):  # noqa: PTH112 (of a Path, names that no file can have are an error)
        raise UserError(f"{folder}: is not a folder with results; `quadstep fly` and `quadstep reproduce` write to out/")
    given = {"root": folder.resolve(), "access": access, "taking": threading.Lock()}
    kind = type("FolderHandler", (Handler,), {**given, "advise": advise and staticmethod(advise)})
    return bound_server(port, access.host, kind)


def bound_server(port: int, host: str, handler: type[Handler]) -> Server:
    """A server that listens. Raises UserError."""
    try:
        return Server((host, port), handler)
    except OSError as error:
        raise UserError(
            f"port {port} of {host} cannot be used: {error.strerror or error}; choose another --host or --port"
        ) from None


def serve(folder: Path, port: int, access: Access, ready: Callable[[str], None], advise: Advise | None = None) -> None:
    """Serve until interrupted. ready: told the link; advise: as for `server`. Raises UserError."""
    with server(folder, port, access, advise) as running:
        ready(access.link(running.server_address[1]))
        running.serve_forever(poll_interval=0.2)
