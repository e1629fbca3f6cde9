"""The inner loop: Eqs 27-39, chi_2, and the rate of the desired attitude."""

import sympy

from quadstep.control.backstepping import desired_torque
from quadstep.control.filters import Filtered, command_filter
from quadstep.interfaces.learning import output
from quadstep.interfaces.plant import Kinematics
from quadstep.numbers import Vector
from quadstep.proofs.verify import closed_loop as loop
from quadstep.proofs.verify.closed_loop import (
    CHI_2,
    DESIRED_DD,
    E2,
    E2_DOT,
    ETA_D,
    ETA_D_DOT,
    GAINS,
    LAMBDA_2,
    MEMORY,
    MOMENT,
    R2,
    W_HAT_2,
    diagonal,
)
from quadstep.proofs.verify.equation_row import (
    Checks,
    EquationVerdict,
    Expression,
    along,
    array,
    near,
    number,
    reduced,
    row,
    same,
    short,
    symbol,
    symbols,
    unlike,
)
from quadstep.proofs.verify.plant import TORQUE, inertia_matrix
from quadstep.proofs.verify.rigid_body import ATTITUDE, INERTIA, RATES
from quadstep.vehicle.paper import coriolis, effective_inertia

ERRORS, TORQUE_LAW = "control.backstepping:attitude_errors", "control.backstepping:desired_torque"
NET, LAW = "control.backstepping:torque_basis", "control.backstepping:Backstepping.law"
K_R2, K_I2 = diagonal(GAINS.gain_2), diagonal(GAINS.integral_2)
INTEGRAL = array(MEMORY.integral_2)
ETA_D_DD = array(DESIRED_DD)
W_2, EPS_2 = loop.weights("W2", loop.NEURONS, 3), symbols("eps2")


def coriolis_matrix() -> Expression:
    return array(coriolis(ATTITUDE, RATES, INERTIA, Kinematics.STANDARD))


def j_r2_dot(torque: Vector = TORQUE) -> Expression:
    """J times the rate of the shipped r2 along the motion of the shipped plant."""
    r2_dot = along(loop.sample(learning=False).command.r2, loop.motion(loop.plant(torque=torque)))
    return inertia_matrix() * array(r2_dot)


def target() -> Expression:
    """The target of the second net, Eq. 33."""
    j, c = inertia_matrix(), coriolis_matrix()
    return j * ETA_D_DD - array(MOMENT) + c * (ETA_D_DOT + LAMBDA_2 * E2) - j * LAMBDA_2**2 * E2


@row("27", "attitude error", "e2 = (psi_d - psi, theta_d - theta, phi_d - phi)", ERRORS, EquationVerdict.AS_PRINTED,
     "the text before it once writes eta_d as (phi_d, theta_d, psi_d)")  # fmt: skip
def equation_27() -> Checks:
    r2 = array(loop.sample(gains=GAINS._replace(slope_2=Vector((1.0, 1.0, 1.0)))).command.r2)
    matched = dict(zip(ETA_D_DOT, RATES, strict=True))
    return Checks([same("r2 of the law for Lambda_2 = I, at the desired rates", r2.xreplace(matched), E2)])


@row("28", "filtered error of the attitude", "r2 = e2_dot + Lambda_2 e2", ERRORS, EquationVerdict.AS_PRINTED,
     "e2_dot by the command filter, see eta_d_dot")  # fmt: skip
def equation_28() -> Checks:
    return Checks([same("r2 of the law", loop.sample().command.r2, E2_DOT + LAMBDA_2 * E2)])


# Eq. 29
@row("29", "rate of r2", "J r2_dot = J e2_dot + J Lambda_2 e2_dot = J eta_d_dd - {tau - C eta_dot + A_eta} + "
     "J Lambda_2 (r2 - Lambda_2 e2)", ERRORS, EquationVerdict.CORRECTED, "slip: J e2_dd, not J e2_dot; the second line is "
     "right")  # fmt: skip
def equation_29() -> Checks:
    j, real = inertia_matrix(), j_r2_dot()
    e2_dd = ETA_D_DD - array(loop.plant().rates)
    second = (
        j * ETA_D_DD - (array(TORQUE) - coriolis_matrix() * array(RATES) + array(MOMENT)) + j * LAMBDA_2 * (R2 - LAMBDA_2 * E2)
    )
    still = dict.fromkeys((*ATTITUDE, *RATES, *TORQUE, *MOMENT, *ETA_D, *ETA_D_DOT), sympy.S.Zero)
    point = still | dict.fromkeys((*INERTIA, *GAINS.slope_2, *DESIRED_DD), sympy.S(5))
    first = j * E2_DOT + j * LAMBDA_2 * E2_DOT
    by_print, true = (number(thing[1].xreplace(still), {k: v for k, v in point.items() if k not in still})
                      for thing in (first, second))  # fmt: skip
    return Checks([
        same("first line with e2_dd", real, j * e2_dd + j * LAMBDA_2 * E2_DOT),
        unlike("first line as printed", real, first),
        same("second line", real, second),
    ], f"at rest, level, no error, no torque, Sigma = 5 I, theta_d_dd = 5 rad/s^2: {short(by_print)} N m by the printed first "
       f"line, {short(true)} N m by the second")  # fmt: skip


