"""Paths, winds and metrics of the user's own, in files that missions name."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from quadstep import fly, read_mission
from quadstep.engines.engine import Engine
from quadstep.engines.fly import reason
from quadstep.engines.scored import scored
from quadstep.io import user_code
from quadstep.io.errors import UserError
from quadstep.numbers import flatten
from quadstep.page.build import flown_mission, missions_page
from quadstep.report import units
from tests.campaigns import no_report, rows
from tests.commands import quadstep

pytestmark = pytest.mark.usefixtures("no_figures", "ungraded")

EXAMPLES = Path(__file__).parent.parent / "examples"

LISSAJOUS = """
[path]
type = "lissajous.py:Lissajous"
size = [1.0, 1.0, 0.5]
period = 4.0
"""

REAL = """
[vehicle]
preset = "research-2.6kg"
"""

WRONG_PATHS = {
    "no such file": ('type = "nowhere.py:Loop"', "", "nowhere.py: file not found"),
    "no such name": ('type = "own.py:Loop"', "class Other: pass", "has no 'Loop'; it defines Other"),
    "no path": (
        'type = "own.py:Loop"',
        "class Loop: pass",
        "path.type: own.py:Loop: should be a subclass of quadstep.own.Path",
    ),
    "abstract": (
        'type = "own.py:Loop"',
        "from quadstep.world.paths import DeclaredPath\nclass Loop(DeclaredPath): pass",
        "path.type: own.py:Loop: has no `length` and no `reference`",
    ),
    "no numbers": (
        'type = "own.py:Loop"',
        "from quadstep.world.paths import DeclaredPath\nclass Loop(DeclaredPath):\n"
        "    def length(self, numbers): return 1.0\n    def reference(self, t, numbers): return None",
        "path.type: own.py:Loop: has no `Numbers`",
    ),
    "fails": ('type = "own.py:Loop"', "\n1 / 0", "own.py:2: ZeroDivisionError: division by zero; the line: 1 / 0"),
    "unknown key": ('type = "lissajous.py:Lissajous"\nspeed = 1.0', "", "path.speed: unknown key; allowed here: centre,"),
    "out of range": ('type = "lissajous.py:Lissajous"\nperiod = -1.0', "", "path.period: should be greater than 0, not -1.0"),
    "no list": ('type = "lissajous.py:Lissajous"\nsize = "big"', "", "path.size: should be a number or a list of three"),
}

BROKEN = """
from typing import NamedTuple
from quadstep.interfaces.gain import gain
from quadstep.interfaces.plant import Reference
from quadstep.world.paths import DeclaredPath
from quadstep.numbers import vector

class Numbers(NamedTuple):
    time: float = gain(2.0, "s", "of the path")

class Broken(DeclaredPath):
    Numbers = Numbers
    def length(self, numbers):
        return LENGTH
    def reference(self, t, numbers):
        return REFERENCE
"""

FLAT = "Reference(vector(0.0, 0.0), vector(0.0, 0.0), vector(0.0, 0.0), 0.0, 0.0)"
WRONG_LAWS = {
    "-1.0": ("None", "its length should be a number of seconds above 0, not -1"),
    "numbers.time": ("None", "`reference` should give a Reference, whose vectors have three entries"),
    "2.0 * numbers.time": (FLAT, "`reference` should give a Reference, whose vectors have three entries"),
    "1.0": ("numbers.nothing", "own.py:16: AttributeError: 'Numbers' object has no attribute 'nothing'; the line: return"),
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """With the examples' files of Python; user code may run whatever was said before."""
    monkeypatch.setattr(user_code, "refused", "")
    for name in EXAMPLES.glob("*.py"):
        shutil.copy(name, tmp_path)
    return tmp_path


def written(folder, mission, name="mission.toml"):
    """A mission's file."""
    (folder / name).write_text(mission)
    return folder / name


def refused(run, said):
    """One line that says so."""
    assert run.refused, run.err
    assert re.search(said, run.err), run.err


