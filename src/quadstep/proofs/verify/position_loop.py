"""The outer loop: Eqs 11-19, 22-25 and chi_1; closed: Eqs 20 and 26, and the term that they leave out."""

import numpy as np
import sympy

from quadstep.control.backstepping import desired_force
from quadstep.control.vectoring import invert_force
from quadstep.interfaces.learning import output
from quadstep.numbers import Vector, vector
from quadstep.proofs.verify import closed_loop as loop
from quadstep.proofs.verify.closed_loop import (
    CHI_1,
    E1,
    E1_DOT,
    FORCE,
    GAINS,
    LAMBDA_1,
    M_G,
    MEMORY,
    R1,
    REFERENCE,
    STATE,
    XI_D_DD,
)
from quadstep.proofs.verify.equation_row import (
    Checks,
    EquationVerdict,
    Expression,
    along,
    array,
    holds,
    near,
    row,
    same,
    short,
    symbol,
    symbols,
    unlike,
)
from quadstep.proofs.verify.forces import printed_direction
from quadstep.proofs.verify.plant import MASS, THRUST
from quadstep.proofs.verify.rigid_body import ATTITUDE, RATES
from quadstep.vehicle.paper import disturb, thrust_direction

LAW = "control.backstepping:position_loop"
K_R1, K_I1 = loop.diagonal(GAINS.gain_1), loop.diagonal(GAINS.integral_1)
INTEGRAL = array(MEMORY.integral_1)
A_HAT = symbols("A_hat")
FEEDBACK = MASS * XI_D_DD - MASS * LAMBDA_1**2 * E1 - M_G + K_R1 * R1 + K_I1 * INTEGRAL


def r1_dot(thrust: Expression = THRUST, attitude: Vector = ATTITUDE) -> Expression:
    """Rate of the shipped r1 along the motion of the shipped plant."""
    return array(along(loop.sample(learning=False).command.r1, loop.motion(loop.plant(thrust, attitude=attitude))))


def force_of(command: Expression) -> Expression:
    """The force that a command's thrust and desired attitude produce: F_d_hat as the law returns it."""
    return command.thrust * array(thrust_direction(command.desired_attitude))


def force_with(estimate: Expression) -> Vector:
    """The shipped F_d_hat with an estimate -A_hat."""
    return desired_force(GAINS, REFERENCE, Vector(E1), Vector(R1), MEMORY.integral_1, Vector(estimate))


@row("11", "position error", "e1 = xi_d - xi", LAW, EquationVerdict.AS_PRINTED)
def equation_11() -> Checks:
    r1 = array(loop.sample(gains=GAINS._replace(slope_1=vector(1.0, 1.0, 1.0))).command.r1)
    matched = dict(zip(REFERENCE.velocity, STATE.velocity, strict=True))
    return Checks([same("r1 of the law for Lambda_1 = I, at the path's velocity", r1.xreplace(matched), E1)])


@row("12", "filtered error", "r1 = e1_dot + Lambda_1 e1", LAW, EquationVerdict.AS_PRINTED)
def equation_12() -> Checks:
    return Checks([same("r1 of the law", loop.sample().command.r1, E1_DOT + LAMBDA_1 * E1)])


# Eq. 13
@row("13", "e1 is bounded by r1", "|e1| <= |r1| / sigma_min(Lambda_1), |e1_dot| <= |r1|", LAW, EquationVerdict.CORRECTED,
     "both fail at an instant; for e1(0) = 0 the suprema over time obey |e1| <= sup|r1| / sigma_min and "
     "|e1_dot| <= (1 + sigma_max / sigma_min) sup|r1|")  # fmt: skip
