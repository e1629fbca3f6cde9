"""What the figures of a flight show: nothing that the vehicle or the law does not have."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from quadstep.engines.fly import fly
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.log import FlightLog
from quadstep.mission.read import check_mission
from quadstep.report.canvas import drawing
from quadstep.report.figures import draw, track_figure
from quadstep.report.moments import mark, named
from quadstep.report.panel import EventMark, Panel, Track
from quadstep.report.panels import (
    attitude_panels,
    flight_jobs,
    jobs_to_draw,
    labels_of,
    of_attitude,
    of_marks,
    of_others,
    of_path,
    other_panels,
    seen_moments,
    with_quiet_marks,
)
from quadstep.report.sheet import COLUMN, PHONE, Sheet, sheet
from quadstep.report.told import strips

PAPER = {"path": {"type": "minimum-jerk", "end": [0.1, 0.0, 0.1], "duration": 0.5}}
ON_AIRFRAME = PAPER | {"vehicle": {"preset": "crazyflie"}}
REAL = ON_AIRFRAME | {"controller": {"type": "geometric"}}
ERRORS = ["filtered errors", "L without weights"]
NO_NETS = {"controller": {"type": "backstepping", "nets": {"enabled": False}}}
WIND = {"wind": {"mean": [1.0, 0.0, 0.0]}}
GUST = {"wind": {"mean": [1.0, 0.0, 0.0], "gust": {"velocity": [0.0, 1.0, 0.0], "start": 0.1, "length": 0.2}}}
BATTERY = {"vehicle": {"preset": "crazyflie", "effects": {"battery": True}}}


def test_a_command_is_drawn_and_compared_the_shorter_way_round():
    columns = {"t": "s"} | {f"{angle}{end}": "rad" for angle in ("roll", "pitch", "yaw") for end in ("", "_d")}
    rows = np.zeros((4, 7))
    rows[:, 0], rows[:, 5], rows[:, 6] = [0, 1, 2, 3], [3.0, 3.2, 3.4, 3.6], [-3.2, -3.1, -2.9, -2.7]
    log = FlightLog(columns, rows, Outcome.COMPLETED, 3.0, None)
    panels = attitude_panels(log)
    drawn = next(panel.lines["yaw_d"] for panel in panels if panel.label == "yaw")
    assert drawn == pytest.approx(rows[:, 6] + 2.0 * np.pi)
    said = "The attitude is farthest from its command in yaw, by 4.77° at 0 s; half"
    assert of_attitude(log, panels).startswith(said)


@pytest.mark.parametrize(("content", "labels"), [
    (REAL, ["rotor thrust"]),
    (REAL | WIND, ["rotor thrust"]),
    (REAL | GUST, ["rotor thrust", "wind"]),
    (REAL | BATTERY, ["rotor thrust", "battery"]),
    (ON_AIRFRAME | NO_NETS, ["rotor thrust", "filtered errors"]),
    (PAPER, ["rotor thrust", "norm of weights", *ERRORS]),
    (PAPER | NO_NETS, ["rotor thrust", *ERRORS]),
])  # fmt: skip
def test_the_last_figure_shows_and_names_only_what_there_is(content, labels):
    log = fly(check_mission(content, "mission").plan())
    *_, last = flight_jobs(log, "A flight")
    assert [panel.label for panel in last.panels] == labels
    assert last.caption.endswith("Steady wind: 1.00\N{NO-BREAK SPACE}m/s along x.") == (content == REAL | WIND)


def test_a_plant_of_ones_own_in_wind_needs_no_nets():
    columns = {"t": "s", **dict.fromkeys(("x", "x_d"), "m"), "wind_x": "m/s"}
    log = FlightLog(columns, np.array([[0.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 2.0]]), Outcome.COMPLETED, 1.0, None)
    assert [panel.label for panel in other_panels(log)] == []  # of its wind it has no other axes


def test_captions_say_where_a_flight_is_worst():
    t = np.linspace(0.0, 4.0, 401)
    off = np.where(t < 1.0, t, np.maximum(2.0 - t, 0.1))
    columns = {"t": "s", **dict.fromkeys(("x", "y", "z", "x_d", "y_d", "z_d"), "m"), "u": "N", "u_a": "N"}
    log = FlightLog(
        columns,
        np.stack([t, off, *np.zeros((5, 401)), 5.0 + t, np.minimum(5.0 + t, 8.0)], axis=1),
        Outcome.COMPLETED,
        4.0,
        None,
    )
    path, position, inputs = flight_jobs(log, "A flight")[:3]
    said = [one.caption.replace("\N{NO-BREAK SPACE}", " ") for one in (path, position, inputs)]
    assert said == [
        "The vehicle is farthest from its path, 1.00 m, at 1 s, and in the second half of the flight at most 100 mm.",
        "The largest error along one axis is that along x, 1.00 m at 1 s.",
        "The largest thrust, u, is 9.00 N, at 4 s. The limits cut the law's command 24.9 % of the time.",
    ]
    assert [panel.lines.keys() for panel in inputs.panels] == [{"commanded", "within limits"}]
    free = log._replace(rows=np.column_stack([log.rows[:, :-1], log.rows[:, -2]]))
    inputs = flight_jobs(free, "A flight")[2]
    assert [panel.lines.keys() for panel in inputs.panels] == [{"u"}]  # of two equal lines one hides the other
    assert inputs.caption.endswith(" No limit is reached.")
    turned = log._replace(
        columns={**columns, "tau_phi": "N m", "tau_theta": "N m"},
        rows=np.column_stack([log.rows, 0.01 * t, -0.242 * (t == 1.0)]),
    )
    said = flight_jobs(turned, "A flight")[2].caption.replace("\N{NO-BREAK SPACE}", " ")
    assert said.startswith("The largest thrust, u, is 9.00 N, at 4 s. The largest torque, tau_theta, is −0.242 N m, at 1 s.")


def test_a_flight_without_an_error_is_not_farthest_anywhere():
    columns = {"t": "s", **dict.fromkeys(("x", "y", "z", "x_d", "y_d", "z_d"), "m")}
    log = FlightLog(columns, np.array([[0.0] * 7, [1.0, *[0.0] * 6]]), Outcome.COMPLETED, 1.0, None)
    path, position = flight_jobs(log, "A flight")[:2]
    assert (path.caption, position.caption) == ("The vehicle never leaves its path.", "No axis has an error.")


def test_lines_where_errors_begin_to_count_are_explained():
    log = FlightLog({"t": "s"}, np.zeros((1, 1)), Outcome.COMPLETED, 4.0, None)
    assert "dashed lines" in of_marks(seen_moments(log, (), 1.0))
    assert of_marks(seen_moments(log, (EventMark(2.0, "", "a waypoint"),))) == ""


def test_a_path_that_leaves_its_picture_says_so():
    t = np.linspace(0.0, 4.0, 401)
    columns = {"t": "s", **dict.fromkeys(("x", "y", "z", "x_d", "y_d", "z_d"), "m")}
    z, x_d = np.where(t < 3.0, 0.0, -(10.0 * (t - 3.0))), 0.25 * t
    log = FlightLog(
        columns, np.stack([t, x_d, *np.zeros((1, 401)), z, x_d, *np.zeros((2, 401))], axis=1), Outcome.OFF_PATH, 4.0, None
    )
    path, position, *_ = jobs = flight_jobs(log, "A flight")
    since = t[np.flatnonzero(np.abs(z) <= 0.1)[-1] + 1]
    assert path.caption.startswith(f"The vehicle stays more than 100\u00a0mm from its path from {since:.3g} s on.")
    assert path.caption.endswith(" The circle marks the start; the end is beyond the view along z.")
    bent = replace(path.track, flown=path.track.flown + np.outer(t * (4.0 - t), (0.0, 0.2, 0.0)))  # seen from above too
    assert of_path(log, bent).endswith(" The circle marks the start, the cross the end, which is beyond the view along z.")
    low = path.track.view[0][2]
    out = int((z < low).argmax())
    assert (path.t[-1], position.t[-1]) == (4.0, t[out])  # the rest would flatten what comes before it
    assert position.caption == f"Drawn until {t[out]:.3g} s, when the vehicle leaves the view above."
    assert [*labels_of(jobs)["position"]] == [
        *labels_of(flight_jobs(log._replace(outcome=Outcome.COMPLETED), "A"))["position"]
    ]
    assert flight_jobs(log._replace(outcome=Outcome.COMPLETED), "A flight")[1].t[-1] == 4.0


def test_what_is_asked_for_is_drawn_below_what_comes_of_it():
    panel = Panel("x", "m", {"x": np.arange(9.0), "x_d": np.arange(9.0)})
    with drawing(Sheet()):
        axes = Figure().subplots()
        draw(axes, np.arange(9.0), panel)
    flown, wanted = axes.lines
    assert wanted.get_zorder() < flown.get_zorder()
    assert wanted.get_linewidth() > 2.0 * flown.get_linewidth()


def test_what_lasts_has_a_line_where_it_begins_and_one_where_it_ends():
    with drawing(Sheet()):
        axes = Figure().subplots()
        axes.set_xlim(0.0, 20.0)
        mark(
            axes, [EventMark(7.0, "a payload was taken up", "payload", 14.0), EventMark(15.0, "a rotor failed", "rotor fault")]
        )
    assert sorted(line.get_xdata()[0] for line in axes.lines) == [7.0, 14.0, 15.0]


def test_other_panels_explain_their_symbols_and_say_when_the_battery_is_lowest():
    battery, norms, thrust = (
        Panel("battery", "V", {"voltage": np.array([16.8, 16.0, 16.2])}),
        Panel("filtered errors", "m/s, rad/s", {"|r1|": np.arange(3.0)}),
        Panel("rotor thrust", "N", {"f1": np.arange(3.0)}),
    )
    said = of_others([battery, norms, thrust], np.arange(3.0)).replace("\N{NO-BREAK SPACE}", " ")
    assert said.startswith("r1 and r2 are the filtered errors of position and attitude")
    assert said.endswith(" The battery's voltage is lowest at 1 s: 16.0 V.")
    assert of_others([thrust], np.arange(3.0)) == "Over time: rotor thrust."


def chosen(jobs, signals):
    return {job.name: [panel.label for panel in job.panels] for job in jobs_to_draw(jobs, sheet(signals=signals))}


def test_signals_are_drawn_in_one_figure_in_the_order_asked_for():
    log = fly(check_mission(REAL, "mission").plan())
    jobs = flight_jobs(log, "A flight")
    assert chosen(jobs, None) == {job.name: [panel.label for panel in job.panels] for job in jobs}
    assert chosen(jobs, "u, z_d-z,z,rotor thrust") == {"signals": ["u", "z_d - z", "z", "rotor thrust"]}
    assert chosen(jobs, "pitch,position") == {"signals": ["pitch", "x", "y", "z", "x_d - x", "y_d - y", "z_d - z"]}
    assert chosen(jobs, "path,u,u") == {"path": [], "signals": ["u"]}  # the one is drawn in space, the other over time
    assert chosen(jobs, "wind") == {}
    assert sheet(signals="z,wind").lacking(labels_of(jobs)) == ["wind"]
    assert chosen([], "z") == {}
    (one,) = jobs_to_draw(jobs, sheet(signals="z"))
    np.testing.assert_array_equal(one.panels[0].lines["z"], log.column("z"))
    assert one.caption == "Over time: z."


def test_columns_that_share_a_panel_are_signals_each():
    t = np.linspace(0.0, 1.0, 11)
    log = FlightLog({"t": "s", "a": "m", "b": "m", "c": "N"}, np.stack([t] * 4, axis=1), Outcome.COMPLETED, 1.0, None)
    jobs = flight_jobs(log, "A flight")
    assert labels_of(jobs) == {"signals": ["a, b", "c"]}
    assert [chosen(jobs, one) for one in ("b", "c")] == [{"signals": ["a, b"]}, {"signals": ["c"]}]


def test_a_torque_that_a_plant_calls_roll_is_no_angle():
    t = np.linspace(0.0, 1.0, 11)
    log = FlightLog({"t": "s", "roll": "N m", "pitch": "N m"}, np.stack([t] * 3, axis=1), Outcome.COMPLETED, 1.0, None)
    (job,) = flight_jobs(log, "A flight", {"roll": "N m", "pitch": "N m"})
    assert (job.name, [panel.label for panel in job.panels]) == ("inputs", ["roll", "pitch"])


def test_what_happens_is_marked_over_time_and_named_where_there_is_room():
    gust = {"velocity": [0.0, 1.0, 0.0], "start": 0.1, "length": 0.2}
    events = [{"type": "payload", "time": 0.12, "mass": 0.001}, {"type": "rotor", "time": 0.4, "rotor": 1, "efficiency": 0.9}]
    waypoints = [{"t": t, "position": [t, 0.0, 0.0]} for t in (0.0, 0.25, 0.5)]
    path = {"type": "waypoints", "waypoints": waypoints}
    mission = check_mission(REAL | {"wind": {"gust": gust}, "events": events, "path": path}, "mission")
    log = fly(mission.plan())
    (job,) = (one for one in mission.figures(log) if one.name == "position")
    assert [one.word for one in job.moments] == ["payload", "rotor fault", "gust", ""]  # no waypoint beside them
    shown = [axes for axes in job.picture().axes if axes.get_visible()]
    for place, axes in enumerate(shown):  # two in each row
        edges = sorted(line.get_xdata()[0] for line in axes.lines if len(line.get_xdata()) == 2)
        assert edges == pytest.approx([0.1, 0.12, 0.3, 0.4])  # 0.3: the gust's end
        above = [] if place >= 2 else ["payload", "rotor fault", "gust"]
        assert [one.get_text() for one in axes.texts] == above
        lasts = [[*one.get_segments()[0][:, 0]] for one in axes.collections if not str(one.get_gid()).startswith("grid")]
        assert lasts == ([] if place >= 2 else [pytest.approx(one) for one in ([0.12, 0.525], [0.4, 0.525], [0.1, 0.3])])
    first, second = with_quiet_marks(mission.figures(log))[:2]
    assert all(one.named for one in first.moments)
    axes = second.picture().axes[0]
    assert not axes.texts  # which the first figure has
    assert [line.get_xdata()[0] for line in axes.lines if len(line.get_xdata()) == 2]
    lost = log._replace(outcome=Outcome.CRASHED, ended=0.2)
    assert [one.word for one in mission.figures(lost)[0].moments] == ["lost", "payload", "gust"]


def test_a_word_without_room_is_left_out_and_none_leaves_the_axes():
    moments = [
        EventMark(9.9, "", "last"),
        EventMark(1.0, "", "a"),
        EventMark(1.1, "", "b"),
        EventMark(1.2, "", "c"),
        EventMark(1.3, "", "e"),
        EventMark(11.0, "", "d"),
    ]
    found = named(moments, 0.0, 10.0, 2.0)
    assert [(one.word, row) for one, row, _ in found] == [("last", 0), ("a", 0), ("b", 1)]
    assert all(0.0 <= begin <= 144.0 - 0.55 * 8.5 * len(one.word) for one, _, begin in found)


@pytest.mark.parametrize("plane", [(0, 2), (0, 1, 2)])
def test_a_path_and_its_error_fill_the_page_and_each_a_phone(plane):
    """On a phone they stand below one another, without scrolling."""
    t = np.linspace(0.0, 1.0, 50)
    wanted = np.zeros((50, 3))
    wanted[:, plane] = np.sin(6.0 * t[:, None] + np.array(plane))
    figure = track_figure(t, Track(0.1 * t, wanted, wanted + 0.1), Sheet())
    FigureCanvasAgg(figure).draw()
    parts = strips(figure)
    assert figure.get_figwidth() == COLUMN and len(parts) > 1
    assert all(width <= 1.06 * 72.0 * PHONE for _, width, _, _ in parts), parts
