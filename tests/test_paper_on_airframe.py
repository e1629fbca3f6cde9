"""The paper's laws on a real vehicle: the translation both ways is exact, and with ideal rotors the flight is the paper's."""

import math
from dataclasses import dataclass

import numpy as np
import pytest

from quadstep.control.backstepping import Backstepping
from quadstep.control.paper_on_airframe import (
    STEEPEST,
    PaperOnAirframe,
    body_to_world,
    body_torque,
    euler_angles,
    euler_rates,
    paper_state,
)
from quadstep.engines.eager import fly_floats
from quadstep.engines.fly import fly
from quadstep.engines.loop import Loop, runge_kutta_4
from quadstep.interfaces.controller import Command, Measured
from quadstep.interfaces.plant import Kinematics, Reference
from quadstep.mission.derived import section_of
from quadstep.mission.multirotor import MultirotorMission
from quadstep.numbers import Vector, matrix, vector
from quadstep.numbers.rotations import (
    from_rotation_vector,
    from_yaw_pitch_roll,
    multiply,
    normalised,
    quaternion_of,
    rotation_matrix,
    yaw_pitch_roll,
)
from quadstep.vehicle.lagrange import Lagrange, Limits, Parameters
from quadstep.vehicle.paper import Disturbance, Rotors, State, Vehicle, derivative, euler_rate_matrix, thrust_direction
from quadstep.vehicle.rigid_body import MassProperties, Motion, motion_rate
from tests.flights import array, column, same

RNG = np.random.default_rng(331)
ANGLES = [column((RNG.uniform(-3, 3), RNG.uniform(-1.5, 1.5), RNG.uniform(-3, 3))) for _ in range(20)]
BODY = [column(RNG.normal(size=3) * 3) for _ in range(20)]
ATTITUDES = pytest.mark.parametrize(("angles", "about"), list(zip(ANGLES, BODY, strict=True)))


def turn(axis, angle):
    """A rotation about one axis, right-handed."""
    vector_of_it = [0.0, 0.0, 0.0]
    vector_of_it["xyz".index(axis)] = angle
    return array(rotation_matrix(from_rotation_vector(column(vector_of_it))))


# The translation


@ATTITUDES
def test_the_papers_angles_are_those_of_turns_about_x_y_and_z_the_other_way(angles, about):
    psi, theta, phi = angles
    expected = turn("x", -phi) @ turn("y", -theta) @ turn("z", -psi)
    np.testing.assert_allclose(array(body_to_world(angles)), expected, atol=1e-14)
    np.testing.assert_allclose(array(euler_angles(body_to_world(angles))), array(angles), atol=1e-12)


@ATTITUDES
def test_thrust_along_body_z_is_the_papers_thrust_direction(angles, about):
    np.testing.assert_allclose(array(body_to_world(angles))[:, 2], array(thrust_direction(angles)), atol=1e-15)


@ATTITUDES
def test_euler_rates_are_those_of_a_small_turn_about_the_body(angles, about):
    attitude, h = quaternion_of(body_to_world(angles)), 1e-5
    ahead, behind = (
        array(euler_angles(rotation_matrix(multiply(attitude, from_rotation_vector(s * h * about))))) for s in (1.0, -1.0)
    )
    change = (ahead - behind + math.pi) % (2.0 * math.pi) - math.pi
    np.testing.assert_allclose(array(euler_rates(angles, about)), change / (2.0 * h), rtol=1e-6, atol=1e-6)


@ATTITUDES
def test_euler_rates_undo_the_rate_matrix_of_a_rigid_body(angles, about):
    back = euler_rate_matrix(angles, Kinematics.RIGID) @ euler_rates(angles, about)
    np.testing.assert_allclose(array(back), array(about), atol=1e-12)


@ATTITUDES
def test_a_torque_does_the_same_work_on_both_vehicles(angles, about):
    torque = column(RNG.normal(size=3))
    on_body = body_torque(angles, torque)
    assert on_body @ about == pytest.approx(torque @ euler_rates(angles, about), rel=1e-11)
    back = euler_rate_matrix(angles, Kinematics.RIGID).T @ on_body
    np.testing.assert_allclose(array(back), array(torque), atol=1e-12)


