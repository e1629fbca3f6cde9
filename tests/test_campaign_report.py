"""report.html of a campaign: it shows what the flights did, for every kind of campaign, and appears whole."""

import itertools
import json
import re
import tomllib
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pyarrow.dataset
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from quadstep.engines.fly import fly
from quadstep.engines.scored import LARGEST, RMSE
from quadstep.interfaces.closed_loop import Outcome
from quadstep.io.errors import UserError
from quadstep.metrics.statistics import Estimate, share
from quadstep.metrics.verdict import graded
from quadstep.mission.check import check
from quadstep.mission.fields import words
from quadstep.report import canvas, units
from quadstep.report.panel import Track
from quadstep.studies.campaign import key_text, pictures, report, report_text, single
from quadstep.studies.campaign.draws import draw
from quadstep.studies.campaign.flyer import table
from quadstep.studies.campaign.page import limit
from quadstep.studies.campaign.run import CampaignRequest, fly_campaign
from quadstep.studies.campaign.schema import CampaignFile, read_campaign
from quadstep.studies.campaign.sensitivity import ExplainedResult, Interaction, parts_of
from quadstep.studies.campaign.single_flight import replay_of
from quadstep.studies.campaign.splits import in_common
from quadstep.studies.campaign.store import opened
from quadstep.studies.campaign.summary import RESULTS, CampaignSummary, WorstFlight, answer, sentences, summarise, tallied
from quadstep.studies.campaign.varied import Bins, VariedKey, variation_text, varied_keys
from tests.campaigns import MASS, NOISY, campaign, leftovers, manifest, rows, varying, written
from tests.flights import METRICS
from tests.missions import EXAMPLES
from tests.pages import data_of, fly_page, needs_node

DOCS = Path(__file__).parent.parent / "docs"
LOST = int(Outcome.OFF_PATH)

SCALE = '"disturbance.scale" = {type="log-normal", median=1.0, sigma=0.5}\n'
NETS = '"controller" = {type="choice", values=[{type="backstepping", nets={enabled=false}}, {type="nested-saturation"}]}\n'


def told_by(folder):
    """The text of a report, without its drawings, as (all of it, the rows of its tables)."""
    html = (folder / "report.html").read_text(encoding="utf-8")
    text = re.sub(r"<svg.*?</svg>|<style>.*?</style>|<pre>.*?</pre>", "", html, flags=re.DOTALL)
    assert not re.search(r"\b(nan|None|inf|Estimate)\b", text)
    cells = [re.findall(r"<td[^>]*>(.*?)</td>", row) for row in re.findall(r"<tr>(.*?)</tr>", text)]
    return re.sub(r"<[^>]+>", " ", text).replace("\u00a0", " "), cells


def written_by(store, read, path):
    flown = store.read(RESULTS)
    report.write_report(store, read, summarise(store, flown, read.varies), flown, path, varied_keys(store, read.file))


def reported(folder, vary, flights, outcome=None, metrics=None, head=""):
    """A report about flights that never were. outcome, metrics: from the drawn values, and the numbers of the flights."""
    read = campaign(folder / "in", vary, head=head)
    random = np.random.default_rng(0)
    with opened(folder / "out", read, flights, "lanes") as store:
        for chunk in store.chunks:
            numbers = np.arange(chunk.first, chunk.past)
            drawn = draw(read.file, numbers)
            values = {
                key: one.values if one.options is None else np.array(one.options)[one.values] for key, one in drawn.items()
            }
            ended = (np.zeros(len(numbers)) if outcome is None else outcome(values, numbers)).astype(np.int8)
            made = np.exp(random.normal(size=(len(numbers), len(METRICS)))) if metrics is None else metrics(values, numbers)
            store.write(chunk, table(read, numbers, drawn, ended, np.where(ended, 0.1, 0.4), made))
        written_by(store, read, folder / "in" / "camp.toml")
        store.save(complete=True)
    return told_by(folder / "out")


@pytest.fixture
def unflown(monkeypatch):
    """The worst flights are not flown again, and pictures are drawn as svg only: what a test does not look at, fast."""
    monkeypatch.setattr(report, "worst_section", lambda *_: [])
    for module in (canvas, pictures):
        monkeypatch.setattr(
            module, "write", lambda figure, path, sheet: path.with_name(f"{path.name}.svg").write_text("<svg></svg>")
        )


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """A real campaign: its folder, file and summary."""
    folder = tmp_path_factory.mktemp("flown")
    path = written(folder, MASS + SCALE, head="flights = 200\n[failure]\nposition_rmse = 0.12")
    done = fly_campaign(CampaignRequest(path, folder / "out"))
    return folder / "out", path, done.summary


def test_all_files_are_there_known_to_the_manifest_and_whole(flown):
    folder, _, summary = flown
    names = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    assert set(manifest(folder)["files"]) == names - {"campaign.json", "flights/00000.parquet"}
    assert "flights.html" in names
    drawn = {"distributions", "ranking", "points", *(f"flight-{one.flight}" for one in summary.worst)}
    assert {f"figures/{name}.{kind}" for name in drawn for kind in ("png", "svg")} <= names
    assert sum("key-" in name for name in names) == 4
    assert all(path.read_bytes()[:4] == b"\x89PNG" for path in folder.rglob("*.png"))
    assert leftovers(folder) == []


def test_when_a_flight_fails_says_from_when_on_its_errors_count():
    assert read_campaign(EXAMPLES / "gusts.toml").failing.endswith(
        "largest error above 0.3\N{NO-BREAK SPACE}m; errors count from 5 s on"
    )


