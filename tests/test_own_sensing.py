"""Sensors and estimators of the user's own, which missions name, and those of the package in the same form."""

import math
import shutil
from pathlib import Path

import numpy as np
import pytest

from quadstep import Engine, Mission, read_mission
from quadstep.engines.fly import fly
from quadstep.io import user_code
from quadstep.numbers import vector
from quadstep.sensing.estimator import ErrorState
from quadstep.sensing.sensors import Navigation
from quadstep.sensing.suite import LAST_SAMPLES
from tests.campaigns import no_report
from tests.commands import quadstep

pytestmark = pytest.mark.usefixtures("no_figures", "ungraded")

ROOT = Path(__file__).parent.parent

MISSION = """
vehicle.preset = "x500"
[path]
type = "step"
end = [0.0, 0.0, 1.0]
time = 0.1
duration = 0.6
[sensors]
imu_period = 0.004
fix_period = 0.02
gyro_noise = 0.002
accelerometer_noise = 0.02
"""

BEACON = 'fix = { type = "sensing.py:Beacon", grows = 0.05 }\n'
COMPLEMENTARY = 'estimator = { type = "sensing.py:Complementary", position = 0.4 }\n'

SAME = """
from typing import NamedTuple
from quadstep.numbers import vector
from quadstep.sensing.estimator import ErrorState
from quadstep.sensing.sensors import Navigation
from quadstep.sensing.suite import WhiteFix

class Nothing(NamedTuple): pass

class Fix(WhiteFix):
    Numbers = Nothing

class Filter(ErrorState):
    Numbers = Nothing
"""

WRONG = {
    "no sensor": ('fix = { type = "sensing.py:Complementary" }', "should be a subclass of quadstep.own.Sensor"),
    "no estimator": ('estimator = { type = "sensing.py:Beacon" }', "should be a subclass of quadstep.own.Estimator"),
    "no draws": ('fix = { type = "own.py:Still" }', "own.py:Still: `draws` should be a whole number from 1 to 100, not 0"),
    "unknown key": ('estimator = { type = "sensing.py:Complementary", yaw = 1.0 }', "sensors.estimator.yaw: unknown key"),
    "out of range": ('fix = { type = "sensing.py:Beacon", grows = -1.0 }', "sensors.fix.grows: should be greater than"),
    "of no file": ('fix = { type = "beacon" }', "sensors.fix.type: unknown value 'beacon'; allowed: your own"),
    "no table": ("fix = true", "sensors.fix: should be a table whose `type` is a sensor"),
    "a word": ('estimator = "kalman"', "sensors.estimator: should be true or false"),
    "no fix": ('fix = { type = "own.py:Place" }', "TypeError: `sample` should return a Navigation, not a Vector"),
    "fails": ('fix = { type = "own.py:Fails" }', "own.py:6: NameError: name 'much' is not defined; the line: return much"),
}

