"""Statements that the paper makes in words: assumption (a), errors 'arbitrarily small', its conclusion's force dynamics;
and the controller of its reference [11], which Case 3 flies, in floats, because its saturations nest four deep.
"""

import math

import numpy as np
import sympy

from quadstep.control.backstepping import desired_force
from quadstep.control.nested_saturation import NestedSaturation, NestedSaturationGains, NoMemory, nested
from quadstep.interfaces.plant import Kinematics, Reference
from quadstep.numbers import Vector, vector
from quadstep.proofs.verify import closed_loop as loop
from quadstep.proofs.verify.attitude_loop import target
from quadstep.proofs.verify.closed_loop import GAINS, MEMORY, REFERENCE, STATE
from quadstep.proofs.verify.equation_row import (
    Checks,
    EquationVerdict,
    Expression,
    array,
    holds,
    listed,
    near,
    number,
    row,
    same,
    short,
    symbols,
    unlike,
)
from quadstep.proofs.verify.plant import MASS, THRUST, body
from quadstep.proofs.verify.rigid_body import ATTITUDE, INERTIA
from quadstep.vehicle.paper import Rotors, State, Vehicle, acceleration, angular_acceleration, effective_inertia

FORCE_LAW, NET = "control.backstepping:desired_force", "control.backstepping:torque_basis"


def shipped_force() -> Expression:
    zero = Vector((0.0, 0.0, 0.0))
    return array(desired_force(GAINS, REFERENCE, zero, zero, zero, zero))


@row("assumption (a)", "the theorem's assumption about the path", "|q_d| < q_B, q_d = (xi_d, psi_d); "
     "'assumption (a) always holds'", FORCE_LAW, EquationVerdict.CORRECTED,
     "Eq. 24 needs a bounded xi_d_dd, Eq. 33 a bounded eta_d_dd and so xi_d's fourth and psi_d's second derivative; a bound "
     "on q_d bounds none of them")  # fmt: skip
def assumption() -> Checks:
    fast = 100.0  # rad/s, along x_d = sin(fast t)
    still = dict.fromkeys((*REFERENCE.acceleration,), 0)
    swing = {**still, REFERENCE.acceleration[0]: -(fast**2), MASS: 1, GAINS.gravity: 9.81}
    force = math.hypot(*(number(entry.xreplace(swing), {}) for entry in shipped_force()))
    slope = shipped_force().jacobian(list(REFERENCE.acceleration))
    wanted_dd = target().jacobian(list(loop.DESIRED_DD))
    return Checks([
        same("F_d_hat grows with xi_d_dd by m", slope, MASS * sympy.eye(3)),
        same("the target of the second net (Eq. 33) grows with eta_d_dd by J", wanted_dd,
             array(effective_inertia(ATTITUDE, INERTIA, Kinematics.STANDARD))),
        near("|F_d_hat| at the turn of x_d = sin(100 t), m = 1 kg", force, math.hypot(fast**2, 9.81)),
    ], f"x_d = sin(100 t) m, |q_d| <= 1: m = 1 kg needs {short(force)} N")  # fmt: skip


@row("arbitrarily small", "Theorem 5.1, last sentence", "r_1 and r_2 can be made arbitrarily small by K_r1, "
     "K_r2, Lambda_1, Lambda_2", NET, EquationVerdict.CORRECTED,
     "not shown: b_r falls as K_v grows only if W_B and eps_v stay, but Lambda_2^2 appears in the second net's target "
     "(Eq. 33), and the gains of the outer loop in eta_d_dd")  # fmt: skip
def arbitrarily_small() -> Checks:
    level = dict.fromkeys(
        (*ATTITUDE, *loop.MOMENT, *loop.DESIRED_DD, *STATE.rates, *MEMORY.filtered.rate, REFERENCE.yaw_rate), 0
    )
    off = {MEMORY.filtered.value[0]: sympy.Rational(1, 10), MEMORY.filtered.value[1]: 0, REFERENCE.yaw: 0}
    there = target()[1].xreplace(level).xreplace(off).xreplace(dict.fromkeys(INERTIA, sympy.S(5)))
    slope = GAINS.slope_2[1]
    low, high = (number(there.xreplace({slope: sympy.S(value)}), {}) for value in (15, 30))
    asked = desired_force(GAINS, REFERENCE, symbols("e1"), symbols("r1"), MEMORY.integral_1, symbols("v_hat"))
    slope_1 = array(asked).jacobian(list(GAINS.gain_1))
    return Checks([
        near("the second net's target, level and at rest, e2_theta = 0.1 rad, Sigma = 5 I, Lambda_2 = 15", low, -112.5),
        near("the same, Lambda_2 = 30", high, 4.0 * -112.5),
        unlike("F_d_hat, and so eta_d, moves with K_r1", slope_1, sympy.zeros(3, 3)),
    ], f"Sigma = 5 I, e2_theta = 0.1 rad at rest: Lambda_2 = 15 demands {short(-low)} N m of the second net, Lambda_2 = 30 "
       f"demands {short(-high)} N m")  # fmt: skip


