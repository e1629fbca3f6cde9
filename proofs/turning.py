"""How fast the inversion's angles turn while the force changes (T15), and the coupling columns while the tilt does (B_rate).

Emitted from `control.vectoring` and `control.completed_backstepping`.
"""

from proofs.statement import Stated, vector_of
from proofs.terms import coq, term, variable
from quadstep.control.completed_backstepping import coupling_columns
from quadstep.control.vectoring import invert_force
from quadstep.numbers import Vector
from quadstep.proofs.theory.region import BENDING

SERIES = 1e-4
"""Of `sinc`: below, it is a series."""


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


class AlongTilt(Stated):
    """Of every tilt (a1, a2) and wanted one (w1, w2) that change with time: B^T r, r constant, has a rate, and it is bounded.

    At every instant but those at which half an angle of e2 is exactly where the code's ratio of sines changes to its series.
    """

    @property
    def prop(self) -> str:
        """The proposition in Coq."""
        tilt, wanted = (Vector(variable(f"({name}{i} x)") for i in (1, 2)) for name in "aw")
        columns = [coq(term(column @ vector_of("r"))) for column in coupling_columns(tilt, wanted)]
        rates = " ->\n  ".join(f"derivable_pt_lim {name}{i} t {rate}{i}" for name, rate in ("ag", "wh") for i in (1, 2))
        apart = " ->\n  ".join(f"Rabs (1 / 2 * (w{i} t - a{i} t)) <> {coq(term(SERIES))}" for i in (1, 2))
        turned = " /\\\n  ".join(f"derivable_pt_lim (fun x : R => {entry}) t d{i + 1}" for i, entry in enumerate(columns))
        speeds = "(sqrt (h1 * h1 + h2 * h2) + sqrt (g1 * g1 + g2 * g2))"
        bound = f"{BENDING.numerator} / {BENDING.denominator} * {speeds} * sqrt (r1 * r1 + r2 * r2 + r3 * r3)"
        return (
            f"forall (a1 a2 w1 w2 : R -> R) (t g1 g2 h1 h2 r1 r2 r3 : R),\n  {rates} ->\n  {apart} ->\n"
            f"  exists d1 d2 : R,\n  {turned} /\\\n  sqrt (d1 * d1 + d2 * d2) <= {bound}"
        )


def statements() -> list[Stated]:
    """Of the inversion's angles, and of the columns."""
    return [
        AlongForce("T15", "|d/dt (theta_d, phi_d)|^2 (f_y^2 + f_z^2) <= |F_dot|^2 along every force with f_z > 0"),
        AlongTilt("B_rate", f"|B_dot^T r| <= {float(BENDING)} (|eta_f_dot| + |eta_dot|) |r| along every tilt and wanted tilt"),
    ]