def flown_campaign(folder, mission, vary, head=""):
    """A campaign of 20 flights, and the folder that it was flown into."""
    written(folder, mission)
    text = f'mission = "mission.toml"\nflights = 20\n[vary]\n{vary}\n{head}\n'
    campaign, out = written(folder, text, "campaign.toml"), folder / "campaign"
    with no_report():
        run = quadstep("campaign", campaign, "--out", out)
    assert run.code == 0, run.err
    return campaign, out


# Paths


@pytest.mark.parametrize("vehicle", ["", REAL])
def test_a_path_flies_on_both_engines_alike(folder, vehicle):
    plan = read_mission(written(folder, LISSAJOUS + vehicle)).plan()
    assert plan.ticks.last * plan.ticks.step == 4.0
    logs = [fly(plan._replace(ticks=plan.ticks._replace(last=100)), engine) for engine in (Engine.LANES, Engine.PYTHON)]
    assert np.array_equal(logs[0].rows, logs[1].rows)
    assert logs[0].column("x_d")[0] == pytest.approx(1.0)


def test_the_lissajous_rates_are_those_of_its_position():
    sample = 1e-4
    plan = read_mission(EXAMPLES / "lissajous.toml").plan()
    before, now, after = (plan.loop.path.reference(1.3 + shift, plan.parameters.path) for shift in (-sample, 0.0, sample))
    for low, name in (("position", "velocity"), ("velocity", "acceleration"), ("acceleration", "jerk"), ("jerk", "snap")):
        slope = [(b - a) / (2 * sample) for a, b in zip(getattr(before, low), getattr(after, low), strict=True)]
        np.testing.assert_allclose(list(getattr(now, name)), slope, atol=1e-5)


def test_missions_of_the_same_path_are_equal_and_say_what_they_name(folder):
    path = written(folder, LISSAJOUS)
    one, other = read_mission(path), read_mission(path)
    assert one == other
    assert one.plan().loop == other.plan().loop
    assert one.model_dump()["path"]["type"] == "lissajous.py:Lissajous"
    assert one.model_dump()["path"]["period"] == 4.0


def test_a_campaign_varies_its_numbers_and_knows_its_file(folder):
    campaign, out = flown_campaign(folder, LISSAJOUS + REAL, '"path.size.0" = { type = "uniform", low = 0.1, high = 3.0 }')
    assert len(set(rows(out)["position_rmse[m]"].to_pylist())) == 20
    assert quadstep("fly", campaign, "--flight", 3, "--results", out, "--out", folder / "replay").code == 0
    law = folder / "lissajous.py"
    law.write_text(law.read_text() + "\n# a comment\n")
    with no_report():
        assert quadstep("campaign", campaign, "--out", out, "--resume").code == 0
    law.write_text(law.read_text().replace("sin(", "1.01 * sin("))
    refused(quadstep("campaign", campaign, "--out", out, "--resume"), "another|changed|differs")


@pytest.mark.parametrize("case", WRONG_PATHS)
def test_wrong_paths_are_one_line(folder, case):
    table, code, said = WRONG_PATHS[case]
    (folder / "own.py").write_text(code)
    refused(quadstep("fly", written(folder, f"[path]\n{table}\n"), "--out", folder / "out"), said)


@pytest.mark.parametrize("length", WRONG_LAWS)
def test_wrong_laws_of_paths_are_one_line(folder, length):
    reference, said = WRONG_LAWS[length]
    (folder / "own.py").write_text(BROKEN.replace("LENGTH", length).replace("REFERENCE", reference))
    refused(quadstep("fly", written(folder, '[path]\ntype = "own.py:Broken"\n'), "--out", folder / "out"), said)


def test_no_user_code_runs_where_that_was_said(folder):
    run = quadstep("fly", written(folder, LISSAJOUS), "--out", folder / "out", "--no-user-code")
    refused(run, "path.type: lissajous.py:Lissajous: user code is not run: --no-user-code was given")


# Winds

THERMAL = f"""{REAL}
[path]
type = "step"
end = [0.0, 0.0, 1.0]
duration = 2.0
[wind]
type = "thermal.py:Thermal"
rising = 3.0
"""

