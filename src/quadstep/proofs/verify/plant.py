"""Rotation of the body: Eqs 2-4, 6, 8, 10 and 66, and T_eta."""

import sympy

from quadstep.interfaces.plant import Kinematics
from quadstep.numbers import Vector
from quadstep.proofs.verify.equation_row import (
    Check,
    Checks,
    EquationVerdict,
    Expression,
    along,
    array,
    flow_of,
    listed,
    near,
    number,
    row,
    same,
    short,
    symbol,
    symbols,
    unlike,
    values,
)
from quadstep.proofs.verify.rigid_body import (
    ACCELERATIONS,
    ATTITUDE,
    INERTIA,
    RATES,
    euler_torque,
    lagrange,
    rate_map,
    sample_point,
    zyx,
)
from quadstep.vehicle.paper import (
    Disturbance,
    Rotors,
    State,
    Vehicle,
    angular_acceleration,
    coriolis,
    coriolis_torque,
    derivative,
    effective_inertia,
    effective_inertia_partials,
    energy,
    euler_rate_matrix,
    euler_rate_partials,
)

STANDARD, PRINTED = Kinematics.STANDARD, Kinematics.PRINTED
MASS, GRAVITY, THRUST = symbol("m"), symbol("g"), symbol("u")
TORQUE = symbols("tau")
PLACE = {"attitude": (0.3, 0.4, -0.2), "rates": (0.5, -0.7, 0.9)}
UNEQUAL, EQUAL = (5, 8, 12), (5, 5, 5)


def body() -> Vehicle:
    """The vehicle in symbols, inertias unequal."""
    return Vehicle(MASS, INERTIA, GRAVITY, Rotors(symbol("l"), symbol("c"), symbol("f_min"), symbol("f_max")))


def inertia_matrix(kinematics: Kinematics = STANDARD) -> Expression:
    return array(effective_inertia(ATTITUDE, INERTIA, kinematics))


def j_dot(kinematics: Kinematics = STANDARD) -> Expression:
    """Time derivative of the shipped J, by differentiating it."""
    return along_rates(inertia_matrix(kinematics))


def along_rates(matrix: Expression) -> Expression:
    """Time derivative of a SymPy matrix of the attitude."""
    return sum((matrix.diff(angle) * rate for angle, rate in zip(ATTITUDE, RATES, strict=True)), sympy.zeros(*matrix.shape))


def solves_lagrange(kinematics: Kinematics, bias: Expression) -> Check:
    """Check: J times the shipped eta_dd, plus a bias, is the torque."""
    turning = array(angular_acceleration(body(), ATTITUDE, RATES, TORQUE, kinematics))
    return same(f"J eta_dd + C eta_dot = tau, {kinematics} T_eta", inertia_matrix(kinematics) * turning + bias, TORQUE)


@row("2", "rotation subsystem, Lagrange's equations", "J eta_dd + d/dt{J} eta_dot - 1/2 d/deta(eta_dot J eta_dot) = tau",
     "vehicle.paper:coriolis_torque", EquationVerdict.AS_PRINTED,
     "with the transpose on the first eta_dot, which the text at hand lacks")  # fmt: skip
def equation_2() -> Checks:
    checks = [same("C eta_dot from the kinetic energy of R = Rz Ry Rx, unequal inertias",
                   coriolis_torque(ATTITUDE, RATES, INERTIA, STANDARD), lagrange().bias)]  # fmt: skip
    for kinematics in Kinematics:
        j, rates = inertia_matrix(kinematics), array(RATES)
        kinetic = (rates.T * j * rates)[0] / 2
        printed = j_dot(kinematics) * rates - sympy.Matrix([kinetic.diff(angle) for angle in ATTITUDE])
        shipped = coriolis_torque(ATTITUDE, RATES, INERTIA, kinematics)
        checks += [same(f"terms of Eq. 2, {kinematics} T_eta", shipped, printed), solves_lagrange(kinematics, printed)]
    state = State(symbols("xi"), symbols("xi_dot"), ATTITUDE, RATES)
    calm = Disturbance(0.0, Vector((0.0, 0.0, 0.0)), Vector((0.0, 0.0, 0.0)))
    rate = derivative(body(), calm, STANDARD, state, THRUST, TORQUE)
    push = Vector(THRUST * entry for entry in (-sympy.sin(ATTITUDE[1]), sympy.cos(ATTITUDE[1]) * sympy.sin(ATTITUDE[2]),
                                               sympy.cos(ATTITUDE[1]) * sympy.cos(ATTITUDE[2])))  # fmt: skip
    growth = along(energy(body(), state, STANDARD), flow_of(*zip(state, rate, strict=True)))
    checks.append(same("energy grows by the power of thrust and torque", growth, push @ state.velocity + TORQUE @ RATES))
    return Checks(checks)


