"""`quadstep study completion`: checks the statements on random states, flies the grid, and writes a folder with both.

Loops that come nearest to violating a statement are searched for: random ones, then from the best of them. A bound is tight
where some closed loop comes near it, so each term of a bound is tested where the others leave it the least room. Every
statement must hold there, and must fail if a term is made a tenth smaller.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib import rcParams
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from quadstep.io import __version__
from quadstep.metrics.verdict import Case
from quadstep.proofs.theory.inequalities import STATEMENTS, Sides, Statement
from quadstep.proofs.theory.trials import (
    COMPLETED,
    COUNTER_ONLY,
    DIMENSIONS,
    INNER_LOOPS,
    LAWS,
    PAPER,
    SCALES,
    TIMES,
    UNCOUNTERED,
    ComparisonSummary,
    Cube,
    GridFlight,
    disturbance_over_weight,
    draw_sample,
    grid,
    sample_at,
    summarise,
)
from quadstep.report import markup
from quadstep.report.canvas import drawing, write
from quadstep.report.evidence import Evidence, Figure, TableSection
from quadstep.report.pool import drawing_pool
from quadstep.report.publish import publishing, write_csv
from quadstep.report.sheet import Sheet
from quadstep.report.units import counted, label

CHUNK = 50_000
ROUND_OFF = 1e-9
"""Relative margin that rounding may cost."""

LANES, STEPS, ENOUGH = 24, 400, 0.95
"""Of a search: closed loops per term, the largest number of steps, and the share of every term that ends it."""

FACTOR = 0.9
"""A statement must fail once a term of its bound is scaled by this."""


class StatementMargin(NamedTuple):
    """A statement: its number in docs/theory.md, its text, its worst relative margin (negative: violated), samples.

    reached: for each term of its bound, the share of it that some closed loop uses up; of an equation, 1 where it is not zero.
    """

    number: str
    statement: str
    worst: float
    samples: int
    reached: dict[str, float]

    @property
    def holds(self) -> bool:
        """Whether it held on every sample, up to round-off."""
        return self.worst >= -ROUND_OFF

    @property
    def bites(self) -> bool:
        """Whether it fails when any term of the bound is made a tenth smaller."""
        return all(share > FACTOR for share in self.reached.values())


class StatementRecord:
    """Results for a statement so far: the worst margin, and the share of each term that was used up."""

    def __init__(self) -> None:
        self.worst, self.reached = np.inf, dict[str, float]()

    def look(self, sides: list[Sides]) -> list[Cube]:
        """Add a batch. Returns, for each term of an inequality, how much of it is left, one number per closed loop."""
        left = []
        for part, side in enumerate(sides):
            size = np.maximum(side.size, 1e-300)
            self.worst = float(np.minimum(self.worst, np.min(side.slack / size)))  # no number where one is none
            for name, term in side.terms.items():
                counts = np.abs(term) > 1e-6 * size
                spare = np.where(counts, side.slack / np.maximum(np.abs(term), 1e-300), np.inf)
                key = name if part == 0 else f"{name} ({part + 1})"
                found = float(np.any(counts)) if side.equal else 1.0 - float(np.min(np.broadcast_to(spare, np.shape(size))))
                self.reached[key] = max(self.reached.get(key, -np.inf), found)
                if not side.equal:
                    left.append(np.broadcast_to(spare, np.shape(size)))
        return left


def search(statement: Statement, record: StatementRecord, seed: int = 1) -> Cube:
    """Move closed loops towards those where a term of the bound is used up, LANES of them for each term. Returns the last."""
    draw = np.random.default_rng([seed, int(statement.number[1:])])
    cube: Cube = draw.random((DIMENSIONS, LANES))
    groups = len(record.look(statement.sides(sample_at(cube))))
    cube = np.tile(cube, max(groups, 1))
    owner, lane = np.repeat(np.arange(groups), LANES), np.arange(groups * LANES)
    best, trial = np.full(groups * LANES, np.inf), cube
    for _ in range(STEPS if groups else 0):
        spare = np.array(record.look(statement.sides(sample_at(trial))))[owner, lane]
        better = spare < best
        best, cube = np.where(better, spare, best), np.where(better, trial, cube)
        if best.reshape(groups, LANES).min(axis=1).max() < 1.0 - ENOUGH:
            break
        trial = moved(cube, best.reshape(groups, LANES), draw)
    return cube


def moved(cube: Cube, best: Cube, draw: np.random.Generator) -> Cube:
    """Closed loops near the best so far: some numbers of each shifted, taken from a better one, or set to zero error."""
    groups, lanes = best.shape
    count = groups * lanes
    changed = draw.random(cube.shape) < 10.0 ** draw.uniform(-2.3, -0.3, count)
    size = 10.0 ** draw.uniform(-2.5, -0.5, count)
    leader = np.argmin(best, axis=1).repeat(lanes) + np.arange(groups).repeat(lanes) * lanes
    kind = draw.integers(0, 4, count)
    stepped = np.clip(cube + size * draw.standard_normal(cube.shape), 0.0, 1.0)
    other = draw.integers(0, lanes, count) + np.arange(groups).repeat(lanes) * lanes
    along = np.clip(cube + draw.random(count) * (cube[:, leader] - cube[:, other]), 0.0, 1.0)
    towards = 0.5 + (cube - 0.5) * draw.random(count)
    ends = (cube > 0.5).astype(float)
    new = np.choose(kind, [stepped, along, towards, ends + (cube - ends) * draw.random(count)])
    return np.where(changed, new, cube)


def check_statements(samples: int = 1_000_000, seed: int = 1) -> list[StatementMargin]:
    """Every statement over random closed loops and over those that a search finds nearest to its bound."""
    seen = {statement.number: StatementRecord() for statement in STATEMENTS}
    done = 0
    while done < samples:
        count = min(CHUNK, samples - done)
        sample = draw_sample(seed * 1_000_003 + done, count)
        for statement in STATEMENTS:
            seen[statement.number].look(statement.sides(sample))
        done += count
    for statement in STATEMENTS:
        search(statement, seen[statement.number], seed)
    return [StatementMargin(s.number, s.says, seen[s.number].worst, samples, seen[s.number].reached) for s in STATEMENTS]


DARKEST, LIGHTEST = 3.0, -2.0
"""log10 of RMSE [mm] at the ends of the grey scale."""


def draw_map(folder: Path, cells: list[GridFlight]) -> None:
    """completion.png and completion.svg: inner loop down, t_f across; a block for each scale, nets and law, but for those in
    which all is lost.
    """
    found = {cell[:6]: cell for cell in cells}
    with drawing(Sheet(), {"axes.grid": False}):
        flown = {(cell.nets, cell.scale) for cell in cells if cell.rmse is not None}
        blocks = [(nets, scale) for nets in (True, False) for scale in SCALES if (nets, scale) in flown]
        figure = Drawing(figsize=(2.75 * len(LAWS), 2.2 * len(blocks)))
        grid = figure.subplots(len(blocks), len(LAWS), squeeze=False)
        figure.subplots_adjust(0.07, 0.045, 0.995, 0.965, 0.4, 0.45)
        for row, (nets, scale) in enumerate(blocks):
            for axes, law in zip(grid[row], LAWS, strict=True):
                draw_block(axes, [[found[(*inner, t, scale, nets, law)].rmse for t in TIMES] for inner in INNER_LOOPS])
                axes.set_title(f"{law}\nnets {'on' if nets else 'off'}, scale {scale:g}")
                axes.set_xticks(range(len(TIMES)), [f"{t:g}" for t in TIMES])
                axes.set_yticks(range(len(INNER_LOOPS)), [f"{k:g}, {s:g}" for k, s in INNER_LOOPS])
                axes.set_ylabel(f"{label('K_r2')} [N m s], {label('Lambda2')} [1/s]", parse_math=True)
        for axes in grid[-1]:
            axes.set_xlabel(label("t_f") + " [s]", parse_math=True)
        write(figure, folder / "completion", Sheet())


def draw_block(axes: Axes, block: list[list[float | None]]) -> None:
    """One table of cells on a logarithmic grey scale, numbers written in; of none, what there is to say."""
    levels = np.array([[np.nan if v is None else np.log10(1e3 * v) for v in row] for row in block])
    axes.imshow(levels, cmap="Greys", vmin=LIGHTEST, vmax=DARKEST + 1.5, aspect="auto")
    axes.tick_params(length=0)
    if np.isnan(levels).all():
        axes.text(0.5, 0.5, "all flights lost", transform=axes.transAxes, ha="center", va="center")
        return
    for i, row in enumerate(block):
        for j, value in enumerate(row):
            text = "x" if value is None else f"{1e3 * value:.2g}" if value < 0.1 else f"{1e3 * value:.0f}"
            dark = value is not None and levels[i, j] > 2.2
            colour, size = "white" if dark else "black", rcParams["legend.fontsize"]
            axes.text(j, i, text, ha="center", va="center", fontsize=size, color=colour)


NAME = "The completed controller"
GRID = ("K_r2[N m s]", "Lambda2[1/s]", "t_f[s]", "scale[-]", "nets", "law", "rmse[m]", "ended[s]")
"""Columns of a cell."""


class Completion(NamedTuple):
    """The results. summaries: each law compared with the paper's. uncountered: the completed law without its counter-term
    compared with the completed law.

    over_weight: largest disturbance at scale 1 over the weight, by t_f [s].
    """

    margins: list[StatementMargin]
    summaries: dict[str, ComparisonSummary]
    uncountered: ComparisonSummary
    over_weight: dict[float, float]


def study_completion(folder: Path, samples: int, overwrite: bool) -> Evidence:
    """Check, fly, and write `folder`; what was found, judged by every statement. Raises UserError."""
    with publishing(folder, f"completion {samples}", overwrite) as out, drawing_pool() as pool:
        cells = grid()
        summaries = {law: summarise(cells, law) for law in LAWS if law != PAPER}
        drawn = pool.submit(draw_map, out, cells)
        uncountered = summarise(cells, UNCOUNTERED, COMPLETED)
        found = evidence(Completion(check_statements(samples), summaries, uncountered, disturbance_over_weight()))
        write_csv(out / "grid.csv", GRID, cells)
        drawn.result()
        found.write(out)
    return found


def as_json(completion: Completion) -> dict[str, object]:
    return {
        "name": NAME,
        "version": __version__,
        "statements": [{**margin._asdict(), "holds": margin.holds, "bites": margin.bites} for margin in completion.margins],
        "beside_the_paper": {law: summary._asdict() for law, summary in completion.summaries.items()},
        "without_counter_term_beside_the_completed": completion.uncountered._asdict(),
        "disturbance_over_weight": {f"{t:g}": ratio for t, ratio in completion.over_weight.items()},
    }


NAMED = {
    COUNTER_ONLY: "the law with only the counter-term added",
    COMPLETED: "the completed law",
    UNCOUNTERED: "the completed law without counter-term",
}
"""Laws in a sentence."""


def sentences(completion: Completion) -> list[str]:
    """The findings in words, with their numbers."""
    u = completion.uncountered
    forbidden = ", ".join(f"{t:g} s ({ratio:.1f} times)" for t, ratio in completion.over_weight.items() if ratio > 1.0)
    return [
        f"{sum(m.holds for m in completion.margins)} of {len(completion.margins)} statements hold on "
        f"{completion.margins[0].samples:,} random closed loops and where a search brings them nearest to failing; "
        f"{sum(m.bites for m in completion.margins)} fail if any term of their bound is made a tenth smaller.",
        *(
            f"Of {s.flights} flights the paper's law completes {s.other_flies}, {NAMED[law]} {s.law_flies}: {s.gained} "
            f"gained, {s.lost} lost. Where both complete, the RMSE of {NAMED[law]} is {s.best_ratio:.2g} to "
            f"{s.worst_ratio:.4g} times that of the paper's law; it is larger by more than 1 % in "
            f"{counted(s.worse, 'flight')}."
            for law, s in completion.summaries.items()
        ),
        f"Without its counter-term the completed law flies {u.law_flies} of these {u.flights}, with it {u.other_flies}; where "
        f"both fly, its RMSE is {u.best_ratio:.4g} to {u.worst_ratio:.4g} times that with it (median {u.median_ratio:.3g}).",
        f"Along the path the disturbance at scale 1 exceeds the weight for t_f = {forbidden or 'none'}; at scale 5 it is five "
        "times that.",
    ]


HEADER = ("number", "statement", "worst margin", "used up", "samples", "verdict")
STATED = (
    "Worst margin relative to the terms it is made of; a negative one of up to 1e-9 is round-off. Used up: the least share of "
    "a term of the bound that some closed loop needs; above 0.9 the statement fails with 0.9 of any term."
)
MAPPED = (
    "Position RMSE [mm]; x: lost. Case 1's path in t_f, then 5 s at its end. Scales and nets with which every flight is lost "
    "are not drawn. The completed laws fly where the paper's is lost."
)
SEEN = "The theorem on closed loops, random and sought out"


def evidence(completion: Completion) -> Evidence:
    rows: list[list[markup.Cell]] = [
        [m.number, m.statement, f"{m.worst:.2g}", f"{min(m.reached.values()):.3f}", f"{m.samples:,}", verdict(m)]
        for m in completion.margins
    ]
    first, *others = sentences(completion)
    failing = [m.number for m in completion.margins if not (m.holds and m.bites)]
    return Evidence(
        name=NAME,
        kind="Study",
        answer=first,
        sentences=[first, *others],
        record=as_json(completion),
        figures=[Figure("completion", MAPPED)],
        sections=[TableSection("Statements of the theorem on closed loops", "statements", HEADER, rows, STATED, shown=SEEN)],
        cases=(Case("every statement", ", ".join(failing) or None),),
        more=others,
    )


def verdict(margin: StatementMargin) -> tuple[str, str]:
    """Text and class of a verdict."""
    if not margin.holds:
        return ("broken", "fails")
    return ("holds", "holds") if margin.bites else ("holds, not tight", "fails")
