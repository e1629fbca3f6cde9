"""Translation of the body: Eqs 1, 7, 9 and 67, and the direction of the thrust."""

import sympy

from quadstep.interfaces.model import Kinematics
from quadstep.numbers import Vector
from quadstep.proofs.verify.algebra import Expression, array, listed, near, same, short, symbol, symbols, unlike, values
from quadstep.proofs.verify.plant import GRAVITY, MASS, PLACE, THRUST, TORQUE, UNEQUAL, body
from quadstep.proofs.verify.rigid_body import ATTITUDE, INERTIA, RATES, known, rate_map, yaw_innermost, zyx
from quadstep.proofs.verify.rows import EquationRow, EquationVerdict, Evidence, row
from quadstep.vehicle.paper import Disturbance, State, acceleration, derivative, disturb, effective_inertia, thrust_direction
from quadstep.world.guidance.minimum_jerk import blend

ROWS: list[EquationRow] = []
STATE = State(symbols("xi"), symbols("xi_dot"), ATTITUDE, RATES)
NOTHING = Vector((0.0, 0.0, 0.0))
WEIGHT = sympy.Matrix([0, 0, MASS * GRAVITY])


def printed_direction(attitude: Vector = ATTITUDE) -> Expression:
    """(-sin theta, cos theta sin phi, cos theta cos phi), as Eq. 7 prints it."""
    _, theta, phi = attitude
    s, c = sympy.sin, sympy.cos
    return sympy.Matrix([-s(theta), c(theta) * s(phi), c(theta) * c(phi)])


@row(
    ROWS,
    "1",
    "position subsystem",
    "m xi_dd + (0, 0, m g) = F_d",
    "vehicle.paper:acceleration",
    EquationVerdict.AS_PRINTED,
)
def equation_1() -> Evidence:
    shipped = array(acceleration(body(), ATTITUDE, THRUST, NOTHING))
    return Evidence([same("m xi_dd + (0, 0, m g) of the plant", MASS * shipped + WEIGHT, THRUST * printed_direction())])


@row(ROWS, "7", "position subsystem, summary", "m xi_dd = u (-s_th, c_th s_ph, c_th c_ph) + (0, 0, -m g)",
     "vehicle.paper:thrust_direction", EquationVerdict.AS_PRINTED, "see thrust direction")  # fmt: skip
def equation_7() -> Evidence:
    shipped = array(acceleration(body(), ATTITUDE, THRUST, NOTHING))
    return Evidence([
        same("direction of the thrust", thrust_direction(ATTITUDE), printed_direction()),
        same("m xi_dd of the plant", MASS * shipped, THRUST * printed_direction() - WEIGHT),
    ])  # fmt: skip


@row(ROWS, "thrust direction", "direction of the thrust and order of the angles", "(-s_th, c_th s_ph, c_th c_ph)",
     "vehicle.paper:thrust_direction", EquationVerdict.AS_PRINTED,
     "kept, but it is R e3 for R = Rx(-phi) Ry(-theta) Rz(-psi), not for T_eta's Rz Ry Rx: one rigid body only while "
     "the inertias are equal")  # fmt: skip
def direction() -> Evidence:
    shipped, up = array(thrust_direction(ATTITUDE)), sympy.Matrix([0, 0, 1])
    t = rate_map(yaw_innermost())
    psi, theta, _ = ATTITUDE
    s, c = sympy.sin, sympy.cos
    named = sympy.Matrix([[0, s(psi), -c(psi) * c(theta)], [0, -c(psi), -s(psi) * c(theta)], [-1, 0, s(theta)]])
    own = t.T * sympy.diag(*INERTIA) * t
    flown = array(effective_inertia(ATTITUDE, INERTIA, Kinematics.STANDARD))
    equal = dict(zip(INERTIA, [INERTIA[0]] * 3, strict=True))
    point = known(inertia=UNEQUAL, **PLACE)
    ours, other, j_flown, j_own = (
        [float(value) for value in values(list(things), point)]
        for things in (shipped, zyx() * up, flown[0, :2], own[0, :2])
    )  # fmt: skip
    return Evidence([
        same("R e3, yaw innermost", shipped, yaw_innermost() * up),
        unlike("R e3 for R = Rz Ry Rx", shipped, zyx() * up),
        same("body rates of that order, T_Q", t, named),
        same("equal inertias: T_Q^T Sigma T_Q is the J that flies", flown.xreplace(equal), own.xreplace(equal)),
        unlike("unequal inertias: T_Q^T Sigma T_Q is the J that flies", flown, own),
    ], f"at eta = {PLACE['attitude']}: {listed(ours)} printed, {listed(other)} for Rz Ry Rx; for Sigma = diag{UNEQUAL} "
       f"(J11, J12) = {listed(j_flown)} flown, {listed(j_own)} in the thrust's own order")  # fmt: skip


@row(ROWS, "9", "position subsystem with disturbance", "m x_dd = -u s_th + A_x; m y_dd = u c_th s_ph + A_y; "
     "m z_dd = u c_th c_ph - m g + A_z", "vehicle.paper:derivative", EquationVerdict.AS_PRINTED)  # fmt: skip
def equation_9() -> Evidence:
    force = symbols("A_xyz")
    rate = derivative(body(), Disturbance(0.0, force, NOTHING), Kinematics.STANDARD, STATE, THRUST, TORQUE)
    return Evidence([
        same("m xi_dd of the plant", MASS * array(rate.velocity), THRUST * printed_direction() - WEIGHT + array(force)),
        same("position moves by its velocity", rate.position, STATE.velocity),
    ])  # fmt: skip


@row(ROWS, "67", "disturbance of the simulation", "A_xyz = A_eta = 3x2 array (x_dot phi_dot; y_dot theta_dot; z_dot psi_dot)",
     "vehicle.paper:disturb", EquationVerdict.CORRECTED,
     "a 3x2 array is not a force; the product of each row is meant, since sums contradict tau_psi = 0 in Case 1")  # fmt: skip
def equation_67() -> Evidence:
    scale, force, moment = symbol("scale"), symbols("F"), symbols("M")
    a_xyz, a_eta = disturb(Disturbance(scale, force, moment), STATE)
    pairs = list(zip(STATE.velocity, reversed(RATES.entries), strict=True))
    products = scale * sympy.Matrix([v * w for v, w in pairs])
    sums = scale * sympy.Matrix([v + w for v, w in pairs])
    _, rate, _ = blend(20.0, 40.0)
    speed = 20.0 * rate
    only_x = dict.fromkeys((*STATE.velocity, *RATES), 0) | {STATE.velocity[0]: speed, scale: 1}
    by_product, by_sum = (float(thing[0].subs(only_x)) for thing in (products, sums))
    return Evidence([
        same("A_xyz", a_xyz, products + array(force)),
        same("A_eta", a_eta, products + array(moment)),
        unlike("sums give A_xyz", a_xyz, sums + array(force)),
        near("A_psi of the products at Case 1's top speed, level", by_product, 0.0),
        near("A_psi of the sums there", by_sum, 0.9375),
    ], f"Case 1 at its top speed, {short(speed)} m/s along x, level: the sums push psi with {short(by_sum)} N m, which "
       "tau_psi has to balance; the products push with 0")  # fmt: skip