@row("3", "rotation subsystem with C", "J eta_dd + C(eta, eta_dot) eta_dot = tau",
     "vehicle.paper:angular_acceleration", EquationVerdict.AS_PRINTED)  # fmt: skip
def equation_3() -> Checks:
    checks = []
    for kinematics in Kinematics:
        product = coriolis(ATTITUDE, RATES, INERTIA, kinematics) @ RATES
        torque = coriolis_torque(ATTITUDE, RATES, INERTIA, kinematics)
        checks += [same(f"C @ eta_dot = C eta_dot, {kinematics} T_eta", product, torque),
                   solves_lagrange(kinematics, array(product))]  # fmt: skip
    return Checks(checks)


@row("4", "effective inertia", "J = T_eta^T Sigma T_eta", "vehicle.paper:effective_inertia", EquationVerdict.AS_PRINTED,
     "with T_eta as in its own row")  # fmt: skip
def equation_4() -> Checks:
    t = rate_map(zyx())
    checks = [
        same("J is the second slope of the kinetic energy", inertia_matrix(), lagrange().mass),
        same("J = T^T Sigma T, T from R^T R_dot", inertia_matrix(), t.T * sympy.diag(*INERTIA) * t),
    ]
    for kinematics in Kinematics:
        slopes = [inertia_matrix(kinematics).diff(angle) for angle in ATTITUDE]
        shipped = effective_inertia_partials(ATTITUDE, INERTIA, kinematics)
        checks.append(same(f"dJ/deta, {kinematics} T_eta", shipped, slopes))
    return Checks(checks)


@row("T_eta", "body rates from Euler rates", "rows (-s_th, 0, 1), (c_th s_psi, c_psi, 0), (c_th c_psi, -s_psi, 0)",
     "vehicle.paper:euler_rate_matrix", EquationVerdict.CORRECTED, "either rows 2 and 3 need roll in place of yaw, or the "
     "columns mean (phi, theta, psi) and the rows z, y, x: then it is -T_eta of the thrust's own order; as printed, for (psi, "
     "theta, phi), Lagrange and Newton-Euler disagree unless the inertias are equal")  # fmt: skip
def t_eta() -> Checks:
    t = rate_map(zyx())
    printed = t.subs(ATTITUDE[2], ATTITUDE[0])
    turning = [array(angular_acceleration(body(), ATTITUDE, RATES, TORQUE, k)) for k in (STANDARD, PRINTED)]
    ours, theirs = ([number_at(part, UNEQUAL, torque=(0, 0, 0)) for part in whole] for whole in turning)
    equal = dict(zip(INERTIA, [INERTIA[0]] * 3, strict=True))
    of_thrust = euler_rate_matrix(ATTITUDE, Kinematics.RIGID)
    checks = [
        same("it is -T_eta of the thrust's own order, columns (phi, theta, psi), rows z, y, x",
             euler_rate_matrix(ATTITUDE, PRINTED), [[-of_thrust[2 - i, 2 - j] for j in range(3)] for i in range(3)]),
        same("omega = T_eta eta_dot, R^T R_dot = [omega]x", euler_rate_matrix(ATTITUDE, STANDARD), t),
        same("the printed form is kept beside it", euler_rate_matrix(ATTITUDE, PRINTED), printed),
        unlike("printed T_eta is that of the rotation", printed, t),
        *(same(f"dT_eta/deta, {k}", euler_rate_partials(ATTITUDE, k),
               [array(euler_rate_matrix(ATTITUDE, k)).diff(angle) for angle in ATTITUDE]) for k in Kinematics),
        unlike("Newton-Euler with the printed T_eta", newton_euler(PRINTED), euler_torque()),
        same("equal inertias hide it in J", inertia_matrix(PRINTED).xreplace(equal), inertia_matrix(STANDARD).xreplace(equal)),
    ]  # fmt: skip
    return Checks(checks, f"at eta = {PLACE['attitude']}, eta_dot = {PLACE['rates']}, Sigma = diag{UNEQUAL}, no torque: "
                            f"eta_dd = {listed(theirs)} with the printed T_eta, {listed(ours)} by Newton-Euler "
                            "[rad/s^2]")  # fmt: skip


