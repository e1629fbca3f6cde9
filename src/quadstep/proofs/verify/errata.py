"""`docs/errata.md` and what the article quotes, made from the rows: `python -m quadstep.proofs.verify.errata`."""

import json
from pathlib import Path

from quadstep.io.atomic import write_beside
from quadstep.proofs.verify.registry import all_rows, verify
from quadstep.proofs.verify.rows import EquationVerdict, JudgedRow

PAGE, FACTS = Path("docs/errata.md"), Path("src/quadstep/proofs/article/facts.json")

OPENING = """\
# Errata of the paper, equation by equation

A. Das, F. Lewis, K. Subbarao, "Backstepping Approach for Controlling a Quadrotor Using Lagrange Form Dynamics" (2009),
checked against the code of this package. `quadstep verify` evaluates the functions that fly with symbols (for the steps of
the proof, at random moments of flight) and compares the results with the printed equations. `make errata` writes this page
from the same rows; do not edit it.

Dots, hats and transposes may have been lost in the copy of the paper that was read (Eqs 2, 29, 60): there the slip may not be
the authors'. s_th, c_th are sin theta, cos theta; the order of angles is (psi, theta, phi).
"""


def row_of(*cells: str) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


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
        "## Every row\n",
        table(("number", "what", "where in the code", "verdict", "checks"),
              [(r.row.number, r.row.what, f"`{r.row.where}`", r.row.verdict if r.passed else "FAILED",
                str(len(r.evidence.checks))) for r in results]),
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
