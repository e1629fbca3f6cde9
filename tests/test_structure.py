"""Dependencies between the modules of the package, read from their source."""

import ast
import contextlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

from quadstep.io.doors import EXTRAS

SOURCE = Path(__file__).parent.parent / "src"

MOST_ROOMS, MOST_FLOORS = 20, 12
"""Of the picture."""

FILES = {"__main__", "own"}
"""No rooms, but files beside them."""

MOST_ANY, MOST_INNER_IMPORTS = 128, 14
"""Ceilings, to be lowered with the counts: uses of `Any`, by any name; imports inside functions, outside `commands/`, of what
is always there.
"""


PICTURE = Path(__file__).parent.parent / "docs" / "architecture.md"


class Import(NamedTuple):
    """inner: whether it stands in a function."""

    module: str
    inner: bool


@cache
def modules() -> dict[str, ast.Module]:
    """Every module of the package, parsed."""
    found = {}
    for path in sorted(SOURCE.rglob("*.py")):
        parts = path.relative_to(SOURCE).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = ast.parse(path.read_text(encoding="utf-8"))
    return found


def imports(node: ast.AST, inner: bool = False) -> Iterator[Import]:
    """What runs as an import below a node; blocks for type checkers only do not."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.If) and isinstance(child.test, ast.Name) and child.test.id == "TYPE_CHECKING":
            continue
        if isinstance(child, ast.Import):
            yield from (Import(one.name, inner) for one in child.names)
        elif isinstance(child, ast.ImportFrom):
            names = [f"{child.module}.{one.name}" for one in child.names]
            yield from (Import(name if name in modules() else str(child.module), inner) for name in names)
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


def loaded(node: ast.AST) -> Iterator[str]:
    """Names that are read below a node, those in annotations written as texts too."""
    for one in ast.walk(node):
        if isinstance(one, ast.Name) and isinstance(one.ctx, ast.Load):
            yield one.id
    for text in texts_of_types(node):
        with contextlib.suppress(SyntaxError):
            yield from loaded(ast.parse(text, mode="eval"))


def texts_of_types(node: ast.AST) -> Iterator[str]:
    """Texts where a type stands: annotations, values of aliases, what is cast to."""
    for one in ast.walk(node):
        places: list[ast.AST | None] = []
        if isinstance(one, ast.AnnAssign):
            places += [one.annotation, one.value if is_alias(one) else None]
        elif isinstance(one, ast.arg):
            places.append(one.annotation)
        elif isinstance(one, ast.FunctionDef | ast.AsyncFunctionDef):
            places.append(one.returns)
        elif isinstance(one, ast.Call) and isinstance(one.func, ast.Name) and one.func.id == "cast":
            places += one.args[:1]
        for place in filter(None, places):
            yield from (
                text.value for text in ast.walk(place) if isinstance(text, ast.Constant) and isinstance(text.value, str)
            )


def is_alias(node: ast.AST) -> bool:
    """Whether it names a type."""
    return isinstance(node, ast.AnnAssign) and isinstance(node.annotation, ast.Name) and node.annotation.id == "TypeAlias"


def anything(trees: dict[str, ast.Module]) -> int:
    """Uses of `Any`, and of every alias with `Any` in its definition, each as one."""
    named = {name: {"Any"} for name in trees}
    before = 0
    while before != (before := sum(map(len, named.values()))):
        for name, tree in trees.items():
            for node in ast.walk(tree):
                if is_alias(node) and node.value and named[name] & {*loaded(node)}:
                    named[name].add(node.target.id)
                elif isinstance(node, ast.ImportFrom):
                    given = named.get(str(node.module), set())
                    named[name] |= {one.asname or one.name for one in node.names if one.name in given}
    return sum(one in named[name] for name, tree in trees.items() for one in loaded(tree))


def test_any_is_counted_by_whatever_name():
    law = "from typing import Any, TypeAlias\nRows: TypeAlias = list[Any]\ndef f(x: Rows, y: int) -> 'Any': ..."
    use = "from law import Rows as Table\nMore: TypeAlias = 'dict[str, Table]'\ndef g(x: Table, y: 'More') -> int: ..."
    assert anything({"law": ast.parse(law)}) == 3
    assert anything({"law": ast.parse(law), "use": ast.parse(use)}) == 3 + 3


def test_a_circle_is_found():
    assert circle({"a": ["b"], "b": ["c"], "c": ["b"]}) == ["b", "c", "b"]
    assert circle({"a": ["b", "c"], "b": ["c"], "c": []}) == []


def test_no_modules_import_one_another_in_a_circle_not_even_inside_functions():
    graph = {
        name: [one.module for one in imports(tree) if one.module in modules() and one.module != name]
        for name, tree in modules().items()
    }
    assert circle(graph) == []


def room(module: str) -> str:
    """The folder or single file of the package that a module belongs to."""
    return f"{module}.".split(".")[1]


def floors() -> dict[str, int]:
    """The floor of every room in the picture, the ground first."""
    lines = PICTURE.read_text(encoding="utf-8").partition("```text\n")[2].partition("```")[0].splitlines()
    rooms = [(floor, name) for floor, line in enumerate(lines) for name in line.partition("   ")[0].split(", ")]
    assert len({name for _, name in rooms}) == len(rooms), "a room is on two floors"
    return {name: floor for floor, name in rooms}


def upwards(graph: dict[str, list[str]], floor: dict[str, int]) -> dict[str, set[str]]:
    """For every module what it imports of rooms that are not below its own. floor: of each room."""
    found = {
        name: {one for one in used if room(one) != room(name) and floor[room(one)] >= floor[room(name)]}
        for name, used in graph.items()
    }
    return {name: used for name, used in found.items() if used}


def test_an_import_upwards_or_across_is_found():
    floor = {"low": 0, "here": 1, "beside": 1, "high": 2}
    graph = {"q.here.a": ["q.low", "q.here.b", "q.beside.c", "q.high"], "q.high": ["q.low", "q.here.a"]}
    assert upwards(graph, floor) == {"q.here.a": {"q.beside.c", "q.high"}}


def test_rooms_import_only_what_is_below_them_in_the_picture():
    graph = {
        name: [one.module for one in imports(tree) if one.module in modules() and one.module != "quadstep"]
        for name, tree in modules().items()
        if name != "quadstep"
    }
    floor = floors()
    assert {room(name) for name in graph} == set(floor), "the rooms of docs/architecture.md are those of the package"
    assert upwards(graph, floor) == {}, "imports against the order of docs/architecture.md"
    assert len({*floor.values()}) <= MOST_FLOORS
    assert len(set(floor) - FILES) <= MOST_ROOMS


@pytest.mark.parametrize("name", [name for name in floors() if name not in FILES])
def test_a_room_says_what_it_is_for_and_who_may_import_it(name):
    said = ast.get_docstring(modules()[f"quadstep.{name}"]) or ""
    assert "may import it" in said or "imports it" in said, said


def test_any_and_imports_inside_functions_become_fewer():
    count = anything(modules())
    inner = sum(
        one.inner and one.module.partition(".")[0] not in EXTRAS
        for name, tree in modules().items()
        if not name.startswith("quadstep.commands.")
        for one in imports(tree)
    )
    print(f"Any: {count}, imports inside functions: {inner}")  # noqa: T201 (for who runs it with -s)
    assert count <= MOST_ANY
    assert inner <= MOST_INNER_IMPORTS


def test_the_package_holds_no_leftovers_of_editors():
    files = (path for path in SOURCE.rglob("*") if "__pycache__" not in path.parts)
    assert [path.name for path in files if path.suffix in {".orig", ".rej", ".bak", ".swp"}] == []


def test_no_test_imports_from_another_test_file():
    for path in Path(__file__).parent.rglob("*.py"):
        used = [one.module for one in imports(ast.parse(path.read_text(encoding="utf-8")))]
        assert not [name for name in used if name.startswith("tests.test_")], path


def test_no_message_gives_none_as_the_reason_of_an_error():
    """An OSError that Python's library raises itself, as shutil does, has no `strerror`."""
    texts = {path: path.read_text(encoding="utf-8") for path in SOURCE.rglob("*.py")}
    assert not [path.name for path, text in texts.items() if "{error.strerror}" in text]


