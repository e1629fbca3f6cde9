"""The planar quadrotor: the paper's plant in a plane, and a plant of which nothing but its file knows."""

import json
import math
import re
import tomllib

import numpy as np
import pytest

from quadstep import Mission, fly
from quadstep.control.planar import PlanarLinearisation, PlanarPd
from quadstep.engines.engine import Engine
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.plant import Kinematics, Reference
from quadstep.numbers import Vector, flatten, vector
from quadstep.vehicle.declared import PlantParameters
from quadstep.vehicle.paper import Disturbance, Rotors, State, Vehicle, derivative
from quadstep.vehicle.planar import Planar, PlanarCommand, PlanarLimits, PlanarNumbers, PlanarState, thrust_direction
from tests.commands import quadstep

PATH = {"type": "figure-eight", "centre": [0.0, 0.0, 3.0], "length": 3.0, "width": 1.5, "period": 5.0, "plane": "vertical"}
NUMBERS = PlanarNumbers(0.5, 0.004, 9.81, 0.15, 6.0)
P = PlantParameters(NUMBERS, None, None, PlanarLimits(100.0, 100.0))


def mission(**changes):
    return Mission(**{"vehicle": {"type": "planar"}, "path": PATH, **changes})


def test_it_is_the_papers_plant_in_a_plane():
    rng = np.random.default_rng(1)
    vehicle = Vehicle(0.5, vector(1.0, 0.004, 1.0), 9.81, Rotors(0.15, 0.05, -1e300, 1e300))
    for _ in range(20):
        x, z, v_x, v_z, q = rng.normal(size=5).tolist()
        pitch, thrust, torque = rng.uniform(-1.2, 1.2), rng.uniform(1.0, 8.0), rng.uniform(-0.2, 0.2)
        state = PlanarState(vector(x, z), vector(v_x, v_z), pitch, q)
        held = vector(0.5 * thrust - 0.5 * torque / 0.15, 0.5 * thrust + 0.5 * torque / 0.15)
        rate = Planar().rate(P, state, held, vector(0.0, 0.0, 0.0), 0.0)
        zero = vector(0.0, 0.0, 0.0)
        paper = State(vector(x, 0.0, z), vector(v_x, 0.0, v_z), vector(0.0, pitch, 0.0), vector(0.0, q, 0.0))
        still = Disturbance(0.0, zero, zero)
        wanted = derivative(vehicle, still, Kinematics.STANDARD, paper, thrust, vector(0.0, torque, 0.0))
        assert list(rate.velocity) == pytest.approx([wanted.velocity[0], wanted.velocity[2]], abs=1e-12)
        assert rate.rate == pytest.approx(wanted.rates[1], abs=1e-9)


def test_rotors_make_what_is_asked_within_their_limits():
    held = Planar().actuate(P, PlanarCommand(6.0, 0.3))
    assert list(held) == pytest.approx([2.0, 4.0])
    made = Planar().made(P, held)
    assert (made.thrust, made.torque) == pytest.approx((6.0, 0.3))
    assert list(Planar().actuate(P, PlanarCommand(20.0, 3.0))) == [0.0, 6.0]


@pytest.mark.parametrize("controller", ["planar-pd", "planar-linearisation"])
def test_every_engine_flies_it_alike(controller):
    plan = mission(controller={"type": controller}, simulation={"duration": 1.0}).plan()
    floats, lanes = fly(plan, Engine.PYTHON), fly(plan)
    np.testing.assert_array_equal(floats.rows, lanes.rows)
    assert flatten(floats.final) == [float(leaf) for leaf in flatten(lanes.final)]


def test_exact_linearisation_follows_a_hundred_times_closer():
    errors = [
        mission(controller={"type": kind}).flight_metrics(fly(mission(controller={"type": kind}).plan()))[0][
            "position_rmse[m]"
        ]
        for kind in ("planar-pd", "planar-linearisation")
    ]
    assert 0.02 < errors[0] < 0.1
    assert errors[1] < 0.02 * errors[0]


def test_the_linearised_error_decays_as_its_poles_say():
    """x_dddd of the error is that of four equal poles: (t + ...) e^-pt of a start at rest, off the path."""
    start, pole, period = 0.3, 4.0, 0.0005
    law, gains = PlanarLinearisation(), PlanarLinearisation.gains(Planar().model(NUMBERS), {"pole": pole})
    zero = vector(0.0, 0.0, 0.0)
    here = Reference(zero, zero, zero, 0.0, 0.0)
    state = PlanarState(vector(start, 0.0), vector(0.0, 0.0), 0.0, 0.0)
    memory = law.start(state, gains)
    for step in range(2000):
        command, memory = law.law(memory, state, here, gains, step * period, period)
        rate = Planar().rate(P, state, Planar().actuate(P, command), zero, 0.0)
        state = PlanarState(*(part + period * slope for part, slope in zip(state, rate, strict=True)))
    t = 2000 * period
    a = pole * t
    wanted = start * math.exp(-a) * (1.0 + a + a * a / 2.0 + a**3 / 6.0)
    assert state.position[0] == pytest.approx(wanted, rel=0.02)


