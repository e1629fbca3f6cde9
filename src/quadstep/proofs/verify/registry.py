"""All rows in the order of the paper, and how to run them."""

from collections.abc import Callable

from quadstep.io.errors import UserError
from quadstep.proofs.verify import (
    attitude_loop,
    bounds,
    completed,
    coupling,
    forces,
    inversion,
    paths,
    plant,
    position_loop,
    reference_11,
    remarks,
    rotation,
    rotor_rows,
    stability,
)
from quadstep.proofs.verify.rows import EquationRow, JudgedRow, judge

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
    parts = (
        plant,
        forces,
        rotor_rows,
        position_loop,
        coupling,
        attitude_loop,
        inversion,
        stability,
        bounds,
        paths,
        reference_11,
        remarks,
        completed,
        rotation,
    )
    return sorted((row for part in parts for row in part.ROWS), key=place)


def chosen(only: str | None) -> list[EquationRow]:
    """All rows, or the one with this number or name. Raises UserError if there is none."""
    rows = all_rows()
    if only is None:
        return rows
    found = [row for row in rows if row.number.lower() == only.strip().lower()]
    if not found:
        raise UserError(f"--only {only}: no such row; allowed are 1 to {EQUATIONS} and {', '.join(repr(n) for n in FOLLOWS)}")
    return found


def verify(rows: list[EquationRow], progress: Callable[[int], None] = lambda _: None) -> list[JudgedRow]:
    """Each row with its evidence. progress: called after each row with the number of rows done."""
    results: list[JudgedRow] = []
    for row in rows:
        results.append(judge(row))
        progress(len(results))
    return results
