"""How many changes of a law its tests catch: `python -m tests.mutants MODULE TEST [EVERY]`, as in

    python -m tests.mutants quadstep.control.loop_shaping tests/test_control_h_infinity.py

In each mutant one place of a function is changed: a sign, a term, a factor, an order of arguments, a bound left out, an index.
It counts as caught where the tests fail; those that survive are printed. EVERY: try only one in so many.
"""

import ast
import importlib.util
import os
import signal
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import scipy.signal  # noqa: F401 (here, where it is loaded once, and not by the tests of every mutant)

from quadstep.report.terminal.screen import say
from tests import durations
from tests.changes import Change, changes, changes_of

MOST_SECONDS = 120
"""Of a processor's time, after which the tests of a mutant count as failed."""

BOUNDS = ("project", "within", "clip", "maximum", "minimum", "conjugate", "transposed", "sqrt")
"""Functions that a mutant goes without: its first argument stands for them."""


def changed(node: ast.AST) -> Iterator[ast.AST]:
    """What a node can become: as everywhere, or without a factor or a bound."""
    yield from changes(node)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult | ast.Div):
        yield node.left
    if isinstance(node, ast.Call) and ast.unparse(node.func) in BOUNDS:
        yield node.args[0]


def mutants(source: str) -> list[Change]:
    """Every change of every function; constants, imports and declared gains stay."""
    functions = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.FunctionDef)]
    return [change for function in functions for change in changes_of(function, changed)]


class CheapestFirst:
    """Plugin: of a file's tests those named like the module come first and slow ones last, so that most mutants fail early."""

    def __init__(self, name: str) -> None:
        self.name = name.rpartition(".")[2].replace("_", "-")

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        seconds = durations.recorded()
        items.sort(key=lambda item: (seconds.get(durations.function(item.nodeid), 0.0), self.name not in item.nodeid))


def source(name: str) -> str:
    """Of a module, which is not loaded: tests that load it after it was changed see nothing of what it was."""
    spec = importlib.util.find_spec(name)
    return Path(str(spec and spec.origin)).read_text(encoding="utf-8")


def caught(name: str, tree: ast.Module, *tests: str) -> bool:
    """Whether the tests fail where the module is this, in a process of its own. tests: as pytest takes them."""
    child = os.fork()
    if child == 0:
        signal.setitimer(signal.ITIMER_PROF, MOST_SECONDS)
        quiet = os.open(os.devnull, os.O_WRONLY)
        os.dup2(quiet, 1)
        os.dup2(quiet, 2)
        code = 1
        try:
            module = importlib.import_module(name)
            exec(compile(tree, module.__file__ or "", "exec"), module.__dict__)
            code = int(pytest.main(["-x", "-q", "-p", "no:cacheprovider", *tests], [CheapestFirst(name)]))
        finally:
            os._exit(code)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    assert code not in (pytest.ExitCode.NO_TESTS_COLLECTED, pytest.ExitCode.USAGE_ERROR), f"no tests: {tests}"
    return code != 0


def outcomes(name: str, chosen: slice, *tests: str) -> Iterator[tuple[Change, bool]]:
    """These mutants of a module, each with whether it is caught."""
    text = source(name)
    for change in mutants(text)[chosen]:
        yield change, caught(name, change.tree(text), *tests)


def survivors(name: str, chosen: slice, *tests: str) -> list[str]:
    """Those of these mutants that are not caught."""
    return [f"{one.function}: {one.was} -> {one.now}" for one, seen in outcomes(name, chosen, *tests) if not seen]


def main(name: str, test: str, every: int = 1) -> None:
    """Count them."""
    assert not caught(name, ast.parse(source(name)), test), "the tests fail anyway"
    tried, survived = 0, 0
    for change, seen in outcomes(name, slice(None, None, every), test):
        tried += 1
        if not seen:
            survived += 1
            say(f"survived: {change.function}: {change.was} -> {change.now}")
        sys.stdout.flush()
    say(f"{tried - survived} of {tried} caught")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]) if len(sys.argv) > 3 else 1)
