"""The completed law of docs/theory.md and the rotation law: command and memory after one sample, compared with their formulas
in plain NumPy.
"""

from typing import cast

import numpy as np

from quadstep.control.completed_backstepping import CompletedBackstepping, CompletedGains
from quadstep.control.filters import Filtered, FilteredAttitude
from quadstep.control.rotation_backstepping import (
    FORCE_INPUTS,
    TORQUE_INPUTS,
    RotationBackstepping,
    RotationGains,
    RotationMemory,
)
from quadstep.interfaces.controller import Measured
from quadstep.interfaces.learning import Net
from quadstep.interfaces.plant import Kinematics, Reference
from quadstep.numbers import Matrix, Number, Vector
from quadstep.numbers.rotations import normalised, yaw_pitch_roll
from quadstep.proofs.plain import Plain, apply, blocks, christoffel, inertia, learnt, limited, neurons, rows, size
from quadstep.proofs.theory.trials import LoopBatch, draw_sample
from quadstep.proofs.verify.equation_row import Checks, EquationVerdict, agree, row

COUNT, PERIOD = 300, 0.004
COMPLETED_LAW = "control.completed_backstepping:CompletedBackstepping.law"


def column(number: object) -> Plain:
    """(count, 1)."""
    return np.broadcast_to(np.asarray(number, dtype=float), (COUNT,))[:, None]


def closed_loops() -> LoopBatch:
    """Random closed loops: in some of them bounds are active, in some the nets are off."""
    sample = draw_sample(75, COUNT)
    draw, paper, memory = np.random.default_rng(75), sample.gains.paper, sample.memory.paper
    bounds = [cast(Number, draw.uniform(0.3, 2.0, COUNT)) for _ in range(4)]
    starts = cast(Number, draw.choice([0.0, 1.0, np.inf], COUNT))
    of_weights = [b * m.norm() for b, m in zip(bounds[:2], (memory.weights_1, memory.weights_2), strict=True)]
    of_integrals = [b * v.norm() for b, v in zip(bounds[2:], (memory.integral_1, memory.integral_2), strict=True)]
    gains = CompletedGains(
        paper._replace(learning_start=starts),
        sample.gains.coupling,
        Vector(draw.uniform(0.5, 6.0, (3, COUNT))),
        Vector(of_weights),
        Vector(of_integrals),
    )
    return sample._replace(gains=gains)


def filtered(before: Filtered, command: Plain, w: Plain) -> tuple[Plain, Plain]:
    """Two lags of frequency w after a sample with the command held, from their exact solution."""
    x, x_dot = rows(before.value) - command, rows(before.rate)
    y = x + x_dot / w  # the second stage's input
    decay = np.exp(-w * PERIOD)
    after, after_y = decay * (x + w * PERIOD * y), decay * y
    return command + after, w * (after_y - after)


def direction(tilt: Plain) -> Plain:
    """Direction of the thrust, Eq. 7."""
    theta, phi = tilt.T
    return np.stack([-np.sin(theta), np.cos(theta) * np.sin(phi), np.cos(theta) * np.cos(phi)], axis=1)


@row("completed law", "the law that completes the paper's", "not in the paper: tau = Eq. 35 + P e2 + J (eta_d_dd - "
     "Lambda_2^2 e2 - Lambda_2 c + c_dot) + C (eta_d_dot + Lambda_2 e2 + c), c = filtered P^-1 u_d B^T r1, r2 = e2_dot + "
     "Lambda_2 e2 + c", COMPLETED_LAW, EquationVerdict.DEFINITION,
     "docs/theory.md; every part of command and memory, sampled, nets on and off, bounds reached or not")  # fmt: skip