def test_signs_of_both_loops():
    gains = PlanarPd.gains(Planar().model(NUMBERS))
    away = Reference(vector(1.0, 0.0, 0.0), *[vector(0.0, 0.0, 0.0)] * 2, 0.0, 0.0)
    command, _ = PlanarPd().law((), PlanarState(vector(0.0, 0.0), vector(0.0, 0.0), 0.0, 0.0), away, gains, 0.0, 0.01)
    assert command.wanted_pitch < 0.0
    assert thrust_direction(command.wanted_pitch)[0] > 0.0
    assert command.torque < 0.0


def test_it_ends_where_its_limits_say():
    spinning = PlanarState(vector(0.0, 0.0), vector(0.0, 0.0), 0.0, 101.0)
    zero = vector(0.0, 0.0, 0.0)
    here = Reference(zero, zero, zero, 0.0, 0.0)
    outcome = Planar().outcome
    assert Outcome(int(outcome(P, spinning, PlanarCommand(1.0, 0.0), here))) is Outcome.SPINNING
    assert Outcome(int(outcome(P, spinning._replace(rate=0.0), PlanarCommand(math.nan, 0.0), here))) is Outcome.NOT_FINITE
    far = spinning._replace(rate=0.0, position=vector(80.0, 80.0))
    assert Outcome(int(outcome(P, far, PlanarCommand(1.0, 0.0), here))) is Outcome.OFF_PATH
    assert isinstance(Planar().weight_norms(None), Vector)


TEXT = """
[vehicle]
type = "planar"
[path]
type = "minimum-jerk"
end = [2.0, 0.0, 1.0]
duration = 3.0
"""


def test_its_columns_axes_and_inputs_are_everywhere(tmp_path):
    path = tmp_path / "planar.toml"
    path.write_text(TEXT)
    run = quadstep("fly", path, "--out", tmp_path / "out", "--require", "position_rmse=0.2")
    assert run.code == 0, run.err
    metrics = json.loads((tmp_path / "out" / "metrics.json").read_text())
    assert list(metrics["position"]) == ["x", "z"]
    assert "largest[N m]" in metrics["torque"]
    page = (tmp_path / "out" / "page.html").read_text()
    assert '"label":"dynamic feedback linearisation"' in page
    assert sorted(one.name for one in (tmp_path / "out" / "figures").iterdir()) == [
        "inputs.svg",
        "path.svg",
        "position.svg",
        "signals.svg",
    ]


@pytest.mark.parametrize(("change", "said"), [
    (("planar", "planer"), "vehicle.type: unknown value 'planer'"),
    (('"planar"', '"planar"\nweight = 1.0'), "vehicle.weight: unknown key; allowed here: arm, gravity, inertia, mass"),
    (('"planar"', '"planar"\nmass = -1.0'), "vehicle.mass: should be greater than 0"),
    (("[path]", '[controller]\ntype = "pid"\n[path]'), "pid"),
    (("[path]", "[wind]\nmean = [1.0, 0.0, 0.0]\n[path]"), "wind"),
])  # fmt: skip
def test_what_it_does_not_know_is_refused(tmp_path, change, said):
    path = tmp_path / "planar.toml"
    path.write_text(TEXT.replace(*change, 1))
    run = quadstep("fly", path, "--out", tmp_path / "out")
    assert run.refused, run
    assert said in run.err


@pytest.mark.parametrize("law", ["planar-pd", "planar-linearisation"])
def test_a_mission_for_it_is_written_with_every_default_in_a_comment(tmp_path, law):
    path = tmp_path / "new.toml"
    assert quadstep("new", path, "--vehicle", "planar", "--controller", law).code == 0
    written = path.read_text()
    shown = re.sub(r"(?m)^# (\w+ = )", r"\1", written)
    assert shown.count("\n") == written.count("\n")
    first, second = (fly(Mission.model_validate(tomllib.loads(text))) for text in (written, shown))
    np.testing.assert_array_equal(first.rows, second.rows)
    assert first.outcome is Outcome.COMPLETED


def test_a_mission_for_it_names_a_controller_that_flies_it(tmp_path):
    run = quadstep("new", tmp_path / "new.toml", "--vehicle", "planar", "--controller", "pid")
    assert run.refused
    assert "allowed: planar-pd, planar-linearisation, or your own FILE.py:NAME" in run.err


def test_a_mission_for_a_plant_of_ones_own_is_written_too(tmp_path, monkeypatch, no_figures):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(
        "from quadstep.vehicle.planar import Planar\nclass Mine(Planar):\n    name = 'mine'\n    label = 'my own'\n"
    )
    assert quadstep("new", "new.toml", "--vehicle", "mine.py:Mine").code == 0
    assert 'type = "mine.py:Mine"' in (tmp_path / "new.toml").read_text()
    assert quadstep("fly", "new.toml", "--out", "out").code == 0
