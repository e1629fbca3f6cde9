"""PX4's cascade: the autopilot's own loops say the same, sample by sample, and its parameters mean what they mean there."""

import json
import math
import os
from pathlib import Path

import numpy as np
import pytest

from quadstep import Mission, fly
from quadstep.control.mixers import command_of_thrust, px4_missed, px4_mixer, thrust_of_command
from quadstep.control.px4_cascade import Px4Cascade, gyro_filters, hover_of, position_gains
from quadstep.control.px4_loops import STILL, MotionNow, attitude_loop, of_gyro, position_loop, thrust_of, within_speed
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.controller import Measured
from quadstep.interfaces.plant import Reference
from quadstep.linear.grade import SOUND, grade
from quadstep.mission.listings import load_preset
from quadstep.numbers import vector
from quadstep.numbers.rotations import normalised, yaw_pitch_roll
from tests.firmware_flights import recorded
from tests.needs import C_COMPILER, PX4_TREE, needs
from tests.px4_stock import LOOPS, firmware, motion, ours

FLOWN = Path(__file__).parent / "golden" / "px4_flight.json"
"""0.16 s of a circle that the real PX4 (main of May 2024) flew with preset `x500`, in this package's axes. Rows: position and
velocity as it estimated them, its setpoint's position, velocity, acceleration and heading, the thrust and attitude that it
wanted. After the first row: the filtered slope of the velocity [m/s^2] and the integral [m/s^2].
"""

NEAR = {
    "attitude": 5e-6, "rates": 0.0, "gyro": [1e-5, 1e-3], "position": 5e-6, "coupled": 5e-6,
    "mixer": 1e-6, "airmode1": 1e-6, "airmode2": 1e-6,
}  # fmt: skip
"""Differences allowed: none where both compute in f32; elsewhere f32 of rad/s, of rad/s and rad/s^2, of shares."""

RARE, FAR = 1e-4, 2e-3
"""Share of the numbers that may differ by more, and by how much: small differences of large f32 numbers, and choices that
both make, a bit apart, at a limit.
"""

MODEL = load_preset("x500").model()
ZERO = vector(0.0, 0.0, 0.0)
LEVEL = vector(1.0, 0.0, 0.0, 0.0)
HOVER = {"type": "step", "start": [0.0, 0.0, 2.0], "end": [0.0, 0.0, 2.0], "time": 0.1, "duration": 2.0}


def check(said, found, name):
    assert np.isfinite(said[name]).all()
    assert (np.abs(said[name] - found[name]) <= NEAR[name]).all()


@pytest.fixture(scope="module")
def found():
    return ours(motion(2, 40))


@pytest.mark.parametrize("name", LOOPS)
def test_loops_do_what_px4_did(found, name):
    """PX4 v1.15.4."""
    check(recorded("px4"), found, name)


@needs(C_COMPILER, PX4_TREE)
def test_a_million_samples_are_px4s(tmp_path):
    given = motion(4096, 250, seed=1)
    said, found = firmware(tmp_path, Path(os.environ["QUADSTEP_PX4"]), given), ours(given)
    for name in LOOPS:
        apart = np.abs(said[name] - found[name])
        assert (apart > NEAR[name]).mean() <= RARE * (name in ("attitude", "position", "coupled"))
        assert apart.max() < FAR
    outputs = said["mixer"][..., :4]
    assert 0.1 < ((outputs > 0.0) & (outputs < 1.0)).all(axis=2).mean() < 0.9  # within limits and beyond


def gains(**values):
    return Px4Cascade.gains(MODEL, values)


def measured(**values):
    still = {"position": ZERO, "velocity": ZERO, "attitude": LEVEL, "rates": ZERO, "thrust": 0.0, "torque": ZERO}
    return Measured(**{**still, **values})


def sampled(law, memory, g, now, wanted, count=1):
    for _ in range(count):
        memory = law.guide(memory, now, wanted, g, 0.0, 0.01)
        memory = law.attitude(memory, now, wanted, g, 0.0, 0.005)
        command, memory = law.law(memory, now, wanted, g, 0.0, 0.00125)
    return command, memory


def test_the_position_loop_says_what_px4_said_in_flight():
    said = json.loads(FLOWN.read_text(encoding="utf-8"))
    g = gains(MPC_THR_HOVER=0.4611, MPC_USE_HTE=0.0)
    first, *samples = said["samples"]
    own = Px4Cascade().start(measured(velocity=vector(*first[3:6])), g)
    own = own._replace(climbing=vector(*said["integral"]), slope=vector(*said["slope"]), begun=1.0)
    for sample in samples:
        position, velocity, *path, heading, thrust, attitude = np.split(sample, [3, 6, 9, 12, 15, 16, 19])
        wanted = Reference(*(vector(*one) for one in path), heading[0], 0.0)
        now = measured(position=vector(*position), velocity=vector(*velocity))
        own = Px4Cascade().guide(own, now, wanted, g, 0.0, 0.008)
        assert own.thrust == pytest.approx(np.linalg.norm(thrust), abs=1e-6)
        assert list(own.wanted) == pytest.approx(list(attitude), abs=2e-6)


