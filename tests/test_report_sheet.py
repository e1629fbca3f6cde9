"""Figures for papers: their formats, width and style, the same bytes in any process; axes on which everything can be seen."""

import os
import re
import subprocess
import sys
from itertools import pairwise
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from matplotlib.figure import Figure

from quadstep.io.errors import UserError
from quadstep.proofs.certify.certificate import certify_plan
from quadstep.proofs.certify.run import figures_of
from quadstep.report.axes import Powers, peaked, plain, plain_decades, threshold
from quadstep.report.canvas import STYLE, thin
from quadstep.report.drawing import FigureJob
from quadstep.report.figures import draw, picture, prefixed
from quadstep.report.panel import LOG, SIGNED_LOG, STACKED, Panel, Track
from quadstep.report.sheet import Sheet, sheet
from quadstep.studies.paper.cases import case_1
from tests.commands import quadstep

T = np.linspace(0.0, 40.0, 4001)
DECAY = 1500.0 * np.exp(-60.0 * T) * np.cos(40.0 * T) + 0.3 * np.exp(-0.2 * T)


def drawn(panel, t=T):
    axes = Figure().subplots()
    draw(axes, t, panel)
    axes.figure.canvas.draw()
    return axes


def ticks(axes):
    return [text.get_text() for text in axes.get_yticklabels()]


def job(name="curve", columns=2):
    panels = [Panel("tau_phi", "N m", {"tau_phi": DECAY}), Panel("z", "m", {"z": np.sin(T), "z_d": np.cos(T)})]
    return FigureJob(name, "", T, [*panels, *panels], columns)


def test_what_is_asked_for():
    assert sheet() == Sheet(("png", "svg"), None, ())
    assert sheet("pdf, PNG,pdf", 88.0, "paper").formats == ("pdf", "png")
    assert dict(sheet(style="paper").settings)["font.size"] == 8
    assert sheet("pdf").with_svg().formats == ("pdf", "svg")
    assert [sheet(width=width).side_by_side(2) for width in (None, 88.0, 180.0)] == [2, 1, 2]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("jpg",), "--figures: unknown format 'jpg'; allowed: png, svg, pdf"),
        (("",), "--figures: unknown format ''"),
        (("png", 3.0), "--width: should be from 40 to 1000 mm, not 3"),
        (("png", float("nan")), "--width"),
        (("png", None, "fancy"), "--style: unknown style 'fancy'; allowed: screen, paper, or a file NAME.mplstyle"),
        (("png", None, "nowhere.mplstyle"), "nowhere.mplstyle: file not found"),
    ],
)
def test_what_is_refused(options, said):
    with pytest.raises(UserError, match=re.escape(said)):
        sheet(*options)


def test_a_style_of_ones_own(tmp_path):
    path = tmp_path / "journal.mplstyle"
    path.write_text("# Journal\nfont.size: 7  # points\nfont.family: serif\ngrid.color: red\n\n")
    assert dict(sheet(style=str(path)).settings) == {"font.size": 7.0, "font.family": ["serif"], "grid.color": "red"}
    refused = {
        "font.size: big": "line 1: font.size",
        "x\n": "line 1: 'x' is not a setting",
        "\nfigure.hooks: os:system": "line 2: 'figure.hooks' is not a setting",
        "font.sise: 3": "line 1: 'font.sise' is not a setting",
    }
    for content, said in refused.items():
        path.write_text(content)
        with pytest.raises(UserError, match=said):
            sheet(style=str(path))
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(UserError, match="not a text file"):
        sheet(style=str(path))
    path.write_text("#" * 200_000)
    with pytest.raises(UserError, match=r"too large; a style file may have at most 0\.1 MB"):
        sheet(style=str(path))


