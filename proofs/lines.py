"""The lines of Q and d of Theorem B, emitted from `theory.region`: L_dot of the loop's equations keeps to them."""

from collections.abc import Callable
from fractions import Fraction
from operator import mul
from typing import cast

from proofs.statement import Stated
from proofs.terms import coq, term, variable, variables
from quadstep.proofs.theory.region import BENDING, NORMS, R1, SIZE, LevelBounds, Setting, Shape, decay

VECTORS = (
    "r1 I1 e1 e2 r2 I2 a b a_c b_c eps1 eps2 delta_f Be2 jerk r1_dot F_dot e2_dot c c_raw command_dot c_raw_dot "
    "J_r2_dot fed_back C_r2 C_I2 eta_dot turned B_r1 B_r1_dot B_turned_r1"
)
"""B_r1, B_r1_dot: B^T r1, B^T r1_dot. B_turned_r1: B_dot^T r1. turned: the rates of the tilt, without that of yaw."""

LOOP = """
  scale m r1_dot = add (scale (- (k1 - m * l1)) r1) (add (scale (- i1) I1) (add delta_f (add (scale thrust Be2) eps1)))
  e2_dot = add r2 (add (scale (- l2) e2) (scale (-1) c))
  c = add c_raw (add (scale (-1) a_c) (scale (-1) b_c))
  p * dot e2 c_raw = thrust * dot r1 Be2
  scale p c_raw = scale thrust B_r1
  J_r2_dot = add (scale l2 (J r2)) (add (scale (-1) C_r2) (add fed_back (add (scale (- p) e2) eps2)))
  fed_back = add (scale (- k2) r2) (scale (- i2) I2)
  F_dot = add (scale m jerk) (add (scale (- (m * (l1 * l1))) (add r1 (scale (- l1) e1))) (add (scale k1 r1_dot) (scale i1 r1)))
  scale p c_raw_dot = add (scale thrust_dot B_r1) (add (scale thrust B_turned_r1) (scale thrust B_r1_dot))
  turned = add (scale w b) (scale (-1) e2_dot)
"""
"""The closed loop, nets off, as docs/theory.md has it: T9's outer and inner loop, the counter-rate, their rates."""

KNOWN = f"""
  0 <= thrust
  thrust <= u
  len delta_f <= thrust * (len a + len b)
  len Be2 <= len e2
  Rabs thrust_dot <= len F_dot
  len command_dot * fz <= len F_dot
  len B_r1 <= column * len r1
  len B_r1_dot <= column * len r1_dot
  len B_turned_r1 <= {BENDING.numerator} / {BENDING.denominator} * (len (scale w b) + len turned) * len r1
  (forall (x y : vec) (t : R), J (add x (scale t y)) = add (J x) (scale t (J y)))
  (forall x y : vec, dot x (J y) = dot (J x) y)
  (forall x : vec, 0 <= dot x (J x) <= high * dot x x)
  l2 * high <= k2
  dot r2 C_I2 * dot r2 C_I2 <= 1 / 2 * (sigma * sigma) * dot eta_dot eta_dot * dot I2 I2 * dot r2 r2
  len eta_dot <= rates
  len eps1 <= force
  len eps2 <= torque
  len jerk <= jerk_most
  len r1 <= r1_most
"""
"""What bounds its parts: T2, T4, T15, C_norm, and the bounds that L <= level implies."""

LEVEL_RATE = """
  m * dot r1 r1_dot + i1 * dot I1 r1 + c1 * (m * dot r1_dot I1 + m * dot r1 r1)
  + q * dot e1 (add r1 (scale (- l1) e1)) + p * dot e2 e2_dot
  + (dot r2 J_r2_dot + dot r2 C_r2) + i2 * dot I2 r2
  + c2 * (dot I2 J_r2_dot + (dot r2 C_I2 + dot I2 C_r2) + dot r2 (J r2))
  + pa * dot a (add command_dot (scale (- w) a)) + pb * dot b (add (scale w a) (scale (- w) b))
  + pc * dot a_c (add c_raw_dot (scale (- w) a_c)) + pd * dot b_c (add (scale w a_c) (scale (- w) b_c))
"""
"""L_dot by the chain rule, with J_dot = C + C^T (T6)."""


NAMES = {
    "mass": "m", "slope_1": "l1", "gain_1": "k1", "integral_1": "i1", "inertia": "sigma", "slope_2": "l2", "gain_2": "k2",
    "integral_2": "i2", "coupling": "p", "filter_frequency": "w", "jerk": "jerk_most", "cross_1": "c1", "cross_2": "c2",
    "position": "q", "command_1": "pa", "command_2": "pb", "counter_1": "pc", "counter_2": "pd",
}  # fmt: skip
"""Of the code's numbers, in the statement."""


def number(name: str) -> Fraction:
    """A variable, as what `region` reckons with."""
    return cast(Fraction, variable(name))


def numbers(of: Callable[[str], Fraction]) -> tuple[Setting, Shape, LevelBounds]:
    """The setting, the shape of L and its bounds, by their names here."""
    largest = [of("r1_most" if i == R1 else f"{name}_most") for i, name in enumerate(NORMS)]
    inertia = of("low"), of("high")
    bounds = LevelBounds(of("pull"), of("u"), of("fz"), largest, inertia, of("column"), of("rates"))
    setting = Setting(*(of(NAMES.get(name, name)) for name in Setting._fields))
    return setting, Shape(*(of(NAMES[name]) for name in Shape._fields)), bounds


def bound(of: Callable[[str], Fraction] = number) -> Fraction:
    """-s^T Q s + d . s of the lengths of the errors, by the code."""
    q, d = decay(*numbers(of), rounded=lambda x: x)
    s = [of(f"(len {name})") for name in NORMS]
    return sum((s[i] * (d[i] - sum(map(mul, q[i], s), Fraction(0))) for i in range(SIZE)), Fraction(0))


class Lines(Stated):
    """The statement."""

    @property
    def prop(self) -> str:
        """The proposition in Coq."""
        lines = term(cast(float, bound()))
        scalars = sorted({name for name in variables(lines) if not name.startswith("(")} | {"thrust", "thrust_dot"})
        positive = [f"0 < {name}" for name in ("m", "p", "fz")]
        positive += [f"0 <= {name}" for name in sorted({*scalars} - {"m", "p", "fz", "thrust", "thrust_dot"})] + [
            "0 <= k1 - m * l1"
        ]
        given = [*positive, *LOOP.strip().splitlines(), *KNOWN.strip().splitlines()]
        supposed = " ->\n  ".join(line.strip() for line in given)
        quantified = f"forall ({' '.join(scalars)} : R) ({VECTORS} : vec) (J : vec -> vec)"
        return f"{quantified},\n  {supposed} ->\n  {LEVEL_RATE.strip()}\n  <= {coq(lines)}"


def statements() -> list[Lines]:
    """The lines of Q and d."""
    return [Lines("T18_lines", "L_dot <= -s^T Q s + d . s: every coefficient of Q and d")]
