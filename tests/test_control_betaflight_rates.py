"""Betaflight's rate loop: the firmware's own code says the same to the bit, sample by sample, and vehicles fly with it."""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from quadstep import Mission, fly
from quadstep.control.betaflight_rates import BetaflightRates, MixerState, filtered, mix, still, throttle_for
from quadstep.control.filters import cut_off, low_passed, notch
from quadstep.identify.logs.read import read_topics
from quadstep.interfaces.closed_loop import Outcome
from quadstep.io.errors import UserError
from quadstep.mission.listings import load_preset
from quadstep.numbers import Vector
from tests.betaflight_flight import GUSTY, real_flight
from tests.betaflight_stock import BLACKBOX, CASES, LOGGED, compiled, firmware, gains, in_flight, motion, ours
from tests.needs import BETAFLIGHT_SITL, BETAFLIGHT_TREE, C_COMPILER, needs

RECORDED = Path(__file__).parent / "golden" / "betaflight_stock.json"
"""What Betaflight 4.5 (maintenance branch, commit 0455ec94) made of `motion(2, 40)`."""

FLOWN = Path(__file__).parent / "golden" / "betaflight_flight.json"
"""`BLACKBOX`, its first seven in tenths, of 0.9 s of a circle in gusts, flown by the simulator of that commit under `fly
--autopilot betaflight`.
"""

PERIOD = 0.001

NEAR = {"biquads": (6e-3, 1e-5)}
"""Differences allowed: of outputs, up to 3,400 in size, and of motors: Betaflight has a sine of its own. Else none."""


def check(said, found, case):
    assert np.isfinite(said).all()
    output, motor = NEAR.get(case, (0.0, 0.0))
    assert np.abs(said[..., :3] - found[..., :3]).max() <= output
    assert np.abs(said[..., 3:] - found[..., 3:]).max() <= motor


@pytest.mark.parametrize("case", CASES)
def test_loop_and_mixer_do_what_the_firmware_did(case):
    said = np.array(json.loads(RECORDED.read_text(encoding="utf-8"))[case], np.float32)
    check(said, ours(case, motion(2, 40)), case)


@needs(C_COMPILER, BETAFLIGHT_TREE)
def test_a_million_samples_are_the_firmwares(tmp_path):
    library, given = compiled(tmp_path, Path(os.environ["QUADSTEP_BETAFLIGHT"])), motion(4096, 250, seed=1)
    for case in CASES:
        said = firmware(library, case, given)
        check(said, ours(case, given), case)
        assert ((said[..., 3:] > 0.06) & (said[..., 3:] < 0.999)).mean() > 0.5  # most of them away from limits


def check_flight(rows):
    """A sum is of three whole numbers, each up to 0.5 off, and of the I part that ours began with, 0.5 off too; rates are
    logged to 0.05 deg/s, of which P and D make up to 0.4, and I a little that stays, most about yaw.
    """
    logged, found = in_flight(rows)
    apart = np.abs(logged - found)
    assert (apart.max(axis=0) < [2.4, 2.4, 2.4, 1.2, 1.2, 1.9, 2.8, 2.8, 2.8, 2.8]).all(), apart.max(axis=0)
    assert (np.sqrt(np.mean(np.square(apart[:, :2]), axis=0)) < 0.8).all()
    assert logged[:, :6].std(axis=0).min() > 1.0  # it had something to do


def test_in_flight_it_does_what_the_firmware_logged():
    rows = np.array(json.loads(FLOWN.read_text(encoding="utf-8")), float)
    rows[:, :7] /= 10.0
    check_flight(rows)


@needs(BETAFLIGHT_SITL)
def test_a_whole_flight_under_the_real_betaflight_is_as_it_logged(tmp_path):
    pytest.importorskip("betaflight_chirp_core")
    assert real_flight(tmp_path, GUSTY, LOGGED).returncode == 0
    columns = read_topics(tmp_path / "blackbox.bbl", [f"main.{name}" for name in BLACKBOX]).columns
    rows = np.stack([columns[f"main.{name}"].value for name in BLACKBOX], axis=1)[3000:]  # from then on it is in the air
    assert len(rows) > 8000
    check_flight(rows)


def gain_at(hertz, filter_of, states):
    """Of a filter [-], for a sine."""
    memory, most = Vector([0.0] * states), 0.0
    for i in range(2000):
        made, memory = filter_of(memory, float(np.sin(2.0 * np.pi * hertz * PERIOD * i)))
        most = max(most, abs(made)) if i > 1000 else most
    return most


@pytest.mark.parametrize("kind", range(4))
def test_a_low_pass_damps_by_3_db_at_its_cut_off(kind):
    assert gain_at(20.0, lambda memory, value: low_passed(float(kind), 20.0, memory, value, PERIOD), 3) == pytest.approx(
        np.sqrt(0.5), rel=0.08
    )
    assert gain_at(1.0, lambda memory, value: low_passed(float(kind), 20.0, memory, value, PERIOD), 3) > 0.99
    assert low_passed(float(kind), 0.0, Vector([0.1] * 3), 3.0, PERIOD)[0] == 3.0