def newton_euler(kinematics: Kinematics) -> Expression:
    """Generalised torque that the shipped equations of motion require."""
    return inertia_matrix(kinematics) * array(ACCELERATIONS) + array(coriolis_torque(ATTITUDE, RATES, INERTIA, kinematics))


def number_at(expression: Expression, inertia: tuple[float, ...], torque: tuple[float, ...] = ()) -> float:
    """The value at the attitude and rates of the counterexamples."""
    point = sample_point(inertia=inertia, **PLACE)
    return number(expression, point | dict(zip(TORQUE, map(sympy.Integer, torque), strict=False)))


@row("6", "the matrix C", "C = J_dot - 1/2 d/deta(eta_dot^T J) = 2 T^T Sigma T_dot - ...; J_dot - 2C skew",
     "vehicle.paper:coriolis", EquationVerdict.CORRECTED,
     "J_dot - 2C is not skew for this C, but is for Christoffel's; J_dot = T_dot^T Sigma T + T^T Sigma T_dot")  # fmt: skip
def equation_6() -> Checks:
    checks, found = [], {}
    probe = sympy.Matrix([1, 2, -1])
    for kinematics in Kinematics:
        j, rates = inertia_matrix(kinematics), array(RATES)
        christoffel = array(coriolis(ATTITUDE, RATES, INERTIA, kinematics))
        gap = j_dot(kinematics) - 2 * christoffel
        slopes = sympy.Matrix([(rates.T * j.diff(angle)) for angle in ATTITUDE])
        printed = j_dot(kinematics) - slopes / 2
        odd = j_dot(kinematics) - 2 * printed
        found[kinematics] = (probe.T * odd * probe)[0]
        t = array(euler_rate_matrix(ATTITUDE, kinematics))
        t_dot, sigma = along_rates(t), sympy.diag(*INERTIA)
        checks += [
            same(f"J_dot - 2C + its transpose = 0 for the shipped C, {kinematics} T_eta", gap + gap.T, sympy.zeros(3)),
            unlike(f"J_dot - 2C + its transpose = 0 for the printed C, {kinematics} T_eta", odd + odd.T, sympy.zeros(3)),
            same(f"both give the same C eta_dot, {kinematics} T_eta", printed * rates, christoffel * rates),
            same(f"J_dot = T_dot^T Sigma T + T^T Sigma T_dot, {kinematics}", j_dot(kinematics),
                 t_dot.T * sigma * t + t.T * sigma * t_dot),
            unlike(f"J_dot = 2 T^T Sigma T_dot, {kinematics}", j_dot(kinematics), 2 * t.T * sigma * t_dot),
        ]  # fmt: skip
    numbers = [number_at(found[k], inertia) for k, inertia in ((STANDARD, EQUAL), (PRINTED, UNEQUAL), (STANDARD, UNEQUAL))]
    checks += [near("r^T (J_dot - 2C) r, 5 I", numbers[0], 2.763), near("printed T_eta", numbers[1], -6.362),
               near("standard T_eta", numbers[2], 8.199)]  # fmt: skip
    t = array(euler_rate_matrix(ATTITUDE, STANDARD))
    slip = (j_dot() - 2 * t.T * sympy.diag(*INERTIA) * along_rates(t))[0, 1]
    return Checks(checks, f"at eta = {PLACE['attitude']}, eta_dot = {PLACE['rates']}, r = (1, 2, -1): r^T (J_dot - 2C) r = "
                            f"{short(numbers[0])} for Sigma = 5 I, {short(numbers[1])} / {short(numbers[2])} for "
                            f"diag{UNEQUAL} "
                            "with printed / standard T_eta, 0 for Christoffel; J_dot - 2 T^T Sigma T_dot has "
                            f"{short(number_at(slip, UNEQUAL))} at (1, 2) for diag{UNEQUAL}")  # fmt: skip