def test_level_and_upright_the_signs_are_opposite_and_the_order_reversed():
    level, torque = same(0.0), vector(1.0, 2.0, 3.0)
    assert array(body_torque(level, torque)) == pytest.approx([-3.0, -2.0, -1.0])
    assert array(euler_rates(level, torque)) == pytest.approx([-3.0, -2.0, -1.0])
    yawed = rotation_matrix(from_yaw_pitch_roll(vector(0.3, 0.0, 0.0)))
    assert array(euler_angles(yawed)) == pytest.approx([-0.3, 0.0, 0.0])


@pytest.mark.parametrize("theta", [math.pi / 2, -math.pi / 2, math.pi / 2 - 1e-9])
def test_straight_up_and_down_everything_stays_finite(theta):
    angles = vector(0.3, theta, -0.2)
    for value in (euler_rates(angles, vector(1.0, 2.0, 3.0)), body_torque(angles, vector(1.0, 2.0, 3.0))):
        assert np.abs(array(value)).max() < 6.0 / STEEPEST
    assert np.isfinite(array(euler_angles(body_to_world(angles)))).all()


def test_a_measurement_becomes_the_papers_state():
    attitude = from_yaw_pitch_roll(vector(0.4, -0.2, 0.1))
    measured = Measured(vector(1, 2, 3), vector(4, 5, 6), attitude, vector(7, 8, 9), 10.0, vector(11, 12, 13))
    state = paper_state(measured)
    assert (list(state.position), list(state.velocity)) == ([1, 2, 3], [4, 5, 6])
    np.testing.assert_allclose(array(body_to_world(state.attitude)), array(rotation_matrix(attitude)), atol=1e-15)
    back = euler_rate_matrix(state.attitude, Kinematics.RIGID) @ state.rates
    np.testing.assert_allclose(array(back), [7, 8, 9], atol=1e-13)


# The law


@dataclass(frozen=True)
class Witness:
    """A law of the paper's plant that shows what it was told, and asks for a fixed command."""

    torque: tuple[float, float, float] = (0.1, 0.2, 0.3)
    desired: tuple[float, float, float] = (-0.5, 0.0, 0.0)

    def start(self, measured, gains):
        return measured

    def law(self, memory, measured, reference, gains, t, period):
        command = Command(7.0, Vector(self.torque), desired_attitude=Vector(self.desired), r1=vector(1.0, 2.0, 3.0))
        return command, (measured, reference, gains, t, period)


def asked(yaw, wanted_yaw, law=Witness()):
    attitude = from_yaw_pitch_roll(vector(yaw, 0.1, -0.05))
    measured = Measured(vector(1, 2, 3), vector(4, 5, 6), attitude, vector(0.1, 0.2, 0.3), 10.0, vector(11, 12, 13))
    reference = Reference(vector(3, 2, 1), vector(1, 1, 1), vector(0, 1, 0), wanted_yaw, 0.7)
    command, told = PaperOnAirframe(law).law("memory", measured, reference, "gains", 1.5, 0.002)
    return measured, command, told


@pytest.mark.parametrize("yaw", [0.0, 1.0, 3.0, -3.0])
@pytest.mark.parametrize("wanted", [0.0, 3.1, -3.1, 7.0, -20.0])
def test_yaw_is_followed_the_short_way_round(yaw, wanted):
    measured, _, (state, reference, *rest) = asked(yaw, wanted)
    assert (reference.yaw, reference.yaw_rate, list(reference.position)) == (-wanted, -0.7, [3, 2, 1])
    assert rest == ["gains", 1.5, 0.002]
    psi, theta, phi = state.attitude
    assert abs(reference.yaw - psi) <= math.pi
    np.testing.assert_allclose(
        array(body_to_world(vector(psi, theta, phi))), array(rotation_matrix(measured.attitude)), atol=1e-14
    )


def test_its_command_is_translated_and_the_rest_handed_on():
    measured, command, _ = asked(0.4, 0.5)
    angles = euler_angles(rotation_matrix(measured.attitude))
    assert command.thrust == 7.0
    np.testing.assert_allclose(array(command.torque), array(body_torque(angles, vector(0.1, 0.2, 0.3))), atol=1e-15)
    np.testing.assert_allclose(array(command.desired_attitude), [0.5, 0.0, 0.0], atol=1e-15)
    assert list(command.r1) == [1.0, 2.0, 3.0]