@pytest.mark.parametrize("style", ["screen", "paper"])
@pytest.mark.parametrize("width", [88.0, 180.0])
def test_every_format_is_as_wide_as_asked(tmp_path, width, style):
    job().draw(tmp_path, sheet("png,svg,pdf", width, style))
    box = re.search(rb"/MediaBox \[ ?0 0 ([0-9.]+) ([0-9.]+)", (tmp_path / "curve.pdf").read_bytes())
    assert box
    assert float(box[1]) == pytest.approx(width / 25.4 * 72.0, abs=0.01)
    svg = ET.parse(tmp_path / "curve.svg").getroot()
    assert float(svg.get("width").removesuffix("pt")) == pytest.approx(width / 25.4 * 72.0, abs=0.01)
    columns = int.from_bytes((tmp_path / "curve.png").read_bytes()[16:20], "big")
    assert columns == pytest.approx(width / 25.4 * 300.0, abs=1.0)


def test_fonts_of_a_pdf_are_embedded_as_truetype_and_nothing_says_when(tmp_path):
    job().draw(tmp_path, sheet("pdf", 88.0, "paper"))
    content = (tmp_path / "curve.pdf").read_bytes()
    assert b"/FontFile2" in content
    assert b"/Type3" not in content
    assert b"CreationDate" not in content
    assert b"Matplotlib" not in content


def test_the_same_figure_in_another_process_is_the_same_bytes(tmp_path):
    code = (
        "import sys; from pathlib import Path; from tests.test_report_sheet import job, sheet\n"
        "job().draw(Path(sys.argv[1]), sheet('png,svg,pdf', 88.0, 'paper'))"
    )
    there = tmp_path / "there"
    there.mkdir()
    subprocess.run([sys.executable, "-c", code, there], check=True, env={**os.environ, "PYTHONHASHSEED": "1"})
    job().draw(tmp_path, sheet("png,svg,pdf", 88.0, "paper"))
    for kind in ("png", "svg", "pdf"):
        assert (tmp_path / f"curve.{kind}").read_bytes() == (there / f"curve.{kind}").read_bytes(), kind


def test_commands_draw_what_is_asked_for(tmp_path):
    mission = tmp_path / "m.toml"
    mission.write_text('[path]\ntype = "minimum-jerk"\nend = [1.0, 0.0, 0.0]\nduration = 1.0\n')
    run = quadstep("fly", mission, "--out", tmp_path / "a", "--figures", "pdf", "--width", "88", "--style", "paper")
    assert run.code == 0, run.err
    assert {one.suffix for one in (tmp_path / "a" / "figures").iterdir()} == {".pdf", ".svg"}  # which the report shows
    assert (tmp_path / "a" / "report.html").read_text(encoding="utf-8").count("<figure") >= 3
    assert quadstep("fly", mission, "--out", tmp_path / "b", "--figures", "gif").refused
    assert not (tmp_path / "b").exists()


def test_a_flight_is_drawn_with_the_signals_that_are_asked_for(tmp_path, monkeypatch):
    mission = tmp_path / "m.toml"
    mission.write_text(
        '[path]\ntype = "minimum-jerk"\nend = [1.0, 0.0, 0.0]\nduration = 1.0\n[vehicle]\npreset = "crazyflie"\n'
    )
    look = ("--figures", "svg", "--width", "88", "--style", "paper")
    run = quadstep("fly", mission, "--out", tmp_path / "a", *look, "--signals", "x,x_d-x,wind")
    assert run.code == 0, run.err
    assert "--signals: wind has nothing to show, and is not drawn" in run.err
    assert [one.name for one in (tmp_path / "a" / "figures").iterdir()] == ["signals.svg"]
    assert re.findall(r'<g id="axes(\d+)"', (tmp_path / "a" / "figures" / "signals.svg").read_text()) == ["0", "1"]
    assert len(re.findall("<figure[ >]", (tmp_path / "a" / "report.html").read_text(encoding="utf-8"))) == 1
    monkeypatch.setattr("quadstep.studies.fly.fly_logged", lambda *_: pytest.fail("flown"))
    for wrong in ("x,height", "x,"):
        run = quadstep("fly", mission, "--out", tmp_path / "b", "--signals", wrong)
        assert run.refused
        assert f"--signals: unknown signal {wrong.rpartition(',')[2]!r}; allowed: path, position, attitude, " in run.err
    assert not (tmp_path / "b").exists()