STEADY = """
from typing import NamedTuple
from quadstep.world.air import DeclaredWind
from quadstep.interfaces.gain import gain
from quadstep.numbers import Vector, vector

class Numbers(NamedTuple):
    mean: Vector = gain((0.0, 0.0, 0.0), "m/s", "of the wind", signed=True)

class Steady(DeclaredWind):
    Numbers = Numbers
    def wind(self, air, p, time, truth):
        return p.wind.mean
"""

WRONG_WINDS = {
    "no wind": ('type = "lissajous.py:Lissajous"',
        "wind.type: lissajous.py:Lissajous: should be a subclass of quadstep.own.Wind"),
    "unknown key": ('type = "thermal.py:Thermal"\nmean = [1.0, 0.0, 0.0]', "wind.mean: unknown key; allowed here: breeze,"),
    "out of range": ('type = "thermal.py:Thermal"\ntime = 0.0', "wind.time: should be greater than 0, not 0.0"),
    "of no file": ('type = "thermal"', "wind.type: unknown value 'thermal'; allowed: your own FILE.py:NAME"),
    "fails": ('type = "own.py:Fails"', "own.py:4: NameError: name 'speed' is not defined; the line: return speed"),
    "no vector": ('type = "own.py:Tuple"', "TypeError: `wind` should return a Vector of 3, not a tuple"),
    "default": ('type = "own.py:Low"', "wind.type: own.py:Low: speed: its default 1 should lie within its range, 2 to 3"),
    "negative": ('type = "own.py:Less"', "own.py:Less: speed: its default should consist of finite numbers above 0, not"),
    "flat": ('type = "own.py:Flat"', "TypeError: `wind` should return a Vector of 3, not a Vector of 2"),
}  # fmt: skip


def test_a_wind_flies_on_both_engines_alike_and_is_logged(folder):
    mission = read_mission(written(folder, THERMAL))
    assert mission.noisy
    plan = mission.plan()
    plan = plan._replace(ticks=plan.ticks._replace(last=200))
    logs = [fly(plan, engine) for engine in (Engine.LANES, Engine.PYTHON)]
    assert np.array_equal(logs[0].rows, logs[1].rows)
    assert logs[0].column("wind_z").max() > 2.5
    assert len(set(logs[0].column("wind_x"))) > 5


def test_a_steady_wind_of_ones_own_is_the_packages(folder):
    (folder / "own.py").write_text(STEADY)
    own = written(
        folder, THERMAL.replace("thermal.py:Thermal", "own.py:Steady").replace("rising = 3.0", "mean = [2.0, 1.0, -0.5]")
    )
    logs = [fly(read_mission(own).plan())]
    known = THERMAL.replace('type = "thermal.py:Thermal"', "").replace("rising = 3.0", "mean = [2.0, 1.0, -0.5]")
    logs.append(fly(read_mission(written(folder, known, "known.toml")).plan()))
    assert np.array_equal(logs[0].rows, logs[1].rows)
    assert not read_mission(own).noisy


def test_a_wind_that_varies_from_place_to_place_is_that_where_the_vehicle_is(folder):
    sheared = STEADY.replace("return p.wind.mean", "return (1.0 + truth.position[0]) * p.wind.mean")
    (folder / "own.py").write_text(sheared)
    own = THERMAL.replace("thermal.py:Thermal", "own.py:Steady").replace("rising = 3.0", "mean = [0.5, 0.0, 0.25]")
    plan = read_mission(written(folder, own)).plan()
    plan = plan._replace(ticks=plan.ticks._replace(last=1500))
    log = fly(plan)
    assert np.ptp(log.column("x")) > 0.02
    assert np.array_equal(log.column("wind_x"), (1.0 + log.column("x")) * 0.5)
    assert np.array_equal(log.column("wind_z"), (1.0 + log.column("x")) * 0.25)
    assert np.array_equal(log.rows[:3], fly(plan._replace(ticks=plan.ticks._replace(last=20)), Engine.PYTHON).rows[:3])


