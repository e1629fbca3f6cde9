"""`quadstep study completion`: checks the statements on random states, flies the grid, and writes a folder with both."""

from pathlib import Path
from typing import NamedTuple

from quadstep.io.version import __version__
from quadstep.proofs.theory.adverse import StatementMargin, check_statements
from quadstep.proofs.theory.comparison import (
    COMPLETED,
    LAWS,
    PAPER,
    UNCOUNTERED,
    ComparisonSummary,
    GridFlight,
    disturbance_over_weight,
    grid,
    summarise,
)
from quadstep.proofs.theory.map import draw_map
from quadstep.report import page
from quadstep.report.pool import drawing_pool
from quadstep.report.publish import MANIFEST, publishing, write_json
from quadstep.report.tables import write_csv

NAME = "The completed controller"
GRID = ("K_r2[N m s]", "Lambda2[1/s]", "t_f[s]", "scale[-]", "nets", "law", "rmse[m]", "ended[s]")
"""Columns of a cell."""


class Completion(NamedTuple):
    """The results. summaries: each law compared with the paper's. uncountered: the completed law without its counter-term
    compared with the completed law.

    over_weight: largest disturbance at scale 1 over the weight, by t_f [s].
    """

    margins: list[StatementMargin]
    cells: list[GridFlight]
    summaries: dict[str, ComparisonSummary]
    uncountered: ComparisonSummary
    over_weight: dict[float, float]


def study_completion(folder: Path, samples: int, overwrite: bool) -> Completion:
    """Check, fly, and write `folder`. Raises UserError."""
    with publishing(folder, f"completion {samples}", overwrite) as out, drawing_pool() as pool:
        cells = grid()
        summaries = {law: summarise(cells, law) for law in LAWS if law != PAPER}
        drawn = pool.submit(draw_map, out, cells)
        uncountered = summarise(cells, UNCOUNTERED, COMPLETED)
        found = Completion(check_statements(samples), cells, summaries, uncountered, disturbance_over_weight())
        write_csv(out / "grid.csv", GRID, cells)
        write_json(out / MANIFEST, as_json(found))
        drawn.result()
        page.write_page(out / "report.html", NAME, sections(out, found), "Study")
    return found


def as_json(found: Completion) -> dict[str, object]:
    """The content of metrics.json."""
    return {
        "name": NAME,
        "version": __version__,
        "statements": [{**margin._asdict(), "holds": margin.holds, "bites": margin.bites} for margin in found.margins],
        "beside_the_paper": {law: summary._asdict() for law, summary in found.summaries.items()},
        "without_counter_term_beside_the_completed": found.uncountered._asdict(),
        "disturbance_over_weight": {f"{t:g}": ratio for t, ratio in found.over_weight.items()},
    }


def sentences(found: Completion) -> list[str]:
    """The findings in words, with their numbers."""
    u = found.uncountered
    forbidden = ", ".join(f"{t:g} s ({ratio:.1f} times)" for t, ratio in found.over_weight.items() if ratio > 1.0)
    return [
        f"{sum(m.holds for m in found.margins)} of {len(found.margins)} statements hold on "
        f"{found.margins[0].samples} random closed loops and where a search brings them nearest to failing; "
        f"{sum(m.bites for m in found.margins)} fail if any term of their bound is made a tenth smaller.",
        *(
            f"Of {s.flights} flights the paper's law completes {s.other_flies}, '{law}' {s.law_flies}: {s.gained} gained, "
            f"{s.lost} lost. Where both fly, its RMSE is {s.best_ratio:.2g} to {s.worst_ratio:.4g} times the paper's; "
            f"it is worse by more than 1 % in {s.worse}."
            for law, s in found.summaries.items()
        ),
        f"Without its counter-term the completed law flies {u.law_flies} of these {u.flights}, with it {u.other_flies}; where "
        f"both fly, its RMSE is {u.best_ratio:.4g} to {u.worst_ratio:.4g} times that with it (median {u.median_ratio:.3g}).",
        f"Along the path the disturbance at scale 1 exceeds the weight for t_f = {forbidden or 'none'}; at scale 5 it is five "
        "times that.",
    ]


def sections(out: Path, found: Completion) -> list[str]:
    """The body of report.html."""
    margins: list[list[page.Cell]] = [
        [m.number, m.statement, f"{m.worst:.2g}", least_reached(m), str(m.samples), verdict(m)] for m in found.margins
    ]
    first, *others = sentences(found)
    return [
        page.summary(first, (), [page.figure(out / "completion.svg", "RMSE of the controllers over the grid; x: diverged")]),
        *(page.paragraph(sentence) for sentence in others),
        page.heading("Statements of the theorem on closed loops", "statements"),
        page.paragraph(
            "Worst margin relative to the terms it is made of; a negative one of up to 1e-9 is round-off. Used up: the "
            "least share of a term of the bound that some closed loop needs; above 0.9 the statement fails with 0.9 of "
            "any term."
        ),
        page.table(["number", "statement", "worst margin", "used up", "samples", "verdict"], margins),
    ]


def least_reached(margin: StatementMargin) -> str:
    """The least share of a term of the bound that is used up."""
    return f"{min(margin.reached.values()):.3f}"


def verdict(margin: StatementMargin) -> tuple[str, str]:
    """Text and class of a verdict."""
    if not margin.holds:
        return ("broken", "fails")
    return ("holds", "holds") if margin.bites else ("holds, not tight", "fails")
