"""Why an attitude stays off its command in moving air: said where it does, by the report and on the page alike."""

import re

import numpy as np
import pytest

from quadstep.engines.fly import fly
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.log import FlightLog
from quadstep.metrics.off_command import off_command
from quadstep.metrics.quantities import LoggedFlight
from quadstep.mission.read import read_mission
from quadstep.page.build import fly_missions
from quadstep.report.panels import left_path
from quadstep.studies.flight_report import answer, gain_rows, in_degrees, of_size, worst, write_report
from tests.commands import write
from tests.missions import EXAMPLES
from tests.needs import CHROMIUM, needs, package

TEXT = """vehicle = {{ preset = "x500" }}
path = {{ type = "minimum-jerk", end = [{far}, 0.0, 1.0], duration = {lasts} }}
controller = {{ type = "{law}" }}
wind = {{ mean = [{wind}, 0.0, 0.0] }}
simulation = {{ duration = 6.0 }}
"""

SENTENCE = re.compile(
    r"In the second half of the flight pitch is on average (\d+)° off its command; one possible reason: [^.<]*\."
)


def text_of(law, wind, far=0.0, lasts=1.0):
    return TEXT.format(law=law, wind=wind, far=far, lasts=lasts)


def said(folder, *flight):
    """What the report of a flight says of it."""
    mission = read_mission(write(folder, text_of(*flight)))
    log = fly(mission.plan(folder))
    write(folder, "<svg></svg>", "attitude.svg")
    write_report(folder / "report.html", mission, log, mission.flight_metrics(log)[0], (), {"attitude": "Angles."})
    caption = re.search(r"<figcaption>.*?</figcaption>", (folder / "report.html").read_text(encoding="utf-8"), re.DOTALL)
    return SENTENCE.search(caption[0])


def test_the_heading_has_its_largest_and_final_error_in_the_table_and_a_large_error_is_amber(tmp_path):
    mission = read_mission(EXAMPLES / "wind_tunnel.toml").model_copy(update={"score_from": 1.0})
    mission = mission.model_copy(update={"simulation": mission.simulation.model_copy(update={"duration": 3.0})})
    log = fly(mission.plan())
    metrics = mission.flight_metrics(log)[0]

    def told(path, **more):
        write_report(path, mission, log, metrics, (), {}, **more)
        text = path.read_text(encoding="utf-8")
        assert '"phase": "30°"' in text.replace("&quot;", '"')
        assert re.search(r'<dt>largest error</dt><dd class="?fair', text) or more
        return re.findall(r"<td>([^<]*)</td>", re.search(r"<tr><td>heading</td>(.*?)</tr>", text)[1])

    off = np.degrees(np.abs(log.column("yaw") - log.column("heading_d"))[log.column("t") >= 1.0])
    shown = [float(one) for one in told(tmp_path / "a.html")[:-1]]
    assert shown == pytest.approx([np.sqrt((off**2).mean()), off.max(), off[-1]], rel=5e-3)


@pytest.mark.parametrize(
    ("law", "wind", "off"),
    [("geometric", 6.0, 15), ("lqr", 6.0, 12), ("pid", 6.0, 0), ("geometric", 0.0, 0), ("lqr", 25.0, 0)],
)
def test_a_report_says_why_the_attitude_stays_off_its_command(tmp_path, law, wind, off):
    found = said(tmp_path, law, wind)
    assert (found is not None) == (off > 0)
    assert found is None or abs(int(found[1]) - off) <= 2


@pytest.mark.parametrize(("wind", "off"), [(0.0, 15), (4.4, 0)])
def test_drag_has_the_same_effect_in_calm_air_and_none_on_a_vehicle_that_flies_with_the_wind(tmp_path, wind, off):
    found = said(tmp_path, "geometric", wind, 26.4, 6.0)
    assert (int(found[1]) if found else 0) == pytest.approx(off, abs=2)


@pytest.mark.parametrize(("off", "air", "says"), [(0.2, 2.0, True), (0.0, 2.0, False), (0.2, 0.0, False)])
def test_an_attitude_that_has_turned_once_more_than_its_command_is_not_off_it_for_that(off, air, says):
    pitch = np.array([0.0, 2.0, -2.2, 0.0, -off, -off, -off, -off])
    columns = dict.fromkeys(("v_y", "v_z", "wind_x", "wind_y", "wind_z", "roll", "roll_d", "pitch_d"), 0.0 * pitch)
    columns |= {"v_x": air + 0.0 * pitch, "pitch": pitch}
    log = FlightLog(dict.fromkeys(columns, "-"), np.array([*columns.values()]).T, Outcome.COMPLETED, 1.0, None)
    said = "In the second half of the flight pitch is on average 11° off its command; one possible reason: drag."
    assert off_command(log, "drag") == (said if says else "")


