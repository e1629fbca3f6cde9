"""The reference trajectory: Eqs 68-75, and proof that its jerk is the least."""

from typing import NamedTuple

import sympy

from quadstep.interfaces.plant import Reference
from quadstep.numbers import Vector, vector
from quadstep.proofs.verify.equation_row import (
    Check,
    Checks,
    EquationVerdict,
    Expression,
    array,
    branch,
    exact,
    holds,
    row,
    same,
    short,
    symbol,
    symbols,
)
from quadstep.world.paths import MinimumJerk, MinimumJerkParameters, blend

PATH, BLEND = "world.paths:MinimumJerk.reference", "world.paths:blend"
T, DURATION = symbol("t"), symbol("t_f")
START, END = symbols("start"), symbols("end")
YAW_START, YAW_END = symbol("psi_0", positive=False), symbol("psi_f", positive=False)
PARAMETERS = MinimumJerkParameters(START, END, YAW_START, YAW_END, DURATION)
UNDER_WAY = {T: 3, DURATION: 7}
SYSTEM = sympy.Matrix([[1, DURATION, DURATION**2], [3, 4 * DURATION, 5 * DURATION**2], [6, 12 * DURATION, 20 * DURATION**2]])


def on_the_way() -> Reference:
    """The shipped path between its ends, in symbols."""
    reference = MinimumJerk().reference(T, PARAMETERS)
    position, velocity, acceleration = (Vector(cut(e) for e in part) for part in reference[:3])
    return Reference(position, velocity, acceleration, cut(reference.yaw), cut(reference.yaw_rate))


def cut(expression: Expression) -> Expression:
    """The piece between 0 and t_f, as a polynomial in t."""
    return sympy.expand(exact(branch(expression, UNDER_WAY)))


class Coefficients(NamedTuple):
    """a_0 to a_5 of one axis of the shipped path."""

    a: tuple[Expression, ...]

    def at(self, order: int) -> Expression:
        """The derivative of this order of the quintic."""
        return sympy.diff(sum((a * T**power for power, a in enumerate(self.a)), sympy.S.Zero), T, order)


def coefficients(axis: int = 0) -> Coefficients:
    """The coefficients read off the shipped path."""
    position: Expression = on_the_way().position[axis]
    return Coefficients(tuple(position.coeff(T, power) for power in range(6)))


def quintic(axis: int, name: str) -> list[Check]:
    """Checks: the shipped path of an axis is x_d0 + a3 t^3 + a4 t^4 + a5 t^5 with the solution of Eq. 71."""
    d = (END[axis] - START[axis]) / DURATION**3
    a3, a4, a5 = SYSTEM.inv() * sympy.Matrix([d, 0, 0])
    form = START[axis] + a3 * T**3 + a4 * T**4 + a5 * T**5
    held = array(MinimumJerk().reference(2 * DURATION, PARAMETERS).position)[axis]
    return [
        same(f"{name}_d on the way", on_the_way().position[axis], form),
        same(f"{name}_d at t_f", form.subs(T, DURATION), END[axis]),
        same(f"{name}_d after t_f", branch(held, UNDER_WAY), END[axis]),
    ]


@row("68", "velocity of the path", "x_d_dot = a_1 + 2 a_2 t + 3 a_3 t^2 + 4 a_4 t^3 + 5 a_5 t^4", BLEND,
     EquationVerdict.AS_PRINTED, "Section 6 cites it once for the disturbance of Eq. 67")  # fmt: skip
def equation_68() -> Checks:
    a = coefficients().a
    printed = a[1] + 2 * a[2] * T + 3 * a[3] * T**2 + 4 * a[4] * T**3 + 5 * a[5] * T**4
    flown = on_the_way()
    return Checks([
        same("x_d_dot of the path", flown.velocity[0], printed),
        same("velocity is the rate of the position", [sympy.diff(p, T) for p in flown.position], flown.velocity),
        same("yaw blends as x does", (flown.yaw - YAW_START) * (END[0] - START[0]),
             (flown.position[0] - START[0]) * (YAW_END - YAW_START)),
        same("yaw rate is the rate of yaw", sympy.diff(flown.yaw, T), flown.yaw_rate),
    ])  # fmt: skip


@row("69", "acceleration of the path", "x_d_dd = 2 a_2 + 6 a_3 t + 12 a_4 t^2 + 20 a_5 t^3", BLEND,
     EquationVerdict.AS_PRINTED)  # fmt: skip
def equation_69() -> Checks:
    a = coefficients().a
    flown = on_the_way()
    return Checks([
        same("x_d_dd of the path", flown.acceleration[0], 2 * a[2] + 6 * a[3] * T + 12 * a[4] * T**2 + 20 * a[5] * T**3),
        same("acceleration is the rate of the velocity", [sympy.diff(v, T) for v in flown.velocity], flown.acceleration),
    ])  # fmt: skip


@row("70", "end conditions", "(d_x, 0, 0) = [1, t_f, t_f^2; 3, 4 t_f, 5 t_f^2; 6, 12 t_f, 20 t_f^2] (a_3, a_4, a_5), "
     "d_x = (x_df - x_d0) / t_f^3", BLEND, EquationVerdict.AS_PRINTED)  # fmt: skip
