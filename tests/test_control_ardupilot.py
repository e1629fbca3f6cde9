"""ArduPilot's cascade: the autopilot's own loops say the same, and its parameters mean what they mean there."""

import json
import math
import os
from pathlib import Path

import numpy as np
import pytest

from quadstep import Mission, fly
from quadstep.control.ardupilot_cascade import (
    ArduPilotCascade,
    across_first,
    attitude_gains,
    command_of,
    filtered,
    horizontal,
    hover_of,
    outer,
    vertical,
)
from quadstep.control.ardupilot_loops import (
    IntegratorLimits,
    PidGains,
    PidMemory,
    Target,
    attitude_error,
    attitude_loop,
    pid,
    root,
    rooted,
    shaped_target,
    turned,
    within_rates,
)
from quadstep.control.mixers import ardupilot_mixed
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.controller import Measured
from quadstep.interfaces.plant import Reference
from quadstep.linear.grade import SOUND, grade
from quadstep.mission.listings import load_preset
from quadstep.numbers import Matrix, vector
from quadstep.numbers.rotations import from_rotation_vector, from_yaw_pitch_roll, multiply, normalised, yaw_pitch_roll
from tests.ardupilot_stock import LOOPS, firmware, motion, ours
from tests.firmware_flights import recorded
from tests.needs import ARDUPILOT_TREE, C_COMPILER, needs

FLOWN = Path(__file__).parent / "golden" / "ardupilot_flight.json"
"""0.2 s of a circle in a wind that the real ArduCopter (4.7.0-dev of October 2025) flew with preset `x500`, in this package's
axes. Rows: the period, position, velocity and vertical acceleration as it had them, its setpoint's position, velocity and
acceleration, the horizontal acceleration [m/s^2] and the throttle beyond the hover that it wanted. Before the first row: the
error, slope and integral of the horizontal velocity; filtered target, error, slope and integral of the two vertical loops.
"""

NEAR = {**dict.fromkeys(LOOPS, 0.0), "all": 2e-6, "climb": 1e-5, "cascade": 2.5e-3, "limited": 2.5e-3}
"""Differences allowed: none, but where an integral next to zero is zero there, or terms are added in another order. The
cascade is in f64 here: an angle of which the cosine is rounded to f32 is known to 3.5e-4 rad at 0, and counts 4.5 times.
"""

MOSTLY = 1e-5
"""Of the cascade, on 99 % of the numbers."""

MODEL = load_preset("x500").model()
LAW = ArduPilotCascade()
ZERO = vector(0.0, 0.0, 0.0)
LEVEL = vector(1.0, 0.0, 0.0, 0.0)
GRAVITY = 9.80665
HERE = Reference(ZERO, ZERO, ZERO, 0.0, 0.0)
PERIOD = 0.002


def check(said, found, name):
    assert np.isfinite(said[name]).all()
    apart = np.abs(said[name] - found[name])
    assert (apart <= NEAR[name]).all()
    assert np.quantile(apart, 0.99) <= MOSTLY


@pytest.fixture(scope="module")
def found():
    return ours(motion(2, 40))


@pytest.mark.parametrize("name", LOOPS)
def test_loops_do_what_ardupilot_did(found, name):
    """ArduPilot Copter: 4.6, and 4.7.0-dev of October 2025 of what goes through the cascade."""
    check(recorded("ardupilot"), found, name)


@needs(C_COMPILER, ARDUPILOT_TREE)
def test_a_million_samples_are_ardupilots(tmp_path):
    given = motion(4096, 250, seed=1)
    said, found = firmware(tmp_path, Path(os.environ["QUADSTEP_ARDUPILOT"]), given), ours(given)
    for name in LOOPS:
        check(said, found, name)
    assert 0.2 < said["mixer"][..., 4].mean() < 0.8  # within limits and beyond


