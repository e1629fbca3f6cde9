"""Textbook mechanics to compare the plant with: rotation matrices, body rates, Lagrange's and Euler's equations.

Nothing here comes from the laws; it starts from rotation matrices.
"""

from functools import cache
from typing import NamedTuple

import sympy

from quadstep.proofs.verify.equation_row import Expression, array, reduced, symbols

ATTITUDE, RATES, ACCELERATIONS = symbols("eta"), symbols("eta_dot"), symbols("eta_dd")
INERTIA = symbols("Sigma", positive=True)
PSI, THETA, PHI = ATTITUDE


def about(axis: int, angle: Expression) -> Expression:
    """Right-handed rotation matrix about x (0), y (1) or z (2)."""
    c, s = sympy.cos(angle), sympy.sin(angle)
    rows = {
        0: [[1, 0, 0], [0, c, -s], [0, s, c]],
        1: [[c, 0, s], [0, 1, 0], [-s, 0, c]],
        2: [[c, -s, 0], [s, c, 0], [0, 0, 1]],
    }
    return sympy.Matrix(rows[axis])


def zyx() -> Expression:
    """Body to inertial frame by yaw, then pitch, then roll: the order that T_eta belongs to."""
    return about(2, PSI) * about(1, THETA) * about(0, PHI)


def yaw_innermost() -> Expression:
    """Body to inertial frame in the order that the paper's thrust direction (Eq. 7) belongs to."""
    return about(0, -PHI) * about(1, -THETA) * about(2, -PSI)


def body_rates(rotation: Expression) -> Expression:
    """Omega with R^T R_dot = [omega]x, linear in the Euler rates."""
    turning = sum((sympy.diff(rotation, angle) * rate for angle, rate in zip(ATTITUDE, RATES, strict=True)), sympy.zeros(3))
    spin = rotation.T * turning
    return sympy.Matrix([reduced(spin[2, 1]), reduced(spin[0, 2]), reduced(spin[1, 0])])


def rate_map(rotation: Expression) -> Expression:
    """The matrix T with omega = T eta_dot."""
    return body_rates(rotation).jacobian(list(RATES))


class LagrangeEquations(NamedTuple):
    """Lagrange's equations of the rotating body: mass @ eta_dd + bias = generalised torque."""

    kinetic: Expression
    mass: Expression
    bias: Expression


@cache
def lagrange() -> LagrangeEquations:
    """Derived from the kinetic energy 1/2 omega^T Sigma omega, omega from R = Rz(psi) Ry(theta) Rx(phi)."""
    omega, rates, angles = body_rates(zyx()), list(RATES), list(ATTITUDE)
    kinetic = sum((i * w**2 for i, w in zip(INERTIA, omega, strict=True)), sympy.S.Zero) / 2
    momentum = sympy.Matrix([sympy.diff(kinetic, rate) for rate in rates])
    slope = sympy.Matrix([sympy.diff(kinetic, angle) for angle in angles])
    bias = momentum.jacobian(angles) * array(RATES) - slope
    return LagrangeEquations(kinetic, momentum.jacobian(rates), bias)


@cache
def euler_torque() -> Expression:
    """Generalised torque by Newton and Euler: T^T (Sigma omega_dot + omega x Sigma omega), from virtual work."""
    omega, rates, angles = body_rates(zyx()), list(RATES), list(ATTITUDE)
    sigma = sympy.diag(*INERTIA)
    t = omega.jacobian(rates)
    omega_dot = t * array(ACCELERATIONS) + omega.jacobian(angles) * array(RATES)
    return t.T * (sigma * omega_dot + omega.cross(sigma * omega))


def sample_point(**vectors: tuple[float, ...]) -> dict[Expression, Expression]:
    """A point for the symbols of this file: attitude, rates, inertia."""
    names = {"attitude": ATTITUDE, "rates": RATES, "inertia": INERTIA}
    return {
        name: sympy.Rational(str(value))
        for key, numbers in vectors.items()
        for name, value in zip(names[key], numbers, strict=True)
    }