@row("30", "rates in r2 and e2", "eta_dot = -r2 + eta_d_dot + Lambda_2 e2", ERRORS, EquationVerdict.AS_PRINTED)
def equation_30() -> Checks:
    return Checks(
        [same("eta_dot from the r2 of the law", -array(loop.sample().command.r2) + ETA_D_DOT + LAMBDA_2 * E2, RATES)]
    )


# Eq. 31
@row("31", "rate of r2 with Eq. 30", "J r2_dot = J eta_d_dd - {tau - C (-r2 + eta_d_dot + Lambda_2 e2) + A_eta} + "
     "J Lambda_2 (r2 - Lambda_2 e2)", ERRORS, EquationVerdict.AS_PRINTED)  # fmt: skip
def equation_31() -> Checks:
    j, c = inertia_matrix(), coriolis_matrix()
    inside = array(TORQUE) - c * (-R2 + ETA_D_DOT + LAMBDA_2 * E2) + array(MOMENT)
    return Checks([same("J r2_dot", j_r2_dot(), j * ETA_D_DD - inside + j * LAMBDA_2 * (R2 - LAMBDA_2 * E2))])


# Eq. 32
@row("32", "rate of r2, ordered", "J r2_dot = -tau - C r2 + {J eta_d_dd - A_eta + C (eta_d_dot + Lambda_2 e2) - "
     "J Lambda_2^2 e2} + J Lambda_2 r2", ERRORS, EquationVerdict.AS_PRINTED)  # fmt: skip
def equation_32() -> Checks:
    printed = -array(TORQUE) - coriolis_matrix() * R2 + target() + inertia_matrix() * LAMBDA_2 * R2
    return Checks([same("J r2_dot", j_r2_dot(), printed)])


@row("33", "function approximated by the second net", "v_NN2 = {J eta_d_dd - A_eta + C (eta_d_dot + Lambda_2 e2) - "
     "J Lambda_2^2 e2} = W_2^T mu_2(chi_2) + eps_2", NET, EquationVerdict.DEFINITION,
     "a function of more than chi_2, see chi_2; W_2 cannot be constant, as eta_d depends on W_hat_1; the text's "
     "bound on 'e_2' must mean eps_2")  # fmt: skip
def equation_33() -> Checks:
    j = array(effective_inertia(ATTITUDE, INERTIA, Kinematics.STANDARD))
    ideal = j_r2_dot() + array(TORQUE) + coriolis_matrix() * R2 - j * LAMBDA_2 * R2
    weights = [list(row) for row in loop.NET_2.input_weights]
    sigmoids = [1 / (1 + sympy.exp(-sum(w * x for w, x in zip(row, (*CHI_2, 1), strict=True)))) for row in weights]
    return Checks([
        same("the torque that leaves J r2_dot = J Lambda_2 r2 - C r2", ideal, target()),
        same("mu_2 of the code: sigmoid of weighted inputs and a bias", loop.mu(loop.NET_2, CHI_2), sigmoids),
    ])  # fmt: skip


@row("34", "second net", "v_NN2_hat = W_hat_2^T mu_2(chi_2)", "interfaces.learning:output", EquationVerdict.AS_PRINTED)
def equation_34() -> Checks:
    spoken = array(loop.sample().command.torque) - array(loop.sample(learning=False).command.torque)
    return Checks([
        same("what the net adds to tau in the law", spoken, array(W_HAT_2).T * loop.mu(loop.NET_2, CHI_2)),
        same("W_hat^T mu", output(W_HAT_2, symbols("mu", 2)), array(W_HAT_2).T * array(symbols("mu", 2))),
    ])  # fmt: skip


@row("35", "torque law", "tau = v_NN2_hat + K_r2 r2 + K_i2 int r2", TORQUE_LAW, EquationVerdict.AS_PRINTED)
def equation_35() -> Checks:
    command, following = loop.sample()
    r2, estimate = symbols("r2"), symbols("v_hat")
    alone = desired_torque(GAINS, r2, MEMORY.integral_2, estimate)
    printed = array(W_HAT_2).T * loop.mu(loop.NET_2, CHI_2) + K_R2 * R2 + K_I2 * INTEGRAL  # with Eq. 34
    return Checks([
        same("tau", alone, array(estimate) + K_R2 * array(r2) + K_I2 * INTEGRAL),
        same("tau of the law", command.torque, printed),
        same("int r2 grows by r2 each sample", array(following.integral_2) - INTEGRAL, loop.PERIOD * R2),
    ])  # fmt: skip


def net_error() -> tuple[Expression, Expression]:
    """v_tilde by Eqs 33 and 34, and its last form in Eqs 36 and 39."""
    mu = loop.mu(loop.NET_2, CHI_2)
    ideal = array(W_2).T * mu + array(EPS_2)
    return ideal - array(output(W_HAT_2, Vector(mu))), (array(W_2) - array(W_HAT_2)).T * mu + array(EPS_2)


