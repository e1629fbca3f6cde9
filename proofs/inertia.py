"""The inertia J, its derivatives and Coriolis matrix: statements emitted from `vehicle.lagrange`."""

from proofs.statement import Statement, above, at_most, differs, equal, matrix_of, state, vector_of
from proofs.terms import variable
from quadstep.interfaces.plant import Kinematics
from quadstep.numbers import Matrix, Vector, sin, solve_symmetric, total
from quadstep.vehicle.paper import coriolis, coriolis_torque, effective_inertia, effective_inertia_partials

ATTITUDE = Vector((variable("psi"), variable("theta"), variable("phi")))
RATES, R, Y = vector_of("w"), vector_of("r"), vector_of("y")
SIGMA = vector_of("s")
STANDARD = Kinematics.STANDARD


def statements() -> list[Statement]:
    """T4, T5, T6 and what they rest on."""
    j = effective_inertia(ATTITUDE, SIGMA, STANDARD)
    partials = effective_inertia_partials(ATTITUDE, SIGMA, STANDARD)
    j_dot = total(rate * partial for rate, partial in zip(RATES, partials, strict=True))
    c = coriolis(ATTITUDE, RATES, SIGMA, STANDARD)
    sine = sin(ATTITUDE[1])
    most, least, slope, k2 = (variable(name) for name in ("most", "least", "slope", "k4"))
    positive = [above(s, 0.0) for s in SIGMA]
    below = [at_most(s, most) for s in SIGMA]
    slopes, gains = vector_of("l"), vector_of("k")
    m, b = matrix_of("m"), vector_of("b")
    m = Matrix([m.rows[0], Vector((m[0, 1], *m.rows[1].entries[1:])), Vector((m[0, 2], m[1, 2], m[2, 2]))])
    determinant = (
        m[0, 0] * (m[1, 1] * m[2, 2] - m[1, 2] * m[1, 2])
        - m[0, 1] * (m[0, 1] * m[2, 2] - m[1, 2] * m[0, 2])
        + m[0, 2] * (m[0, 1] * m[1, 2] - m[1, 1] * m[0, 2])
    )
    s = variable("s")
    equal_c = coriolis(ATTITUDE, RATES, Vector((s, s, s)), STANDARD)
    return [
        state("J_symmetric", "J is symmetric", equal(j, j.T)),
        state("T4", "r^T J r <= max(Sigma) (1 + |sin theta|) |r|^2",
              at_most(R @ (j @ R), most * (1.0 + abs(sine)) * (R @ R)), [*positive, *below]),
        state("T4_least", "r^T J r >= min(Sigma) (1 - |sin theta|) |r|^2",
              at_most(least * (1.0 - abs(sine)) * (R @ R), R @ (j @ R)),
              [above(least, 0.0), *(at_most(least, entry) for entry in SIGMA)]),
        state("T5", "r^T (K_r2 - J Lambda_2) r >= (min K_r2 - 2 max(Sigma) max(Lambda_2)) |r|^2",
              at_most((k2 - 2.0 * most * slope) * (R @ R), R @ (gains * R) - R @ (j @ (slopes * R))),
              [*positive, *below, *(above(entry, 0.0) for entry in slopes), *(at_most(entry, slope) for entry in slopes),
               *(at_most(k2, entry) for entry in gains)]),
        state("T6", "r^T (J_dot - 2 C) r = 0", equal(R @ (j_dot @ R), 2.0 * (R @ (c @ R)))),
        state("T6_transpose", "J_dot = C + C^T", equal(j_dot, c + c.T)),
        state("C_rates", "C eta_dot is the torque that the plant subtracts",
              equal(c @ RATES, coriolis_torque(ATTITUDE, RATES, SIGMA, STANDARD))),
        state("C_norm", "y^T C r <= Sigma / sqrt 2 |eta_dot| |y| |r|, squared, for equal inertias",
              at_most((Y @ (equal_c @ R)) * (Y @ (equal_c @ R)), 0.5 * (s * s) * (RATES @ RATES) * (R @ R) * (Y @ Y))),
        state("solved", "solve_symmetric solves M x = b",
              equal(m @ solve_symmetric(m, b), b), [differs(determinant, 0.0)]),
        state("J_determinant", "det J = Sigma_x Sigma_y Sigma_z cos^2 theta",
              equal(j[0, 0] * (j[1, 1] * j[2, 2] - j[1, 2] * j[2, 1]) - j[0, 1] * (j[1, 0] * j[2, 2] - j[1, 2] * j[2, 0])
                    + j[0, 2] * (j[1, 0] * j[2, 1] - j[1, 1] * j[2, 0]),
                    SIGMA[0] * SIGMA[1] * SIGMA[2] * (1.0 - sine * sine))),
    ]  # fmt: skip