def test_the_position_loops_say_what_ardupilot_said_in_flight():
    """Its log tells accelerations to f32, and integrals grow in f32 there."""
    said = json.loads(FLOWN.read_text(encoding="utf-8"))
    g = gains(MOT_HOVER_LEARN=0.0, MOT_THST_HOVER=0.4611, MOT_SPIN_MIN=0.0, MOT_SPIN_MAX=1.0, MOT_THST_EXPO=1.0)
    push = Matrix([vector(*one) for one in said["push"]] + [vector(0.0, 0.0)])
    memory = begun(g, push=push, climb=PidMemory(*said["climb"]), acceleration=PidMemory(*said["acceleration"]))
    for sample in said["samples"]:
        (period,), position, velocity, (up,), *path, pushed, (throttle,) = np.split(sample, [1, 4, 7, 8, 11, 14, 17, 19])
        wanted = Reference(*(vector(*one) for one in path), 0.0, 0.0)
        now = measured(position=vector(*position), velocity=vector(*velocity))
        made, push = horizontal(g, memory, now, wanted, period)
        lift, climb, acceleration = vertical(g, memory, now, wanted, up, period)
        assert list(made) == pytest.approx(list(pushed), abs=1e-6)
        assert lift - hover_of(g) == pytest.approx(throttle, abs=1e-7)
        memory = memory._replace(push=push, climb=climb, acceleration=acceleration)


def gains(**values):
    return ArduPilotCascade.gains(MODEL, values)


def measured(**values):
    still = {"position": ZERO, "velocity": ZERO, "attitude": LEVEL, "rates": ZERO, "thrust": 0.0, "torque": ZERO}
    return Measured(**{**still, "specific_force": vector(0.0, 0.0, GRAVITY), **values})


def begun(g, **values):
    return LAW.start(measured(), g)._replace(begun=1.0, **values)


def sampled(memory, g, now, wanted, count=1):
    for _ in range(count):
        command, memory = LAW.law(memory, now, wanted, g, 0.0, PERIOD)
    return command, memory


def test_a_hover_is_a_hover_and_each_setpoint_turns_the_rotors_its_way():
    g = gains()
    hover = math.sqrt(MODEL.mass * MODEL.gravity / (4.0 * MODEL.per_speed))
    command, memory = sampled(LAW.start(measured(), g), g, measured(), HERE, 3)
    assert list(command.speeds) == pytest.approx([hover] * 4, rel=1e-6)
    roll, pitch, yaw = MODEL.mixing[1:]
    for wanted, row, sign in (
        (HERE._replace(position=vector(1.0, 0.0, 0.0)), pitch, 1.0),
        (HERE._replace(velocity=vector(0.0, 1.0, 0.0)), roll, -1.0),
        (HERE._replace(acceleration=vector(0.0, 1.0, 0.0)), roll, -1.0),
        (HERE._replace(yaw=0.3), yaw, 1.0),
        (HERE._replace(yaw_rate=0.3), yaw, 1.0),
    ):
        found, _ = sampled(memory, g, measured(), wanted, 5)
        assert sign * (row @ (found.speeds - command.speeds)) > 0.0
    found, _ = sampled(memory, g, measured(), HERE._replace(position=vector(0.0, 0.0, 0.5)), 5)
    assert all(one > hover for one in found.speeds)


@pytest.mark.parametrize(
    ("roll", "yaw", "throttle", "limits"),
    [
        (0.0, 0.0, 0.05, (0, 0, 0, 0)),
        (0.0, 0.0, 0.0, (0, 0, 0, 1)),
        (0.0, 0.0, 1.0, (0, 0, 1, 0)),
        (0.6, 0.0, 0.6, (0, 0, 0, 0)),
        (0.6, 0.0, 0.9, (0, 0, 1, 0)),  # the faster rotors are full
        (0.6, 0.9, 0.5, (0, 1, 0, 0)),  # what roll leaves is too little for the yaw
        (3.0, 0.0, 0.8, (1, 1, 1, 0)),
        (3.0, 0.0, 0.3, (1, 1, 0, 0)),
    ],
)
def test_the_mixer_tells_the_loops_what_it_could_not_give(roll, yaw, throttle, limits):
    made = ardupilot_mixed(gains().factors, vector(roll, 0.0, yaw), throttle, 0.5, 0.2)
    assert (made.tilting, made.turning, made.upper, made.lower) == limits
    assert all(-1e-12 <= one <= 1.0 + 1e-12 for one in made.thrusts)


@pytest.mark.parametrize("seed", range(3))
def test_an_attitudes_error_is_the_shortest_tilt_and_then_the_heading(seed):
    random = np.random.default_rng(seed)
    attitude, wanted = (normalised(vector(*random.normal(size=4))) for _ in range(2))
    found = attitude_error(attitude, wanted)
    back = multiply(multiply(attitude, found.tilt), from_rotation_vector(vector(0.0, 0.0, found.error[2])))
    assert abs(back @ wanted) == pytest.approx(1.0)
    tilt = from_rotation_vector(vector(found.error[0], found.error[1], 0.0))
    assert abs(tilt @ found.tilt) == pytest.approx(1.0)
    assert found.angle == pytest.approx(math.hypot(found.error[0], found.error[1]))
    over = attitude_error(attitude, multiply(attitude, vector(0.0, 0.6, 0.8, 0.0)))  # upside down: no turn is the shortest
    assert (over.angle, math.hypot(*over.error[:2])) == pytest.approx((math.pi, math.pi))