def equation_13() -> Checks:
    r1 = sympy.lambdify([*REFERENCE.position, *REFERENCE.velocity, *GAINS.slope_1], list(in_errors(loop.sample().command.r1)))
    slopes = np.array([1.0, 2.0, 4.0])
    draw, worst, worst_rate = np.random.default_rng(13), 0.0, 0.0
    for _ in range(20):
        e, size, rate_size, r_size = np.zeros(3), 0.0, 0.0, 0.0
        for _ in range(50):
            r, decay = draw.uniform(-1, 1, 3), np.exp(-slopes * draw.exponential(1.0))
            for here in (e, r / slopes + decay * (e - r / slopes)):  # r held: the solution of e_dot = r - Lambda e
                rate = r - slopes * here
                size, rate_size = max(size, float(np.linalg.norm(here))), max(rate_size, float(np.linalg.norm(rate)))
                r_size = max(r_size, float(np.linalg.norm(r1(*here, *rate, *slopes))))
            e = here
        worst, worst_rate = max(worst, size / r_size), max(worst_rate, rate_size / r_size)
    reversal = 1.0 - np.exp(-5.0)  # e1 after 5 s of r1 = 1, Lambda_1 = 1; then r1 = -1
    before, after = r1(1, 1, 1, -1, -1, -1, 1, 1, 1)[0], r1(reversal, 0, 0, -1.0 - reversal, 0, 0, 1, 1, 1)[0]
    return Checks([
        near("r1 of the law while sliding, e1 = 1, e1_dot = -1, Lambda_1 = 1", before, 0.0),
        near("r1 of the law after a reversal", after, -1.0),
        holds("|e1_dot| > |r1| there", 1.0 + reversal > 1.99 * abs(after), short(1.0 + reversal), "above 1"),
        holds("sup|e1| <= sup|r1| / sigma_min on 20 random runs", worst <= 1.0, short(worst), "at most 1"),
        holds("sup|e1_dot| <= 5 sup|r1| on them", worst_rate <= 5.0, short(worst_rate), "at most 5"),
    ], "Lambda_1 = 1: e1 = 1, e1_dot = -1 has r1 = 0, against both; r1 = 1 for 5 s and then -1 has |e1_dot| = "
       f"{short(1.0 + reversal)} with |r1| = 1")  # fmt: skip


def in_errors(thing: Vector) -> Expression:
    """A law's vector with the vehicle at rest at the origin, so that e1 and e1_dot are the path's own symbols."""
    still = dict.fromkeys((*STATE.position, *STATE.velocity), 0)
    return array(thing).xreplace(still)


# Eq. 14
@row("14", "sliding", "e1(t) = exp(-Lambda_1 t) e1(0)", LAW, EquationVerdict.AS_PRINTED, "while r1 = 0")
def equation_14() -> Checks:
    t, start = symbol("t"), symbols("e1_0")
    slide = [sympy.exp(-slope * t) * e for slope, e in zip(GAINS.slope_1, start, strict=True)]
    r1 = in_errors(loop.sample().command.r1)
    point = dict(zip(REFERENCE.position, slide, strict=True)) | {
        v: sympy.diff(e, t) for v, e in zip(REFERENCE.velocity, slide, strict=True)
    }
    return Checks([same("r1 of the law along it", r1.xreplace(point), [0, 0, 0]),
                     same("its start", [e.subs(t, 0) for e in slide], start)])  # fmt: skip


# Eq. 15
@row("15", "rate of r1", "m r1_dot = m e1_dd + m Lambda_1 e1_dot", LAW, EquationVerdict.AS_PRINTED)
def equation_15() -> Checks:
    e1_dd = XI_D_DD - array(loop.plant().velocity)
    return Checks([same("m r1_dot", MASS * r1_dot(), MASS * e1_dd + MASS * LAMBDA_1 * E1_DOT)])


# Eq. 16
@row("16", "rate of r1 in terms of r1 and e1", "m r1_dot = m xi_d_dd - m xi_dd + m Lambda_1 (r1 - Lambda_1 e1)", LAW,
     EquationVerdict.AS_PRINTED)  # fmt: skip
def equation_16() -> Checks:
    printed = MASS * XI_D_DD - MASS * array(loop.plant().velocity) + MASS * LAMBDA_1 * (R1 - LAMBDA_1 * E1)
    return Checks([same("m r1_dot", MASS * r1_dot(), printed)])


def driven(force: Expression) -> Expression:
    """Right side of Eqs 17 and 18 under a force F_d."""
    return MASS * XI_D_DD + MASS * LAMBDA_1 * R1 - MASS * LAMBDA_1**2 * E1 - force - M_G - array(FORCE)


# Eq. 17
@row("17", "rate of r1 under thrust", "m r1_dot = m xi_d_dd - u (-s_th, c_th s_ph, c_th c_ph) - (0, 0, -m g) - A_xyz "
     "+ m Lambda_1 (r1 - Lambda_1 e1)", LAW, EquationVerdict.AS_PRINTED)  # fmt: skip
def equation_17() -> Checks:
    printed = MASS * XI_D_DD - THRUST * printed_direction() - M_G - array(FORCE) + MASS * LAMBDA_1 * (R1 - LAMBDA_1 * E1)
    return Checks([same("m r1_dot", MASS * r1_dot(), printed)])


# Eq. 18
@row("18", "rate of r1 under F_d", "m r1_dot = m xi_d_dd + m Lambda_1 r1 - m Lambda_1^2 e1 - F_d - m_g - A_xyz", LAW,
     EquationVerdict.AS_PRINTED)  # fmt: skip
