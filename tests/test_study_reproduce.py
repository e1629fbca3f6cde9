"""`quadstep reproduce`, run once as a user does, and everything it writes."""

import html
import json
import re
import xml.etree.ElementTree as ET
from collections import Counter
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from quadstep import __version__
from quadstep.report.units import rich, typed
from quadstep.studies.paper.cases import case_title, main_cases
from quadstep.vehicle.in_space import COLUMNS
from tests import golden
from tests.commands import ISSUE_COLUMNS, columns, files, strict_json
from tests.terminals import in_terminal

CSV = ["case1.csv", "case2.csv", "case3_adaptive.csv", "case3_nested.csv"]
FIGURES = [f"fig{number:02d}" for number in range(3, 13)]
VERDICTS = {"holds", "fails", "undecided"}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    out = tmp_path_factory.mktemp("reproduce") / "paper"
    return in_terminal("reproduce", "--out", out, columns=80), out


@pytest.fixture(scope="module")
def out(run):
    return run[1]


@pytest.fixture(scope="module")
def metrics(out):
    return strict_json(out / "metrics.json")


@pytest.fixture(scope="module")
def claims(out):
    return strict_json(out / "claims.json")


@pytest.fixture(scope="module")
def report(out):
    return (out / "report.html").read_text(encoding="utf-8")


def test_an_error_in_fast_flights_says_until_when_it_counts(claims):
    (said,) = [one["measured"] for one in claims if one["name"] == "nonlinearities compensated by the nets"]
    assert "RMSE (until 5 s after t_f) by a factor of 5 to 19;" in said
    page = " ".join((Path(__file__).parents[1] / "docs/paper.md").read_text(encoding="utf-8").split())
    assert "errors count until 5 s after its end), the nets cut the RMSE by a factor of 5 to 19. In 3 s" in page


def test_it_ends_well_with_the_counts_what_does_not_hold_and_the_place_of_the_report(run, claims):
    done, out = run
    assert done.code == 0, done.text
    assert done.text.startswith(f"Of {len(claims)} claims that Das, Lewis")
    assert len(done.lines) < 66, "a short answer"
    assert f"Report: {out / 'report.html'}" in done.lines
    kept = " ".join(done.text.split())
    assert f"Of {len(claims)} claims that Das, Lewis and Subbarao (2009) make about their simulations, " in kept
    fails, undecided = (done.text.index(f"\nWhat {what}") for what in ("fails", "is undecided"))
    for claim in claims:
        place = done.text.find(f"\n{typed(claim['name'])}  ")
        assert {"holds": place < 0, "fails": fails < place < undecided, "undecided": undecided < place}[claim["verdict"]]


def test_the_issues_files_are_there(out, metrics):
    pages = ["report.html", "page.html"]
    needed = [*CSV, "metrics.json", "claims.json", *pages, *(f"{f}.{kind}" for f in FIGURES for kind in ("png", "svg"))]
    there = files(out)
    assert set(needed) <= set(there)
    assert all(there.values())
    assert set(metrics["files"]) == set(there)


@pytest.mark.parametrize("name", CSV)
def test_a_case_has_a_row_every_10_ms_over_40_s_and_the_issues_columns(out, name):
    log = columns(out, name)
    assert log["t[s]"] == pytest.approx(np.arange(4001) / 100, abs=1e-9)
    assert [*log] == [f"{column}[{unit}]" for column, unit in COLUMNS.items()]
    assert {column.replace("#", " ") for column in ISSUE_COLUMNS} <= set(log)
    assert np.isfinite(list(log.values())).all()


def test_case_1_stays_within_a_millimetre_and_5_mrad(out):
    log = columns(out, "case1.csv")
    for axis in "xyz":
        assert np.abs(log[f"{axis}_d[m]"] - log[f"{axis}[m]"]).max() < 1e-3
    for angle in ("psi", "theta", "phi"):
        assert np.abs(log[f"{angle}_d[rad]"] - log[f"{angle}[rad]"]).max() < 5e-3


ENDS = {"case1": ((0, 0, 0), (20, 5, 10)), "case2": ((0, 5, 10), (20, 5, 10)), "case3_adaptive": ((0, 0, 0), (0, 0, 10))}


