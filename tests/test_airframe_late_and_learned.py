"""Commands that reach the rotors late, and accelerations that a network has learned beside the laws."""

import numpy as np
import pytest

from quadstep.engines import fly
from quadstep.engines.fly import fly_all
from quadstep.io.errors import UserError
from quadstep.mission.multirotor import MultirotorMission
from quadstep.mission.presets import preset_table
from tests.quick_gains import QUICK

STEP = 0.002
NET = {
    "inputs": [[0.1, 0.0, 0.2, 0.0, 0.3, 0.0, 1e-4], [0.0, -0.2, 0.0, 0.4, 0.0, 0.1, 0.0]],
    "biases": [0.1, -0.2],
    "outputs": [[0.5, -0.1], [0.0, 0.2], [0.1, 0.0], [0.0, 0.3], [-0.2, 0.0], [0.1, 0.1]],
    "offsets": [0.0, 0.0, 0.0, 0.1, 0.0, -0.1],
}


def plan(gains=None, **vehicle):
    """A short flight of a Crazyflie to one side."""
    return MultirotorMission.model_validate(
        {
            "vehicle": {**preset_table("crazyflie"), **vehicle},
            "path": {"type": "step", "end": [0.1, 0.0, 1.0], "time": 0.0, "duration": 0.2},
            "start": {"position": [0.0, 0.0, 1.0]},
            "controller": {"type": "pid", **(gains or {})},
            "simulation": {"duration": 0.2, "log_period": STEP},
        }
    ).plan(warn=False)


def fly_floats(flown):
    """The flight on Python floats."""
    return fly.fly_floats(flown.loop, flown.parameters, flown.start, flown.ticks)


def rotors(log, flown):
    """What every rotor is told at each row, and how fast it turns [rad/s]."""
    shares = np.array([list(row) for row in flown.parameters.allocation.matrix])
    k = flown.parameters.airframe.rotor.thrust
    told = np.stack([log.column(name) for name in ("u_a", "tau_x_a", "tau_y_a", "tau_z_a")], axis=1) @ shares.T
    turning = np.stack([log.column(f"f{i + 1}") for i in range(4)], axis=1)
    return np.sqrt(np.maximum(told, 0.0) / k), np.sqrt(turning / k)


@pytest.mark.parametrize(("delay", "late"), [(0.0, 0), (0.001, 0), (0.013, 6), (0.0151, 7)])
def test_rotors_follow_what_they_were_told_so_many_samples_ago(delay, late):
    flown = plan(QUICK["pid"], command={"speed": 2675.0, "delay": delay})
    told, turning = rotors(fly_all([flown])[0], flown)
    left = np.exp(-STEP / flown.parameters.airframe.rotor.rise)
    before, after = turning[late:-2], turning[late + 1 : -1]
    heard = told[: len(before)]
    assert np.abs(heard + left * (before - heard) - after).max() < 1e-3
    other = told[1 : len(before) + 1]
    assert np.abs(other + left * (before - other) - after).max() > 1e-2


def test_engines_agree_on_late_commands_and_a_learned_residual():
    flown = plan(command={"speed": 2675.0, "delay": 0.007}, residual=NET, effects={"residual": True})
    assert np.array_equal(fly_all([flown])[0].rows, fly_floats(flown).rows)


def test_a_residual_acts_only_where_it_is_switched_on():
    switched = {"residual": NET, "effects": {"residual": True}}
    plain, off, on = (fly_floats(plan(**more)).rows for more in ({}, {"residual": NET}, switched))
    assert np.array_equal(plain, off)
    assert not np.array_equal(plain, on)


def test_a_residual_is_an_acceleration():
    constant = {**NET, "outputs": [[0.0, 0.0]] * 6, "offsets": [0.0, 0.0, 3.0, 0.0, 0.0, 0.5]}
    plain, pushed = (fly_floats(plan(**more)) for more in ({}, {"residual": constant, "effects": {"residual": True}}))
    row = 5
    assert pushed.column("v_z")[row] - plain.column("v_z")[row] == pytest.approx(0.5 * row * STEP, rel=0.05)
    assert pushed.column("r")[row] - plain.column("r")[row] == pytest.approx(3.0 * row * STEP, rel=0.05)


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [("biases", [0.1], "inputs"), ("offsets", [0.0] * 5, "offsets"), ("outputs", [[0.0, 0.0]] * 5, "outputs")],
)
def test_a_network_of_the_wrong_shape_is_refused(key, value, said):
    with pytest.raises((UserError, ValueError), match=said):
        plan(residual={**NET, key: value})


def test_too_long_a_delay_is_refused():
    with pytest.raises(UserError, match=r"vehicle\.command\.delay"):
        plan(command={"speed": 2675.0, "delay": 1.0})
