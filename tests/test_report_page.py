"""The parts of reports: escaping, tables, inline drawings, figures, CSV."""

import csv
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.log import FlightLog
from quadstep.metrics.registry import flight_metrics
from quadstep.report import markup, units
from quadstep.report.drawing import FigureJob
from quadstep.report.evidence import Evidence
from quadstep.report.panel import Panel
from quadstep.report.publish import write_json, write_log
from quadstep.report.sheet import Sheet
from quadstep.report.units import prefixed, suited
from quadstep.studies.flight_report import distance_when_lost, error_table
from quadstep.vehicle.in_space import COLUMNS

HOSTILE = "<script>alert('x')</script> & \"quotes\""


@pytest.mark.parametrize(
    "text",
    [markup.paragraph(HOSTILE), markup.heading(HOSTILE, 'a"b'), markup.table([HOSTILE], [[HOSTILE], [(HOSTILE, 'k"')]])],
)
def test_every_text_is_escaped(text):
    assert "<script>" not in text
    tree = ET.fromstring(f"<div>{text}</div>")
    assert HOSTILE in "".join(tree.itertext())


def test_a_table_has_its_header_and_rows():
    tree = ET.fromstring(markup.table(["a", "b"], [["1", "2"], ["3", ("4", "holds")]]))
    assert [cell.text for cell in tree.iter("th")] == ["a", "b"]
    assert [cell.text for cell in tree.iter("td")] == ["1", "2", "3", "4"]
    assert [cell.get("class") for cell in tree.iter("td")] == [None, None, None, "holds"]


def test_a_page_is_whole_and_its_title_is_text():
    text = markup.page_text(HOSTILE, [markup.paragraph("é 飛")])
    assert text.startswith("<!doctype html>")
    assert "<script>" not in text
    assert 'charset="utf-8"' in text
    assert "é 飛" in text


def job(name="curve", caption="What to see", lines=None, samples=50, **options):
    t = np.linspace(0.0, 1.0, samples)
    return FigureJob(name, caption, t, [Panel("x", "m", {"x": np.sin(t)} if lines is None else lines)], **options)


def test_apostrophes_are_typographic_where_people_read_them_and_nothing_else_changes():
    said = "the law's `it's`'s 'quoted' word, vehicles' masses"
    body = [
        markup.paragraph(said),
        markup.verbatim("echo 'a'"),
        markup.links([("it's.html", "it's")]),
        "<text>x's</text>",
        "<b>m</b>&#x27;</span>s",
    ]
    named = [markup.disclosure("campaign file it's.toml", ""), markup.table(("", ""), [("", "it's.toml")], markup.own)]
    text = markup.page_text("O'Brien's 'calm'", [*body, *named])
    assert text.count("O&apos;Brien&apos;s &apos;calm&apos;") == 2 and "<b>m</b>’</span>s" in text
    assert text.count("it&apos;s.toml") == 2, "users' names of files stay as they are"
    assert "the law’s <code>it&#x27;s</code>’s ‘quoted’ word, vehicles’ masses" in text
    assert "echo &#x27;a&#x27;" in text and '<a href="it&#x27;s.html">it’s</a>' in text and "<text>x’s</text>" in text


def test_ids_of_two_drawings_on_one_page_never_meet(tmp_path):
    for name in ("one", "two"):
        job(name).draw(tmp_path)
    ids = []
    for name in ("one", "two"):
        drawing = markup.figure(tmp_path / f"{name}.svg", "a <b>")
        tree = ET.fromstring(drawing)
        found = [element.get("id") for element in tree.iter() if element.get("id")]
        assert all(identity.startswith(f"{name}-") for identity in found)
        for element in tree.iter():
            for key, value in element.attrib.items():
                if key.endswith("href") and value.startswith("#"):
                    assert value[1:] in found
        ids += found
    assert len(ids) == len(set(ids)) > 0