def test_a_hover_is_a_hover_and_each_setpoint_turns_the_rotors_its_way():
    law, g = Px4Cascade(), gains()
    hover = math.sqrt(MODEL.mass * MODEL.gravity / (4.0 * MODEL.per_speed))
    here = Reference(ZERO, ZERO, ZERO, 0.0, 0.0)
    command, memory = sampled(law, law.start(measured(), g), g, measured(), here)
    assert list(command.speeds) == pytest.approx([hover] * 4)
    roll, pitch, yaw = MODEL.mixing[1:]
    for wanted, row, sign in (
        (here._replace(position=vector(1.0, 0.0, 0.0)), pitch, 1.0),
        (here._replace(position=vector(0.0, 1.0, 0.0)), roll, -1.0),
        (here._replace(yaw=0.3), yaw, 1.0),
        (here._replace(yaw_rate=0.3), yaw, 1.0),
    ):
        found, after = sampled(law, memory, g, measured(), wanted)
        assert sign * (row @ (found.speeds - command.speeds)) > 0.0
        assert yaw_pitch_roll(after.wanted)[0] == pytest.approx(wanted.yaw, abs=1e-9)
    found, after = sampled(law, memory, g, measured(), here._replace(position=vector(0.0, 0.0, 0.5)))
    assert all(one > hover for one in found.speeds)


def test_the_velocitys_slope_is_filtered_and_nothing_at_the_first_sample():
    law, g = Px4Cascade(), gains(MPC_VELD_LP=5.0)
    here = Reference(ZERO, ZERO, ZERO, 0.0, 0.0)
    start = law.start(measured(velocity=vector(1.0, 0.0, 0.0)), g)
    first = law.guide(start, measured(velocity=vector(2.0, 0.0, 0.0)), here, g, 0.0, 0.01)
    second = law.guide(first, measured(velocity=vector(2.5, 0.0, 0.0)), here, g, 0.01, 0.01)
    share = 2.0 * math.pi * 5.0 * 0.01
    assert list(first.slope) == [0.0, 0.0, 0.0]
    assert second.slope[0] == pytest.approx(50.0 * share / (1.0 + share))
    third = law.guide(second, measured(velocity=vector(2.5, 0.0, 0.0)), here, g, 0.02, 0.01)
    assert third.slope[0] == pytest.approx(second.slope[0] / (1.0 + share))


@pytest.mark.parametrize(("factor", "hover"), [(0.0, 0.679), (1.0, 0.461), (0.4, 0.4 * 0.461 + 0.6 * 0.679)])
def test_the_hovers_thrust_is_the_vehicles_within_the_estimators_range(factor, hover):
    assert hover_of(gains(THR_MDL_FAC=factor)) == pytest.approx(hover, abs=1e-3)
    assert hover_of(gains(THR_MDL_FAC=factor, HTE_THR_RANGE=0.01)) == pytest.approx(0.5 + math.copysign(0.01, hover - 0.5))
    assert hover_of(gains(THR_MDL_FAC=factor, MPC_USE_HTE=0.0)) == 0.5
    strong = {"full_speed": 2e4, "MPC_THR_HOVER": 0.1}
    assert hover_of(gains(**strong)) == pytest.approx(808.77 / 2e4, rel=1e-4)
    assert hover_of(gains(MPC_THR_HOVER=0.9, full_speed=2e3, HTE_THR_RANGE=0.05)) == 0.8
    assert hover_of(gains(MPC_THR_HOVER=0.9, full_speed=800.0)) == 0.9


@pytest.mark.parametrize("factor", [0.0, 0.3, 1.0])
def test_the_thrust_curve_is_undone(factor):
    for thrust in (0.0, 0.2, 0.7, 1.0):
        assert thrust_of_command(command_of_thrust(thrust, factor), factor) == pytest.approx(thrust)
    assert thrust_of_command(0.5, factor) == 0.5 - 0.25 * factor


def test_filters_that_are_switched_off_let_the_gyro_through_and_a_start_in_motion_rings_nothing():
    off = gyro_filters(gains(IMU_GYRO_CUTOFF=0.0, IMU_DGYRO_CUTOFF=0.0).filters, 0.00125)
    usual = gyro_filters(gains(IMU_GYRO_NF0_FRQ=90.0, IMU_GYRO_NF1_FRQ=150.0).filters, 0.00125)
    assert gyro_filters(gains(IMU_GYRO_CUTOFF=400.0).filters, 0.00125).smooth.on == 0.0  # half of 800 Hz
    assert gyro_filters(gains(IMU_GYRO_CUTOFF=399.0).filters, 0.00125).smooth.on == 1.0
    first = of_gyro(off, of_gyro(off, STILL, 1.0, 0.0, 0.00125), 1.5, 1.0, 0.00125)
    assert (first.rate, first.acceleration) == pytest.approx((1.5, 400.0))
    axis, begun = STILL, 0.0
    for _ in range(5):
        axis, begun = of_gyro(usual, axis, 2.0, begun, 0.00125), 1.0
        assert axis.rate == pytest.approx(2.0)
        assert abs(axis.acceleration) < 1e-9


