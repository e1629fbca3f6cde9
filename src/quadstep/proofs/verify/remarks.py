"""Statements that the paper makes in words: assumption (a), errors 'arbitrarily small', its conclusion's force dynamics."""

import math

import sympy

from quadstep.control.backstepping import wanted_force
from quadstep.interfaces.model import Kinematics
from quadstep.numbers import Vector, vector
from quadstep.proofs.verify import closed_loop as loop
from quadstep.proofs.verify.algebra import Expression, array, near, number, same, short, symbols, unlike
from quadstep.proofs.verify.attitude_loop import target
from quadstep.proofs.verify.closed_loop import GAINS, MEMORY, REFERENCE, STATE
from quadstep.proofs.verify.plant import MASS, THRUST, body
from quadstep.proofs.verify.rigid_body import ATTITUDE, INERTIA
from quadstep.proofs.verify.rows import EquationRow, EquationVerdict, Evidence, row
from quadstep.vehicle.paper import acceleration, effective_inertia

ROWS: list[EquationRow] = []
FORCE_LAW, NET = "control.backstepping:wanted_force", "control.backstepping:torque_basis"


def shipped_force() -> Expression:
    """The shipped F_d_hat."""
    zero = Vector((0.0, 0.0, 0.0))
    return array(wanted_force(GAINS, REFERENCE, zero, zero, zero, zero))


@row(ROWS, "assumption (a)", "the theorem's assumption about the path", "|q_d| < q_B, q_d = (xi_d, psi_d); "
     "'assumption (a) always holds'", FORCE_LAW, EquationVerdict.CORRECTED,
     "Eq. 24 needs a bounded xi_d_dd, Eq. 33 a bounded eta_d_dd and so xi_d's fourth and psi_d's second derivative; a bound "
     "on q_d bounds none of them")  # fmt: skip
def assumption() -> Evidence:
    fast = 100.0  # rad/s, along x_d = sin(fast t)
    still = dict.fromkeys((*REFERENCE.acceleration,), 0)
    swing = {**still, REFERENCE.acceleration[0]: -(fast**2), MASS: 1, GAINS.gravity: 9.81}
    force = math.hypot(*(number(entry.xreplace(swing), {}) for entry in shipped_force()))
    slope = shipped_force().jacobian(list(REFERENCE.acceleration))
    wanted_dd = target().jacobian(list(loop.DESIRED_DD))
    return Evidence([
        same("F_d_hat grows with xi_d_dd by m", slope, MASS * sympy.eye(3)),
        same("the target of the second net (Eq. 33) grows with eta_d_dd by J", wanted_dd,
             array(effective_inertia(ATTITUDE, INERTIA, Kinematics.STANDARD))),
        near("|F_d_hat| at the turn of x_d = sin(100 t), m = 1 kg", force, math.hypot(fast**2, 9.81)),
    ], f"x_d = sin(100 t) m, |q_d| <= 1: m = 1 kg needs {short(force)} N")  # fmt: skip


@row(ROWS, "arbitrarily small", "Theorem 5.1, last sentence", "r_1 and r_2 can be made arbitrarily small by K_r1, "
     "K_r2, Lambda_1, Lambda_2", NET, EquationVerdict.CORRECTED,
     "not shown: b_r falls as K_v grows only if W_B and eps_v stay, but Lambda_2^2 appears in the second net's target "
     "(Eq. 33), and the gains of the outer loop in eta_d_dd")  # fmt: skip
def arbitrarily_small() -> Evidence:
    level = dict.fromkeys(
        (*ATTITUDE, *loop.MOMENT, *loop.DESIRED_DD, *STATE.rates, *MEMORY.filtered.rate, REFERENCE.yaw_rate), 0
    )
    off = {MEMORY.filtered.value[0]: sympy.Rational(1, 10), MEMORY.filtered.value[1]: 0, REFERENCE.yaw: 0}
    there = target()[1].xreplace(level).xreplace(off).xreplace(dict.fromkeys(INERTIA, sympy.S(5)))
    slope = GAINS.slope_2[1]
    low, high = (number(there.xreplace({slope: sympy.S(value)}), {}) for value in (15, 30))
    slope_1 = asked_in_errors().jacobian(list(GAINS.gain_1))
    return Evidence([
        near("the second net's target, level and at rest, e2_theta = 0.1 rad, Sigma = 5 I, Lambda_2 = 15", low, -112.5),
        near("the same, Lambda_2 = 30", high, 4.0 * -112.5),
        unlike("F_d_hat, and so eta_d, moves with K_r1", slope_1, sympy.zeros(3, 3)),
    ], f"Sigma = 5 I, e2_theta = 0.1 rad at rest: Lambda_2 = 15 demands {short(-low)} N m of the second net, Lambda_2 = 30 "
       f"{short(-high)} N m")  # fmt: skip


def asked_in_errors() -> Expression:
    """The shipped F_d_hat with errors."""
    return array(wanted_force(GAINS, REFERENCE, symbols("e1"), symbols("r1"), MEMORY.integral_1, symbols("v_hat")))


@row(ROWS, "conclusion", "Section 7 on the force dynamics", "'completely independent of the rotational dynamics "
     "except through the aerodynamic state dependent "
     "disturbances'", "vehicle.paper:acceleration", EquationVerdict.CORRECTED,
     "the attitude sets the thrust's direction (Eqs 1, 7): without any aerodynamics theta and phi still move the vehicle "
     "sideways")  # fmt: skip
def conclusion() -> Evidence:
    nothing = vector(0.0, 0.0, 0.0)
    free = array(acceleration(body(), ATTITUDE, THRUST, nothing))
    moved = free.jacobian(list(ATTITUDE))
    hover = {THRUST: sympy.Float(9.81), MASS: 1, body().gravity: sympy.Float(9.81), ATTITUDE[0]: 0, ATTITUDE[2]: 0}
    tilted = number(free[0].xreplace(hover).xreplace({ATTITUDE[1]: sympy.Rational(1, 10)}), {})
    return Evidence([
        unlike("xi_dd moves with the attitude, no force but thrust and weight", moved, sympy.zeros(3, 3)),
        near("x_dd in hover, theta = 0.1 rad", tilted, -9.81 * math.sin(0.1)),
    ], f"hover, m = 1 kg, theta = 0.1 rad, still air: x_dd = {short(tilted)} m/s^2")  # fmt: skip
