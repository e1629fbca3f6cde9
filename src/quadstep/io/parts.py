"""The parts of a long computation, in a folder of results: those that an unfinished run left, and those of a finished one.

Each is named by a digest of all that decides it and one of its content, which is compared before the content is used. So an
interrupted run goes on, one that has grown computes only what is new, and no damaged part is taken for a result.

None is continued by other code than began it, by a digest of the package's (`code_digest`); an interrupted one says so.
"""

import ast
import contextlib
import hashlib
import json
import logging
import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from quadstep.io import __version__, code_cache, files
from quadstep.io.documents import parse_json
from quadstep.io.errors import UserError, interruptible
from quadstep.io.files import FLIGHTS as ANY_PART
from quadstep.io.results_folder import RUNNING, Folder, alone_in

log = logging.getLogger(__name__)

ROOMS = ("control", "engines", "interfaces", "metrics", "numbers", "program", "sensing", "vehicle", "world")
"""Packages that count as a whole, data files too: their modules are also loaded by name."""

ROOTS = (
    "studies.campaign.draws", "studies.campaign.flyer", "studies.comparison.jobs", "studies.rare.replicates",
    "studies.tuning.search", "mission.declared", "mission.lagrange", "mission.multirotor",
)  # fmt: skip
"""Modules that count with all that they import."""

SHOWING = ("commands", "metrics.requirements", "metrics.verdict", "page", "report")
"""Packages that never count."""

EMPTY = ((re.compile(r", \w+=(?:\[\]|Load\(\))"), ""), (re.compile(r"\b\w+=(?:\[\]|Load\(\))(?:, )?"), ""))
"""What only some versions of Python write of a syntax tree."""


OTHER_CODE = "it was flown by other code of quadstep"
"""Why results are neither continued nor replaced."""


@cache
def code_digest() -> str:
    """Of the package's code that decides results. Cached between runs, as parsing takes a second.

    It is of the syntax trees without docstrings, so comments and layout do not count, nor do modules that only show results.
    The version says less: between two releases, laws may change every day.
    """
    name = code_cache.key("code that decides", source_digest(), sys.version)
    known = code_cache.read(name)
    if known is None:
        known = digest(source_files()).encode()
        code_cache.write(name, known)
    return known.decode()


@cache
def source_digest() -> str:
    """Of the package's files as they are, comments too: read in a hundredth of a second, it stands for `code_digest`."""
    contents = [(name, hashlib.sha256(content).digest()) for name, content in source_files().items()]
    return hashlib.sha256(repr(contents).encode()).hexdigest()


def source_files() -> dict[str, bytes]:
    """The package's code and its rooms' data, by their names in it."""
    root = Path(__file__).parents[1]
    code = list(root.rglob("*.py"))
    data = [
        path for room in ROOMS for path in (root / room).rglob("*") if path.suffix not in (".py", ".pyc") and path.is_file()
    ]
    return {path.relative_to(root).as_posix(): path.read_bytes() for path in sorted(code + data)}


def digest(files: Mapping[str, bytes]) -> str:
    """Of the files of a package that decide results, by their names in it."""
    modules = {name.removesuffix(".py").removesuffix("/__init__").replace("/", "."): name for name in files}
    todo = [name for name in modules if name.partition(".")[0] in ROOMS or name in ROOTS]
    found: dict[str, str] = {}
    while todo:
        module = todo.pop()
        name = modules[module]
        if name in found or f"{module}.".startswith(tuple(f"{one}." for one in SHOWING)):
            continue
        if not name.endswith(".py"):
            found[name] = hashlib.sha256(files[name]).hexdigest()
            continue
        tree = ast.parse(files[name])
        found[name] = hashlib.sha256(meaning(tree).encode()).hexdigest()
        todo += [one for one in imported(tree) if one in modules]
    return hashlib.sha256(repr(sorted(found.items())).encode()).hexdigest()[:16]