@pytest.mark.parametrize("name", ENDS)
def test_a_case_goes_where_the_paper_says(out, name):
    log = columns(out, f"{name}.csv")
    path = np.array([log[f"{axis}_d[m]"] for axis in "xyz"]).T
    assert tuple(path[0]) == pytest.approx(ENDS[name][0])
    assert tuple(path[-1]) == pytest.approx(ENDS[name][1])


def test_both_controllers_of_case_3_fly_from_one_start_and_only_one_has_nets(out):
    adaptive, nested = columns(out, "case3_adaptive.csv"), columns(out, "case3_nested.csv")
    for name in ("x[m]", "y[m]", "z[m]", "psi[rad]", "theta[rad]", "phi[rad]", "z_d[m]"):
        assert adaptive[name][0] == nested[name][0]
    assert adaptive["norm_W1[-]"].max() > 0.0
    assert nested["norm_W1[-]"].max() == 0.0


def text_of(svg):
    """The labels, a line each; the letters of one with symbols are elements of their own."""
    labels = [element for element in svg.iter() if element.tag.endswith("text")]
    return "\n".join("".join(part for part in label.itertext() if not part.startswith("\n")) for label in labels)


@pytest.mark.parametrize("name", FIGURES)
def test_a_figure_is_a_picture_with_labels_units_and_a_legend(out, name):
    assert (out / f"{name}.png").read_bytes().startswith(b"\x89PNG")
    svg = ET.fromstring((out / f"{name}.svg").read_text(encoding="utf-8"))
    text = text_of(svg)
    assert "time [s]" in text
    assert re.search(r"\[\w*(m|rad|N|°)\]", text)
    several = any(len(axes["curves"]) > 1 for axes in json.loads(svg.get("data-axes")))
    assert any(element.get("id", "").startswith("legend") for element in svg.iter()) == several


def test_a_line_of_a_figure_is_told_apart_by_its_dashes(out):
    """With nets solid, without dashed; the desired path is a band below them."""
    svg = (out / "fig10.svg").read_text(encoding="utf-8")
    curves = set(re.findall(r'style="(fill: none; [^"]*)"', svg))
    assert any("stroke-dasharray" in style for style in curves)
    assert any("stroke-opacity: 0.26" in style for style in curves)


def test_figure_3_ends_at_10_20_30_and_40(out):
    text = "\n".join(ET.fromstring((out / "fig03.svg").read_text(encoding="utf-8")).itertext())
    for end in (10, 20, 30, 40):
        assert f"to {end} m" in text


def test_comparisons_name_both_controllers(out):
    for name in ("fig10", "fig11", "fig12"):
        text = text_of(ET.fromstring((out / f"{name}.svg").read_text(encoding="utf-8")))
        named = 2 if name == "fig10" else 1  # once, or where columns show other lines, in each
        assert text.replace("\u00a0", " ").count("paper’s controller") == text.count("[11]") == named


def test_the_metrics_say_seed_version_and_every_choice(metrics):
    assert (metrics["version"], metrics["seed"]) == (__version__, 1)
    assert len(metrics["choices"]) >= 15
    for choice in metrics["choices"]:
        assert all(choice[key] for key in ("what", "value", "why"))
    text = json.dumps(metrics["choices"])
    for word in ("Lambda", "K_r1", "K_i2", "neurons", "seed", "filter", "step", "start of Case 3", "rotor", "kappa", "[11]"):
        assert word in text


def test_the_metrics_of_a_case_are_those_the_issue_asks_for(metrics):
    assert set(metrics["cases"]) >= {"case1", "case2", "case2_y", "case2_z", "case3_adaptive", "case3_nested"}
    for case in metrics["cases"].values():
        for axis in "xyz":
            assert set(case["position"][axis]) == {"rmse[m]", "largest[m]", "final[m]"}
        for angle in ("psi", "theta", "phi"):
            assert {"rmse[rad]", "largest[rad]", "final[rad]"} < set(case["attitude"][angle])
            assert any("settling[s]" in key for key in case["attitude"][angle])
        for name in ("u", "tau_psi", "tau_theta", "tau_phi"):
            assert {key.partition("[")[0] for key in case[name]} == {"largest", "total_variation"}
        assert set(case["largest_weight_norm"]) == {"norm_W1", "norm_W2"}


