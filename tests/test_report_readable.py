"""Figures of reports tell their axes, and their script reads values off the drawing, shows a part of it, and all again."""

import json
import re
from html import unescape

import numpy as np
import pytest

from quadstep.report import markup
from quadstep.report.canvas import drawing, new_figure, write
from quadstep.report.drawing import FigureJob
from quadstep.report.panel import LOG, Panel
from quadstep.report.sheet import Sheet
from quadstep.report.told import ToldPlace, tell
from tests.browsers import axe
from tests.needs import CHROMIUM, needs

T = np.linspace(0.0, 10.0, 201)
SHEET = Sheet(("svg",))


def write_report(folder, figure):
    text = markup.page_text("A report", [markup.figure(folder / figure, "What to see")])
    (folder / "report.html").write_text(text, encoding="utf-8")


@pytest.fixture
def report(tmp_path):
    """A report with one figure, and what it tells."""
    panels = [Panel("x", "m", {"x": 2.0 + T, "x_d": 2.5 + T}), Panel("e", "m", {"e": np.exp(-T)}, LOG)]
    FigureJob("curve", "", T, panels, 2).draw(tmp_path)
    write_report(tmp_path, "curve")
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
    assert "<script" not in markup.page_text("A", [markup.paragraph("text")])


@needs(CHROMIUM)
def test_hovering_reads_values_and_a_drag_shows_a_part(report, browsers):
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
    box = opened.locator(".reading").bounding_box()
    card = opened.locator(".drawn").first.locator("..").bounding_box()
    assert box["y"] + box["height"] <= card["y"] + 5.0  # above the figure, so that it hides no peak, of the row above neither
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


@needs(CHROMIUM)
@pytest.mark.parametrize("wide", [300.0, 308.0, 350.0])
def test_a_phone_says_that_a_figure_scrolls_where_it_does(tmp_path, browsers, wide):
    drawn = f"<svg {markup.strip(0.0, wide, 100.0)}></svg><svg {markup.strip(wide, 200.0, 100.0)}></svg>"
    file = tmp_path / "report.html"
    file.write_text(markup.page_text("A", [markup.inline_figure(drawn, "What to see")]), encoding="utf-8")
    opened = browsers[False].page()
    opened.set_viewport_size({"width": 360, "height": 720})
    opened.goto(file.as_uri())
    said = opened.evaluate("getComputedStyle(document.querySelector('figcaption'), '::before').content")
    beyond = opened.evaluate("(({ scrollWidth, clientWidth }) => scrollWidth - clientWidth)(document.querySelector('.drawn'))")
    assert ("Scroll" in said, beyond > 0) == ((True, True) if wide == 350.0 else (False, False))
    opened.set_viewport_size({"width": 1280, "height": 720})
    browsers[False].blank()


@needs(CHROMIUM)
def test_a_phone_shows_the_columns_of_a_figure_below_one_another(report, browsers):
    (file, told), opened = report, browsers[False].page()
    opened.set_viewport_size({"width": 1280, "height": 720})
    opened.goto(file.as_uri())
    strips = opened.locator(".drawn > svg")
    wide = [strips.nth(place).bounding_box() for place in range(strips.count())]
    assert len(wide) == 2
    assert wide[0]["y"] == wide[1]["y"]
    assert wide[0]["x"] + wide[0]["width"] == pytest.approx(wide[1]["x"], abs=0.6)
    opened.set_viewport_size({"width": 360, "height": 720})
    above, below = (strips.nth(place).bounding_box() for place in range(2))
    assert above["y"] + above["height"] == pytest.approx(below["y"], abs=0.6)
    assert (
        opened.evaluate("(({ scrollWidth, clientWidth }) => scrollWidth - clientWidth)(document.querySelector('.drawn'))") == 0
    )
    sizes = opened.evaluate(
        "[...document.querySelectorAll('.drawn text')].map((one) => parseFloat(one.style.fontSize) * one.getScreenCTM().a)"
    )
    assert min(sizes) >= 9.0
    left, top, width, height = told[1]["box"]
    from_left, scale = opened.evaluate(
        "(({ x, width }) => [x, width])(document.querySelectorAll('.drawn > svg')[1].viewBox.baseVal)"
    )
    scale = below["width"] / scale
    ends = told[1]["x"]
    part = (2.0 - ends["low"]) / (ends["high"] - ends["low"])
    opened.mouse.move(below["x"] + scale * (left - from_left + part * width), below["y"] + scale * (top + 0.5 * height))
    read = [float(one) for one in re.findall(r"([\d.]+)\s(?:s|m)\b", opened.locator(".reading").inner_text())]
    assert read == pytest.approx([2.0, np.exp(-2.0)], rel=0.03)
    opened.set_viewport_size({"width": 1280, "height": 720})
    browsers[False].blank()


def test_what_is_wider_than_a_phone_and_cannot_be_cut_scrolls():
    assert 'class="wide"' in markup.strip(0.0, 400.0, 200.0)
    assert 'class="wide"' not in markup.strip(0.0, 308.0, 200.0)  # of which a phone shows text of 9 pixels


