"""Control allocation: exact within the limits, always within them, thrust and tilt before yaw, for four to eight rotors."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadstep.mission.airframe import LAYOUTS, laid_out
from quadstep.numbers import Vector, flatten, rebuild, vector
from quadstep.vehicle.allocation import (
    Allocation,
    allocate,
    allocation,
    columns,
    mix,
    plain,
    rank,
    shares_evenly,
    within_limits,
)
from quadstep.vehicle.rigid_body import Geometry, Mount
from quadstep.vehicle.rotor import RotorParameters
from tests.flights import through_lanes

UP = (0.0, 0.0, 1.0)
ROTOR = RotorParameters(thrust=1e-5, torque=2e-7, inertia=0.0, rise=0.02, fall=0.02, slowest=100.0, fastest=1000.0, radius=0.1)
LEAST, MOST, MOMENT = 0.1, 10.0, 0.02


def circle(count, spins, axes=None):
    """Rotors evenly around a circle of 0.2 m."""
    angles = [2.0 * math.pi * i / count for i in range(count)]
    axes = axes or [UP] * count
    return Geometry(
        tuple(
            Mount((0.2 * math.cos(a), 0.2 * math.sin(a), 0.0), axis, s) for a, s, axis in zip(angles, spins, axes, strict=True)
        )
    )


def leaning(count):
    """Axes that lean by 0.2 rad around the circle, every second one the other way."""
    result = []
    for i in range(count):
        angle, lean = 2.0 * math.pi * i / count, 0.2 * (-1) ** i
        result.append((-math.sin(lean) * math.sin(angle), math.sin(lean) * math.cos(angle), math.cos(lean)))
    return result


LOPSIDED = Geometry(
    tuple(Mount((x, y, 0.0), UP, s) for x, y, s in ((0.25, 0.2, -1), (-0.15, 0.15, 1), (-0.15, -0.15, -1), (0.25, -0.2, 1)))
)
OUTWARD = [(0.2 * math.cos(math.pi * i / 4), 0.2 * math.sin(math.pi * i / 4), math.sqrt(0.96)) for i in range(8)]
HALF_LEANING = [OUTWARD[i] if i in {0, 1, 4, 5} else UP for i in range(8)]  # nothing but the lift differs from rotor to rotor

GEOMETRIES = {
    **{name: Geometry(laid_out(name, 0.2)) for name in LAYOUTS},
    "five": circle(5, (1, -1, 1, -1, 1)),
    "seven": circle(7, (1, -1, 1, -1, 1, -1, 1)),
    "leaning six": circle(6, (1, -1, 1, -1, 1, -1), leaning(6)),
    "half leaning eight": circle(8, (-1, 1) * 4, HALF_LEANING),
    "lopsided four": LOPSIDED,
}
EVERY = pytest.mark.parametrize("geometry", GEOMETRIES.values(), ids=GEOMETRIES)
NUMBERS = st.floats(-1.0, 1.0, allow_nan=False)
WANTED = st.tuples(st.floats(-0.5, 1.5), NUMBERS, NUMBERS, NUMBERS)


def scaled(geometry, wanted, size=1.0):
    """A thrust from below nothing to above all, and torques up to some times what the rotors can do."""
    share, *torque = wanted
    count = len(geometry.mounts)
    return share * count * MOST, [part * size * count * reach for part, reach in zip(torque, (1.0, 1.0, 0.1), strict=True)]


def allocated(geometry, thrust, torque):
    speeds, achieved_thrust, achieved_torque = allocate(geometry, allocation(geometry, ROTOR), thrust, Vector(torque))
    return [1e-5 * speed * speed for speed in speeds], achieved_thrust, list(achieved_torque)


def shares(geometry):
    """The matrix of the allocation as an array, shape (rotors, 4)."""
    return np.array([list(row) for row in allocation(geometry, ROTOR).matrix])


@EVERY
def test_the_shares_are_the_least_norm_inverse_of_the_map(geometry):
    rows, share = np.array([list(column) for column in columns(geometry, MOMENT)]).T, shares(geometry)
    assert np.allclose(rows @ share, np.eye(4), atol=1e-12)
    assert np.allclose((share @ rows).T, share @ rows, atol=1e-12)  # no part outside the row space, so of least norm


def test_one_newton_of_a_rotor_turns_the_vehicle_as_the_right_hand_says():
    front_left_clockwise = columns(Geometry((Mount((0.3, 0.2, 0.1), UP, -1),)), 0.02)[0]
    assert list(front_left_clockwise) == pytest.approx([1.0, 0.2, -0.3, 0.02])  # rolls right, pitches up, yaws left
    on_its_side = columns(Geometry((Mount((0.3, 0.2, 0.1), (1.0, 0.0, 0.0), 1),)), 0.02)[0]
    assert list(on_its_side) == pytest.approx([0.0, -0.02, 0.1, -0.2])


@EVERY
@given(wanted=WANTED)
@settings(max_examples=15, deadline=None)
def test_what_is_achieved_is_what_the_limited_rotors_make(geometry, wanted):
    thrust, torque = scaled(geometry, wanted)
    thrusts, achieved, made = allocated(geometry, thrust, torque)
    u, tau = mix(geometry, MOMENT, Vector(thrusts))
    assert [u, *tau] == pytest.approx([achieved, *made], abs=1e-9)


@EVERY
@given(wanted=WANTED)
@settings(max_examples=15, deadline=None)
def test_every_rotor_keeps_to_its_limits_and_nothing_changes_sign_or_grows(geometry, wanted):
    thrust, torque = scaled(geometry, wanted)
    thrusts, _, made = allocated(geometry, thrust, torque)
    assert all(LEAST * (1 - 1e-12) <= one <= MOST * (1 + 1e-12) for one in thrusts)
    for given_part, made_part in zip(torque, made, strict=True):
        assert 0.0 <= made_part * np.sign(given_part) <= abs(given_part)


@EVERY
@given(wanted=WANTED)
@settings(max_examples=15, deadline=None)
def test_within_the_limits_it_is_exact(geometry, wanted):
    thrust, torque = scaled(geometry, wanted, 0.05)
    simple, without_yaw = (shares(geometry) @ [thrust, *torque[:2], yaw] for yaw in (torque[2], 0.0))  # thrust goes before yaw
    if all(np.all((some > LEAST) & (some < MOST)) for some in (simple, without_yaw)):
        thrusts, achieved, made = allocated(geometry, thrust, torque)
        assert thrusts == pytest.approx(list(simple), rel=1e-9)
        assert [achieved, *made] == [thrust, *torque]


@EVERY
@given(wanted=WANTED)
@settings(max_examples=25, deadline=None)
def test_yaw_is_given_up_for_thrust_and_tilt_and_no_more_of_it_than_needed(geometry, wanted):
    thrust, torque = scaled(geometry, wanted, 0.2)
    without_yaw = shares(geometry) @ [thrust, *torque[:2], 0.0]
    if np.all((without_yaw > LEAST) & (without_yaw < MOST)):
        thrusts, achieved, made = allocated(geometry, thrust, torque)
        assert [achieved, *made[:2]] == [thrust, *torque[:2]]
        if abs(made[2]) < abs(torque[2]):
            assert min(thrusts) <= LEAST + 1e-9 or max(thrusts) >= MOST - 1e-9


@EVERY
@given(share=st.floats(0.02, 0.98), direction=st.floats(-math.pi, math.pi), part=st.floats(0.5, 0.999))
@settings(max_examples=25, deadline=None)
def test_every_tilt_that_fits_at_the_wanted_thrust_is_made_at_that_thrust(geometry, share, direction, part):
    matrix, thrust = shares(geometry), share * len(geometry.mounts) * MOST
    base = matrix[:, 0] * thrust
    if base.min() > LEAST and base.max() < MOST:
        unit = matrix[:, 1] * math.cos(direction) + matrix[:, 2] * math.sin(direction)
        reach = part * np.min(np.where(unit > 0.0, MOST - base, base - LEAST) / np.maximum(np.abs(unit), 1e-12))
        torque = [reach * math.cos(direction), reach * math.sin(direction), 3.0]
        _, achieved, made = allocated(geometry, thrust, torque)
        assert [achieved, *made[:2]] == pytest.approx([thrust, *torque[:2]], rel=1e-12, abs=1e-12)


@EVERY
@given(sign=st.sampled_from([-1.0, 1.0]), direction=st.floats(-math.pi, math.pi), far=st.floats(1.0, 10.0))
@settings(max_examples=15, deadline=None)
def test_far_beyond_every_limit_the_rotors_still_make_what_is_said(geometry, sign, direction, far):
    torque = [far * math.cos(direction), far * math.sin(direction), -far]
    thrusts, achieved, made = allocated(geometry, sign * 1e3 * far, torque)
    u, tau = mix(geometry, MOMENT, Vector(thrusts))
    assert [u, *tau] == pytest.approx([achieved, *made], abs=1e-9)
    assert all(LEAST * (1 - 1e-12) <= one <= MOST * (1 + 1e-12) for one in thrusts)


def test_only_balanced_vehicles_count_as_even():
    assert {name for name, geometry in GEOMETRIES.items() if shares_evenly(geometry)} == {*LAYOUTS, "leaning six"}
    for geometry in GEOMETRIES.values():
        lift = shares(geometry)[:, 0]
        assert shares_evenly(geometry) == bool(np.ptp(lift) < 1e-9)


@EVERY
@given(wanted=WANTED)
@settings(max_examples=25, deadline=None)
def test_thrust_moves_no_farther_than_the_tilt_needs_and_tilt_keeps_its_direction(geometry, wanted):
    thrust, torque = scaled(geometry, wanted, 0.6)
    _, achieved, made = allocated(geometry, thrust, torque)
    thrusts = shares(geometry) @ [achieved, *made[:2], 0.0]  # the yaw takes what these leave
    assert made[0] * torque[1] == pytest.approx(made[1] * torque[0], abs=1e-9)
    if abs(achieved - thrust) > 1e-9:
        short = thrust > achieved  # a rotor at its greatest holds the thrust down, one at its least holds it up
        assert (max(thrusts) >= MOST - 1e-9) if short else (min(thrusts) <= LEAST + 1e-9)
    if np.hypot(*made[:2]) < np.hypot(*torque[:2]) * (1.0 - 1e-9) and shares_evenly(geometry):
        assert min(thrusts) <= LEAST + 1e-9
        assert max(thrusts) >= MOST - 1e-9


@pytest.mark.parametrize(
    ("roll", "yaw", "thrust", "rolled", "yawed"),
    [
        (1.2, 0.05, 12.0, 1.2, 0.05),  # 3 N each in hover, 2.12 N up and down for the roll, 0.625 N for the yaw: all fit
        (1.2, 0.10, 12.0, 1.2, 0.0623),  # 0.779 N are left for the yaw above the 0.1 N of a rotor at its slowest
        (2.0, 0.10, 14.542, 2.0, 0.0),  # 3.536 N do not fit: every rotor has to carry 3.636 N
        (4.0, 0.10, 20.2, 2.8001, 0.0),  # 7.07 N fit at no thrust: 4.95 N do, between 0.1 and 10 N
    ],
)
def test_four_cases_worked_by_hand(roll, yaw, thrust, rolled, yawed):
    _, achieved, made = allocated(Geometry(laid_out("x", 0.2)), 12.0, [roll, 0.0, yaw])
    assert [achieved, *made] == pytest.approx([thrust, rolled, 0.0, yawed], rel=1e-4)


def test_a_torque_about_each_axis_speeds_up_the_rotors_that_make_it():
    """Layout x: front left cw, rear left ccw, rear right cw, front right ccw."""
    geometry = Geometry(laid_out("x", 0.2))
    for torque, faster in (((0.1, 0.0, 0.0), {0, 1}), ((0.0, 0.1, 0.0), {1, 2}), ((0.0, 0.0, 0.01), {0, 2})):
        thrusts, _, _ = allocated(geometry, 12.0, torque)
        assert {place for place, one in enumerate(thrusts) if one > 3.0} == faster


@pytest.mark.parametrize(("spins", "count"), [((1, 1, 1, 1), 3), ((1, -1, 1, -1), 4), ((1, 1, -1, -1), 3), ((1,) * 6, 3)])
def test_rank_counts_what_the_rotors_can_make(spins, count):
    assert rank(circle(len(spins), spins), 0.02) == count


def test_rotors_in_a_line_or_without_torque_cannot_make_everything():
    line = Geometry(tuple(Mount((x, 0.0, 0.0), UP, s) for x, s in ((0.3, 1), (0.1, -1), (-0.1, 1), (-0.3, -1))))
    assert rank(line, 0.02) == 3
    assert rank(circle(4, (1, -1, 1, -1)), 0.0) == 3


@pytest.mark.parametrize("name", ["x", "lopsided four", "hexa-x", "octo-plus"])
@pytest.mark.parametrize("double", [True, False], ids=["f64", "f32"])
def test_lanes_and_arrays_agree_with_floats(name, double):
    geometry = GEOMETRIES[name]
    flat = allocation(geometry, ROTOR)
    rng = np.random.default_rng(3)
    wanted = np.array([np.r_[u, t] for u, t in (scaled(geometry, w, 0.3) for w in rng.uniform(-1, 1, (200, 4)))]).T

    def law(thrust, *torque):
        speeds, achieved, made = allocate(geometry, flat, thrust, Vector(torque))
        return [*speeds, achieved, *made]

    floats = np.array([law(*one) for one in wanted.T.tolist()]).T
    arrays = np.array(law(*wanted))
    lanes = through_lanes(law, *wanted, double=double)
    assert np.allclose(arrays, floats, rtol=1e-12, atol=1e-12)
    assert np.allclose(lanes, floats, rtol=1e-12 if double else 2e-5, atol=1e-10 if double else 2e-4)


def test_limits_are_numbers_of_each_flight():
    """A batch may hold vehicles of different thrust; nothing of the matrix is a constant of the program."""
    geometry = Geometry(laid_out("x", 0.2))
    one = allocation(geometry, ROTOR)

    def law(most, scale):
        changed = Allocation(tuple(scale * row for row in one.matrix), one.least, most, one.thrust)
        speeds, achieved, _ = allocate(geometry, changed, 30.0, vector(0.0, 0.0, 0.0))
        return [speeds[0], achieved]

    speed, achieved = through_lanes(law, [10.0, 5.0], [1.0, 1.0])
    assert speed == pytest.approx([math.sqrt(7.5e5), math.sqrt(5e5)])
    assert achieved == pytest.approx([30.0, 20.0])


@pytest.mark.parametrize("place", range(4))
def test_a_command_that_is_not_a_number_stays_none(place):
    wanted = [12.0, 0.1, 0.1, 0.1]
    wanted[place] = math.nan
    flat = allocation(GEOMETRIES["x"], ROTOR)

    def law(thrust, *torque):
        return list(allocate(GEOMETRIES["x"], flat, thrust, Vector(torque))[0])

    assert any(math.isnan(speed) for speed in law(*wanted))
    assert np.isnan(law(*np.array([wanted, [12.0, 0.0, 0.0, 0.0]]).T)).any(axis=0).tolist() == [True, False]
    assert np.isnan(through_lanes(law, *np.array([wanted, [12.0, 0.0, 0.0, 0.0]]).T)).any(axis=0).tolist() == [True, False]


@EVERY
@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_away_from_the_limits_the_short_way_is_the_long_one_to_the_bit(geometry, kind):
    if not shares_evenly(geometry):
        return
    shares, rng = allocation(geometry, ROTOR), np.random.default_rng(4)
    shares = rebuild(shares, iter([kind(one) for one in flatten(shares)]))
    size = rng.choice([0.0, 1e-3, 0.1, 1.0], (4, 40_000))
    thrust, *torque = (rng.uniform(-1.0, 1.0, (4, 40_000)) * size).astype(kind)
    thrust = (thrust + rng.choice([LEAST, 0.5 * MOST, MOST], len(thrust)).astype(kind)) * len(geometry.mounts)
    asked = thrust.astype(kind), Vector(torque), shares
    with np.errstate(invalid="ignore"):  # roots of thrusts below zero, where it does not hold
        holds, short = plain(asked)
        long = within_limits(True, asked)
    assert 1000 < np.count_nonzero(holds) < 39_000
    for one, other in zip(flatten(short), flatten(long), strict=True):
        assert one.dtype == other.dtype == kind
        np.testing.assert_array_equal(one[holds], other[holds])
