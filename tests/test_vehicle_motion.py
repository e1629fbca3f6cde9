"""The whole plant: position (Eqs 1, 7, 9), disturbance (Eq. 67), and what its motion must keep."""

import numpy as np
import pytest

from quadstep.engines.loop import along, runge_kutta_4
from quadstep.interfaces.plant import Kinematics
from quadstep.numbers import vector
from quadstep.vehicle.paper import Disturbance, State, acceleration, derivative, disturb, energy, euler_rate_matrix
from tests.flights import array, random_state, same, state, vehicle
from tests.rotations import papers_rotation, rotation

UNEQUAL = (5, 8, 12)
CALM = Disturbance(0.0, same(0.0), same(0.0))
STATES = [random_state(np.random.default_rng(case)) for case in range(10)]


def test_acceleration_is_thrust_weight_and_force_over_mass():
    for motion in STATES:
        attitude = array(motion.attitude)
        wanted = (7.0 * papers_rotation(attitude)[:, 2] + [0.1, -0.2, 0.3]) / 2.0 - [0, 0, 9.5]
        got = acceleration(vehicle(mass=2.0, gravity=9.5), motion.attitude, 7.0, vector(0.1, -0.2, 0.3))
        np.testing.assert_allclose(array(got), wanted, atol=1e-14)


def test_disturbance_is_the_product_of_velocity_and_the_reversed_euler_rates():
    motion = state(velocity=(2, 3, 5), rates=(7, 11, 13))
    force, torque = disturb(Disturbance(1.0, same(0.0), same(0.0)), motion)
    assert array(force).tolist() == [2 * 13, 3 * 11, 5 * 7]
    assert array(torque).tolist() == [2 * 13, 3 * 11, 5 * 7]


def test_disturbance_scales_the_products_and_adds_constants():
    motion = state(velocity=(2, 3, 5), rates=(7, 11, 13))
    force, torque = disturb(Disturbance(0.1, vector(1.0, 2.0, 3.0), vector(-1.0, -2.0, -3.0)), motion)
    np.testing.assert_allclose(array(force), [3.6, 5.3, 6.5])
    np.testing.assert_allclose(array(torque), [1.6, 1.3, 0.5])


def test_derivative_adds_the_disturbance_to_force_and_torque():
    disturbance = Disturbance(0.5, vector(0.1, 0.2, 0.3), vector(0.4, 0.5, 0.6))
    body = vehicle(UNEQUAL)
    for motion in STATES:
        force, moment = disturb(disturbance, motion)
        torque = vector(1.0, -2.0, 3.0)
        got = derivative(body, disturbance, Kinematics.STANDARD, motion, 9.0, torque)
        calm = derivative(body, CALM, Kinematics.STANDARD, motion, 9.0, torque + moment)
        assert array(got.position).tolist() == array(motion.velocity).tolist()
        assert array(got.attitude).tolist() == array(motion.rates).tolist()
        np.testing.assert_allclose(array(got.rates), array(calm.rates), atol=1e-14)
        np.testing.assert_allclose(array(got.velocity), array(calm.velocity) + array(force), atol=1e-14)


def test_energy_by_hand():
    motion = state(position=(0, 0, 3), velocity=(1, 2, 2), rates=(0, 0, 2))
    assert energy(vehicle(UNEQUAL, mass=2.0), motion, Kinematics.STANDARD) == pytest.approx(9 + 10 + 2 * 9.81 * 3)


@pytest.mark.parametrize("kinematics", Kinematics)
def test_power_of_thrust_torque_and_disturbance_is_the_rate_of_energy(kinematics):
    body, thrust, torque = vehicle(UNEQUAL), 11.0, vector(1.5, -2.5, 0.5)
    disturbance = Disturbance(0.3, vector(0.1, 0.2, 0.3), vector(0.4, 0.5, 0.6))
    for motion in STATES:
        rate = derivative(body, disturbance, kinematics, motion, thrust, torque)
        ahead, behind = (energy(body, along(motion, h, rate), kinematics) for h in (1e-5, -1e-5))
        force, moment = (array(part) for part in disturb(disturbance, motion))
        force = force + thrust * papers_rotation(array(motion.attitude))[:, 2]
        power = force @ array(motion.velocity) + (array(torque) + moment) @ array(motion.rates)
        assert (ahead - behind) / 2e-5 == pytest.approx(power, abs=1e-6)