@pytest.mark.parametrize("most", [0.242, 3.0, 77.0])
def test_the_outermost_power_of_ten_of_a_peak_is_labelled(most):
    axes = drawn(Panel("tau_theta", "N m", {"tau_theta": np.where(T[0] == T, -most, 4e-4 * np.cos(T))}))
    assert axes.get_yscale() == "symlog"
    ticks = axes.yaxis.get_majorticklocs()
    assert min(ticks) == pytest.approx(-(10.0 ** np.floor(np.log10(1.6 * most))))


def test_a_peak_does_not_flatten_what_follows():
    axes = drawn(Panel("tau_phi", "N m", {"tau_phi": DECAY}))
    assert axes.get_yscale() == "symlog"
    axes.figure.draw_without_rendering()
    (note,) = (text.get_window_extent() for text in axes.texts if "linear within ±" in text.get_text())
    line = axes.transData.transform(axes.lines[0].get_xydata())
    assert not np.all((line > note.min) & (line < note.max), axis=1).any()
    low, high = axes.transData.transform([(0, 0.0), (0, 0.3)])[:, 1]
    whole = axes.get_window_extent().height
    assert high - low > 0.02 * whole  # on a linear axis 0.3 of 1500 would not be a pixel
    assert drawn(Panel("x", "m", {"x": np.sin(T)})).get_yscale() == "linear"


def test_when_a_line_counts_as_peaked():
    calm = np.ones(1000)
    assert not peaked([calm, 5.0 * calm])
    assert peaked([calm, np.concatenate([[100.0], calm])])
    assert not peaked([np.concatenate([[100.0], 0.0 * calm])])  # nothing is flattened
    assert not peaked([np.zeros(0), np.ones(2)])
    assert threshold([np.concatenate([[100.0], 0.3 * calm])]) == 1.0


def test_numbers_of_an_axis_are_whole_and_what_hardly_varies_is_shown_away_from_it():
    thrust = 9.81 + 2.6e-4 * np.sin(T) ** 2
    axes = drawn(Panel("u", "N", {"u": thrust}))
    assert axes.get_ylabel() == "$u$ − 9.81 N [mN]"
    assert axes.lines[0].get_ydata().max() == pytest.approx(0.26, abs=1e-3)
    position = drawn(Panel("z", "m", {"z": 10.0 + 2e-8 * np.sin(T), "z_d": np.full(len(T), 10.0)}))
    assert position.get_ylabel() == "$z$ [m]"
    assert position.get_ylim()[1] - position.get_ylim()[0] > 0.1  # 20 nm are no wobble beside 10 m
    assert "10" in ticks(position)
    for one in (axes, position, drawn(Panel("norm", "-", {"W1": 5.8e-3 + 1e-4 * T}))):
        assert one.yaxis.get_offset_text().get_text() == ""


def test_zeros_and_empty_lines_are_drawn_on_any_axis():
    for scale in ("", LOG, SIGNED_LOG):
        for lines in ({"a": np.zeros(10)}, {"a": np.zeros(0)}, {"a": np.ones(10), "b": np.zeros(0)}):
            drawn(Panel("a", "m", lines, scale), np.arange(10.0))


def test_a_line_thinned_for_logarithmic_time_keeps_its_beginning_and_peaks():
    t = np.linspace(0.0, 40.0, 20001)
    values = np.where(np.arange(20001) == 7, 3.0, 1.0) + np.where(np.arange(20001) == 15003, 2.0, 0.0)
    thinned, kept = thin(t, values, log=True)
    assert len(kept) < 2000
    assert {3.0, 4.0} & set(kept.tolist())
    assert kept[thinned == t[7]] == 3.0 + values[7] - 3.0
    assert kept[thinned == t[15003]] == 3.0
    assert np.all(np.diff(thinned) > 0.0)


def test_powers_of_ten_on_an_axis():
    assert Powers().format_ticks([0.0, 1e-3, 0.1, -10.0, 1000.0]) == ["0", "0.001", "0.1", "−10", "1000"]
    assert Powers().format_ticks([0.0, 1e-3, 1.0, -10.0, -1e-7]) == ["0", "10⁻³", "1", "−10", "−10⁻⁷"]
    assert [plain()(value, 0) for value in (0.2, -2e-5, 250.0)] == ["0.2", "−2×10⁻⁵", "250"]