def completed_law() -> Checks:
    s = closed_loops()
    paper, before, gains = s.gains.paper, s.memory.paper, s.gains
    command, after = CompletedBackstepping(Kinematics.STANDARD).law(s.memory, s.state, s.reference, gains, 1.0, PERIOD)

    on, w, mass = np.where(column(paper.learning_start) <= 1.0, 1.0, 0.0), column(paper.filter_frequency), column(paper.mass)
    eta, rates = rows(s.state.attitude), rows(s.state.rates)
    xi, slope_1, slope_2 = rows(s.state.position), rows(paper.slope_1), rows(paper.slope_2)
    e1 = rows(s.reference.position) - xi
    r1 = rows(s.reference.velocity) - rows(s.state.velocity) + slope_1 * e1
    mu_1 = neurons(paper.force_net.input_weights, np.concatenate([xi, r1, eta, rates], axis=1))
    w_1, w_2 = blocks(before.weights_1), blocks(before.weights_2)
    up = np.array([0.0, 0.0, 9.81])
    force = mass * (rows(s.reference.acceleration) - slope_1**2 * e1 + up) + on * np.einsum("bni,bn->bi", w_1, mu_1)
    force = force + rows(paper.gain_1) * r1 + rows(paper.integral_1) * rows(before.integral_1)
    thrust = size(force)
    f_x, f_y, f_z = force.T
    tilt = np.stack([np.arctan2(-f_x, np.hypot(f_y, f_z)), np.arctan2(f_y, f_z)], axis=1)

    here, fed = eta[:, 1:], rows(before.filtered.value)
    mean, apart = 0.5 * (here + fed), fed - here
    half = np.sinc(apart / (2.0 * np.pi))  # sin(x/2) / (x/2)
    s_th, c_th, s_ph, c_ph = np.sin(mean[:, 0]), np.cos(mean[:, 0]), np.sin(mean[:, 1]), np.cos(mean[:, 1])
    sin_phi, cos_phi = np.sin(eta[:, 2]), np.cos(eta[:, 2])
    b_theta = -half[:, :1] * np.stack([c_th, sin_phi * s_th, cos_phi * s_th], axis=1)
    b_phi = half[:, 1:] * np.cos(fed[:, :1]) * np.stack([0.0 * c_ph, c_ph, -s_ph], axis=1)
    coupling = rows(gains.coupling)
    raw = thrust * np.stack([(b_theta * r1).sum(axis=1), (b_phi * r1).sum(axis=1)], axis=1) / coupling[:, 1:]

    c = np.concatenate([column(0.0), rows(s.memory.counter.value)], axis=1)
    counter, counter_rate = filtered(s.memory.counter, raw, w)
    c_dot = np.concatenate([column(0.0), (counter - c[:, 1:]) / PERIOD], axis=1)
    value, rate = filtered(before.filtered, tilt, w)
    wanted = np.concatenate([column(s.reference.yaw), fed], axis=1)
    wanted_dot = np.concatenate([column(s.reference.yaw_rate), rows(before.filtered.rate)], axis=1)
    wanted_dd = np.concatenate([column(s.reference.yaw_acceleration), (rate - rows(before.filtered.rate)) / PERIOD], axis=1)
    e2 = wanted - eta
    r2 = wanted_dot - rates + slope_2 * e2 + c
    mu_2 = neurons(paper.torque_net.input_weights, np.concatenate([eta, r1, r2], axis=1))
    sigma, i_2 = rows(gains.inertia), rows(before.integral_2)
    bent = wanted_dd - slope_2**2 * e2 - slope_2 * c + c_dot
    rigid = np.einsum("bij,bj->bi", inertia(eta, sigma).real, bent)
    rigid = rigid + np.einsum("bij,bj->bi", christoffel(eta, rates, sigma), wanted_dot + slope_2 * e2 + c)
    torque = on * np.einsum("bni,bn->bi", w_2, mu_2) + rows(paper.gain_2) * r2 + rows(paper.integral_2) * i_2
    torque = torque + coupling * e2 + rigid

    length = np.sqrt(size(r1) ** 2 + size(r2) ** 2)
    net_1, net_2, period = paper.force_net, paper.torque_net, on * PERIOD
    new_1 = learnt(w_1, mu_1, r1, length, column(net_1.learning_rate), column(net_1.damping), period)
    new_2 = learnt(w_2, mu_2, r2, length, column(net_2.learning_rate), column(net_2.damping), period)
    bounds, most = rows(gains.weight_bounds), rows(gains.integral_bounds)
    i_1 = rows(before.integral_1)
    stored = 0.5 * ((i_1 * rows(paper.integral_1) * i_1).sum(axis=1) + (i_2 * rows(paper.integral_2) * i_2).sum(axis=1))
    cancelled = thrust[:, 0] * (r1 * (direction(fed) - direction(here))).sum(axis=1)
    return Checks([
        agree("u", column(command.thrust), thrust),
        agree("tau", rows(command.torque), torque),
        agree("desired attitude", rows(command.desired_attitude), np.concatenate([wanted[:, :1], tilt], axis=1)),
        agree("r1", rows(command.r1), r1),
        agree("r2", rows(command.r2), r2),
        agree("stored", column(command.stored), stored[:, None]),
        agree("norms of the weights", rows(command.weight_norms), np.concatenate([size(w_1), size(w_2)], axis=1)),
        agree("counter-rate", rows(after.counter.value), counter),
        agree("its rate", rows(after.counter.rate), counter_rate),
        agree("u r1^T (n(eta_f) - n(eta)) = e2^T P c before its filter", (apart * coupling[:, 1:] * raw).sum(1), cancelled),
        agree("command filter", rows(after.paper.filtered.value), value),
        agree("its rate", rows(after.paper.filtered.rate), rate),
        agree("int r1, within its bound", rows(after.paper.integral_1), limited(i_1 + PERIOD * r1, most[:, :1])),
        agree("int r2, within its bound", rows(after.paper.integral_2), limited(i_2 + PERIOD * r2, most[:, 1:])),
        agree("W_hat_1, within its bound", blocks(after.paper.weights_1), limited(new_1, bounds[:, :1])),
        agree("W_hat_2, within its bound", blocks(after.paper.weights_2), limited(new_2, bounds[:, 1:])),
    ])  # fmt: skip