def equation_70() -> Checks:
    c = coefficients()
    d = (END[0] - START[0]) / DURATION**3
    a = symbols("a", 6)
    free = Coefficients((START[0], sympy.S.Zero, sympy.S.Zero, *a.entries[3:]))
    ends = [(free.at(order).subs(T, DURATION) - wanted) / DURATION ** (3 - order)
            for order, wanted in enumerate((END[0], 0, 0))]  # fmt: skip
    return Checks([
        same("the system is that of rest at x_df", ends, SYSTEM * sympy.Matrix(a.entries[3:]) - sympy.Matrix([d, 0, 0])),
        same("the path's coefficients solve it", SYSTEM * sympy.Matrix(c.a[3:]), [d, 0, 0]),
        same("a_0, a_1, a_2 of rest at x_d0", c.a[:3], [START[0], 0, 0]),
    ])  # fmt: skip


@row("71", "coefficients", "(a_3, a_4, a_5) = inverse of that matrix times (d_x, 0, 0)", BLEND, EquationVerdict.AS_PRINTED)
def equation_71() -> Checks:
    d = (END[0] - START[0]) / DURATION**3
    solved = SYSTEM.inv() * sympy.Matrix([d, 0, 0])
    return Checks([
        same("the path's coefficients", coefficients().a[3:], solved),
        same("they are (10 d, -15 d / t_f, 6 d / t_f^2)", solved, [10 * d, -15 * d / DURATION, 6 * d / DURATION**2]),
    ])  # fmt: skip


def axis_row(number: str, axis: int, name: str) -> None:
    """The row of Eq. 72, 73 or 74."""
    row(number, f"path along {name}", f"{name}_d = {name}_d0 + a_3 t^3 + a_4 t^4 + a_5 t^5", PATH, EquationVerdict.AS_PRINTED)(
        lambda: Checks(quintic(axis, name))
    )


axis_row("72", 0, "x")
axis_row("73", 1, "y")
axis_row("74", 2, "z")


@row("75", "example", "x_d = 0.1 t^3 - 0.015 t^4 + 0.0006 t^5 for t_f = 10, x_df = 10, d_x = 0.01", PATH,
     EquationVerdict.AS_PRINTED, "Section 6 announces two cases before it, and three follow")  # fmt: skip
def equation_75() -> Checks:
    example = MinimumJerkParameters(vector(0.0, 0.0, 0.0), vector(10.0, 20.0, 40.0), 0.0, 0.0, 10.0)
    gap = 0.0
    for t in (0.0, 1.0, 2.5, 5.0, 7.5, 9.0, 10.0):
        printed = 0.1 * t**3 - 0.015 * t**4 + 0.0006 * t**5
        flown = MinimumJerk().reference(t, example).position
        gap = max(gap, *(abs(x - factor * printed) for x, factor in zip(flown, (1, 2, 4), strict=True)))
    way: Expression = on_the_way().position[0]
    symbolic = way.xreplace({START[0]: sympy.S.Zero, END[0]: sympy.S(10)}).subs(DURATION, 10)
    by_hand = T**3 / 10 - T**4 * 15 / 1000 + T**5 * 6 / 10000
    return Checks([same("x_d on the way", symbolic, by_hand),
                     holds("x_d, and twice and four times it for 20 and 40 m", gap < 1e-13, f"off by {gap:.0e} "
                         "m", "equal")])  # fmt: skip


@row("least jerk", "Section 6: 'the jerk is minimized over the time horizon'",
     "minimise the integral of x_d_ddd^2 with rest at both ends", BLEND, EquationVerdict.PROOF_STEP,
     "against every polynomial with the same ends up to degree 9, and by Euler-Lagrange")  # fmt: skip
def least_jerk() -> Checks:
    share = cut(blend(T, DURATION)[0])
    free = symbols("q", 4)
    other = T**3 * (DURATION - T) ** 3 * sum((q * T**power for power, q in enumerate(free)), sympy.S.Zero)
    jerk, change = sympy.diff(share, T, 3), sympy.diff(other, T, 3)
    cross = sympy.integrate(sympy.expand(jerk * change), (T, 0, DURATION))
    extra = sympy.integrate(sympy.expand(change**2), (T, 0, DURATION)).subs(DURATION, 1)
    curvature = sympy.hessian(extra, list(free))
    cost = sympy.integrate(sympy.expand(jerk**2), (T, 0, DURATION))
    ends = [sympy.diff(other, T, order).subs(T, at) for order in range(3) for at in (0, DURATION)]
    return Checks([
        same("the variation keeps position, velocity and acceleration at both ends", ends, [0] * 6),
        same("first variation of the integral", cross, 0),
        holds("second variation is positive", curvature.is_positive_definite, f"determinant "
            f"{short(curvature.det())}", "above 0"),
        same("sixth derivative (Euler-Lagrange)", sympy.diff(share, T, 6), 0),
        same("the least: integral jerk^2 = 720 / t_f^5 per metre squared", cost, 720 / DURATION**5),
    ])  # fmt: skip