FAILS = """
from typing import NamedTuple
from quadstep.own import Sensor
class Fails(Sensor):
    def sample(self, truth, noise, p):
        return much
class N(NamedTuple): pass
Fails.Numbers = N
class Still(Fails): draws = 0
class Place(Fails):
    def sample(self, truth, noise, p):
        return truth.position
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setattr(user_code, "refused", "")
    shutil.copy(ROOT / "examples" / "sensing.py", tmp_path)
    return tmp_path


def mission(folder, *lines):
    path = folder / "m.toml"
    path.write_text(MISSION + "".join(lines))
    return path


def rows(path, engine=Engine.LANES):
    return fly(read_mission(path).plan(), engine).rows


def test_they_fly_on_both_engines_alike_and_act(folder):
    both = mission(folder, BEACON, COMPLEMENTARY)
    own = rows(both)
    assert np.array_equal(own, rows(both, Engine.PYTHON))
    assert np.isfinite(own).all()
    for lines in ([BEACON.replace("0.05", "0.5"), COMPLEMENTARY], [BEACON, "estimator = true\n"]):
        assert not np.array_equal(own, rows(mission(folder, *lines)))


def test_a_late_velocity_is_that_of_the_past_made_smaller(folder):
    late = 'estimator = { type = "sensing.py:LateVelocity", late = 0.02, size = 0.9 }\n'
    own = mission(folder, late)
    assert np.array_equal(rows(own), rows(own, Engine.PYTHON))
    assert not np.array_equal(rows(own), rows(mission(folder)))
    estimator = read_mission(mission(folder, late)).plan().loop.sensing.estimator
    turn, numbers = 0.2 * math.pi, read_mission(mission(folder, late)).sensors.numbers(gravity=9.81)

    def at(t):
        return vector(math.cos(turn * t), math.sin(turn * t), 0.0)

    fix = Navigation(at(3.0), at(3.0), vector(1.0, 0.0, 0.0, 0.0))
    force = vector(-turn * math.sin(turn * 3.0), turn * math.cos(turn * 3.0), 9.81)
    known = estimator.start(fix, vector(0.0, 0.0, 0.0), force, numbers, 0, 0)
    known = estimator.correct(estimator.predict(known, vector(0.0, 0.0, 0.0), force, numbers, 0.004), fix, numbers)
    told = estimator.motion(known)
    assert [float(one) for one in told.velocity] == pytest.approx([0.9 * float(one) for one in at(2.98)], abs=1e-4)
    assert told.position == fix.position


def test_the_packages_are_the_same_where_a_file_of_ones_own_has_them(folder):
    (folder / "same.py").write_text(SAME)
    late = "latency = 0.052\nimu_latency = 0.008\n"
    known = rows(mission(folder, late, "position_noise = 0.01\nestimator = true\n"))
    own = rows(
        mission(
            folder, late, 'position_noise = 0.01\nestimator = { type = "same.py:Filter" }\nfix = { type = "same.py:Fix" }\n'
        )
    )
    assert np.array_equal(known, own)


def test_a_mission_with_them_is_noisy_and_is_written_as_it_was_read(folder):
    read = read_mission(mission(folder, BEACON, COMPLEMENTARY))
    assert read.noisy
    sensors = read.model_dump()["sensors"]
    assert sensors["fix"] == {"type": "sensing.py:Beacon", "place": (0.0, 0.0, 0.0), "near": 0.002, "grows": 0.05}
    assert sensors["estimator"]["position"] == 0.4
    again = Mission(vehicle=read.vehicle, path=read.path, controller=read.controller, sensors=read.sensors)
    assert again.sensors == read.sensors


def test_the_key_chooses_the_estimator(folder):
    assert read_mission(mission(folder, "estimator = true\n")).plan().loop.sensing.estimator == ErrorState()
    assert read_mission(mission(folder)).plan().loop.sensing.estimator == LAST_SAMPLES


@pytest.mark.slow
def test_a_campaign_varies_them(folder):
    mission(folder, BEACON, COMPLEMENTARY)
    campaign = folder / "c.toml"
    campaign.write_text(
        'mission = "m.toml"\nflights = 20\n[vary]\n"sensors.fix.grows" = { type = "uniform", low = 0.0, high = 0.2 }\n'
        '"sensors.estimator.position" = { type = "uniform", low = 0.1, high = 0.5 }\n'
    )
    with no_report():
        flown = quadstep("campaign", campaign, "--out", folder / "out")
    assert flown.code == 0, flown
    assert quadstep("fly", campaign, "--flight", 7, "--results", folder / "out", "--out", folder / "replay").code == 0


@pytest.mark.parametrize("case", WRONG)
def test_wrong_ones_are_one_line(folder, case):
    line, said = WRONG[case]
    (folder / "own.py").write_text(FAILS)
    run = quadstep("fly", mission(folder, line), "--out", folder / "out")
    assert run.refused, run.err
    assert said in run.err
