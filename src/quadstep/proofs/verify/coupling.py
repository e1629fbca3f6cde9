"""The closed outer loop: Eqs 20 and 26, and the term that they leave out."""

import numpy as np
import sympy

from quadstep.control.inversion import invert_force
from quadstep.numbers import Vector, vector
from quadstep.proofs.verify import closed_loop as loop
from quadstep.proofs.verify.algebra import Expression, array, holds, near, same, short, symbols, unlike
from quadstep.proofs.verify.closed_loop import FORCE, LAMBDA_1, R1
from quadstep.proofs.verify.plant import MASS
from quadstep.proofs.verify.position_loop import (
    A_HAT,
    EPS_1,
    INTEGRAL,
    K_I1,
    K_R1,
    LAW,
    W_1,
    force_of,
    ideal_1,
    r1_dot,
    wanted_by,
)
from quadstep.proofs.verify.rigid_body import ATTITUDE
from quadstep.proofs.verify.rows import EquationRow, EquationVerdict, Evidence, row
from quadstep.vehicle.paper import thrust_direction

ROWS: list[EquationRow] = []


def attained(force: Vector) -> Expression:
    """m r1_dot when thrust and attitude are those that produce a force."""
    u_d, theta_d, phi_d = invert_force(force)
    return MASS * r1_dot(u_d, vector(ATTITUDE[0], theta_d, phi_d))


def left_out(force: Vector) -> Expression:
    """Delta: the force that u_d produces at the actual attitude, less the intended one."""
    u_d, _, _ = invert_force(force)
    return u_d * array(thrust_direction(ATTITUDE)) - array(force)


def off_by(angle: float) -> float:
    """|delta| in hover with theta off by an angle [N], by the shipped laws."""
    u_d, theta_d, phi_d = invert_force(vector(0.0, 0.0, 9.81))
    real = u_d * thrust_direction(vector(0.0, theta_d + angle, phi_d))
    return (real - vector(0.0, 0.0, 9.81)).norm()


@row(ROWS, "20", "closed loop of the position", "m r1_dot = -(K_r1 - m Lambda_1) r1 - A_tilde - K_i1 int r1",
     "control.backstepping:wanted_force", EquationVerdict.CORRECTED,
     "right only at the desired attitude; in flight add -delta, delta = F_d(u_d, theta, phi) - F_d_hat")  # fmt: skip
def equation_20() -> Evidence:
    force = wanted_by(-array(A_HAT))
    printed = -(K_R1 - MASS * LAMBDA_1) * R1 - (array(FORCE) - array(A_HAT)) - K_I1 * INTEGRAL
    real = MASS * r1_dot(invert_force(force)[0])
    return Evidence([
        same("m r1_dot at the desired attitude", attained(force), printed),
        same("m r1_dot at any attitude, with -delta", real, printed - left_out(force)),
        unlike("m r1_dot at any attitude, as printed", real, printed),
    ], f"hover, m = 1 kg, theta 0.1 rad off: m r1_dot is off by |delta| = {short(off_by(0.1))} N")  # fmt: skip


# Eq. 26
@row(ROWS, "26", "closed loop of the position with the net", "m r1_dot = -(K_r1 - m Lambda_1) r1 + W_tilde_1^T mu_1 - "
     "K_i1 int r1 + eps_1", LAW, EquationVerdict.CORRECTED, "add -delta, as in Eq. 20")  # fmt: skip
def equation_26() -> Evidence:
    command = loop.sample().command
    w_tilde = array(W_1) - array(loop.W_HAT_1)
    printed = -(K_R1 - MASS * LAMBDA_1) * R1 + w_tilde.T * loop.mu(loop.NET_1, loop.CHI_1) - K_I1 * INTEGRAL + array(EPS_1)
    pushed = dict(zip(FORCE, -ideal_1(), strict=True))
    delta = command.thrust * array(thrust_direction(ATTITUDE)) - force_of(command)
    there = (MASS * r1_dot(command.thrust, command.desired_attitude)).xreplace(pushed)
    real = (MASS * r1_dot(command.thrust)).xreplace(pushed)
    return Evidence([
        same("m r1_dot at the desired attitude", there, printed),
        same("m r1_dot at any attitude, with -delta", real, printed - delta),
        unlike("m r1_dot at any attitude, as printed", real, printed),
    ], f"hover, m = 1 kg, theta 0.1 rad off: m r1_dot is off by |delta| = {short(off_by(0.1))} N")  # fmt: skip


@row(ROWS, "delta", "the coupling that Eqs 20, 26, 56 leave out", "none: F_d = F_d_hat is assumed",
     "vehicle.paper:thrust_direction", EquationVerdict.CORRECTED,
     "delta = F_d(u_d, theta, phi) - F_d_hat, |delta| <= u_d |e2|; L_dot gains -r1^T delta, which nothing "
     "cancels")  # fmt: skip
def delta() -> Evidence:
    there, here = symbols("there"), symbols("here")
    gap = array(thrust_direction(here)) - array(thrust_direction(there))
    s, c = sympy.sin, sympy.cos
    turn = c(here[2]) * c(there[2]) + s(here[2]) * s(there[2])
    law = 2 * (1 - s(here[1]) * s(there[1]) - c(here[1]) * c(there[1]) * turn)
    draw = np.random.default_rng(20)
    a, b = draw.uniform(-np.pi, np.pi, (2, 3, 100_000))
    length = (thrust_direction(Vector(a)) - thrust_direction(Vector(b))).norm()
    ratio = float(np.max(length / np.hypot(a[1] - b[1], a[2] - b[2])))
    return Evidence([
        same("|delta|^2 / u_d^2 = 2 (1 - s_th s_thd - c_th c_thd cos(phi - phi_d))", (gap.T * gap)[0], law),
        holds("|delta| <= u_d |e2| at 1e5 random attitudes", ratio <= 1.0 + 1e-12, short(ratio), "at most 1"),
        near("|delta| in hover, theta off by 0.1 rad", off_by(0.1), 9.81 * 2 * np.sin(0.05)),
    ], f"u_d = 9.81 N, theta 0.1 rad off: |delta| = {short(off_by(0.1))} N; largest |delta| / (u_d |e2|) seen: "
       f"{short(ratio)}")  # fmt: skip
