"""What is proved: a statement written out of the code's own arithmetic."""

from collections.abc import Iterable
from typing import NamedTuple

from quadstep.numbers import Matrix, Vector, flatten
from quadstep.numbers.terms import Term, coq, term, variable, variables


class Statement(NamedTuple):
    """name: of the Coq proposition, which a theorem `NAME_holds` proves. says: in words. prop: the proposition."""

    name: str
    says: str
    prop: str

    @property
    def definition(self) -> str:
        """As Coq's definition."""
        return f"(* {self.says} *)\nDefinition {self.name} : Prop :=\n  {self.prop}.\n"


def vector_of(name: str, count: int = 3) -> Vector:
    """A vector of variables NAME1, NAME2, ..."""
    return Vector(variable(f"{name}{i + 1}") for i in range(count))


def matrix_of(name: str, rows: int = 3, columns: int = 3) -> Matrix:
    """A matrix of variables NAMEij."""
    return Matrix(Vector(variable(f"{name}{i + 1}{j + 1}") for j in range(columns)) for i in range(rows))


class Claim(NamedTuple):
    """left relation right, in numbers; of vectors and matrices entry by entry."""

    left: object
    relation: str
    right: object

    @property
    def pairs(self) -> list[tuple[Term, Term]]:
        """Entry by entry."""
        return list(zip(map(term, flatten(self.left)), map(term, flatten(self.right)), strict=True))

    @property
    def text(self) -> str:
        """In Coq."""
        return " /\\ ".join(f"{coq(a)} {self.relation} {coq(b)}" for a, b in self.pairs)


def equal(left: object, right: object) -> Claim:
    """They are equal, entry by entry."""
    return Claim(left, "=", right)


def at_most(left: object, right: object) -> Claim:
    """left <= right."""
    return Claim(left, "<=", right)


def above(left: object, right: object) -> Claim:
    """left > right."""
    return Claim(left, ">", right)


def differs(left: object, right: object) -> Claim:
    """They are not equal."""
    return Claim(left, "<>", right)


def state(name: str, says: str, claim: Claim, given: Iterable[Claim] = ()) -> Statement:
    """For all values of every variable: where what is given holds, the claim holds."""
    given = tuple(given)
    names: dict[str, None] = {}
    for part in (*given, claim):
        for pair in part.pairs:
            for side in pair:
                for found in variables(side):
                    names.setdefault(found)
    hypotheses = "".join(f"{part.text} ->\n  " for part in given)
    quantifier = f"forall {' '.join(sorted(names))} : R,\n  " if names else ""
    return Statement(name, says, f"{quantifier}{hypotheses}{claim.text}")