NEURONS = 3
ROTATION_LAW = "control.rotation_backstepping:RotationBackstepping.follow"


class RotationBatch:
    """Random numbers for the law, as batches."""

    def __init__(self) -> None:
        draw = np.random.default_rng(76)

        def number(low: float, high: float) -> Number:
            batch: Plain = draw.uniform(low, high, COUNT)
            return batch  # type: ignore[return-value]  # a batch is a number here

        def one_of(*numbers: float) -> Number:
            batch: Plain = draw.choice(numbers, COUNT)
            return batch  # type: ignore[return-value]

        def entries(low: float, high: float, length: int = 3) -> Vector:
            return Vector(number(low, high) for _ in range(length))

        def block(bound: float, columns: int) -> Matrix:
            return Matrix(entries(-bound, bound, columns) for _ in range(NEURONS))

        def attitude() -> Vector:
            return normalised(entries(-1.0, 1.0, 4))

        self.gains = RotationGains(
            mass=number(0.5, 3.0), inertia=entries(0.01, 0.1), gravity=9.81, most_thrust=number(20.0, 60.0),
            slope_1=entries(0.5, 2.0), gain_1=entries(3.0, 9.0), integral_1=entries(0.1, 1.0), slope_2=entries(2.0, 6.0),
            gain_2=entries(10.0, 40.0), integral_2=entries(20.0, 90.0), coupling=entries(30.0, 80.0),
            filter_frequency=entries(15.0, 40.0),
            force_net=Net(block(1.0, FORCE_INPUTS + 1), number(1.0, 9.0), number(0.01, 0.1)),
            torque_net=Net(block(1.0, TORQUE_INPUTS + 1), number(1.0, 40.0), number(0.01, 0.1)),
            learning_start=one_of(0.0, 1.0, np.inf),
            weight_bounds=entries(2.0, 6.0, 2), integral_bounds=entries(0.5, 3.0, 2),
            weights_1=block(2.0, 3), weights_2=block(2.0, 3),
        )  # fmt: skip
        asked, torque = number(5.0, 30.0), entries(-1.0, 1.0)
        self.memory = RotationMemory(
            integral_1=entries(-1.0, 1.0), integral_2=entries(-1.0, 1.0),
            weights_1=self.gains.weights_1, weights_2=self.gains.weights_2,
            filtered=FilteredAttitude(attitude(), entries(-3.0, 3.0), entries(-9.0, 9.0)),
            flying=one_of(0.0, 1.0), force=entries(-10.0, 25.0), r1=entries(-1.0, 1.0),
            wanted=attitude(), turn=number(-3.0, 3.0),
            asked_thrust=asked, asked_torque=torque,
        )  # fmt: skip
        made = asked * (1.0 + number(-0.12, 0.12))
        self.measured = Measured(
            entries(-5.0, 5.0), entries(-5.0, 5.0), attitude(), entries(-3.0, 3.0), made, torque + entries(-0.06, 0.06)
        )
        self.reference = Reference(
            self.measured.position + entries(-2.0, 2.0),
            entries(-5.0, 5.0),
            entries(-4.0, 4.0),
            number(-3.0, 3.0),
            number(-1.0, 1.0),
        )


