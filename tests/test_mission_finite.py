"""NaN and infinity are refused wherever a number can be given, by the key's name, also where no flight would meet them."""

import math
from copy import deepcopy
from functools import reduce

import pytest

from quadstep import Mission, UserError, read_mission
from quadstep.mission.check import check
from quadstep.mission.fields import plain
from quadstep.mission.read import check_mission
from quadstep.studies.campaign.schema import CampaignFile
from quadstep.studies.comparison.schema import StudyFile
from tests.missions import EXAMPLES

LINE = {"type": "minimum-jerk", "end": [1.0, 0.0, 2.0], "duration": 4.0}
EVENTS = [{"type": "payload", "mass": 0.1, "time": 1.0}, {"type": "rotor", "rotor": 1, "efficiency": 0.5, "time": 1.0}]
VARIED = {
    "controller.k_x": {"type": "uniform", "low": 1.0, "high": 2.0},
    "wind.mean.0": {"type": "normal", "mean": 0.0, "deviation": 1.0},
}
TUNED = {"gains": {"controller.k_x": {"low": 1.0, "high": 2.0}}, "constraints": {"position_rmse": 1.0}, "vary": VARIED}
SHARES = {"type": "choice", "values": [0.0, 0.01], "weights": [1.0, 1e-9]}
GRID = {"type": "grid", "values": [1.0, 2.0]}

WHOLE = {
    "paper": lambda: Mission(path=LINE, controller={"type": "backstepping"}),
    "real": lambda: Mission(
        path=LINE, vehicle={"preset": "x500"}, controller={"type": "geometric"}, events=EVENTS, tune=TUNED
    ),
    "own plant": lambda: read_mission(EXAMPLES / "twelve_states.toml"),
    "own path": lambda: read_mission(EXAMPLES / "lissajous.toml"),
    "own wind": lambda: read_mission(EXAMPLES / "thermal.toml"),
    "waypoints": lambda: read_mission(EXAMPLES / "waypoints.toml"),
}
TABLES = {
    "campaign": (CampaignFile, {
        "mission": {"path": LINE},
        "vary": {"sensors.latency": SHARES, "vehicle.mass": GRID, **VARIED},
        "failure": {"position_rmse": 1.0},
    }),
    "study": (StudyFile, {
        "vehicles": ["x500"], "common": {"wind": {"mean": [1.0, 0.0, 0.0]}}, "paths": {"a": {"mission": {"path": LINE}}},
        "scenarios": {"b": {"mission": {"sensors": {"latency": 0.01}}, "vary": {"vehicle.mass": GRID}}},
        "controllers": {"c": {
            "controller": {"type": "geometric", "k_x": [1.0, 1.0, 1.0]}, "ranges": {"k_x": {"low": 1.0, "high": 2.0}},
        }},
        "tuning": {"flown": [{"path": "a", "scenario": "b"}], "budget": 2000, "constraints": {"position_rmse": 1.0}},
        "margins": {"m": {"keys": ["wind.mean.0"], "path": "a", "scenario": "b", "high": 9.0, "step": 0.5}},
    }),
}  # fmt: skip


def numbers(value, way=()):
    """The way to every number in tables and lists, but not to whole ones: TOML has no such NaN."""
    if isinstance(value, dict | list):
        for key, one in value.items() if isinstance(value, dict) else enumerate(value):
            yield from numbers(one, (*way, key))
    elif isinstance(value, float):
        yield way


def with_number(content, way, number):
    changed = deepcopy(content)
    reduce(lambda table, key: table[key], way[:-1], changed)[way[-1]] = number
    return changed


def refused(checked, content, fewest):
    """Every number of this content, replaced, is refused by its table's name in one line."""
    ways = list(numbers(content))
    assert len(ways) >= fewest
    for place, way in enumerate(ways):
        number = (math.nan, math.inf, -math.inf)[place % 3]
        with pytest.raises(UserError) as raised:
            checked(with_number(content, way, number))
        said = raised.value.lines
        assert len(said) == 1, way
        assert str(way[0]) in said[0], way
        assert f"{number}" in said[0], way


@pytest.mark.parametrize("kind", WHOLE)
def test_every_number_of_a_mission_must_be_finite(kind):
    mission = WHOLE[kind]()
    content = plain(mission.model_dump())
    assert check_mission(content, "m.toml", mission.folder)
    refused(lambda changed: check_mission(changed, "m.toml", mission.folder), content, 20)


@pytest.mark.parametrize("kind", TABLES)
def test_every_number_of_a_file_of_many_flights_must_be_finite_though_no_flight_has_it(kind):
    model, content = TABLES[kind]
    assert check(model, content, "f.toml")
    refused(lambda changed: check(model, changed, "f.toml"), content, 15)
