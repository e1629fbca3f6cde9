"""All rows in the order of the paper, and how to run them; what `quadstep verify` prints of them, and as `python -m
quadstep.proofs.verify.registry` `docs/errata.md` and what the article quotes.
"""

import json
from collections.abc import Callable
from pathlib import Path

from quadstep.io.errors import UserError
from quadstep.io.files import write_beside
from quadstep.proofs.verify import (  # noqa: F401 (each adds its rows)
    attitude_loop,
    bounds,
    forces,
    inversion,
    own_laws,
    paths,
    plant,
    position_loop,
    remarks,
    stability,
)
from quadstep.proofs.verify.equation_row import ROWS, EquationRow, EquationVerdict, JudgedRow, judge
from quadstep.report.mathml import dollars

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
    failed = sum(not result.passed for result in results)
    checks = sum(len(result.evidence.checks) for result in results)
    wrong = sum(result.row.verdict is EquationVerdict.CORRECTED for result in results)
    corrected = f" {wrong} {'row is' if wrong == 1 else 'rows are'} wrong in the paper and corrected here." if wrong else ""
    rows = "1 row" if len(results) == 1 else f"{len(results)} rows"
    ending = f"{failed} of {rows} FAILED ({checks} checks" if failed else f"All checks pass ({checks} in {rows}"
    return f"{ending}, {seconds:.1f} s).{corrected}"


def document(results: list[JudgedRow], seconds: float) -> dict[str, object]:
    """All rows, their checks and numbers, for `--json`."""
    return {
        "passed": all(result.passed for result in results),
        "seconds": round(seconds, 1),
        "rows": [
            {
                **{name: said for name, said in result.row._asdict().items() if name != "gather"},
                "counterexample": result.evidence.counterexample,
                "passed": result.passed,
                "checks": [check._asdict() for check in result.evidence.checks],
            }
            for result in results
        ],
    }


EQUATIONS = 75

FOLLOWS = {
    "T_eta": 4, "rotor signs": 5, "tau": 5, "thrust direction": 7, "chi_1": 22, "delta": 26, "eta_d_dot": 28, "chi_2": 33,
    "assumption (a)": 52, "gain conditions": 53, "F_1, F_2": 54, "compact set": 65, "arbitrarily small": 65,
    "least jerk": 75, "[11]": 75, "conclusion": 75, "completed law": 75, "rotation law": 75,
}  # fmt: skip
"""Items without a number in the paper, and the equation that each belongs to."""


def place(row: EquationRow) -> tuple[int, int]:
    """Where a row stands in the order of the paper."""
    names = list(FOLLOWS)
    return (int(row.number), 0) if row.number.isdigit() else (FOLLOWS[row.number], 1 + names.index(row.number))


def all_rows() -> list[EquationRow]:
    """Every row, in the order of the paper."""
    return sorted(ROWS, key=place)


def chosen(only: str | None) -> list[EquationRow]:
    """All rows, or the one with this number or name. Raises UserError if there is none."""
    rows = all_rows()
    if only is None:
        return rows
    found = [row for row in rows if row.number.lower() == only.strip().lower()]
    if not found:
        raise UserError(f"--only {only}: no such row; allowed: 1 to {EQUATIONS} and {', '.join(repr(n) for n in FOLLOWS)}")
    return found


def verify(rows: list[EquationRow], progress: Callable[[int], None] = lambda _: None) -> list[JudgedRow]:
    """Each row with its evidence. progress: called after each row with the number of rows done."""
    results: list[JudgedRow] = []
    for row in rows:
        results.append(judge(row))
        progress(len(results))
    return results


PAGE, FACTS = Path("docs/errata.md"), Path("src/quadstep/proofs/article/facts.json")

OPENING = """\
# Errata of the paper, equation by equation

A. Das, F. Lewis, K. Subbarao, "Backstepping Approach for Controlling a Quadrotor Using Lagrange Form Dynamics" (2009),
checked against the code of this package: `quadstep verify` evaluates the functions that fly with symbols (for the steps of
the proof, at random moments of flight) and compares the results with the printed equations. What is not listed here holds as
printed; docs/reference/equations.md has every equation with its place in the code. `make errata` writes this page; do not edit
it.

Dots, hats and transposes may have been lost in the copy of the paper that was read (Eqs 2, 29, 60): there the slip may not be
the authors'. $s_\\theta$ and $c_\\theta$ are $\\sin\\theta$ and $\\cos\\theta$; angles are in the order
$(\\psi, \\theta, \\phi)$.
"""


def row_of(*cells: str) -> str:
    return "| " + " | ".join(dollars(cell).replace("|", "\\|") for cell in cells) + " |"


def table(header: tuple[str, ...], lines: list[tuple[str, ...]]) -> str:
    return "\n".join([row_of(*header), "|" + "---|" * len(header), *(row_of(*line) for line in lines)]) + "\n"


def row_name(result: JudgedRow) -> str:
    return f"Eq. {result.row.number}" if result.row.number.isdigit() else result.row.number


def page(results: list[JudgedRow]) -> str:
    wrong = [r for r in results if r.row.verdict is EquationVerdict.CORRECTED]
    kept = [r for r in results if r.row.verdict is not EquationVerdict.CORRECTED and r.evidence.counterexample]
    noted = [
        r for r in results if r.row.verdict is not EquationVerdict.CORRECTED and not r.evidence.counterexample and r.row.reason
    ]
    return "\n".join([
        OPENING,
        f"## Corrected ({len(wrong)})\n",
        table(("where", "printed", "what is wrong, what is right", "counterexample"),
              [(row_name(r), r.row.printed, r.row.reason, r.evidence.counterexample) for r in wrong]),
        "## Kept as printed, with a limit\n",
        table(("where", "printed", "limit", "numbers"),
              [(row_name(r), r.row.printed, r.row.reason, r.evidence.counterexample) for r in kept]),
        "## Notes\n",
        table(("where", "printed", "note"), [(row_name(r), r.row.printed, r.row.reason) for r in noted]),
    ])  # fmt: skip


def facts(results: list[JudgedRow]) -> str:
    """What the article quotes of the rows (`proofs/article/`), as JSON: counts, and what is wrong with each corrected row."""
    wrong = [r for r in results if r.row.verdict is EquationVerdict.CORRECTED]
    found = {
        "rows": len(results),
        "checks": sum(len(r.evidence.checks) for r in results),
        "wrong": {row_name(r): [r.row.printed, r.row.reason, r.evidence.counterexample] for r in wrong},
    }
    return json.dumps(found, indent=1, ensure_ascii=False) + "\n"


def main() -> None:
    results = verify(all_rows())
    write_beside(PAGE, page(results))
    write_beside(FACTS, facts(results))


if __name__ == "__main__":
    main()
