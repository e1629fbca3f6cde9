"""Translation of the body (Eqs 1, 7, 9 and 67) and the direction of the thrust; rotors and torques (Eq. 5, tau)."""

import itertools

import sympy

from quadstep.interfaces.plant import Kinematics
from quadstep.numbers import Vector, vector
from quadstep.proofs.verify.equation_row import (
    Checks,
    EquationVerdict,
    Expression,
    array,
    holds,
    listed,
    near,
    row,
    same,
    short,
    symbol,
    symbols,
    unlike,
    values,
)
from quadstep.proofs.verify.plant import GRAVITY, MASS, PLACE, THRUST, TORQUE, UNEQUAL, along_rates, body
from quadstep.proofs.verify.rigid_body import (
    ATTITUDE,
    INERTIA,
    PHI,
    PSI,
    RATES,
    THETA,
    body_rates,
    rate_map,
    sample_point,
    yaw_innermost,
    zyx,
)
from quadstep.vehicle.paper import (
    Disturbance,
    Rotors,
    State,
    acceleration,
    allocate,
    angular_acceleration,
    derivative,
    disturb,
    effective_inertia,
    euler_rate_matrix,
    limit,
    mix,
    rotor_map,
    thrust_direction,
)
from quadstep.world.paths import blend

STATE = State(symbols("xi"), symbols("xi_dot"), ATTITUDE, RATES)
NOTHING = Vector((0.0, 0.0, 0.0))
WEIGHT = sympy.Matrix([0, 0, MASS * GRAVITY])


def printed_direction(attitude: Vector = ATTITUDE) -> Expression:
    """(-sin theta, cos theta sin phi, cos theta cos phi), as Eq. 7 prints it."""
    _, theta, phi = attitude
    s, c = sympy.sin, sympy.cos
    return sympy.Matrix([-s(theta), c(theta) * s(phi), c(theta) * c(phi)])


@row("1", "position subsystem", "m xi_dd + (0, 0, m g) = F_d", "vehicle.paper:acceleration", EquationVerdict.AS_PRINTED)
def equation_1() -> Checks:
    shipped = array(acceleration(body(), ATTITUDE, THRUST, NOTHING))
    return Checks([same("m xi_dd + (0, 0, m g) of the plant", MASS * shipped + WEIGHT, THRUST * printed_direction())])


@row("7", "position subsystem, summary", "m xi_dd = u (-s_th, c_th s_ph, c_th c_ph) + (0, 0, -m g)",
     "vehicle.paper:thrust_direction", EquationVerdict.AS_PRINTED, "see thrust direction")  # fmt: skip
def equation_7() -> Checks:
    shipped = array(acceleration(body(), ATTITUDE, THRUST, NOTHING))
    return Checks([
        same("direction of the thrust", thrust_direction(ATTITUDE), printed_direction()),
        same("m xi_dd of the plant", MASS * shipped, THRUST * printed_direction() - WEIGHT),
    ])  # fmt: skip


@row("thrust direction", "direction of the thrust and order of the angles", "(-s_th, c_th s_ph, c_th c_ph)",
     "vehicle.paper:thrust_direction", EquationVerdict.AS_PRINTED, "kept, but it is R e3 for R = Rx(-phi) Ry(-theta) "
     "Rz(-psi), not for T_eta's Rz Ry Rx: one rigid body only while the inertias are equal")  # fmt: skip