@pytest.mark.parametrize("largest", [1e-13, 1e-9, 3e-5, 0.04, 0.05, 9999.0, 1e4, 1e7, 1e15])
def test_a_prefix_brings_a_value_where_it_reads_well(largest):
    for unit in ("m", "-", "m/s, rad/s"):
        name, factor = prefixed(unit, largest)
        assert 0.04 < largest * factor < 1e4, name


def test_every_panel_of_a_certificate_shows_its_whole_flight():
    certificate = certify_plan(case_1(controller={"type": "backstepping"}).plan())
    first, *others = figures_of(certificate, "Case 1")
    assert first.log_time
    by_name = {panel.label: panel for job in (first, *others) for panel in job.panels}
    assert [by_name[name].scale for name in ("|r|", "thrust", "added to L")] == [LOG, LOG, STACKED]
    name, radius = next((name, line) for name, line in by_name["|r|"].lines.items() if name.startswith("b_r = "))
    assert radius.min() == radius.max() == certificate.b_r
    assert name == f"b_r = {certificate.b_r:.3g}"
    for panel in by_name.values():
        axes = Figure().subplots()
        draw(axes, first.t, panel, log_time=True)
        for line in axes.lines:
            heights = axes.transData.transform(np.column_stack([line.get_xdata(), line.get_ydata()]))[:, 1]
            box = axes.get_window_extent()
            inside = np.mean((heights >= box.y0) & (heights <= box.y1))
            assert inside > 0.9, (panel.label, line.get_label(), inside)


def test_on_a4_the_text_of_figures_has_7_points():
    track = Track(T, np.column_stack([T, T, T]), np.column_stack([T, T, T]))
    panels = job().panels
    widths = [picture(T, panels, columns).get_figwidth() for columns in (1, 2, 3)] + [
        picture(T, [], track=track).get_figwidth()
    ]
    column = (210.0 - 2.0 * 15.0) / 25.4 - 14.0 / 72.0  # inside its frame; page and frame as in report.css
    assert min(float(STYLE["legend.fontsize"]) * min(1.0, column / width) for width in widths) >= 7.0


def test_a_legend_stands_once_above_panels_that_share_it_and_not_over_a_single_line():
    pairs = [Panel(name, "m", {name: T, f"{name}_d": T}) for name in "xyz"]
    figure = picture(T, [*pairs, *(Panel(f"{name}_d - {name}", "m", {f"error in {name}": T}) for name in "xyz")], 2)
    said = [[text.get_text() for text in axes.get_legend().get_texts()] for axes in figure.axes if axes.get_legend()]
    assert said == [["flown", "desired"]]
    both = picture(T, [Panel(name, "m", {"one": T, "other": -T}) for name in "abcd"], 2)
    assert [bool(axes.get_legend()) for axes in both.axes] == [True, False, False, False], "all columns have the same"


def test_a_legend_of_two_rows_does_not_cover_the_panel_above():
    names = dict.fromkeys(("a long name", "another long name", "one more of them", "the last long name"), np.sin(T))
    others = dict(reversed(names.items()))
    figure = picture(T, [Panel("z", "m", names), Panel("z", "m", others)] * 3, 2)
    column = [axes for axes in figure.axes if axes.get_position().x0 < 0.5]
    for above, below in pairwise(sorted(column, key=lambda axes: -axes.get_position().y0)):
        assert below.get_legend().get_window_extent().y1 <= above.get_window_extent().y0


@pytest.mark.parametrize(("low", "high"), [(3.1, 9.4), (2.01, 6.1), (1.3, 1.9), (0.7, 4.0), (2.0, 300.0)])
def test_a_logarithmic_axis_has_several_numbers(low, high):
    axes = Figure().subplots()
    axes.set_xscale("log")
    axes.set_xlim(low, high)
    plain_decades(axes.xaxis)
    assert sum(low <= tick <= high for tick in axes.get_xticks()) >= 3
