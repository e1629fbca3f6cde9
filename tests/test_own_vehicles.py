"""Vehicles and disturbances of the user's own, in files that missions name; and entry points for whatever users can add."""

import re
from importlib.metadata import EntryPoint

import numpy as np
import pytest

from quadstep import Mission, UserError, fly
from quadstep.engines.engine import Engine
from quadstep.io import doors, user_code
from quadstep.mission.presets import preset_table
from quadstep.studies.campaign.schema import digests
from tests.commands import quadstep, quadstep_process

pytestmark = pytest.mark.usefixtures("ungraded")

LINE = {"type": "minimum-jerk", "end": [2.0, 0.5, 1.0], "duration": 3.0}
SHORT = {"duration": 3.0}

SPRING = """
from dataclasses import dataclass
from typing import NamedTuple

from quadstep.interfaces.gain import gain
from quadstep.numbers import Vector, sin, vector
from quadstep.vehicle.paper import DeclaredDisturbance


class Numbers(NamedTuple):
    force: Vector = gain((0.1, 0.2, -0.3), "N", "steady force", signed=True)
    swing: float = gain(0.0, "N", "swinging force", zero=True)


@dataclass(frozen=True)
class Pull(DeclaredDisturbance):
    Numbers = Numbers

    def disturb(self, state, numbers, time):
        return numbers.force + vector(numbers.swing * sin(2.0 * time), 0.0, 0.0), vector(0.0, 0.0, 0.0)
"""

RACER = """
from pathlib import Path

RACER = {"preset": "x500", "mass": 1.8, "inertia": (0.02, 0.02, 0.04)}


def heavy():
    return {**RACER, "mass": 2.6}


LIST = [1, 2]
LOOP = {"preset": "racer.py:LOOP"}
WRONG = {"preset": "x500", "mass": -1.0}


def fails():
    return 1 / 0
"""


@pytest.fixture(autouse=True)
def files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pull.py").write_text(SPRING)
    (tmp_path / "racer.py").write_text(RACER)


def paper(disturbance, **more):
    return Mission(path=LINE, disturbance=disturbance, simulation=SHORT, **more)


def test_a_steady_force_of_ones_own_is_the_packages_to_the_bit():
    package = fly(paper({"scale": 0.0, "force": [0.1, 0.2, -0.3]}))
    own = fly(paper({"type": "pull.py:Pull"}))
    np.testing.assert_array_equal(own.rows, package.rows)
    assert not np.array_equal(own.rows, fly(paper({"type": "pull.py:Pull", "force": [0.1, 0.2, 0.3]})).rows)


def test_a_disturbance_knows_the_time_and_is_the_same_on_every_engine():
    one = paper({"type": "pull.py:Pull", "swing": 2.0})
    lanes, floats = fly(one), fly(one, engine=Engine.PYTHON)
    np.testing.assert_array_equal(lanes.rows, floats.rows)
    assert not np.array_equal(lanes.rows, fly(paper({"type": "pull.py:Pull"})).rows)


def test_a_disturbance_of_ones_own_in_every_command(tmp_path):
    (tmp_path / "own.toml").write_text(
        '[path]\ntype = "minimum-jerk"\nend = [2.0, 0.5, 1.0]\nduration = 2.0\n[disturbance]\ntype = "pull.py:Pull"\n'
    )
    assert quadstep("fly", "own.toml", "--out", "out").code == 0
    assert "steady force" in (tmp_path / "out" / "page.html").read_text()
    (tmp_path / "many.toml").write_text(
        'mission = "own.toml"\nflights = 8\n[vary]\n"disturbance.swing" = { type = "uniform", low = 0.0, high = 1.0 }\n'
    )
    run = quadstep("campaign", "many.toml", "--out", "many")
    assert run.code == 0, run.err
    run = quadstep("certify", "own.toml", "--out", "sure")
    assert run.code == 0, run.err
    run = quadstep_process("--no-user-code", "fly", "own.toml", "--out", "none")
    assert run.returncode == 2
    assert "user code is not run" in run.stderr


