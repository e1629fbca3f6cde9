"""The paper's controller, Eqs 11-54, against NumPy and against its own error dynamics."""

import numpy as np
import pytest

from quadstep.control.backstepping import Backstepping, BacksteppingMemory, desired_force, desired_torque
from quadstep.control.filters import Filtered, command_filter
from quadstep.control.vectoring import invert_force
from quadstep.interfaces.plant import Kinematics, Reference
from quadstep.numbers import matrix, vector
from quadstep.vehicle.paper import acceleration, angular_acceleration, coriolis, effective_inertia
from tests.flights import array, column, gains, random_state, state, vehicle

LAW = Backstepping()
RNG = np.random.default_rng(71)
UNEQUAL = np.array([5.0, 8.0, 12.0])
PERIOD = 0.004


def random_gains(start=0.0):
    weights = [matrix(*RNG.normal(size=(10, 3)).tolist()) for _ in range(2)]
    vectors = {
        name: column(RNG.uniform(0.5, 4, 3)) for name in ("slope_1", "gain_1", "integral_1", "slope_2", "gain_2", "integral_2")
    }
    return gains(start=start, mass=1.7, gravity=9.5, weights_1=weights[0], weights_2=weights[1], **vectors)


def random_memory(design):
    integral_1, integral_2 = (column(RNG.normal(size=3)) for _ in range(2))
    filtered = Filtered(column(RNG.normal(size=2)), column(RNG.normal(size=2)))
    return BacksteppingMemory(integral_1, integral_2, filtered, design.weights_1, design.weights_2)


def random_reference():
    position, velocity, acceleration = (column(RNG.normal(size=3)) for _ in range(3))
    return Reference(position, velocity, acceleration, *RNG.normal(size=2).tolist())


def by_numpy(memory, measured, path, design, learning):
    """Everything one sample computes, written again with NumPy from the paper's equations."""
    xi, xi_dot, eta, eta_dot = (array(part) for part in measured)
    l1, k1, i1, l2, k2, i2 = (
        array(part)
        for part in (design.slope_1, design.gain_1, design.integral_1, design.slope_2, design.gain_2, design.integral_2)
    )
    w1, w2 = array(memory.weights_1), array(memory.weights_2)
    s1, s2 = array(memory.integral_1), array(memory.integral_2)

    def mu(net, inputs):
        weights = array(net.input_weights)
        return 1 / (1 + np.exp(-(weights @ [*inputs, 1.0])))

    e1 = array(path.position) - xi
    r1 = array(path.velocity) - xi_dot + l1 * e1
    mu1 = mu(design.force_net, [*xi, *r1, *eta, *eta_dot])
    m_g = np.array([0, 0, -design.mass * design.gravity])
    force = design.mass * array(path.acceleration) - design.mass * l1**2 * e1 - m_g + k1 * r1 + i1 * s1
    force = force + learning * (w1.T @ mu1)
    fx, fy, fz = force
    u, theta, phi = np.linalg.norm(force), np.arctan2(-fx, np.hypot(fy, fz)), np.arctan2(fy, fz)
    e2 = np.array([path.yaw, *memory.filtered.value]) - eta
    r2 = np.array([path.yaw_rate, *memory.filtered.rate]) - eta_dot + l2 * e2
    mu2 = mu(design.torque_net, [*eta, *r1, *r2])
    torque = learning * (w2.T @ mu2) + k2 * r2 + i2 * s2
    norm = np.linalg.norm([*r1, *r2])
    return {
        "thrust": u,
        "torque": torque,
        "desired": [path.yaw, theta, phi],
        "r1": r1,
        "r2": r2,
        "stored": 0.5 * (s1 @ (i1 * s1) + s2 @ (i2 * s2)),
        "norms": [np.linalg.norm(w1), np.linalg.norm(w2)],
        "integral_1": s1 + PERIOD * r1,
        "integral_2": s2 + PERIOD * r2,
        "weights_1": w1 + learning * PERIOD * (5 * np.outer(mu1, r1) - 0.01 * norm * 5 * w1),
        "weights_2": w2 + learning * PERIOD * (5 * np.outer(mu2, r2) - 0.01 * norm * 5 * w2),
    }


