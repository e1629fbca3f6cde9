"""Rotors: how speeds follow, and which way the vehicle goes for each of them, by finite rotations."""

import numpy as np
import pytest

from quadstep.numbers import Vector, vector
from quadstep.vehicle.airframe_plant import Events, Payload, RotorFault, mass_properties
from quadstep.vehicle.rigid_body import Effects
from quadstep.vehicle.rotor import speed_rate
from tests.airframes import (
    FRONT,
    NONE,
    airframe,
    at,
    attitude_matrix,
    fly,
    hover_speed,
    momenta,
    rate_of,
    rotor,
)
from tests.flights import array

HOVER = hover_speed(airframe())
GYRO = Effects(gyroscopic=True, drag=False)
FORWARD, LEFTWARD, UPWARD = range(3)


def turned(pattern, seconds=0.1, **setting):
    """R after hovering level with each rotor's speed off by its share of `pattern`, as in front, left, rear, right."""
    speeds = HOVER * (1 + 0.05 * np.array(pattern))
    return attitude_matrix(fly(at(speeds=speeds), speeds, seconds, **setting))


def test_all_faster_climbs_and_tilting_goes_where_the_thrust_leans():
    climbing = fly(at(speeds=[1.05 * HOVER] * 4), 1.05 * HOVER, 0.2)
    assert climbing.velocity[2] == pytest.approx(0.2 * 9.81 * (1.05**2 - 1), rel=1e-9)
    speeds = HOVER * np.array((0.98, 1, 1.02, 1))  # nose down
    going = fly(at(speeds=speeds), speeds, 0.3)
    assert attitude_matrix(going)[UPWARD, FORWARD] < -0.05
    assert going.velocity[0] > 0.05
    assert abs(going.velocity[1]) < 1e-4


def test_spinning_rotors_up_turns_the_body_against_them_and_down_with_them():
    for wanted, sign in [(1.3 * HOVER, -1), (0.5 * HOVER, 1)]:
        speeds = np.array([wanted, HOVER, wanted, HOVER])  # counter-clockwise rotors change
        lifeless = airframe(rotor=rotor(torque=0.0))
        r = attitude_matrix(fly(at(speeds=[HOVER] * 4), speeds, 0.2, vehicle=lifeless, effects=GYRO))
        assert sign * r[LEFTWARD, FORWARD] > 0.01
        assert abs(attitude_matrix(fly(at(speeds=[HOVER] * 4), speeds, 0.2, vehicle=lifeless))[LEFTWARD, FORWARD]) < 1e-12


def test_rotors_and_body_keep_their_angular_momentum_together():
    events = Events((Payload(-1.0, 99.0, 0.2, vector(0.1, -0.05, -0.1)),))
    vehicle = airframe(rotor=rotor(thrust=0.0, torque=0.0))
    start = at(rates=(3, -2, 4), speeds=(900, 100, 700, 200))
    end = fly(start, (100, 900, 400, 100), 0.5, vehicle=vehicle, effects=GYRO, events=events)
    properties = mass_properties(vehicle, events, 0.0)

    def momentum(state):
        spin = 5e-5 * (np.array((1, -1, 1, -1)) @ array(state.speeds))
        return momenta(properties, state, (0, 0, spin))[:2]

    np.testing.assert_allclose(momentum(end)[1], momentum(start)[1], rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(momentum(end)[0], momentum(start)[0] - [0, 0, 9.81 * 0.5], atol=1e-7)
    assert np.abs(array(end.rates) - array(start.rates)).max() > 0.5


def test_a_gyroscope_precesses_towards_the_torque():
    # all momentum up (counter-clockwise rotors only); a torque that would pitch it nose down makes it roll instead:
    # the momentum, and with it body z, moves towards the torque's axis, +y
    vehicle = airframe(inertia=Vector([0.01] * 3), rotor=rotor(torque=0.0, inertia=1e-3))
    slower = np.array((0.9, 0.0, 1.1, 0.0)) * HOVER
    lean = attitude_matrix(fly(at(speeds=slower), slower, 0.2, vehicle=vehicle, effects=GYRO))[:, UPWARD]
    assert lean[LEFTWARD] == pytest.approx(0.2 * 0.118 / 0.99, rel=0.1)  # torque over momentum, rad/s
    assert abs(lean[FORWARD]) < 0.3 * lean[LEFTWARD]
    clockwise = np.array((0.0, 1.0, 0.0, 1.0)) * HOVER
    rate = rate_of(at(rates=(0, 2.0, 0), speeds=clockwise), clockwise, vehicle, effects=GYRO)
    assert rate.rates[0] == pytest.approx(2.0 * 1e-3 * 2 * HOVER / 0.01)  # -omega x h with h down


def test_speed_rises_and_falls_by_its_own_time_constant():
    for start, wanted, lag in [(200.0, 800.0, 0.03), (800.0, 200.0, 0.05)]:
        state = at(speeds=[start] * 4)
        for passed in (lag, 3 * lag):
            after = fly(state, wanted, passed, step=lag / 50)
            assert after.speeds[2] == pytest.approx(wanted + (start - wanted) * np.exp(-passed / lag), rel=1e-6)
            assert after.speeds[2] == after.speeds[0]


def test_speed_keeps_to_its_limits():
    limited = rotor(slowest=150.0)
    assert speed_rate(limited, 500.0, 5000.0, 900.0) == pytest.approx((900 - 500) / 0.03)
    assert speed_rate(limited, 500.0, -10.0, 900.0) == pytest.approx((150 - 500) / 0.05)
    assert speed_rate(limited, 900.0, 5000.0, 900.0) == 0.0
    assert speed_rate(limited, 400.0, 5000.0, 100.0) == pytest.approx((100 - 400) / 0.05)  # a flat battery


def test_a_rotor_that_lost_its_efficiency_drops_its_side_and_its_torque():
    fault = Events(faults=(RotorFault(0.0, float(FRONT), 0.8),))
    r = turned((0, 0, 0, 0), events=fault)
    assert r[UPWARD, FORWARD] < -0.03
    assert r[LEFTWARD, FORWARD] > 1e-3  # less clockwise torque of a counter-clockwise rotor
    rate = rate_of(at(speeds=[HOVER] * 4), HOVER, events=fault, effects=NONE)
    assert rate.velocity[2] == pytest.approx(-0.05 * 9.81)
    assert rate.rates[1] == pytest.approx(0.2 * 8e-6 * HOVER**2 * 0.15 / 0.008)
