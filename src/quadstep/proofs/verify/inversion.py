"""The thrust and attitude that produce a desired force: Eqs 21 and 40-52."""

import math
from collections.abc import Callable
from typing import NamedTuple

import sympy

from quadstep.control.vectoring import invert_force
from quadstep.numbers import vector
from quadstep.proofs.verify.equation_row import (
    Check,
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
from quadstep.proofs.verify.forces import printed_direction

PLACE = "control.vectoring:invert_force"
FORCE = symbols("f_d")
F_X, F_Y, F_Z = FORCE
FAR_SIDE = (1.0, 2.0, -3.0)


class Solution(NamedTuple):
    """The result of the shipped inversion for a force in symbols, and the a and b that follow from it."""

    u: Expression
    theta: Expression
    phi: Expression

    @property
    def a(self) -> Expression:
        """u_d sin theta_d."""
        return self.u * sympy.sin(self.theta)

    @property
    def b(self) -> Expression:
        """u_d cos theta_d."""
        return self.u * sympy.cos(self.theta)


def solution() -> Solution:
    """The shipped inversion, in symbols."""
    return Solution(*invert_force(FORCE))


A, B = -F_X, sympy.sqrt(F_Y**2 + F_Z**2)  # Eqs 43 and 45


def printed_force(u: Expression, theta: Expression, phi: Expression) -> Expression:
    """The force that a thrust and an attitude produce, as printed."""
    return u * printed_direction(vector(0.0, theta, phi))


def plain(
    name: str, what: str, printed: str, verdict: EquationVerdict,
    sides: Callable[[Solution], tuple[Expression, Expression]], reason: str = "",
) -> None:  # fmt: skip
    """A row whose evidence is that two sides are equal."""

    def gather() -> Checks:
        return Checks([same(printed, *sides(solution()))])

    row(name, what, printed, PLACE, verdict, reason)(gather)


@row("21", "attitude and thrust for a force", "u_d (-s_thd, c_thd s_phd, c_thd c_phd) = F_d_hat", PLACE,
     EquationVerdict.AS_PRINTED)  # fmt: skip
def equation_21() -> Checks:
    found = solution()
    return Checks([same("the force made by the shipped solution", printed_force(found.u, found.theta, found.phi), FORCE)])


@row("40", "Eq. 21 over time", "u_d (-s_thd, c_thd s_phd, c_thd c_phd) = F_d_hat(t)", PLACE, EquationVerdict.AS_PRINTED,
     "solvable for every force: angles that a force leaves undetermined are set to zero")  # fmt: skip
def equation_40() -> Checks:
    checks: list[Check] = []
    along = ((3.0, 0.0, 0.0), (-3.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, -4.0), (0.0, 0.0, 0.0))
    for force in (*along, (0.03, 0.0, 0.04), FAR_SIDE):
        u, theta, phi = invert_force(vector(*force))
        back = printed_force(u, theta, phi)
        gap = max(abs(float(x) - y) for x, y in zip(back, force, strict=True))
        checks.append(holds(f"force {force} N", gap < 1e-14 and (any(force) or theta == phi == 0.0), f"off by {gap:.1g} N"))
    return Checks(checks)


plain(
    "41", "intermediate variables", "a = u_d s_thd, b = u_d c_thd", EquationVerdict.DEFINITION, lambda s: ([s.a, s.b], [A, B])
)
plain("42", "the force in a and b", "(-a, b s_phd, b c_phd) = (f_x, f_y, f_z)", EquationVerdict.AS_PRINTED,
      lambda s: ([-s.a, s.b * sympy.sin(s.phi), s.b * sympy.cos(s.phi)], FORCE))  # fmt: skip
plain("43", "a", "a = -f_x", EquationVerdict.AS_PRINTED, lambda s: (s.a, -F_X))
# Eq. 44
plain("44", "b squared", "b^2 s_phd^2 + b^2 c_phd^2 = f_y^2 + f_z^2", EquationVerdict.AS_PRINTED,
      lambda s: ((s.b * sympy.sin(s.phi)) ** 2 + (s.b * sympy.cos(s.phi)) ** 2, F_Y**2 + F_Z**2))  # fmt: skip
plain("45", "b", "b = sqrt(f_y^2 + f_z^2)", EquationVerdict.AS_PRINTED, lambda s: (s.b, B),
      "the root with cos theta_d >= 0")  # fmt: skip
# Eq. 46
plain("46", "thrust squared in a and b", "(u_d s_thd)^2 + (u_d c_thd)^2 = a^2 + b^2", EquationVerdict.AS_PRINTED,
      lambda s: (s.a**2 + s.b**2, A**2 + B**2), "from Eq. 41, not Eq. 42 as the text says")  # fmt: skip
# Eq. 47
plain("47", "thrust squared", "u_d^2 = a^2 + b^2", EquationVerdict.AS_PRINTED, lambda s: (s.u**2, A**2 + B**2))
plain("48", "thrust", "u_d = sqrt(a^2 + b^2)", EquationVerdict.AS_PRINTED, lambda s: (s.u, sympy.sqrt(A**2 + B**2)))
# Eq. 49
plain("49", "tangent of pitch", "tan theta_d = a / b", EquationVerdict.AS_PRINTED, lambda s: (sympy.tan(s.theta), A / B),
     "for b > 0")  # fmt: skip


@row("50", "pitch", "theta_d = atan(a / b)", PLACE, EquationVerdict.AS_PRINTED,
     "for b > 0; the code has atan2(a, b), the same there and right for a force along x too")  # fmt: skip
def equation_50() -> Checks:
    along_x = invert_force(vector(3.0, 0.0, 0.0))[1]
    return Checks([same("theta_d = atan(a / b)", solution().theta, sympy.atan(A / B)),
                     near("theta_d for a force along +x, b = 0", along_x, -math.pi / 2, 1e-15)])  # fmt: skip


# Eq. 51
plain("51", "tangent of roll", "tan phi_d = f_y / f_z", EquationVerdict.AS_PRINTED, lambda s: (sympy.tan(s.phi), F_Y / F_Z),
     "for f_z != 0")  # fmt: skip


@row("52", "roll", "phi_d = atan(f_y / f_z), 'f_z != 0, i.e. phi and psi are not 90 deg'", PLACE, EquationVerdict.CORRECTED,
     "atan2(f_y, f_z): atan takes the wrong branch for f_z < 0; and it is phi and theta that must not be 90 deg")  # fmt: skip
def equation_52() -> Checks:
    found, upward = solution(), symbols("up", 1, positive=True)[0]
    by_print = sympy.atan(F_Y / F_Z)
    above = {F_Z: upward}
    at = dict(zip(FORCE, map(sympy.Integer, map(int, FAR_SIDE)), strict=True))
    wrong = [number(entry, at) for entry in printed_force(found.u, found.theta, by_print)]
    miss = math.dist(wrong, FAR_SIDE)
    phis = [number(angle, at) for angle in (by_print, found.phi)]
    return Checks([
        same("phi_d = atan2(f_y, f_z)", found.phi, sympy.atan2(F_Y, F_Z)),
        same("phi_d = atan(f_y / f_z) for f_z > 0", found.phi.xreplace(above), by_print.xreplace(above)),
        unlike("the force made with phi_d = atan(f_y / f_z)", printed_force(found.u, found.theta, by_print), FORCE),
        near("error of the printed form", miss, 2 * math.sqrt(13.0)),
        same("with the shipped form", printed_force(found.u, found.theta, found.phi), array(FORCE)),
    ], f"F_d_hat = {FAR_SIDE} N: phi_d = {short(phis[0])} rad makes {listed(wrong)} N, {short(miss)} N off; phi_d = "
       f"{short(phis[1])} rad is right")  # fmt: skip