def test_the_desired_attitude_is_logged_in_the_angles_of_the_airframe():
    desired = (-0.5, 0.3, -0.2)
    _, command, _ = asked(0.4, 0.5, Witness(desired=desired))
    wanted = yaw_pitch_roll(quaternion_of(body_to_world(Vector(desired))))
    np.testing.assert_allclose(array(command.desired_attitude), array(wanted), atol=1e-15)
    assert command.desired_attitude[1] == pytest.approx(-0.3, abs=0.1)  # theta > 0 leans back
    assert command.desired_attitude[2] == pytest.approx(0.2, abs=0.2)


# The vehicle

MASS, INERTIA, GRAVITY = 1.3, (0.02, 0.03, 0.04), 9.81
LAGRANGE = Vehicle(MASS, column(INERTIA), GRAVITY, Rotors(0.25, 0.02, 0.0, 1e9))
NO_DISTURBANCE = Disturbance(0.0, same(0.0), same(0.0))
DIAGONAL = matrix(*([INERTIA[i] if i == j else 0.0 for j in range(3)] for i in range(3)))
RIGID = MassProperties(MASS, same(0.0), DIAGONAL)


def both(angles, about, rng):
    """The same random motion in both forms."""
    position, velocity = column(rng.normal(size=3)), column(rng.normal(size=3))
    paper = State(position, velocity, angles, euler_rates(angles, about))
    return paper, Motion(position, velocity, quaternion_of(body_to_world(angles)), about)


def on_rigid_body(motion, thrust, torque):
    """Rate of the rigid body under the paper's thrust and generalised torque."""
    rotation = rotation_matrix(motion.attitude)
    twist = body_torque(euler_angles(rotation), torque)
    return motion_rate(RIGID, rotation, motion, vector(0.0, 0.0, thrust), twist, same(0.0), GRAVITY)


@ATTITUDES
def test_the_papers_plant_is_this_rigid_body(angles, about):
    """Fifty steps under a thrust and generalised torques that change; away from theta = 90 degrees."""
    rng = np.random.default_rng(7)
    paper, motion = both(vector(angles[0], 0.6 * angles[1], angles[2]), 0.3 * about, rng)
    h = 0.001
    for _ in range(50):
        thrust, torque = float(rng.uniform(5, 20)), column(rng.normal(size=3) * 0.2)
        paper = runge_kutta_4(
            lambda s, u=thrust, tau=torque: derivative(LAGRANGE, NO_DISTURBANCE, Kinematics.RIGID, s, u, tau), paper, h
        )
        motion = runge_kutta_4(lambda m, u=thrust, tau=torque: on_rigid_body(m, u, tau), motion, h)
        motion = motion._replace(attitude=normalised(motion.attitude))
    seen = paper_state(Measured(*motion, thrust=0.0, torque=same(0.0)))
    for one, other in zip(paper[:2], seen[:2], strict=True):
        np.testing.assert_allclose(array(one), array(other), atol=1e-10)
    np.testing.assert_allclose(array(body_to_world(paper.attitude)), array(body_to_world(seen.attitude)), atol=1e-9)
    np.testing.assert_allclose(array(paper.rates), array(seen.rates), rtol=1e-8, atol=1e-8)


PATH = {"type": "figure-eight", "length": 2.0, "width": 1.0, "period": 6.0, "ramp": 1.0, "yaw": 0.3, "yaw_rate": 0.2}


