"""How many changes of a law its tests catch: `python -m tests.mutants MODULE TEST [EVERY]`, as in

    python -m tests.mutants control.loop_shaping tests/test_control_h_infinity.py

In each mutant one place of a function is changed: a sign, a term, a factor, an order of arguments, a bound left out, an index.
It counts as caught where the tests fail; those that survive are printed. EVERY: try only one in so many.
"""

import ast
import contextlib
import io
import math
import os
import signal
import sys
from collections.abc import Iterator, Sequence

import pytest

from quadstep.report.screen import say
from tests import durations
from tests.changes import Change, changes, changes_of
from tests.mutations import exchanged, source

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


class Mutated:
    """Plugin: tests are collected once, and run in a process of its own for each mutant, to the first that fails. Those named
    like the module come first and slow ones last, so that most mutants fail early.
    """

    def __init__(self, name: str, trees: Sequence[ast.Module], enough: float) -> None:
        self.name, self.trees, self.enough = name, trees, enough
        self.caught: list[bool] = []

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        seconds, law = durations.recorded(), self.name.rpartition(".")[2].replace("_", "-")
        items.sort(key=lambda item: (seconds.get(durations.function(item.nodeid), 0.0), law not in item.nodeid))

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        assert session.items and not session.testsfailed, "no tests"
        for tree in self.trees:
            if sum(self.caught) < self.enough:
                self.caught.append(fails(session, self.name, tree))
        return True


def fails(session: pytest.Session, name: str, tree: ast.Module) -> bool:
    """Whether one of the collected tests fails where the module is this."""
    child = os.fork()
    if child == 0:
        signal.setitimer(signal.ITIMER_PROF, MOST_SECONDS)
        code = 1
        try:
            with exchanged(name, tree):
                for item, following in zip(session.items, [*session.items[1:], None], strict=True):
                    item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
                    if session.testsfailed:
                        break
                else:
                    code = 0
        finally:
            os._exit(code)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) != 0


def caught(name: str, trees: Sequence[ast.Module], *tests: str, enough: float = math.inf) -> list[bool]:
    """Whether the tests fail where a module of the package is each of these, until enough are caught. tests: as pytest takes
    them.
    """
    plugin = Mutated(name, trees, enough)
    with contextlib.redirect_stdout(io.StringIO()) as said:
        again = "ignore::pytest.PytestAssertRewriteWarning"  # plugins are imported already: this pytest runs inside another
        pytest.main(["-p", "no:cacheprovider", "-W", again, *tests], [plugin])
    assert plugin.caught, said.getvalue()
    return plugin.caught


def survivors(name: str, chosen: slice, *tests: str, enough: float = math.inf) -> list[str]:
    """Those of these mutants of a module that are not caught before enough are."""
    text = source(name)
    tried = mutants(text)[chosen]
    seen = caught(name, [change.tree(text) for change in tried], *tests, enough=enough)
    return [f"{one.function}: {one.was} -> {one.now}" for one, found in zip(tried, seen, strict=False) if not found]


def main(name: str, test: str, every: int = 1) -> None:
    """Count them."""
    text = source(name)
    assert caught(name, [ast.parse(text)], test) == [False], "the tests fail anyway"
    chosen = slice(None, None, every)
    survived = survivors(name, chosen, test)
    for one in survived:
        say(f"survived: {one}")
    tried = len(mutants(text)[chosen])
    say(f"{tried - len(survived)} of {tried} caught")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]) if len(sys.argv) > 3 else 1)