def test_rates_are_asked_for_in_proportion_near_the_target_and_yaw_gives_way_far_from_it():
    g = attitude_gains(gains(ATC_ANG_RLL_P=6.0, ATC_ANG_YAW_P=3.0))
    rates = vector(0.0, 0.0, 0.7)
    target = Target(from_yaw_pitch_roll(vector(0.01, 0.02, 0.03)), ZERO)
    asked, kept = attitude_loop(g, target, LEVEL, rates, PERIOD)
    assert list(asked) == pytest.approx([6.0 * 0.03, 4.5 * 0.02, 3.0 * 0.01], rel=0.05)
    assert list(kept.attitude) == pytest.approx(list(target.attitude))
    fed, _ = attitude_loop(g, target._replace(rates=vector(0.1, 0.2, 0.3)), LEVEL, rates, PERIOD)
    assert list(fed - asked) == pytest.approx([0.1, 0.2, 0.3], abs=0.02)
    for angle, part in ((0.4, 1.0), (math.radians(45.0), 0.5), (1.2, 0.0)):
        tilted = Target(from_rotation_vector(vector(angle, 0.0, 0.0)), vector(0.3, 0.0, 0.0))
        asked, _ = attitude_loop(g, tilted, LEVEL, rates, PERIOD)
        still, _ = attitude_loop(g, tilted._replace(rates=ZERO), LEVEL, rates, PERIOD)
        assert (asked - still)[0] == pytest.approx(0.3 * part)
        assert asked[2] == pytest.approx(0.7 * (1.0 - part))


def test_a_heading_out_of_reach_pulls_its_target_along():
    g = attitude_gains(gains())
    target = Target(from_yaw_pitch_roll(vector(2.0, 0.0, 0.0)), ZERO)
    _, kept = attitude_loop(g, target, LEVEL, ZERO, PERIOD)
    assert yaw_pitch_roll(kept.attitude)[0] == pytest.approx(math.radians(45.0))
    leaning = from_yaw_pitch_roll(vector(0.4, -0.5, 0.7))
    before = attitude_error(leaning, target.attitude).error
    _, kept = attitude_loop(g, target, leaning, ZERO, PERIOD)
    after = attitude_error(leaning, kept.attitude).error  # its tilt is not touched
    assert list(after) == pytest.approx([before[0], before[1], math.copysign(math.radians(45.0), before[2])])
    slow = attitude_gains(gains(ATC_RAT_YAW_P=2.0, ATC_ACCEL_Y_MAX=1000.0))
    _, kept = attitude_loop(slow, target, LEVEL, ZERO, PERIOD)  # 1/2 rad/s is stopped with 10 deg/s^2
    reach = 0.5 * math.radians(10.0) / 4.5**2 + 0.25 / (2.0 * math.radians(10.0))
    assert yaw_pitch_roll(kept.attitude)[0] == pytest.approx(min(reach, math.radians(45.0)))


def test_the_target_turns_as_fast_as_it_may_and_arrives():
    g = attitude_gains(gains(ATC_ACCEL_R_MAX=18000.0, ATC_RATE_R_MAX=40.0, ATC_RATE_P_MAX=40.0))
    wanted, target, rates = from_rotation_vector(vector(0.6, 0.0, 0.0)), Target(LEVEL, ZERO), [0.0]
    for _ in range(1500):
        target = turned(shaped_target(g, target, wanted, 0.0, PERIOD), PERIOD)
        rates.append(target.rates[0])
    assert max(rates) == pytest.approx(math.radians(40.0))
    assert np.abs(np.diff(rates)).max() == pytest.approx(PERIOD * math.pi)
    assert abs(target.attitude @ wanted) == pytest.approx(1.0, abs=1e-9)
    both = attitude_gains(gains(ATC_RATE_R_MAX=40.0, ATC_RATE_P_MAX=20.0))
    fast = shaped_target(both, Target(LEVEL, ZERO), from_rotation_vector(vector(0.0, 2.0, 0.0)), 0.0, 1.0)
    assert fast.rates[1] == pytest.approx(math.radians(20.0))
    off = attitude_gains(gains(ATC_RATE_FF_ENAB=0.0))
    plain = shaped_target(off, Target(LEVEL, vector(1.0, 1.0, 1.0)), wanted, 0.5, PERIOD)
    assert (list(plain.attitude), list(plain.rates)) == (list(wanted), [0.0, 0.0, 0.0])
    turning = shaped_target(attitude_gains(gains(ATC_SLEW_YAW=3000.0)), Target(LEVEL, ZERO), LEVEL, 5.0, 10.0)
    assert turning.rates[2] == pytest.approx(math.radians(30.0))


