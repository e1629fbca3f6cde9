"""A digest of the package's code that decides results, so that none is continued by other code than began it.

It is of the syntax trees without docstrings, so comments and layout do not count, nor do modules that only show results. The
version says less: between two releases, laws may change every day.
"""

import ast
import hashlib
import re
import sys
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

from quadstep.io import code_cache

ROOMS = ("control", "engines", "interfaces", "metrics", "numbers", "program", "sensing", "vehicle", "world")
"""Packages that count as a whole, data files too: their modules are also loaded by name."""

ROOTS = (
    "studies.campaign.draws", "studies.campaign.flyer", "studies.comparison.jobs", "studies.rare.pieces",
    "studies.tuning.search", "mission.declared", "mission.lagrange", "mission.multirotor",
)  # fmt: skip
"""Modules that count with all that they import."""

SHOWING = ("commands", "metrics.judging", "page", "report")
"""Packages that never count."""

EMPTY = ((re.compile(r", \w+=(?:\[\]|Load\(\))"), ""), (re.compile(r"\b\w+=(?:\[\]|Load\(\))(?:, )?"), ""))
"""What only some versions of Python write of a syntax tree."""


@cache
def code_digest() -> str:
    """Of the code of this package. Cached between runs, as parsing takes a second."""
    root = Path(__file__).parents[2]
    code = list(root.rglob("*.py"))
    data = [
        path for room in ROOMS for path in (root / room).rglob("*") if path.suffix not in (".py", ".pyc") and path.is_file()
    ]
    files = {path.relative_to(root).as_posix(): path.read_bytes() for path in sorted(code + data)}
    whole = hashlib.sha256(repr([(name, hashlib.sha256(content).digest()) for name, content in files.items()]).encode())
    name = code_cache.key("code that decides", whole.hexdigest(), sys.version)
    known = code_cache.read(name)
    if known is None:
        known = digest(files).encode()
        code_cache.write(name, known)
    return known.decode()


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
