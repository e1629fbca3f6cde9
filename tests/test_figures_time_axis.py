"""Panels above each other share their time axis: its numbers stand below the lowest, its grid in all."""

from pathlib import Path

import numpy as np
import pytest

from quadstep.report import figures
from quadstep.report.panel import Panel
from quadstep.report.sheet import Sheet

T = np.linspace(0.0, 40.0, 81)


def drawn(monkeypatch, panels, columns, log_time=False):
    """The axes of a figure, column by column, and whether each is the lowest of its column."""
    kept = []
    monkeypatch.setattr(figures, "write", lambda figure, *_: kept.append(figure))
    figures.save(Path("none"), T, [Panel("x", "m", {"x": np.sin(T)})] * panels, columns, Sheet(), log_time)
    kept[0].draw_without_rendering()
    assert kept[0].axes[0].get_position().x1 > 0.95 or panels > 1  # a lone panel has no room for another beside it
    return [axes for axes in kept[0].axes if axes.get_visible()]


def grid_of(axes):
    """Where vertical lines of the grid stand."""
    low, high = axes.get_xlim()
    if axes.xaxis.get_visible():
        return [time for time in axes.get_xticks() if low <= time <= high]
    (lines,) = axes.collections
    return [segment[0][0] for segment in lines.get_segments()]


@pytest.mark.parametrize("log_time", [False, True])
@pytest.mark.parametrize(
    ("panels", "columns", "lowest"), [(6, 2, {2, 5}), (3, 1, {2}), (5, 2, {2, 4}), (1, 1, {0}), (1, 2, {0})]
)
def test_the_lowest_of_each_column_has_numbers_and_all_have_the_same_grid(monkeypatch, panels, columns, lowest, log_time):
    shown = drawn(monkeypatch, panels, columns, log_time)
    placed = sorted(shown, key=lambda axes: (round(axes.get_position().x0, 3), -axes.get_position().y0))
    assert {place for place, axes in enumerate(placed) if axes.xaxis.get_visible()} == lowest
    assert {place for place, axes in enumerate(placed) if axes.get_xlabel() == "time [s]"} == lowest
    grids = [grid_of(axes) for axes in placed]
    assert len(grids[0]) >= 2
    for grid, axes in zip(grids, placed, strict=True):
        assert grid == pytest.approx(grids[0])
        assert axes.get_xlim() == placed[0].get_xlim()
    low, high = placed[0].get_xlim()
    assert high < 1.1 * T[-1]
    assert low > -0.1 * T[-1]


def test_a_style_without_a_grid_gets_none(monkeypatch):
    monkeypatch.setitem(figures.rcParams, "axes.grid", False)
    monkeypatch.setattr("quadstep.report.canvas.STYLE", {"axes.grid": False})
    assert not drawn(monkeypatch, 2, 1)[0].collections
