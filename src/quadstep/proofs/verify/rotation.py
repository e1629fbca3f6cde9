"""The rotation law: a sample of each of its loops compared with its formulas in plain NumPy with rotation matrices."""

import numpy as np

from quadstep.control.filters import FilteredAttitude, attitude_filter
from quadstep.control.rotation_backstepping import (
    FORCE_INPUTS,
    TORQUE_INPUTS,
    RotationBackstepping,
    RotationGains,
    RotationMemory,
)
from quadstep.interfaces.controller import Measured
from quadstep.interfaces.learning import Net
from quadstep.interfaces.plant import Reference
from quadstep.numbers import Matrix, Number, Vector
from quadstep.numbers.rotations import normalised, yaw_pitch_roll
from quadstep.proofs.plain import Plain, agree, apply, blocks, learnt, limited, neurons, rows, size
from quadstep.proofs.verify.rows import Checks, EquationRow, EquationVerdict, row

ROWS: list[EquationRow] = []
COUNT, NEURONS, PERIOD = 300, 3, 0.004
LAW = "control.rotation_backstepping:RotationBackstepping.follow"


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
            flying=one_of(0.0, 1.0), force=entries(-10.0, 25.0), wanted=attitude(), r1=entries(-1.0, 1.0),
            asked_thrust=asked, asked_torque=torque,
        )  # fmt: skip
        made = asked * (1.0 + number(-0.12, 0.12))
        self.measured = Measured(
            entries(-5.0, 5.0), entries(-5.0, 5.0), attitude(), entries(-3.0, 3.0), made, torque + entries(-0.06, 0.06)
        )
        self.reference = Reference(
            self.measured.position + entries(-2.0, 2.0), entries(-5.0, 5.0), entries(-4.0, 4.0), number(-3.0, 3.0), 0.0
        )


def column(number: object) -> Plain:
    """(count, 1)."""
    return np.broadcast_to(np.asarray(number, dtype=float), (COUNT,))[:, None]


def rotations(quaternion: Vector) -> Plain:
    """I + 2 w S + 2 S^2, S the cross product with the quaternion's axis: body to world."""
    w, *axis = quaternion
    s = np.stack([np.cross(rows(Vector(axis)), unit) for unit in np.eye(3)], axis=2)
    r: Plain = np.eye(3) + 2.0 * np.asarray(w)[:, None, None] * s + 2.0 * s @ s
    return r


def logarithm(r: Plain) -> Plain:
    """Axis times angle of a rotation."""
    sine = 0.5 * np.stack([r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]], axis=1)
    angle = np.arctan2(size(sine)[:, 0], 0.5 * (np.trace(r, axis1=1, axis2=2) - 1.0))
    turn: Plain = sine * (angle / size(sine)[:, 0])[:, None]
    return turn


def learning_factor(missing: Plain, asked: Plain) -> Plain:
    """Factor on learning: zero where a tenth of the commanded thrust or torque is missing."""
    share: Plain = np.clip(1.0 - 10.0 * missing / np.maximum(asked, 1e-6), 0.0, None)
    return share


@row(ROWS, "rotation law", "the paper's law on the rotation group", "not in the paper: F = m (xi_d_dd + g e_z - "
     "Lambda_1^2 e1 + K_r1 r1 + K_i1 int r1 + W_hat_1^T mu_1), tau = Sigma (omega_d_dot + Lambda_2 e2_dot + K_r2 r2 + "
     "K_i2 int r2 + P e2 + W_hat_2^T mu_2) + omega x Sigma omega", LAW, EquationVerdict.DEFINITION,
     "both loops with hedging, bounds and learning; e2 the turn to the filtered attitude, gains over mass and "
     "inertia")  # fmt: skip
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
    second = second / size(second)
    share_1 = learning_factor(np.abs(column(memory.asked_thrust) - column(measured.thrust)), column(memory.asked_thrust))
    net_1, net_2 = g.force_net, g.torque_net
    kappa_1, kappa_2 = column(net_1.damping), column(net_2.damping)
    period_1 = (flying & started) * share_1 * PERIOD
    new_1 = learnt(w_1, mu_1, r1, size(r1), column(net_1.learning_rate), kappa_1, period_1)
    bounds, most_i = rows(g.weight_bounds), rows(g.integral_bounds)

    was = column(memory.flying) > 0.0
    sigma, missing = rows(g.inertia), rows(memory.asked_torque) - rows(measured.torque)
    filtered = attitude_filter(memory.filtered, memory.wanted, g.filter_frequency, Vector((missing / sigma).T), PERIOD)
    into = np.einsum("bki,bkj->bij", r, rotations(filtered.attitude))
    e2, fed = logarithm(into), apply(into, rows(filtered.rates))
    e2_dot = fed - omega
    r2 = e2_dot + rows(g.slope_2) * e2
    turning = apply(into, rows(filtered.acceleration)) - np.cross(omega, fed)
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
        agree("filter", rows(after.filtered.attitude), rows(filtered.attitude)),
        agree("int r2", rows(after.integral_2), limited(i_2 + was * share_2 * PERIOD * r2, most_i[:, 1:])),
        agree("W_hat_2", blocks(after.weights_2), limited(new_2, bounds[:, 1:])),
        agree("what was asked for", np.concatenate([column(after.asked_thrust), rows(after.asked_torque)], axis=1),
              np.concatenate([thrust, torque], axis=1)),
    ])  # fmt: skip