def test_the_metrics_are_those_of_the_study_flown_again(metrics):
    flown = golden.study()
    for name, case in flown.cases.items():
        assert golden.numbers(metrics["cases"][name]) == golden.numbers(case)


def test_36_stress_flights_have_an_error_and_a_tilt_or_a_time_and_a_reason(metrics):
    stress = metrics["stress"]
    keys = {(flight["t_f[s]"], flight["scale"], flight["nets"]) for flight in stress}
    assert keys == {(t, s, n) for t in (20, 10, 6, 5, 4, 3) for s in (0, 1, 5) for n in (True, False)}
    assert len(stress) == 36
    for flight in stress:
        if flight["outcome"] == "completed":
            assert flight["ended[s]"] == pytest.approx(flight["t_f[s]"] + 5.0)
            assert flight["position_rmse[m]"] >= 0.0
            assert flight["largest_tilt[rad]"] > 0.0
        else:
            assert 0.0 < flight["ended[s]"] < flight["t_f[s]"] + 5.0


def test_case_3_was_flown_from_several_starts_with_both_controllers(metrics):
    starts = Counter(key.partition("; ")[0] for key in metrics["case3_by_start"])
    assert len(starts) >= 4
    assert all(count >= 2 for count in starts.values())
    assert any(key.startswith("at rest on the path; adaptive") for key in metrics["case3_by_start"])


def test_claims_have_a_sentence_numbers_and_one_of_three_verdicts(claims):
    for claim in claims:
        assert set(claim) >= {"name", "sentence", "measured", "verdict"}
        assert claim["verdict"] in VERDICTS
        assert re.search(r"\d", claim["measured"])
    assert {claim["verdict"] for claim in claims} == VERDICTS


class Page(HTMLParser):
    """Open elements, ids, references and the tables of a page."""

    VOID = frozenset({"meta", "br", "hr", "img", "link", "input"})

    def __init__(self, text):
        super().__init__()
        self.open, self.ids, self.references, self.outside = [], [], [], []
        self.tables, self.scripts = [], 0
        self.feed(text)
        self.close()

    def handle_startendtag(self, tag, attrs):
        self.note(tag, attrs)

    def handle_starttag(self, tag, attrs):
        self.note(tag, attrs)
        if tag not in self.VOID:
            self.open.append(tag)
        if tag == "table":
            self.tables.append([])
        if tag == "tr":
            self.tables[-1].append([])
        if tag in {"td", "th"}:
            self.tables[-1][-1].append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, tag

    def handle_data(self, data):
        if {"td", "th"} & set(self.open):
            self.tables[-1][-1][-1] += data

    def note(self, tag, attrs):
        self.scripts += tag == "script"
        for key, value in ((key, value or "") for key, value in attrs):
            if key == "id":
                self.ids.append(value)
            if value.startswith("#") and key in {"href", "xlink:href"}:
                self.references.append(value[1:])
            self.references += re.findall(r"url\(#([^)]+)\)", value)
            if key in {"src", "href", "xlink:href", "srcset", "style"} and re.search(r"\w+://|url\((?!#)|@import", value):
                self.outside.append((tag, key, value))


@pytest.fixture(scope="module")
def page(report):
    return Page(report)


def test_every_element_of_the_report_is_closed(page):
    assert page.open == []


def test_the_report_needs_nothing_from_outside(page, report):
    assert page.outside == []
    assert page.scripts == 1  # reads values off figures
    assert "<link" not in report
    assert "@import" not in report
    report = re.sub(r"(?s)<script.*?</script>", "", report)
    kept = re.sub(r'xmlns(:\w+)?="[^"]*"|rdf:resource="[^"]*"', "", report)
    assert re.findall(r"https?://[^\s\"<]+", kept) == []


def test_ids_of_the_report_are_unique_and_references_lead_to_one(page):
    assert [name for name, count in Counter(page.ids).items() if count > 1] == []
    assert set(page.references) <= set(page.ids)
    assert page.references


