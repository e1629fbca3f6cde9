"""`quadstep serve`: results under a folder in the browser, for this machine, or with a token for others.

Whatever is requested, only regular files below the folder are sent: every part of the way is opened from the one before it,
and links are not followed.
"""

import io
import os
import re
import socket
import tempfile
import threading
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path, PurePosixPath
from typing import NamedTuple, TypeAlias
from urllib.parse import parse_qs, quote, unquote, urlsplit

from quadstep.io import files
from quadstep.io.errors import UserError
from quadstep.io.results_folder import opened
from quadstep.metrics.verdict import FlightGrade
from quadstep.page.cards import list_page
from quadstep.page.comparison import compared_page
from quadstep.page.folder import grade, manifest, open_result, open_two, results, results_in
from quadstep.page.model import Link
from quadstep.page.sharing import COOKIE, LOCAL, Access, qr_drawing
from quadstep.page.thumbnails import first_panel, thumbnail

POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval' blob:; worker-src blob:; style-src 'unsafe-inline'; "
    "img-src 'self' data: blob:; font-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
LISTED = f"{POLICY}; connect-src 'self'"
"""Of the list, which sends logs that are dropped on it."""
SANDBOXED = f"{POLICY}; sandbox allow-scripts allow-downloads"
THEIRS = {"Content-Security-Policy": SANDBOXED}
"""Of files, which others may have written: their scripts run in an origin of their own, not in that of the list."""
KINDS = {
    ".html": "text/html; charset=utf-8",
    ".svg": "image/svg+xml",
    ".png": "image/png",
    ".csv": "text/csv; charset=utf-8",
    ".json": "application/json",
    ".md": "text/plain; charset=utf-8",
    ".txt": "text/plain; charset=utf-8",
    ".toml": "text/plain; charset=utf-8",
}
OTHER_KIND = "application/octet-stream"
CHUNK = 1 << 16
DROPPED, MOST_LETTERS = "/advise/", 60
"""Where a log is sent to, before its name, and letters of a name that are kept."""

BACK = (Link("All results", "/"),)


Advise: TypeAlias = Callable[[Path, str, Path], Path]
"""Writes what a log advises, from its file, its name for readers, and the folder of results; gives the folder there. Raises
UserError for a log that carries no advice.
"""


class Answer(NamedTuple):
    """The answer to a request: text, or a file, which is closed once it is sent."""

    status: HTTPStatus
    kind: str
    text: str = ""
    file: io.BufferedReader | None = None
    headers: Mapping[str, str] = {}


class NotFound(Exception):  # noqa: N818 (an answer, not an error)
    """Nothing has that name."""


def name_of(path: str) -> str:
    """What a request names in the folder, percent signs decoded once. Raises NotFound for what leads out or is hidden."""
    parts = [unquote(part, errors="strict") for part in path.split("/") if part]
    if any(part.startswith(".") or any(sign in part for sign in ("/", "\\", "\0")) for part in parts):
        raise NotFound
    return "/".join(parts)


def open_file(root: Path, path: str) -> io.BufferedReader:
    """The regular file at `path` of a request, no link followed on the way. Raises NotFound, OSError."""
    try:
        with opened(root) as folder:
            return folder.file(name_of(path), files.FLIGHTS)
    except UserError:
        raise NotFound from None


def folder_below(root: Path, path: str, needed: str = "flight.csv") -> Path:
    """The folder at `path` of a request, which has such a file. Raises NotFound, OSError."""
    name = name_of(path)
    with opened(root) as folder:
        if not (folder.has(f"{name}/{needed}".lstrip("/")) if needed else not name or folder.is_folder(name)):
            raise NotFound
    return root / name


def two_below(root: Path, query: str, needed: str = "") -> tuple[Path, Path]:
    """The two folders that a request compares. Raises NotFound."""
    asked = parse_qs(query)
    first, second = (
        folder_below(root, quote(asked[key][0]), needed) if asked.get(key, ["."])[0] != "." else root for key in ("a", "b")
    )
    return first, second


def compare(root: Path, query: str) -> str:
    """Two results of one kind beside each other. Raises NotFound, UserError."""
    folders = two_below(root, query)
    first, second = (next(iter(results_in(root, folder)), None) for folder in folders)
    if first is None or second is None:
        raise NotFound
    if first.kind != second.kind:
        kinds = f"{folders[0].name} ({first.kind.lower()}) and {folders[1].name} ({second.kind.lower()})"
        raise UserError(f"{kinds} cannot be compared: choose two results of one kind")
    return compared_page((first, second), (manifest(folders[0]), manifest(folders[1])), root)


def stamp(*folders: Path) -> str:
    """The thumbnail of a flight, or of two. Raises UserError, ValueError, OSError where a log cannot be drawn."""
    with ExitStack() as held:
        logs = [held.enter_context(held.enter_context(opened(one)).file("flight.csv", files.LOG)) for one in folders]
        return thumbnail(*((log, grade(manifest(one)) == FlightGrade.LOST) for log, one in zip(logs, folders, strict=True)))


DRAWN: Mapping[str, tuple[str, Callable[[Path], str]]] = {
    "/fly/": (".html", lambda folder: open_result(folder, BACK)),
    "/thumb/": (".svg", stamp),
}
"""What is drawn of a flight's log when it is asked for, below these: its kind, and from its folder."""


def answer(root: Path, target: str, share: str = "") -> Answer:
    """The answer to a GET of `target`. share: what the list says of who may see it."""
    try:
        asked = urlsplit(target)
        path = asked.path
        pages: dict[str, Callable[[], str]] = {
            "/": lambda: list_page(root, results(root), share),
            "/compare": lambda: compare(root, asked.query),
            "/thumbs": lambda: stamp(*two_below(root, asked.query, "flight.csv")),
            "/both": lambda: open_two(two_below(root, asked.query, "flight.csv"), BACK),
        }
        if path in pages:
            listed = {"Content-Security-Policy": LISTED} if path == "/" else {}
            return Answer(HTTPStatus.OK, KINDS[".svg" if path == "/thumbs" else ".html"], pages[path](), headers=listed)
        if path == "/favicon.ico":  # what browsers ask for of themselves
            return Answer(HTTPStatus.NO_CONTENT, KINDS[".txt"])
        start, _, name = path.removeprefix("/").partition("/")
        if start in ("files", "panel"):
            file, what = open_file(root, name), KINDS.get(PurePosixPath(unquote(path)).suffix.lower(), OTHER_KIND)
            text, sent = ("", file) if start == "files" else (first_panel(file), None)
            return Answer(HTTPStatus.OK, what, text, sent, THEIRS)
        for start, (kind, drawn) in DRAWN.items():
            if path.startswith(start):
                return Answer(HTTPStatus.OK, KINDS[kind], drawn(folder_below(root, path.removeprefix(start))))
    except (NotFound, OSError, ValueError):  # no such name, or none that a file can have
        pass
    except UserError as error:
        return Answer(HTTPStatus.UNPROCESSABLE_ENTITY, KINDS[".txt"], "\n".join((*error.lines, "")))
    return Answer(HTTPStatus.NOT_FOUND, KINDS[".txt"], "Nothing here. The list is at /\n")


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