@pytest.mark.parametrize(("swing", "says"), [(0.1, False), (0.3, True)])
def test_an_angle_that_swings_by_more_than_the_other_is_off_is_named_too(swing, says):
    columns = dict.fromkeys(("v_y", "v_z", "wind_x", "wind_y", "wind_z", "roll_d", "pitch_d"), np.zeros(8))
    columns |= {"v_x": np.full(8, 2.0), "pitch": np.full(8, -0.2), "roll": swing * np.array([1.0, -1.0] * 4)}
    log = FlightLog(dict.fromkeys(columns, "-"), np.array([*columns.values()]).T, Outcome.COMPLETED, 1.0, None)
    said = "; one possible reason: drag."
    said += " Roll swings more, by 17° on average to either side of its command." * says
    assert off_command(log, "drag").endswith(said)


@pytest.mark.parametrize(("largest", "lowest"), [(9.0, 1.0), (33.0, 1.0), (33.0, -4.0)])
def test_a_flight_farther_from_its_path_than_that_is_wide_is_said_not_to_keep_it(largest, lowest):
    columns = {"t": "s", "x": "m", "z": "m", "x_d": "m", "z_d": "m"}
    log = FlightLog(
        columns, np.array([[0.0, 0.0, 10.0, 0.0, 10.0], [1.0, 0.0, lowest, 10.0, 10.0]]), Outcome.COMPLETED, 1.0, None
    )
    metrics = {"outcome": "completed", "largest_error[m]": largest, "relative_error": 3.0}
    found = left_path(log, metrics).replace("\u00a0", " ")
    off = "The vehicle did not keep its path: it was 33.0 m from where it should have been, on a path that spans 10.0 m"
    sank = ", and it sank to z = −4.00 m, below z = 0" if lowest < 0.0 else ""
    assert found == (f"{off}{sank}." if largest > 10.0 else "")
    assert not left_path(log, metrics | {"relative_error": 0.01})  # as commanded
    log.rows[0, 1] = 33.0  # where it began
    assert not left_path(log, metrics)


def track(flown, wanted):
    """The log of a flight through these points, shape (rows, 3), and its metrics."""
    columns = ["t", *"xyz", "x_d", "y_d", "z_d"]
    rows = np.column_stack([np.linspace(0.0, 1.0, len(flown)), flown, wanted])
    log = FlightLog(dict.fromkeys(columns, "m"), rows, Outcome.COMPLETED, 1.0, None)
    off = np.linalg.norm(flown - wanted, axis=1)
    return log, {"outcome": "completed", "largest_error[m]": float(off.max()), "relative_error": 3.0}


@pytest.mark.parametrize("seed", range(200))
def test_a_vehicle_that_is_only_late_or_early_on_its_path_is_not_said_to_have_left_it(seed):
    rng = np.random.default_rng(seed)
    path = rng.normal(size=(rng.integers(2, 6), 3)) * 10.0 ** rng.uniform(-2, 2)
    path *= rng.integers(0, 2, 3) | (rng.random(3) < 0.7)
    late, due = (np.sort(rng.integers(0, len(path), 40)) for _ in range(2))
    assert not left_path(*track(path[late], path[due])), seed


def test_a_vehicle_off_the_point_that_it_holds_by_more_than_ten_arms_has_left_it():
    fell = np.outer(np.linspace(0.0, 1.0, 20), [0.0, 3.0, -4.0])
    log, metrics = track(fell, np.zeros((20, 3)))
    found = left_path(log, metrics).replace("\u00a0", " ")
    assert found == "The vehicle did not hold its position: it was 5.00 m off, and it sank to z = −4.00 m, below z = 0."
    assert not left_path(log, metrics | {"relative_error": 0.9})


