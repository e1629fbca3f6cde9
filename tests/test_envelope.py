"""`quadstep envelope`: the map holds what flights flown one by one give, each in its own cell."""

import itertools
import json
import math
import re
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from matplotlib.figure import Figure

from quadstep import flight_metrics
from quadstep.engines.fly import fly
from quadstep.engines.scored import LARGEST, RMSE
from quadstep.metrics.statistics import share
from quadstep.mission.fields import label
from quadstep.mission.read import check_mission
from quadstep.numbers.noise import key
from quadstep.page.thumbnails import first_panel
from quadstep.report import canvas
from quadstep.report.panels import grade_of
from quadstep.report.sheet import Sheet
from quadstep.report.told import SPOTS
from quadstep.studies import envelope
from quadstep.studies import study as study_module
from quadstep.studies.campaign.flyer import OUTCOME, OUTCOMES, SUCCESS, Chunk, Flyer, on_lanes
from quadstep.studies.campaign.single import flown_again
from quadstep.studies.envelope import Map, watched
from quadstep.studies.envelope_answer import Envelope, MapPanel, along, answer, caption, how_sure
from quadstep.studies.envelope_cells import CAUSES, Cells, cells_of, middle
from quadstep.studies.envelope_map import LOOKS, by_success, draw_panel, draw_scale, draw_slices, legend, scale
from quadstep.studies.envelope_request import NOISY_FLIGHTS, request
from quadstep.studies.study import run
from tests.campaigns import MASS, NOISY, SHORT, written
from tests.commands import LINE, quadstep, write
from tests.pages import data_of

CASE = '[path]\ntype = "minimum-jerk"\nend = [20.0, 5.0, 10.0]\nduration = 40.0\n'
DURATIONS, SCALES, NETS = (2.0, 3.0, 4.0, 5.0), (0.0, 1.0, 2.0), (True, False)


def rows(folder):
    """The rows of the map."""
    return pq.read_table(folder / "envelope.parquet").to_pylist()


def about(folder):
    """metrics.json."""

    def refuse(constant):
        raise AssertionError(constant)

    return json.loads((folder / "metrics.json").read_text(encoding="utf-8"), parse_constant=refuse)


def saved(folder, text=SHORT, name="mission.toml"):
    """A mission file."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    """The paper's Case 1 in little time, nets on and off: (what the command said, its folder)."""
    folder = tmp_path_factory.mktemp("case")
    run = quadstep(
        "envelope", saved(folder, CASE), "--x", "path.duration=2:5:4", "--y", "disturbance.scale=0,1,2",
        "--by", "controller.nets.enabled=true,false", "--failure", "largest_error=0.5", "--out", folder / "out",
    )  # fmt: skip
    assert (run.code, run.err) == (0, "")
    return run, folder / "out"


# What the map holds


def test_every_cell_is_the_flight_flown_by_itself(case):
    found = {(row["controller.nets.enabled"], row["disturbance.scale"], row["path.duration"]): row for row in rows(case[1])}
    assert len(found) == 24
    for nets, disturbance, duration in itertools.product(NETS, SCALES, DURATIONS):
        content = {
            "path": {"type": "minimum-jerk", "end": [20.0, 5.0, 10.0], "duration": duration},
            "controller": {"type": "backstepping", "nets": {"enabled": nets}},
            "disturbance": {"scale": disturbance},
        }
        log = fly(check_mission(content, "m.toml").plan())
        row, alone = found[nets, disturbance, duration], flight_metrics(log)
        name = log.outcome.name.lower().replace("_", "-")
        through = name == "completed"
        assert (row["outcome"], row["completed"], row["flights"]) == (name, int(through), 1)
        if not through:
            assert (row["success"], row["cause"]) == (0.0, name)
            assert row["position_rmse_median[m]"] is row["largest_error[m]"] is None
            continue
        for column in ("position_rmse_median[m]", "position_rmse_mean[m]"):
            assert row[column] == pytest.approx(alone["position_rmse[m]"], rel=1e-6)
        good = row["largest_error[m]"] <= 0.5
        assert (row["success"], row["cause"]) == ((1.0, None) if good else (0.0, "over-limit"))
    assert {row["cause"] for row in found.values()} >= {None, "over-limit", "spinning"}  # the case has something of all


def test_rows_are_in_order_with_x_first_and_turning_fastest(case):
    table = pq.read_table(case[1] / "envelope.parquet")
    assert table.column_names[:3] == ["path.duration", "disturbance.scale", "controller.nets.enabled"]
    got = list(zip(*(table[name].to_pylist() for name in table.column_names[:3]), strict=True))
    assert got == [(x, y, by) for by in NETS for y in SCALES for x in DURATIONS]


def test_the_sentence_and_the_manifest_say_how_much_is_flyable(case):
    run, out = case
    panels = about(out)["panels"]
    assert [panel["name"] for panel in panels] == ["nets on", "nets off"]
    for nets, panel in zip(NETS, panels, strict=True):
        here = [row for row in rows(out) if row["controller.nets.enabled"] is nets]
        good = [row["position_rmse_median[m]"] for row in here if row["success"] == 1.0]
        assert (panel["cells"], panel["flyable"]) == (12, len(good))
        assert panel["success"] == pytest.approx(len(good) / 12)
        assert panel["rmse[m]"] == [min(good), max(good)]
        assert sum(panel["causes"].values()) == 12 - len(good)
        of = " combinations of path duration and disturbance scale can be flown" if nets else ""
        counted = f"{len(good)} of 12{of}"
        assert f"{counted} with {panel['name']}" in " ".join(run.out.split())
    assert run.out.count("however large the error") == 0, "an error above 0.5 m is a failure here"
    assert panels[0]["flyable"] != panels[1]["flyable"]
    assert about(out)["axes"]["x"] == {"key": "path.duration", "values": [2.0, 3.0, 4.0, 5.0]}
    flew = about(out)["mission"]["controller"]["type"]
    assert flew == "backstepping", "though the file does not say so: else two maps would seem to differ in it"
    assert sorted(path.name for path in out.iterdir()) == about(out)["files"]
    assert {"envelope.png", "envelope.svg"} < set(about(out)["files"])


