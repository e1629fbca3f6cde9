"""What a row of the verification is: one equation, where it lives in the code, the verdict, and the evidence for it."""

from collections.abc import Callable
from enum import StrEnum
from typing import NamedTuple


class Verdict(StrEnum):
    """What is said of an equation."""

    AS_PRINTED = "as printed"
    CORRECTED = "corrected"
    PROOF_STEP = "proof step, checked numerically"
    DEFINITION = "definition"


class Check(NamedTuple):
    """One thing that was tried: what, what had to come out, what came out."""

    what: str
    expected: str
    found: str
    holds: bool


class Evidence(NamedTuple):
    """The checks of a row, and the numbers of the case in which the printed form fails (empty where it never does)."""

    checks: list[Check]
    counterexample: str = ""


class Row(NamedTuple):
    """An equation of the paper.

    number: 1 to 75, or the name of what has no number. printed: the paper's form, in plain text.
    where: the function that holds it, `module:function`, or the one that a step of the proof is about.
    """

    number: str
    what: str
    printed: str
    where: str
    verdict: Verdict
    reason: str
    gather: Callable[[], Evidence]


class Result(NamedTuple):
    """A row with its evidence."""

    row: Row
    evidence: Evidence

    @property
    def passed(self) -> bool:
        """Whether there is evidence and all of it holds."""
        return bool(self.evidence.checks) and all(check.holds for check in self.evidence.checks)

    @property
    def failure(self) -> str:
        """What was expected and what was found, for the first check that fails."""
        failing = [check for check in self.evidence.checks if not check.holds]
        return f"{failing[0].what}: expected {failing[0].expected}, found {failing[0].found}" if failing else "no evidence"


def judge(row: Row) -> Result:
    """The row with its evidence gathered; evidence that cannot be gathered counts as a failed check."""
    try:
        return Result(row, row.gather())
    except Exception as error:  # a law that cannot even be evaluated is what this command has to report
        check = Check("evidence", "no error", f"{type(error).__name__}: {error}".partition("\n")[0], False)
        return Result(row, Evidence([check]))


def row(
    rows: list[Row], number: str, what: str, printed: str, where: str, verdict: Verdict, reason: str = ""
) -> Callable[[Callable[[], Evidence]], Callable[[], Evidence]]:
    """Adds to `rows` the row whose evidence the function below gathers."""

    def add(gather: Callable[[], Evidence]) -> Callable[[], Evidence]:
        rows.append(Row(number, what, printed, f"quadstep.{where}", verdict, reason, gather))
        return gather

    return add