@row("conclusion", "Section 7 on the force dynamics",
     "'completely independent of the rotational dynamics except through the aerodynamic state dependent disturbances'",
     "vehicle.paper:acceleration", EquationVerdict.CORRECTED, "the attitude sets the thrust's direction (Eqs 1, 7): without "
     "any aerodynamics theta and phi still move the vehicle sideways")  # fmt: skip
def conclusion() -> Checks:
    nothing = vector(0.0, 0.0, 0.0)
    free = array(acceleration(body(), ATTITUDE, THRUST, nothing))
    moved = free.jacobian(list(ATTITUDE))
    hover = {THRUST: sympy.Float(9.81), MASS: 1, body().gravity: sympy.Float(9.81), ATTITUDE[0]: 0, ATTITUDE[2]: 0}
    tilted = number(free[0].xreplace(hover).xreplace({ATTITUDE[1]: sympy.Rational(1, 10)}), {})
    return Checks([
        unlike("xi_dd moves with the attitude, no force but thrust and weight", moved, sympy.zeros(3, 3)),
        near("x_dd in hover, theta = 0.1 rad", tilted, -9.81 * math.sin(0.1)),
    ], f"hover, m = 1 kg, theta = 0.1 rad, still air: x_dd = {short(tilted)} m/s^2")  # fmt: skip


WIDE, NARROW = vector(8e6, 4e6, 2e6, 1e6), vector(2.0, 1.0, 0.2, 0.1)


@row("[11]", "the controller of reference [11]", "not given in this paper", "control.nested_saturation:NestedSaturation.law",
     EquationVerdict.DEFINITION, "u c_th c_ph = m g - m (a_z1 z_dot + a_z2 z); tau = C eta_dot + J tau~; unsaturated, each "
     "channel has the poles of (s + 1)^4")  # fmt: skip
def reference_11() -> Checks:
    slopes = [-nested(WIDE, *unit) for unit in np.eye(4).tolist()]
    far, near_by = nested(NARROW, 0.0, 0.0, 0.0, 100.0), nested(NARROW, 0.01, -0.02, 0.03, 0.01)
    draw = np.random.default_rng(11)
    lift = turn = logged = 0.0
    for _ in range(20):
        state = State(*(Vector(draw.uniform(-1.2, 1.2, 3).tolist()) for _ in range(4)))
        a_z, a_psi, slope_1, slope_2 = (Vector(draw.uniform(0.5, 3, n).tolist()) for n in (2, 2, 3, 3))
        position, velocity, ahead = (Vector(draw.uniform(-1, 1, 3).tolist()) for _ in range(3))
        path = Reference(position, velocity, ahead, *draw.uniform(-1, 1, 2).tolist())
        body = Vehicle(1.7, vector(5.0, 8.0, 12.0), 9.81, Rotors(0.25, 0.05, 0.0, 8.0))
        gains = NestedSaturationGains(1.7, body.inertia, 9.81, a_z, a_psi, WIDE, slope_1, slope_2, pace=1.0)
        command, _ = NestedSaturation().law(NoMemory(), state, path, gains, 0.0, 0.0)
        e, e_dot = state.position - position, state.velocity - velocity
        climb = acceleration(body, state.attitude, command.thrust, vector(0.0, 0.0, 0.0))[2]
        eta_dd = angular_acceleration(body, state.attitude, state.rates, command.torque, Kinematics.STANDARD)
        (psi, theta, phi), (psi_dot, theta_dot, phi_dot) = state.attitude, state.rates
        wanted = vector(
            -a_psi[0] * (psi_dot - path.yaw_rate) - a_psi[1] * (psi - path.yaw),
            -(4 * theta_dot + 6 * theta - (4 * e_dot[0] + e[0]) / 9.81),
            -(4 * phi_dot + 6 * phi + (4 * e_dot[1] + e[1]) / 9.81),
        )
        r1 = -e_dot - slope_1 * e
        r2 = vector(path.yaw_rate, 0.0, 0.0) - state.rates + slope_2 * (vector(path.yaw, 0.0, 0.0) - state.attitude)
        lift = max(lift, abs(climb + a_z[0] * e_dot[2] + a_z[1] * e[2]))
        turn = max(turn, (eta_dd - wanted).norm())
        logged = max(logged, (command.r1 - r1).norm(), (command.r2 - r2).norm())
    return Checks([
        holds("a_dd = -(4 a_dot + 6 a + 4 v + p) unsaturated", slopes == [4.0, 6.0, 4.0, 1.0], listed(slopes), "(4, 6, 4, 1)"),
        near("a_dd far away", far, -0.1, 1e-12),
        near("a_dd close by", near_by, -(0.04 - 0.12 + 0.12 + 0.01), 1e-12),
        holds("z_dd = -a_z1 z_dot - a_z2 z by the plant, 20 random states", lift < 1e-10, f"off by {lift:.0e}", "equal"),
        holds("eta_dd = tau~ by the plant", turn < 1e-8, f"off by {turn:.0e}", "equal"),
        holds("logged r1 and r2", logged < 1e-12, f"off by {logged:.0e}", "equal"),
    ])  # fmt: skip