def test_it_says_what_was_flown_and_how_it_ended(flown):
    folder, _, summary = flown
    text, cells = told_by(folder)
    plain = text.replace("\N{NO-BREAK SPACE}", " ")
    assert all(sentence.replace("\N{NO-BREAK SPACE}", " ") in plain for sentence in summary.findings)
    about = dict(row for row in cells if len(row) == 2)
    varied = {row[0]: row[1:] for row in cells if len(row) == 3}
    assert about["seed, precision, engine"] == "1, f64, lanes"
    assert about["a flight fails"] == "if it ends early, or position RMSE above 0.12\N{NO-BREAK SPACE}m"
    assert varied["vehicle mass [kg]"] == ["vehicle.mass", "normal, mean 1, deviation 0.1, nothing below 0.6 or above 1.4"]
    assert about["machine"].startswith("processor ")
    assert "numpy" in about["quadstep"]
    success = np.array(rows(folder)["success"])
    shares = {row[0]: row[1:] for row in cells if row and row[0].startswith("completed")}
    exact = share(int(success.sum()), 200)
    assert shares["completed, succeeded"] == [str(success.sum()), report_text.percent(exact)]
    assert int(shares["completed, above a limit"][0]) == (~success).sum() - summary.outcomes["spinning"]
    assert exact.low < success.mean() < exact.high


def test_it_ranks_the_keys(flown):
    text, cells = told_by(flown[0])
    names = ("vehicle mass [kg]", "disturbance scale")
    ranking = {row[0]: row[1:] for row in cells if row and row[0] in names and len(row) == 3 and "[" in row[2]}
    most = [max(ranking, key=lambda key, at=column: float(ranking[key][at].split()[0])) for column in (0, 1)]
    assert most == [names[1]] * 2
    assert "Share of the variance [%] that would vanish if the key were known" in text


HEAVY = """[mission]
vehicle = { preset = "x500", mass = MASS }
controller = { type = "geometric" }
simulation = { duration = 3.0 }
path = { type = "circle", centre = [0, 0, 10.0], radius = 3.0, period = 15.0 }
[vary]
wind.mean.0 = { type = "uniform", low = 0.0, high = HIGH }
"""


@pytest.mark.parametrize(("mass", "high", "count", "said"), [
    ("9.0", "1.0", 20, "; none of the 10 graded flights is as commanded. Left its path in 10, "),
    ("9.0", "1e-300", 20, "; none of the 20 is as commanded. Left its path in 20, "),
    ("2.0", "1.0", 3, ". All of the 3 that reach the end are as commanded."),
])  # fmt: skip
def test_a_vehicle_that_cannot_leave_the_ground_does_not_succeed_by_reaching_the_end(tmp_path, mass, high, count, said):
    path = tmp_path / "camp.toml"
    path.write_text(f"flights = {count}\n{HEAVY}".replace("MASS", mass).replace("HIGH", high))
    summary = fly_campaign(CampaignRequest(path, tmp_path / "out")).summary
    text, _ = told_by(tmp_path / "out")
    assert said in answer(summary) and all(part in text for part in said.split(". "))
    graded = json.loads((tmp_path / "out" / "campaign.json").read_text())["summary"]["graded"]
    assert graded["not as commanded"] == graded["flights"] * (mass == "9.0") and f"the {graded['flights']} " in said
    assert answer(summary).startswith(f"All {count} flights reached the end")
    assert "succeeded" not in " ".join(sentences(summary)) and "completed, succeeded" not in text
    assert ("completed, not as commanded" in text) == (mass == "9.0")


def test_the_worst_flights_have_their_values_and_pictures_and_the_first_its_command(flown):
    folder, path, summary = flown
    html = (folder / "report.html").read_text(encoding="utf-8")
    section = html[html.index('id="worst"') : html.index('id="flown"')]
    flights = [int(flight) for flight in re.findall(r"<th>(\d+)</th>", section)]
    assert flights == [one.flight for one in summary.worst]
    cells = [re.findall(r"<td>(.*?)</td>", row) for row in re.findall(r"<tr>(.*?)</tr>", section)]
    found = {row[0]: row[1:] for row in cells if row}
    drawn = rows(folder).to_pylist()
    assert f"quadstep fly {path} --flight {flights[0]} --results {folder}</pre>" in section
    for place, flight in enumerate(flights):
        lost = drawn[flight]["outcome"] != "completed"
        ended = (
            f"lost: spinning at {drawn[flight]['time_of_failure[s]']:.4g} s" if lost else "completed, above a limit, largest"
        )
        assert f"Flight {flight}: {ended}" in section
        assert found["RMSE"][place] == units.quantity(drawn[flight]["position_rmse[m]"], "m", 4)
        assert found["largest error"][place] == units.quantity(drawn[flight]["largest_error[m]"], "m", 4)
        for key, unit in (("vehicle.mass", " [kg]"), ("disturbance.scale", "")):
            assert found[f"{words(key)}{unit}"][place] == units.numerals(f"{drawn[flight][key]:.4g}")