def test_the_picture_of_a_card_says_which_values_were_flown_not_where_cells_end(case):
    with (case[1] / "envelope.svg").open("rb") as figure:
        said = re.findall(r"<text [^>]*>([^<]*)</text>", first_panel(figure))
    assert said[-2:] == ["disturbance scale", "path duration [s], 2 to 5"], "a list has no range"


def test_a_cell_leads_to_its_flight(case):
    _, out = case
    report, page = (out / "report.html").read_text(), (out / "flights.html").read_text()
    assert (
        "4 values of path.duration from 2 s to 5 s" in (told := report.replace("\N{NO-BREAK SPACE}", " "))
        and "on, off" in told
    )
    assert all(f'href="flights.html#flight=flight-{cell}"' in report for cell in range(24))
    assert '"path duration = 3\\u00a0s, disturbance scale = 2, nets off"' in page, "cell 21"
    assert "click one to see the flight of that cell." in report
    flights = data_of(page)["flights"]
    found, grades = rows(out), {one["id"]: one["outcome"]["grade"] for one in flights}
    colours = {one["id"]: one["cell"]["colour"] for one in flights}
    seen = [(row["position_rmse_median[m]"], colours[f"flight-{i}"]) for i, row in enumerate(found) if row["success"]]
    light = [sum(int(colour[i : i + 2], 16) for i in (1, 3, 5)) for _, colour in sorted(seen)]
    assert len(seen) == sum(map(bool, colours.values())) and light == sorted(light), "as the map: lighter means larger"
    wanted = {"over-limit": "above the limit", None: ""}
    assert {"over-limit", None} < {row["cause"] for row in found} and len(found) == len(grades) == 24
    for cell, row in enumerate(found):
        grade = grades[f"flight-{cell}"]
        assert (grade if grade in ("above the limit", "lost") else "") == wanted.get(row["cause"], "lost")


def test_the_flight_of_a_cell_is_the_first_that_ends_as_at_least_half_do_there(tmp_path):
    asked, random = (
        request(saved(tmp_path), "path.duration=1:2:2", "disturbance.scale=0,1", flights=4),
        np.random.default_rng(8),
    )
    for _ in range(30):
        good = random.random(16) < 0.5
        ended = pa.DictionaryArray.from_arrays(np.where(good, 0, 1), [*OUTCOMES])
        flown = pa.table({OUTCOME: ended, SUCCESS: good, RMSE: np.full(16, 0.1), LARGEST: np.full(16, 0.1)})
        found = cells_of(asked, [((0, 0, 16), flown)])
        for cell, flight in enumerate(found.shown.ravel().tolist()):
            most = good[cell::4].mean() >= 0.5
            assert flight == next(one for one in range(cell, 16, 4) if good[one] == most)
            assert found.successes.flat[cell] == good[cell::4].sum()


def test_cells_of_a_large_map_lead_to_their_flights_here_and_there(tmp_path):
    large = request(saved(tmp_path), "path.duration=1:40:40", "disturbance.scale=0:5:26")
    rows, columns = np.unravel_index(watched(large), (26, 40))
    assert 50 < len(rows) <= 100
    assert len({*np.diff(np.unique(rows)), *np.diff(np.unique(columns))}) == 1, "evenly"


def test_greys_of_causes_differ():
    greys = [float(grey) for grey, _, _ in LOOKS.values()]
    assert np.diff(sorted(greys)).min() > 0.07
    assert len({hatch for _, hatch, _ in LOOKS.values()}) == len(CAUSES) == len(greys)


def test_a_limit_of_something_else_and_what_is_open_are_said(tmp_path):
    """Of how many combinations flights do not decide is counted by the intervals of the table."""
    asked = request(write(tmp_path, LINE), "path.duration=0.5:1:2", "vehicle.mass=1:1.1:2", failures=["effort_thrust=1e9"])
    assert asked.campaign.meaning == (
        " (success means reaching the end with thrust effort at most 1e+09 N, however large the error)"
    )
    one = made([[[1, 1], [1, 0]]], 0.1)
    assert how_sure(Envelope(asked, one, [])) == ""
    assert how_sure(Envelope(asked._replace(random=True), one, [])) == " Each was flown once, so chance decides, too."
    random = np.random.default_rng(2)
    for flights, said in ((4, "all 4 flights"), (20, "at least 19 of 20 flights"), (200, "at least 190 of 200 flights")):
        several = asked._replace(random=True, flights=flights)
        for _ in range(20):
            successes = random.binomial(flights, random.choice([0.2, 0.9, 0.99], (1, 2, 2)))
            cells, many = made(successes, 0.1, flights=flights), int((successes >= 0.95 * flights).sum())
            panel, told = MapPanel("", 4, many, 0.5, {}, None), how_sure(Envelope(several, cells, []))
            first = answer(Envelope(several, cells, [panel])).split(". ")[0]
            whole = many and cells.flyable.sum() == (successes == flights).sum()
            pairs = "combinations of path duration and vehicle mass"
            did = f"{f'all {flights} flights' if whole else said} succeed"
            begun = (
                f"In {'all' if many == 4 else f'{many} of'} 4 {pairs}, {did}ed"
                if many
                else f"In none of the 4 {pairs} did {did}"
            )
            assert first.startswith(begun)
            rate, wide = (
                "a success rate of 95 %",
                [(one := share(int(n), flights)).low < 0.95 <= one.high for n in successes.flat],
            )
            good, bad = (int((np.array(wide) & of.ravel()).sum()) for of in (cells.flyable, ~cells.flyable))
            which = f" in {'any' if good == many else good} of these"
            whole = f" in {bad} of the {'others' if many else 'combinations'}"
            parts = [f"show {rate}{which}"] * bool(good) + [f"rule {'it out' if good else f'out {rate}'}{whole}"] * bool(bad)
            assert told.replace(
                "\N{NO-BREAK SPACE}", " "
            ) == f" {flights} flights are too few to {' or to '.join(parts)}." * bool(parts)