@row("8", "rotation subsystem, summary", "J eta_dd = -C(eta, eta_dot) eta_dot + tau",
     "vehicle.paper:angular_acceleration", EquationVerdict.AS_PRINTED)  # fmt: skip
def equation_8() -> Checks:
    return Checks([
        same("J eta_dd + C eta_dot is the torque by Newton-Euler, unequal inertias", newton_euler(STANDARD), euler_torque()),
        solves_lagrange(STANDARD, lagrange().bias),
    ])  # fmt: skip


@row("10", "rotation subsystem with disturbance", "J eta_dd = tau - C(eta, eta_dot) eta_dot + A_eta",
     "vehicle.paper:derivative", EquationVerdict.AS_PRINTED)  # fmt: skip
def equation_10() -> Checks:
    state = State(symbols("xi"), symbols("xi_dot"), ATTITUDE, RATES)
    moment = symbols("A_eta")
    still = Disturbance(0.0, symbols("A_xyz"), moment)
    rate = derivative(body(), still, STANDARD, state, THRUST, TORQUE)
    return Checks([
        same("J eta_dd of the plant", inertia_matrix() * array(rate.rates), array(TORQUE) - lagrange().bias + array(moment)),
        same("attitude moves by its rates", rate.attitude, RATES),
    ])  # fmt: skip


@row("66", "effective inertia written out", "rows (Sx s_th^2 + Sy c_th^2 s_psi^2 + Sz c_th^2 c_psi^2, "
     "(Sy-Sz) c_th s_psi c_psi, -Sx s_th), ((Sy-Sz) c_th c_psi s_psi, Sy c_psi^2 + Sz s_psi^2, 0), (-Sx s_th, 0, Sx)",
     "vehicle.paper:effective_inertia", EquationVerdict.CORRECTED,
     "roll for yaw as in T_eta; otherwise as printed")  # fmt: skip
def equation_66() -> Checks:
    s, c = sympy.sin(ATTITUDE[1]), sympy.cos(ATTITUDE[1])
    x, y, z = INERTIA

    def form(angle: Expression) -> Expression:
        sa, ca = sympy.sin(angle), sympy.cos(angle)
        cross = (y - z) * c * sa * ca
        return sympy.Matrix([[x * s**2 + y * c**2 * sa**2 + z * c**2 * ca**2, cross, -x * s],
                             [cross, y * ca**2 + z * sa**2, 0], [-x * s, 0, x]])  # fmt: skip

    rates = array(RATES)
    true, printed = lagrange().kinetic, (rates.T * form(ATTITUDE[0]) * rates)[0] / 2
    point = sample_point(inertia=UNEQUAL, **PLACE)
    by_print, by_body = (float(value) for value in values([printed, true], point))
    return Checks([
        same("J of the shipped standard T_eta is Eq. 66 with roll", inertia_matrix(), form(ATTITUDE[2])),
        same("J of the printed T_eta is Eq. 66", inertia_matrix(PRINTED), form(ATTITUDE[0])),
        same("1/2 eta_dot^T J eta_dot is the kinetic energy", (rates.T * inertia_matrix() * rates)[0] / 2, true),
        unlike("with the printed J it is", printed, true),
    ], f"rotational energy at eta = {PLACE['attitude']}, eta_dot = {PLACE['rates']}, Sigma = diag{UNEQUAL}: "
       f"{short(by_print)} J by Eq. 66, {short(by_body)} J for the body")  # fmt: skip