def equation_18() -> Checks:
    return Checks([same("m r1_dot", MASS * r1_dot(), driven(THRUST * printed_direction()))])


@row("19", "desired force", "F_d_hat = m xi_d_dd - m Lambda_1^2 e1 - m_g - A_hat + K_r1 r1 + K_i1 int r1",
     "control.backstepping:desired_force", EquationVerdict.AS_PRINTED)  # fmt: skip
def equation_19() -> Checks:
    after = array(loop.sample().following.integral_1)
    return Checks([
        same("F_d_hat", force_with(-array(A_HAT)), FEEDBACK - array(A_HAT)),
        same("int r1 grows by r1 each sample", after - INTEGRAL, loop.PERIOD * R1),
    ])  # fmt: skip


@row("22", "function approximated by the first net", "v_NN1 = -A_xyz = W_1^T mu_1(chi_1) + eps_1",
     "interfaces.learning:basis", EquationVerdict.DEFINITION)  # fmt: skip
def equation_22() -> Checks:
    weights = [list(row) for row in loop.NET_1.input_weights]
    sigmoids = [1 / (1 + sympy.exp(-sum(w * x for w, x in zip(row, (*CHI_1, 1), strict=True)))) for row in weights]
    return Checks([same("mu_1 of the code: sigmoid of weighted inputs and a bias", loop.mu(loop.NET_1, CHI_1), sigmoids)])


@row("23", "first net", "v_NN1_hat = -A_hat = W_hat_1^T mu_1(chi_1)", "interfaces.learning:output",
     EquationVerdict.AS_PRINTED)  # fmt: skip
def equation_23() -> Checks:
    spoken = force_of(loop.sample().command) - force_of(loop.sample(learning=False).command)
    printed = array(loop.W_HAT_1).T * loop.mu(loop.NET_1, CHI_1)
    return Checks([
        same("W_hat^T mu", output(loop.W_HAT_1, Vector(symbols("mu", 2))), array(loop.W_HAT_1).T * array(symbols("mu", 2))),
        same("what the net adds to F_d_hat in the law", spoken, printed),
    ])  # fmt: skip


@row("24", "desired force with the net", "F_d_hat = m xi_d_dd - m Lambda_1^2 e1 - m_g + W_hat_1^T mu_1 + K_r1 r1 + "
     "K_i1 int r1", LAW, EquationVerdict.AS_PRINTED)  # fmt: skip
def equation_24() -> Checks:
    printed = FEEDBACK + array(loop.W_HAT_1).T * loop.mu(loop.NET_1, CHI_1)
    return Checks([same("thrust and desired attitude of the law produce it", force_of(loop.sample().command), printed)])


W_1, EPS_1 = loop.weights("W1", loop.NEURONS, 3), symbols("eps1")


def ideal_1() -> Expression:
    """W_1^T mu_1 + eps_1 with the ideal weights."""
    return array(W_1).T * loop.mu(loop.NET_1, CHI_1) + array(EPS_1)


# Eq. 25
@row("25", "error of the first net", "-A_tilde = W_1^T mu_1 - W_hat_1^T mu_1 + eps_1 = W_tilde_1^T mu_1 + eps_1",
     "interfaces.learning:output", EquationVerdict.DEFINITION)  # fmt: skip
def equation_25() -> Checks:
    basis = loop.mu(loop.NET_1, CHI_1)
    a, a_hat = -ideal_1(), -array(output(loop.W_HAT_1, Vector(basis)))
    return Checks([same("A_hat - A by Eqs 22 and 23", a_hat - a, (array(W_1) - array(loop.W_HAT_1)).T * basis + array(EPS_1))])


@row("chi_1", "input of the first net", "chi_1 = (xi, r1, eta, eta_dot)", LAW, EquationVerdict.AS_PRINTED,
     "kept, but it lacks xi_dot, on which A_xyz of Eq. 67 depends")  # fmt: skip
def chi_1() -> Checks:
    shift = {v: v + 1 for v in (STATE.velocity[0], REFERENCE.velocity[0])}
    learnt = array(loop.sample().following.weights_1)
    paper = loop.DISTURBANCE._replace(scale=1.0)
    force = array(disturb(paper, STATE)[0])
    at = {STATE.velocity[0]: 1, ATTITUDE[0]: 0} | dict.fromkeys(RATES, 1)
    moved = (force.xreplace(shift) - force).xreplace(at)[0]
    return Checks([
        same("learning is blind to a velocity common to path and vehicle", learnt.xreplace(shift), learnt),
        near("A_x changes by", moved, 1.0),
    ], f"both 1 m/s faster along x at phi_dot = 1 rad/s: chi_1 the same, A_x larger by {short(moved)} N")  # fmt: skip


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


