"""The completed law of docs/theory.md: command and memory after one sample, compared with its formulas in plain NumPy."""

from typing import cast

import numpy as np

from quadstep.control.completed_backstepping import CompletedBackstepping, CompletedGains
from quadstep.control.filters import Filtered
from quadstep.interfaces.model import Kinematics
from quadstep.numbers import Number, Vector
from quadstep.proofs.plain import Plain, agree, blocks, christoffel, inertia, learnt, limited, neurons, rows, size
from quadstep.proofs.theory.samples import LoopBatch, draw_sample
from quadstep.proofs.verify.rows import Check, Checks, EquationRow, EquationVerdict, row

ROWS: list[EquationRow] = []
COUNT, PERIOD = 300, 0.004
LAW = "control.completed_backstepping:CompletedBackstepping.law"


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


def half_ratio(x: Plain) -> Plain:
    """sin(x/2) / (x/2)."""
    ratio: Plain = np.sinc(x / (2.0 * np.pi))
    return ratio


@row(ROWS, "completed law", "the law that completes the paper's", "not in the paper: tau = Eq. 35 + P e2 + J (eta_d_dd - "
     "Lambda_2^2 e2 - Lambda_2 c + c_dot) + C (eta_d_dot + Lambda_2 e2 + c), c = filtered P^-1 u_d B^T r1, r2 = e2_dot + "
     "Lambda_2 e2 + c", LAW, EquationVerdict.DEFINITION,
     "docs/theory.md; every part of command and memory, sampled, nets on and off, bounds reached or not")  # fmt: skip
def completed_law() -> Checks:
    s = closed_loops()
    paper, before, gains = s.gains.paper, s.memory.paper, s.gains
    command, after = CompletedBackstepping(Kinematics.STANDARD).law(s.memory, s.state, s.reference, gains, 1.0, PERIOD)

    def column(number: object) -> Plain:
        return np.broadcast_to(np.asarray(number, dtype=float), (COUNT,))[:, None]

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
    s_th, c_th, s_ph, c_ph = np.sin(mean[:, 0]), np.cos(mean[:, 0]), np.sin(mean[:, 1]), np.cos(mean[:, 1])
    sin_phi, cos_phi = np.sin(eta[:, 2]), np.cos(eta[:, 2])
    b_theta = -half_ratio(apart[:, :1]) * np.stack([c_th, sin_phi * s_th, cos_phi * s_th], axis=1)
    b_phi = half_ratio(apart[:, 1:]) * np.cos(fed[:, :1]) * np.stack([0.0 * c_ph, c_ph, -s_ph], axis=1)
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
    checks: list[Check] = [
        agree("u", column(command.thrust), thrust),
        agree("tau", rows(command.torque), torque),
        agree("desired attitude", rows(command.desired_attitude), np.concatenate([wanted[:, :1], tilt], axis=1)),
        agree("r1", rows(command.r1), r1),
        agree("r2", rows(command.r2), r2),
        agree("stored", column(command.stored), stored[:, None]),
        agree("norms of the weights", rows(command.weight_norms), np.concatenate([size(w_1), size(w_2)], axis=1)),
        agree("counter-rate", rows(after.counter.value), counter),
        agree("its rate", rows(after.counter.rate), counter_rate),
        agree(
            "u r1^T (n(eta_f) - n(eta)) = e2^T P c before its filter", (apart * coupling[:, 1:] * raw).sum(axis=1), cancelled
        ),
        agree("command filter", rows(after.paper.filtered.value), value),
        agree("its rate", rows(after.paper.filtered.rate), rate),
        agree("int r1, within its bound", rows(after.paper.integral_1), limited(i_1 + PERIOD * r1, most[:, :1])),
        agree("int r2, within its bound", rows(after.paper.integral_2), limited(i_2 + PERIOD * r2, most[:, 1:])),
        agree("W_hat_1, within its bound", blocks(after.paper.weights_1), limited(new_1, bounds[:, :1])),
        agree("W_hat_2, within its bound", blocks(after.paper.weights_2), limited(new_2, bounds[:, 1:])),
    ]
    return Checks(checks)
