"""What is proved: a statement written out of the code's own arithmetic."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple, cast

from proofs.terms import Term, coq, generalised, term, variable, variables
from quadstep.numbers import Matrix, Number, Vector, flatten


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

    def generalised(self, names: Mapping[Term, Term]) -> "Claim":
        """With these parts replaced by variables."""
        sides = [Vector(cast(float, generalised(side, names)) for side in column) for column in zip(*self.pairs, strict=True)]
        return Claim(sides[0], self.relation, sides[1])

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


class Setting(NamedTuple):
    """What some statements suppose: parts with names, and what is given.

    name: of the Coq predicate. base: supposed too. later: parts with names whose meaning the settings on top of it say.
    """

    name: str
    given: tuple[Claim, ...]
    names: tuple[tuple[Term, Term], ...]
    base: "Setting | None" = None
    later: tuple[tuple[Term, Term], ...] = ()

    @property
    def named(self) -> dict[Term, Term]:
        """The name of each part, of the base's too."""
        return {**(self.base.named if self.base else {}), **{part: name for name, part in (*self.names, *self.later)}}

    @property
    def meant(self) -> list[tuple[str, Term]]:
        """What each of its own names is, said with the other names."""
        named = self.named
        others = {part: {p: n for p, n in named.items() if p is not part} for _, part in self.names}
        return [(str(name.leaf), generalised(part, others[part])) for name, part in self.names]

    @property
    def claims(self) -> list[Claim]:
        """What its names are, and what is given."""
        meant = (Claim(variable(name), "=", part) for name, part in self.meant)
        return [*meant, *(claim.generalised(self.named) for claim in self.given)]

    @property
    def variables(self) -> set[str]:
        """Of everything."""
        return variables_of(self.claims) | (self.base.variables if self.base else set())

    @property
    def hypotheses(self) -> list[str]:
        """In Coq; the base by its name."""
        return [*([self.base.text] if self.base else []), *(claim.text for claim in self.claims)]

    @property
    def text(self) -> str:
        """In Coq, by its name."""
        return " ".join([self.name, *sorted(self.variables)])

    @property
    def definition(self) -> str:
        """As Coq's definition."""
        claims = " /\\\n  ".join(self.hypotheses)
        return f"Definition {self.name} ({' '.join(sorted(self.variables))} : R) : Prop :=\n  {claims}.\n"


@dataclass(frozen=True)
class Stated(ABC):
    """What Coq is to prove. name: of the proposition, which a theorem `NAME_holds` proves. says: in words."""

    name: str
    says: str

    @property
    def settings(self) -> list[Setting]:
        """Those that it supposes, each after its base, its own last."""
        return [Setting("", (), ())]

    @property
    @abstractmethod
    def prop(self) -> str:
        """The proposition in Coq."""

    @property
    def definition(self) -> str:
        """As Coq's definition."""
        return f"(* {self.says} *)\nDefinition {self.name} : Prop :=\n  {self.prop}.\n"


@dataclass(frozen=True)
class Statement(Stated):
    """For all values of every variable: where what is given holds, the claim holds."""

    claim: Claim
    given: Setting

    @property
    def claimed(self) -> Claim:
        """The claim, said with the names."""
        return self.claim.generalised(self.given.named)

    @property
    def settings(self) -> list[Setting]:
        """The bases of what is given, and that."""
        found, setting = [self.given], self.given.base
        while setting:
            found, setting = [setting, *found], setting.base
        return found

    @property
    def prop(self) -> str:
        """The proposition in Coq."""
        names = sorted(variables_of([self.claimed]) | self.given.variables)
        quantifier = f"forall {' '.join(names)} : R,\n  " if names else ""
        return quantifier + " ->\n  ".join([*self.given.hypotheses, self.claimed.text])


def variables_of(claims: Iterable[Claim]) -> set[str]:
    """Of both sides of all of them."""
    return {name for claim in claims for pair in claim.pairs for side in pair for name in variables(side)}


def state(
    name: str,
    says: str,
    claim: Claim,
    given: Iterable[Claim] = (),
    names: Mapping[str, object] | None = None,
    base: Setting | None = None,
) -> Statement:
    """A statement. names, base: as of a setting."""
    return Statement(name, says, claim, suppose("", given, names, base))


def suppose(
    name: str,
    given: Iterable[Claim],
    names: Mapping[str, object] | None = None,
    base: Setting | None = None,
    later: Mapping[str, object] | None = None,
) -> Setting:
    """A setting. names, later: numbers, vectors and matrices to be called NAME, NAMEi and NAMEij; what has a name keeps it."""
    taken = {part for part in base.named if part not in {part for _, part in base.later}} if base else set()

    def called(parts: Mapping[str, object] | None) -> tuple[tuple[Term, Term], ...]:
        found = []
        for prefix, value in (parts or {}).items():
            for suffix, part in indexed(value):
                if term(part).parts and term(part) not in taken:
                    found.append((term(variable(prefix + suffix)), term(part)))
                    taken.add(term(part))
        return tuple(found)

    return Setting(name, tuple(given), called(names), base, called(later))


def indexed(value: object) -> list[tuple[str, Number]]:
    """The entries with their indices, counted from 1."""
    if isinstance(value, Vector):
        return [(f"{i + 1}", entry) for i, entry in enumerate(value)]
    if isinstance(value, Matrix):
        return [(f"{i + 1}{k + 1}", entry) for i, row in enumerate(value) for k, entry in enumerate(row)]
    return [("", cast(float, value))]