@row("20", "closed loop of the position", "m r1_dot = -(K_r1 - m Lambda_1) r1 - A_tilde - K_i1 int r1",
     "control.backstepping:desired_force", EquationVerdict.CORRECTED,
     "right only at the desired attitude; in flight add -delta, delta = F_d(u_d, theta, phi) - F_d_hat")  # fmt: skip
def equation_20() -> Checks:
    force = force_with(-array(A_HAT))
    printed = -(K_R1 - MASS * LAMBDA_1) * R1 - (array(FORCE) - array(A_HAT)) - K_I1 * INTEGRAL
    real = MASS * r1_dot(invert_force(force)[0])
    return Checks([
        same("m r1_dot at the desired attitude", attained(force), printed),
        same("m r1_dot at any attitude, with -delta", real, printed - left_out(force)),
        unlike("m r1_dot at any attitude, as printed", real, printed),
    ], f"hover, m = 1 kg, theta off by 0.1 rad: m r1_dot is off by |delta| = {short(off_by(0.1))} N")  # fmt: skip


# Eq. 26
@row("26", "closed loop of the position with the net", "m r1_dot = -(K_r1 - m Lambda_1) r1 + W_tilde_1^T mu_1 - "
     "K_i1 int r1 + eps_1", LAW, EquationVerdict.CORRECTED, "add -delta, as in Eq. 20")  # fmt: skip
def equation_26() -> Checks:
    command = loop.sample().command
    w_tilde = array(W_1) - array(loop.W_HAT_1)
    printed = -(K_R1 - MASS * LAMBDA_1) * R1 + w_tilde.T * loop.mu(loop.NET_1, loop.CHI_1) - K_I1 * INTEGRAL + array(EPS_1)
    pushed = dict(zip(FORCE, -ideal_1(), strict=True))
    delta = command.thrust * array(thrust_direction(ATTITUDE)) - force_of(command)
    there = (MASS * r1_dot(command.thrust, command.desired_attitude)).xreplace(pushed)
    real = (MASS * r1_dot(command.thrust)).xreplace(pushed)
    return Checks([
        same("m r1_dot at the desired attitude", there, printed),
        same("m r1_dot at any attitude, with -delta", real, printed - delta),
        unlike("m r1_dot at any attitude, as printed", real, printed),
    ], f"hover, m = 1 kg, theta off by 0.1 rad: m r1_dot is off by |delta| = {short(off_by(0.1))} N")  # fmt: skip


@row("delta", "the coupling that Eqs 20, 26, 56 leave out", "none: F_d = F_d_hat is assumed", "vehicle.paper:thrust_direction",
     EquationVerdict.CORRECTED, "delta = F_d(u_d, theta, phi) - F_d_hat, |delta| <= u_d |e2|; L_dot gains -r1^T delta, which "
     "nothing cancels")  # fmt: skip
def delta() -> Checks:
    there, here = symbols("there"), symbols("here")
    gap = array(thrust_direction(here)) - array(thrust_direction(there))
    s, c = sympy.sin, sympy.cos
    turn = c(here[2]) * c(there[2]) + s(here[2]) * s(there[2])
    law = 2 * (1 - s(here[1]) * s(there[1]) - c(here[1]) * c(there[1]) * turn)
    draw = np.random.default_rng(20)
    a, b = draw.uniform(-np.pi, np.pi, (2, 3, 100_000))
    length = (thrust_direction(Vector(a)) - thrust_direction(Vector(b))).norm()
    ratio = float(np.max(length / np.hypot(a[1] - b[1], a[2] - b[2])))
    return Checks([
        same("|delta|^2 / u_d^2 = 2 (1 - s_th s_thd - c_th c_thd cos(phi - phi_d))", (gap.T * gap)[0], law),
        holds("|delta| <= u_d |e2| at 1e5 random attitudes", ratio <= 1.0 + 1e-12, short(ratio), "at most 1"),
        near("|delta| in hover, theta off by 0.1 rad", off_by(0.1), 9.81 * 2 * np.sin(0.05)),
    ], f"u_d = 9.81 N, theta off by 0.1 rad: |delta| = {short(off_by(0.1))} N; largest |delta| / (u_d |e2|) seen: "
       f"{short(ratio)}")  # fmt: skip
