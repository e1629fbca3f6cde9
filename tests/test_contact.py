"""A vehicle on legs: it stands, takes off, lands, holds against a wind, and falls over."""

import numpy as np
import pytest

from quadstep import Mission
from quadstep.engines.engine import Engine
from quadstep.engines.fly import fly
from quadstep.interfaces.closed_loop import Outcome
from tests.commands import quadstep, write

LEGS = 0.12

OFF = {"type": "pid", "mass": 1e-3}
"""A law that asks for next to no thrust: the rotors turn at idle."""


def flight(vehicle="x500", end=(0.0, 0.0, LEGS), duration=4.0, engine=Engine.LANES, **more):
    """On legs, from where it stands, with rotors at idle."""
    path = {"type": "minimum-jerk", "start": [0.0, 0.0, LEGS], "end": list(end), "duration": duration}
    start = {"hovering": False, **more.pop("start", {})}
    plan = Mission(vehicle={"preset": vehicle, "ground": 0.0, "legs": LEGS}, path=path, start=start, **more).plan()
    return fly(plan, engine)


def column(log, name):
    return log.rows[:, list(log.columns).index(name)]


@pytest.mark.parametrize("vehicle", ["x500", "crazyflie"])
def test_a_vehicle_takes_off_from_its_legs(vehicle):
    log = flight(vehicle, (0.5, 0.0, 1.5))
    assert log.outcome is Outcome.COMPLETED
    height = column(log, "z")
    assert height.min() > LEGS - 0.02  # the legs give by 5 mm
    assert height[-1] == pytest.approx(1.5, abs=0.15)


def test_it_stands_with_the_weight_on_its_feet_and_friction_holds_it():
    """Its law asks for nothing: rotors at idle, in wind."""
    log = flight(wind={"mean": [3.0, 0.0, 0.0]}, controller=OFF, start={"velocity": [0.0] * 3})
    assert log.outcome is Outcome.COMPLETED
    assert column(log, "z")[-1] == pytest.approx(LEGS, abs=0.01)
    assert abs(column(log, "x")[-1]) < 0.02  # creeps, and does not slide
    assert np.abs(column(log, "roll")).max() < 0.02


def test_it_lands_from_a_fall_and_bounces_little():
    log = flight(controller=OFF, start={"position": [0.0, 0.0, 0.4]})
    assert log.outcome is Outcome.COMPLETED
    height = column(log, "z")
    touched = int(np.argmax(height < LEGS))
    assert height[touched:].max() < LEGS + 0.05
    assert height.min() > 0.0
    assert height[-1] == pytest.approx(LEGS, abs=0.01)


def test_the_engines_agree_on_the_ground():
    logs = [flight("crazyflie", (0.1, 0.0, 0.4), 1.0, engine) for engine in (Engine.LANES, Engine.PYTHON)]
    np.testing.assert_array_equal(logs[0].rows, logs[1].rows)


def test_legs_need_a_ground_and_a_short_step(tmp_path):
    text = (
        '[vehicle]\npreset = "x500"\nlegs = 0.1\n{more}\n[path]\ntype = "step"\nend = [0.0, 0.0, 1.0]\nduration = 2.0\n{last}'
    )
    for more, last, said in (
        ("", "", "legs need the height `ground`"),
        ("ground = 0.0", "[simulation]\nstep = 0.005\ncontrol_period = 0.005\n", "vehicle.legs needs a simulation.step of"),
    ):
        run = quadstep("fly", write(tmp_path, text.format(more=more, last=last)), "--out", tmp_path / "out")
        assert run.refused
        assert said in run.err
