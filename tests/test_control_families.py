"""INDI, L1, adaptation, ADRC and super-twisting against NumPy and SciPy, written from the papers with their own signs.

Every law is asked for commands at random samples with random gains, none of which are equal, and has to give what an
independent implementation gives, over enough samples for its memory to matter. Then what a paper promises: closed forms and
convergence.
"""

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import lsim
from scipy.spatial.transform import Rotation

from quadstep.interfaces.controller import Measured
from quadstep.interfaces.plant import Reference
from quadstep.mission.derived import section_of
from quadstep.mission.listings import load_preset
from quadstep.numbers import Vector, vector
from quadstep.numbers.rotations import IDENTITY
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
)

ZERO = vector(0.0, 0.0, 0.0)
PERIOD = 0.002
NONE = np.zeros(3)


class Numpy:
    """What all of them share. `step` gives thrust, torque, r1 and r2 for arrays of what is measured and wanted."""

    def __init__(self, gains, measured):
        self.g = {key: arrays(value) if hasattr(value, "_asdict") else value for key, value in arrays(gains).items()}
        self.body = self.g["body"]
        self.mass, self.gravity, self.inertia = self.body["mass"], self.body["gravity"], self.body["inertia"]
        self.made = np.array([self.mass * self.gravity, 0.0, 0.0, 0.0])
        self.begin(measured)

    def sample(self, measured, reference):
        self.m, self.d = measured, reference
        self.rotation = rotation_of(measured["attitude"])
        self.axis = self.rotation @ UP
        self.e_x = measured["position"] - reference["position"]
        self.e_v = measured["velocity"] - reference["velocity"]
        asked = np.array([measured["thrust"], *measured["torque"]])
        self.made = asked + np.exp(-PERIOD / self.body["lag"]) * (self.made - asked)
        return self.step()

    def point(self, acceleration):
        """Lee's errors to the attitude for an acceleration."""
        d = self.d
        self.force = reachable(self.mass * (acceleration + self.gravity * UP), self.body["most_thrust"])

        def attitude(t):
            force = self.force + self.mass * (d["jerk"] * t + d["snap"] * t**2 / 2.0)
            return frame(force, d["yaw"] + d["yaw_rate"] * t)

        self.wanted, self.e_r, self.e_w, self.forward = attitude_errors(attitude, self.rotation, self.m["rates"])

    def torque(self, angular):
        return self.inertia * angular + np.cross(self.m["rates"], self.inertia * self.m["rates"])

    def free(self):
        """Acceleration and angular acceleration by what is known."""
        w = self.m["rates"]
        spun = np.linalg.solve(np.diag(self.inertia), self.made[1:] - np.cross(w, self.inertia * w))
        return self.made[0] / self.mass * self.axis - self.gravity * UP, spun

    def proportional(self):
        pull, turn = self.g["pull"], self.g["turn"]
        back = self.d["acceleration"] - pull["stiffness"] * self.e_x - pull["damping"] * self.e_v
        return back, lambda: self.forward - turn["stiffness"] * self.e_r - turn["damping"] * self.e_w

    def begin(self, measured):
        pass


class Adrc(Numpy):
    def begin(self, measured):
        zero = np.zeros(3)
        self.x = np.array([measured["position"], measured["velocity"], zero])
        self.y = np.array([measured["rates"], zero])

    def step(self):
        w, v, g = self.g["observer"], self.g["turn_observer"], self.g
        push, spin = self.free()
        zero = np.zeros(3)
        off, off_r = self.m["position"] - self.x[0], self.m["rates"] - self.y[0]
        shift = np.diag([1.0, 1.0], 1)
        self.x = self.x + PERIOD * (shift @ self.x + [zero, push, zero] + np.outer([3 * w, 3 * w**2, w**3], off))
        self.y = self.y + PERIOD * (np.array([self.y[1] + spin, zero]) + np.array([2 * v * off_r, v**2 * off_r]))
        self.x[2] = np.clip(self.x[2], -g["bound"], g["bound"])
        self.y[1] = np.clip(self.y[1], -g["turn_bound"], g["turn_bound"])
        c, r = g["bandwidth"], g["turn_bandwidth"]
        self.point(self.d["acceleration"] - c**2 * self.e_x - 2 * c * self.e_v - self.x[2])
        angular = self.forward - r**2 * self.e_r - 2 * r * self.e_w - self.y[1]
        return self.force @ self.axis, self.torque(angular)


