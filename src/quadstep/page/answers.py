"""What the list of results answers: itself, pages that are drawn when they are asked for, and files of the folder.

Whatever is requested, only regular files below the folder are sent: every part of the way is opened from the one before it,
and links are not followed.
"""

import io
from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress
from html import escape
from http import HTTPStatus
from pathlib import Path, PurePosixPath
from typing import NamedTuple
from urllib.parse import parse_qs, quote, unquote, urlsplit

from quadstep.io import files
from quadstep.io.errors import UserError
from quadstep.io.results_folder import opened
from quadstep.metrics.verdict import FlightGrade
from quadstep.page.cards import list_page
from quadstep.page.comparison import compared_page
from quadstep.page.folder import ResultFolder, campaign_content, grade, manifest, open_result, open_two, results, results_in
from quadstep.page.model import Link
from quadstep.page.thumbnails import first_panel, thumbnail
from quadstep.report.markup import links, page_text, paragraph

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
BACK = (Link("All results", "/"),)
NOTHING = "Nothing here."


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


def two_below(root: Path, query: str) -> tuple[Path, Path]:
    """The two folders of flights that a request compares. Raises NotFound."""
    asked = parse_qs(query)
    first, second = (
        folder_below(root, quote(asked[key][0])) if asked.get(key, ["."])[0] != "." else root for key in ("a", "b")
    )
    return first, second


def first_result(root: Path, name: str) -> ResultFolder:
    """The first result of the folder that a request names. Raises NotFound."""
    with suppress(NotFound, OSError, ValueError):
        if found := results_in(root, root if name == "." else folder_below(root, quote(name), "")):
            return found[0]
    raise NotFound(f"No result “{name}” here." if name.isprintable() and name != "." else NOTHING)


def compare(root: Path, query: str) -> str:
    """Two results of one kind beside each other. Raises NotFound, UserError."""
    asked = parse_qs(query)
    first, second = (first_result(root, asked.get(key, ["."])[0]) for key in ("a", "b"))
    folders = [root / one.place for one in (first, second)]
    if folders[0] == folders[1]:
        raise UserError(f"{folders[0].name} cannot be compared with itself.")
    if first.kind != second.kind:
        kinds = f"{folders[0].name} ({first.kind.lower()}) and {folders[1].name} ({second.kind.lower()})"
        raise UserError(f"{kinds} cannot be compared: choose two results of one kind")
    one, other = (manifest(at) or campaign_content(at) for at in folders)
    return compared_page((first, second), (one, other), root)


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
    status, said = HTTPStatus.NOT_FOUND, [NOTHING]
    try:
        asked = urlsplit(target)
        path = asked.path
        pages: dict[str, Callable[[], str]] = {
            "/": lambda: list_page(root, results(root), share),
            "/compare": lambda: compare(root, asked.query),
            "/thumbs": lambda: stamp(*two_below(root, asked.query)),
            "/both": lambda: open_two(two_below(root, asked.query), BACK),
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
    except NotFound as error:
        said = [*map(str, error.args)] or said
    except (OSError, ValueError):  # a name that no file can have
        pass
    except UserError as error:
        status, said = HTTPStatus.UNPROCESSABLE_ENTITY, error.lines
    body = [*(paragraph(line, escape) for line in said), links([("/", "All results")])]
    return Answer(status, KINDS[".html"], page_text("Not shown", body, "Results"))