def test_errors_are_said_to_be_those_of_flyable_cells_or_of_coloured_ones(tmp_path):
    asked = request(saved(tmp_path), "path.duration=1:3:3", "disturbance.scale=0:50:2", flights=4)
    cells = made([[[4, 4, 3], [2, 1, 0]]], [[[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]]], flights=4)
    found = Envelope(asked._replace(random=True), cells, [MapPanel("", 6, 2, 0.5, {}, (0.1, 0.2))])
    told = "Colour: median position RMSE, 100 to 400 mm; lighter means larger."
    causes = np.zeros_like(cells.causes)
    causes[..., 0] = cells.causes.sum(axis=-1)
    both = causes.copy()
    both[0, 1, 2] = cells.causes[0, 1, 2]
    looks = ("Hatched", cells.causes), ("Dotted", causes), ("Hatched or dotted", both)
    for look, shown in ((look, cells._replace(causes=some)) for look, some in looks):
        said = caption(found._replace(cells=shown), linked=False).replace("\N{NO-BREAK SPACE}", " ")
        assert said.splitlines() == [
            told,
            f"{look}: 2 cells in which fewer than half of the flights succeed.",
            "Struck through: 2 cells in which fewer than 4 of 4 succeed.",
        ]


def test_a_map_without_a_flyable_cell_names_its_best_and_shows_success_rates(tmp_path):
    """Whatever the map: so many succeed in the cell that is named, and in no other more."""
    random, such = np.random.default_rng(5), set()
    asked = request(saved(tmp_path), "path.duration=1:5:5", "disturbance.scale=0:3:4", flights=20)._replace(random=True)
    for most in (0, 1, 3, 9, 10, 18):
        successes = random.integers(0, most + 1, (1, 4, 5))
        cells = made(successes, 0.1, flights=20)
        said = answer(Envelope(asked, cells, [MapPanel("", 20, 0, 0.1, {}, None)])).replace("\N{NO-BREAK SPACE}", " ")
        over = "combinations of path duration and disturbance scale"
        assert said.startswith(f"In none of the 20 {over} did at least 19 of 20 flights reach the end")
        found = re.search(
            r"; in (.*?), path duration = (\d) s and disturbance scale = (\d), (\d+) of 20 flights reach the end\.",
            said,
        )
        assert bool(found) == bool(successes.max())
        if found:
            assert int(found[4]) == successes[0, int(found[3]), int(found[2]) - 1] == successes.max()
            such.add((found[1], int((successes == successes.max()).sum()) == 1))
        told = caption(Envelope(asked, cells, []), linked=False)
        few = (successes >= 10).mean() < 0.1 and np.ptp(successes) > 0
        assert told.startswith("Colour: share of flights that succeed, ") == few == by_success(cells)
        if few:
            assert not drawn(asked, cells).patches, "nothing is grey"
    assert {one for one, _ in such} == {"the best", "one of the best"} and all(
        (one == "the best") == only for one, only in such
    )


def test_an_axis_that_makes_no_difference_is_named(tmp_path):
    asked = request(write(tmp_path, LINE), "path.duration=2:3:2", "vehicle.mass=1:1.1:2")
    rmse = np.array([[[1.0, 2.0], [1.0, 2.0]]])
    zeros, ones = np.zeros((1, 2, 2), int), np.ones((1, 2, 2), int)
    cells = Cells(1, False, np.zeros((1, 2, 2, 6), int), ones, rmse, rmse, rmse, zeros, np.stack([rmse] * 3))
    found = Envelope(asked, cells, [MapPanel("", 4, 4, 1.0, {}, (1.0, 2.0))])
    assert answer(found).endswith(" No result depends on vehicle mass.")
    differs = found._replace(cells=cells._replace(largest=np.array([[[1.0, 2.0], [1.0, 2.1]]])))
    assert "No result" not in answer(differs)
    lost = cells._replace(completed=0 * cells.completed, rmse=np.nan * rmse, mean=np.nan * rmse, largest=np.nan * rmse)
    assert "No result" not in answer(found._replace(cells=lost))  # when they were lost may well depend on it


def test_without_a_limit_flyable_is_said_to_be_to_the_end_only(tmp_path):
    axes = "--x", "path.duration=0.5:1:2", "--y", "vehicle.mass=1:1.1:2"
    run = quadstep("envelope", write(tmp_path, LINE), *axes, "--out", tmp_path / "out")
    assert "All 4 combinations of path duration and vehicle mass reach the end" in " ".join(run.out.split())
    report = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert not re.search(r"shows no limit|can be flown[ ,.:]|succe", re.search(r'class="answer">(.*?)</p>', report)[1])


