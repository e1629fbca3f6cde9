"""A row of the verification: one equation, where it lives in the code, the verdict, and the evidence for it.

Evidence compares what the code computes with what the paper prints. Differences that are polynomials in symbols, sines and
cosines are proved zero by expanding them and substituting 1 - sin^2 for cos^2. All others are evaluated at random points to
40 digits.
"""

import random
from collections.abc import Callable, Iterable, Sequence
from enum import StrEnum
from typing import NamedTuple, TypeAlias

import mpmath
import numpy as np
import sympy
from numpy.typing import NDArray
from sympy.core.relational import Relational

from quadstep.numbers import Matrix, Vector, flatten


class EquationVerdict(StrEnum):
    AS_PRINTED = "as printed"
    CORRECTED = "corrected"
    PROOF_STEP = "proof step, checked numerically"
    DEFINITION = "definition"


class Check(NamedTuple):
    """One check: what was checked, the expected result, the result found."""

    what: str
    expected: str
    found: str
    holds: bool


class Checks(NamedTuple):
    """The checks of a row, and the numbers of the case in which the printed form fails (empty where it never does)."""

    checks: list[Check]
    counterexample: str = ""


class EquationRow(NamedTuple):
    """An equation of the paper.

    number: 1 to 75, or a name for items without a number. printed: the paper's form, in plain text.
    where: the function that implements it, `module:function`, or the one that a step of the proof is about.
    """

    number: str
    what: str
    printed: str
    where: str
    verdict: EquationVerdict
    reason: str
    gather: Callable[[], Checks]


class JudgedRow(NamedTuple):
    row: EquationRow
    evidence: Checks

    @property
    def passed(self) -> bool:
        return bool(self.evidence.checks) and all(check.holds for check in self.evidence.checks)

    @property
    def failure(self) -> str:
        """The expected and the found result of the first check that fails."""
        failing = [check for check in self.evidence.checks if not check.holds]
        return f"{failing[0].what}: expected {failing[0].expected}, found {failing[0].found}" if failing else "no evidence"


def judge(row: EquationRow) -> JudgedRow:
    """The row with its evidence gathered; evidence that cannot be gathered counts as a failed check."""
    try:
        return JudgedRow(row, row.gather())
    except Exception as error:  # a law that cannot even be evaluated must be reported by this command
        check = Check("evidence", "no error", f"{type(error).__name__}: {error}".partition("\n")[0], False)
        return JudgedRow(row, Checks([check]))


ROWS: list[EquationRow] = []
"""Of all modules that have been loaded."""


def row(
    number: str, what: str, printed: str, where: str, verdict: EquationVerdict, reason: str = ""
) -> Callable[[Callable[[], Checks]], Callable[[], Checks]]:
    """Decorator: adds to `ROWS` a row whose evidence the decorated function gathers."""

    def add(gather: Callable[[], Checks]) -> Callable[[], Checks]:
        ROWS.append(EquationRow(number, what, printed, f"quadstep.{where}", verdict, reason, gather))
        return gather

    return add


Expression: TypeAlias = sympy.Basic | sympy.MatrixBase
"""A SymPy expression, matrix or number. SymPy has no types, so mypy checks nothing about it."""

DIGITS = 40
TOLERANCE = mpmath.mpf(10) ** -28
POINTS = 3


def symbols(name: str, count: int = 3, positive: bool = False) -> Vector:
    return Vector(sympy.Symbol(f"{name}_{i + 1}", real=True, positive=positive or None) for i in range(count))


def symbol(name: str, positive: bool = True) -> Expression:
    return sympy.Symbol(name, real=True, positive=positive or None)


def entries(thing: Expression) -> list[Expression]:
    """Every entry of numbers, vectors and matrices, in order."""
    if isinstance(thing, list | tuple) and not hasattr(thing, "_fields"):
        return [entry for part in thing for entry in entries(part)]
    if isinstance(thing, sympy.MatrixBase):
        return list(thing)
    return flatten(thing)


def array(thing: Vector | Matrix) -> Expression:
    """A vector or matrix of the laws as a SymPy matrix."""
    return sympy.Matrix([list(row) for row in thing] if isinstance(thing, Matrix) else list(thing)).applyfunc(exact)


def exact(expression: Expression) -> Expression:
    """The same with every float as its exact fraction."""
    expression = sympy.sympify(expression)
    return expression.xreplace({number: sympy.Rational(float(number)) for number in expression.atoms(sympy.Float)})


def branch(expression: Expression, at: dict[Expression, Expression]) -> Expression:
    """The piece of a piecewise expression that holds at a point."""
    expression = sympy.sympify(expression)
    return expression.xreplace({test: test.subs(at) for test in expression.atoms(Relational)})


