"""How many changes of a law its tests catch: `python -m tests.mutants MODULE TEST [EVERY]`, as in

    python -m tests.mutants quadstep.control.loop_shaping tests/test_control_h_infinity.py

In each mutant one place of a function is changed: a sign, a term, a factor, an order of arguments, a bound left out, an index.
It counts as caught where the tests fail; those that survive are printed. EVERY: try only one in so many.
"""

import ast
import importlib
import os
import signal
import sys
import types
from pathlib import Path

import pytest

from quadstep.terminal.screen import say

MOST_SECONDS = 120
"""Of a processor's time, after which the tests of a mutant count as failed."""

BOUNDS = ("project", "within", "clip", "maximum", "minimum", "conjugate", "transposed", "sqrt")
"""Functions that a mutant goes without: its first argument stands for them."""

ORDERED = ("cross", "multiply", "product", "outer")
"""Functions whose first two arguments a mutant changes places of."""


class Mutation(ast.NodeTransformer):
    """Changes the place of this number. what: that was done, empty where there is no such place."""

    def __init__(self, number: int) -> None:
        self.left, self.what = number, ""

    def here(self, node: ast.AST, what: str) -> bool:
        """Whether it is this place."""
        self.left -= 1
        if self.left == -1:
            self.what = f"line {getattr(node, 'lineno', 0)}: {what}"
        return self.left == -1

    def visit_Module(self, node: ast.Module) -> ast.AST:
        """Constants and imports stay."""
        node.body = [self.visit(one) if isinstance(one, ast.FunctionDef | ast.ClassDef) else one for one in node.body]
        return node

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.AST:
        """Declared gains stay."""
        node.body = [self.visit(one) if isinstance(one, ast.FunctionDef) else one for one in node.body]
        return node

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        """Annotations stay."""
        node.body = [self.visit(one) for one in node.body]
        return node

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        """Signs, terms, factors."""
        self.generic_visit(node)
        text = ast.unparse(node)
        if isinstance(node.op, ast.Add | ast.Sub):
            if self.here(node, f"other sign in {text}"):
                return ast.copy_location(
                    ast.BinOp(node.left, ast.Sub() if isinstance(node.op, ast.Add) else ast.Add(), node.right), node
                )
            if self.here(node, f"no first term in {text}"):
                return node.right
            if self.here(node, f"no second term in {text}"):
                return node.left
        if isinstance(node.op, ast.Mult | ast.Div) and self.here(node, f"no second factor in {text}"):
            return node.left
        return node

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.AST:
        """A minus."""
        self.generic_visit(node)
        return node.operand if isinstance(node.op, ast.USub) and self.here(node, f"no minus in {ast.unparse(node)}") else node

    def visit_Subscript(self, node: ast.Subscript) -> ast.AST:
        """An index of a vector: its neighbour's."""
        self.generic_visit(node)
        index = node.slice
        if (
            isinstance(index, ast.Constant)
            and index.value in (0, 1)
            and self.here(node, f"other index in {ast.unparse(node)}")
        ):
            return ast.copy_location(ast.Subscript(node.value, ast.Constant(1 - index.value), node.ctx), node)
        return node

    def visit_Call(self, node: ast.Call) -> ast.AST:
        """A bound, an order."""
        self.generic_visit(node)
        name, text = ast.unparse(node.func), ast.unparse(node)
        if name in BOUNDS and self.here(node, f"without {text}"):
            return node.args[0]
        if name in ORDERED and self.here(node, f"other order in {text}"):
            return ast.copy_location(ast.Call(node.func, node.args[::-1], node.keywords), node)
        return node


def mutants(source: str):
    """Each: what was changed, and the tree."""
    number = 0
    while True:
        mutation = Mutation(number)
        tree = ast.fix_missing_locations(mutation.visit(ast.parse(source)))
        if not mutation.what:
            return
        yield mutation.what, tree
        number += 1


def caught(module: types.ModuleType, tree: ast.Module, test: str) -> bool:
    """Whether the tests fail where the module is this, in a process of its own."""
    child = os.fork()
    if child == 0:
        signal.setitimer(signal.ITIMER_PROF, MOST_SECONDS)
        quiet = os.open(os.devnull, os.O_WRONLY)
        os.dup2(quiet, 1)
        os.dup2(quiet, 2)
        code = 1
        try:
            exec(compile(tree, module.__file__ or "", "exec"), module.__dict__)
            code = int(pytest.main(["-x", "-q", "-p", "no:cacheprovider", test]))
        finally:
            os._exit(code)
    return os.waitpid(child, 0)[1] != 0


def main(name: str, test: str, every: int = 1) -> None:
    """Count them."""
    module = importlib.import_module(name)
    source = Path(str(module.__file__)).read_text(encoding="utf-8")
    assert not caught(module, ast.parse(source), test), "the tests fail without any change"
    tried, survived = 0, 0
    for what, tree in list(mutants(source))[::every]:
        tried += 1
        if not caught(module, tree, test):
            survived += 1
            say(f"survived: {what}")
        sys.stdout.flush()
    say(f"{tried - survived} of {tried} caught")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]) if len(sys.argv) > 3 else 1)
