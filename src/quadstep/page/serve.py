"""`quadstep serve`: results under a folder in the browser, for this machine only.

Whatever is requested, only regular files below the folder are sent: every part of the way is opened from the one before it,
and links are not followed.
"""

import html
import os
import stat
import time
from collections.abc import Callable
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path, PurePosixPath
from typing import NamedTuple
from urllib.parse import quote, unquote, urlsplit

from quadstep.errors import UserError
from quadstep.page.folder import Result, results
from quadstep.page.model import Link
from quadstep.page.opened import open_result
from quadstep.report.page import style

HOST = "127.0.0.1"
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' blob:; worker-src blob:; style-src 'unsafe-inline'; "
    "img-src 'self' data: blob:; font-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
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
LIST_STYLE = "a { color: LinkText; } td:first-child { font-weight: 600; } td:nth-child(n+2) { color: GrayText; }"


class Answer(NamedTuple):
    """The answer to a request: text, or an open file."""

    status: HTTPStatus
    kind: str
    text: str = ""
    handle: int | None = None


class NotFound(Exception):  # noqa: N818 (an answer, not an error)
    """Nothing has that name."""


def parts_of(path: str) -> list[str]:
    """The parts of a path below the folder, percent signs decoded once. Raises NotFound for one that leads elsewhere."""
    parts = [unquote(part, errors="strict") for part in path.split("/") if part]
    for part in parts:
        if part.startswith(".") or any(sign in part for sign in ("/", "\\", "\0")):
            raise NotFound
    return parts