def test_a_campaign_varies_a_wind(folder):
    campaign, out = flown_campaign(folder, THERMAL, '"wind.rising" = { type = "uniform", low = 0.0, high = 6.0 }')
    assert len(set(rows(out)["position_rmse[m]"].to_pylist())) == 20
    assert quadstep("fly", campaign, "--flight", 7, "--results", out, "--out", folder / "replay").code == 0


@pytest.mark.parametrize(("text", "group", "units"), [
    (LISSAJOUS, "Path", {"centre": "m", "size": "m", "period": "s"}),
    (THERMAL, "Wind", {"rising": "m/s"}),
])  # fmt: skip
def test_their_numbers_have_sliders(folder, text, group, units):
    mission = read_mission(written(folder, text))
    plan = mission.plan()
    page = missions_page([flown_mission(mission, plan, fly(plan), folder)])
    for label, unit in units.items():
        assert f'"label":"{label}","unit":"{unit}","group":"{group}"' in page


@pytest.mark.parametrize("case", WRONG_WINDS)
def test_wrong_winds_are_one_line(folder, case):
    table, said = WRONG_WINDS[case]
    code = "from quadstep.world.air import DeclaredWind as W\nclass Fails(W):\n    def wind(self, air, p, time, truth):\n"
    numbers = "\nfrom typing import NamedTuple\nclass N(NamedTuple): pass\nFails.Numbers = N\n"
    others = "class Tuple(Fails):\n    def wind(self, *given): return 1.0, 0.0, 0.0\n"
    for name, given in (("Low", "1.0, 'm/s', 'x', low=2.0, high=3.0"), ("Less", "-1.0, 'm/s', 'x'")):
        numbers += f"class {name}Numbers(NamedTuple):\n    speed: float = gain({given})\n"
        others += f"class {name}(Fails):\n    Numbers = {name}Numbers\n"
    others += "class Flat(Fails):\n    def wind(self, *given): return vector(1.0, 0.0)\n"
    imports = "from quadstep.own import gain, vector; "
    (folder / "own.py").write_text(f"{imports}{code}        return speed{numbers}{others}")
    mission = THERMAL.partition("[wind]")[0] + f"[wind]\n{table}\n"
    refused(quadstep("fly", written(folder, mission), "--out", folder / "out"), said)


def test_a_wind_that_is_not_finite_is_named(folder):
    broken = STEADY.replace("return p.wind.mean", "return where(time > 0.05, float('nan'), 1.0) * p.wind.mean")
    (folder / "own.py").write_text(broken.replace("import Vector, vector", "import Vector, vector, where"))
    own = THERMAL.replace("thermal.py:Thermal", "own.py:Steady").replace("rising = 3.0", "mean = [2.0, 1.0, -0.5]")
    plan = read_mission(written(folder, own)).plan()
    log = fly(plan)
    assert 0.05 < log.ended < 0.06
    assert reason(plan, log) == "a number was no longer finite: the wind of Steady was nan"


def test_a_wind_that_is_not_finite_at_once_is_refused(folder):
    (folder / "own.py").write_text(STEADY.replace("return p.wind.mean", "return float('nan') * p.wind.mean"))
    own = THERMAL.replace("thermal.py:Thermal", "own.py:Steady").replace("rising = 3.0", "mean = [2.0, 1.0, -0.5]")
    said = "wind: Steady: is (nan, nan, nan) m/s at t = 0 s; it should be finite (own.py:"
    refused(quadstep("fly", written(folder, own), "--out", folder / "out"), re.escape(said))


