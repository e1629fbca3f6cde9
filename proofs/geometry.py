"""The thrust's direction, the coupling columns B, the inversion: statements emitted from `control` and `vehicle`."""

from proofs.statement import Statement, above, at_most, equal, state, vector_of
from proofs.terms import variable
from quadstep.control.completed_backstepping import coupling_columns, half_sine_ratio
from quadstep.control.vectoring import invert_force, project
from quadstep.numbers import Vector, sin
from quadstep.vehicle.paper import thrust_direction

TILT, WANTED = vector_of("a", 2), vector_of("w", 2)
ERROR = WANTED - TILT


def direction(tilt: Vector) -> Vector:
    """Of the thrust, at any yaw."""
    return thrust_direction(Vector((variable("psi"), *tilt)))


def statements() -> list[Statement]:
    """T1, T2, T3, T8, T17 and what they rest on."""
    b_theta, b_phi = coupling_columns(TILT, WANTED)
    gap = direction(WANTED) - direction(TILT)
    product = b_theta * ERROR[0] + b_phi * ERROR[1]
    x, bound, inside = vector_of("x"), variable("bound"), vector_of("y")
    moved = project(x, bound) - inside
    h = half_sine_ratio(variable("x"))
    apart = [at_most(1e-3, abs(error)) for error in ERROR]
    squares = [b @ b for b in (b_theta, b_phi)]
    near = gap - product
    x_theta, x_phi = vector_of("x", 2)
    turned = b_theta * x_theta + b_phi * x_phi
    coupled = abs(sin(0.5 * (WANTED[0] + TILT[0]))) * abs(sin(0.5 * ERROR[1]))
    force = vector_of("f")
    u_d, theta_d, phi_d = invert_force(force)
    return [
        state("T1", "n(eta_f) - n(eta) = B e2", equal(gap, product), apart),
        state("T1_near", "|n(eta_f) - n(eta) - B e2| <= 1e-17 in each entry, where the ratio is a series",
              at_most(Vector(abs(entry) for entry in near), Vector((1e-17, 1e-17, 1e-17)))),
        state("T2", "|n(eta_f) - n(eta)|^2 <= |e2|^2", at_most(gap @ gap, ERROR @ ERROR)),
        state("T3", "each column of B has length at most 1", at_most(Vector(squares), Vector((1.0, 1.0)))),
        state("T3_ratio", "|sin(x/2) / (x/2)| <= 1 as the code has it", at_most(abs(h), 1.0)),
        state("B_norm", "|B x|^2 <= (1 + |sin th'| |sin(e_phi / 2)|) |x|^2",
              at_most(turned @ turned, (1.0 + coupled) * (x_theta * x_theta + x_phi * x_phi))),
        state("T17", "u_d n(eta_d) = F_d_hat: the inversion of Eqs 40 to 52, for every force",
              equal(u_d * direction(Vector((theta_d, phi_d))), force)),
        state("T8", "projection never increases the distance to what is inside",
              at_most(moved @ moved, (x - inside) @ (x - inside)),
              [above(bound, 0.0), at_most(inside @ inside, bound * bound)]),
    ]  # fmt: skip
