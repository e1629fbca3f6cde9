"""A plant of the user's own, whose state nothing in the package knows, with its controllers: through every command."""

import json
import re

import numpy as np
import pyarrow.parquet as pq
import pytest

from quadstep import UserError, fly, read_mission
from quadstep.engines.engine import Engine
from quadstep.io import user_code
from tests.campaigns import fly as fly_campaign
from tests.commands import quadstep, write
from tests.pages import fly_page, needs_node

pytestmark = pytest.mark.usefixtures("undrawn", "ungraded")

PLANT = '''
from typing import ClassVar, NamedTuple

from quadstep.interfaces.controller import Controller
from quadstep.interfaces.gain import believed, from_gains, gain
from quadstep.interfaces.plant import Model
from quadstep.interfaces.closed_loop import Outcome, finite
from quadstep.interfaces.log import Metric
from quadstep.numbers import Number, Vector, absolute, clip, maximum, vector, where
from quadstep.vehicle.declared import DeclaredPlant


class Numbers(NamedTuple):
    mass: Number = gain(2.0, "kg", "mass")
    drag: Number = gain(0.3, "N s/m", "drag", zero=True)
    lag: Number = gain(0.1, "s", "of the engine")
    most: Number = gain(60.0, "N", "what the engine can make at most")


class Limits(NamedTuple):
    distance: Number = gain(20.0, "m", "from the path")


class Motion(NamedTuple):
    position: Vector
    velocity: Number
    thrust: Number


class Thrust(NamedTuple):
    thrust: Number


class Rail(DeclaredPlant):
    """A rocket on a vertical rail: one axis, one input, an engine that lags."""

    name: ClassVar = "rail"
    Numbers: ClassVar = Numbers
    Limits: ClassVar = Limits
    measures: ClassVar = Motion
    axes: ClassVar = ("z",)
    efforts: ClassVar = {"thrust": "N"}
    columns: ClassVar = {"t": "s", "z": "m", "v_z": "m/s", "z_d": "m", "thrust": "N"}

    def model(self, numbers):
        return Model(numbers.mass, vector(1.0, 1.0, 1.0), 9.81, most_thrust=numbers.most, rotors=1)

    def begin(self, numbers, wanted):
        return Motion(vector(wanted.position[2]), wanted.velocity[2], 9.81 * numbers.mass)

    def rest(self, state, p):
        return Thrust(0.0), vector(0.0)

    def actuate(self, p, command):
        return vector(clip(command.thrust, 0.0, p.vehicle.most))

    def rate(self, p, state, held, wind, time):
        force = state.thrust - p.vehicle.drag * state.velocity
        return Motion(vector(state.velocity), force / p.vehicle.mass - 9.81, (held[0] - state.thrust) / p.vehicle.lag)

    def outcome(self, p, state, command, reference):
        away = absolute(self.error(state, reference)[0])
        off = where(away < p.limits.distance, 0.0, float(Outcome.OFF_PATH))
        return where(finite(away + command.thrust), off, float(Outcome.NOT_FINITE))

    def error(self, state, reference):
        return vector(reference.position[2] - state.position[0])

    def inputs(self, held):
        return held

    def row(self, p, state, told, command, held, reference, wind, time):
        return [time, state.position[0], state.velocity, reference.position[2], held[0]]


class Glider(Rail):
    """The same on a rail that the wind blows along."""

    windy: ClassVar = True

    def rate(self, p, state, held, wind, time):
        return super().rate(p, state._replace(velocity=state.velocity - wind[2]), held, wind, time)._replace(
            position=vector(state.velocity)
        )


class Gains(NamedTuple):
    mass: Number = believed("mass")
    pole: Number = gain(3.0, "1/s", "both poles", low=0.5, high=10.0)
    k_i: Number = gain(from_gains(lambda g, model: 0.3 * g.pole), "1/s^3", "integral", zero=True)


class Lift(Controller):
    name = "lift"
    Gains = Gains
    measures = Motion

    def start(self, measured, gains):
        return vector(0.0)

    def law(self, memory, measured, reference, gains, t, period):
        error = reference.position[2] - measured.position[0]
        damped = 2.0 * gains.pole * (reference.velocity[2] - measured.velocity)
        pull = reference.acceleration[2] + gains.pole * gains.pole * error + damped + memory[0]
        return Thrust(gains.mass * (pull + 9.81)), vector(memory[0] + period * gains.k_i * error)


class Plain(Lift):
    name = "plain"

    def law(self, memory, measured, reference, gains, t, period):
        return super().law(vector(0.0), measured, reference, gains, t, period)[0], memory


class Sink(Metric):
    name, unit = "sink", "m"

    def start(self):
        return 0.0

    def add(self, sums, sample):
        return maximum(sums, sample["z_d"] - sample["z"])

    def value(self, sums):
        return sums
'''
MISSION = """
name = "Rail"
metrics = ["rail.py:Sink"]
[vehicle]
type = "rail.py:Rail"
mass = 2.5
[path]
type = "minimum-jerk"
end = [0.0, 0.0, 1.0]
duration = 1.0
[controller]
type = "rail.py:Lift"
pole = 4.0
[tune]
seeds = 2
[tune.gains]
"controller.pole" = {}
"""
CAMPAIGN = """
name = "Masses"
mission = "rail.toml"
flights = 20
[vary]
"vehicle.mass" = { type = "uniform", low = 2.0, high = 3.0 }
[failure]
sink = 0.5
"""
STUDY = """
name = "Laws"
vehicles = ["VEHICLE"]
seeds = 8
metrics = ["position_rmse", "rail.py:Sink"]
[paths.up]
mission = { path = { type = "minimum-jerk", end = [0.0, 0.0, 1.0], duration = 1.0 } }
[scenarios.heavy]
vary = { "vehicle.mass" = { type = "uniform", low = 0.5, high = 2.5 } }
"""
LAWS = '[controllers.lift]\ncontroller = "rail.py:Lift"\n[controllers.plain]\ncontroller = "rail.py:Plain"\n'


