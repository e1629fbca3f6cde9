"""The nested saturations of [11] on a real vehicle, against formulas written in NumPy and flights."""

from functools import partial

import numpy as np
import pytest

from quadstep.control.nested_saturation import NestedSaturation, NestedSaturationOnAirframe
from quadstep.interfaces.plant import Kinematics, Reference
from quadstep.mission.listings import load_preset
from quadstep.numbers import vector
from quadstep.vehicle.paper import angular_acceleration
from tests.flights import array, column, nested_gains, random_state, same, vehicle
from tests.followed import EIGHT, FAST, HERE, followed
from tests.rigid import linearised

PRESETS = ("research-2.6kg", "crazyflie", "x500", "hummingbird")


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("yaw", [0.0, 1.0, -2.5])
def test_near_the_path_it_is_linear_with_four_poles_at_the_vehicles_pace(preset, yaw):
    model = load_preset(preset).model()
    law, gains = NestedSaturationOnAirframe.for_vehicle(model), NestedSaturationOnAirframe.gains(model)
    here = Reference(same(0.0), same(0.0), same(0.0), yaw, 0.0)

    def command(measured):
        asked, _ = law.law(law.start(measured, gains), measured, here, gains, 0.0, 0.002)
        return asked.thrust, asked.torque

    at = np.zeros(12)
    at[8] = yaw
    matrix = linearised(command, model.mass, list(model.inertia), at)
    pace, a_z, a_psi = 4.63 * model.agility, list(gains.altitude), list(gains.yaw)
    assert gains.pace == pytest.approx(pace)
    level = np.poly1d([1.0, pace]) ** 4
    others = np.poly1d([1.0, *a_z]) * np.poly1d([1.0, *a_psi])
    s = np.array([0.3j, 1.1 + 0.4j, 2.0, 5.0j]) * pace
    wanted = (level * level * others)(s)
    got = [np.linalg.det(one * np.eye(12) - matrix) for one in s]
    np.testing.assert_allclose(got, wanted, rtol=1e-5)
    assert a_z == pytest.approx([8.0 * model.agility, 24.0 * model.agility**2])
    assert a_psi == pytest.approx([12.0 * model.yaw_agility, 50.0 * model.yaw_agility**2])


@pytest.mark.parametrize("bounds", [(6.0, 3.0, 1.5, 0.75), (0.4, 0.2, 0.1, 0.05)])
def test_the_errors_of_a_path_are_paced_and_its_higher_rates_fed_forward(bounds):
    law, rng, g, pace = NestedSaturation(Kinematics.RIGID, feed_forward=True), np.random.default_rng(91), 9.81, 3.0
    inertia, (b_1, b_2, b_3, b_4) = (0.02, 0.03, 0.05), bounds
    for _ in range(10):
        motion = random_state(rng, tilt=0.8)
        place, speed, pull, jerk, snap = (rng.normal(size=3) for _ in range(5))
        path = Reference(*(column(v) for v in (place, speed, pull)), 0.4, -0.3, column(jerk), column(snap))
        gains = nested_gains(mass=1.3, inertia=column(inertia), pace=pace, bounds=column(bounds))
        command, _ = law.law(law.start(motion, gains), motion, path, gains, 0.0, 0.002)
        body = vehicle(inertia, mass=1.3)
        got = angular_acceleration(body, motion.attitude, motion.rates, command.torque, Kinematics.RIGID)
        (psi, theta, phi), (psi_dot, theta_dot, phi_dot) = array(motion.attitude), array(motion.rates)
        wanted = [-2.374 * (psi_dot + 0.3) - 0.08 * (psi - 0.4)]
        for axis, sign, angle, rate in ((0, -1.0, theta, theta_dot), (1, 1.0, phi, phi_dot)):
            p = sign * pace**2 * (array(motion.position)[axis] - place[axis]) / g
            v = sign * pace * (array(motion.velocity)[axis] - speed[axis]) / g
            a, a_dot = angle - sign * pull[axis] / g, (rate - sign * jerk[axis] / g) / pace
            inner = np.clip(a_dot + 3 * a + 3 * v + p, -b_4, b_4)
            inner = np.clip(2 * a + a_dot + v + inner, -b_3, b_3)
            inner = np.clip(a + a_dot + inner, -b_2, b_2)
            wanted.append(-(pace**2) * np.clip(a_dot + inner, -b_1, b_1) + sign * snap[axis] / g)
        np.testing.assert_allclose(array(got), wanted, rtol=1e-9, atol=1e-9)
        e_z, e_z_dot = motion.position[2] - place[2], motion.velocity[2] - speed[2]
        lift = 1.3 * (g + pull[2] - 3.0 * e_z_dot - 0.5 * e_z)
        assert command.thrust * np.cos(theta) * np.cos(phi) == pytest.approx(lift)
        np.testing.assert_allclose(array(command.desired_attitude), [0.4, -pull[0] / g, pull[1] / g])


flown = partial(followed, "nested-saturation")


@pytest.mark.parametrize("preset", ["research-2.6kg", "crazyflie", "x500"])
def test_it_flies_a_figure_eight_a_fast_circle_and_back_from_afar(preset):
    assert flown(EIGHT, preset).metrics()["position_rmse[m]"] < 0.07
    assert flown(FAST, preset).metrics()["position_rmse[m]"] < 0.35
    far = flown(HERE, preset, start={"position": [-5.0, 4.0, 3.0]}, simulation={"duration": 12.0})
    off = far.table("x", "y", "z") - far.table("x_d", "y_d", "z_d")
    assert np.abs(off[-1]).max() < 0.01


def test_a_steady_wind_leaves_an_error_for_nothing_is_integrated():
    flight = flown(HERE, wind={"mean": [2.0, 0.0, 0.0]})
    tail = flight.column("t") > 7.0
    lean, off = flight.column("pitch")[tail].mean(), flight.column("x")[tail].mean()
    assert off > 0.02
    assert off == pytest.approx(-6.0 * 9.81 * lean / 4.63**2, rel=0.02)  # 6 theta = pace^2 x / g, theta = -pitch


def test_the_conditions_of_11_are_asked_of_its_bounds():
    model = load_preset("x500").model()
    law = NestedSaturationOnAirframe.for_vehicle(model)
    assert all(one.holds for one in law.conditions(law.gains(model), model))
    tight = law.gains(model, {"bounds": vector(2.0, 1.5, 0.2, 0.1)})
    assert [one.holds for one in law.conditions(tight, model)] == [False, True, True]
