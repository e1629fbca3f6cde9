"""Output of `quadstep verify`: cells of the table, the closing line, the JSON file."""

import json
from pathlib import Path

from quadstep.io.atomic import check_place, write_beside
from quadstep.io.errors import UserError
from quadstep.io.files import JSON, read_bytes
from quadstep.proofs.verify.rows import EquationVerdict, JudgedRow

HEADER = ("number", "what", "where", "verdict", "reason")


def summary(results: list[JudgedRow]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Header and rows of a table that counts the rows with each verdict, and how many of them hold."""
    rows: list[tuple[str, ...]] = []
    for verdict in EquationVerdict:
        of_kind = [result for result in results if result.row.verdict is verdict]
        checks = sum(len(result.evidence.checks) for result in of_kind)
        passed = sum(result.passed for result in of_kind)
        rows.append((verdict.value, str(len(of_kind)), str(checks), str(passed), str(len(of_kind) - passed)))
    return ("verdict", "rows", "checks", "hold", "fail"), rows


def cells(result: JudgedRow) -> tuple[str, ...]:
    """One row of the table; a failing row states what was expected and what was found."""
    row = result.row
    verdict = row.verdict if result.passed else f"FAILED ({row.verdict})"
    return row.number, row.what, row.where.removeprefix("quadstep."), verdict, explanation(result)


def explanation(result: JudgedRow) -> str:
    """The reason, with the counterexample's numbers, or what failed."""
    if not result.passed:
        return result.failure
    return "; ".join(part for part in (result.row.reason, result.evidence.counterexample) if part)


def closing(results: list[JudgedRow], seconds: float) -> str:
    """Counts and seconds."""
    failed = sum(not result.passed for result in results)
    checks = sum(len(result.evidence.checks) for result in results)
    ending = f"{failed} FAILED" if failed else "all evidence holds"
    rows = "1 row" if len(results) == 1 else f"{len(results)} rows"
    return f"{rows}, {checks} checks, {seconds:.1f} s: {ending}"


def document(results: list[JudgedRow], seconds: float) -> dict[str, object]:
    """Everything, for the JSON file."""
    return {
        "passed": all(result.passed for result in results),
        "seconds": round(seconds, 1),
        "rows": [
            {
                "number": result.row.number,
                "what": result.row.what,
                "printed": result.row.printed,
                "where": result.row.where,
                "verdict": result.row.verdict,
                "reason": result.row.reason,
                "counterexample": result.evidence.counterexample,
                "passed": result.passed,
                "checks": [check._asdict() for check in result.evidence.checks],
            }
            for result in results
        ],
    }


def check_target(path: Path) -> None:
    """Raises UserError at once if the JSON file cannot be written."""
    check_place(path)
    if path.exists() and b'"rows"' not in read_bytes(path, JSON):
        raise UserError(f"{path}: exists and is not a document of `quadstep verify`; name another file")


def write_document(path: Path, results: list[JudgedRow], seconds: float) -> None:
    """The JSON file."""
    write_beside(path, json.dumps(document(results, seconds), indent=2, allow_nan=False) + "\n")
