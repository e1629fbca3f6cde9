"""What the figures of a flight show: nothing that the vehicle or the law does not have."""

import pytest

from quadstep.engines.fly import fly
from quadstep.mission.read import check_mission
from quadstep.report.panels import flight_jobs

PAPER = {"path": {"type": "minimum-jerk", "end": [0.1, 0.0, 0.1], "duration": 0.5}}
REAL = PAPER | {"vehicle": {"preset": "crazyflie"}, "controller": {"type": "geometric"}}
ERRORS = ["filtered errors", "L without weights"]
NO_NETS = {"controller": {"type": "backstepping", "nets": {"enabled": False}}}
WIND = {"wind": {"mean": [1.0, 0.0, 0.0]}}
BATTERY = {"vehicle": {"preset": "crazyflie", "effects": {"battery": True}}}


@pytest.mark.parametrize(
    ("content", "title", "labels"),
    [
        (REAL, "rotors and errors", ["rotor thrust", *ERRORS[:1]]),
        (REAL | WIND, "rotors, wind and errors", ["rotor thrust", "wind", *ERRORS[:1]]),
        (REAL | BATTERY, "rotors, errors and battery", ["rotor thrust", *ERRORS[:1], "battery"]),
        (PAPER, "rotors, nets and errors", ["rotor thrust", "norm of weights", *ERRORS]),
        (PAPER | NO_NETS, "rotors and errors", ["rotor thrust", *ERRORS]),
    ],
)
def test_the_last_figure_shows_and_names_only_what_there_is(content, title, labels):
    log = fly(check_mission(content, "mission").plan())
    *_, last = flight_jobs(log, "A flight")
    assert last.title == f"A flight: {title}"
    assert [panel.label for panel in last.panels] == labels