def points(folder):
    """The flights that open from the points of a report, and the flights.html address of each."""
    html = (folder / "report.html").read_text(encoding="utf-8")
    links = {flight: link for link, flight in re.findall(r'<a href="(flights.html[^"]*)">flight (\d+)</a>', html)}
    rings = re.findall(r'<a xlink:href="([^"]*)">[^a]*<text[^>]*>(\d+)</text>', html)
    assert {flight: link for link, flight in rings}.items() <= links.items(), "a ring without room beside it has no number"
    assert set(re.findall(r'<a xlink:href="(flights.html[^"]*)">', html)) == {*links.values()}
    assert "_blank" not in html  # which `quadstep serve` does not allow
    return links


@pytest.mark.parametrize(("limit", "said", "lines"), [(0.3, "limit 300 mm", 1), (2.0, "limit 2.00 m →", 0), (None, "", 0)])
def test_a_limit_is_named_above_the_errors_also_where_it_is_far_off(limit, said, lines):
    axes = Figure().subplots()
    metric = pictures.PlottedMetric(RMSE, np.linspace(0.1, 0.5, 50), limit)
    pictures.draw_metric(axes, metric, 60)
    assert "".join(one.get_text() for one in axes.texts).removeprefix("ended early") == said.replace(
        " mm", "\N{NO-BREAK SPACE}mm"
    ).replace(" m ", "\N{NO-BREAK SPACE}m ")
    assert sum(one.get_color() == pictures.LIMIT for one in axes.lines) == lines


@pytest.mark.parametrize("close", [0.02, 0.3, 3.0])
def test_the_numbers_of_flights_meet_no_other_number_and_no_ring(monkeypatch, close):
    """Of twelve flights near to each other, or far apart, each number stands within the axes or is left out."""
    figure = Figure(figsize=(4.0, 3.6), dpi=100)
    monkeypatch.setattr(single, "figure_at", lambda *_, **__: nullcontext(figure))
    random = np.random.default_rng(4)
    values = np.exp(close * random.standard_normal((2, 4000)))
    metrics = tuple(pictures.PlottedMetric(name, one, None) for name, one in zip((RMSE, LARGEST), values, strict=True))
    links = {int(one): f"flights.html#{one}" for one in random.choice(4000, 12, replace=False)}
    assert single.draw_points(Path("points"), metrics, random.random(4000) < 0.1, links, pictures.SCREEN)
    (axes,) = figure.axes
    figure.draw_without_rendering()
    boxes = [Text.get_window_extent(one) for one in axes.texts]  # without the line to the ring
    dots = axes.transData.transform(np.concatenate([line.get_xydata() for line in axes.lines]))
    assert not any(one.contains(*dot) for one in boxes for dot in dots), "numbers hide no point"
    at = [axes.transData.transform(one.get_offsets()[0]) for one in axes.collections]
    rings = [Bbox([place - 6.0, place + 6.0]) for place in at]
    assert not any(one.overlaps(other) for place, one in enumerate(boxes) for other in [*boxes[:place], *rings])
    assert all(axes.bbox.x0 <= one.x0 and one.x1 <= axes.bbox.x1 for one in boxes)
    assert (len(rings), len(boxes) > 6) == (12, True)


def test_the_points_that_open_are_the_worst_and_others_from_the_best_to_the_worst(flown):
    folder, _, summary = flown
    flights = [int(one) for one in points(folder)]
    worst = [one.flight for one in summary.worst]
    assert flights[: len(worst)] == worst
    all_of = rows(folder)
    rmse, through = np.array(all_of[RMSE], dtype=float), np.array(all_of["outcome"]) == "completed"
    shown = rmse[flights[len(worst) :]]
    assert shown[0] == rmse[through].min()
    assert rmse[through].max() in rmse[flights]
    assert (np.diff(shown) > 0.0).all()


def test_a_flight_that_a_point_opens_succeeds_there_if_the_campaign_says_so(flown):
    page = data_of((flown[0] / "flights.html").read_text(encoding="utf-8"))
    good = rows(flown[0]).sort_by("flight")["success"].to_pylist()
    grades = {int(one["id"].removeprefix("flight-")): one["outcome"]["grade"] for one in page["flights"]}
    assert {flight: grade not in ("above the limit", "lost") for flight, grade in grades.items()} == {
        flight: good[flight] for flight in grades
    }
    assert {"above the limit", "lost"} <= {*grades.values()}
    drawn = rows(flown[0]).sort_by("flight")
    for one in page["flights"]:  # with the values of its draw in words
        mass = drawn["vehicle.mass"][int(one["id"].removeprefix("flight-"))].as_py()
        assert f"vehicle mass {mass:.3g}\N{NO-BREAK SPACE}kg" in one["note"]


def test_a_limit_that_a_page_does_not_measure_is_named_and_no_flight_there_is_as_commanded():
    one, other = limit("largest_error[m]", 0.3), limit("effort_u[N]", 5.0)
    measured = {"outcome": "completed", "position_rmse[m]": 0.1, "largest_error[m]": 0.3}
    assert graded(measured, [one]).grade == "as commanded", "at the limit it succeeds"
    found = graded({**measured, "largest_error[m]": 0.69816}, [one])
    assert (found.grade, found.reasons) == ("above the limit", ("its largest error is 698 mm (limit 300\xa0mm)",))
    assert graded(measured, [other]).grade == "flew, but"
    assert graded(measured, [other]).reasons[0].startswith("this page does not measure its ")