def direction() -> Checks:
    shipped, up = array(thrust_direction(ATTITUDE)), sympy.Matrix([0, 0, 1])
    t = rate_map(yaw_innermost())
    psi, theta, _ = ATTITUDE
    s, c = sympy.sin, sympy.cos
    named = sympy.Matrix([[0, s(psi), -c(psi) * c(theta)], [0, -c(psi), -s(psi) * c(theta)], [-1, 0, s(theta)]])
    own = t.T * sympy.diag(*INERTIA) * t
    flown = array(effective_inertia(ATTITUDE, INERTIA, Kinematics.STANDARD))
    equal = dict(zip(INERTIA, [INERTIA[0]] * 3, strict=True))
    point = sample_point(inertia=UNEQUAL, **PLACE)
    ours, other, j_flown, j_own = (
        [float(value) for value in values(list(things), point)]
        for things in (shipped, zyx() * up, flown[0, :2], own[0, :2])
    )  # fmt: skip
    return Checks([
        same("R e3, yaw innermost", shipped, yaw_innermost() * up),
        unlike("R e3 for R = Rz Ry Rx", shipped, zyx() * up),
        same("body rates of that order, T_Q", t, named),
        same("equal inertias: T_Q^T Sigma T_Q is the J that flies", flown.xreplace(equal), own.xreplace(equal)),
        unlike("unequal inertias: T_Q^T Sigma T_Q is the J that flies", flown, own),
    ], f"at eta = {PLACE['attitude']}: {listed(ours)} printed, {listed(other)} for Rz Ry Rx; for Sigma = diag{UNEQUAL}, "
       f"(J11, J12) = {listed(j_flown)} flown, {listed(j_own)} in the thrust's own order")  # fmt: skip


@row("9", "position subsystem with disturbance", "m x_dd = -u s_th + A_x; m y_dd = u c_th s_ph + A_y; "
     "m z_dd = u c_th c_ph - m g + A_z", "vehicle.paper:derivative", EquationVerdict.AS_PRINTED)  # fmt: skip
def equation_9() -> Checks:
    force = symbols("A_xyz")
    rate = derivative(body(), Disturbance(0.0, force, NOTHING), Kinematics.STANDARD, STATE, THRUST, TORQUE)
    return Checks([
        same("m xi_dd of the plant", MASS * array(rate.velocity), THRUST * printed_direction() - WEIGHT + array(force)),
        same("position moves by its velocity", rate.position, STATE.velocity),
    ])  # fmt: skip


@row("67", "disturbance of the simulation", "A_xyz = A_eta = 3x2 array (x_dot phi_dot; y_dot theta_dot; z_dot psi_dot)",
     "vehicle.paper:disturb", EquationVerdict.CORRECTED,
     "a 3x2 array is not a force; the product of each row is meant, since sums contradict tau_psi = 0 in Case 1")  # fmt: skip
def equation_67() -> Checks:
    scale, force, moment = symbol("scale"), symbols("F"), symbols("M")
    a_xyz, a_eta = disturb(Disturbance(scale, force, moment), STATE)
    pairs = list(zip(STATE.velocity, reversed(RATES.entries), strict=True))
    products = scale * sympy.Matrix([v * w for v, w in pairs])
    sums = scale * sympy.Matrix([v + w for v, w in pairs])
    _, rate, _ = blend(20.0, 40.0)
    speed = 20.0 * rate
    only_x = dict.fromkeys((*STATE.velocity, *RATES), 0) | {STATE.velocity[0]: speed, scale: 1}
    by_product, by_sum = (float(thing[0].subs(only_x)) for thing in (products, sums))
    return Checks([
        same("A_xyz", a_xyz, products + array(force)),
        same("A_eta", a_eta, products + array(moment)),
        unlike("sums give A_xyz", a_xyz, sums + array(force)),
        near("A_psi of the products at Case 1's top speed, level", by_product, 0.0),
        near("A_psi of the sums there", by_sum, 0.9375),
    ], f"Case 1 at its top speed, {short(speed)} m/s along x, level: the sums push psi with {short(by_sum)} N m, which "
       "tau_psi has to balance; the products push with 0")  # fmt: skip


ARM, MOMENT = symbol("l"), symbol("c")
ROTORS = Rotors(ARM, MOMENT, symbol("f_min"), symbol("f_max"))
THRUSTS = symbols("f", 4)


