"""Mutants of tests/mutations.py that may survive, and why."""

COMPLETED, ROTATION = "control.completed_backstepping", "control.rotation_backstepping"
NETS_ON = "where(t >= {0}.learning_start, 1.0, 0.0) -> where(1.0, t >= {0}.learning_start, 0.0)"
EQUIVALENT = {
    f"{COMPLETED}.law: {NETS_ON.format('paper')}": "a condition counts as 1 or 0",
    f"control.backstepping.law: {NETS_ON.format('gains')}": "a condition counts as 1 or 0",
    f"{ROTATION}.follow: {NETS_ON.format('gains')}": "a condition counts as 1 or 0",
    f"{ROTATION}.pull: {NETS_ON.format('gains')}": "a condition counts as 1 or 0",
    f"{ROTATION}.pull: 0.0 -> 0.1": "rates that go into the wanted attitude, of which only the rotation is used",
    f"{ROTATION}.share_made: 1e-06 -> 1.1e-06": "keeps a quotient finite where nothing was asked for",
    "theory.inequalities.coupling_bound: 1.0 -> 1.1": "the size beside which round-off is judged",
    "theory.inequalities.column_bounds: 1.0 -> 1.1": "the size beside which round-off is judged (the bound itself is caught)",
    "theory.inequalities.column_bounds: 0.0 * column[0] + 1.0 -> 1.0": "one number for a batch of them",
    "theory.inequalities.column_bounds: column[": "any entry makes a batch",
    "theory.inequalities.column_bounds: coupling_columns(tilt, wanted) -> coupling_columns(wanted, tilt)": "as true",
    "theory.inequalities.trace_bound: sample.": "any matrices",
    "theory.inequalities.trace_bound: sum_squares(error) ": "the size beside which round-off is judged",
    "theory.inequalities.small_gain: paper.": "any positive numbers",
    "control.projection.shrink: 1.0 -> 1.1": "stands for a length in a quotient that is not chosen",
    "vehicle.lagrange.effective_inertia: scaled_rows(inertia, rates) -> ": "the factors of a product",
    "vehicle.lagrange.effective_inertia_partials: scaled_rows(inertia, euler": "the factors of a product",
    "vehicle.lagrange.coriolis_torque: zip(rates, slopes, strict=True) -> ": "the factors of a product",
    "control.networks.basis: zip(row, chi, strict=False) -> zip(chi, row, strict=False)": "the factors of a product",
    "theory.lyapunov.closed_loop: 0.0 -> 0.1": "the time given to the law, whose nets learn from 0 on",
    "theory.lyapunov.closed_loop: zip(state.rates, partials, strict=True) -> ": "the factors of a product",
    "theory.lyapunov.lyapunov_rate: coupling_columns(Vector(sample.state": "B e2 is the same: both are n(eta_f) - n(eta)",
    "theory.lyapunov.lyapunov_rate: 0.0 -> 0.1": "n does not depend on yaw; a lag that is not used",
    "theory.lyapunov.lyapunov_rate: sample.gains.coupling[0] -> ": "any p > 0 for the paper's law",
    "theory.lyapunov.lyapunov_rate: p[0] -> ": "for the paper's law P = p I",
    "theory.region.bounds_of: sine >= 1 -> sine > 1": "J >= 0 alone: its form is not definite, which refuses as well",
}
"""How the names of mutants begin that change no number, or leave a statement as true as it was, and why."""