@needs_node
def test_a_flight_that_a_point_opens_has_the_bits_of_fly(flown):
    folder, path, _ = flown
    links = points(folder)
    assert list(links.values()) == [f"flights.html#flight=flight-{flight}" for flight in links]
    chosen = list(links)[::4]
    asked = [{"flight": links[one].partition("=")[2]} for one in chosen]
    for flight, told in zip(chosen, fly_page(folder / "flights.html", *asked), strict=True):
        plan = replay_of(path, int(flight), folder)[1].plan  # which `quadstep fly` flies
        np.testing.assert_array_equal(told["values"], fly(plan).rows)


def test_outcomes_and_quantiles_are_a_table_for_a_paper(flown):
    table = (flown[0] / "table.tex").read_text(encoding="utf-8")
    assert r"completed, succeeded & " in table
    assert r"position RMSE & 50 \% & " in table


def test_ids_of_the_drawings_do_not_meet_on_the_page(flown):
    html = (flown[0] / "report.html").read_text(encoding="utf-8")
    ids = re.findall(r'\bid="([^"]+)"', html)
    assert len(ids) == len(set(ids)) > 100
    assert set(re.findall(r'href="#([^"]+)"', html)) <= set(ids)
    assert html.count("<script") == html.count('<script id="reader">')
    assert not re.search(r'<link|<img|src=|@import|url\((?!#|"data:font)', html)


def test_the_worst_flights_flown_again_are_as_bad_as_they_were(flown):
    _, path, summary = flown
    again = report.flown_again(read_campaign(path), [one.flight for one in summary.worst])
    for worst, one in zip(summary.worst, again, strict=True):
        errors = one.log.table("x_d", "y_d", "z_d") - one.log.table("x", "y", "z")
        assert np.sqrt((errors**2).sum(axis=1)).max() == pytest.approx(worst.largest, rel=1e-9)
        assert report_text.differing(worst, one.log, read_campaign(path)) == ""


def test_a_flight_that_ends_otherwise_when_flown_again_is_said_to(flown):
    _, path, summary = flown
    read = read_campaign(path)
    worst = summary.worst[0]
    log = report.flown_again(read, [worst.flight])[0].log
    assert (worst.outcome, log.outcome) == ("spinning", Outcome.SPINNING)
    assert "outcome is spinning" in report_text.differing(worst._replace(outcome="completed", time=None), log, read)
    assert f"it ends at {log.ended:.4g} s" in report_text.differing(worst._replace(time=1.1 * log.ended), log, read)
    assert report_text.differing(worst._replace(time=1.001 * log.ended), log, read) == ""


@pytest.mark.parametrize("count", [1, 2, 30])
def test_few_flights_are_reported_without_conclusions(tmp_path, unflown, count):
    text, _ = reported(tmp_path, MASS, count)
    assert "too few flights completed" in text
    assert f"too few flights failed (0 of {count})" in text


def test_if_all_are_lost_there_are_no_errors_to_show(tmp_path, unflown):
    nothing = np.full((300, len(METRICS)), np.nan)
    text, cells = reported(tmp_path, MASS, 300, lambda _, flights: np.full(len(flights), LOST), lambda *_: nothing)
    assert "too few flights succeeded (0 of 300)" in text
    assert "Distance from the path" not in text
    assert ["lost: off-path", "300", report_text.percent(share(300, 300))] in cells


@pytest.mark.parametrize("value", [0.0, 0.25])
def test_results_that_do_not_vary_are_explained_by_nothing(tmp_path, unflown, value):
    text, _ = reported(tmp_path, MASS, 100, metrics=lambda _, flights: np.full((len(flights), len(METRICS)), value))
    assert ("it does not vary" in text) == (value > 0.0)


def test_nothing_that_varies_and_a_choice_of_one_value(tmp_path, unflown):
    assert "the noise varies from flight to flight." in reported(tmp_path / "a", "", 100)[0]
    text, _ = reported(tmp_path / "b", '"vehicle.mass" = {type="choice", values=[1.0]}', 100)
    assert "The flights over vehicle mass." in text


def test_copies_of_one_flight_are_said_to_be_that(tmp_path, unflown):
    for count, said in ((1, False), (8, True)):
        text, cells = reported(
            tmp_path / str(count), "", count, metrics=lambda _, flights: np.full((len(flights), len(METRICS)), 0.5)
        )
        assert text.count(f"Its {count} flights do not differ, so there are no statistics.") == said
        assert ("Nothing varies from flight to flight." in text) == said
        assert "95 %" not in text
        assert text.count("It is a single flight, which gives no success rate.") == (not said)
        assert (f"All {count} flights succeeded." in text) == said
        assert "500 [500, 500] mm" not in text and "median" not in text
        assert "position RMSE" in {row[0] for row in cells if len(row) == 2}, "without a share below"
    assert "do not differ" not in reported(tmp_path / "noisy", "", 8)[0]


def test_numbers_that_overflow_or_are_missing_reach_no_statistic(tmp_path, unflown):
    def made(_, flights):
        metrics = np.exp(np.random.default_rng(1).normal(size=(len(flights), len(METRICS))))
        metrics[::3], metrics[1::7] = 1e300, np.nan
        return metrics

    text, cells = reported(tmp_path, MASS, 300, metrics=made, head='precision = "f32"\n[failure]\neffort_thrust = 2.0')
    assert "thrust effort above 2 N" in text
    assert all("e+30" not in cell for row in cells for cell in row)


