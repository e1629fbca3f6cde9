"""Dependencies between the modules of the package, read from their source."""

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from quadstep.extras import EXTRAS

SOURCE = Path(__file__).parent.parent / "src"

MOST_ANY, MOST_INNER_IMPORTS = 115, 17
"""Ceilings, to be lowered with the counts: uses of `Any`; imports inside functions, outside `commands/`, of what is always
there.
"""


class Import(NamedTuple):
    """inner: whether it stands in a function."""

    module: str
    inner: bool


def parsed() -> dict[str, ast.Module]:
    """Every module of the package."""
    found = {}
    for path in sorted(SOURCE.rglob("*.py")):
        parts = path.relative_to(SOURCE).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = ast.parse(path.read_text(encoding="utf-8"))
    return found


MODULES = parsed()


def imports(node: ast.AST, inner: bool = False) -> Iterator[Import]:
    """What runs as an import below a node; blocks for type checkers only do not."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.If) and isinstance(child.test, ast.Name) and child.test.id == "TYPE_CHECKING":
            continue
        if isinstance(child, ast.Import):
            yield from (Import(one.name, inner) for one in child.names)
        elif isinstance(child, ast.ImportFrom):
            names = [f"{child.module}.{one.name}" for one in child.names]
            yield from (Import(name if name in MODULES else str(child.module), inner) for name in names)
        yield from imports(child, inner or isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef))


def circle(graph: dict[str, list[str]]) -> list[str]:
    """Modules that import one another in a circle, the first last again; empty where there is none."""
    done: set[str] = set()

    def walk(path: list[str]) -> list[str]:
        for name in graph[path[-1]]:
            if name in path:
                return [*path[path.index(name) :], name]
            found = [] if name in done else walk([*path, name])
            if found:
                return found
        done.add(path[-1])
        return []

    return next((found for name in graph if name not in done and (found := walk([name]))), [])


def test_a_circle_is_found():
    assert circle({"a": ["b"], "b": ["c"], "c": ["b"]}) == ["b", "c", "b"]
    assert circle({"a": ["b", "c"], "b": ["c"], "c": []}) == []


def test_no_modules_import_one_another_in_a_circle_not_even_inside_functions():
    graph = {
        name: [one.module for one in imports(tree) if one.module in MODULES and one.module != name]
        for name, tree in MODULES.items()
    }
    assert circle(graph) == []


def test_any_and_imports_inside_functions_become_fewer():
    anything = sum(isinstance(node, ast.Name) and node.id == "Any" for tree in MODULES.values() for node in ast.walk(tree))
    inner = sum(
        one.inner and one.module.partition(".")[0] not in EXTRAS
        for name, tree in MODULES.items()
        if not name.startswith("quadstep.commands.")
        for one in imports(tree)
    )
    print(f"Any: {anything}, imports inside functions: {inner}")  # noqa: T201 (for who runs it with -s)
    assert anything <= MOST_ANY
    assert inner <= MOST_INNER_IMPORTS


def test_no_test_imports_from_another_test_file():
    for path in Path(__file__).parent.rglob("*.py"):
        used = [one.module for one in imports(ast.parse(path.read_text(encoding="utf-8")))]
        assert not [name for name in used if name.startswith("tests.test_")], path