def test_of_a_map_without_limits_as_many_flights_are_not_as_commanded_as_have_that_grade_on_its_page(tmp_path):
    """On a circle that is soon too fast."""
    text = '[vehicle]\npreset = "crazyflie"\n[path]\ntype = "circle"\nradius = 1.0\nperiod = 6.0\nturns = 1\n'
    seen = set()
    for place, (x, more) in enumerate((("path.period=1:9:4", ()), ("path.period=1:1.5:2", ()), ("path.period=12:15:2", ()))):
        out = tmp_path / f"{place}"
        run = quadstep("envelope", saved(tmp_path, text), "--x", x, "--y", "vehicle.mass=0.030:0.034:2", *more, "--out", out)
        grades = [one["outcome"]["grade"] for one in data_of((out / "flights.html").read_text())["flights"]]
        ended = [one for one in grades if one != "lost"]
        good, told = ended.count("as commanded"), " ".join(run.out.split())
        found = re.search(r"[.;] (none|All|\d+) of the (\d+)(?: that reach the end)? (?:is|are) (not )?as commanded", told)
        assert int(found[2]) == len(ended) and ".." not in told, told
        counts = {"flights": len(ended), "not as commanded": len(ended) - good}
        kept = json.loads((out / "metrics.json").read_text())["graded"]
        assert {**kept, **counts} == kept and max(kept["lacks"].values(), default=0) <= len(ended) - good
        wanted = ("none", None) if not good else ("All", None) if good == len(ended) else (f"{len(ended) - good}", "not ")
        assert (found[1], found[3]) == wanted
        seen.add(found[1] if found[1] in ("none", "All") else "some")
    assert seen == {"none", "All", "some"}, seen


def test_whatever_flights_of_a_map_are_graded_the_answer_says_of_how_many_and_what_they_lack(tmp_path):
    """Any map: the counts of the sentence are those of the flights, and those that are not graded are said not to be."""
    random, seen = np.random.default_rng(11), set()
    for _ in range(400):
        flights = int(random.choice([1, 1, 4]))
        asked = request(saved(tmp_path), "path.duration=1:3:3", "disturbance.scale=0:3:2", flights=flights)
        cells = made(random.binomial(flights, random.choice([0.3, 0.9, 1.0]), (1, 2, 3)), 0.1, flights=flights)
        some = [cell for cell in np.flatnonzero(cells.successes).tolist() if random.random() < random.choice([0.5, 1.0])]
        names, share = ("large error", "shaking"), random.choice([0.0, 0.5, 1.0])
        lacking = {cell: names[: random.integers(1, 3)] if random.random() < share else () for cell in some}
        found = Envelope(asked, cells._replace(lacking=lacking), [MapPanel("", 6, int(cells.flyable.sum()), 0.5, {}, None)])
        told, bad = answer(found).replace("\N{NO-BREAK SPACE}", " "), [labels for labels in lacking.values() if labels]
        more, limited = (
            int(cells.successes.sum()) - len(lacking),
            asked._replace(
                campaign=asked.campaign._replace(
                    file=asked.campaign.file.model_copy(update={"failure": {"position_rmse": 1.0}})
                )
            ),
        )
        assert "commanded" not in answer(found._replace(asked=limited)), "the limit judges"
        said = re.search(r"[.;] ([^.;]*) as commanded([:.] [^.;]*)?(; the other ((?:\d+ are|is)) not graded)?\.", told)
        if not lacking:
            assert not said and ("is graded" in told) == (more > 0), told
            continue
        assert (said[4] or "0 are") == ("is" if more == 1 else f"{more} are") and ("graded flights" in said[1]) == (
            more > 0
        ), told
        counts = [sum(name in labels for labels in bad) for name in names]
        if len(lacking) == 1:
            assert (" not" in said[1]) == bool(bad) and "nly one" in said[1], told
        else:
            count = re.match(r"(\w+) of the (\d+)", said[1])
            assert int(count[2]) == len(lacking) and (" not" in said[1]) == (0 < len(bad) < len(lacking)), told
            assert count[1] == ("All" if not bad else "none" if len(bad) == len(lacking) else str(len(bad))), told
            assert all(
                (f"{name} in {count}" in (said[2] or "").lower()) == (count > 0)
                for name, count in zip(names, counts, strict=True)
            )
        crosses = f"Crosses: {len(bad)} of the {len(lacking)} flights that are graded."
        assert (crosses in caption(found, linked=True)) == (flights == 1 and more > 0 < len(bad) < len(lacking)), told
        seen.add((len(lacking) == 1, bool(more), 0 if not bad else 2 if len(bad) == len(lacking) else 1))
    assert len(seen) == 10, seen


def test_flights_that_are_not_shown_are_graded_and_marked_too(tmp_path, monkeypatch):
    monkeypatch.setattr(envelope, "MOST_WATCHED", 2)
    text = '[vehicle]\npreset = "crazyflie"\n[path]\ntype = "circle"\nradius = 1.0\nperiod = 6.0\nturns = 1\n'
    out, axes = tmp_path / "out", ("path.period=0.4:9:5", "vehicle.mass=0.030:0.034:2")
    run = quadstep("envelope", saved(tmp_path, text), "--x", axes[0], "--y", axes[1], "--out", out)
    again = flown_again(request(tmp_path / "mission.toml", *axes).campaign, [*range(10)])
    grades = [
        grade_of(one.log, one.replay.mission.flight_metrics(one.log)[0])
        for one in again
        if one.log.outcome.name == "COMPLETED"
    ]
    bad, told = [one for one in grades if one.labels], " ".join(run.out.split())
    assert 0 < len(bad) < len(grades) and any("left its path" in one.labels for one in bad), grades
    assert f"{len(bad)} of the {len(grades)} " in told and " not as commanded: " in told, told
    assert f"left its path in {sum('left its path' in one.labels for one in bad)}" in told
    assert len(data_of((out / "flights.html").read_text())["flights"]) == 2
    report = (out / "report.html").read_text()
    whys = {", ".join(one.labels).replace(", ", " and ") if len(one.labels) < 3 else "" for one in bad}
    assert all(f"not as commanded: {why}" in report for why in whys), "under the pointer"


def test_of_a_large_map_those_shown_and_the_worst_are_graded_and_how_many_are_not_is_said(tmp_path, monkeypatch):
    monkeypatch.setattr(envelope, "MOST_WATCHED", 4)
    monkeypatch.setattr(envelope, "MOST_GRADED", 3)
    axes, out = ("path.duration=0.5:1:3", "vehicle.mass=1:1.1:4"), tmp_path / "out"
    run = quadstep("envelope", path := write(tmp_path, LINE), "--x", axes[0], "--y", axes[1], "--out", out)
    worst = np.argsort([-row["position_rmse_median[m]"] for row in rows(out)])[:3].tolist()
    graded = len({*worst, *watched(request(path, *axes))})
    assert len(data_of((out / "flights.html").read_text())["flights"]) == 4 < graded < 12
    wanted = rf"end; none of the {graded} graded flights is as commanded\..*; the other {12 - graded} are not graded"
    assert re.search(wanted, " ".join(run.out.split())), run.out