def test_what_decides_is_found_and_what_does_nothing_is_not(tmp_path, unflown):
    def lost(values, flights):
        return np.where(values["controller.nets.enabled"] & (values["vehicle.mass"] > 1.0), LOST, 0)

    def made(values, flights):
        noise = np.random.default_rng(2).normal(size=(len(flights), len(METRICS)))
        return 10.0 ** (3.0 * values["disturbance.scale"][:, None] + 0.1 * noise)

    keys = MASS + '"disturbance.scale" = {type="uniform", low=0.0, high=1.0}\n'
    keys += '"controller.nets.enabled" = {type="choice", values=[true, false]}\n'
    text, cells = reported(tmp_path, keys, 3000, lost, made)
    shares = {
        row[0]: [float(cell.split()[0].replace(",", "")) for cell in row[1:]]
        for row in cells
        if len(row) == 3 and "[" in row[2]
    }
    error, failure = (dict(zip(shares, part, strict=True)) for part in zip(*shares.values(), strict=True))
    assert error["disturbance scale"] > 95.0
    assert error["vehicle mass [kg]"] < 2.0
    assert failure["vehicle mass [kg]"] == pytest.approx(33.3, abs=4.0)  # P(lost) = 1/4: Var 3/16, of which 1/16 each
    assert failure["nets"] == pytest.approx(33.3, abs=4.0)
    assert failure["disturbance scale"] < 1.0
    assert re.search(r"Together, (vehicle mass and nets|nets and vehicle mass) explain 3", text)


def test_correlated_keys_are_said_to_overlap_and_tables_and_grids_have_names(tmp_path, unflown):
    keys = NETS + '"start.position.0" = {type="grid", values=[0.0, 0.01]}\n[[correlated]]\n'
    keys += 'keys = ["vehicle.mass", "disturbance.scale"]\nmean = [1.0, 1.0]\ncovariance = [[0.01, 0.005], [0.005, 0.01]]'
    folder = tmp_path / "in"
    written(folder, keys)
    read = read_campaign(folder / "camp.toml")
    with opened(tmp_path / "out", read, 400, "lanes") as store:
        numbers = np.arange(400)
        drawn = draw(read.file, numbers)
        made = (
            np.exp(np.random.default_rng(0).normal(size=(400, len(METRICS))))
            * np.exp(20.0 * drawn["vehicle.mass"].values)[:, None]
        )
        store.write(store.chunks[0], table(read, numbers, drawn, np.zeros(400, dtype=np.int8), np.full(400, 0.4), made))
        written_by(store, read, folder / "camp.toml")
    text, cells = told_by(tmp_path / "out")
    assert "shares overlap" in text
    varied = {row[0]: row[-1] for row in cells if len(row) == 3}
    assert varied["vehicle mass [kg]"] == "normal, mean 1, deviation 0.1, correlated with disturbance.scale"
    assert varied["start position along x [m]"] == "each of 0, 0.01 in turn"
    assert varied["controller"] == "one of backstepping, nets enabled = off, nested-saturation"


def test_a_pair_is_told_beside_the_shares_of_its_keys_and_no_share_is_told_twice(tmp_path):
    shares = {"vehicle.mass": {"failure": Estimate(0.4, 0.3, 0.5)}}
    pair = Interaction(("vehicle.mass", "disturbance.scale"), Estimate(0.2, 0.1, 0.3), 1)
    said = [one.text for one in key_text.ranking(campaign(tmp_path, MASS), shares, {"failure": ("", pair)})]
    alone = (
        "Together, vehicle mass and disturbance scale explain 20.0 [10.0, 30.0] % of failure beyond what each explains alone."
    )
    explained = "Vehicle mass explains 40.0 [30.0, 50.0] % of the variance of failure."
    assert said == [explained, alone]
    first, *_ = key_text.ranking(campaign(tmp_path, MASS, NOISY), shares, {})
    assert first.text == f"{explained} Nothing else varies but the turbulence and the sensors' noise."


def test_the_worst_flights_say_from_when_their_errors_count_and_whether_they_succeeded(tmp_path):
    one = WorstFlight(19, "completed", None, 0.26, 0.5133)
    outcome, since = report_text.outcome_of(one, CampaignSummary(1, share(0, 1), {}, [], [one])), " from 2 s on"
    said = report_text.of_flight(one, outcome, since).replace("\N{NO-BREAK SPACE}", " ")
    assert said == "Flight 19: completed, above a limit, largest error 513.3 mm from 2 s on"
    text = str(report_text.worst({one: outcome}, [{}], since, tmp_path, tmp_path))
    assert "largest error from 2 s on" in text
    assert "then those above a limit, then the rest, each by their largest error." in text


def test_pairs_are_looked_for_only_among_keys_that_are_independent(tmp_path):
    random = np.random.default_rng(0)
    keys = {name: parts_of(random.normal(size=2000)) for name in ("vehicle.mass", "disturbance.scale")}
    result = ExplainedResult(random.normal(size=2000))
    assert report.explained(result, keys, campaign(tmp_path / "a", MASS + SCALE)).pair is not None
    group = '[[correlated]]\nkeys = ["vehicle.mass", "disturbance.scale"]\nmean = [1.0, 1.0]\n'
    read = campaign(tmp_path / "b", f"{group}covariance = [[0.01, 0.0], [0.0, 0.01]]")
    assert report.explained(result, keys, read).pair is None


def test_of_very_many_keys_the_first_are_drawn_and_the_rest_is_said_to_be_left_out(tmp_path, unflown):
    keys = "".join(
        f'"{name}.{i}" = {{type="uniform", low=0.1, high=0.2}}\n'
        for name in ("disturbance.force", "disturbance.torque", "start.rates", "start.attitude", "path.end")
        for i in range(3)
    )
    text, _ = reported(tmp_path, keys, 200)
    assert "the 12 of 15 keys that explain most" in text
    assert len(list((tmp_path / "out" / "figures").glob("key-*.svg"))) == 12