def imported(tree: ast.Module) -> Iterator[str]:
    """Modules of the package that one imports, and names in them that may be modules."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("quadstep"):
            place = str(node.module).removeprefix("quadstep").removeprefix(".")
            yield place
            yield from (f"{place}.{one.name}".removeprefix(".") for one in node.names)


def meaning(tree: ast.Module) -> str:
    """A syntax tree as text, without docstrings, and the same in all versions of Python."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            node.body = [one for one in node.body if not is_text(one)]
    text = ast.dump(tree)
    for sign, nothing in EMPTY:
        text = sign.sub(nothing, text)
    return text


def is_text(node: ast.stmt) -> bool:
    """Whether a statement is a docstring."""
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


SEAL = "sha256"
UNKNOWN = "0" * 64


def sealed(content: Mapping[str, object]) -> bytes:
    """A manifest or certificate as the content of a file."""
    text = json.dumps(
        {**{key: value for key, value in content.items() if key != SEAL}, SEAL: UNKNOWN}, indent=1, allow_nan=False
    )
    head, _, tail = f"{text}\n".rpartition(UNKNOWN)
    return f"{head}{hashlib.sha256(f'{head}{UNKNOWN}{tail}'.encode()).hexdigest()}{tail}".encode()


def read_sealed(path: Path, what: str = "a manifest written by quadstep", links: bool = False) -> dict[str, Any]:
    """A manifest or certificate, with its seal, which those of earlier versions lack. links: whether `path` may be a link.

    Raises UserError for a file that is none, or whose content is not what was written.
    """
    text = files.read_bytes(path, files.JSON, links)
    content = parse_json(text, str(path))
    if not isinstance(content, dict):
        raise UserError(f"{path}: not {what}")
    if SEAL in content and sealed(content) != text:
        raise UserError(f"{path}: was changed after quadstep wrote it")
    return content


FLIGHTS, GAINS, MARGINS, GRADES, LINEAR, COSTS = "flights", "gains", "margins", "grades", "linear", "costs"
NAMED, JOURNALS = "named", "journals"
"""Folders of results, of what is known of the user's files that decide them, and of what a search has flown so far."""

ENDINGS = {FLIGHTS: "parquet"} | dict.fromkeys((GAINS, MARGINS, GRADES, LINEAR, COSTS, NAMED), "json")


GO_ON = "finished parts are kept; run the same command to continue"
"""What is so when the disk takes no more."""


class Parts:
    """The parts in a folder that one run has for itself. Made by `parts_in`."""

    def __init__(self, folder: Folder) -> None:
        self.folder = folder
        self.named: list[tuple[str, str]] = []

    def note(self, named: Mapping[str, str]) -> None:
        """Keep digests of the user's files, by name, and say which files have changed since parts were computed here."""
        before = {}
        for name, digest in named.items():
            part, content = (NAMED, key(name)), json.dumps({"file": name, "digest": digest}).encode()
            if known := self.read(*part):
                before[name] = digest if known == content else ""
            self.add(*part, content)
            self.named.append(part)
        if changes := changed_files(before, {name: named[name] for name in before}):
            log.warning(
                "quadstep: note: %s: %s since these results; what depends on it is computed again", self.folder.path, changes
            )

    def find(self, kind: str, key: str) -> str | None:
        """The name of a part in the folder; None where it is still to be computed."""
        for inner in (f"{RUNNING}/{kind}", kind):
            with contextlib.suppress(FileNotFoundError, NotADirectoryError):
                for name in self.folder.names(inner):
                    if name.startswith(f"{key}-"):
                        return f"{inner}/{name}"
        return None

    def read(self, kind: str, key: str) -> bytes | None:
        """The content of a part; None where it is still to be computed. Raises UserError where it is not what was written."""
        name = self.find(kind, key)
        if name is None:
            return None
        content = self.folder.read(name, ANY_PART)
        if not is_whole(name, kind, key, content):
            raise changed(self.folder.path / name)
        return content

    def add(self, kind: str, key: str, content: bytes) -> None:
        """Keep a part, in place of an earlier one. Raises UserError where the disk does not take it."""
        content = sealed(json.loads(content)) if kind == COSTS else content
        name = f"{RUNNING}/{kind}/{file_name(kind, key, content)}"
        try:
            self.folder.write(name, content)
            for other in self.folder.names(f"{RUNNING}/{kind}"):
                if other.startswith(f"{key}-") and other != Path(name).name:
                    self.folder.remove(f"{RUNNING}/{kind}/{other}")
        except OSError as error:
            raise self.folder.unwritable(error, GO_ON) from None

    def publish(self, out: Path, wanted: Iterable[tuple[str, str]]) -> None:
        """Put these parts, by kind and key, into the folder of a finished run; equal entrants share theirs."""
        for kind, key in dict.fromkeys([*wanted, *self.named]):
            content = self.read(kind, key)
            assert content is not None
            (out / kind).mkdir(exist_ok=True)
            (out / kind / file_name(kind, key, content)).write_bytes(content)