V_TILDE = "v_tilde_NN2 = v_NN2 - v_hat_NN2 = W_2^T mu_2 - W_hat_2^T mu_2 + eps_2 = W_tilde_2^T mu_2 + eps_2"


@row("36", "error of the second net", V_TILDE, "interfaces.learning:output", EquationVerdict.DEFINITION)
def equation_36() -> Checks:
    return Checks([same("v_NN2 - v_hat_NN2", *net_error())])


def rest() -> Expression:
    """The terms of Eqs 37 and 38 besides the net's error."""
    return inertia_matrix() * LAMBDA_2 * R2 - coriolis_matrix() * R2 - K_R2 * R2 - K_I2 * INTEGRAL


# Eq. 37
@row("37", "closed loop of the attitude", "J r2_dot = v_tilde_NN2 + J Lambda_2 r2 - C r2 - K_r2 r2 - K_i2 int r2",
     TORQUE_LAW, EquationVerdict.AS_PRINTED)  # fmt: skip
def equation_37() -> Checks:
    estimate = symbols("v_hat")
    torque = desired_torque(GAINS, loop.sample().command.r2, MEMORY.integral_2, estimate)
    return Checks([same("J r2_dot under tau of Eq. 35", j_r2_dot(torque), target() - array(estimate) + rest())])


# Eq. 38
@row("38", "closed loop of the attitude with the net",
     "J r2_dot = W_tilde_2^T mu_2 - {K_r2 + C - J Lambda_2} r2 - K_i2 int r2 + "
     "eps_2", LAW, EquationVerdict.AS_PRINTED)  # fmt: skip
def equation_38() -> Checks:
    ideal = array(W_2).T * loop.mu(loop.NET_2, CHI_2) + array(EPS_2)
    lacking = target() - ideal  # Eq. 33 says that this is zero
    return Checks([same("J r2_dot under the law, by Eq. 33", j_r2_dot(loop.sample().command.torque) - lacking,
                          net_error()[1] + rest())])  # fmt: skip


# Eq. 39
@row("39", "error of the second net, again", V_TILDE, "interfaces.learning:output", EquationVerdict.DEFINITION,
     "Eq. 36 repeated")  # fmt: skip
def equation_39() -> Checks:
    spoken = array(loop.sample().command.torque) - K_R2 * R2 - K_I2 * INTEGRAL
    ideal = array(W_2).T * loop.mu(loop.NET_2, CHI_2) + array(EPS_2)
    return Checks([same("v_NN2 less the output of the law's net", ideal - spoken, net_error()[1])])


@row("chi_2", "input of the second net", "chi_2 = (eta, r1, r2)", NET, EquationVerdict.AS_PRINTED,
     "kept, but the target of Eq. 33 is not a function of it: e2 may change while r2 does not")  # fmt: skip
def chi_2() -> Checks:
    theta_d, theta_d_dot, slope = ETA_D[1], ETA_D_DOT[1], GAINS.slope_2[1]
    shift = {theta_d: theta_d + sympy.Rational(1, 10), theta_d_dot: theta_d_dot - slope / 10}
    said = array(loop.sample().command.torque)
    moved = (target().xreplace(shift) - target()).xreplace(dict.fromkeys(INERTIA, sympy.S(5)) | {slope: sympy.S(3)})[1]
    by = number(reduced(moved), {})
    return Checks([
        same("the law's torque does not change", said.xreplace(shift), said),
        near("its target changes by", by, -4.5),
    ], f"Sigma = 5 I, Lambda_2 = 3, e2_theta larger by 0.1 rad at the same r2: chi_2 the same, the target {short(by)} N "
       "m")  # fmt: skip


@row("eta_d_dot", "rate of the desired attitude", "used in Eq. 28, never defined", "control.filters:command_filter",
     EquationVerdict.DEFINITION, "theta_d and phi_d pass through x_dd = w^2 (command - x) - 2 w x_dot, solved exactly: the "
     "true rate contains eta_dd, and so the torque itself")  # fmt: skip
def eta_d_dot() -> Checks:
    t, w = symbol("t"), symbol("w")
    start, command = Filtered(symbols("x", 2), symbols("x_dot", 2)), symbols("command", 2)
    now = command_filter(start, command, w, t)
    x, x_dot = array(now.value), array(now.rate)
    after = command_filter(now, command, w, symbol("s"))
    at_once = command_filter(start, command, w, t + symbol("s"))
    used = loop.sample()
    fed = command_filter(
        MEMORY.filtered, Vector(used.command.desired_attitude.entries[1:]), GAINS.filter_frequency, loop.PERIOD
    )
    return Checks([
        same("rate is the rate of the value", x.diff(t), x_dot),
        same("the filter's equation", x_dot.diff(t), w**2 * (array(command) - x) - 2 * w * x_dot),
        same("start", [*x.subs(t, 0), *x_dot.subs(t, 0)], [*start.value, *start.rate]),
        same("two samples are one of both lengths", [*after.value, *after.rate], [*at_once.value, *at_once.rate]),
        same("the law filters its own theta_d and phi_d", [*used.following.filtered.value, *used.following.filtered.rate],
             [*fed.value, *fed.rate]),
    ])  # fmt: skip
