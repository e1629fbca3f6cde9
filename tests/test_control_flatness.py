"""Flatness with rotor drag: attitude and rates by differences of the vehicle's equation of motion, the law against NumPy."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quadstep import fly
from quadstep.control.flatness import away_from_zero, flat, unit
from quadstep.interfaces.plant import Reference
from quadstep.mission.listings import load_preset
from quadstep.mission.multirotor import MultirotorMission
from quadstep.numbers import Vector, vector
from tests.random_samples import (
    UP,
    any_measured,
    any_reference,
    arrays,
    frame,
    law_of,
    reachable,
    rotation_of,
    shaken,
    turning,
)

DRAG = np.array([0.5, 0.8, 0.3])
PERIOD = 0.002


def attitude_in_drag(velocity, acceleration, yaw, drag, gravity):
    """R of v_dot = -g e3 + c R e3 - R D R^T v, its x axis at right angles to the heading's y: by Newton's iteration."""
    across = np.array([-np.sin(yaw), np.cos(yaw), 0.0])

    def residual(rotation):
        x, y, _ = rotation.T @ (acceleration + gravity * UP) + drag * (rotation.T @ velocity)
        return np.array([x, y, rotation[:, 0] @ across])

    rotation = frame(acceleration + gravity * UP, yaw)
    for _ in range(12):

        def turned(v, rotation=rotation):
            return rotation @ Rotation.from_rotvec(v).as_matrix()

        slopes = np.column_stack([
            (residual(turned(1e-5 * one)) - residual(turned(-1e-5 * one))) / 2e-5 for one in np.eye(3)
        ])  # fmt: skip
        rotation = turned(-np.linalg.solve(slopes, residual(rotation)))
    assert np.abs(residual(rotation)).max() < 1e-10
    return rotation


def along(reference, drag, gravity):
    """The attitude over time near an instant of a path."""
    d = arrays(reference)

    def attitude(t):
        velocity = d["velocity"] + d["acceleration"] * t + d["jerk"] * t**2 / 2.0
        return attitude_in_drag(velocity, d["acceleration"] + d["jerk"] * t, d["yaw"] + d["yaw_rate"] * t, drag, gravity)

    return attitude


@pytest.mark.parametrize("seed", range(6))
def test_attitude_and_rates_are_those_of_the_equation_of_motion(seed):
    reference = any_reference(np.random.default_rng(seed))
    attitude = along(reference, DRAG, 9.81)
    found = flat(reference, Vector(map(float, DRAG)), 9.81)
    np.testing.assert_allclose([list(row) for row in found.rotation], attitude(0.0), atol=1e-9)
    np.testing.assert_allclose(list(found.rates), turning(attitude)[0], rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize(("seed", "bounds"), [(1, 1.0), (2, 1e-5), (3, 1.0)])
def test_it_commands_what_numpy_makes_of_the_paper(seed, bounds):
    random = np.random.default_rng(seed)
    flown, gains = law_of("flatness")
    law, g = flown.commander, shaken(gains.law, random, bounds)
    n = arrays(g)
    memory, integral = law.start(any_measured(random), g), np.zeros(3)
    for _ in range(8):
        measured, reference = any_measured(random), any_reference(random)
        asked, memory = law.law(memory, measured, reference, g, 0.0, PERIOD)
        m, d = arrays(measured), arrays(reference)
        wanted = along(reference, n["drag"], n["gravity"])
        path, rotation = wanted(0.0), rotation_of(m["attitude"])
        e_x, e_v = m["position"] - d["position"], m["velocity"] - d["velocity"]
        drag = -path @ np.diag(n["drag"]) @ path.T @ d["velocity"]
        back = -n["stiffness"] * e_x - n["damping"] * e_v + integral
        force = reachable(n["mass"] * (back + d["acceleration"] - drag + n["gravity"] * UP), n["most_thrust"])
        third = force / np.linalg.norm(force)
        first = np.cross([-np.sin(d["yaw"]), np.cos(d["yaw"]), 0.0], third)
        first /= np.linalg.norm(first)
        attitude = np.column_stack([first, np.cross(third, first), third])
        turn = Rotation.from_matrix(rotation.T @ attitude).as_rotvec()
        rates = n["attitude"] * turn + rotation.T @ path @ turning(wanted)[0]
        level = (rotation.T @ m["velocity"])[:2]
        assert asked.thrust == pytest.approx(force @ rotation @ UP - n["mass"] * n["lift"] * level @ level, rel=1e-8)
        np.testing.assert_allclose(list(asked.rates), rates, rtol=1e-5, atol=1e-5)
        angles = Rotation.from_matrix(attitude).as_euler("ZYX")
        np.testing.assert_allclose(list(asked.desired_attitude), angles, rtol=1e-8, atol=1e-8)
        integral = integral - PERIOD * n["integral"] * e_x
        integral *= min(1.0, n["integral_bound"] / np.linalg.norm(integral))


def test_it_is_finite_where_flatness_is_not():
    falling = Reference(*[vector(0.0, 0.0, 0.0)] * 2, vector(0.0, 0.0, -9.81), 0.0, 0.0)
    found = flat(falling, vector(0.0, 0.0, 0.0), 9.81)
    assert np.isfinite([*found.rates, *(entry for row in found.rotation for entry in row)]).all()
    assert [away_from_zero(x) for x in (0.2, 0.05, 0.0, -0.05, -0.2)] == [0.2, 0.1, 0.1, -0.1, -0.2]
    assert list(unit(vector(0.0, 1e-3, 0.0))) == pytest.approx([0.0, 1.0, 0.0])
    assert list(unit(vector(0.0, 1e-6, 0.0))) == pytest.approx([0.0, 1.0, 0.0])


def circle(**controller):
    path = {"type": "circle", "radius": 2.0, "period": 3.0, "centre": [0.0, 0.0, 5.0], "turns": 50.0, "ramp": 3.0}
    content = {"vehicle": {"preset": "x500"}, "path": path, "controller": {"type": "flatness", **controller}}
    return MultirotorMission.model_validate({**content, "simulation": {"duration": 9.0}, "score_from": 6.0})


def test_knowing_the_drag_pays_on_a_fast_circle():
    none = {"k_i": 0.0}
    knows, not_told = (fly(circle(**none, **one)).metrics()["position_rmse[m]"] for one in ({}, {"drag": 0.0}))
    assert knows < 0.4 * not_told


def test_the_drag_that_a_controller_believes_is_that_of_rotors_in_hover():
    """Four rotors of the X500: 0.803, 0.803, 1.014 N s/m at 809 rad/s, over its mass; said by the preset's source."""
    vehicle = load_preset("x500")
    hover = np.sqrt(vehicle.mass * vehicle.gravity / 4.0 / vehicle.rotor.thrust_coefficient)
    wanted = np.array([0.803, 0.803, 1.014]) * hover / 809.0 / vehicle.mass
    np.testing.assert_allclose(list(vehicle.model().drag), wanted, rtol=2e-3)
    still = load_preset("x500").model_copy(update={"effects": vehicle.effects.model_copy(update={"drag": False})})
    assert list(still.model().drag) == [0.0, 0.0, 0.0]


def test_the_lift_that_it_believes_is_that_of_all_rotors_over_the_mass():
    vehicle = load_preset("hummingbird")
    assert vehicle.model().lift == pytest.approx(4.0 * vehicle.drag.translational_lift / vehicle.mass)
    assert vehicle.model().lift > 0.0