def test_names_of_a_users_own_cannot_break_the_page(tmp_path, unflown):
    reported(tmp_path, MASS, 50, head='name = "<script>alert(1)</script> & Ω 飛行"')
    html = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert html.count("<script") == html.count('<script id="reader">')
    assert "&lt;script&gt;alert(1)&lt;/script&gt; &amp; Ω 飛行" in html


def test_a_disk_that_fails_leaves_the_report_before_and_nothing_else(tmp_path, unflown, monkeypatch):
    reported(tmp_path, MASS, 50)
    before = {path: path.read_bytes() for path in (tmp_path / "out").rglob("*") if path.is_file()}
    read = read_campaign(tmp_path / "in" / "camp.toml")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(report.Evidence, "write_report", full)
    with opened(tmp_path / "out", read, 50, "lanes", resume=True) as store:
        before[store.folder / "campaign.json"] = (store.folder / "campaign.json").read_bytes()
        with pytest.raises(UserError, match="No space left"):
            written_by(store, read, tmp_path / "in" / "camp.toml")
    assert {path: path.read_bytes() for path in (tmp_path / "out").rglob("*") if path.is_file()} == before
    assert leftovers(tmp_path / "out") == []


def test_a_new_report_takes_the_place_of_the_old_one_with_all_its_pictures(tmp_path, unflown):
    reported(tmp_path, MASS, 50)
    stale = tmp_path / "out" / "figures" / "flight-7.png"
    stale.write_bytes(b"old")
    read = read_campaign(tmp_path / "in" / "camp.toml")
    with opened(tmp_path / "out", read, 50, "lanes", resume=True) as store:
        store.save(files=[*store.manifest["files"], "figures/flight-7.png", "../elsewhere", "flights/00000.parquet"])
        written_by(store, read, tmp_path / "in" / "camp.toml")
    assert not stale.exists()
    assert (tmp_path / "out" / "flights" / "00000.parquet").exists()
    assert all((tmp_path / "out" / name).is_file() for name in store.manifest["files"])


def test_success_and_errors_by_key_are_those_of_the_flights():
    random = np.random.default_rng(0)
    places, success = random.integers(0, 5, 1000), random.uniform(size=1000) < 0.8
    places[places == 3] = 4
    rmse = np.where(success, random.lognormal(size=1000), np.nan)
    rmse[places == 1] = np.nan
    shown = pictures.by_key(Bins(places, None, ("a", "b", "c", "d", "e")), success, rmse, np.ones(1000, bool))
    assert set(shown.good) == {0, 1, 2, 4}
    assert set(shown.errors) == {0, 2, 4}
    for place, one in shown.good.items():
        assert one == share(int(success[places == place].sum()), int((places == place).sum()))
    for place, quantiles in shown.errors.items():
        known = rmse[(places == place) & np.isfinite(rmse)]
        assert quantiles.tolist() == np.quantile(known, [0.1, 0.5, 0.9]).tolist()


def test_the_curve_of_those_that_are_worse_counts_the_lost_as_worse(monkeypatch, tmp_path):
    figures = []
    monkeypatch.setattr(canvas, "write", lambda figure, path, sheet: figures.append(figure))
    values = np.random.default_rng(0).lognormal(size=900)
    pictures.draw_distributions(tmp_path / "x", [pictures.PlottedMetric("m", values, 1.0)], 1000)
    (axes,) = figures[0].axes
    x, y = axes.lines[0].get_data()
    for at, share_worse in zip(x, y, strict=True):
        assert share_worse == pytest.approx((100 + (values >= at).sum()) / 1000)
    assert axes.get_xscale() == "log"


def test_lines_of_a_ranking_end_where_the_intervals_end(monkeypatch, tmp_path):
    figures = []
    monkeypatch.setattr(pictures, "write", lambda figure, path, sheet: figures.append(figure))
    ranking = {"a": {"x": Estimate(0.5, 0.4, 0.6), "y": Estimate(0.1, 0.0, 0.2)}, "b": {"x": Estimate(0.2, 0.1, 0.3)}}
    pictures.draw_ranking(tmp_path / "x", ranking)
    drawn = {axes.get_title(loc="left"): axes for axes in figures[0].axes}
    ends = {name: [list(line.get_xdata()) for line in axes.lines] for name, axes in drawn.items()}
    assert ends == {"x": [[40.0, 60.0], [10.0, 30.0]], "y": [[0.0, 20.0]]}
    assert [[round(bar.get_width(), 9) for bar in drawn[name].patches] for name in "xy"] == [[50.0, 20.0], [10.0]]


def test_the_view_of_a_lost_flight_stays_near_the_wanted_path():
    t = np.linspace(0.0, 1.0, 50)[:, None]
    wanted = t * np.array([4.0, 0.0, 2.0])
    low, high = Track(np.zeros(50), wanted, wanted + 1e4 * t**2).view
    assert (low <= wanted.min(axis=0)).all()
    assert (high >= wanted.max(axis=0)).all()
    assert (high - low).max() < 4.0 * 4.0
    assert Track(np.zeros(50), wanted, wanted + np.array([0.0, 0.05, 0.0])).views == []  # a straight line
    level = np.column_stack([t, t**2, 0.0 * t])
    assert Track(np.zeros(50), level, level).views == [(0, 1)]
    low, high = Track(np.zeros(5), np.zeros((5, 3)), np.zeros((5, 3))).view
    assert (high > low).all()