def test_large_numbers_of_a_map_have_separators(tmp_path):
    asked = request(saved(tmp_path), "path.duration=1:3:60", "disturbance.scale=0:3:50", flights=2000)
    successes = np.full((1, 50, 60), 2000)
    successes[0, :30] = 1500
    cells = made(successes, 0.1, flights=2000)
    cells = cells._replace(lacking={cell: ("large error",) * (cell > 5) for cell in range(1500)})
    told = answer(Envelope(asked, cells, [MapPanel("", 3000, 1200, 0.85, {}, None)])).replace("\N{NO-BREAK SPACE}", " ")
    assert {"1,200", "3,000", "1,494", "1,500", "2,000"} <= {*re.findall(r"[\d,]*\d", told)}, told
    assert not re.search(r"\d{4}", told), told
    failed = envelope.row(MapPanel("", 3000, 1200, 0.85, {"crashed": 1368}, None), 1.0)
    assert failed[1:3] == ["3,000", "1,200"] and failed[5].startswith("1,368 "), failed


def test_the_answer_says_where_the_map_can_be_flown_and_where_not(tmp_path):
    """Of any map, each cell that the first sentence names is as it says; bounds are rounded so that they hold."""
    random, seen = np.random.default_rng(3), set()
    asked = request(write(tmp_path, LINE), "path.duration=2:8:8", "vehicle.mass=1:1.1:4")
    for _ in range(400):
        corner = random.integers(-1, 9), random.integers(-1, 5)
        rows, columns = np.mgrid[:4, :8]
        good = (columns >= corner[0]) & (rows <= corner[1]) ^ (random.random((4, 8)) < random.choice([0.0, 0.0, 0.03]))
        flyable = (good ^ bool(random.integers(2)))[None].astype(int)
        count = int(flyable.sum())
        first = answer(Envelope(asked, made(flyable, np.ones_like(flyable)), [MapPanel("", 32, count, 0.5, {}, (1.0, 1.0))]))
        first = re.split(r"(?<=\.) ", first.replace("\N{NO-BREAK SPACE}", " "))[0]
        assert first.startswith({0: "None of the 32", 32: "All 32"}.get(count, f"{count} of 32"))
        for what, said in re.findall(r"(all|none) where (.*?)(?=, none|[.]$)", first):
            places = []
            for clause in re.split(" or | and ", said):
                axis, index = (asked.x, columns) if "duration" in clause else (asked.y, rows)
                value = np.array(axis.values)[index]
                at = [axis.shown(one).split("\N{NO-BREAK SPACE}")[0] for one in axis.values]
                ends = re.findall(r"[0-9]+(?:[.][0-9]+)?", clause)
                low, high = float(ends[0]), float(ends[-1])
                how = re.search(r"is (at most|at least|from|)", clause)[1]
                named = {"at most": value <= low, "at least": value >= low, "from": (value >= low) & (value <= high)}
                places.append(named[how] if how else index == at.index(ends[0]))
                assert places[-1].flat[np.abs(value - low).argmin()], f"{clause}: without its end"
            for where in [np.logical_and(*places)] if " and " in said else places:
                assert where.any() and set(flyable[0][where]) == {int(what == "all")}, first
            seen.add((what, " and " in said))
    assert seen == {("all", False), ("none", False), ("all", True), ("none", True)}


def test_the_same_map_again_is_the_same_whatever_the_span(case, tmp_path, monkeypatch):
    path = case[1].parent / "mission.toml"
    monkeypatch.setattr(study_module, "MOST_AT_ONCE", 7)
    options = ["--x", "path.duration=2:5:4", "--y", "disturbance.scale=0,1,2", "--by", "controller.nets.enabled=true,false"]
    assert quadstep("envelope", path, *options, "--failure", "largest_error=0.5", "--out", tmp_path / "again").code == 0
    assert (tmp_path / "again" / "envelope.parquet").read_bytes() == (case[1] / "envelope.parquet").read_bytes()


def test_flights_of_a_cell_each_have_their_own_noise(tmp_path):
    path = saved(tmp_path, f"seed = 7\n{NOISY}")
    out = tmp_path / "out"
    run = quadstep(
        "envelope", path, "--x", "wind.mean.0=1,4", "--y", "sensors.position_noise=0.01:0.03:3", "--flights", "3",
        "--failure", "position_rmse=0.42", "--out", out,
    )  # fmt: skip
    assert run.code == 0, run
    page = data_of((out / "flights.html").read_text())
    assert page["intro"] == ["Marked: fewer than half of the flights succeed; one that failed is shown."]
    assert not any(one["cell"]["colour"] for one in page["flights"])
    told = run.out.replace("\n", " ")
    assert " did all 3 flights succeed. " in told and " Limit: position RMSE 0.42 m." in told
    asked = request(path, "wind.mean.0=1,4", "sensors.position_noise=0.01:0.03:3", flights=3)
    spread = []
    for cell, row in enumerate(rows(out)):
        content = json.loads(json.dumps(asked.campaign.content))
        content["wind"]["mean"] = [row["wind.mean.0"], 0.0, 0.0]
        content["sensors"]["position_noise"] = row["sensors.position_noise"]
        plan = check_mission(content, "m.toml").plan()
        errors, farthest = [], []
        for turn in range(3):
            noise = key(7, turn * 6 + cell)
            log = fly(plan._replace(parameters=plan.parameters._replace(key=noise)))
            metrics = flight_metrics(log)
            errors.append(metrics["position_rmse[m]"])
            farthest.append(metrics["largest_error[m]"])
        spread.append(np.ptp(errors))
        assert row["position_rmse_median[m]"] == pytest.approx(np.median(errors), rel=1e-6)
        assert row["position_rmse_mean[m]"] == pytest.approx(np.mean(errors), rel=1e-6)
        assert row["largest_error[m]"] == pytest.approx(max(farthest), rel=1e-6)
        good = sum(error <= 0.42 for error in errors)
        assert (row["success"], row["success_low"], row["success_high"]) == pytest.approx(share(good, 3))
    assert min(spread) > 1e-4