@needs(CHROMIUM)
def test_narrow_figures_stand_in_pairs_and_one_alone_has_its_caption_beside_it(tmp_path, browsers):
    FigureJob("curve", "", T, [Panel("x", "m", {"x": T})], 2).draw(tmp_path)  # one panel, where two would have room
    one, opened = markup.figure(tmp_path / "curve", "What to see"), browsers[False].page()
    text = markup.page_text("A report", [markup.summary("Fine.", figures=[one] * 3), one, markup.note("And"), one, one])
    (tmp_path / "report.html").write_text(text, encoding="utf-8")
    opened.set_viewport_size({"width": 1440, "height": 900})
    opened.goto((tmp_path / "report.html").as_uri())
    boxes = opened.evaluate("""[...document.querySelectorAll("figure")].map(one =>
        [one, one.querySelector(".drawn"), one.querySelector("figcaption")].map(part => {
            const { x, y, width, height } = part.getBoundingClientRect(); return [x, y, width, height]; }))""")
    page = boxes[0][0][2]
    for (_, top, wide, _), (left, _, drawn, high), (beside, middle, _, _) in (boxes[0], boxes[3]):
        assert wide == page and beside > left + drawn and middle > top + 0.2 * high
    for first, second in ((boxes[1], boxes[2]), (boxes[4], boxes[5])):
        assert first[0][1] == second[0][1] and first[0][2] == second[0][2] == pytest.approx(page / 2, rel=0.03)
        assert second[0][0] + second[0][2] <= boxes[0][0][0] + page
        assert first[2][1] >= first[1][1] + first[1][3]
    browsers[False].blank()


def edges_of(page, name):
    """Left and right of what is drawn under a name, in pixels of the screen."""
    box = page.locator(f"g[id$='{name}'] path").first.bounding_box()
    return box["x"], box["x"] + box["width"]


@needs(CHROMIUM)
def test_a_histogram_and_bars_are_read_and_a_part_is_shown_with_its_limit(tmp_path, browsers):
    with drawing(SHEET):
        figure = new_figure(SHEET, (8.0, 3.0))
        bars, counts = figure.subplots(1, 2)
        bars.barh([0, 1], [30.0, 70.0])
        bars.set_yticks([0, 1], ["lost", "completed"])
        bars.set_xlabel("share [%]")
        counts.stairs([4, 10, 6], [0.0, 1.0, 2.0, 3.0], fill=True)
        counts.stairs([4, 10, 6], [0.0, 1.0, 2.0, 3.0])
        counts.axvline(1.5)
        counts.text(1.5, 0.9, "limit", transform=counts.get_xaxis_transform())
        counts.set_xlabel("error [m]")
        counts.set_ylabel("flights")
        write(figure, tmp_path / "counts", SHEET)
    told = json.loads(unescape(re.search(r'data-axes="([^"]*)"', (tmp_path / "counts.svg").read_text(encoding="utf-8"))[1]))
    write_report(tmp_path, "counts")
    opened = browsers[False].page()
    opened.goto((tmp_path / "report.html").as_uri())
    shown = opened.locator("svg[data-axes]").bounding_box()
    scale = shown["width"] / opened.evaluate("document.querySelector('svg[data-axes]').viewBox.baseVal.width")

    def place(axes, x, up, low=None, high=None):
        left, top, width, height = axes["box"]
        low, high = (axes["x"]["low"], axes["x"]["high"]) if low is None else (low, high)
        return shown["x"] + scale * (left + (x - low) / (high - low) * width), shown["y"] + scale * (top + (1.0 - up) * height)

    reading = opened.locator(".reading")
    opened.mouse.move(*place(told[0], 50.0, 0.75))
    assert reading.inner_text().split() == ["completed", "share", "70.0", "%"]
    opened.mouse.move(*place(told[1], 1.2, 0.3))
    assert reading.inner_text().split() == ["error", "1.20", "m", "flights", "10.0"]
    opened.mouse.down()
    opened.mouse.move(*place(told[1], 1.8, 0.3))
    opened.mouse.up()
    limit = next(one["id"] for one in told[1]["drawn"] if one["along"] == "x")  # the line, which comes before its word
    middle = sum(edges_of(opened, limit)) / 2.0
    assert middle == pytest.approx(place(told[1], 1.5, 0.0, 1.2, 1.8)[0], abs=0.6)
    word = opened.get_by_text("limit").bounding_box()
    assert word["x"] == pytest.approx(middle, abs=1.5)
    opened.mouse.move(*place(told[1], 1.35, 0.3, 1.2, 1.8))
    assert reading.inner_text().split() == ["error", "1.35", "m", "flights", "10.0"]
    opened.locator("button.whole").click()
    assert sum(edges_of(opened, limit)) / 2.0 == pytest.approx(place(told[1], 1.5, 0.0)[0], abs=0.6)
    browsers[False].blank()


