"""Figures of reports tell their axes, and their script reads values off the drawing, shows a part of it, and all again."""

import json
import re
from html import unescape

import numpy as np
import pytest

from quadstep.report import page
from quadstep.report.drawing import FigureJob
from quadstep.report.panel import LOG, Panel
from tests.browsers import browsers, playwright  # noqa: F401 (fixtures)
from tests.needs import CHROMIUM, needs

T = np.linspace(0.0, 10.0, 201)


@pytest.fixture
def report(tmp_path):
    """A report with one figure, and what it tells."""
    panels = [Panel("x", "m", {"x": 2.0 + T, "x_d": 2.5 + T}), Panel("e", "m", {"e": np.exp(-T)}, LOG)]
    FigureJob("curve", "", T, panels, 2).draw(tmp_path)
    page.write_page(tmp_path / "report.html", "A report", [page.figure(tmp_path / "curve", "What to see")])
    told = re.search(r'data-axes="([^"]*)"', (tmp_path / "curve.svg").read_text(encoding="utf-8"))
    return tmp_path / "report.html", json.loads(unescape(told[1]))


def test_axes_are_told_as_they_are_drawn(report):
    x, e = report[1]
    assert [one["name"] for one in x["curves"]] == ["x", "x_{d}"]
    assert (x["across"], x["up"], e["y"]["kind"]) == ("time [s]", "x [m]", "log")
    assert x["x"]["low"] < 0.0
    assert x["x"]["high"] > 10.0
    assert x["ours"]
    left, _, width, _ = x["box"]
    assert left + width < e["box"][0]


def test_a_page_without_figures_has_no_script():
    assert "<script" not in page.page_text("A", [page.paragraph("text")])


@needs(CHROMIUM)
def test_hovering_reads_values_and_a_drag_shows_a_part(report, browsers):  # noqa: F811
    (file, told), opened, errors = report, browsers[False].page(), []
    opened.on("pageerror", lambda error: errors.append(str(error)))
    opened.goto(file.as_uri())
    left, top, width, height = told[0]["box"]
    ends = told[0]["x"]
    shown = opened.locator("svg[data-axes]").bounding_box()
    scale = shown["width"] / opened.evaluate("document.querySelector('svg[data-axes]').viewBox.baseVal.width")

    def move(t, ends=ends):
        part = (t - ends["low"]) / (ends["high"] - ends["low"])
        opened.mouse.move(shown["x"] + scale * (left + part * width), shown["y"] + scale * (top + 0.5 * height))

    def read():
        return [float(one) for one in re.findall(r"([\d.]+)\s(?:s|m)\b", opened.locator(".reading").inner_text())]

    move(4.0)
    assert read() == pytest.approx([4.0, 6.0, 6.5], abs=0.06)
    opened.mouse.down()
    move(6.0)
    opened.mouse.up()
    move(4.5, {"low": 4.0, "high": 6.0})
    assert read() == pytest.approx([4.5, 6.5, 7.0], abs=0.06)
    opened.locator("button.whole").click()
    move(4.0)
    assert read() == pytest.approx([4.0, 6.0, 6.5], abs=0.06)
    assert errors == []
    browsers[False].blank()
