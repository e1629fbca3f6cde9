"""How fast the inversion's angles turn while the force changes: T15, emitted from `control.inversion`."""

from proofs.statement import Stated
from quadstep.control.inversion import invert_force
from quadstep.numbers import Vector
from quadstep.numbers.terms import coq, term, variable


class AlongForce(Stated):
    """Of every force (f1, f2, f3) that changes with time, f3 > 0: the inversion's angles have rates, and these are bounded.

    The rates are derivatives as Coq's library has them, of the angles as the code has them.
    """

    @property
    def prop(self) -> str:
        """The proposition in Coq."""
        _, theta_d, phi_d = invert_force(Vector(variable(f"(f{i} x)") for i in (1, 2, 3)))
        rates = " ->\n  ".join(f"derivable_pt_lim f{i} t g{i}" for i in (1, 2, 3))
        angles = " /\\\n  ".join(
            f"derivable_pt_lim (fun x : R => {coq(term(angle))}) t {rate}" for angle, rate in ((theta_d, "th"), (phi_d, "ph"))
        )
        return (
            f"forall (f1 f2 f3 : R -> R) (t g1 g2 g3 : R),\n  (forall x : R, 0 < f3 x) ->\n  {rates} ->\n"
            f"  exists th ph : R,\n  {angles} /\\\n"
            "  (th * th + ph * ph) * (f2 t * f2 t + f3 t * f3 t) <= g1 * g1 + g2 * g2 + g3 * g3"
        )


def statements() -> list[AlongForce]:
    """T15."""
    return [AlongForce("T15", "|d/dt (theta_d, phi_d)|^2 (f_y^2 + f_z^2) <= |F_dot|^2 along every force with f_z > 0")]
