"""The nested saturations of the paper's reference [11]."""

import numpy as np
import pytest

from quadstep.control.nested_saturation import NestedSaturation, NoMemory, nested
from quadstep.engines.kernel import fly_lanes
from quadstep.interfaces.closed_loop import Outcome, Ticks
from quadstep.interfaces.plant import Kinematics, Reference
from quadstep.numbers import flatten, rebuild, vector
from quadstep.vehicle.lagrange import Limits
from quadstep.vehicle.paper import Disturbance, angular_acceleration, derivative
from tests.flights import NESTED, array, column, nested_gains, parameters, random_state, same, state, vehicle

REST = Reference(same(0.0), same(0.0), same(0.0), 0.0, 0.0)
BOUNDS = vector(2.0, 1.0, 0.2, 0.1)
LAW = NestedSaturation()


def command_at(motion, reference=REST, gains=None, law=LAW):
    command, memory = law.law(law.start(motion, gains), motion, reference, gains or nested_gains(), 0.0, 0.004)
    assert memory == NoMemory()
    return command


def closed_loop(motion):
    command = command_at(motion)
    calm = Disturbance(0.0, same(0.0), same(0.0))
    return derivative(vehicle(), calm, Kinematics.STANDARD, motion, command.thrust, command.torque)


def linearised(h=1e-5):
    """Jacobian of the closed loop at rest; order: position 0-2, velocity 3-5, (psi, theta, phi) 6-8, their rates 9-11."""
    slopes = []
    for unit in np.eye(12):
        ahead, behind = (np.array(flatten(closed_loop(rebuild(state(), iter((s * unit).tolist()))))) for s in (h, -h))
        slopes.append((ahead - behind) / (2 * h))
    return np.array(slopes).T


@pytest.mark.parametrize(("channel", "members"), [("x and theta", [0, 3, 7, 10]), ("y and phi", [1, 4, 8, 11])])
def test_linear_region_has_four_poles_at_minus_one(channel, members):
    channel_matrix = linearised()[np.ix_(members, members)]
    np.testing.assert_allclose(np.poly(channel_matrix), [1, 4, 6, 4, 1], atol=1e-4)


def test_altitude_and_yaw_are_linear_with_the_given_gains():
    matrix = linearised()
    np.testing.assert_allclose(np.poly(matrix[np.ix_([2, 5], [2, 5])]), [1, 3, 0.5], atol=1e-6)
    np.testing.assert_allclose(np.poly(matrix[np.ix_([6, 9], [6, 9])]), [1, 2.374, 0.08], atol=1e-6)


def test_nested_saturations_against_numpy_at_random_places():
    rng = np.random.default_rng(61)
    for scale in (0.01, 0.1, 1.0, 10.0):
        for rate, a, v, p in rng.normal(size=(50, 4)) * scale:
            inner = np.clip(rate + 3 * a + 3 * v + p, -0.1, 0.1)
            inner = np.clip(2 * a + rate + v + inner, -0.2, 0.2)
            inner = np.clip(a + rate + inner, -1, 1)
            assert nested(BOUNDS, rate, a, v, p) == pytest.approx(-np.clip(rate + inner, -2, 2), abs=1e-13)


def test_thrust_is_a_linear_pd_divided_by_the_tilt():
    motion = state(position=(0, 0, 2), velocity=(0, 0, 0.5), attitude=(0.3, 0.4, -0.2))
    wanted = 2.0 * (10 - 3 * 0.5 - 0.5 * 2) / (np.cos(0.4) * np.cos(0.2))
    assert command_at(motion, gains=nested_gains(mass=2.0, gravity=10.0)).thrust == pytest.approx(wanted)