@pytest.mark.parametrize(("content", "words"), [
    ({"type": "uniform", "low": 1.0, "high": 2.5}, "uniform from 1 to 2.5"),
    ({"type": "sobol", "low": 1.0, "high": 2.5}, "Sobol sequence from 1 to 2.5"),
    ({"type": "normal", "mean": 1.0, "deviation": 0.1, "high": 2.0}, "normal, mean 1, deviation 0.1, nothing above 2"),
    ({"type": "log-normal", "median": 0.5, "sigma": 0.5}, "log-normal, median 0.5, σ 0.5"),
    ({"type": "choice", "values": [True, False], "weights": [1, 3]}, "one of on, off, weights 1, 3"),
    ({"type": "grid", "low": 0.0, "high": 1.0, "count": 11}, "each of 11 from 0 to 1 in turn"),
    ({"type": "grid", "values": list(range(12))}, "each of 0, 1, 2, 3, 4, 5, 6, 7, 8, 9 ... (12) in turn"),
])  # fmt: skip
def test_every_distribution_is_told_in_words(content, words):
    assert variation_text(varying(key=content), "key") == words


def test_what_the_page_about_campaigns_shows_works(tmp_path, flown, monkeypatch):
    page = (DOCS / "campaigns.md").read_text(encoding="utf-8")
    files = [tomllib.loads(block) for block in re.findall(r"```toml\n(.*?)```", page, re.DOTALL)]
    for content in files:
        check(CampaignFile, {"mission": "mission.toml", **content}, "campaigns.md")
    assert set(files[0]) == set(CampaignFile.model_fields) - {"correlated", "rare"}  # the latter in docs/rare.md
    kinds = re.findall(r"^\| `([a-z-]+)` \|", page, re.MULTILINE)
    assert kinds == ["uniform", "normal", "log-normal", "choice", "grid", "sobol"]
    assert all(f"`{name.partition('[')[0]}" in page or "torque" in name for name in METRICS)
    code = next(block for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if "dataset" in block)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "trust").symlink_to(flown[0])
    monkeypatch.chdir(tmp_path)
    names = {}
    exec(code, names)
    assert names["lost"].column_names == ["flight", "time_of_failure[s]"]
    assert names["lost"].num_rows == flown[2].outcomes["spinning"]
    assert names["flights"].count_rows() == 200
    assert pyarrow.dataset.dataset("out/trust/flights").schema.names[0] == "flight"


@pytest.mark.parametrize("name", ["trust", "trust_wind"])
def test_the_examples_can_be_flown(name, tmp_path, unflown):
    path = DOCS.parent / "examples" / f"{name}.toml"
    assert path.read_text(encoding="utf-8").startswith("# ")
    read = read_campaign(path)
    assert all(variation_text(read.file, key) for key in read.file.keys)
    done = fly_campaign(CampaignRequest(path, tmp_path / "out", flights=2))
    assert done.summary.outcomes == {"completed": 2}


def test_no_number_mixes_the_flights_with_the_values_of_a_choice_that_decides(tmp_path, unflown, monkeypatch):
    """The answer has the rates by value; so have the cards and tables, whose intervals are of these flights alone."""

    def lost(values, flights):
        return np.where(~values["controller.nets.enabled"] & (flights % 5 == 0), LOST, 0)

    def made(values, flights):
        return np.where(values["controller.nets.enabled"], 0.1, 0.4)[:, None] * np.ones((1, len(METRICS)))

    said = {"Nets decide.": ("controller.nets.enabled",)}

    def summarised(store, _, varies, plain=summarise):
        flown = store.read()
        on = flown["controller.nets.enabled"].to_numpy()
        parts = {which: tallied(flown.filter(some), 0.025) for which, some in (("nets on", on), ("nets off", ~on))}
        return plain(store, flown, varies)._replace(by="Nets decide.", findings=said, parts=parts)

    monkeypatch.setitem(globals(), "summarise", summarised)
    text, cells = reported(tmp_path, '"controller.nets.enabled" = {type="choice", values=[true, false]}\n', 2000, lost, made)
    drawn = rows(tmp_path / "out")
    off = ~np.array(drawn["controller.nets.enabled"])
    gone = int((np.array(drawn["outcome"]) != "completed").sum())
    assert ["nets on", "completed, succeeded", f"{(~off).sum():,}", "100 [99.6, 100]"] == next(
        [*row[:3], re.sub(r"100 \[99\.\d+, 100\]", "100 [99.6, 100]", row[3])] for row in cells if row and row[0] == "nets on"
    )
    assert ["nets off", "lost: off-path", str(gone), report_text.percent(share(gone, int(off.sum())))] in cells
    assert all(row[0] in ("nets on", "nets off") for row in cells if "position RMSE" in row)
    assert "99th percentile of position RMSE" not in text or "percentile of position RMSE, nets on" in text
    plain = re.sub(r"\s+", " ", text)
    assert re.search(r"percentile of position RMSE, nets on 100 mm", plain)
    assert "of all flights" not in plain and not (tmp_path / "out" / "figures" / "distributions.svg").exists()
    paper = re.findall(r"^(\w.+?) & ", (tmp_path / "out" / "table.tex").read_text(), re.MULTILINE)
    assert all(re.search(", nets (on|off)$", row) for row in paper)
    assert "lost: off-path, nets off" in paper and "lost: off-path, nets on" not in paper
    with opened(tmp_path / "out", read_campaign(tmp_path / "in" / "camp.toml"), 2000, "lanes", resume=True) as store:
        lines = " ".join(sentences(summarised(store, None, True)))
    assert f"Ended early with nets off: {gone} off-path." in lines and "Ended early with nets on" not in lines
    assert f"Position RMSE of the {(~off).sum():,} completed flights with nets on: 50 % below 100 mm" in lines
    assert re.search(r"percentile of position RMSE, nets off 400 mm 95 % interval: [^;]*; of completed flights only", plain)