@pytest.fixture
def mission(tmp_path, monkeypatch):
    """Its mission, in the folder that is worked in."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rail.py").write_text(PLANT)
    return write(tmp_path, MISSION, "rail.toml")


def test_it_flies_alike_on_floats_and_lanes(mission):
    lanes, floats = (fly(read_mission(mission), engine=one) for one in (Engine.LANES, Engine.PYTHON))
    np.testing.assert_array_equal(lanes.rows, floats.rows)
    assert lanes.metrics()["position_rmse[m]"] < 0.1
    assert lanes.metrics()["sink[m]"] < 0.1


@pytest.mark.parametrize("command", [
    ("fly", "rail.toml"),
    ("page", "rail.toml"),
    ("linear", "rail.toml"),
    ("linear", "windy.toml"),
    ("export", "rail.toml"),
    ("envelope", "rail.toml", "--x", "vehicle.mass=2,3", "--y", "controller.pole=3,4"),
    ("tune", "rail.toml", "--budget", "200"),
    ("campaign", "masses.toml"),
    ("compare", "rail.toml", "other.toml", "--seeds", "2"),
], ids=" ".join)  # fmt: skip
@pytest.mark.usefixtures("windy")
def test_every_command_takes_it(mission, command):
    write(mission.parent, CAMPAIGN, "masses.toml")
    write(mission.parent, MISSION.replace(":Lift", ":Plain"), "other.toml")
    run = quadstep(*command, "--out", "out.html" if command[0] == "page" else "out")
    assert run.code == 0, run


@pytest.mark.parametrize("start", ["0.0", "0.001"])
def test_its_flights_are_proved_and_that_is_checked(mission, start):
    run = quadstep("prove", mission, "--start", start, "--out", "proofs/lift.json")
    assert run.code == 0, run
    assert "Proved: " in run.out
    run = quadstep("prove", "--check", "proofs/lift.json", "--controller", "rail.py")
    assert run.code == 0, run
    assert "Confirmed" in run.out


def test_nothing_is_proved_of_a_state_that_does_not_say_where_the_position_is(mission):
    text = PLANT.replace("    position: Vector\n    velocity", "    place: Vector\n    velocity")
    mission.with_name("rail.py").write_text(re.sub(r"(state|measured)\.position", r"\1.place", text))
    assert quadstep("fly", mission, "--out", "out").code == 0
    run = quadstep("prove", mission)
    assert run.refused, run
    assert "the first entry of its state should be `position`, a Vector along z" in run.err


def test_a_study_compares_its_laws_by_a_metric_of_ones_own(mission, studies_here):
    study = write(mission.parent, STUDY.replace("VEHICLE", "rail.py:Rail") + LAWS, "study.toml")
    run = quadstep("compare", study, "--out", "out")
    assert run.code == 0, run
    cells = pq.read_table("out/cells.parquet")
    assert cells.num_rows == 2
    assert any(name.startswith("sink") for name in cells.column_names)
    assert json.loads(mission.with_name("out").joinpath("metrics.json").read_text())


def test_a_law_with_a_mistake_is_one_line_and_the_others_go_on(mission):
    mission.with_name("rail.py").write_text(PLANT.replace("law(vector(0.0),", "law(nothing,"))
    study = write(mission.parent, STUDY.replace("VEHICLE", "rail.py:Rail") + LAWS, "study.toml")
    run = quadstep("compare", study, "--out", "out")
    assert run.refused, run
    assert re.search(
        r"plain cannot fly rail.py:Rail: .*rail.py:\d+: NameError: name 'nothing' is not defined; the line: ", run.err
    )
    run = quadstep("compare", study, "--keep-going", "--out", "out")
    assert run.code == 2
    assert "lift has a median " in run.out
    assert "NameError" in run.err


WIND = """
seed = 3
[wind]
mean = [0.0, 0.0, 4.0]
turbulence = { intensity = "moderate", height = 20.0 }
"""


@pytest.fixture
def windy(mission):
    """The mission of the rail that the wind blows along."""
    head, _, rest = MISSION.replace("rail.py:Rail", "rail.py:Glider").partition("[vehicle]")
    wind = WIND.replace("seed = 3\n", "")
    return write(mission.parent, f"seed = 3\n{head}[vehicle]{rest}{wind}", "windy.toml")


def test_the_wind_acts_on_one_that_says_so(mission, windy):
    lanes, floats = (fly(read_mission(windy), engine=one) for one in (Engine.LANES, Engine.PYTHON))
    np.testing.assert_array_equal(lanes.rows, floats.rows)
    calm, blown = fly(read_mission(mission)).column("v_z"), lanes.column("v_z")
    assert 1e-3 < abs(blown - calm).max() < 1.0
    assert read_mission(windy).noisy


def test_a_campaign_varies_its_wind(windy):
    text = CAMPAIGN.replace("rail.toml", "windy.toml").replace('"vehicle.mass"', '"wind.mean.2"')
    write(windy.parent, text, "gusts.toml")
    assert fly_campaign("gusts.toml", "gusts").code == 0
    rows = pq.read_table(windy.parent / "gusts" / "flights").to_pandas()
    assert rows["position_rmse[m]"].nunique() == 20


def test_the_wind_of_one_that_does_not_is_refused(mission):
    path = write(mission.parent, f"{MISSION}[wind]\nmean = [0.0, 0.0, 1.0]\n", "calm.toml")
    with pytest.raises(UserError, match="wind: unknown key"):
        read_mission(path)


@needs_node
@pytest.mark.parametrize("named", ["mission", "windy"])
def test_its_page_flies_it_as_python_floats_do(named, request):
    path = request.getfixturevalue(named)
    assert quadstep("page", path, "--out", "page.html").code == 0
    (answer,) = fly_page(path.with_name("page.html"), {"flight": "rail"})
    log = fly(read_mission(path), engine=Engine.PYTHON)
    assert [name for name, _ in answer["columns"]] == list(log.columns)
    np.testing.assert_array_equal(answer["values"], log.rows)


def test_a_study_takes_the_packages_planar_vehicle_and_vehicles_in_python_files(mission, studies_here):
    text = STUDY.replace(', "rail.py:Sink"', "")
    mission.with_name("racer.py").write_text('RACER = {"preset": "x500", "mass": 2.2}\n')
    for vehicle, laws in (("planar", ("planar-pd", "planar-linearisation")), ("racer.py:RACER", ("pid", "geometric"))):
        study = write(
            mission.parent,
            text.replace("VEHICLE", vehicle).replace("high = 2.5", "high = 0.6" if vehicle == "planar" else "high = 2.4")
            + "".join(f'[controllers.{name}]\ncontroller = "{name}"\n' for name in laws),
            "study.toml",
        )
        run = quadstep("compare", study, "--seeds", "2", "--out", vehicle.partition(".")[0])
        assert run.code == 0, run


@pytest.mark.parametrize(("old", "new", "said"), [
    ('"VEHICLE"', '"rail.py:Nothing"', "study.toml: vehicles: .*rail.py: has no 'Nothing'"),
    ('"rail.py:Sink"', '"rail.py:Lift"', "study.toml: .*rail.py:Lift: should be a subclass of quadstep.own.Metric"),
    ('"VEHICLE"', '"rail"', "vehicles: unknown vehicle 'rail'; allowed: .*planar, .*FILE.py:NAME"),
])  # fmt: skip
def test_what_a_study_names_wrongly_is_one_line(mission, old, new, said):
    text = (STUDY + LAWS).replace(old, new).replace("VEHICLE", "rail.py:Rail")
    run = quadstep("compare", write(mission.parent, text, "study.toml"))
    assert run.refused, run
    assert re.search(said, run.err), run.err


def test_a_mission_for_it_is_written_and_needs_a_controller(mission):
    assert quadstep("new", "new.toml", "--vehicle", "rail.py:Rail", "--controller", "rail.py:Lift").code == 0
    assert "; or" not in mission.with_name("new.toml").read_text().split("[controller]")[1].splitlines()[1]
    assert quadstep("fly", "new.toml", "--out", "out").code == 0
    without = MISSION.replace('[controller]\ntype = "rail.py:Lift"\npole = 4.0\n', "")
    run = quadstep("fly", write(mission.parent, without, "none.toml"))
    assert run.refused, run
    assert "controller is required" in run.err


@pytest.mark.parametrize(("old", "new", "said"), [
    ('axes: ClassVar = ("z",)', 'axes: ClassVar = ("altitude",)', "axes: should be a tuple of x, y, z or some of them"),
    ('    efforts: ClassVar = {"thrust": "N"}\n', "", "rail.py:Rail: has no `efforts`"),
    ('"z_d": "m", ', "", "columns: z_d missing"),
    ("return [time, state.position[0], ", "return [time, ", "row: should be a list of 5 numbers, one for each of `columns`"),
    ("        return held\n", "        return vector(0.0, 0.0)\n", "inputs: should be a Vector of 1 numbers, one for each of"),
    ("        return vector(reference.position[2] - state.position[0])", "        return reference.position", "error: "),
    ("return Motion(vector(state.velocity), ", "return Motion(state.velocity, ", "rate: the rates: should keep the shape"),
    ("return vector(clip(", "return (clip(", "actuate: the command to the actuators: should keep the shape"),
], ids=lambda text: text[:12])  # fmt: skip
def test_what_it_declares_or_returns_wrongly_is_one_line(mission, old, new, said):
    assert old in PLANT
    mission.with_name("rail.py").write_text(PLANT.replace(old, new, 1))
    run = quadstep("fly", mission)
    assert run.refused, run
    assert said in run.err


def test_a_function_cannot_fly_it(mission):
    with mission.with_name("rail.py").open("a") as file:
        file.write("\n\ndef function(t, measured, reference):\n    return 0.0, (0.0, 0.0, 0.0)\n")
    text = MISSION.replace(":Lift", ":function").replace("pole = 4.0\n", "")
    run = quadstep("fly", write(mission.parent, text, "function.toml"))
    assert run.refused, run
    assert "rail.py:function: a function flies a real vehicle or the paper's plant; this vehicle needs a Controller" in run.err


def test_a_study_runs_no_code_of_users_where_that_was_said(mission, monkeypatch):
    monkeypatch.setattr(user_code, "refused", "")
    study = write(mission.parent, STUDY.replace("VEHICLE", "rail.py:Rail") + LAWS, "study.toml")
    run = quadstep("--no-user-code", "compare", study)
    assert run.refused, run
    assert "study.toml: vehicles: " in run.err