@pytest.mark.parametrize("part", ["numbers.centre + sines", "rate * cosines", "rate * rate * rate * rate * sines"])
def test_a_path_that_is_not_finite_is_refused_at_once_and_named_later(folder, part):
    code = (EXAMPLES / "lissajous.py").read_text().replace("import Number", "import where, Number")
    own = folder / "lissajous.py"
    own.write_text(code.replace(part, f"float('nan') * ({part})", 1))
    path = written(folder, LISSAJOUS + REAL)
    run = quadstep("fly", path, "--out", folder / "out")
    refused(run, r"path.type: lissajous.py:Lissajous \(lissajous.py:")
    assert "is nan at t = 0 s; it should be finite" in run.err
    own.write_text(code.replace(part, f"where(t > 2.0, float('nan'), 1.0) * ({part})", 1))
    plan = read_mission(path).plan()
    log = fly(plan)
    assert 2.0 < log.ended < 2.02
    assert re.fullmatch(r"a number was no longer finite: the path's \w+\.0 was nan", reason(plan, log))


def test_a_metric_that_is_not_finite_is_told_of(folder):
    (folder / "metrics.py").write_text(
        (EXAMPLES / "metrics.py").read_text().replace("return sums\n", "return 0.0 * float('inf')\n")
    )
    run = quadstep("fly", written(folder, f'metrics = ["metrics.py:SettlingTime"]\n{LISSAJOUS}'), "--out", folder / "out")
    assert "warning" in run.err
    assert "the metric settling_time is not finite on this flight, so it has no value" in run.err


def test_a_wind_is_of_real_vehicles_only(folder):
    mission = THERMAL.replace(REAL, "")
    refused(quadstep("fly", written(folder, mission), "--out", folder / "out"), "wind")


# Metrics

STEP = """
path = { type = "step", end = [0.0, 0.0, 0.5], time = 0.1, duration = 3.0 }
"""

MEASURED = 'metrics = ["metrics.py:SettlingTime", "metrics.py:Climb"]\n'
MASS = '"vehicle.mass" = { type = "uniform", low = 0.8, high = 1.2 }'
HEIGHT = '"path.end.2" = { type = "uniform", low = 0.2, high = 1.0 }'
NOISY = f"{REAL}[sensors]\nposition_noise = 0.01\n"

ONE = """
from quadstep.interfaces.log import Metric

class One(Metric):
    name, unit = NAME
    def start(self):
        return START
    def add(self, sums, sample):
        return sums + sample["x"]
    def value(self, sums):
        return VALUE
"""

WRONG_METRICS = {
    '"metrics.py:Nothing"': ({}, "metrics: .*metrics.py: has no 'Nothing'; it defines "),
    '"lissajous.py:Lissajous"': ({}, "metrics: lissajous.py:Lissajous: should be a subclass of quadstep.own.Metric"),
    '"overshoot"': ({}, "metrics: unknown value 'overshoot'; allowed: energy, "),
    "3": ({}, r"metrics\[0\]: should be text, not 3"),
    '"metrics.py:Climb", "metrics.py:Climb"': ({}, "metrics: two metrics share the name climb"),
    '"own.py:One"': ({"NAME": '"a[b]", "m"'}, "metrics: own.py:One: its `name` should be letters"),
    '"own.py:One" ': ({"NAME": '"a", "m\\n"'}, "metrics: own.py:One: its `unit` should be"),
    ' "own.py:One"': ({"NAME": '"position_rmse", "m"'}, "position_rmse: every flight already has a metric of this name"),
    ' "own.py:One" ': ({"NAME": '"outcome", "m"'}, "metrics: own.py:One: its `name` is outcome, which already has another"),
    '"own.py:One",': ({"VALUE": "sums.nothing"}, "own.py:11: AttributeError: .* 'nothing'; the line: return sums.nothing"),
    '"own.py:One" , ': ({"VALUE": "'x'"}, r"`One.value` \(own.py:10\) should return numbers, not 'x'"),
    ' "own.py:One", ': ({"VALUE": "None"}, r"`One.value` \(own.py:10\) should return numbers, not None"),
    ' "own.py:One",': ({"START": "None"}, "own.py:9: TypeError: .*; the line: return sums"),
}


