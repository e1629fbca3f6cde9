"""Rotations by finite turns about known axes, and at random against SciPy, on every kind of number."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quadstep.numbers import Matrix, Vector, flatten, vector
from quadstep.numbers.rotations import (
    IDENTITY,
    conjugate,
    cross,
    from_rotation_vector,
    from_yaw_pitch_roll,
    heading,
    multiply,
    normalised,
    quaternion_of,
    quaternion_rate,
    rotate,
    rotation_matrix,
    rotation_vector,
    unrotate,
    yaw_pitch_roll,
)
from tests.flights import array, column, through_lanes

RNG = np.random.default_rng(11)
X, Y, Z = vector(1.0, 0.0, 0.0), vector(0.0, 1.0, 0.0), vector(0.0, 0.0, 1.0)


def on_floats(law, *columns):
    return np.array([law(*row) for row in np.transpose(columns).tolist()]).T


def on_arrays(law, *columns):
    return np.array([np.broadcast_to(entry, len(columns[0])) for entry in law(*np.array(columns))])


def on_lanes(law, *columns):
    return through_lanes(law, *columns)


def on_f32_lanes(law, *columns):
    return through_lanes(law, *columns, double=False)


EVERY_KIND = pytest.mark.parametrize(
    ("run", "tolerance"),
    [(on_floats, 3e-15), (on_arrays, 3e-15), (on_lanes, 3e-15), (on_f32_lanes, 2e-6)],
    ids=["floats", "arrays", "f64 lanes", "f32 lanes"],
)


def quaternions(rotation):
    """Shape (4, n), w first, either sign."""
    x, y, z, w = rotation.as_quat().T
    return np.array([w, x, y, z])


def rotations():
    """At random, and by nothing, by next to nothing, by a half turn and by nearly one, about the axes and others."""
    axes = np.concatenate([np.eye(3), -np.eye(3), RNG.normal(size=(20, 3))])
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    angles = [0.0, 1e-12, 1e-7, 1e-5, 1e-4, 2e-4, 0.01, math.pi / 2, 3.0, math.pi - 1e-5, math.pi - 1e-9, math.pi]
    edges = np.concatenate([axes * angle for angle in angles])
    return Rotation.concatenate([Rotation.from_rotvec(edges), Rotation.random(500, random_state=5)])


ALL = rotations()


def assert_same_rotation(got, wanted, tolerance):
    """Up to the quaternion's sign."""
    sign = np.sign(np.sum(got * wanted, axis=0))
    np.testing.assert_allclose(got * sign, wanted, atol=tolerance, rtol=0)


def test_cross_product_is_that_of_numpy():
    a, b = RNG.normal(size=(2, 3))
    np.testing.assert_allclose(array(cross(column(a), column(b))), np.cross(a, b), rtol=1e-14)


def test_the_product_of_quaternions_is_hamiltons():
    i, j, k = (Vector((0.0, *axis)) for axis in (X, Y, Z))
    for a, b, product in ((i, j, k), (j, k, i), (k, i, j)):
        assert array(multiply(a, b)).tolist() == array(product).tolist()
        assert array(multiply(b, a)).tolist() == array(-product).tolist()
        assert array(multiply(a, a)).tolist() == array(-IDENTITY).tolist()


@EVERY_KIND
def test_a_product_turns_by_the_second_then_by_the_first(run, tolerance):
    first, second = Rotation.random(100, random_state=1), Rotation.random(100, random_state=2)
    got = run(lambda *n: [*multiply(Vector(n[:4]), Vector(n[4:]))], *quaternions(first), *quaternions(second))
    assert_same_rotation(got, quaternions(first * second), tolerance)


@EVERY_KIND
def test_the_conjugate_is_the_inverse_rotation(run, tolerance):
    got = run(lambda *n: [*conjugate(Vector(n))], *quaternions(ALL))
    assert_same_rotation(got, quaternions(ALL.inv()), tolerance)


@EVERY_KIND
def test_vectors_and_the_matrix_turn_as_scipy_turns_them(run, tolerance):
    v = RNG.normal(size=(3, len(ALL)))

    def law(*n):
        q, u = Vector(n[:4]), Vector(n[4:])
        return [*rotate(q, u), *unrotate(q, u), *flatten(rotation_matrix(q))]

    got = run(law, *quaternions(ALL), *v)
    np.testing.assert_allclose(got[:3], ALL.apply(v.T).T, atol=3 * tolerance)
    np.testing.assert_allclose(got[3:6], ALL.inv().apply(v.T).T, atol=3 * tolerance)
    np.testing.assert_allclose(got[6:].T.reshape(-1, 3, 3), ALL.as_matrix(), atol=tolerance)