def open_below(root: Path, parts: list[str]) -> int:
    """A handle of the regular file or folder at `parts` below `root`, no link followed on the way. Raises NotFound."""
    handle = os.open(root, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    for part in parts:
        try:
            inner = os.open(part, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, dir_fd=handle)
        except (OSError, ValueError):
            raise NotFound from None
        finally:
            os.close(handle)
        handle = inner
    return handle


def open_file(root: Path, path: str) -> int:
    """A handle of the regular file at `path` of a request. Raises NotFound."""
    handle = open_below(root, parts_of(path))
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        os.close(handle)
        raise NotFound
    return handle


def folder_below(root: Path, path: str) -> Path:
    """The folder at `path` of a request. Raises NotFound."""
    parts = parts_of(path)
    handle = open_below(root, parts)
    directory = stat.S_ISDIR(os.fstat(handle).st_mode)
    os.close(handle)
    if not directory:
        raise NotFound
    os.close(open_file(root, quote("/".join([*parts, "flight.csv"]))))
    return root.joinpath(*parts)


def answer(root: Path, target: str) -> Answer:
    """The answer to a GET of `target`."""
    try:
        path = urlsplit(target).path
        if path == "/":
            return Answer(HTTPStatus.OK, KINDS[".html"], list_page(root, results(root)))
        if path == "/favicon.ico":  # what browsers ask for of themselves
            return Answer(HTTPStatus.NO_CONTENT, KINDS[".txt"])
        if path.startswith("/files/"):
            kind = KINDS.get(PurePosixPath(unquote(path)).suffix.lower(), OTHER_KIND)
            return Answer(HTTPStatus.OK, kind, handle=open_file(root, path.removeprefix("/files/")))
        if path.startswith("/fly/"):
            folder = folder_below(root, path.removeprefix("/fly/"))
            return Answer(HTTPStatus.OK, KINDS[".html"], open_result(folder, (Link("All results", "/"),)))
    except (NotFound, UnicodeDecodeError, ValueError):
        pass
    except UserError as error:
        return Answer(HTTPStatus.UNPROCESSABLE_ENTITY, KINDS[".txt"], f"{error}\n")
    return Answer(HTTPStatus.NOT_FOUND, KINDS[".txt"], "There is nothing here. The list is at /\n")


def list_page(root: Path, found: list[Result]) -> str:
    """The list of results as HTML, every text escaped."""
    rows = "\n".join(row(result) for result in found)
    header = "<tr><th>result</th><th>folder</th><th>written</th><th>ended</th><th>files</th></tr>"
    body = f'<div class="scroll"><table><thead>{header}</thead><tbody>{rows}</tbody></table></div>'
    if not found:
        body = "<p>No results yet. `quadstep fly` and `quadstep reproduce` write some.</p>"
    title = html.escape(f"Results in {root.name or root}")
    head = '<meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">'
    head += f"<title>{title}</title><style>{style()}{LIST_STYLE}</style>"
    return f'<!doctype html>\n<html lang="en"><head>{head}</head>\n<body><h1>{title}</h1>\n{body}\n</body></html>\n'


def row(result: Result) -> str:
    """One result: a link to its page or report, then to every file."""
    place = result.place.as_posix()
    base = "" if place == "." else quote(place) + "/"
    files = [(name, f"/files/{base}{quote(name)}") for name in result.files]
    best = files[0][1]
    if "flight.csv" in result.files and "page.html" not in result.files:
        best = f"/fly/{base}"
    links = " ".join(f'<a href="{html.escape(href)}">{html.escape(name)}</a>' for name, href in files)
    name = f'<a href="{html.escape(best)}">{html.escape(result.name)}</a>'
    try:
        written = time.strftime("%Y-%m-%d %H:%M", time.localtime(result.changed))
    except (ValueError, OverflowError):  # a time that no calendar has
        written = ""
    cells = [name, html.escape(place), written, html.escape(result.ending), links]
    return "<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>"


class Handler(BaseHTTPRequestHandler):
    """Answers GET and HEAD of this machine's browser."""

    root: Path
    timeout = 60
    server_version = "quadstep"
    sys_version = ""

    def do_GET(self) -> None:
        self.reply(self.answer())

    def do_HEAD(self) -> None:
        self.reply(self.answer(), body=False)

    def answer(self) -> Answer:
        """The answer to this request; a page of another host that calls itself by ours gets none (DNS rebinding)."""
        port = self.connection.getsockname()[1]
        hosts = {f"{name}:{port}" for name in (HOST, "localhost")} | ({HOST, "localhost"} if port == 80 else set())
        if self.headers.get_all("Host") is None or any(host.lower() not in hosts for host in self.headers.get_all("Host", [])):
            return Answer(
                HTTPStatus.MISDIRECTED_REQUEST, KINDS[".txt"], "This server answers to 127.0.0.1 and localhost only.\n"
            )
        return answer(self.root, self.path)

    def reply(self, answer: Answer, body: bool = True) -> None:
        """Send an answer."""
        content = answer.text.encode("utf-8", "replace")
        length = len(content) if answer.handle is None else os.fstat(answer.handle).st_size
        self.send_response(answer.status)
        for name, value in {
            "Content-Type": answer.kind,
            "Content-Length": str(length),
            "Cache-Control": "no-store",
            "X-Content-Type-Options": "nosniff",
            "Referrer-Policy": "no-referrer",
            "Cross-Origin-Resource-Policy": "same-origin",
            "Content-Security-Policy": POLICY,
        }.items():
            self.send_header(name, value)
        self.end_headers()
        if answer.handle is None:
            if body:
                self.wfile.write(content)
            return
        with os.fdopen(answer.handle, "rb") as file:
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


def server(folder: Path, port: int) -> Server:
    """A server of the results under `folder`. Raises UserError where that is impossible."""
    if not folder.is_dir():
        raise UserError(f"{folder}: is not a folder with results; `quadstep fly` and `quadstep reproduce` write to out/")
    kind = type("FolderHandler", (Handler,), {"root": folder.resolve()})
    try:
        return Server((HOST, port), kind)
    except OSError as error:
        raise UserError(f"port {port} of {HOST} cannot be used: {error.strerror}; choose another --port") from None
    except OverflowError:
        raise UserError(f"port {port}: should be from 0 to 65535") from None


def serve(folder: Path, port: int, ready: Callable[[str], None]) -> None:
    """Serve until interrupted. ready: told the address. Raises UserError."""
    with server(folder, port) as running:
        ready(f"http://{HOST}:{running.server_address[1]}/")
        running.serve_forever(poll_interval=0.2)
