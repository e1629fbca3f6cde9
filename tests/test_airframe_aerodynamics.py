"""Drag, lift, flapping and ground effect: directions, magnitudes, terminal speed."""

import math

import numpy as np
import pytest

from quadstep.numbers import matrix, vector
from quadstep.vehicle.rigid_body import Effects, Geometry, Mount
from quadstep.vehicle.rotor import Drag, ground_effect, hub_drag, parasitic_drag, translational_lift
from tests.airframes import (
    ARM,
    NO_DRAG,
    PLUS,
    airframe,
    at,
    attitude_matrix,
    fly,
    hover_speed,
    random_attitude,
    rate_of,
    rotor,
)
from tests.flights import array, column

AIR = Effects(gyroscopic=False, drag=True)
GROUND = Effects(gyroscopic=False, drag=False, ground=True)
HOVER = hover_speed(airframe())
UNIT = matrix((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
DIRECTIONS = [*np.eye(3), *-np.eye(3)]


def only(**part):
    return airframe(drag=NO_DRAG._replace(**part))


DRAGS = {"parasitic": only(parasitic=vector(0.02, 0.03, 0.05)), "rotor": only(rotor=vector(1e-4, 1e-4, 2e-4))}


def against_weight(vehicle, **state):
    """Acceleration beside that of thrust and gravity, world axes."""
    motion = at(speeds=[HOVER] * 4, **state)
    wind = np.zeros(3)
    return array(rate_of(motion, HOVER, vehicle, effects=AIR, wind=wind).velocity - rate_of(motion, HOVER).velocity)


@pytest.mark.parametrize("kind", DRAGS)
def test_drag_opposes_the_velocity_whatever_the_attitude(kind):
    rng = np.random.default_rng(2)
    for _ in range(20):
        velocity = 6 * rng.normal(size=3)
        push = against_weight(DRAGS[kind], velocity=velocity, attitude=random_attitude(rng))
        assert push @ velocity < -0.02 * velocity @ velocity
    for direction in DIRECTIONS:
        push = against_weight(DRAGS[kind], velocity=4 * direction)
        np.testing.assert_allclose(push / np.linalg.norm(push), -direction, atol=1e-12)


def test_drag_magnitudes():
    for i, (c, k) in enumerate(zip((0.02, 0.03, 0.05), (1e-4, 1e-4, 2e-4), strict=True)):
        velocity = 4 * np.eye(3)[i]
        assert against_weight(DRAGS["parasitic"], velocity=velocity)[i] == pytest.approx(-c * 16 / 0.8)
        assert against_weight(DRAGS["rotor"], velocity=velocity)[i] == pytest.approx(-4 * HOVER * k * 4 / 0.8)
    got = parasitic_drag(DRAGS["parasitic"].drag, vector(3.0, 0.0, -4.0))
    np.testing.assert_allclose(array(got), [-5 * 0.02 * 3, 0, 5 * 0.05 * 4])


@pytest.mark.parametrize("kind", DRAGS)
def test_wind_pushes_along(kind):
    for direction in DIRECTIONS:
        end = fly(at(speeds=[HOVER] * 4), HOVER, 0.1, vehicle=DRAGS[kind], effects=AIR, wind=5 * direction)
        gained = array(end.velocity)
        assert gained @ direction > 0.01
        assert np.linalg.norm(gained - (gained @ direction) * direction) < 1e-4


def test_only_the_velocity_through_the_air_counts():
    rng = np.random.default_rng(4)
    for _ in range(5):
        q, velocity, wind, rates = random_attitude(rng), *rng.normal(size=(3, 3))
        speeds = rng.uniform(300, 900, 4)
        one = rate_of(at(velocity=velocity, attitude=q, rates=rates, speeds=speeds), HOVER, effects=AIR, wind=wind)
        other = rate_of(at(velocity=velocity - wind, attitude=q, rates=rates, speeds=speeds), HOVER, effects=AIR)
        np.testing.assert_allclose(array(one.velocity), array(other.velocity), atol=1e-11)
        np.testing.assert_allclose(array(one.rates), array(other.rates), atol=1e-11)


def test_rotor_drag_damps_yaw_and_roll():
    spinning = rate_of(at(rates=(0, 0, 3.0), speeds=[HOVER] * 4), HOVER, DRAGS["rotor"], effects=AIR)
    assert spinning.rates[2] == pytest.approx(-4 * HOVER * 1e-4 * ARM**2 * 3.0 / 0.011)
    rolling = rate_of(at(rates=(3.0, 0, 0), speeds=[HOVER] * 4), HOVER, DRAGS["rotor"], effects=AIR)
    assert rolling.rates[0] == pytest.approx(-2 * HOVER * 2e-4 * ARM**2 * 3.0 / 0.006)


def test_drag_on_hubs_above_the_centre_tips_the_vehicle_back():
    high = Geometry(tuple(Mount((x, y, 0.1), axis, spin) for (x, y, _), axis, spin in
                          ((m.position, m.axis, m.spin) for m in PLUS.mounts)))  # fmt: skip
    setting = {"vehicle": DRAGS["rotor"], "effects": AIR, "geometry": high}
    r = attitude_matrix(fly(at(velocity=(5, 0, 0), speeds=[HOVER] * 4), HOVER, 0.05, **setting))
    assert r[2, 0] > 1e-4  # the nose comes up
    r = attitude_matrix(fly(at(velocity=(0, 5, 0), speeds=[HOVER] * 4), HOVER, 0.05, **setting))
    assert r[2, 1] > 1e-4  # as does the left side


def test_flapping_blades_tip_the_vehicle_back():
    flapping = only(flapping=3e-6)
    for velocity, side in [((5, 0, 0), 0), ((0, 5, 0), 1)]:
        rate = rate_of(at(velocity=velocity, speeds=[HOVER] * 4), HOVER, flapping, effects=AIR)
        size = 4 * 3e-6 * HOVER * 5
        wanted = [0, -size / 0.008, 0] if side == 0 else [size / 0.006, 0, 0]
        np.testing.assert_allclose(array(rate.rates), wanted, atol=1e-12)
        r = attitude_matrix(fly(at(velocity=velocity, speeds=[HOVER] * 4), HOVER, 0.05, vehicle=flapping, effects=AIR))
        assert r[2, side] > 1e-4
    upward = rate_of(at(velocity=(0, 0, 5), speeds=[HOVER] * 4), HOVER, flapping, effects=AIR)
    np.testing.assert_allclose(array(upward.rates), 0.0, atol=1e-12)


def test_moving_across_the_air_lifts_and_moving_along_the_axis_does_not():
    lifting = only(translational_lift=2e-3)
    for velocity, wanted in [((3, -4, 0), 25.0), ((0, 0, 7), 0.0)]:
        np.testing.assert_allclose(against_weight(lifting, velocity=velocity), [0, 0, 4 * 2e-3 * wanted / 0.8], atol=1e-12)
    tipped = np.sqrt(0.5)
    push = against_weight(lifting, velocity=(0, 0, 5), attitude=(tipped, 0, tipped, 0))  # nose down, lift along world x
    np.testing.assert_allclose(push, [4 * 2e-3 * 25 / 0.8, 0, 0], atol=1e-12)


def test_hub_drag_and_lift_turn_with_the_rotor():
    drag = Drag(vector(0.0, 0.0, 0.0), vector(1.0, 1.0, 3.0), 0.0, 2.0)
    sideways = Mount((0, 0, 0), (1.0, 0.0, 0.0), 1).frame
    np.testing.assert_allclose(array(hub_drag(drag, UNIT, vector(1.0, 2.0, 3.0))), [-1, -2, -9])
    np.testing.assert_allclose(array(hub_drag(drag, sideways, vector(1.0, 2.0, 3.0))), [-3, -2, -3])
    assert translational_lift(drag, UNIT, vector(1.0, 2.0, 3.0)) == 2 * 5
    assert translational_lift(drag, sideways, vector(1.0, 2.0, 3.0)) == pytest.approx(2 * 13)


def test_falling_ends_at_the_terminal_speed():
    # m g = C v^2 + n w k_z v with the rotors idling without thrust
    vehicle = airframe(
        rotor=rotor(thrust=0.0), drag=NO_DRAG._replace(parasitic=column((0, 0, 0.05)), rotor=column((0, 0, 2e-4)))
    )
    for speed in (0.0, 500.0):
        linear, weight = 4 * speed * 2e-4, 0.8 * 9.81
        terminal = (-linear + math.sqrt(linear**2 + 4 * 0.05 * weight)) / (2 * 0.05)
        end = fly(at((0, 0, 1000), speeds=[speed] * 4), speed, 12.0, step=0.02, vehicle=vehicle, effects=AIR)
        assert end.velocity[2] == pytest.approx(-terminal, rel=1e-6)


def test_a_push_through_the_air_fades_exponentially_with_rotor_drag_alone():
    end = fly(at(velocity=(2, 0, 0), speeds=[HOVER] * 4), HOVER, 1.0, step=0.01, vehicle=DRAGS["rotor"], effects=AIR)
    assert end.velocity[0] == pytest.approx(2 * math.exp(-4 * HOVER * 1e-4 / 0.8), rel=1e-9)


@pytest.mark.parametrize(("height", "ratio"), [(0.5, 4 / 3), (1.0, 16 / 15), (2.0, 64 / 63), (3.0, 144 / 143)])
def test_ground_effect_is_cheesemans_and_bennetts(height, ratio):
    assert ground_effect(height * 0.12, 0.12) == pytest.approx(ratio, rel=1e-14)
    vehicle = airframe(ground=-3.0)
    rate = rate_of(at((0, 0, height * 0.12 - 3.0), speeds=[HOVER] * 4), HOVER, vehicle, effects=GROUND)
    assert rate.velocity[2] == pytest.approx(9.81 * (ratio - 1), rel=1e-9)


def test_ground_effect_stays_in_range_on_and_below_the_ground_and_far_from_it():
    heights = np.linspace(-1.0, 3.0, 400)
    ratios = np.array([ground_effect(float(height), 0.12) for height in heights])
    assert np.all(np.diff(ratios) <= 0)
    assert ratios[0] == ratios[heights < 0.05][-1] == pytest.approx(4 / 3)
    assert ratios[-1] < 1.0002
    assert ground_effect(1e9, 0.1) == 1.0


def test_the_cushion_is_stronger_under_the_lower_rotor():
    lean = 0.1  # nose down: body x below the horizon
    low = at((0, 0, 0.15), attitude=(math.cos(lean / 2), 0, math.sin(lean / 2), 0), speeds=[HOVER] * 4)
    assert rate_of(low, HOVER, effects=GROUND).rates[1] < -0.1  # back to level
    assert abs(rate_of(low, HOVER).rates[1]) < 1e-12