def test_a_caption_over_a_key_does_not_claim_that_nothing_was_found():
    """Of a key without a sentence: the search for one tells the strongest keys, and is silent on weak ones that matter."""
    assert key_text.over_key("vehicle.mass", []) == "The flights over vehicle mass."


def test_largest_errors_that_are_the_starts_own_are_said_to_be_from_more_than_half_of_the_flights_on():
    offsets = np.array([1.0, 0.5, 0.0, 2.0])
    most = report_text.from_the_start(np.array([1.0, 0.5, 0.0, 2.0]), offsets, True)
    assert most.startswith("In 3 of 4 completed flights the largest error is the one at the start")
    assert "`score_from`" in most
    assert "score_from" not in report_text.from_the_start(offsets, offsets, False)  # which the paper's plant does not have
    assert report_text.from_the_start(np.array([1.0, 0.5, 0.0, 2.1]), offsets, True) == ""


def test_what_all_failed_flights_share_is_told_only_where_chance_does_not_explain_it():
    """Every sentence is true of the flights; of flights that fail at random hardly any has one."""
    random, flights, wrong = np.random.default_rng(7), 400, 0
    for turn in range(200):
        values = {"vehicle.mass": random.normal(1.0, 0.1, flights), "disturbance.scale": random.lognormal(0.0, 0.7, flights)}
        nets = random.integers(0, 2, flights)
        columns = {key: VariedKey(one, None, parts_of(one)) for key, one in values.items()}
        columns["controller.nets.enabled"] = VariedKey(nets, ("on", "off"), parts_of(nets.astype(float)))
        units_of = {"vehicle.mass": "kg", "disturbance.scale": "", "controller.nets.enabled": ""}
        caused = turn < 50
        failed = (values["disturbance.scale"] > 2.5 if caused else random.random(flights) < 0.02) & (
            random.random(flights) < 0.9
        )
        kinds = {
            "lost flights": failed,
            "flights above a limit": (nets == 1) & (random.random(flights) < (0.2 if caused else 0.0)),
        }
        said = in_common(kinds, columns, units_of)
        wrong += bool(said) and not caused
        for one in said if caused else ():
            count, kind, fit, found = re.fullmatch(r"All (\d+) (.*?) are among the (\d+) with (.*)\.", one).groups()
            assert int(count) == kinds[kind].sum()
            if kind == "lost flights":
                end = found.removeprefix("a disturbance scale of at least ")
                assert (values["disturbance.scale"][failed] >= float(end) * (1.0 - 1e-12)).all()
                assert int(fit) == (values["disturbance.scale"] >= float(end) * (1.0 - 1e-12)).sum()
            else:
                assert (found, int(fit)) == ("nets off", (nets == 1).sum())
        assert not caused or len(said) == 1 + ((nets == 1).mean() <= 0.6)
    assert wrong <= 12, "5 % of 150, and some"


def test_the_legend_of_keys_and_names_of_values_have_room_and_a_panel_without_lines_is_grey(tmp_path, monkeypatch):
    seen = []
    monkeypatch.setattr(pictures, "write", lambda figure, *_: (figure.draw_without_rendering(), seen.append(figure)))
    laws, random = ("geometric", "rotation-backstepping"), np.random.default_rng(5)
    law, late = random.integers(0, 2, 400), random.integers(0, 3, 400)
    good, error = random.random(400) < 0.5, random.random(400)
    every, each = {"": law >= 0}, {f"controller = {name}": law == place for place, name in enumerate(laws)}
    by = {"latency": (("0", "0.02", "0.04"), late, each), "controller": (laws, law, every)}
    keys = []
    for name, (labels, places, apart) in by.items():
        cut = Bins(places, None, labels)
        lines = {one: pictures.by_key(cut, good, error, where) for one, where in apart.items()}
        keys.append(pictures.PlottedKey(name, cut, lines, ("largest_error[m]", None)))
    for shown in ([*keys, keys[0]], keys[:1], keys[1:]):
        pictures.draw_keys(tmp_path / "keys", shown)
        for axes in seen[-1].axes:
            box, ticks = axes.get_window_extent(), [one.get_window_extent() for one in axes.get_xticklabels()]
            assert all(left.x1 + 3.0 < right.x0 for left, right in itertools.pairwise(ticks))
            if legend := axes.get_legend():
                held = legend.get_window_extent()
                assert held.x1 <= box.x1 + 3.0 and held.y0 >= axes.title.get_window_extent().y1 - 3.0
                assert held.y1 <= seen[-1].bbox.y1
        assert bool(seen[-1].axes[0].get_legend()) == (shown[0] is keys[0])
    blue = pictures.CURVES[0]
    assert blue not in [line.get_color() for line in seen[-1].axes[0].lines], "the colour of a value where there is a legend"