@pytest.mark.parametrize(("old", "new", "said"), [
    ("def disturb", "def other", "has no `disturb`"),
    ("numbers.force +", "numbers.strength +", "pull.py:20: AttributeError"),
    (", vector(0.0, 0.0, 0.0)\n", "\n", "TypeError: `disturb` should return a force and a torque, each a Vector of 3"),
])  # fmt: skip
def test_a_wrong_disturbance_is_one_line(tmp_path, old, new, said):
    (tmp_path / "pull.py").write_text(SPRING.replace(old, new))
    (tmp_path / "own.toml").write_text(
        '[path]\ntype = "minimum-jerk"\nend = [2.0, 0.5, 1.0]\nduration = 2.0\n[disturbance]\ntype = "pull.py:Pull"\n'
    )
    run = quadstep("fly", "own.toml", "--out", "out")
    assert run.refused, run.err
    assert said in run.err


def real(preset, **more):
    return Mission(vehicle={"preset": preset, **more}, path=LINE, simulation=SHORT)


def test_a_vehicle_in_a_python_file_is_the_same_as_in_toml():
    by_key = fly(real("x500", mass=1.8, inertia=[0.02, 0.02, 0.04]))
    np.testing.assert_array_equal(fly(real("racer.py:RACER")).rows, by_key.rows)
    assert real("racer.py:heavy").modelled.airframe.mass == 2.6
    assert real("racer.py:heavy", mass=3.0).modelled.airframe.mass == 3.0


@pytest.mark.parametrize(("name", "said"), [
    ("racer.py:LIST", "racer.py:LIST: should be a dict with the keys of a vehicle"),
    ("racer.py:LOOP", "racer.py:LOOP: should be a dict with the keys of a vehicle"),
    ("racer.py:NONE", "has no 'NONE'"),
    ("racer.py:WRONG", "mass: should be greater than 0, not -1"),
    ("racer.py:fails", "racer.py:17: ZeroDivisionError"),
    ("nowhere.py:RACER", "nowhere.py"),
    ("racer", "unknown preset 'racer'; allowed: crazyflie, hummingbird, paper, research-2.6kg, x500, or your own FILE"),
])  # fmt: skip
def test_a_wrong_vehicle_is_one_line(name, said):
    with pytest.raises(UserError, match=re.escape(said)) as caught:
        real(name)
    assert "\n" not in str(caught.value)


def test_a_vehicle_of_ones_own_is_listed_and_a_mission_for_it_written(tmp_path):
    run = quadstep("vehicles", "racer.py:RACER")
    assert run.code == 0, run.err
    assert "1.8" in run.out
    assert quadstep("new", "mine.toml", "--vehicle", "racer.py:RACER").code == 0
    assert 'preset = "racer.py:RACER"' in (tmp_path / "mine.toml").read_text()
    run = quadstep("fly", "mine.toml", "--out", "out")
    assert run.code == 0, run.err


def test_user_code_is_refused_for_vehicles_too(monkeypatch):
    monkeypatch.setattr(user_code, "refused", "--no-user-code is given")
    with pytest.raises(UserError, match="user code is not run"):
        real("racer.py:RACER")


def test_the_content_of_a_vehicle_is_part_of_an_identity(tmp_path):
    before = digests({"vehicle": {"preset": "racer.py:RACER"}}, tmp_path)
    (tmp_path / "racer.py").write_text(RACER.replace("1.8", "1.9"))
    assert len(before) == 1
    assert digests({"vehicle": {"preset": "racer.py:RACER"}}, tmp_path) != before


@pytest.fixture
def packages(tmp_path, monkeypatch):
    """Installed packages with an entry point of each group."""
    (tmp_path / "quadstep_bring.py").write_text(SPRING + RACER)
    monkeypatch.syspath_prepend(tmp_path)
    points = [
        EntryPoint("pulled", "quadstep_bring:Pull", doors.DISTURBANCES),
        EntryPoint("racer", "quadstep_bring:RACER", doors.VEHICLES),
    ]
    monkeypatch.setattr("importlib.metadata.entry_points", lambda group: [one for one in points if one.group == group])
    doors.registered.cache_clear()
    yield
    doors.registered.cache_clear()


@pytest.mark.usefixtures("packages")
def test_entry_points_bring_vehicles_and_disturbances():
    assert preset_table("racer")["mass"] == 1.8
    assert real("racer").modelled.airframe.mass == 1.8
    assert paper({"type": "pulled", "swing": 1.0}).disturbance.swing == 1.0