def test_without_chance_a_share_is_no_estimate(case):
    assert all(row["success"] == row["success_low"] == row["success_high"] for row in rows(case[1]))


@pytest.mark.parametrize(
    ("mission", "axis", "flights"), [(SHORT, "vehicle.mass=1:2:2", 1), (NOISY, "vehicle.mass=2,3", NOISY_FLIGHTS)]
)
def test_a_cell_has_several_flights_where_they_differ(tmp_path, mission, axis, flights):
    asked = request(saved(tmp_path, mission), axis, "path.duration=0.3,0.4")
    assert asked.flights == flights
    assert asked.random is (flights > 1)


def test_noise_that_only_an_axis_brings_counts(tmp_path):
    calm = NOISY[: NOISY.index("[wind]")]
    assert not request(saved(tmp_path, calm), "vehicle.mass=2,3", "path.duration=0.3,0.4").random
    assert request(saved(tmp_path, calm), "sensors.gyro_noise=0:0.1:3", "path.duration=0.3,0.4").random


def test_a_campaign_keeps_what_varies_and_what_fails(tmp_path):
    path = written(tmp_path, MASS + 'disturbance.force.0 = {type="grid", values=[0.0, 9.0]}\n', head="seed = 3\nflights = 5\n")
    path.write_text(path.read_text() + "[failure]\nlargest_error = 0.3\n")
    asked = request(path, "path.duration=0.3:0.5:3", "path.end.2=0.1,0.2", failures=["position_rmse=0.7"])
    assert asked.campaign.file.failure == {"largest_error": 0.3, "position_rmse": 0.7}
    assert (asked.random, asked.flights, asked.campaign.file.seed) == (True, NOISY_FLIGHTS, 3)
    flown = Flyer(asked.campaign).fly(0, 6 * 20)
    assert len(set(flown["vehicle.mass"].to_pylist())) == 120
    for cell in range(6):  # the file's own grid goes through its values within each cell
        assert flown["disturbance.force.0"].to_pylist()[cell::6] == [0.0, 9.0] * 10
    cells = cells_of(asked, on_lanes(asked.campaign)([Chunk("", 0, 120)], lambda _: None))
    good = np.array(flown["success"].to_pylist()).reshape(20, 1, 2, 3).sum(axis=0)
    assert (cells.successes == good).all()
    assert 0 < good.sum() < 120


def test_what_can_be_built_in_one_go_is_tried_all_over_the_map(tmp_path):
    asked = request(saved(tmp_path), "vehicle.mass=1:2:300", "disturbance.scale=0:7:2")
    flyer = Flyer(asked.campaign)
    flyer.fly(0, 1)
    for name, ends in (("vehicle.mass", (1.0, 2.0)), ("disturbance.scale", (0.0, 7.0))):
        column = flyer.planner.typical[name].column()
        assert (column.min(), column.max()) == ends


def test_whole_numbers_where_a_key_takes_no_others(tmp_path):
    asked = request(saved(tmp_path), "controller.nets.neurons=2:6:3", "vehicle.mass=1:2:2")
    assert asked.x.values == (2, 4, 6)
    assert all(type(value) is int for value in asked.x.values)
    assert all(type(value) is float for value in asked.y.values)


def test_a_range_has_both_its_ends(tmp_path):
    asked = request(saved(tmp_path), "path.duration=2:40:39", "disturbance.scale=0:5:26", "controller.nets.enabled=true,false")
    assert asked.x.values == tuple(float(n) for n in range(2, 41))
    assert asked.y.values[::25] == (0.0, 5.0)
    assert asked.by.values == (True, False)
    assert asked.shape == (2, 26, 39)


# Numbers of a cell


def test_quantiles_and_mean_leave_out_what_is_missing():
    values = np.array([[3.0, np.nan, 1.0, np.nan], [1.0, 5.0, 2.0, np.nan], [2.0, np.nan, np.nan, np.nan]])
    (low, median, high), mean = middle(values)
    assert median.tolist()[:3] == mean.tolist()[:3] == [2.0, 5.0, 1.5]
    assert low[:3] == pytest.approx([1.2, 5.0, 1.1]) and high[:3] == pytest.approx([2.8, 5.0, 1.9])
    assert np.isnan([low[3], median[3], high[3], mean[3]]).all()


# The picture


def made(successes, rmse, causes=None, flights=1):
    """Cells of which so many succeed; the others are off the path unless said otherwise."""
    successes = np.array(successes)
    counted = np.zeros((*successes.shape, len(CAUSES)), dtype=int)
    counted[..., CAUSES.index("off-path")] = flights - successes
    for name, count in (causes or {}).items():
        counted[..., CAUSES.index(name)] = count
        counted[..., CAUSES.index("off-path")] -= count
    rmse = np.where(successes > 0, rmse, np.nan)
    return Cells(flights, flights > 1, counted, successes, rmse, rmse, rmse, np.zeros_like(successes), np.stack([rmse] * 3))


def drawn(asked, cells):
    """The axes of the first panel."""
    axes = Figure().subplots()
    draw_panel(axes, asked, cells, 0)
    return axes