class L1(Numpy):
    def begin(self, measured):
        self.z = np.concatenate([measured["velocity"], measured["rates"]])
        self.off, self.s, self.u_t, self.u_l, self.u_1, self.u_2 = np.zeros(6), np.zeros(6), 0.0, *np.zeros((3, 3))

    def step(self):
        g = self.g
        a = np.diag([-g["pole"]] * 3 + [-g["turn_pole"]] * 3)
        self.z = self.z + PERIOD * (np.concatenate(self.free()) + self.s + a @ self.off)
        self.off = self.z - np.concatenate([self.m["velocity"], self.m["rates"]])
        phi = np.linalg.inv(a) @ (expm(a * PERIOD) - np.eye(6))
        most = np.array([g["bound"]] * 3 + [g["turn_bound"]] * 3)
        self.s = np.clip(-np.linalg.inv(phi) @ expm(a * PERIOD) @ self.off, -most, most)
        matched = self.axis @ self.s[:3]
        kept = {key: np.exp(-g[f"{key}_cutoff"] * PERIOD) for key in ("thrust", "tilt", "turn")}
        self.u_t = kept["thrust"] * self.u_t + (1 - kept["thrust"]) * matched
        self.u_l = kept["tilt"] * self.u_l + (1 - kept["tilt"]) * (np.eye(3) - np.outer(self.axis, self.axis)) @ self.s[:3]
        self.u_1 = kept["turn"] * self.u_1 + (1 - kept["turn"]) * self.s[3:]
        self.u_2 = kept["turn"] * self.u_2 + (1 - kept["turn"]) * self.u_1
        back, angular = self.proportional()
        self.point(back - self.u_l)
        return self.force @ self.axis - self.mass * self.u_t, self.torque(angular() - self.u_2)


class Adaptive(Numpy):
    def begin(self, measured):
        self.t_x, self.t_r = np.zeros((2, 3)), np.zeros((2, 3))

    def step(self):
        g, w = self.g, self.m["rates"]
        of_v = np.hstack([np.eye(3), -self.rotation @ np.diag(self.rotation.T @ self.m["velocity"])])
        of_w = np.hstack([np.eye(3), -np.diag(w)])
        back, angular = self.proportional()
        self.point(back - of_v @ self.t_x.ravel())
        answer = self.force @ self.axis, self.torque(angular() - of_w @ self.t_r.ravel())
        rates = np.array([[g["adaptation"]], [g["drag_adaptation"]]])
        self.t_x = self.t_x + PERIOD * rates * (of_v.T @ (self.e_v + g["coupling"] * self.e_x)).reshape(2, 3)
        rates = np.array([g["turn_adaptation"], [g["turn_drag_adaptation"]] * 3])
        self.t_r = self.t_r + PERIOD * rates * (of_w.T @ (self.e_w + g["turn_coupling"] * self.e_r)).reshape(2, 3)
        for t, names in ((self.t_x, ("bound", "drag_bound")), (self.t_r, ("turn_bound", "turn_drag_bound"))):
            for k, name in enumerate(names):
                t[k] *= min(1.0, g[name] / np.linalg.norm(t[k]))
        return answer


