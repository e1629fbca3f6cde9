"""Rotors and torques: Eq. 5, its interpretation, and the meaning of tau."""

import itertools

import sympy

from quadstep.interfaces.model import Kinematics
from quadstep.numbers import Vector, vector
from quadstep.proofs.verify.algebra import array, holds, listed, near, same, symbol, symbols, unlike, values
from quadstep.proofs.verify.plant import PLACE, THRUST, TORQUE, along_rates, body
from quadstep.proofs.verify.rigid_body import ATTITUDE, INERTIA, PHI, PSI, RATES, THETA, body_rates, known, yaw_innermost, zyx
from quadstep.proofs.verify.rows import EquationRow, EquationVerdict, Evidence, row
from quadstep.vehicle.paper import Rotors, allocate, angular_acceleration, euler_rate_matrix, limit, mix, rotor_map

ROWS: list[EquationRow] = []
ARM, MOMENT = symbol("l"), symbol("c")
ROTORS = Rotors(ARM, MOMENT, symbol("f_min"), symbol("f_max"))
THRUSTS = symbols("f", 4)


@row(ROWS, "5", "rotor map", "(u, tau_phi, tau_theta, tau_psi) = M f, M rows (1, 1, 1, 1), (l, 0, -l, 0), (0, -l, 0, l), "
     "(c, -c, c, -c)", "vehicle.paper:rotor_map", EquationVerdict.AS_PRINTED, "see rotor signs, and tau")  # fmt: skip
def equation_5() -> Evidence:
    printed = sympy.Matrix([[1, 1, 1, 1], [ARM, 0, -ARM, 0], [0, -ARM, 0, ARM], [MOMENT, -MOMENT, MOMENT, -MOMENT]])
    shipped = array(rotor_map(ROTORS))
    u, tau = mix(ROTORS, THRUSTS)
    wanted = sympy.Matrix([THRUST, TORQUE[2], TORQUE[1], TORQUE[0]])
    real = Rotors(0.25, 0.05, 0.0, 8.0)
    kept, cut = limit(real, 12.0, vector(0.1, -0.2, 0.3)), limit(real, 12.0, vector(0.0, 0.0, 4.0))
    return Evidence([
        same("M", shipped, printed),
        near("det M over 8 c l^2", shipped.det() / (8 * MOMENT * ARM**2), 1.0),
        same("thrust and torques of four rotor thrusts", [u, tau[2], tau[1], tau[0]], printed * array(THRUSTS)),
        same("M times the shipped inverse", printed * array(allocate(ROTORS, THRUST, TORQUE)), wanted),
        holds("thrusts within their limits produce the commanded ones",
              max(abs(a - b) for a, b in zip((kept[0], *kept[1]), (12.0, 0.1, -0.2, 0.3), strict=True)) < 1e-12),
        holds("rotors 1 and 3 at 8 N and 0 N leave 2 N m of 4", abs(cut[1][2] - 2.0) < 1e-12 and abs(cut[0] - 14.0) < 1e-12,
              f"tau_phi = {cut[1][2]:g} N m, u = {cut[0]:g} N"),
    ])  # fmt: skip


@row(ROWS, "rotor signs", "positions and spin of the rotors of Eq. 5", "front and rear turn counter-clockwise; pitch by "
     "front and rear, roll by the lateral ones", "vehicle.paper:mix", EquationVerdict.DEFINITION,
     "Eq. 5 with the angles of Eq. 7 puts rotors 1, 2, 3, 4 at -y, -x, +y, +x; then front and rear (4, 2) turn clockwise, "
     "contrary to the text")  # fmt: skip
def rotor_signs() -> Evidence:
    _, tau = mix(ROTORS, THRUSTS)
    level = {PSI: 0, THETA: 0, PHI: 0}
    places = {0: (0, -ARM), 1: (-ARM, 0), 2: (0, ARM), 3: (ARM, 0)}
    checks = []
    for rotor, (x, y) in places.items():
        height = (yaw_innermost() * sympy.Matrix([x, y, 0]))[2]
        climb = sum(height.diff(a).subs(level) * sympy.diff(t, THRUSTS[rotor]) for a, t in zip(ATTITUDE, tau, strict=True))
        checks.append(holds(f"pushing with rotor {rotor + 1} raises its side", climb.is_positive, f"rises by {climb} f"))
    heading = (yaw_innermost() * sympy.Matrix([1, 0, 0]))[1].diff(PSI).subs(level)
    spins = [int(-sympy.sign(heading * sympy.diff(tau[0], f))) for f in THRUSTS]  # against the push on the body
    checks.append(holds("counter-clockwise seen from above", spins == [1, -1, 1, -1],
                        f"rotors {[i + 1 for i, spin in enumerate(spins) if spin > 0]}", "rotors [1, 3]"))  # fmt: skip
    return Evidence(checks)


@row(ROWS, "tau", "meaning of tau", "used as the rotors' torque (Eq. 5) and as the generalised torque (Eq. 3)",
     "vehicle.paper:euler_rate_matrix", EquationVerdict.AS_PRINTED,
     "kept: tau is generalised; virtual work gives tau_eta = T_eta^T tau_body, the same only at theta = phi = 0")  # fmt: skip
def meaning_of_tau() -> Evidence:
    omega = body_rates(zyx())
    t = array(euler_rate_matrix(ATTITUDE, Kinematics.STANDARD))
    _, tau = mix(ROTORS, THRUSTS)
    on_body = sympy.Matrix(list(reversed(tau.entries)))  # about x, y and z
    places = [(0, ARM), (ARM, 0), (0, -ARM), (-ARM, 0)]
    power = sum(f * omega.cross(sympy.Matrix([x, y, 0]))[2] for f, (x, y) in zip(THRUSTS, places, strict=True))
    power += sum(sign * MOMENT * f * omega[2] for f, sign in zip(THRUSTS, itertools.cycle((1, -1)), strict=False))
    torque = symbols("tau_body")
    generalised = t.T * array(torque)
    turning = array(angular_acceleration(body(), ATTITUDE, RATES, Vector(generalised), Kinematics.STANDARD))
    omega_dot, sigma = t * turning + along_rates(t) * array(RATES), sympy.diag(*INERTIA)
    level = t.subs({THETA: 0, PHI: 0})
    by_rotors = dict(zip(torque, (1, 2, 3), strict=True))
    numbers = [float(v) for v in values(list(generalised), known(**PLACE) | by_rotors)]
    return Evidence([
        same("power of the four rotors is tau_body . omega", (on_body.T * omega)[0], power),
        same("tau_body . omega = (T^T tau_body) . eta_dot", (array(torque).T * omega)[0], (generalised.T * array(RATES))[0]),
        same("Sigma omega_dot + omega x Sigma omega = tau_body when the plant gets T^T tau_body",
             sigma * omega_dot + omega.cross(sigma * omega), torque),
        unlike("tau_eta = tau_body", generalised, list(reversed(torque.entries))),
        same("at theta = phi = 0 they are equal", level.T * array(torque), list(reversed(torque.entries))),
    ], f"tau_body = (1, 2, 3) N m about x, y, z at eta = {PLACE['attitude']}: as rotor torques (psi, theta, phi) = (3, 2, 1), "
       f"as generalised torques {listed(numbers)}")  # fmt: skip