def test_x_is_to_the_right_and_y_is_up(tmp_path):
    asked = request(saved(tmp_path), "path.duration=1:3:3", "disturbance.scale=0:50:2")
    cells = made([[[1, 1, 1], [1, 1, 0]]], [[[1.0, 0.1, 0.1], [0.1, 0.1, 0.1]]])  # lost: largest x, largest y
    image = drawn(asked, cells).images[0]
    assert image.origin == "lower"
    assert image.get_extent() == [0.5, 3.5, -25.0, 75.0]
    pixels = image.get_array()
    assert pixels.shape[:2] == (2, 3)
    grey = np.ptp(pixels[..., :3], axis=-1) < 1e-12
    assert grey.tolist() == [[False, False, False], [False, False, True]]
    assert not np.array_equal(pixels[0, 0], pixels[0, 1])  # the larger error has another colour
    assert np.array_equal(pixels[0, 1], pixels[1, 0])


def test_hatches_cover_the_lost_cells_only_each_cause_in_its_own_way(tmp_path):
    asked = request(saved(tmp_path), "path.duration=1:3:3", "disturbance.scale=0:50:2", failures=["largest_error=0.5"])
    lost = np.array([[[1, 1, 0], [0, 0, 0]]])
    cells = made([[[0, 0, 1], [1, 1, 1]]], 0.1, {"over-limit": lost * [[[0, 1, 0], [0, 0, 0]]]})
    patches = [patch for patch in drawn(asked, cells).patches if patch.get_hatch()]
    spans = {patch.get_hatch(): patch.get_path().get_extents().extents.tolist() for patch in patches}
    assert len(spans) == 2
    assert sorted(spans.values()) == [[0.5, -25.0, 1.5, 25.0], [1.5, -25.0, 2.5, 25.0]]
    assert [handle.get_label() for handle in legend(asked, cells)] == ["largest error more than 0.5 m", "lost: off the path"]


def test_the_lines_beside_the_map_are_its_errors_where_it_has_colours(tmp_path, monkeypatch):
    figures = []
    monkeypatch.setattr(canvas, "write", lambda figure, path, sheet: figures.append(figure))
    asked = request(saved(tmp_path), "path.duration=1:3:3", "disturbance.scale=0:50:2")
    cells = made([[[1, 1, 1], [1, 1, 0]]], [[[1.0, 0.1, 0.2], [0.3, 0.4, 0.5]]])
    assert draw_slices(tmp_path / "slices", asked, cells, Sheet())
    (axes,) = figures[0].axes
    assert [text.get_text() for text in axes.get_legend().texts] == ["disturbance scale = 0", "disturbance scale = 50"]
    for line, wanted in zip(axes.lines, ([1.0, 0.1, 0.2], [0.3, 0.4, math.nan]), strict=True):
        np.testing.assert_allclose(line.get_ydata(), wanted)
        assert line.get_xdata().tolist() == [1.0, 2.0, 3.0]
    assert axes.get_title(loc="left") == "position RMSE [m]"
    several = made([[[20, 20, 20], [20, 20, 0]]], [[[1.0, 0.1, 0.2], [0.3, 0.4, 0.5]]], flights=20)
    draw_slices(tmp_path / "slices", asked, several._replace(spread=several.rmse * [[[[0.5]]], [[[1.0]]], [[[2.0]]]]), Sheet())
    assert figures[1].axes[0].get_title(loc="left") == "position RMSE [m]: median and middle 80 %"
    for band, line in zip(figures[1].axes[0].collections, figures[1].axes[0].lines, strict=True):
        ends = band.get_paths()[0].get_extents()
        known = line.get_ydata()[np.isfinite(line.get_ydata())]
        assert (ends.y0, ends.y1) == pytest.approx((0.5 * known.min(), 2.0 * known.max()))
    assert not draw_slices(tmp_path / "slices", asked, made([[[1, 0, 0], [0, 0, 0]]], 0.1), Sheet()), "one point is no line"


def test_the_lines_are_said_to_cross_only_where_chance_would_not_make_them(tmp_path):
    """Values of y that make no difference: no two lines are said to differ. True ones: as the medians do."""
    asked = request(saved(tmp_path), "path.duration=4:12:9", "disturbance.scale=0:3:3", flights=20)._replace(random=True)
    random, told = np.random.default_rng(5), 0
    for turn in range(1000):
        law = random.standard_normal if turn % 2 else random.standard_cauchy
        spread, _ = middle(np.abs(law((20, 27))))
        cells = made(np.full((1, 3, 9), 20), spread[1].reshape(1, 3, 9), flights=20)
        told += "larger" in along(Envelope(asked, cells._replace(spread=spread.reshape(-1, 1, 3, 9)), []))
    assert told == 0
    rmse = np.full((1, 3, 9), 0.4)
    rmse[0, -1] = [1.0, 0.4, *[0.2] * 7]
    cells = made(np.full((1, 3, 9), 20), rmse, flights=20)
    cells = cells._replace(spread=rmse * [[[[0.8]]], [[[1.0]]], [[[1.2]]]])
    said = along(Envelope(asked, cells, [])).replace("\N{NO-BREAK SPACE}", " ")
    assert said == (
        "The same errors. With disturbance scale = 3 they are larger than with disturbance scale = 0 where the path "
        "duration is 4 s and smaller where the path duration is at least 6 s."
    )
    for plain in (cells._replace(spread=cells.spread[:, :, ::-1]), cells._replace(spread=np.stack([rmse, rmse, 9.0 * rmse]))):
        assert ("smaller" in along(Envelope(asked, plain, []))) == (plain.spread[0, 0, 0, 0] > 0.5)
    assert along(Envelope(asked._replace(flights=5), cells, [])) == "The same errors.", "few flights say little of others"