def flown_on_both(lag):
    """The log of a mission whose rotors lag by so little [s], and that of the paper's plant under the same law and gains."""
    rotor = {"rise_time": lag, "fall_time": lag, "torque_coefficient": 1e-6, "slowest": 0.0, "fastest": 3000.0}
    clock = {"step": lag, "control_period": 0.001, "guidance_period": 0.01, "air_period": 0.01, "duration": 1.0}
    effects = {"drag": False, "gyroscopic": False}
    content = {
        "vehicle": {"preset": "hummingbird", "rotor": rotor, "effects": effects},
        "path": PATH,
        "controller": {"type": "backstepping", "Lambda2": 12.0, "K_r2": 0.37, "filter_frequency": 14.0},
        "simulation": clock,
    }
    plan = MultirotorMission.model_validate(content).plan()
    airframe = plan.parameters.airframe
    vehicle = Vehicle(airframe.mass, airframe.inertia, airframe.gravity, Rotors(0.25, 0.02, 0.0, 1e9))
    loop = Loop(Lagrange(Kinematics.RIGID), TurnedAround(plan.loop.path), plan.loop.controller.law_on_angles)
    limits = Limits(100.0, 100.0, 1.57)
    numbers = Parameters(vehicle, NO_DISTURBANCE, plan.parameters.path, plan.parameters.gains, limits)
    attitude = euler_angles(rotation_matrix(plan.start.attitude))
    start = State(plan.start.position, plan.start.velocity, attitude, same(0.0))
    ticks = plan.ticks._replace(every=plan.ticks.every[-1:])
    return fly(plan), fly(plan._replace(loop=loop, parameters=numbers, start=start, ticks=ticks))


@dataclass(frozen=True)
class TurnedAround:
    """A path whose yaw is the paper's psi."""

    path: object

    def reference(self, t, parameters):
        wanted = self.path.reference(t, parameters)
        return wanted._replace(yaw=-wanted.yaw, yaw_rate=-wanted.yaw_rate)


def test_with_ideal_rotors_it_flies_as_on_the_papers_plant():
    """What is left is the rotors' lag, and falls with it."""
    apart = []
    for lag in (1e-3, 5e-4):
        real, paper = flown_on_both(lag)
        assert len(real.rows) == len(paper.rows) == 101
        np.testing.assert_array_equal(
            real.table("u", "tau_x", "tau_y", "tau_z"), real.table("u_a", "tau_x_a", "tau_y_a", "tau_z_a")
        )
        places = [log.table("x", "y", "z") for log in (real, paper)]
        apart.append(np.abs(places[0] - places[1]).max())
        assert np.ptp(places[1], axis=0).max() > 0.25
    assert apart[1] < 5e-5
    assert apart[0] / apart[1] == pytest.approx(2.0, rel=0.05)
    attitudes = [array(body_to_world(column(row))) for row in paper.table("psi", "theta", "phi")]
    turned = [array(rotation_matrix(column(row))) for row in real.table("q_w", "q_x", "q_y", "q_z")]
    np.testing.assert_allclose(turned, attitudes, atol=1e-3)
    np.testing.assert_allclose(real.column("u"), paper.column("u"), atol=1e-3)
    np.testing.assert_allclose(real.column("norm_W2"), paper.column("norm_W2"), atol=1e-4)
    assert np.abs(paper.column("psi") - paper.column("psi")[0]).max() > 0.1


def test_the_mission_gives_it_the_papers_gains_scaled_to_the_vehicle():
    vehicle = MultirotorMission.model_validate({"vehicle": {"preset": "hummingbird"}, "path": PATH}).vehicle.build()
    section = section_of(PaperOnAirframe).model_validate({"type": "backstepping", "K_r1": [9.0, 8.0, 7.0]})
    built = section.build(vehicle, None)
    gains = built.gains
    assert built.law == PaperOnAirframe(Backstepping())
    assert section.warnings(vehicle) == []
    assert (gains.mass, list(gains.gain_1)) == (0.5, [9.0, 8.0, 7.0])
    assert list(gains.integral_1) == pytest.approx([9.0, 8.0, 7.0])


def test_over_the_top_it_ends_as_an_outcome_or_goes_on():
    """The paper's law is singular at theta = 90 degrees; on the airframe nothing else is."""
    start = {"attitude": [0.0, 1.5, 0.0], "rates": [0.0, 4.0, 0.0]}
    mission = MultirotorMission.model_validate(
        {
            "vehicle": {"preset": "hummingbird"},
            "path": {**PATH, "centre": [0.0, 0.0, 20.0]},
            "controller": {"type": "backstepping"},
            "start": start,
            "simulation": {"duration": 0.3},
        }
    )
    plan = mission.plan()
    log = fly_floats(plan.loop, plan.parameters, plan.start, plan.ticks)
    assert np.isfinite(log.rows).all()
    assert len(log.rows) > 5