def test_powers_of_ten_are_written_out_where_nobody_chose_how(tmp_path):
    with drawing(Sheet()):
        figure = new_figure(Sheet(), (4.0, 3.0))
        axes = figure.add_subplot()
        axes.loglog([1e-6, 1.0], [1e-5, 1e5])
        write(figure, tmp_path / "a", Sheet(formats=("svg",)))
    text = (tmp_path / "a.svg").read_text(encoding="utf-8")
    assert "10⁻⁴" in text
    assert "math" not in text


PARTS = [
    markup.summary("The answer.", [markup.Fact("largest error", "3 mm", "from the path")], []),
    markup.links([("page.html", "Fly it in your browser"), ("flight.csv", "the log")], "See it move:"),
    markup.heading("Numbers", "numbers"),
    markup.paragraph("K_r1 > m Lambda1"),
    markup.table(("", "RMSE", "share"), [("x", "3 [2, 4] mm", "12 %"), ("y", "1", "-")]),
    markup.table((), [("seed", "1")]),
    markup.note("A note."),
    markup.listing(["one", "two"]),
    markup.verbatim("[path]", "all keys"),
    markup.verbatim("quadstep fly mission.toml"),
    markup.heading("More", "more"),
    markup.heading("How to read this", "reading"),
]
"""Of what every kind of report is made, beside its figures."""


@needs(CHROMIUM)
@pytest.mark.parametrize(("width", "scheme"), [(1440, "light"), (360, "dark")])
def test_axe_finds_nothing_in_the_parts_of_reports(report, browsers, width, scheme):
    window = browsers[False].page()
    figure = markup.figure(report[0].parent / "curve", "What to see")
    report[0].write_text(markup.page_text("A report", [*PARTS, figure], "Flight"), encoding="utf-8")
    window.set_viewport_size({"width": width, "height": 900})
    window.emulate_media(color_scheme=scheme)
    window.goto(report[0].as_uri())
    window.evaluate("document.querySelectorAll('details').forEach((one) => { one.open = true })")
    assert axe(window) == []
    assert window.evaluate("document.documentElement.scrollWidth") <= width
    browsers[False].blank()


@needs(CHROMIUM)
def test_points_and_cells_say_what_they_are(tmp_path, browsers):
    with drawing(SHEET):
        figure = new_figure(SHEET, (8.0, 3.0))
        points, cells = figure.subplots(1, 2)
        points.plot([1.0], [2.0], "o")
        points.set_xscale("log")
        points.set_xlim(0.5, 2.0)
        tell(points, ToldPlace(0.9, 1.1, 2.0, 2.0, "pid, calm", [("RMSE [mm]", "1.2 [1.0, 1.4]")]))
        cells.imshow([[0.0, 1.0]], extent=(0.0, 2.0, 0.0, 1.0), aspect="auto")
        for left in (0.0, 1.0):
            tell(cells, ToldPlace(left, left + 1.0, 0.0, 1.0, f"cell {left:g}", [("RMSE", f"{left:g} mm")]))
        write(figure, tmp_path / "spots", SHEET)
    write_report(tmp_path, "spots")
    told = json.loads(unescape(re.search(r'data-axes="([^"]*)"', (tmp_path / "spots.svg").read_text(encoding="utf-8"))[1]))
    opened = browsers[False].page()
    opened.set_viewport_size({"width": 1280, "height": 720})
    opened.goto((tmp_path / "report.html").as_uri())
    shown = opened.locator("svg[data-axes]").bounding_box()
    scale = shown["width"] / opened.evaluate("document.querySelector('svg[data-axes]').viewBox.baseVal.width")

    def said(axes, along, up, name):
        left, top, width, height = axes["box"]
        opened.mouse.move(shown["x"] + scale * (left + along * width), shown["y"] + scale * (top + up * height))
        reading = opened.locator(".reading", has_text=name)
        reading.wait_for()
        return reading.inner_text().split("\n")

    assert said(told[0], 0.5, 0.5, "pid") == ["pid, calm", "RMSE", "1.2 [1.0, 1.4]\N{NO-BREAK SPACE}mm"]
    assert said(told[1], 0.25, 0.5, "cell 0") == ["cell 0", "RMSE", "0 mm"]
    assert said(told[1], 0.75, 0.1, "cell 1") == ["cell 1", "RMSE", "1 mm"]
    browsers[False].blank()


@needs(CHROMIUM)
def test_a_phone_does_not_break_the_words_of_a_row_one_a_line(tmp_path, browsers):
    cell, file = "284 [265, 303] mm", tmp_path / "report.html"
    rows = [["largest error at most 600 mm, in 90 % of the flights", cell, cell, cell]]
    table = markup.table(("", "current", "tuned", "tuned - current"), rows)
    file.write_text(markup.page_text("A", [table]), encoding="utf-8")
    opened = browsers[False].page()
    opened.set_viewport_size({"width": 360, "height": 720})
    opened.goto(file.as_uri())
    lines = opened.evaluate(
        """(() => { const words = document.createRange(); words.selectNodeContents(document.querySelector("tbody td"));
        return new Set([...words.getClientRects()].map((one) => Math.round(one.y))).size; })()"""
    )
    assert lines <= 5, lines
    opened.set_viewport_size({"width": 1280, "height": 720})
    browsers[False].blank()