@EVERY_KIND
def test_the_quaternion_of_a_matrix_is_its_own_with_w_not_negative(run, tolerance):
    matrices = ALL.as_matrix().reshape(-1, 9).T
    got = run(lambda *n: [*quaternion_of(Matrix(Vector(n[i : i + 3]) for i in (0, 3, 6)))], *matrices)
    assert np.all(got[0] >= 0)
    np.testing.assert_allclose(np.linalg.norm(got, axis=0), 1.0, atol=tolerance)
    assert_same_rotation(got, quaternions(ALL), tolerance)


@EVERY_KIND
def test_turns_about_a_vector_are_those_of_scipy(run, tolerance):
    vectors = np.concatenate([ALL.as_rotvec(), 3.0 * RNG.normal(size=(100, 3))])
    got = run(lambda *n: [*from_rotation_vector(Vector(n))], *vectors.T)
    assert_same_rotation(got, quaternions(Rotation.from_rotvec(vectors)), tolerance)


@EVERY_KIND
def test_the_turn_that_a_quaternion_stands_for_is_at_most_half_a_turn_and_gives_it_back(run, tolerance):
    q = quaternions(ALL)
    for sign in (1.0, -1.0):
        got = run(lambda *n: [*rotation_vector(Vector(n))], *(sign * q))
        assert np.all(np.linalg.norm(got, axis=0) <= math.pi + tolerance)
        assert_same_rotation(quaternions(Rotation.from_rotvec(got.T.astype(float))), q, tolerance)


@EVERY_KIND
@pytest.mark.parametrize("angle", [1e-9, 1e-6, 0.9e-5, 1.1e-5, 2.1e-5, 0.9e-4, 1.1e-4, 1e-2])
def test_small_turns_keep_their_relative_accuracy(run, tolerance, angle):
    v = angle * np.array([[0.48, 0.36], [-0.6, 0.48], [0.64, -0.8]])
    np.testing.assert_allclose(run(lambda *n: [*rotation_vector(from_rotation_vector(Vector(n)))], *v), v, rtol=tolerance)


@EVERY_KIND
def test_euler_angles_are_those_of_scipy_and_come_back(run, tolerance):
    angles = RNG.uniform((-3.1, -1.5, -3.1), (3.1, 1.5, 3.1), (300, 3))
    wanted = Rotation.from_euler("ZYX", angles)
    assert_same_rotation(run(lambda *n: [*from_yaw_pitch_roll(Vector(n))], *angles.T), quaternions(wanted), tolerance)
    got = run(lambda *n: [*yaw_pitch_roll(Vector(n)), heading(Vector(n))], *quaternions(wanted))
    worst = 20 * tolerance  # yaw and roll lose what 1 / cos(pitch) magnifies
    np.testing.assert_allclose(got[:3], angles.T, atol=worst)
    np.testing.assert_allclose(got[3], angles[:, 0], atol=worst)


@EVERY_KIND
@pytest.mark.parametrize("pitch", [math.pi / 2, -math.pi / 2])
def test_pitch_of_a_quarter_turn_is_found_and_nothing_is_infinite(run, tolerance, pitch):
    q = quaternions(Rotation.from_euler("ZYX", [[0.3, pitch, -0.2], [0.0, pitch, 0.0]]))
    got = run(lambda *n: [*yaw_pitch_roll(Vector(n))], *q)
    np.testing.assert_allclose(got[1], pitch, atol=max(tolerance, 1e-7))
    assert np.all(np.isfinite(got))


@EVERY_KIND
def test_normalised_keeps_the_direction(run, tolerance):
    v = RNG.normal(size=(4, 50)) * 10
    np.testing.assert_allclose(run(lambda *n: [*normalised(Vector(n))], *v), v / np.linalg.norm(v, axis=0), atol=tolerance)


@EVERY_KIND
def test_the_rate_of_a_quaternion_is_that_of_turning_about_the_bodys_axes(run, tolerance):
    rates = RNG.normal(size=(len(ALL), 3))
    got = run(lambda *n: [*quaternion_rate(Vector(n[:4]), Vector(n[4:]))], *quaternions(ALL), *rates.T)
    assert got.shape == (4, len(ALL))
    h = 1e-4
    ahead, behind = (quaternions(ALL * Rotation.from_rotvec(sign * h * rates)) for sign in (1.0, -1.0))
    now = quaternions(ALL)
    ahead, behind = (q * np.sign(np.sum(q * now, axis=0)) for q in (ahead, behind))
    np.testing.assert_allclose(got, (ahead - behind) / (2 * h), atol=1e-7 + tolerance)


def test_a_body_that_yaws_while_it_lies_on_its_side_turns_about_its_own_axis():
    on_its_side = from_yaw_pitch_roll(vector(0.0, 0.0, math.pi / 2))
    spun = on_its_side + 1e-6 * quaternion_rate(on_its_side, Z)  # body z lies along world -y
    np.testing.assert_allclose(array(rotate(spun, Z)), array(-Y), atol=1e-11)
    np.testing.assert_allclose(array(rotate(spun, X)), [1, 0, 1e-6], atol=1e-11)