@pytest.mark.parametrize(("most", "unit", "ticks"), [(1.01, "m", ["0.3", "0.4", "0.6", "1"]), (0.5, "mm", ["300", "400"])])
def test_a_map_has_its_errors_in_one_unit_with_ticks_where_most_of_them_are(tmp_path, most, unit, ticks):
    asked = request(saved(tmp_path), "path.duration=1:3:3", "disturbance.scale=0:3:2")
    cells, figure = made([[[1] * 3] * 2], [[[0.239, 0.3, 0.3], [0.3, 0.4, most]]]), Figure()
    draw_scale(figure, np.array([[figure.subplots()]]), scale(cells), asked)
    bar, found = figure.axes[-1], Envelope(asked, cells, [])
    figure.draw_without_rendering()
    low, high = bar.get_xlim()
    seen = [one.get_text() for one in bar.get_xticklabels() if low <= one.get_position()[0] <= high]
    assert bar.get_xlabel() == f"position RMSE [{unit}]" and {*ticks} <= {*seen}, seen
    assert re.search(rf" to \S+\s{unit}; lighter", caption(found, linked=False))


def test_a_cell_under_the_pointer_says_why_flights_fail_not_that_most_do(tmp_path):
    asked = request(saved(tmp_path), "path.duration=1:2:2", "disturbance.scale=0,1", flights=20)
    axes = drawn(asked, made([[[20, 19], [18, 3]]], 0.1, {"over-limit": np.array([[[0, 1], [1, 17]]])}, flights=20))
    told = [dict(one.said).get("failures") for one in SPOTS[axes]]
    assert told == [None, "above a limit", "mostly above a limit", "above a limit"]
    assert [dict(one.said)["succeed"][:2] for one in SPOTS[axes]] == ["10", "95", "90", "15"]


def test_a_dotted_cell_and_a_line_have_their_own_words(tmp_path):
    asked = request(
        saved(tmp_path), "path.duration=1:3:3", "disturbance.scale=0:50:2", failures=["largest_error=0.5"], flights=20
    )
    cells = made([[[20, 18, 3], [19, 12, 9]]], 0.1, {"over-limit": np.array([[[0, 2, 17], [1, 8, 11]]])}, flights=20)
    assert [one.get_label() for one in legend(asked, cells)] == ["fewer than half succeed", "fewer than 19 of 20 succeed"]


def test_all_lost_cells_of_a_row_are_hatched(tmp_path):
    asked = request(saved(tmp_path), "path.duration=1:5:5", "disturbance.scale=0,1")
    (patch,) = drawn(asked, made([[[0, 1, 0, 0, 1], [1, 1, 1, 1, 0]]], 0.1)).patches
    corners = [tuple(part[[0, 2]].ravel()) for part in patch.get_path().vertices.reshape(-1, 5, 2)]
    assert corners == [(0.5, -0.5, 1.5, 0.5), (2.5, -0.5, 4.5, 0.5), (4.5, 0.5, 5.5, 1.5)]


def test_coloured_cells_that_cannot_be_flown_are_struck_through_also_between_others_that_can(tmp_path):
    asked = request(saved(tmp_path), "path.duration=1:3:3", "disturbance.scale=0:50:2", flights=20)
    axes = drawn(asked, made([[[20, 19, 0], [20, 18, 0]]], 0.1, flights=20))
    lines = {tuple(part.ravel().tolist()) for one in axes.collections for part in one.get_segments()}
    assert lines == {(1.5, 25.0, 2.5, 75.0)}
    alone = request(saved(tmp_path), "path.duration=1:3:3", "disturbance.scale=0:50:2")
    assert not any(one.get_segments() for one in drawn(alone, made([[[1, 1, 0], [1, 1, 0]]], 0.1)).collections), "grey says it"


def test_a_list_has_a_cell_for_each_value_with_its_name(tmp_path):
    asked = request(saved(tmp_path), "controller.nets.enabled=false,true", "path.duration=0.1,1,10")
    axes = drawn(asked, made([[[1, 1]] * 3], 0.1))
    assert axes.images[0].get_extent() == [-0.5, 1.5, -0.5, 2.5]
    assert [tick.get_text() for tick in axes.get_xticklabels()] == ["off", "on"]
    assert [tick.get_text() for tick in axes.get_yticklabels()] == ["0.1", "1", "10"]


def test_a_map_of_nothing_flyable_has_no_scale():
    assert scale(made([[[0, 0], [0, 0]]], 0.1)) is None
    one = scale(made([[[1, 0], [0, 0]]], 0.1))
    assert one.vmin < 0.1 < one.vmax


def test_axes_say_their_unit():
    mission = check_mission({"path": {"type": "minimum-jerk", "end": [1.0, 0.0, 0.0], "duration": 1.0}}, "m.toml")
    assert label(mission, "path.duration") == "path duration [s]"
    assert label(mission, "disturbance.force.2") == "disturbance force along z [N]"
    assert label(mission, "controller.K_r1.2") == "K_r1[2] [N s/m]"
    assert label(mission, "controller.nets.start") == "nets start [s]"
    vehicle = check_mission(
        {"vehicle": {"preset": "crazyflie"}, "path": {"type": "step", "end": [1.0, 0.0, 0.0]}}, "m.toml", Path()
    )
    assert label(vehicle, "vehicle.rotor.rise_time") == "vehicle rotor rise time [s]"


def test_a_grid_of_wind_that_begins_at_zero_flies_with_turbulence(tmp_path):
    (tmp_path / "windy.toml").write_text(
        '[vehicle]\npreset = "x500"\n[path]\ntype = "minimum-jerk"\nend = [1.0, 0.0, 0.0]\nduration = 1.0\n'
        "[wind]\nturbulence = { wind_20 = 4.0 }\n"
    )
    asked = request(tmp_path / "windy.toml", "wind.mean.0=0:4:2", "path.duration=1:2:2", None, (), 3)
    found = run(Map(asked), tmp_path / "out").found
    assert found.cells.share.min() == 1.0
    assert (found.cells.rmse > 1e-4).all()  # the gust that stands is felt