def test_a_notch_stops_its_centre_and_damps_by_3_db_at_its_edge():
    assert gain_at(100.0, lambda memory, value: notch(100.0, 70.0, memory, value, PERIOD), 2) < 0.01
    assert gain_at(70.0, lambda memory, value: notch(100.0, 70.0, memory, value, PERIOD), 2) == pytest.approx(0.71, abs=0.06)
    assert notch(0.0, 0.0, Vector([0.1] * 2), 3.0, PERIOD)[0] == 3.0


def test_a_dynamic_cut_off_goes_with_throttle():
    assert cut_off(90.0, 0.0, 150.0, 5.0, 0.5) == 90.0
    assert [cut_off(90.0, 75.0, 150.0, 5.0, one) for one in (0.0, 0.5, 1.0)] == [75.0, 121.875, 150.0]
    assert cut_off(90.0, 75.0, 150.0, 0.0, 0.5) == pytest.approx(0.6875 * 150.0)


def test_the_gyro_is_filtered_as_its_settings_say():
    f = gains("defaults").filters._replace(gyro2=0.0, notch=0.0, gyro_least=0.0, gyro1=0.0)
    assert filtered(f, still(), 5.0, 0.5, PERIOD)[0] == 5.0
    for change in ({"gyro2": 100.0}, {"gyro1": 100.0}, {"gyro_least": 100.0, "gyro_most": 100.0}):
        assert filtered(f._replace(**change), still(), 5.0, 0.5, PERIOD)[0] == pytest.approx(5.0 * 0.3859, rel=1e-3)
    assert filtered(f._replace(notch=200.0, notch_cut=140.0), still(), 5.0, 0.5, PERIOD)[0] == pytest.approx(3.72, abs=0.03)


def test_each_axis_is_turned_by_the_rotors_that_turn_it():
    """The body's axes: roll lifts the left, pitch the back, yaw the rotors that spin clockwise."""
    own = gains("defaults").shared
    for place, faster in enumerate(({2, 3}, {1, 2}, {1, 3})):
        outputs = tuple(100.0 * (place == axis) for axis in range(3))
        motors, _ = mix(own, rested(0.5), outputs, 0.5, False, PERIOD)
        assert {i for i, one in enumerate(motors) if one > np.mean(motors)} == faster
    mirrored, _ = mix(own, rested(0.5), (0.0, 0.0, 100.0), 0.5, True, PERIOD)
    assert {i for i, one in enumerate(mirrored) if one > np.mean(mirrored)} == {0, 2}


def rested(throttle):
    """A mixer that has been still."""
    return MixerState(throttle, 0.0, Vector([0.0] * 2), throttle)


def test_a_throttle_makes_the_thrust_that_is_asked():
    own = gains("defaults").shared
    for thrust in (4.0, 20.0, 30.0):
        throttle = throttle_for(own, thrust, 8.0)
        motors, _ = mix(own, rested(throttle), (0.0, 0.0, 0.0), throttle, False, PERIOD)
        assert sum(8.0 * one * one for one in motors) == pytest.approx(thrust)


@pytest.mark.parametrize("vehicle", ["crazyflie", pytest.param("x500", marks=pytest.mark.thorough)])
def test_it_goes_where_it_is_told_and_stays(vehicle):
    path = {"type": "step", "start": [0.0, 0.0, 1.0], "end": [0.3, -0.3, 1.3], "time": 0.5, "duration": 4.0, "yaw": 0.5}
    flight = fly(Mission(vehicle={"preset": vehicle}, path=path, controller={"type": "betaflight-rates"}))
    assert flight.outcome is Outcome.COMPLETED
    assert np.abs(flight.table("x", "y", "z")[-1] - [0.3, -0.3, 1.3]).max() < 0.05
    assert flight.column("yaw")[-1] == pytest.approx(0.5, abs=0.05)


def test_gains_do_not_follow_from_the_vehicle_and_six_rotors_are_refused():
    small, large = (BetaflightRates.gains(load_preset(name).model()) for name in ("crazyflie", "x500"))
    assert small[1:-1] == large[1:-1]
    model = load_preset("crazyflie").model()
    with pytest.raises(UserError, match='"betaflight-rates": flies four rotors'):
        BetaflightRates.for_vehicle(model._replace(mixing=tuple(type(row)((*row, *row[:2])) for row in model.mixing)))


def test_motors_without_a_range_are_refused():
    path = {"type": "step", "end": [0.0, 0.0, 1.0], "time": 0.1, "duration": 0.5}
    controller = {"type": "betaflight-rates", "motor_output_limit": 5.5}
    with pytest.raises(UserError, match=r"motors have no range: dshot_idle_value is 5.5 %, motor_output_limit 5.5 %"):
        Mission(vehicle={"preset": "x500"}, path=path, controller=controller).plan()