def shown(text):
    """What a reader sees of a text whose names are set as symbols."""
    return html.unescape(re.sub("<[^>]+>", "", rich(text))).replace("'", "’")


def test_the_report_holds_all_figures_and_tables(page, report, claims, metrics):
    assert len(re.findall("<figure[ >]", report)) == len(FIGURES)
    captions = [
        html.unescape(re.sub("<[^>]+>", "", one)) for one in re.findall(r"<figcaption>(.*?)</figcaption>", report, re.DOTALL)
    ]
    assert [one.partition(":")[0] for one in sorted(captions)] == sorted(f"Fig. {int(name[3:])}" for name in FIGURES)
    assert all(one.endswith(".") and one.count(". ") >= 2 for one in captions), "what is drawn, and what to see of it"
    judged, full, cases, taken, starts, others, stress, chosen = page.tables
    by_name = {shown(claim["name"]): (shown(claim["measured"]), claim["verdict"]) for claim in claims}
    assert {row[0]: row[-1] for row in judged[1:]} == {name: verdict for name, (_, verdict) in by_name.items()}
    assert list(dict.fromkeys(row[-1] for row in judged[1:])) == ["fails", "undecided", "holds"], "what fails comes first"
    assert [row[3] for row in full[1:]] == [shown(claim["measured"]) for claim in claims]
    assert all(by_name[brief[0]][0].startswith(brief[1]) for brief in judged[1:])
    assert max(len(row[1]) for row in judged[1:]) < 200, "a line or two"
    assert all(row[column].endswith(".") for table, column in ((judged, 1), (full, 3)) for row in table[1:]), "sentences"
    assert report.index('id="claims"') < report.index("<figure"), "the claims come first"
    assert "off in x and y, the paper’s controller is lost" in html.unescape(report)
    assert [row[0] for row in cases[1:]] == [case_title(key, mission) for key, mission in main_cases().items()]
    assert [row[0] for row in taken] == [row[0] for row in cases]  # which a phone shows below one another
    assert len(starts) > 5
    assert [row[0] for row in starts] == [row[0] for row in others]  # as these
    assert max(len(row) for table in (cases, taken, starts, others, stress) for row in table) <= 4, "what fits a phone"
    assert [row[0] for row in chosen[1:]] == [shown(choice["what"]) for choice in metrics["choices"]]
    assert not any("{" in cell for row in chosen[1:] for cell in row)  # no dictionary as Python writes it
    for table in page.tables:
        assert len({len(row) for row in table}) == 1


def test_captions_of_case_2_have_the_largest_values_of_its_log(out, report):
    log = columns(out, "case2.csv")
    said = html.unescape(re.sub("<[^>]+>", "", report)).replace("\N{NO-BREAK SPACE}", " ")
    error = 1e6 * np.abs(log["x_d[m]"] - log["x[m]"]).max()
    pitch, miss = np.abs(log["theta[rad]"]).max(), np.abs(log["theta_d[rad]"] - log["theta[rad]"]).max()
    rise, torque = log["u[N]"].max() - 9.81, np.abs(log["tau_theta[N m]"]).max()
    assert f"The largest error in x is {error:.1f} µm." in said
    assert f"Pitch reaches {np.degrees(pitch):.2g}°, and its largest error is {1e3 * miss:.2g} mrad." in said
    assert f"The thrust rises by at most {1e3 * rise:.2g} mN, and the pitch torque reaches {torque:.3f} N m." in said


def test_a_stress_flight_that_diverges_is_told_with_time_and_reason(page, metrics):
    cells = [cell.replace("\N{NO-BREAK SPACE}", " ") for row in page.tables[6][1:] for cell in row[1:]]
    lost = sum(flight["outcome"] != "completed" for flight in metrics["stress"])
    assert sum(bool(re.fullmatch(r"lost at [\d.]+ s: [a-z ]+", cell)) for cell in cells) == lost
    assert sum(bool(re.fullmatch(r"[\d.e+-]+ [µm]m, [\d.]+°", cell)) for cell in cells) == 36 - lost
