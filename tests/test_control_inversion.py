"""Kinematic inversion (Eqs 40-52): the force is recovered from the thrust and attitude computed for it."""

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from quadstep.control.vectoring import invert_force
from quadstep.numbers import Vector, vector
from quadstep.vehicle.paper import thrust_direction
from tests.flights import array, column, through_lanes

PI = math.pi
COMPONENT = st.sampled_from([0.0, 1.0, -1.0]) | st.floats(-1, 1, allow_subnormal=False)


def force_of(u, theta, phi):
    return u * array(thrust_direction(vector(0.0, theta, phi)))


@given(COMPONENT, COMPONENT, COMPONENT, st.integers(-150, 149))
@example(1.0, 0.0, 0.0, -150)
@example(-1.0, 0.0, 0.0, 149)
@example(0.0, 0.0, -1.0, 0)
@example(0.0, 1e-9, -1.0, 0)
def test_thrust_and_attitude_make_the_wanted_force(x, y, z, exponent):
    direction = np.array([x, y, z])
    if np.abs(direction).max() < 1e-3:
        direction = np.array([1.0, 1.0, 1.0])
    force = direction / np.linalg.norm(direction) * 10.0**exponent
    u, theta, phi = invert_force(column(force))
    size = np.linalg.norm(force / 10.0**exponent) * 10.0**exponent
    assert u == pytest.approx(size, rel=1e-14)
    assert np.abs(force_of(u, theta, phi) - force).max() <= 1e-12 * size
    assert -PI / 2 <= theta <= PI / 2
    assert -PI <= phi <= PI


@pytest.mark.parametrize(("force", "wanted"), [
    ((0, 0, 0), (0, 0, 0)),
    ((0, 0, 9.81), (9.81, 0, 0)),
    ((0, 0, -2), (2, 0, PI)),
    ((2, 0, 0), (2, -PI / 2, 0)),
    ((-2, 0, 0), (2, PI / 2, 0)),
    ((0, 3, 0), (3, 0, PI / 2)),
    ((0, -3, 0), (3, 0, -PI / 2)),
    ((0, 1, -1), (math.sqrt(2), 0, 3 * PI / 4)),
    ((-1, 0, 1), (math.sqrt(2), PI / 4, 0)),
    ((-1, 0, -1), (math.sqrt(2), PI / 4, PI)),
    ((3, 4, 12), (13, -math.atan(3 / math.hypot(4, 12)), math.atan(4 / 12))),
])  # fmt: skip
def test_inversion_by_hand(force, wanted):
    assert invert_force(column(force)) == pytest.approx(wanted, rel=1e-14)
    lanes = through_lanes(lambda x, y, z: list(invert_force(Vector((x, y, z)))), *([one] for one in force))
    np.testing.assert_allclose(lanes[:, 0], wanted, rtol=1e-14)
    arrays = invert_force(vector(*(np.array([float(one)]) for one in force)))
    np.testing.assert_allclose([one[0] for one in arrays], wanted, rtol=1e-14)


def test_lanes_and_arrays_make_the_wanted_force_in_every_direction_and_size():
    rng = np.random.default_rng(51)
    forces = rng.normal(size=(3, 3000)) * 10.0 ** rng.integers(-150, 150, 3000)
    size = np.sqrt(np.sum((forces / np.abs(forces).max(axis=0)) ** 2, axis=0)) * np.abs(forces).max(axis=0)
    for u, theta, phi in (
        through_lanes(lambda x, y, z: list(invert_force(Vector((x, y, z)))), *forces),
        invert_force(vector(*forces)),
    ):
        back = u * np.array([-np.sin(theta), np.cos(theta) * np.sin(phi), np.cos(theta) * np.cos(phi)])
        assert np.all(np.abs(back - forces) <= 1e-12 * size)