@pytest.mark.parametrize("case", range(6))
@pytest.mark.parametrize("learning", [True, False])
def test_one_sample_is_what_the_equations_give_in_numpy(case, learning):
    design = random_gains(start=2.0)
    memory, measured, path = random_memory(design), random_state(RNG), random_reference()
    command, following = LAW.law(memory, measured, path, design, 2.0 if learning else 1.999, PERIOD)
    got = {
        "thrust": command.thrust,
        "torque": array(command.torque),
        "desired": array(command.desired_attitude),
        "r1": array(command.r1),
        "r2": array(command.r2),
        "stored": command.stored,
        "norms": array(command.weight_norms),
        "integral_1": array(following.integral_1),
        "integral_2": array(following.integral_2),
        "weights_1": array(following.weights_1),
        "weights_2": array(following.weights_2),
    }
    wanted = by_numpy(memory, measured, path, design, float(learning))
    for name, value in wanted.items():
        np.testing.assert_allclose(got[name], value, rtol=1e-11, atol=1e-12, err_msg=name)
    filtered = command_filter(memory.filtered, vector(*wanted["desired"][1:]), design.filter_frequency, PERIOD)
    np.testing.assert_allclose(array(following.filtered.value), array(filtered.value), rtol=1e-11)
    np.testing.assert_allclose(array(following.filtered.rate), array(filtered.rate), rtol=1e-9)


def test_memory_starts_with_empty_integrals_the_measured_tilt_and_the_given_weights():
    design = random_gains()
    memory = LAW.start(state(attitude=(1, 2, 3), rates=(4, 5, 6)), design)
    assert [*memory.integral_1, *memory.integral_2] == [0.0] * 6
    assert [*memory.filtered.value, *memory.filtered.rate] == [2, 3, 5, 6]
    assert memory.weights_1 is design.weights_1
    assert memory.weights_2 is design.weights_2


@pytest.mark.parametrize("case", range(5))
def test_perfect_attitude_gives_the_position_error_dynamics_of_eqs_20_and_26(case):
    design = random_gains()
    measured, path = random_state(RNG), random_reference()
    integral, estimate, disturbance = (column(RNG.normal(size=3)) for _ in range(3))
    lam, k, ki = array(design.slope_1), array(design.gain_1), array(design.integral_1)
    e1 = array(path.position) - array(measured.position)
    r1 = array(path.velocity) - array(measured.velocity) + lam * e1
    u, theta, phi = invert_force(desired_force(design, path, column(e1), column(r1), integral, estimate))
    body = vehicle(mass=design.mass, gravity=design.gravity)
    xi_dd = array(acceleration(body, vector(0.3, theta, phi), u, disturbance))
    r1_dot = array(path.acceleration) - xi_dd + lam * (r1 - lam * e1)
    m = design.mass
    mistaken = array(disturbance) + array(estimate)  # A - A_hat, A_hat = -W_hat^T mu (Eq. 23)
    wanted = -(k - m * lam) * r1 - mistaken - ki * array(integral)
    np.testing.assert_allclose(m * r1_dot, wanted, atol=1e-12)


@pytest.mark.parametrize("case", range(5))
@pytest.mark.parametrize("kinematics", Kinematics)
def test_torque_law_gives_the_attitude_error_dynamics_of_eqs_37_and_38(case, kinematics):
    design = random_gains()
    measured = random_state(RNG)
    eta, eta_dot = array(measured.attitude), array(measured.rates)
    desired, desired_dot, desired_dd = RNG.normal(size=(3, 3))
    integral, estimate, disturbance = RNG.normal(size=(3, 3))
    lam, k, ki = array(design.slope_2), array(design.gain_2), array(design.integral_2)
    e2 = desired - eta
    r2 = desired_dot - eta_dot + lam * e2
    tau = array(desired_torque(design, column(r2), column(integral), column(estimate)))
    body = vehicle(UNEQUAL)
    eta_dd = array(angular_acceleration(body, measured.attitude, measured.rates, column(tau + disturbance), kinematics))
    r2_dot = desired_dd - eta_dd + lam * (desired_dot - eta_dot)
    j = array(effective_inertia(measured.attitude, body.inertia, kinematics))
    c = array(coriolis(measured.attitude, measured.rates, body.inertia, kinematics))
    unknown = j @ desired_dd - disturbance + c @ (desired_dot + lam * e2) - j @ (lam**2 * e2)  # Eq. 33
    wanted = unknown - estimate + j @ (lam * r2) - c @ r2 - k * r2 - ki * integral
    np.testing.assert_allclose(j @ r2_dot, wanted, atol=1e-11)
