"""How a mission names a thing of the user's own, where that is, and what it consists of.

`type = "my_law.py:SuperTwisting"` names a file, looked up from the mission's folder; `type = "my_law:SuperTwisting"` means the
same file where there is one, else a module that is installed.
"""

import ast
import hashlib
import re
import sys
from collections.abc import Iterable, Mapping
from functools import cache, lru_cache
from importlib.machinery import PathFinder
from pathlib import Path
from typing import NamedTuple

from quadstep.io import files
from quadstep.io.errors import UserError
from quadstep.io.parts import meaning

WRITTEN = re.compile(r"(?P<where>[^:\n]+\.py|[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*):(?P<name>[A-Za-z_]\w*)")
MOST_FILES = 2000
"""Of an installed package."""

UNPARSED = (SyntaxError, ValueError, RecursionError, MemoryError)
"""What Python raises for a file that is not Python."""


class Place(NamedTuple):
    """where: a file or a module. name: of the class or function in it. origin: the distribution that registers it."""

    where: str
    name: str
    origin: str = ""

    @property
    def text(self) -> str:
        return f"{self.where}:{self.name}"

    def file(self, folder: Path) -> Path | None:
        """The file, if it is one beside the mission; None for an installed module. Raises UserError if there is neither."""
        if self.where.endswith(".py"):
            return resolved(folder / self.where)
        beside = folder.joinpath(*self.where.split(".")).with_suffix(".py")
        if files.is_file(beside) and not self.origin:
            return resolved(beside)
        if PathFinder.find_spec(self.where.partition(".")[0]) is None:
            if self.origin:
                raise UserError(f"{self.text}: {self.origin} registers it, but there is no installed module {self.where}")
            raise UserError(f"{self.text}: there is no {beside.name} in {beside.parent} and no installed module {self.where}")
        return None


def resolved(path: Path) -> Path:
    """The file itself, wherever links lead. Raises UserError."""
    try:
        return path.resolve()
    except (OSError, ValueError, RuntimeError):  # too long, NUL, links in a circle
        raise UserError(f"{path}: cannot be read: no file can have this name") from None


def place(text: object) -> Place | None:
    """What a mission names, None where it is no thing of the user's own."""
    found = WRITTEN.fullmatch(text) if isinstance(text, str) else None
    return Place(found["where"], found["name"]) if found else None


def digests(place: Place, folder: Path) -> dict[str, str]:
    """Of everything that the thing is made of, by name: its file and those beside it that it imports, or an installed package.

    Raises UserError.
    """
    path = place.file(folder)
    if path is None:
        top = place.where.partition(".")[0]
        return {top: package_code(top)}
    beside = Path(place.where if place.where.endswith(".py") else place.where.replace(".", "/")).parent
    return {str(beside / one.name): code_of({one: content}) for one, content in sources(path).items()}


def code_of(contents: Mapping[Path, bytes]) -> str:
    """A digest of Python files wherever they are; comments, docstrings and layout do not count."""
    return digest_of(sorted((path.name, code(content)) for path, content in contents.items()))


@lru_cache(maxsize=256)
def code(content: bytes) -> bytes:
    """What a file says to Python; of one that is not Python, what it holds."""
    try:
        return meaning(ast.parse(content)).encode()
    except UNPARSED:
        return content


@cache
def package_code(name: str) -> str:
    """A digest of an installed package or module. Raises UserError as `package_files`."""
    return digest_of(sorted((path.name, files.read_bytes(path, files.PYTHON)) for path in package_files(name)))


def digest_of(parts: Iterable[tuple[str, bytes]]) -> str:
    """Of named contents, in this order."""
    total = hashlib.sha256()
    for name, content in parts:
        total.update(f"{name} {len(content)}\n".encode() + content)
    return total.hexdigest()


def sources(path: Path) -> dict[Path, bytes]:
    """A file and those beside it that it imports, directly or not, with their contents. Raises UserError."""
    found: dict[Path, bytes] = {}
    waiting = [path]
    while waiting:
        one = waiting.pop()
        if one not in found:
            found[one] = files.read_bytes(one, files.PYTHON)
            waiting += [beside for name in imported(found[one]) if (beside := sibling(path.parent, name))]
    return found


def sibling(folder: Path, module: str) -> Path | None:
    """The file beside the others that `import module` means; the standard library and quadstep go before it."""
    top = module.partition(".")[0]
    path = folder / f"{top}.py"
    own = top not in sys.stdlib_module_names and top != "quadstep"
    return path if own and files.is_file(path) else None


@lru_cache(maxsize=256)
def imported(content: bytes) -> frozenset[str]:
    """The modules that a file imports anywhere; none of one that is not Python."""
    try:
        tree = ast.parse(content)
    except UNPARSED:  # loading it will say so
        return frozenset()
    nodes = list(ast.walk(tree))
    found = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    return frozenset(found | {one.module for one in nodes if isinstance(one, ast.ImportFrom) and one.module and not one.level})


def package_files(name: str) -> list[Path]:
    """The Python files of an installed package or module. Raises UserError for one that is not Python, or too large."""
    spec = PathFinder.find_spec(name)
    folders = [Path(one) for one in spec.submodule_search_locations or ()] if spec else []
    paths = [path for folder in folders for path in sorted(folder.rglob("*.py"))]
    if spec and not folders and spec.origin:
        paths = [Path(spec.origin)]
    if not paths or len(paths) > MOST_FILES:
        raise UserError(f"{name}: an installed package of 1 to {MOST_FILES} Python files is needed, not {len(paths)}")
    return paths