@pytest.mark.parametrize(("turns", "since"), [(1.0, 0.0), (1.0, 5.0), (0.0, 0.0)])
def test_an_error_is_said_as_a_share_of_the_size_of_a_path_that_moves(turns, since):
    t, share = np.linspace(0.0, 10.0, 101), 0.02
    angle = turns * np.minimum(t, since or 10.0)  # the path has stopped when errors begin to count
    circle = np.array([t, 5.0 * np.cos(angle), 5.0 * np.sin(angle)])
    columns = {"t": "s", "x": "m", "y": "m", "x_d": "m", "y_d": "m"}
    log = FlightLog(columns, np.concatenate([circle, circle[1:]]).T, Outcome.COMPLETED, 10.0, None)
    metrics = {"position_rmse[m]": share * 6.94, "relative_error": share}
    found = of_size(LoggedFlight(log, since), metrics).replace("\u00a0", " ")
    said = answer(log, {**metrics, "outcome": "completed"}, size=found).replace("\u00a0", " ")
    if turns > since:
        assert found == "The path's size, 6.94 m, is the RMSE of a vehicle that never leaves its start. "
        wide = log._replace(rows=log.rows * np.array([1.0, 10.0, 10.0, 10.0, 10.0]))
        assert of_size(LoggedFlight(wide, since), metrics).endswith("start (distances above 30 m count as 30 m). ")
        assert said == "The flight completed 10 s with a position RMSE of 139 mm, 2 % of the path's size."
        for grade, ends in (
            ("fragile", "; its loop is fragile at rest."),
            ("sound", "the path's size."),
        ):
            rest = {"margins_at_rest": {"grade": grade, "why": "phase margin 29.4°"}}
            assert answer(log, {**metrics, **rest, "outcome": "completed"}, size=found).endswith(ends)
        large = answer(log, {**metrics, "relative_error": 0.2, "outcome": "completed"}, size=found)
        for told in ({"relative_error": 1e-5}, {"relative_error": 0.02, "overturned[rad]": 3.0}):  # no percentage to explain
            assert not of_size(LoggedFlight(log, since), {**metrics, **told, "outcome": "completed"})
        assert " mm. However, its error is large: 20 % of the path's size (limit 10 %)" in large.replace("\u00a0", " ")
    else:
        assert not found
        assert said == "The flight completed 10 s with a position RMSE of 139 mm."
    assert not of_size(LoggedFlight(log._replace(outcome=Outcome.SPINNING), since), metrics)


@pytest.fixture(scope="module")
def page_file(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    return write(folder, fly_missions([write(folder, text_of("geometric", 6.0))]), "page.html")


@needs(CHROMIUM)
def test_the_page_says_the_same_and_no_more_once_the_wind_is_gone(open_page, tmp_path):
    package("playwright")
    page, found = open_page(), said(tmp_path, "geometric", 6.0)
    assert page.locator("#plot-attitude .note").inner_text() == found[0]
    page.evaluate("quadstep.setControl('wind', 0)")
    assert page.locator("#plot-attitude .note").is_hidden()
    page.evaluate("quadstep.setControl('wind', [6, 0, 0])")
    page.evaluate("quadstep.setControl('k_R', 0)")  # it tumbles, which is not for want of drag in the law
    assert page.locator("#plot-attitude .note").is_hidden()


def test_a_report_has_the_gains_that_were_flown_and_says_which_are_defaults(tmp_path):
    text = text_of("geometric", 0.0).replace('"geometric"', '"geometric", k_R = 40.0')
    plain, late = (gain_rows(read_mission(write(tmp_path, one))) for one in (text, text + "sensors = { latency = 0.12 }\n"))
    given, slower = ({name.partition(" ")[0]: value for name, value, _ in rows} for rows in (plain, late))
    assert given["k_R"] == "40.0"
    value, origin = given["k_x"].split(", ")
    assert origin == "default"
    assert float(slower["k_x"].split(",")[0]) < 0.5 * float(value)  # late fixes make it slower


def test_the_largest_error_has_its_time_and_where_the_path_is_then():
    rows = np.array([[0.0, 9.0, 0.0], [1.0, 3.0, 3.5], [2.0, 4.0, 6.0], [3.0, 5.0, 5.0]])
    log = FlightLog({"t": "s", "x": "m", "x_d": "m"}, rows, Outcome.COMPLETED, 3.0, None)
    assert worst(log, 0.5) == ", at 2 s"
    assert worst(log, 0.0) == ", at 0 s"
    assert worst(log, 3.5) == ""


def test_the_mission_of_a_report_has_every_angle_in_degrees():
    """By the unit of its key, so a period is left as it is."""
    content = {"path": {"type": "figure-eight", "yaw": 0.5, "period": 0.5}, "margins": {"phase": 0.5}}
    mission = read_mission(EXAMPLES / "figure_eight.toml")
    shown = in_degrees(mission, content)
    assert shown == {"path": {"type": "figure-eight", "yaw": "28.6479°", "period": 0.5}, "margins": {"phase": "28.6479°"}}
