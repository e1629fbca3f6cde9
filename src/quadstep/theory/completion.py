"""`quadstep study completion`: the inequalities on random states, the grid of flights, a folder with both."""

from pathlib import Path
from typing import NamedTuple

from quadstep import __version__
from quadstep.report import page
from quadstep.report.pool import drawing_pool
from quadstep.report.publish import MANIFEST, publishing, write_json
from quadstep.report.tables import write_csv
from quadstep.theory.comparison import LAWS, PAPER, Cell, Summary, disturbance_over_weight, grid, summarise
from quadstep.theory.inequalities import Margin, check_inequalities
from quadstep.theory.map import draw_map

NAME = "The completed controller"
GRID = ("K_r2[N m s]", "Lambda2[1/s]", "t_f[s]", "scale[-]", "nets", "law", "rmse[m]", "ended[s]")
"""Columns of a cell."""


class Completion(NamedTuple):
    """What was found. summaries: of each law beside the paper's.

    over_weight: largest disturbance at scale 1 over the weight, by t_f [s].
    """

    margins: list[Margin]
    cells: list[Cell]
    summaries: dict[str, Summary]
    over_weight: dict[float, float]


def study_completion(folder: Path, samples: int, overwrite: bool) -> Completion:
    """Check, fly, and write `folder`. Raises UserError."""
    with publishing(folder, f"completion {samples}", overwrite) as out, drawing_pool() as pool:
        cells = grid()
        summaries = {law: summarise(cells, law) for law in LAWS if law != PAPER}
        drawn = pool.submit(draw_map, out, cells)
        found = Completion(check_inequalities(samples), cells, summaries, disturbance_over_weight())
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
        "inequalities": [{**margin._asdict(), "holds": margin.holds} for margin in found.margins],
        "beside_the_paper": {law: summary._asdict() for law, summary in found.summaries.items()},
        "disturbance_over_weight": {f"{t:g}": ratio for t, ratio in found.over_weight.items()},
    }


def sentences(found: Completion) -> list[str]:
    """The finding in words, with its numbers."""
    forbidden = ", ".join(f"{t:g} s ({ratio:.1f} times)" for t, ratio in found.over_weight.items() if ratio > 1.0)
    return [
        f"{sum(m.holds for m in found.margins)} of {len(found.margins)} inequalities hold on "
        f"{found.margins[0].samples} random closed loops.",
        *(
            f"Of {s.flights} flights the paper's law completes {s.paper_flies}, '{law}' {s.law_flies}: {s.gained} gained, "
            f"{s.lost} lost. Where both fly, its RMSE is {s.best_ratio:.2g} to {s.worst_ratio:.4g} times the paper's; "
            f"it is worse by more than 1 % in {s.worse}."
            for law, s in found.summaries.items()
        ),
        f"Along the path the disturbance at scale 1 exceeds the weight for t_f = {forbidden or 'none'}; at scale 5 it is five "
        "times that.",
    ]


def sections(out: Path, found: Completion) -> list[str]:
    """The body of report.html."""
    margins: list[list[page.Cell]] = [
        [m.number, m.statement, f"{m.worst:.2g}", str(m.samples), verdict(m)] for m in found.margins
    ]
    first, *others = sentences(found)
    return [
        page.summary(first, (), [page.figure(out / "completion.svg", "RMSE of the controllers over the grid; x: diverged")]),
        *(page.paragraph(sentence) for sentence in others),
        page.heading("Inequalities of the theorem on random closed loops", "inequalities"),
        page.paragraph("Worst margin relative to the terms it is made of; a negative one of 1e-9 or less is round-off."),
        page.table(["number", "statement", "worst margin", "samples", "verdict"], margins),
    ]


def verdict(margin: Margin) -> tuple[str, str]:
    """Text and class of a verdict."""
    return ("holds", "holds") if margin.holds else ("broken", "fails")