def test_rates_are_limited_in_an_ellipse_or_alone():
    rates = vector(3.0, 4.0, 2.0)
    assert list(within_rates(rates, vector(0.0, 0.0, 0.0))) == [3.0, 4.0, 2.0]
    assert list(within_rates(rates, vector(1.0, 0.0, 1.0))) == [1.0, 4.0, 1.0]
    assert list(within_rates(rates, vector(0.0, 1.0, 3.0))) == [3.0, 1.0, 2.0]
    assert list(within_rates(rates, vector(2.5, 2.5, 0.0))) == pytest.approx([1.5, 2.0, 2.0])
    for least in (vector(0.05, 0.0, 0.05), vector(0.0, 0.05, 0.05)):  # ArduPilot: none only below f32's epsilon
        assert list(within_rates(rates, least)) == [one or rate for one, rate in zip(least, rates, strict=True)]
    assert list(within_rates(rates, vector(0.05, 0.05, 0.05))) == pytest.approx([0.03, 0.04, 0.05])


def test_small_cut_offs_are_cut_offs_and_pdmx_bounds_the_sum_of_p_and_d():
    plain = PidGains(
        p=2.0, i=0.0, d=0.1, ff=0.0, d_ff=0.0, most=1.0, most_pd=0.0, target_cut=0.0, error_cut=0.0, slope_cut=0.0
    )
    memory, free = PidMemory(0.3, 0.1, 0.5, 0.0), IntegratorLimits(0.0, 0.0)

    def after(g, target=0.4, measured=0.2):
        return pid(g, memory, target, measured, free, 1.0, PERIOD)

    for cut in (0.05, 30.0):
        share = PERIOD / (PERIOD + 1.0 / (2.0 * math.pi * cut))
        assert after(plain._replace(target_cut=cut))[2].target == pytest.approx(0.3 + share * 0.1, rel=1e-12)
        assert after(plain._replace(error_cut=cut))[2].error == pytest.approx(0.1 + share * 0.1, rel=1e-12)
        assert after(plain._replace(slope_cut=cut))[2].slope == pytest.approx(0.5 + share * (0.1 / PERIOD - 0.5), rel=1e-12)
    assert after(plain)[0] == pytest.approx(2.0 * 0.2 + 0.1 * 50.0)
    for most in (0.05, 3.0):
        assert after(plain._replace(most_pd=most))[0] == pytest.approx(most)
        assert after(plain._replace(most_pd=most), 0.2, 0.4)[0] == pytest.approx(-most)
    against = plain._replace(d=-0.02, most_pd=0.7)  # parts of 0.4 and -1: only their sum of -0.6 counts
    assert after(against)[0] == pytest.approx(-0.6)
    assert after(plain._replace(most_pd=9.0))[0] == pytest.approx(5.4)


@pytest.mark.parametrize(("expo", "low", "high"), [(0.65, 0.15, 0.95), (1.0, 0.0, 1.0), (0.0, 0.0, 1.0)])
def test_the_hovers_throttle_is_the_vehicles_within_what_is_learnt(expo, low, high):
    g = gains(MOT_THST_EXPO=expo, MOT_SPIN_MIN=low, MOT_SPIN_MAX=high)
    assert command_of(g.motors, hover_of(g)) == pytest.approx(g.hover_speed / g.full_speed)
    assert (command_of(g.motors, 0.0), command_of(g.motors, 1.5)) == pytest.approx((low, high))
    assert hover_of(gains(MOT_HOVER_LEARN=0.0, MOT_THST_HOVER=0.3)) == 0.3
    assert hover_of(gains(full_speed=800.0)) == 0.6875
    assert hover_of(gains(full_speed=4000.0)) == 0.125


