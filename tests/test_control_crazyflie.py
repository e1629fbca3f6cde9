"""The Crazyflie's stock laws: the firmware's own loops say the same, sample by sample, and its mixer and limits act."""

import os
from pathlib import Path

import numpy as np
import pytest

from quadstep import Mission, fly
from quadstep.control.crazyflie_mellinger import CrazyflieMellinger
from quadstep.control.crazyflie_pid import CrazyfliePid
from quadstep.control.mixers import crazyflie_thrusts
from quadstep.interfaces.closed_loop import Outcome
from quadstep.io.errors import UserError
from quadstep.mission.listings import load_preset
from tests.crazyflie_stock import LOOPS, firmware, motion, ours
from tests.firmware_flights import recorded
from tests.needs import C_COMPILER, CRAZYFLIE_TREE, needs

NEAR = {"attitude": 0.0, "rates": 0.0, "filtered": 2.0, "position": 0.025, "mellinger": 4.05}
"""Differences allowed: none where both compute in f32; rounding of filter coefficients [counts of 4e5]; f32 in positions and
thrust [counts, deg]; the firmware truncates three moments and the motors to whole counts, up to 4 in all, and f32.
"""


def check(said, found, name):
    assert np.isfinite(said[name]).all()
    assert np.abs(said[name] - found[name]).max() <= NEAR[name]


@pytest.fixture(scope="module")
def found():
    return ours(motion(2, 40))


@pytest.mark.parametrize("name", LOOPS)
def test_loops_do_what_the_firmware_did(found, name):
    """the firmware of August 2026 (commit 2a18fc29)."""
    check(recorded("crazyflie"), found, name)


@needs(C_COMPILER, CRAZYFLIE_TREE)
def test_a_million_samples_are_the_firmwares(tmp_path):
    asked = motion(4096, 250, seed=1)
    said, found = firmware(tmp_path, Path(os.environ["QUADSTEP_CRAZYFLIE"]), asked.given), ours(asked)
    for name in LOOPS:
        check(said, found, name)
    whole = said["mellinger"]
    assert ((whole > 0.0) & (whole < 65535.0)).mean() > 0.5  # most of them away from limits


def test_thrust_goes_before_turning():
    asked = crazyflie_thrusts((60000.0, 20000.0, 0.0, 0.0), (0, 1, 2, 3), False, 65535.0)
    assert list(asked) == pytest.approx([45535.0, 45535.0, 65535.0, 65535.0])
    left = crazyflie_thrusts((30000.0, 0.0, 0.0, 4000.0), (0, 1, 2, 3), False, 65535.0)
    right = crazyflie_thrusts((30000.0, 0.0, 0.0, 4000.0), (0, 1, 2, 3), True, 65535.0)
    assert list(left) == [26000.0, 34000.0, 26000.0, 34000.0]
    assert list(right) == [34000.0, 26000.0, 34000.0, 26000.0]


@pytest.mark.parametrize("law", [CrazyfliePid, CrazyflieMellinger])
def test_gains_do_not_follow_from_the_vehicle(law):
    small, large = (law.gains(load_preset(name).model()) for name in ("crazyflie", "x500"))
    assert small[:-1] == large[:-1]
    assert small.full_thrust < large.full_thrust


@pytest.mark.parametrize("law", [CrazyfliePid, CrazyflieMellinger])
@pytest.mark.parametrize("way", [(0.3, 0.0, 0.0), (0.0, 0.3, 0.0), (0.0, 0.0, 0.3)])
def test_it_goes_where_it_is_told_and_stays(law, way):
    end = [way[0], way[1], 1.0 + way[2]]
    path = {"type": "step", "start": [0.0, 0.0, 1.0], "end": end, "time": 1.0, "duration": 8.0}
    start = {"attitude": [0.4, 0.0, 0.0]}
    controller = {"type": law.name}
    flight = fly(Mission(vehicle={"preset": "crazyflie"}, path=path, controller=controller, start=start))
    assert flight.outcome is Outcome.COMPLETED
    went = flight.table("x", "y", "z")[-1] - [0.0, 0.0, 1.0]
    assert np.abs(went - way).max() < 0.05
    assert abs(flight.column("yaw")[-1]) < 0.05


@pytest.mark.parametrize("law", [CrazyfliePid, CrazyflieMellinger])
def test_six_rotors_are_refused(law):
    model = load_preset("crazyflie").model()
    with pytest.raises(UserError, match=f'"{law.name}": flies four rotors'):
        law.for_vehicle(model._replace(mixing=tuple(type(row)((*row, *row[:2])) for row in model.mixing)))