def coast(kinematics, seconds=10.0, step=0.004):
    """A body of unequal inertias without thrust, torque or disturbance, spun mostly about its largest."""
    body = vehicle(UNEQUAL)
    motions = [state((0, 0, 700), (1, 0, 2), (1.0, 0.3, -0.4), (1.2, -0.1, 0.3))]
    for _ in range(round(seconds / step)):
        motions.append(runge_kutta_4(lambda now: derivative(body, CALM, kinematics, now, 0.0, same(0.0)), motions[-1], step))
    return body, motions


@pytest.fixture(scope="module")
def coasting():
    return {kinematics: coast(kinematics) for kinematics in Kinematics}


@pytest.mark.parametrize("kinematics", Kinematics)
def test_a_coasting_body_keeps_its_energy_for_ten_seconds(kinematics, coasting):
    body, motions = coasting[kinematics]
    assert max(abs(motion.attitude[1]) for motion in motions) < 1.3
    assert np.ptp([motion.attitude[2] for motion in motions]) > 0.2
    energies = np.array([energy(body, motion, kinematics) for motion in motions[::50]])
    assert np.abs(energies / energies[0] - 1).max() < 1e-9
    weightless = body._replace(gravity=0.0, mass=0.0)
    turning = np.array([energy(weightless, motion, kinematics) for motion in motions[::50]])
    assert np.abs(turning / turning[0] - 1).max() < 1e-9


def test_a_coasting_body_of_standard_kinematics_keeps_its_angular_momentum(coasting):
    _, motions = coasting[Kinematics.STANDARD]

    def momentum(motion):
        omega = array(euler_rate_matrix(motion.attitude, Kinematics.STANDARD) @ motion.rates)
        return rotation(array(motion.attitude)) @ (np.array(UNEQUAL) * omega)

    wanted = momentum(motions[0])
    assert np.linalg.norm(momentum(motions[-1]) - wanted) < 1e-9 * np.linalg.norm(wanted)


def test_a_coasting_body_falls_on_a_parabola(coasting):
    _, motions = coasting[Kinematics.STANDARD]
    final = motions[-1].position
    np.testing.assert_allclose([final[0], final[2]], [10.0, 700 + 20 - 0.5 * 9.81 * 100], rtol=1e-9)


def shifted_in_yaw(kinematics):
    rate = [
        derivative(
            vehicle(UNEQUAL),
            CALM,
            kinematics,
            motion._replace(attitude=motion.attitude + vector(turn, 0.0, 0.0)),
            9.0,
            vector(1.0, 2.0, 3.0),
        )
        for motion in STATES
        for turn in (0.0, 1.1)
    ]
    return [
        np.abs(array(a.rates) - array(b.rates)).max() + np.abs(array(a.velocity) - array(b.velocity)).max()
        for a, b in zip(rate[::2], rate[1::2], strict=True)
    ]


def test_turning_the_yaw_and_nothing_else_leaves_standard_dynamics_unchanged():
    assert max(shifted_in_yaw(Kinematics.STANDARD)) < 1e-12


def test_turning_the_yaw_changes_printed_dynamics_of_unequal_inertias():
    assert min(shifted_in_yaw(Kinematics.PRINTED)) > 1e-3


def test_the_integrator_is_of_fourth_order():
    def rate(now):
        return State(now.velocity, -now.position, now.rates, -4.0 * now.attitude)

    def off(steps):
        now = state(position=(1, 0, 0), attitude=(1, 0, 0))
        for _ in range(steps):
            now = runge_kutta_4(rate, now, 1.0 / steps)
        return np.array([now.position[0] - np.cos(1), now.velocity[0] + np.sin(1), now.attitude[0] - np.cos(2)])

    np.testing.assert_allclose(np.log2(off(20) / off(40)), 4, atol=0.1)
