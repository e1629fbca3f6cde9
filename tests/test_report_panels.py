"""What the figures of a flight show: nothing that the vehicle or the law does not have."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from quadstep.engines.fly import fly
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.log import FlightLog
from quadstep.mission.read import check_mission
from quadstep.report.canvas import drawing
from quadstep.report.figures import draw
from quadstep.report.panel import Panel
from quadstep.report.panels import flight_jobs
from quadstep.report.sheet import Sheet

PAPER = {"path": {"type": "minimum-jerk", "end": [0.1, 0.0, 0.1], "duration": 0.5}}
REAL = PAPER | {"vehicle": {"preset": "crazyflie"}, "controller": {"type": "geometric"}}
ERRORS = ["filtered errors", "L without weights"]
NO_NETS = {"controller": {"type": "backstepping", "nets": {"enabled": False}}}
WIND = {"wind": {"mean": [1.0, 0.0, 0.0]}}
BATTERY = {"vehicle": {"preset": "crazyflie", "effects": {"battery": True}}}


@pytest.mark.parametrize(
    ("content", "labels"),
    [
        (REAL, ["rotor thrust", *ERRORS[:1]]),
        (REAL | WIND, ["rotor thrust", "wind", *ERRORS[:1]]),
        (REAL | BATTERY, ["rotor thrust", *ERRORS[:1], "battery"]),
        (PAPER, ["rotor thrust", "norm of weights", *ERRORS]),
        (PAPER | NO_NETS, ["rotor thrust", *ERRORS]),
    ],
)
def test_the_last_figure_shows_and_names_only_what_there_is(content, labels):
    log = fly(check_mission(content, "mission").plan())
    *_, last = flight_jobs(log, "A flight")
    assert last.caption.startswith("Largest values: rotor thrust, f")
    assert [panel.label for panel in last.panels] == labels


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
        "Farthest from its path: 1.00 m, at 1 s; in the second half at most 100 mm. Circle: start; cross: end.",
        "Largest error along an axis: x, 1.00 m at 1 s; at the end: x −100 mm, y 0 m, z 0 m.",
        "Most u: 9.00 N, at 4 s. The limits cut the law's command 24.9 % of the time.",
    ]
    assert [panel.lines.keys() for panel in inputs.panels] == [{"commanded", "within limits"}]


def test_what_is_asked_for_is_drawn_below_what_comes_of_it():
    panel = Panel("x", "m", {"x": np.arange(9.0), "x_d": np.arange(9.0)})
    with drawing(Sheet()):
        axes = Figure().subplots()
        draw(axes, np.arange(9.0), panel)
    flown, wanted = axes.lines
    assert wanted.get_zorder() < flown.get_zorder()
    assert wanted.get_linewidth() > 2.0 * flown.get_linewidth()