@row("5", "rotor map", "(u, tau_phi, tau_theta, tau_psi) = M f, M rows (1, 1, 1, 1), (l, 0, -l, 0), (0, -l, 0, l), "
     "(c, -c, c, -c)", "vehicle.paper:rotor_map", EquationVerdict.AS_PRINTED, "see rotor signs, and tau")  # fmt: skip
def equation_5() -> Checks:
    printed = sympy.Matrix([[1, 1, 1, 1], [ARM, 0, -ARM, 0], [0, -ARM, 0, ARM], [MOMENT, -MOMENT, MOMENT, -MOMENT]])
    shipped = array(rotor_map(ROTORS))
    u, tau = mix(ROTORS, THRUSTS)
    wanted = sympy.Matrix([THRUST, TORQUE[2], TORQUE[1], TORQUE[0]])
    real = Rotors(0.25, 0.05, 0.0, 8.0)
    kept, cut = limit(real, 12.0, vector(0.1, -0.2, 0.3)), limit(real, 12.0, vector(0.0, 0.0, 4.0))
    return Checks([
        same("M", shipped, printed),
        near("det M over 8 c l^2", shipped.det() / (8 * MOMENT * ARM**2), 1.0),
        same("thrust and torques of four rotor thrusts", [u, tau[2], tau[1], tau[0]], printed * array(THRUSTS)),
        same("M times the shipped inverse", printed * array(allocate(ROTORS, THRUST, TORQUE)), wanted),
        holds("thrusts within their limits produce the commanded ones",
              max(abs(a - b) for a, b in zip((kept[0], *kept[1]), (12.0, 0.1, -0.2, 0.3), strict=True)) < 1e-12),
        holds("rotors 1 and 3 at 8 N and 0 N leave 2 N m of 4", abs(cut[1][2] - 2.0) < 1e-12 and abs(cut[0] - 14.0) < 1e-12,
              f"tau_phi = {cut[1][2]:g} N m, u = {cut[0]:g} N"),
    ])  # fmt: skip


@row("rotor signs", "positions and spin of the rotors of Eq. 5", "front and rear turn counter-clockwise; pitch by "
     "front and rear, roll by the lateral ones", "vehicle.paper:mix", EquationVerdict.DEFINITION,
     "Eq. 5 with the angles of Eq. 7 puts rotors 1, 2, 3, 4 at -y, -x, +y, +x; then front and rear (4, 2) turn clockwise, "
     "contrary to the text")  # fmt: skip
def rotor_signs() -> Checks:
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
    return Checks(checks)


@row("tau", "meaning of tau", "used as the rotors' torque (Eq. 5) and as the generalised torque (Eq. 3)",
     "vehicle.paper:euler_rate_matrix", EquationVerdict.AS_PRINTED,
     "kept: tau is generalised; virtual work gives tau_eta = T_eta^T tau_body, the same only at theta = phi = 0")  # fmt: skip
def meaning_of_tau() -> Checks:
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
    numbers = [float(v) for v in values(list(generalised), sample_point(**PLACE) | by_rotors)]
    return Checks([
        same("power of the four rotors is tau_body . omega", (on_body.T * omega)[0], power),
        same("tau_body . omega = (T^T tau_body) . eta_dot", (array(torque).T * omega)[0], (generalised.T * array(RATES))[0]),
        same("Sigma omega_dot + omega x Sigma omega = tau_body when the plant gets T^T tau_body",
             sigma * omega_dot + omega.cross(sigma * omega), torque),
        unlike("tau_eta = tau_body", generalised, list(reversed(torque.entries))),
        same("at theta = phi = 0 they are equal", level.T * array(torque), list(reversed(torque.entries))),
    ], f"tau_body = (1, 2, 3) N m about x, y, z at eta = {PLACE['attitude']}: as rotor torques (psi, theta, phi) = (3, 2, 1), "
       f"as generalised torques {listed(numbers)}")  # fmt: skip
