"""Titles and labels of figures of a given width are broken where they are longer than what they name."""

import warnings

import numpy as np
import pytest

from quadstep.report.canvas import drawing, fit, legend_columns, new_figure, wrapped
from quadstep.report.figures import arranged
from quadstep.report.panel import Panel
from quadstep.report.sheet import Sheet


@pytest.mark.parametrize(("text", "lines"), [
    ("short", "short"),
    ("distance from the path [m]", "distance from\nthe path [m]"),
    ("filtered errors [m/s, rad/s]", "filtered errors\n[m/s, rad/s]"),
    ("the middle of 80 %", "the middle of\n80 %"),
    (r"$\mathrm{roll}_d$ − $\mathrm{roll}$ [mrad]", "$\\mathrm{roll}_d$ − $\\mathrm{roll}$\n[mrad]"),
    ("an_unbreakable_name_of_a_key", "an_unbreakable_name_of_a_key"),
])  # fmt: skip
def test_units_shares_and_symbols_stay_together(text, lines):
    assert wrapped(text, 1.1, 9.0) == lines


@pytest.mark.parametrize("width", [60.0, 88.0, None])
def test_nothing_stands_beyond_the_edge_of_a_figure(width):
    sheet, t = Sheet(("svg",), width), np.linspace(0.0, 1.0, 50)
    panels = [
        Panel("norm of the weights", "-", {"a": 3e-4 * t}),
        Panel("filtered errors", "m/s, rad/s", {"b": 1e-3 * t - 4e-4}),
    ]
    with drawing(sheet):
        figure = arranged(t, panels, 1 if width else 2, sheet, False)
        if width:
            fit(figure)
        inside(figure)


def test_a_figure_that_lays_itself_out_has_room_for_its_labels():
    sheet = Sheet(("svg",), 60.0)
    with drawing(sheet), warnings.catch_warnings():
        warnings.simplefilter("error")
        figure = new_figure(sheet, (9.0, 3.0))
        axes = figure.subplots(1, 2)[0]
        axes.set_ylabel("share of all flights that are worse than this one")
        fit(figure)
        inside(figure)


def inside(figure):
    """All words of a figure are on it."""
    figure.draw_without_rendering()
    wide, high = figure.get_size_inches() * figure.dpi
    labels = [label for axes in figure.axes for label in (axes.xaxis.label, axes.yaxis.label)]
    texts = [one for one in (*labels, *figure.texts) if one.get_text()]
    assert texts
    for text in texts:
        box = text.get_window_extent()
        assert box.x0 >= -1.0, text
        assert box.x1 <= wide + 1.0, text
        assert box.y0 >= -1.0, text
        assert box.y1 <= high + 1.0, text


def test_a_legend_has_as_many_columns_as_fit():
    names = ["L", "errors", "integrals", "weights"]
    assert [legend_columns(wide, names, 4) for wide in (2.4, 3.5, 7.0)] == [1, 2, 4]
    assert legend_columns(7.0, names, 3) == 3
    assert legend_columns(7.0, names[:1], 4) == 1