def test_corrections_are_slow_enough_to_stop_and_no_faster_than_said():
    g = gains(WPNAV_SPEED=200.0, WPNAV_ACCEL=100.0, PSC_VELXY_D=0.0, PSC_VELXY_I=0.0, ANGLE_MAX=8000.0)
    far = HERE._replace(position=vector(30.0, 40.0, 0.0))
    made, _ = horizontal(g, begun(g, push=Matrix([vector(0.0, 0.0)] * 4)), measured(), far, 1e9)
    assert list(made) == pytest.approx([2.0 * 1.2, 2.0 * 1.6])
    near, _ = horizontal(g, begun(g), measured(), HERE._replace(position=vector(0.3, 0.0, 0.0)), 1e9)
    assert near[0] == pytest.approx(2.0 * 0.3)
    assert list(rooted(vector(3.0, 4.0), 1.0, 2.0)) == pytest.approx([0.6 * root(5.0, 1.0, 2.0), 0.8 * root(5.0, 1.0, 2.0)])


def test_velocity_errors_are_filtered_and_integrated_but_not_into_the_leans_limit():
    g = gains()
    wanted = HERE._replace(velocity=vector(1.0, 0.0, 0.0))
    share = PERIOD / (PERIOD + 1.0 / (2.0 * math.pi * 5.0))
    made, (error, slope, integral, beyond) = horizontal(g, begun(g), measured(), wanted, PERIOD)
    assert error[0] == pytest.approx(share)
    assert slope[0] == pytest.approx(share * share / PERIOD)
    assert integral[0] == pytest.approx(share * PERIOD)
    assert made[0] == pytest.approx(2.0 * error[0] + integral[0] + 0.25 * slope[0])
    assert list(beyond) == [0.0, 0.0]
    _, (error, slope, _, _) = horizontal(g, begun(g)._replace(begun=0.0), measured(), wanted, PERIOD)
    assert (error[0], slope[0]) == (1.0, 0.0)
    full = vector(6.0, 0.0)
    limited = Matrix([vector(5.0, 0.0), vector(0.0, 0.0), full, vector(9.0, 0.0)])
    made, (_, _, integral, beyond) = horizontal(g, begun(g, push=limited), measured(), wanted, PERIOD)
    assert integral[0] == pytest.approx(6.0)
    assert made[0] == pytest.approx(GRAVITY * math.tan(math.radians(30.0)))
    assert beyond[0] > made[0]
    free = Matrix([vector(5.0, 0.0), vector(0.0, 0.0), full, vector(0.0, 0.0)])
    assert horizontal(g, begun(g, push=free), measured(), wanted, PERIOD)[1][2, 0] > 6.0
    low = begun(g)._replace(lean=0.1)
    assert horizontal(g, low._replace(push=limited), measured(), wanted, PERIOD)[0][0] == pytest.approx(
        GRAVITY * math.tan(0.1)
    )


def test_what_is_across_the_path_is_kept_first():
    assert list(across_first(vector(3.0, 4.0), vector(0.0, 0.0), 2.5)) == pytest.approx([1.5, 2.0])
    assert list(across_first(vector(9.0, 3.0), vector(2.0, 0.0), 5.0)) == pytest.approx([4.0, 3.0])
    assert list(across_first(vector(9.0, 7.0), vector(2.0, 0.0), 5.0)) == pytest.approx([0.0, 5.0])
    assert list(across_first(vector(1.0, 2.0), vector(2.0, 0.0), 5.0)) == [1.0, 2.0]


def test_height_is_corrected_within_its_speeds_and_throttle_follows_the_acceleration():
    g = gains(PSC_ACCZ_I=0.0, PSC_VELZ_FLTE=0.0, PSC_ACCZ_FLTE=0.0)
    hover = hover_of(g)

    def throttle(reference, up=0.0, **memory):
        return vertical(g, begun(g, **memory), measured(), reference, up, PERIOD)

    for height, speed in ((50.0, 2.5), (-50.0, -1.5), (0.2, 0.2), (-0.2, -0.2)):
        lift, climb, _ = throttle(HERE._replace(position=vector(0.0, 0.0, height)))
        assert climb.error == pytest.approx(speed)
        assert lift - hover == pytest.approx(0.05 * 5.0 * speed)
    assert throttle(HERE._replace(acceleration=vector(0.0, 0.0, 1.0)), up=1.0)[0] == pytest.approx(hover)
    assert throttle(HERE, up=-1.0)[0] == pytest.approx(hover + 0.05)
    integrating = gains(PSC_VELZ_I=1.0)
    above = HERE._replace(position=vector(0.0, 0.0, 1.0))
    for limits, grows in (((0.0, 0.0), True), ((1.0, 0.0), False), ((0.0, 1.0), True)):
        memory = begun(integrating, limits=vector(0.0, 0.0, *limits))
        _, climb, acceleration = vertical(integrating, memory, measured(), above, 0.0, PERIOD)
        assert (climb.integral > 0.0) == grows
        assert (acceleration.integral > 0.0) == (limits == (0.0, 0.0))