def rotations(quaternion: Vector) -> Plain:
    """I + 2 w S + 2 S^2, S the cross product with the quaternion's axis: body to world."""
    w, *axis = quaternion
    s = np.stack([np.cross(rows(Vector(axis)), unit) for unit in np.eye(3)], axis=2)
    return np.eye(3) + 2.0 * np.asarray(w)[:, None, None] * s + 2.0 * s @ s


def logarithm(r: Plain) -> Plain:
    """Axis times angle of a rotation."""
    sine = 0.5 * np.stack([r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]], axis=1)
    angle = np.arctan2(size(sine)[:, 0], 0.5 * (np.trace(r, axis1=1, axis2=2) - 1.0))
    return sine * (angle / size(sine)[:, 0])[:, None]


def exponential(turn: Plain) -> Plain:
    """The rotation whose axis times angle is `turn`."""
    angle, axis = size(turn)[:, :, None], turn / size(turn)
    s = np.stack([np.cross(axis, unit) for unit in np.eye(3)], axis=2)
    return np.eye(3) + np.sin(angle) * s + (1.0 - np.cos(angle)) * s @ s


def learning_factor(missing: Plain, asked: Plain) -> Plain:
    """Factor on learning: zero where a tenth of the commanded thrust or torque is missing."""
    return np.clip(1.0 - 10.0 * missing / np.maximum(asked, 1e-6), 0.0, None)


def followed(m: RotationBatch, hedge: Plain) -> tuple[Plain, Plain, Plain]:
    """The command filter a sample later: its rotation, rates and acceleration."""
    before, wanted, w = m.memory.filtered, m.memory.wanted, rows(m.gains.filter_frequency)
    f, spin = rotations(before.attitude), rows(before.rates)
    ahead = np.einsum("bki,bkj->bij", f, rotations(wanted))
    led = column(m.memory.turn) * np.array([0.0, 0.0, 1.0])
    acceleration: Plain = w**2 * logarithm(ahead) + 2.0 * w * (led - spin)
    rates: Plain = spin + PERIOD * (acceleration - hedge)
    return f @ exponential(PERIOD * rates), rates, acceleration


@row("rotation law", "the paper's law on the rotation group", "not in the paper: F = m (xi_d_dd + g e_z - Lambda_1^2 e1 + "
     "K_r1 r1 + K_i1 int r1 + W_hat_1^T mu_1), tau = Sigma (omega_d_dot + Lambda_2 e2_dot + K_r2 r2 + K_i2 int r2 + P e2 + "
     "W_hat_2^T mu_2) + omega x Sigma omega", ROTATION_LAW, EquationVerdict.DEFINITION, "both loops with hedging, bounds and "
     "learning; e2 the turn to the filtered attitude, gains over mass and inertia")  # fmt: skip