def test_no_class_name_stands_for_two_things():
    names = [node.name for tree in modules().values() for node in ast.walk(tree) if isinstance(node, ast.ClassDef)]
    assert {name for name in names if names.count(name) > 1} == set()


SAME_FILES = {
    "air": "the air of a flight",
    "ardupilot": "ArduPilot",
    "closed_loop": "the controller and the plant together",
    "declared": "a plant that declares its numbers",
    "evidence": "what a study has found",
    "fly": "flying: of plans, of a mission with its files, as a command",
    "lagrange": "the paper's plant",
    "lyapunov": "the Lyapunov function of Theorem 5.1",
    "multirotor": "a real vehicle",
    "page": "the interactive pages of a study",
    "paths": "the paths that a vehicle follows",
    "planar": "the planar quadrotor",
    "plant": "equations of motion",
    "read": "reading a user's file of any kind",
    "registry": "all of its kind that the package has",
    "report": "report.html of the room",
    "rigid_body": "the motion of a rigid body",
    "run": "the room's command, from a user's file to a folder of results",
    "sampled": "the sampled closed loop as a map",
    "schema": "a user's file: its keys, what they may hold, their defaults",
    "serve": "`quadstep serve`",
    "study": "studies",
    "summary": "the results of many flights with their intervals",
    "tables": "a room's result as tables",
    "what_if": "`quadstep what-if`",
    "writing": "recorded numbers as statements of another language",
}
"""Names of files in several rooms, each with what it means in all of them."""


def test_no_file_name_means_two_things():
    names = [path.stem for path in SOURCE.rglob("*.py") if path.stem != "__init__"]
    assert {name for name in names if names.count(name) > 1} == set(SAME_FILES)


PARTICIPLES = {"told", "said", "held", "kept", "known", "found", "wanted", "given", "drawn"}
PUBLIC = {"given", "Given", "Drawn", "desired_attitude", "wanted_acceleration", "not_held"}
"""Words of which docs/glossary.md says that they name nothing, and those that users meet in laws and results all the same."""


def test_no_function_or_class_is_named_by_a_participle():
    named = {
        node.name for tree in modules().values() for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and PARTICIPLES & set(node.name.lower().strip("_").split("_"))
    }  # fmt: skip
    assert named <= PUBLIC