@pytest.mark.parametrize(("limit", "tilt"), [(30.0, 30.0), (120.0, 89.0)])
def test_a_thrust_leans_as_far_as_its_limit_and_keeps_its_direction(limit, tilt):
    x, y, up = thrust_of(position_gains(gains(MPC_TILTMAX_AIR=limit)), vector(900.0, -1200.0, 0.0))
    assert math.degrees(math.atan2(math.hypot(x, y), up)) == pytest.approx(tilt)
    assert (x / y, up) == pytest.approx((-0.75, hover_of(gains())))


@pytest.mark.parametrize("seed", range(4))
def test_an_attitude_and_its_negative_are_the_same_attitude(seed):
    random = np.random.default_rng(seed)
    attitude, wanted = (normalised(vector(*random.normal(size=4).tolist())) for _ in range(2))
    weak, fast = vector(6.5, 6.5, 2.8), vector(99.0, 99.0, 99.0)
    asked = attitude_loop(weak, 0.4, fast, wanted, attitude, 0.1)
    assert list(attitude_loop(weak, 0.4, fast, wanted, -1.0 * attitude, 0.1)) == pytest.approx(list(asked))
    assert list(attitude_loop(weak, 0.4, fast, -1.0 * wanted, attitude, 0.1)) == pytest.approx(list(asked))


@pytest.mark.parametrize("seed", range(4))
def test_a_velocity_beyond_its_limit_gives_up_its_second_part_first(seed):
    first, second = (vector(*row, 0.0) for row in np.random.default_rng(seed).normal(size=(2, 2)))
    size = math.hypot(first[0], first[1])
    assert within_speed(first, second, 9.0) == pytest.approx((first[0] + second[0], first[1] + second[1]))
    assert within_speed(first, first, 0.5 * size) == pytest.approx((0.5 * first[0], 0.5 * first[1]))
    x, y = within_speed(first, 9.0 * second, 1.1 * size)
    assert math.hypot(x, y) == pytest.approx(1.1 * size)
    assert math.atan2(y - first[1], x - first[0]) == pytest.approx(math.atan2(second[1], second[0]))


@pytest.mark.parametrize(
    ("height", "acceleration", "grows"),
    [(0.1, 0.0, 1), (-0.1, 0.0, -1), (50.0, 0.0, 0), (-0.1, 30.0, -1), (0.1, 30.0, 0), (0.1, -30.0, 1), (-0.1, -30.0, 0)],
)
def test_the_integral_of_the_climb_stands_where_thrust_is_at_the_limit_that_it_pushes_against(height, acceleration, grows):
    up = vector(0.0, 0.0, 1.0)
    wanted = Reference(height * up, ZERO, acceleration * up, 0.0, 0.0)
    _, integral = position_loop(position_gains(gains()), ZERO, MotionNow(ZERO, ZERO, ZERO), wanted, 0.01)
    assert np.sign(integral[2]) == grows


def test_torques_that_the_rotors_miss_are_told_by_their_sign():
    by = px4_mixer(MODEL).torques
    full = vector(1.0, 1.0, 1.0, 1.0)
    assert list(px4_missed(by, vector(0.3, -0.2, 0.0), full)) == [1.0, -1.0, 0.0]
    assert list(px4_missed(by, vector(1e-4, 0.0, 0.0), full)) == [0.0, 0.0, 0.0]


def test_the_tutorials_circle_is_flown_and_the_loop_is_sound():
    circle = {"type": "circle", "centre": [0.0, 0.0, 2.0], "radius": 2.0, "period": 8.0}
    mission = Mission(vehicle={"preset": "x500"}, path=circle, controller={"type": "px4-cascade"})
    assert (mission.simulation.step, mission.simulation.control_period) == (0.001, 0.001)
    assert mission.simulation.loop_periods == {"attitude": 0.005}
    flight = fly(mission)
    assert flight.outcome is Outcome.COMPLETED
    assert flight.metrics()["position_rmse[m]"] < 0.3
    found = grade(Mission(vehicle={"preset": "x500"}, path=HOVER, controller={"type": "px4-cascade"}))
    assert found.word == SOUND


def test_gains_do_not_follow_from_the_vehicle_but_its_motors_and_mixer_do():
    small, large = (Px4Cascade.gains(load_preset(name).model()) for name in ("crazyflie", "x500"))
    assert small[:4] == large[:4]
    assert small.full_speed > large.full_speed
    assert [abs(one) for row in large.mixer.outputs for one in row] == pytest.approx([0.5**0.5, 0.5**0.5, 1.0, 1.0] * 4)
