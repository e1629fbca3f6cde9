"""The grid as a picture: RMSE in every cell, a cross where the flight diverged."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from quadstep.proofs.theory.comparison import INNER_LOOPS, LAWS, SCALES, TIMES, GridFlight
from quadstep.report.canvas import drawing, write
from quadstep.report.sheet import Sheet
from quadstep.report.symbols import label

DARKEST, LIGHTEST = 3.0, -2.0
"""log10 of RMSE [mm] at the ends of the grey scale."""


def draw_map(folder: Path, cells: list[GridFlight]) -> None:
    """completion.png and completion.svg: inner loop down, t_f across; a block for each scale, nets and law."""
    found = {cell[:6]: cell for cell in cells}
    with drawing(Sheet(), {"axes.grid": False}):
        figure = Figure(figsize=(5.8 * len(LAWS), 8.2))
        grid = figure.subplots(len(SCALES), 2 * len(LAWS))
        figure.subplots_adjust(0.07, 0.06, 0.995, 0.9, 0.06, 0.28)
        for row, scale in enumerate(SCALES):
            for column, (nets, law) in enumerate((nets, law) for nets in (True, False) for law in LAWS):
                block = [[found[(*inner, t, scale, nets, law)].rmse for t in TIMES] for inner in INNER_LOOPS]
                axes = grid[row][column]
                draw_block(axes, block)
                axes.set_title(f"{law}, nets {'on' if nets else 'off'}, scale {scale:g}", fontsize=9)
                axes.set_yticks(range(len(INNER_LOOPS)), [f"{k:g}, {s:g}" for k, s in INNER_LOOPS] if column == 0 else [])
                axes.set_xticks(range(len(TIMES)), [f"{t:g}" for t in TIMES])
            grid[row][0].set_ylabel(f"{label('K_r2')} [N m s], {label('Lambda2')} [1/s]", parse_math=True)
        for axes in grid[-1]:
            axes.set_xlabel(label("t_f") + " [s]", parse_math=True)
        figure.text(0.01, 0.965, "Position RMSE [mm]; x: diverged. Case 1's way in t_f, held for 5 s", fontsize=11)
        write(figure, folder / "completion", Sheet())


def draw_block(axes: Axes, block: list[list[float | None]]) -> None:
    """One table of cells on a logarithmic grey scale, numbers written in."""
    levels = np.array([[np.nan if v is None else np.log10(1e3 * v) for v in row] for row in block])
    axes.imshow(levels, cmap="Greys", vmin=LIGHTEST, vmax=DARKEST + 1.5, aspect="auto")
    axes.tick_params(length=0)
    for i, row in enumerate(block):
        for j, value in enumerate(row):
            text = "x" if value is None else f"{1e3 * value:.2g}" if value < 0.1 else f"{1e3 * value:.0f}"
            dark = value is not None and levels[i, j] > 2.2
            axes.text(j, i, text, ha="center", va="center", fontsize=8, color="white" if dark else "black")