def test_a_flight_has_metrics_of_ones_own_and_is_judged_by_them(folder):
    mission = written(folder, MEASURED + STEP)
    run = quadstep("fly", mission, "--out", folder / "out", "--require", "settling_time=0.001")
    assert run.code == 4, run.err
    found = json.loads((folder / "out" / "metrics.json").read_text())
    assert found["settling_time[s]"] > 0.1
    log = fly(read_mission(mission).plan())
    assert found["climb[m]"] == pytest.approx(np.abs(np.diff(log.column("z"))).sum(), rel=1e-12)
    error = np.abs(log.table("x_d", "y_d", "z_d") - log.table("x", "y", "z"))
    assert found["settling_time[s]"] == log.column("t")[np.linalg.norm(error, axis=1) > 0.05].max()
    assert found["mission"]["metrics"] == ["metrics.py:SettlingTime", "metrics.py:Climb"]
    shown = units.quantity(found["settling_time[s]"], "s")
    assert f"settling time  {shown}" in re.sub(" {2,}", "  ", run.out)
    assert f"<dt>settling time</dt><dd>{units.unbroken(shown)}" in (folder / "out" / "report.html").read_text(encoding="utf-8")
    said = quadstep("fly", mission, "--out", folder / "other", "--require", "setling_time=0.001").err
    assert "did you mean settling_time? Allowed: any number of its metrics.json" in said


@pytest.mark.parametrize(("vehicle", "vary"), [("", MASS), (NOISY, HEIGHT)])
def test_a_campaign_has_the_metrics_of_its_flights(folder, vehicle, vary):
    head = "[failure]\nsettling_time = 1.0"
    campaign, out = flown_campaign(folder, MEASURED + STEP + vehicle, vary, head)
    table = rows(out)
    assert len(set(table["climb[m]"].to_pylist())) == 20
    late = [time > 1.0 for time in table["settling_time[s]"].to_pylist()]
    assert [not one for one in table["success"].to_pylist()] == late
    for flight in (0, 11):
        assert quadstep("fly", campaign, "--flight", flight, "--results", out, "--out", folder / f"{flight}").code == 0
        replay = json.loads((folder / f"{flight}" / "metrics.json").read_text())
        for name in ("climb[m]", "settling_time[s]"):
            assert replay[name] == table[name][flight].as_py()


def test_no_metric_of_ones_own_leaves_the_sums_as_they_were(folder):
    plan = read_mission(written(folder, STEP)).plan()
    loop, _ = scored(plan.loop, plan.ticks, 0.01)
    assert len(flatten(loop.start(plan.start, plan.parameters).score)) == 3 + 4 + 4 + 4 + 2


def test_tuning_may_ask_for_a_metric_of_ones_own(folder):
    tune = '[tune]\nobjective = { settling_time = 1.0 }\n[tune.gains]\n"controller.K1" = { low = 1.0, high = 2.0 }\n'
    with pytest.raises(UserError, match="settling_time: unknown metric"):
        read_mission(written(folder, STEP + tune))
    assert "settling_time[s]" in read_mission(written(folder, MEASURED + STEP + tune)).scores


def test_metrics_do_not_vary(folder):
    written(folder, MEASURED + STEP)
    text = 'mission = "mission.toml"\n[vary]\n"metrics.0" = { type = "choice", values = ["metrics.py:Climb"] }\n'
    refused(
        quadstep("campaign", written(folder, text, "c.toml"), "--out", folder / "out"),
        "what is measured does not affect flights",
    )


@pytest.mark.parametrize("named", WRONG_METRICS)
def test_wrong_metrics_are_one_line(folder, named):
    changes, said = WRONG_METRICS[named]
    code = ONE
    for name, usual in (("NAME", '"one", "m"'), ("START", "0.0"), ("VALUE", "sums")):
        code = code.replace(name, changes.get(name, usual))
    (folder / "own.py").write_text(code)
    refused(quadstep("fly", written(folder, f"metrics = [{named}]\n{STEP}"), "--out", folder / "out"), said)


def test_no_metric_of_users_runs_where_that_was_said(folder):
    run = quadstep("fly", written(folder, MEASURED + STEP), "--out", folder / "out", "--no-user-code")
    refused(run, "metrics: metrics.py:SettlingTime: user code is not run: --no-user-code was given")
