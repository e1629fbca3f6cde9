"""Formulas as numbers: pass them to a law, and the result is the law's own arithmetic, to be written for a proof checker.

Nothing is simplified and nothing is decided: a term is what the code does, operation by operation, over the real numbers.
`coq` writes it for Coq, `gappa` for Gappa with a rounding after each operation, as floats have it. Equal terms are one object.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from functools import reduce
from typing import ClassVar, TypeAlias, cast

from quadstep.numbers.kinds import Number
from quadstep.numbers.operation import OPERATIONS, Kind, Operation, Rule
from quadstep.program.operations import FORMS

Operand: TypeAlias = "Term | float | int | Fraction"


Infix: TypeAlias = "Callable[[Term, Operand], Term]"


def infix(op: str) -> tuple[Infix, Infix]:
    """An operator of two numbers, and the same with the term at the right; vectors and matrices have their own."""

    def written(left: Operand, right: Operand) -> Term:
        if isinstance(left, Term | float | int | Fraction) and isinstance(right, Term | float | int | Fraction):
            return Term(op, term(left), term(right))
        return NotImplemented

    return written, lambda right, left: written(left, right)


class Term:
    """An operation on other terms; a leaf is a variable ("var") or a constant ("const"), with its name or exact value."""

    __slots__ = ("leaf", "op", "parts")
    op: str
    parts: tuple[Term, ...]
    leaf: str | Fraction
    functions: ClassVar[Functions]
    known: ClassVar[dict[tuple[object, ...], Term]] = {}

    def __new__(cls, op: str, *parts: Term, leaf: str | Fraction = "") -> Term:
        key = (op, leaf, *map(id, parts))
        found = cls.known.get(key)
        if found is None:
            found = object.__new__(cls)
            found.op, found.parts, found.leaf = op, parts, leaf
            cls.known[key] = found
        return found

    __add__, __radd__ = infix("+")
    __sub__, __rsub__ = infix("-")
    __mul__, __rmul__ = infix("*")
    __truediv__, __rtruediv__ = infix("/")
    __lt__, __le__, __gt__, __ge__ = (infix(one)[0] for one in ("<", "<=", ">", ">="))

    def __pow__(self, count: int) -> Term:
        return reduce(Term.__mul__, [self] * count)

    def __neg__(self) -> Term:
        return Term("negative", self)

    def __abs__(self) -> Term:
        return Term("magnitude", self)

    def __bool__(self) -> bool:
        raise TypeError("a law chooses with `where`, not with `if`")

    def __repr__(self) -> str:
        return coq(self)


class Functions(Kind):
    """The functions of `quadstep.numbers` for terms."""

    @staticmethod
    def rule(operation: Operation) -> Rule:
        return lambda _, *given: Term(operation.name, *map(term, given))

    def sqrt(self, x: Operand) -> Term:
        return Term("sqrt", term(x))

    def where(self, condition: Term | bool, yes: Operand, no: Operand) -> Operand:
        """Decided at once where the condition is known."""
        if isinstance(condition, bool):
            return yes if condition else no
        return Term("where", condition, term(yes), term(no))


Term.functions = Functions()


def term(value: Operand | Number) -> Term:
    """A number as a term; a float is the fraction that it is."""
    return value if isinstance(value, Term) else Term("const", leaf=Fraction(value))


def variable(name: str) -> Number:
    """A variable, as a number that laws take."""
    return cast(float, Term("var", leaf=name))  # the type checker reads a law as if it were over floats


def generalised(root: Number | Term, names: Mapping[Term, Term], opaque: frozenset[str] = frozenset()) -> Term:
    """The term with the given parts replaced by variables, and every call of an `opaque` function by one for its argument.

    Whatever holds for the result for all values of the variables holds for the term.
    """
    done: dict[int, Term] = {id(old): new for old, new in names.items()}

    def replaced(node: Term) -> Term:
        found = done.get(id(node))
        if found is None:
            if node.op in ("var", "const"):
                found = node
            elif node.op in opaque:
                found = Term("var", leaf=f"{node.op}_{len([key for key in OPAQUE if key[0] == node.op])}")
                found = OPAQUE.setdefault((node.op, *map(id, node.parts)), found)
            else:
                found = Term(node.op, *map(replaced, node.parts))
            done[id(node)] = found
        return found

    return replaced(term(root))


OPAQUE: dict[tuple[object, ...], Term] = {}
"""The variable that stands for a call of an opaque function, everywhere the same."""


def variables(root: Term) -> list[str]:
    """Names of the variables of a term, each once, in order of appearance."""
    found: dict[str, None] = {}
    seen: set[int] = set()

    def walk(node: Term) -> Iterator[str]:
        if id(node) in seen:
            return
        seen.add(id(node))
        if node.op == "var":
            yield str(node.leaf)
        for part in node.parts:
            yield from walk(part)

    for name in walk(root):
        found.setdefault(name)
    return list(found)


def constant(value: Fraction) -> str:
    """A fraction in the notation of Coq and Gappa's expressions."""
    text = str(abs(value.numerator)) if value.denominator == 1 else f"({abs(value.numerator)} / {value.denominator})"
    return f"(- {text})" if value < 0 else text


def coq(root: Term) -> str:
    """The term in Coq's notation for reals."""
    if root.op in ("var", "const"):
        return constant(root.leaf) if isinstance(root.leaf, Fraction) else root.leaf
    parts = [coq(part) for part in root.parts]
    if root.op in OPERATIONS:
        return f"({OPERATIONS[root.op].coq} {' '.join(parts)})"
    return FORMS[root.op].coq.format(*parts)


def gappa(root: Term, rounding: str, lines: list[str]) -> str:
    """The term in Gappa's notation, one rounded operation per line added to `lines`; its name is returned.

    A factor that is a power of two, and a change of sign, are exact: Gappa knows.
    """
    done: dict[int, str] = {}

    def written(node: Term) -> str:
        if node.op in ("var", "const"):
            return decimal(node.leaf) if isinstance(node.leaf, Fraction) else node.leaf
        if id(node) not in done:
            inside = [written(part) for part in node.parts]
            text = f"-{inside[0]}" if node.op == "negative" else f" {node.op} ".join(inside)
            name = f"t{len(lines)}"
            lines.append(f"{name} = {text};" if node.op == "negative" else f"{name} = {rounding}({text});")
            done[id(node)] = name
        return done[id(node)]

    return written(root)


def decimal(value: Fraction) -> str:
    """A float's value for Gappa: a whole number times a power of two."""
    power = value.denominator.bit_length() - 1
    if value.denominator != 1 << power:
        raise ValueError(f"{value} is not a float")
    return f"{value.numerator}b-{power}" if power else str(value.numerator)
