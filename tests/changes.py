"""Small changes of the source of a function, one at a time: an operator, a sign, a constant, an index, an argument, a term."""

import ast
import copy
from collections.abc import Callable, Iterator
from typing import NamedTuple

SYMMETRIC = ("maximum", "inner", "np.maximum", "abs", "plus")
"""Functions whose arguments may change places."""

SWAPPED = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult}
TURNED = {ast.Gt: ast.Lt, ast.Lt: ast.Gt, ast.GtE: ast.Gt, ast.LtE: ast.Lt}


def changes(node: ast.AST) -> Iterator[ast.AST]:
    """What a node can become."""
    if isinstance(node, ast.BinOp) and type(node.op) in SWAPPED:
        yield ast.BinOp(node.left, SWAPPED[type(node.op)](), node.right)
        if isinstance(node.op, ast.Add | ast.Sub):
            yield node.left
            yield node.right
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        yield node.operand
    elif isinstance(node, ast.Compare) and type(node.ops[0]) in TURNED:
        yield ast.Compare(node.left, [TURNED[type(node.ops[0])]()], node.comparators)
    elif isinstance(node, ast.Constant) and type(node.value) is float:
        yield ast.Constant(node.value * 1.1 if node.value else 0.1)
    elif isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Constant) and type(node.slice.value) is int:
        for other in {0, 1, 2} - {node.slice.value}:
            yield ast.Subscript(node.value, ast.Constant(other), node.ctx)
    elif isinstance(node, ast.Call) and ast.unparse(node.func) not in SYMMETRIC:
        for i in range(len(node.args) - 1):
            yield ast.Call(node.func, [*node.args[:i], node.args[i + 1], node.args[i], *node.args[i + 2 :]], node.keywords)
    else:
        yield from of_the_other_loop(node)


def of_the_other_loop(node: ast.AST) -> Iterator[ast.AST]:
    """A name that ends in 1 or 2, with the other of the two."""
    other = {"1": "2", "2": "1"}
    if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Load) and node.attr[-2:] in ("_1", "_2"):
        yield ast.Attribute(node.value, node.attr[:-1] + other[node.attr[-1]], node.ctx)
    elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load) and len(node.id) > 1 and node.id[-1] in other:
        yield ast.Name(node.id[:-1] + other[node.id[-1]], node.ctx)


class Replace(ast.NodeTransformer):
    """One node for another."""

    def __init__(self, old: ast.AST, new: ast.AST) -> None:
        self.old, self.new = old, new

    def visit(self, node: ast.AST) -> ast.AST:
        return self.new if node is self.old else super().visit(node)


def annotations(function: ast.FunctionDef) -> set[int]:
    """Identities of the nodes that stand in a type."""
    types_of = [function.returns, *(a.annotation for a in ast.walk(function.args) if isinstance(a, ast.arg))]
    types_of += [n.annotation for n in ast.walk(function) if isinstance(n, ast.AnnAssign)]
    return {id(part) for whole in types_of if whole for part in ast.walk(whole)}


class Change(NamedTuple):
    """Of the function that begins in a line: its node of this number, in the order of `ast.walk`, becomes another."""

    function: str
    line: int
    node: int
    was: str
    now: str
    becomes: ast.AST

    def tree(self, source: str) -> ast.Module:
        """The module of this source with the change."""
        tree = ast.parse(source)
        (there,) = [f for f in ast.walk(tree) if isinstance(f, ast.FunctionDef) and f.lineno == self.line]
        target = list(ast.walk(there))[self.node]
        new = ast.fix_missing_locations(ast.copy_location(copy.deepcopy(self.becomes), target))
        Replace(target, new).visit(there)
        return tree


def changes_of(function: ast.FunctionDef, made: Callable[[ast.AST], Iterator[ast.AST]] = changes) -> Iterator[Change]:
    """Every change of a function. made: what a node can become."""
    types_in = annotations(function)
    for place, node in enumerate(ast.walk(function)):
        for change in made(node):
            was, now = ast.unparse(node), ast.unparse(change)
            if was != now and id(node) not in types_in:
                yield Change(function.name, function.lineno, place, was, now, change)