def reduced(expression: Expression) -> Expression | None:
    """The expanded form with cos^2 = 1 - sin^2, zero only if the expression is; None for anything but such a polynomial."""
    expression = exact(expression)
    angles = sorted({wave.args[0] for wave in expression.atoms(sympy.sin, sympy.cos)}, key=str)
    names = [(sympy.Dummy(f"s{i}"), sympy.Dummy(f"c{i}")) for i in range(len(angles))]
    waves = dict(zip([f(angle) for angle in angles for f in (sympy.sin, sympy.cos)], sum(names, ()), strict=True))
    plain = expression.xreplace(waves)
    if any(not power.exp.is_Integer or power.exp < 0 for power in plain.atoms(sympy.Pow)) or plain.has(
        sympy.Function, sympy.Piecewise, sympy.exp
    ):
        return None
    generators = sorted(plain.free_symbols, key=lambda s: (s.name, str(s)))
    if not generators:
        return sympy.expand(plain)
    polynomial = sympy.Poly(plain, *generators, domain=sympy.QQ)
    ring = sympy.polys.rings.PolyRing([f"g{i}" for i in range(len(generators))], sympy.QQ, sympy.lex)
    element, places = ring.from_dict(dict(polynomial.terms())), dict(zip(generators, ring.gens, strict=True))
    circles = [places[c] ** 2 + places.get(s, ring.zero) ** 2 - 1 for s, c in names if c in places and s in places]
    if circles:
        element = element.rem(circles)
    back = {name: wave for wave, name in waves.items()}
    return sympy.sympify(element.as_expr(*[back.get(g, g) for g in generators]))


def random_point(names: Iterable[Expression], seed: int) -> dict[Expression, Expression]:
    """A fraction for each symbol: in (0.3, 2) for positive ones, else in (-1.2, 1.2)."""
    draw = random.Random(seed)
    low_high = {True: (30, 200), None: (-120, 120)}
    point = {}
    for name in sorted(names, key=str):
        point[name] = sympy.Rational(draw.randint(*low_high[name.is_positive]) * 2 + 1, 200)
    return point


def values(expressions: Sequence[Expression], point: dict[Expression, Expression]) -> list[Expression]:
    """The expressions at a point, in 40 digits."""
    names = list(point)
    with mpmath.workdps(DIGITS):
        at = [mpmath.mpf(value.p) / value.q for value in map(sympy.Rational, point.values())]
        results = sympy.lambdify(names, [exact(e) for e in expressions], "mpmath", cse=True)(*at)
        return [mpmath.mpmathify(result) for result in results]


def number(expression: Expression, point: dict[Expression, Expression]) -> float:
    return float(values([expression], point)[0])


def difference(ours: Expression, theirs: Expression) -> tuple[bool, str]:
    """Whether two things are equal entry by entry, and how that was established."""
    a, b = entries(ours), entries(theirs)
    if len(a) != len(b):
        return False, f"{len(a)} entries against {len(b)}"
    gaps = [x - y for x, y in zip(a, b, strict=True)]
    if all(reduced(gap) == 0 for gap in gaps):
        return True, "difference 0, expanded"
    names = set().union(*(sympy.sympify(e).free_symbols for e in (*a, *b)))
    worst = mpmath.mpf(0)
    for seed in range(POINTS):
        point = random_point(names, seed)
        for place, (x, y) in enumerate(zip(values(a, point), values(b, point), strict=True)):
            gap, size = abs(x - y), 1 + abs(x) + abs(y)
            if not gap <= TOLERANCE * size:
                return False, f"entry {place + 1} is {short(x)} instead of {short(y)} at a random point"
            worst = max(worst, gap)
    return True, f"largest difference {short(worst)} at {POINTS} random points, {DIGITS} digits"


def same(what: str, ours: Expression, theirs: Expression) -> Check:
    """Check: two things are equal, identically in every symbol."""
    holds, found = difference(ours, theirs)
    return Check(what, "equal", found, holds)


def unlike(what: str, ours: Expression, theirs: Expression) -> Check:
    """Check: two things are not equal (the printed form fails)."""
    equal, found = difference(ours, theirs)
    return Check(what, "different", found, not equal)


def near(what: str, found: Expression | float, expected: float, tolerance: float = 5e-4) -> Check:
    """Check: a number comes out as expected, to `tolerance` of its size (of 1 for small ones)."""
    return Check(what, short(expected), short(found), bool(abs(found - expected) <= tolerance * max(1.0, abs(expected))))


def holds(what: str, truth: object, found: str = "", expected: str = "true") -> Check:
    return Check(what, expected, found or str(bool(truth)).lower(), bool(truth))


def agree(what: str, ours: NDArray[np.float64], theirs: NDArray[np.float64]) -> Check:
    """Check: two batches are the same, relative to their size."""
    gap = float(np.max(np.abs(ours - theirs) / (1.0 + np.abs(theirs))))
    return holds(what, ours.shape == theirs.shape and gap < 1e-10, f"off by {gap:.0e} at {len(ours)} closed loops", "equal")


def short(number: Expression | float) -> str:
    return f"{float(number) + 0.0:.4g}"


def listed(numbers: Iterable[Expression]) -> str:
    """Numbers in four digits, in brackets."""
    return "(" + ", ".join("0" if abs(float(number)) < 1e-12 else short(number) for number in numbers) + ")"


def along(expression: Expression, flow: dict[Expression, Expression]) -> Expression:
    """Time derivative of an expression, or of each entry of a vector or matrix, when its symbols move as `flow` says."""
    if isinstance(expression, Vector | Matrix):
        return type(expression)(along(part, flow) for part in expression)
    expression = sympy.sympify(expression)
    return sum((sympy.diff(expression, name) * rate for name, rate in flow.items()), sympy.S.Zero)


def flow_of(*pairs: tuple[Expression, Expression]) -> dict[Expression, Expression]:
    """Which symbol moves how fast, from pairs (symbols, their rates)."""
    return {name: rate for names, rates in pairs for name, rate in zip(entries(names), entries(rates), strict=True)}