@pytest.mark.parametrize("kinematics", Kinematics)
def test_input_change_makes_the_angles_double_integrators_whatever_the_inertias(kinematics):
    inertia = column((5, 8, 12))
    rng = np.random.default_rng(62)
    for _ in range(5):
        motion = random_state(rng, tilt=0.8)
        torque = command_at(motion, gains=nested_gains(inertia=inertia), law=NestedSaturation(kinematics)).torque
        got = angular_acceleration(vehicle((5, 8, 12)), motion.attitude, motion.rates, torque, kinematics)
        (x, y, _), (u, v, _), (psi, theta, phi), (psi_dot, theta_dot, phi_dot) = (array(part) for part in motion)
        wanted = [
            -2.374 * psi_dot - 0.08 * psi,
            nested(BOUNDS, theta_dot, theta, -u / 9.81, -x / 9.81),
            nested(BOUNDS, phi_dot, phi, v / 9.81, y / 9.81),
        ]
        np.testing.assert_allclose(array(got), wanted, atol=1e-12)


def test_it_follows_path_errors_and_not_places():
    rng = np.random.default_rng(63)
    motion = random_state(rng, tilt=0.5)
    moved = Reference(vector(5.0, -4.0, 3.0), vector(0.5, 0.4, -0.3), vector(9.0, 9.0, 9.0), 0.7, -0.2)
    there = motion._replace(position=motion.position + moved.position, velocity=motion.velocity + moved.velocity)
    here = command_at(motion)
    got = command_at(there, moved)
    assert got.thrust == pytest.approx(here.thrust)
    np.testing.assert_allclose(array(got.r1), array(here.r1), atol=1e-14)
    # yaw: turn = ... - a1 (psi_dot - psi_d_dot) - a2 (psi - psi_d), so the reference adds a1 psi_d_dot + a2 psi_d
    difference = np.linalg.solve(
        5 * np.array([[1, 0, -np.sin(s := motion.attitude[1])], [0, 1, 0], [-np.sin(s), 0, 1]]),
        array(got.torque) - array(here.torque),
    )
    np.testing.assert_allclose(difference, [2.374 * -0.2 + 0.08 * 0.7, 0, 0], atol=1e-13)
    assert array(got.desired_attitude).tolist() == [0.7, 0, 0]


def test_logged_errors_are_those_of_the_papers_controller():
    motion = random_state(np.random.default_rng(64))
    path = Reference(vector(1.0, 2.0, 3.0), vector(0.1, 0.2, 0.3), same(0.0), 0.4, 0.5)
    got = command_at(motion, path, nested_gains(slope_1=vector(1.0, 2.0, 3.0), slope_2=vector(4.0, 5.0, 6.0)))
    position, velocity, attitude, rates = (array(part) for part in motion)
    np.testing.assert_allclose(array(got.r1), [0.1, 0.2, 0.3] - velocity + [1, 2, 3] * ([1, 2, 3] - position))
    np.testing.assert_allclose(array(got.r2), [0.5, 0, 0] - rates + [4, 5, 6] * ([0.4, 0, 0] - attitude))


@pytest.fixture(scope="module")
def from_far_away():
    far = parameters(
        end=(0, 0, 0),
        gains=nested_gains(),
        disturbance=Disturbance(0.0, same(0.0), same(0.0)),
        limits=Limits(1e3, 100.0, 1.57),
    )
    return fly_lanes(NESTED, [far], [state(position=(100, 70, 0))], Ticks(0.004, (1,), 25, 30000))[0]


def test_from_far_away_it_slides_at_the_innermost_bound_times_gravity(from_far_away):
    assert from_far_away.outcome is Outcome.COMPLETED
    t = from_far_away.column("t")
    steady = (t > 20) & (t < 60)
    np.testing.assert_allclose(from_far_away.column("x_dot")[steady], -0.981, atol=1e-3)
    np.testing.assert_allclose(from_far_away.column("y_dot")[steady], -0.981, atol=1e-3)


@pytest.mark.parametrize(("axis", "time"), [("x", 104.44), ("y", 73.86)])
def test_from_far_away_it_comes_within_a_metre_when_scipy_says(axis, time, from_far_away):
    # the times are those of the bare chain x_dd = -g theta, theta_dd = nested(...), integrated by SciPy
    outside = np.flatnonzero(np.abs(from_far_away.column(axis)) > 1)
    assert from_far_away.column("t")[outside[-1]] == pytest.approx(time, abs=0.15)
