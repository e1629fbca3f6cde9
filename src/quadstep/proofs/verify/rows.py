"""A row of the verification: one equation, where it lives in the code, the verdict, and the evidence for it."""

from collections.abc import Callable
from enum import StrEnum
from typing import NamedTuple


class EquationVerdict(StrEnum):
    """Verdict on an equation."""

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
    """A row with its evidence."""

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


def row(
    rows: list[EquationRow], number: str, what: str, printed: str, where: str, verdict: EquationVerdict, reason: str = ""
) -> Callable[[Callable[[], Checks]], Callable[[], Checks]]:
    """Decorator: adds to `rows` a row whose evidence the decorated function gathers."""

    def add(gather: Callable[[], Checks]) -> Callable[[], Checks]:
        rows.append(EquationRow(number, what, printed, f"quadstep.{where}", verdict, reason, gather))
        return gather

    return add