def test_leaning_takes_more_throttle_and_a_limit_of_the_lean_keeps_the_height():
    g = gains()
    tilted = from_rotation_vector(vector(0.5, 0.0, 0.0))
    force = vector(0.0, GRAVITY * math.sin(0.5), GRAVITY * math.cos(0.5))
    fresh = begun(g)._replace(begun=0.0)  # filters begin at what is felt
    leaning, tilting = fresh._replace(level=math.cos(0.5)), measured(attitude=tilted, specific_force=force)
    assert outer(fresh, tilting, ZERO, HERE, g, PERIOD).asked == pytest.approx(hover_of(g))  # by the sample before
    lean = outer(leaning, tilting, ZERO, HERE, g, PERIOD)
    assert lean.asked == pytest.approx(hover_of(g) / math.cos(0.5))
    plain = gains(ATC_ANGLE_BOOST=0.0)
    flat = outer(leaning, tilting, ZERO, HERE, plain, PERIOD)
    assert flat.asked == pytest.approx(hover_of(g))
    assert flat.average == pytest.approx(hover_of(g))
    less = outer(fresh, measured(), ZERO, HERE._replace(acceleration=vector(0.0, 0.0, -4.0)), g, PERIOD)
    assert less.asked == pytest.approx(hover_of(g) - 0.2, abs=1e-3)
    assert less.average == pytest.approx(hover_of(g) - 0.1, abs=1e-3)
    start = fresh
    after = outer(start, measured(), ZERO, HERE, g, PERIOD)
    goal = math.acos(hover_of(g) / 0.8)
    assert after.lean - start.lean == pytest.approx(PERIOD / (PERIOD + 1.0) * (goal - start.lean))


def test_sensors_are_filtered_and_a_start_in_motion_rings_nothing():
    values, delays = vector(1.0, -2.0, 3.0), Matrix([vector(0.0, 0.0)] * 3)
    first, delays = filtered(20.0, delays, values, 0.0, PERIOD)
    second, _ = filtered(20.0, delays, values, 1.0, PERIOD)
    assert list(first) == pytest.approx(list(values))
    assert list(second) == pytest.approx(list(values))
    step, _ = filtered(20.0, delays, 2.0 * values, 1.0, PERIOD)
    assert 1.0 < step[0] < 1.2
    for cut in (0.0, 250.0):  # none, and half of 500 Hz
        assert list(filtered(cut, delays, 2.0 * values, 1.0, PERIOD)[0]) == [2.0, -4.0, 6.0]


def test_the_tutorials_circle_is_flown_and_the_loop_is_sound_in_wind():
    circle = {"type": "circle", "centre": [0.0, 0.0, 2.0], "radius": 2.0, "period": 8.0}
    flight = fly(Mission(vehicle={"preset": "x500"}, path=circle, controller={"type": "ardupilot-cascade"}))
    assert flight.outcome is Outcome.COMPLETED
    assert flight.metrics()["position_rmse[m]"] < 0.2
    hover = {"type": "step", "start": [0.0, 0.0, 2.0], "end": [0.0, 0.0, 2.0], "time": 0.1, "duration": 2.0}
    air, law = {"mean": [3.0, -1.0, 0.0]}, {"type": "ardupilot-cascade"}
    assert grade(Mission(vehicle={"preset": "x500"}, path=hover, wind=air, controller=law)).word == SOUND


def test_gains_do_not_follow_from_the_vehicle_but_its_motors_and_mixer_do():
    small, large = (ArduPilotCascade.gains(load_preset(name).model()) for name in ("crazyflie", "x500"))
    assert small[:6] == large[:6]
    assert small.full_speed > large.full_speed
    assert [abs(one) for row in large.factors for one in row] == pytest.approx([0.5] * 12)