class SuperTwisting(Numpy):
    def begin(self, measured):
        self.v, self.v_r = np.zeros(3), np.zeros(3)

    def step(self):
        g = self.g
        s = -self.e_v - g["slope"] * self.e_x

        def root(s, layer):
            return np.sign(s) * np.abs(s) / np.sqrt(np.abs(s) + layer)

        self.point(self.d["acceleration"] - g["slope"] * self.e_v + g["reaching"] * root(s, g["layer"]) + self.v)
        s_r = -self.e_w - g["turn_slope"] * self.e_r
        angular = self.forward - g["turn_slope"] * self.e_w + g["turn_reaching"] * root(s_r, g["turn_layer"]) + self.v_r
        smooth, smooth_r = s / (np.abs(s) + g["layer"]), s_r / (np.abs(s_r) + g["turn_layer"])
        self.v = np.clip(self.v + PERIOD * g["twisting"] * smooth, -g["bound"], g["bound"])
        self.v_r = np.clip(self.v_r + PERIOD * g["turn_twisting"] * smooth_r, -g["turn_bound"], g["turn_bound"])
        return self.force @ self.axis, self.torque(angular), s, s_r


class Indi(Numpy):
    feels = True

    def begin(self, measured):
        self.pushed, self.felt = self.gravity * UP, self.gravity * UP if self.feels else measured["velocity"]
        self.w = np.array([measured["rates"]] * 2)
        self.t = np.zeros((2, 3))

    def step(self):
        g, before = self.g, self.w[1].copy()
        if self.feels:
            thrusts = g["per_speed"] * self.m["rotor_speeds"] ** 2
            self.made = np.array([list(row) for row in g["mixing"]]) @ thrusts
        keep, keep_r = np.exp(-g["force_filter"] * PERIOD), np.exp(-g["torque_filter"] * PERIOD)
        self.pushed = keep * self.pushed + (1 - keep) * self.made[0] / self.mass * self.axis
        if self.feels:
            self.felt = keep * self.felt + (1 - keep) * self.rotation @ self.m["specific_force"]
            felt = self.felt
        else:  # filtered derivative of the velocity, less gravity
            self.felt = keep * self.felt + (1 - keep) * self.m["velocity"]
            felt = g["force_filter"] * (self.m["velocity"] - self.felt) + self.gravity * UP
        back, angular = self.proportional()
        self.point(back + self.pushed - felt)
        for line, new in ((self.w, self.m["rates"]), (self.t, self.made[1:])):
            line[0] = keep_r * line[0] + (1 - keep_r) * new
            line[1] = keep_r * line[1] + (1 - keep_r) * line[0]
        turning = (self.w[1] - before) / PERIOD
        return self.force @ self.axis, self.t[1] + self.inertia * (angular() - turning)


class IndiVelocity(Indi):
    feels = False


FAMILIES = {
    "adrc": Adrc, "geometric-l1": L1, "geometric-adaptive": Adaptive, "super-twisting": SuperTwisting, "indi": Indi,
    "indi-velocity": IndiVelocity,
}  # fmt: skip


@pytest.mark.parametrize("kind", FAMILIES)
@pytest.mark.parametrize(("seed", "bounds"), [(1, 1.0), (2, 1e3), (3, 1e-5)])
def test_it_commands_what_numpy_makes_of_the_paper(kind, seed, bounds):
    random = np.random.default_rng(seed)
    law, gains = law_of(kind)
    gains = shaken(gains, random, bounds)
    hidden = {} if "specific_force" in law.also_measures else {"specific_force": vector(), "rotor_speeds": vector()}
    first = any_measured(random, **hidden)
    memory, independent = law.start(first, gains), FAMILIES[kind](gains, arrays(first))
    for _ in range(12):
        measured, reference = any_measured(random, **hidden), any_reference(random)
        command, memory = law.law(memory, measured, reference, gains, 0.5, PERIOD)
        thrust, torque, r1, r2 = (*independent.sample(arrays(measured), arrays(reference)), NONE, NONE)[:4]
        assert command.thrust == pytest.approx(thrust, rel=1e-9)
        np.testing.assert_allclose(list(command.torque), torque, rtol=1e-6, atol=1e-6 * np.linalg.norm(torque))
        np.testing.assert_allclose(list(command.r1), r1, rtol=1e-12)
        np.testing.assert_allclose(list(command.r2), r2, rtol=1e-6, atol=1e-6)
        angles = Rotation.from_matrix(independent.wanted).as_euler("ZYX")
        np.testing.assert_allclose(list(command.desired_attitude), angles, rtol=1e-9, atol=1e-9)