def rotation_law() -> Checks:
    m = RotationBatch()
    g, memory, measured, reference = m.gains, m.memory, m.measured, m.reference
    law = RotationBackstepping()
    guided = law.guide(memory, measured, reference, g, 1.0, PERIOD)
    command, after = law.law(memory, measured, reference, g, 1.0, PERIOD)

    mass, started = column(g.mass), column(g.learning_start) <= 1.0
    flying = (column(measured.thrust) > 0.8 * 9.81 * mass) | (column(memory.flying) > 0.0)
    r, velocity, omega = rotations(measured.attitude), rows(measured.velocity), rows(measured.rates)
    e1 = rows(reference.position) - rows(measured.position)
    r1 = rows(reference.velocity) - velocity + rows(g.slope_1) * e1
    mu_1 = neurons(
        g.force_net.input_weights, np.concatenate([velocity / 5.0, r[:, :, 2], rows(memory.force) / (10.0 * mass)], 1)
    )
    w_1, w_2 = blocks(memory.weights_1), blocks(memory.weights_2)
    i_1, i_2 = rows(memory.integral_1), rows(memory.integral_2)
    asked = rows(reference.acceleration) - rows(g.slope_1) ** 2 * e1 + rows(g.gain_1) * r1 + rows(g.integral_1) * i_1
    asked = asked + (flying & started) * np.einsum("bni,bn->bi", w_1, mu_1) + np.array([0.0, 0.0, 9.81])
    most, lift = column(g.most_thrust), (mass * asked)[:, 2:]
    lift = np.clip(lift, 0.1 * most, 0.95 * most)
    force = np.concatenate([limited((mass * asked)[:, :2], np.sqrt(most**2 - lift**2)), lift], axis=1)
    third = force / size(force)
    yaw = column(reference.yaw)
    second = np.cross(third, np.concatenate([np.cos(yaw), np.sin(yaw), 0.0 * yaw], axis=1))
    turn = column(reference.yaw_rate) * third[:, 2:] / size(second) ** 2  # about the third axis, which stays
    second = second / size(second)
    share_1 = learning_factor(np.abs(column(memory.asked_thrust) - column(measured.thrust)), column(memory.asked_thrust))
    net_1, net_2 = g.force_net, g.torque_net
    kappa_1, kappa_2 = column(net_1.damping), column(net_2.damping)
    period_1 = (flying & started) * share_1 * PERIOD
    new_1 = learnt(w_1, mu_1, r1, size(r1), column(net_1.learning_rate), kappa_1, period_1)
    bounds, most_i = rows(g.weight_bounds), rows(g.integral_bounds)

    was = column(memory.flying) > 0.0
    sigma, missing = rows(g.inertia), rows(memory.asked_torque) - rows(measured.torque)
    filtered, rates, acceleration = followed(m, missing / sigma)
    into = np.einsum("bki,bkj->bij", r, filtered)
    e2, fed = logarithm(into), apply(into, rates)
    e2_dot = fed - omega
    r2 = e2_dot + rows(g.slope_2) * e2
    turning = apply(into, acceleration) - np.cross(omega, fed)
    mu_2 = neurons(
        net_2.input_weights, np.concatenate([apply(r.swapaxes(1, 2), velocity) / 5.0, omega / 5.0, turning / 50.0], axis=1)
    )
    bent = turning + rows(g.slope_2) * e2_dot + rows(g.gain_2) * r2 + rows(g.integral_2) * i_2 + rows(g.coupling) * e2
    bent = bent + (was & started) * np.einsum("bni,bn->bi", w_2, mu_2)
    torque = sigma * bent + np.cross(omega, sigma * omega)
    thrust: Plain = np.maximum((rows(memory.force) * r[:, :, 2]).sum(axis=1), 0.0)[:, None]
    share_2 = learning_factor(size(missing), size(rows(memory.asked_torque)))
    period_2 = (was & started) * share_2 * PERIOD
    new_2 = learnt(w_2, mu_2, r2, size(r2), column(net_2.learning_rate), kappa_2, period_2)
    return Checks([
        agree("desired force", rows(guided.force), force),
        agree("its attitude", rotations(guided.wanted), np.stack([np.cross(second, third), second, third], axis=2)),
        agree("its turn", column(guided.turn), turn),
        agree("r1", rows(guided.r1), r1),
        agree("flying", column(guided.flying), flying.astype(np.float64)),
        agree("int r1", rows(guided.integral_1), limited(i_1 + flying * share_1 * PERIOD * r1, most_i[:, :1])),
        agree("W_hat_1", blocks(guided.weights_1), limited(new_1, bounds[:, :1])),
        agree("u", column(command.thrust), thrust),
        agree("tau", rows(command.torque), torque),
        agree("r1 and r2 of the command", np.concatenate([rows(command.r1), rows(command.r2)], 1),
              np.concatenate([rows(memory.r1), r2], 1)),
        agree("desired attitude of the command", rows(command.desired_attitude), rows(yaw_pitch_roll(memory.wanted))),
        agree("norms of the weights", rows(command.weight_norms), np.concatenate([size(w_1), size(w_2)], axis=1)),
        agree("filter", rotations(after.filtered.attitude), filtered),
        agree("int r2", rows(after.integral_2), limited(i_2 + was * share_2 * PERIOD * r2, most_i[:, 1:])),
        agree("W_hat_2", blocks(after.weights_2), limited(new_2, bounds[:, 1:])),
        agree("what was asked for", np.concatenate([column(after.asked_thrust), rows(after.asked_torque)], axis=1),
              np.concatenate([thrust, torque], axis=1)),
    ])  # fmt: skip
