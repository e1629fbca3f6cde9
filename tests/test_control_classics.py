"""Geometric tracking and the cascaded PID against NumPy and SciPy, at random samples with random gains, none of them equal."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.random_samples import (
    UP,
    any_measured,
    any_reference,
    arrays,
    attitude_errors,
    frame,
    law_of,
    reachable,
    rotation_of,
    shaken,
    turning,
)

PERIOD, SLOWER = 0.002, 3
BOUNDS = [(1, 1.0), (2, 1e3), (3, 1e-5)]
"""Seeds, and what bounds are multiplied with: some hold, some do not."""


def shortened(vector, most):
    return vector * min(1.0, most / np.linalg.norm(vector))


def same(command, thrust, torque, wanted):
    assert command.thrust == pytest.approx(thrust, rel=1e-9)
    np.testing.assert_allclose(list(command.torque), torque, rtol=1e-6, atol=1e-6 * np.linalg.norm(torque))
    angles = Rotation.from_matrix(wanted).as_euler("ZYX")
    np.testing.assert_allclose(list(command.desired_attitude), angles, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(("seed", "bounds"), BOUNDS)
def test_geometric_tracking_is_lees(seed, bounds):
    """The force over time follows from the path and from how the body moves under the thrust that it makes."""
    random = np.random.default_rng(seed)
    law, gains = law_of("geometric")
    gains = shaken(gains, random, bounds)
    g, first = arrays(gains), any_measured(random)
    memory, integral = law.start(first, gains), np.zeros(3)
    for _ in range(12):
        measured, reference = any_measured(random), any_reference(random)
        command, memory = law.law(memory, measured, reference, gains, 0.5, PERIOD)
        m, d = arrays(measured), arrays(reference)
        rotation, made = rotation_of(m["attitude"]), m["thrust"] / g["mass"]
        e = [d["position"] - m["position"], d["velocity"] - m["velocity"]]
        e.append(d["acceleration"] - made * rotation @ UP + g["gravity"] * UP)
        e.append(d["jerk"] - made * rotation @ np.cross(m["rates"], UP))

        def force(t, d=d, e=e, stored=integral):
            path = d["acceleration"] + d["jerk"] * t + d["snap"] * t**2 / 2.0
            pull = g["stiffness"] * (e[0] + e[1] * t + e[2] * t**2 / 2.0)
            brake = g["damping"] * (e[1] + e[2] * t + e[3] * t**2 / 2.0)
            rest = g["integral"] * (stored + e[0] * t + e[1] * t**2 / 2.0)
            return g["mass"] * (path + pull + brake + rest + g["gravity"] * UP)

        def attitude(t, d=d, force=force):
            return frame(force(t), d["yaw"] + d["yaw_rate"] * t)

        wanted, e_r, e_w, forward = attitude_errors(attitude, rotation, m["rates"], h=5e-4)
        angular = forward - g["turn_stiffness"] * e_r - g["turn_damping"] * e_w
        torque = g["inertia"] * angular + np.cross(m["rates"], g["inertia"] * m["rates"])
        same(command, force(0.0) @ rotation @ UP, torque, wanted)
        integral = shortened(integral + PERIOD * e[0], g["integral_bound"])


@pytest.mark.parametrize(("seed", "bounds"), BOUNDS)
@pytest.mark.parametrize("limits", [{}, {"axis_speed": 0.2, "most_tilt": 0.2}])
def test_the_cascaded_pid_is_its_four_loops(seed, bounds, limits):
    """The position loop runs at every third sample only."""
    random = np.random.default_rng(seed)
    law, gains = law_of("pid")
    gains = shaken(gains, random, bounds)
    gains = gains._replace(outer=gains.outer._replace(**limits))
    g, first = arrays(gains) | arrays(gains.outer), any_measured(random)
    memory = law.start(first, gains)
    i_v, i_w, filtered = np.zeros(3), np.zeros(3), arrays(first)["rates"]
    for sample in range(12):
        measured, reference = any_measured(random), any_reference(random)
        m, d = arrays(measured), arrays(reference)
        if sample % SLOWER == 0:
            memory = law.guide(memory, measured, reference, gains, 0.5, SLOWER * PERIOD)
            towards = np.clip(g["position"] * (d["position"] - m["position"]), -g["axis_speed"], g["axis_speed"])
            e_v = d["velocity"] + shortened(towards, g["most_speed"]) - m["velocity"]
            asked = g["mass"] * (d["acceleration"] + g["velocity"] * e_v + i_v + g["gravity"] * UP)
            force = reachable(asked, g["most_thrust"])
            force[:2] *= min(1.0, force[2] * np.tan(min(g["most_tilt"], 0.5 * np.pi)) / np.hypot(*force[:2]))
            gained = g["velocity_integral"] * e_v + 2.0 * (force - asked) / g["mass"]
            i_v = shortened(i_v + SLOWER * PERIOD * gained, g["integral_bound"])
            wanted = frame(force, d["yaw"])
            fed, _ = turning(lambda t, f=force, d=d: frame(f, d["yaw"] + d["yaw_rate"] * t), 5e-4)
        command, memory = law.law(memory, measured, reference, gains, 0.5, PERIOD)
        rotation = rotation_of(m["attitude"])
        turn = Rotation.from_matrix(rotation.T @ wanted).as_rotvec()
        e_w = shortened(g["attitude"] * turn + fed, g["most_rate"]) - m["rates"]
        before, filtered = filtered, m["rates"] + np.exp(-g["rate_filter"] * PERIOD) * (filtered - m["rates"])
        angular = g["rate"] * e_w + i_w - g["rate_derivative"] * (filtered - before) / PERIOD
        same(command, force @ rotation @ UP, g["inertia"] * angular, wanted)
        i_w = shortened(i_w + PERIOD * g["rate_integral"] * e_w, g["rate_integral_bound"])