STILL = Reference(ZERO, ZERO, ZERO, 0.0, 0.0)


def level(gains, t, push, **known):
    """At time t a body that is pushed by an acceleration from t = 0 on while its rotors carry its weight."""
    weight = gains.body.mass * gains.body.gravity
    return Measured(
        Vector(0.5 * t * t * one for one in push), Vector(t * one for one in push), IDENTITY, ZERO, weight, ZERO, **known
    )


def test_the_observer_of_adrc_finds_a_push_with_all_its_poles_at_its_bandwidth():
    law, gains = law_of("adrc")
    push, period = np.array([0.7, -0.4, 0.2]), 1e-4
    memory = law.start(level(gains, 0.0, push), gains)
    t = period * np.arange(1, 6001)
    found = []
    for one in t:
        memory = law.observed(memory, level(gains, one, push), gains, one, period)
        found.append(list(memory.disturbance))
    w = gains.observer
    _, response, _ = lsim(([w**3], [1.0, 3.0 * w, 3.0 * w**2, w**3]), np.ones_like(t), t)
    np.testing.assert_allclose(found, np.outer(response, push), atol=2e-3)
    assert response[-1] > 0.85


def test_the_estimate_of_l1_is_there_after_two_samples_and_passes_its_filters():
    law, gains = law_of("geometric-l1")
    push = np.array([0.7, -0.4, 0.2])
    memory = law.start(level(gains, 0.0, push), gains)
    t = PERIOD * np.arange(1, 501)
    for k, one in enumerate(t):
        memory = law.estimated(memory, level(gains, one, push), gains, one, PERIOD)
        if k > 0:
            np.testing.assert_allclose(list(memory.unknown), push, rtol=2.0 * gains.pole * PERIOD)
    passed = 1.0 - np.exp(-gains.thrust_cutoff * t[-1]), 1.0 - np.exp(-gains.tilt_cutoff * t[-1])
    assert memory.along == pytest.approx(0.2 * passed[0], rel=0.02)
    np.testing.assert_allclose(list(memory.across), [0.7 * passed[1], -0.4 * passed[1], 0.0], rtol=0.02, atol=1e-12)


def test_indi_asks_for_what_is_missing_once_its_filter_has_let_it_through():
    law, gains = law_of("indi")
    weight = gains.body.mass * gains.body.gravity
    speeds = Vector(float(one) for one in np.sqrt(weight / 4.0 / gains.per_speed) * np.ones(4))
    felt = vector(0.5, -0.3, gains.body.gravity - 0.2)
    still = Measured(ZERO, ZERO, IDENTITY, ZERO, weight, ZERO, felt, speeds)
    memory = law.start(still._replace(specific_force=vector(0.0, 0.0, gains.body.gravity)), gains)
    for _ in range(100):
        command, memory = law.law(memory, still, STILL, gains, 0.0, PERIOD)
    passed = 1.0 - np.exp(-gains.force_filter * 100 * PERIOD)
    assert command.thrust == pytest.approx(weight + 0.2 * gains.body.mass * passed, rel=1e-9)
    axis = Rotation.from_euler("ZYX", list(command.desired_attitude)).as_matrix()[:, 2]
    lean = np.array([-0.5, 0.3]) * gains.body.mass * passed / command.thrust
    np.testing.assert_allclose(axis[:2] / axis[2], lean, rtol=1e-9)