def changed_files(before: object, now: Mapping[str, str]) -> str:
    """Which of the user's files have changed since results were computed, in words; empty where none has, or none is known.

    before, now: digests by name.
    """
    known = before if isinstance(before, Mapping) else {}
    names = [name for name in sorted({*known, *now}) if known and known.get(name) != now.get(name)]
    return f"{' and '.join(names)} {'has' if len(names) == 1 else 'have'} changed" if names else ""


def file_name(kind: str, key: str, content: bytes) -> str:
    """Of a part: what decides it, and what it holds; times differ whenever they are measured, so names do not tell them."""
    digest = "measured" if kind == COSTS else hashlib.sha256(content).hexdigest()[:16]
    return f"{key}-{digest}.{ENDINGS[kind]}"


def is_whole(name: str, kind: str, key: str, content: bytes) -> bool:
    """Whether a part of this name holds what was written."""
    if kind != COSTS:
        return Path(name).name == file_name(kind, key, content)
    with contextlib.suppress(UserError):
        found = parse_json(content, name)
        return isinstance(found, dict) and sealed(found) == content
    return False


def changed(path: Path) -> UserError:
    """The error for a part whose content is not what was written."""
    return UserError(f"{path}: was changed after `quadstep compare` wrote it; delete it to compute it again")


@contextlib.contextmanager
def parts_in(path: Path) -> Iterator[Parts]:
    """The parts in a folder, which is made if absent, and locked while the block runs.

    When the block ends well, they have been published; else they are kept for the next run. Raises UserError, and
    InterruptedRun on Ctrl-C.
    """
    with alone_in(path, RUNNING) as folder:
        kept = f"finished flights are kept in {path}; run the same command to continue"
        left = [Path(name).name for name in folder.files() if name.startswith(f"{RUNNING}/")]
        if others := sum(not name.startswith(code_mark()) for name in left):
            log.warning(
                "quadstep: note: %s: of what an interrupted run left there, %s of %s files are of other code of quadstep; "
                "their results are computed again",
                path,
                others,
                len(left),
            )
        with interruptible(lambda: kept if folder.files() else ""):
            yield Parts(folder)
        folder.remove_tree(RUNNING)


def key(*decisive: object) -> str:
    """A digest of all that decides a part, and of the code that computes it, after the mark of that code."""
    return code_mark() + digest_of(__version__, code_digest(), *decisive)[4:]


def code_mark() -> str:
    """What the names of all parts begin with that this code computes."""
    return digest_of(__version__, code_digest())[:4]


def digest_of(*decisive: object) -> str:
    """A digest of what was asked, whatever code answers."""
    return hashlib.sha256(json.dumps(decisive, sort_keys=True, default=str).encode()).hexdigest()[:16]
