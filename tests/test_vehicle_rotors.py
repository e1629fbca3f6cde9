"""The rotor map (Eq. 5), the reading of its signs written in `rotors`, and the rotor limits."""

import numpy as np
import pytest

from quadstep.numbers import vector
from quadstep.vehicle.paper import Rotors, allocate, limit, mix, rotor_map
from tests.flights import array, column
from tests.rotations import axis, papers_rotation

ROTORS = Rotors(arm=0.25, moment=0.02, minimum=0.0, maximum=6.0)
PLACES = {1: (0, -1, 0), 2: (-1, 0, 0), 3: (0, 1, 0), 4: (1, 0, 0)}
"""Where each rotor sits, in arms, with the paper's left-handed angles."""


def test_map_is_the_printed_matrix():
    l, c = 0.25, 0.02  # noqa: E741
    wanted = [[1, 1, 1, 1], [l, 0, -l, 0], [0, -l, 0, l], [c, -c, c, -c]]
    assert array(rotor_map(ROTORS)).tolist() == wanted


def test_allocation_is_the_inverse_of_the_map():
    l, c = 0.25, 0.02  # noqa: E741
    wanted = np.array([[1, 2 / l, 0, 1 / c], [1, 0, -2 / l, -1 / c], [1, -2 / l, 0, 1 / c], [1, 0, 2 / l, -1 / c]]) / 4
    np.testing.assert_allclose(wanted, np.linalg.inv(array(rotor_map(ROTORS))), rtol=1e-12, atol=1e-15)
    for u, tau_phi, tau_theta, tau_psi in np.eye(4):
        got = array(allocate(ROTORS, u, vector(tau_psi, tau_theta, tau_phi)))
        np.testing.assert_allclose(got, wanted @ [u, tau_phi, tau_theta, tau_psi], atol=1e-14)


def test_mixing_by_hand():
    thrust, torque = mix(ROTORS, vector(1.0, 2.0, 3.0, 5.0))
    assert thrust == 11.0
    np.testing.assert_allclose(array(torque), [0.02 * (1 - 2 + 3 - 5), 0.25 * (5 - 2), 0.25 * (1 - 3)])


def angle_axes(h=1e-6):
    """The inertial axis about which the vehicle turns as each of psi, theta, phi grows from level, by finite rotations."""
    return [axis((papers_rotation(h * unit) - papers_rotation(-h * unit)) / (2 * h)) for unit in np.eye(3)]


@pytest.mark.parametrize("rotor", PLACES)
def test_thrust_of_a_rotor_does_the_work_on_pitch_and_roll_that_its_place_says(rotor):
    thrusts = np.eye(4)[rotor - 1]
    torque = np.cross(0.25 * np.array(PLACES[rotor]), [0, 0, 1])  # about the centre, right-handed
    _, (_, tau_theta, tau_phi) = mix(ROTORS, column(thrusts))
    _, theta_axis, phi_axis = angle_axes()
    assert tau_theta == pytest.approx(torque @ theta_axis, abs=1e-9)
    assert tau_phi == pytest.approx(torque @ phi_axis, abs=1e-9)


@pytest.mark.parametrize("rotor", PLACES)
def test_a_rotor_raises_the_side_it_is_on(rotor):
    _, torque = mix(ROTORS, column(np.eye(4)[rotor - 1]))
    turned = papers_rotation(0.1 * np.array([0, torque[1], torque[2]])) @ PLACES[rotor]
    assert turned[2] > 0.01


def test_positive_roll_tilts_the_thrust_to_positive_y_and_positive_pitch_to_negative_x():
    assert papers_rotation(np.array([0, 0, 0.1]))[1, 2] > 0.05
    assert papers_rotation(np.array([0, 0.1, 0]))[0, 2] < -0.05


@pytest.mark.parametrize("rotor", PLACES)
def test_a_rotor_turns_against_the_yaw_it_pushes(rotor):
    _, (tau_psi, _, _) = mix(ROTORS, column(np.eye(4)[rotor - 1]))
    counter_clockwise = rotor in (1, 3)
    reaction = -1 if counter_clockwise else 1  # about the vertical, right-handed, opposite to the spin
    assert tau_psi == pytest.approx(0.02 * reaction * angle_axes()[0][2], abs=1e-9)


def test_commands_within_the_limits_are_left_alone():
    thrust, torque = limit(ROTORS, 9.81, vector(0.01, 0.2, -0.3))
    np.testing.assert_allclose([thrust, *torque], [9.81, 0.01, 0.2, -0.3], atol=1e-14)


def test_every_rotor_is_held_at_its_limits():
    wanted = array(allocate(ROTORS, 9.81, vector(0.0, 3.0, 0.5)))
    assert wanted.min() < 0
    assert wanted.max() > 6
    thrust, torque = limit(ROTORS, 9.81, vector(0.0, 3.0, 0.5))
    np.testing.assert_allclose(array(allocate(ROTORS, thrust, torque)), np.clip(wanted, 0, 6), atol=1e-13)
    assert limit(ROTORS, 1e9, vector(0.0, 0.0, 0.0))[0] == pytest.approx(24)
    assert limit(ROTORS, -5.0, vector(0.0, 0.0, 0.0))[0] == 0.0