def test_a_figure_is_drawn_the_same_twice(tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    for folder in ("a", "b"):
        job().draw(tmp_path / folder)
    for kind in ("png", "svg"):
        assert (tmp_path / "a" / f"curve.{kind}").read_bytes() == (tmp_path / "b" / f"curve.{kind}").read_bytes()


def test_a_short_line_an_empty_line_and_a_flat_line_are_drawn(tmp_path):
    lines = {"whole": np.ones(50), "ended early": np.ones(7), "nothing": np.zeros(0), "flat": np.zeros(50)}
    job(lines=lines).draw(tmp_path)
    text = "\n".join(ET.parse(tmp_path / "curve.svg").getroot().itertext())
    assert all(name in text for name in lines)


@pytest.mark.parametrize("samples", [2, 499, 500, 501, 1001, 5000])
def test_a_long_line_is_thinned_but_keeps_its_last_point(tmp_path, samples):
    job(samples=samples).draw(tmp_path)
    assert (tmp_path / "curve.svg").stat().st_size < 200_000


@pytest.mark.parametrize(("unit", "largest", "expected"), [
    ("m", 20.0, ("m", 1.0)),
    ("m", 0.003, ("mm", 1e3)),
    ("m", 3e-5, ("µm", 1e6)),
    ("m", 3e-9, ("nm", 1e9)),
    ("m", 0.0, ("m", 1.0)),
    ("-", 2e-4, ("10⁻³", 1e3)),
    ("m/s, rad/s", 2e-3, ("10⁻³ m/s, rad/s", 1e3)),
    ("-", 0.3, ("-", 1.0)),
    ("N m", 2e4, ("kN m", 1e-3)),
    ("m/s^2", 1.0, ("m/s²", 1.0)),
    ("rad", 0.01, ("mrad", 1e3)),
    ("N m", 3e-5, ("µN m", 1e6)),
])  # fmt: skip
def test_a_unit_gets_the_prefix_that_suits(unit, largest, expected):
    name, factor = prefixed(unit, largest)
    assert (name, factor) == (expected[0], pytest.approx(expected[1]))


@pytest.mark.parametrize("size", [3.9e-8, 7.16e-5, 9.9e-4])
def test_an_angle_too_small_for_degrees_is_in_millionths_of_a_radian_whatever_its_size(size):
    assert suited("rad", size) == ("µrad", 1e6)
    assert suited("rad", 0.0011)[0] == "°"


def test_the_errors_of_a_lost_flight_are_those_of_its_log_and_say_when_it_ends():
    columns = {"t": "s", "x": "m", "x_d": "m", "z": "m", "z_d": "m"}
    rows = np.array([[6.34, 0.0, 0.0, 0.0, 0.0], [6.35, 0.0, 3.0, 94.0, 0.0]])
    log = FlightLog(columns, rows, Outcome.OFF_PATH, 6.36, None)
    metrics = flight_metrics(log)
    header, errors = error_table(metrics, log)
    assert header == ("error", "largest", "at 6.35\N{NO-BREAK SPACE}s", "unit")
    assert errors == [["x", "3.00", "3.00", "m"], ["z", "94.0", "94.0", "m"]]
    assert metrics["position"]["z"]["final[m]"] == 94.0
    said = distance_when_lost(log)
    assert [one.replace("\N{NO-BREAK SPACE}", " ") for one in said[:3]] == [
        "distance from the path at 6.35 s", "94.0 m", "in the log's last row, 0.01 s before the loss"
    ]  # fmt: skip


def test_a_csv_reads_back_exactly(tmp_path):
    rows = np.random.default_rng(1).normal(size=(5, len(COLUMNS))) * 10.0 ** np.arange(-8, len(COLUMNS) - 8)
    write_log(tmp_path / "log.csv", FlightLog(COLUMNS, rows, Outcome.COMPLETED, 1.0, None))
    with (tmp_path / "log.csv").open(encoding="utf-8", newline="") as file:
        header, *read = csv.reader(file)
    assert header == [f"{name}[{unit}]" for name, unit in COLUMNS.items()]
    assert np.array_equal(np.array(read, dtype=float), rows)


def test_json_refuses_what_is_not_json(tmp_path):
    with pytest.raises(ValueError, match="JSON"):
        write_json(tmp_path / "a.json", {"x": float("nan")})


# Numbers as people write them


@pytest.mark.parametrize(
    ("value", "unit", "shown"),
    [
        (0.0047712, "m", "4.77 mm"), (0.0000047, "m", "4.70 µm"), (0.3, "m", "300 mm"), (12.345, "m", "12.3 m"),
        (12345.0, "N", "12.3 kN"), (-0.0012, "rad", "−1.20 mrad"), (0.5, "-", "0.500"), (0.0, "m", "0 m"),
        (float("nan"), "m", "– m"), (float("inf"), "s", "∞ s"), (1e9, "-", "1.00 × 10⁹"), (31000.0, "-", "31,000"),
    ],
)  # fmt: skip
def test_a_quantity_has_the_unit_and_digits_that_suit_it(value, unit, shown):
    assert units.quantity(value, unit).replace("\u00a0", " ") == shown


def test_an_interval_decides_how_many_digits_mean_something():
    assert units.interval(0.0123456, 0.0119, 0.0128, "m").replace("\u00a0", " ") == "12.3 [11.9, 12.8] mm"
    assert units.interval(0.0123456, 0.01234, 0.01235, "m").replace("\u00a0", " ") == "12.346 [12.340, 12.350] mm"
    assert units.interval(0.0123, 0.0098, 0.0151, "m").replace("\u00a0", " ") == "12 [10, 15] mm"
    assert units.interval(2.0, 1.0, 3.0) == "2.0 [1.0, 3.0]"
    assert units.interval(2.0, 2.0, 2.0) == "2.00"
    assert units.interval(0.5, float("nan"), float("nan")) == "0.500"


@pytest.mark.parametrize(("share", "shown"), [
    ((0.5,), "50 %"),
    ((1.0,), "100 %"),
    ((0.0,), "0 %"),
    ((0.9996,), "99.960 %"),
    ((0.963, 0.935, 0.982), "96.3 [93.5, 98.2] %"),
])  # fmt: skip
def test_a_share_can_be_told_from_none_and_all(share, shown):
    assert units.percent(*share) == shown


def test_a_summary_says_the_answer_its_intervals_and_shows_its_figures(tmp_path):
    job().draw(tmp_path)
    fact = markup.Fact("succeed", "96 %", "93 to 98 %")
    text = markup.summary(HOSTILE, [fact], [markup.figure(tmp_path / "curve", "A curve of tau_psi")])
    tree = ET.fromstring(f"<div>{text}</div>")
    assert HOSTILE in "".join(tree.itertext())
    assert "93 to 98\N{NO-BREAK SPACE}%" in text
    assert "τ<sub>ψ</sub>" in text


def test_a_page_lists_its_sections_and_prints_on_a4(tmp_path):
    text = markup.page_text("T", [markup.heading(name, name) for name in ("one", "two", "three")], "Kind")
    assert [anchor for anchor in ("one", "two", "three") if f'href="#{anchor}"' in text] == ["one", "two", "three"]
    assert "quadstep · Kind" in text
    assert "size: A4" in text
    assert "<nav" not in markup.page_text("T", [markup.heading("one", "one")])


def test_sections_for_specialists_open_at_a_click_and_stay_in_the_contents():
    parts = [part for name in ("one", "two", "three") for part in (markup.heading(name, name), markup.paragraph(f"of {name}"))]
    text = markup.page_text("T", parts, fold=("two",))
    assert [anchor for anchor in ("one", "two", "three") if f'href="#{anchor}"' in text] == ["one", "two", "three"]
    folded = ET.fromstring(text[text.index("<details") : text.index("</details>") + 10])
    assert folded.findtext("summary/h2") == "two"
    assert [folded.find("div").get("id"), folded.findtext("div/p")] == ["two", "of two"]  # a link to what is inside opens it
    assert text.count("<details") == 1


def test_an_answer_is_its_first_sentence_and_the_rest_is_text():
    text = markup.summary("0.5 m at most. At rest it is sound: 12.7 dB.")
    assert '<p class="answer">0.5 m at most.</p><p>At rest it is sound: 12.7 dB.</p>' in text.replace(
        "\N{NO-BREAK SPACE}", " "
    )
    text = markup.summary("All at most 0.5 times Eq. 67. Where it can be flown.").replace("\u00a0", " ")
    assert '<p class="answer">All at most 0.5 times Eq. 67.</p><p>Where it can be flown.</p>' in text
    lost = markup.summary("Lost at 2 s: it fell. More.", failed=True)
    assert '<p class="answer"><span class="fails">Lost at 2 s: it fell.</span></p><p>More.</p>' in lost.replace("\u00a0", " ")


@pytest.mark.parametrize(("height", "kind"), [(300.0, ""), (400.5, ' class="tall"')])
def test_only_a_tall_figure_may_fill_a_page_of_paper(height, kind):
    drawn = f'<svg data-axes="[]" width="576pt" height="{height}pt" viewBox="0 0 576 {height}"></svg>'
    assert markup.inline_figure(drawn, "What to see").startswith(f"<figure{kind}>")


def test_a_figure_without_svg_is_its_png(tmp_path):
    job().draw(tmp_path, Sheet(("png",)))
    assert 'src="data:image/png;base64,' in markup.figure(tmp_path / "curve", "A curve")


def test_a_warning_has_a_true_minus_and_no_symbols():
    found = Evidence("a", "kind", "answer", (), {}, warnings=["K_r1 is -2.5 in run-3.toml"])
    assert "Warning: K_r1 is −2.5 in run-3.toml" in found.html(Path())


def test_what_is_not_for_paper_opens_on_a_screen_alone():
    assert markup.verbatim("{}", "every key", on_paper=False).startswith(
        '<details class="screen"><summary>every key</summary>'
    )
    assert markup.verbatim("{}", "every key").startswith("<details><summary>")
    assert ".screen" in markup.style().partition("@media print {")[2].partition("{ display: none; }")[0]