def test_super_twisting_reaches_its_surface_in_finite_time_and_holds_it_against_what_changes():
    """Its acceleration on a double integrator whose push changes by at most 1.5 m/s^3, k_1 > 1.5 sqrt(L), k_2 > 1.1 L."""
    law, gains = law_of("super-twisting")
    four = vector(4.0, 4.0, 4.0)
    gains = gains._replace(layer=1e-6, slope=four, reaching=four, twisting=four, lipschitz=1.5)
    assert all(one.holds for one in law.conditions(gains, None))
    assert not any(one.holds for one in law.conditions(gains._replace(lipschitz=8.0), None))
    dt, z, speed = 1e-3, 0.4, 0.0
    memory, sizes = law.start(level(gains, 0.0, (0.0, 0.0, 0.0)), gains), []
    for k in range(6000):
        now = level(gains, 0.0, (0.0, 0.0, 0.0))._replace(position=vector(0.0, 0.0, z), velocity=vector(0.0, 0.0, speed))
        command, memory = law.law(memory, now, STILL, gains, 0.0, dt)
        sizes.append(abs(command.r1[2]))
        speed += dt * (command.thrust / gains.body.mass - gains.body.gravity + 1.5 * np.sin(k * dt))
        z += dt * speed
    assert sizes[0] > 1.0
    assert max(sizes[3000:]) < 2e-3
    assert abs(memory.integral[2] + 1.5 * np.sin(6.0)) < 0.05


def test_adaptation_ends_at_the_push_that_acts():
    """On the plant of the position, without drag: what is learnt takes the place of the error."""
    law, gains = law_of("geometric-adaptive")
    dt, z, speed = 2e-3, 0.0, 0.0
    memory = law.start(level(gains, 0.0, (0.0, 0.0, 0.0)), gains._replace(drag_adaptation=0.0))
    for _ in range(8000):
        now = level(gains, 0.0, (0.0, 0.0, 0.0))._replace(position=vector(0.0, 0.0, z), velocity=vector(0.0, 0.0, speed))
        command, memory = law.law(memory, now, STILL, gains, 0.0, dt)
        speed += dt * (command.thrust / gains.body.mass - gains.body.gravity - 1.3)
        z += dt * speed
    assert memory.push[2] == pytest.approx(-1.3, abs=0.01)
    assert abs(z) < 1e-3


@pytest.mark.parametrize("vehicle", ["research-2.6kg", "crazyflie", "x500"])
@pytest.mark.parametrize("kind", FAMILIES)
def test_gains_that_are_left_out_scale_with_the_vehicle(kind, vehicle):
    model = load_preset(vehicle).model()
    usual, scaled = law_of(kind)[1], section_of(type(law_of(kind)[0]))(type=kind).gains(model).decided()
    for name in ("pull", "turn"):
        if hasattr(usual, name):
            ratio = getattr(scaled, name).damping[0] / getattr(usual, name).damping[0]
            assert ratio == pytest.approx(model.agility)
            assert getattr(scaled, name).stiffness[2] / getattr(usual, name).stiffness[2] == pytest.approx(
                (model.yaw_agility if name == "turn" else model.agility) ** 2
            )
    assert scaled.body.lag == model.lag


@pytest.mark.parametrize("kind", ["adrc", "geometric-l1", "indi-velocity"])
def test_rotors_that_have_not_been_asked_for_anything_yet_carry_the_weight(kind):
    law, gains = law_of(kind)
    weight = gains.body.mass * gains.body.gravity
    idle = Measured(ZERO, ZERO, IDENTITY, ZERO, 0.0, ZERO)
    command, memory = law.law(law.start(idle, gains), idle, STILL, gains, 0.0, PERIOD)
    assert command.thrust == pytest.approx(weight, rel=1e-12)
    assert memory.made.thrust == pytest.approx(weight, rel=1e-12)
    _, memory = law.law(memory, idle, STILL, gains, PERIOD, PERIOD)
    assert memory.made.thrust == pytest.approx(weight * np.exp(-PERIOD / gains.body.lag), rel=1e-12)
