"""How far rounding takes the own elementary functions from their polynomials: scripts for Gappa, emitted from their code."""

import re
import subprocess
from collections.abc import Iterable
from fractions import Fraction
from typing import NamedTuple

from proofs.coq_run import UnprovedError
from proofs.kernels import KERNELS, Kernel, kept, reduced
from proofs.terms import Term, decimal, gappa, term, variable
from quadstep.numbers.operation import QUARTER_TURN

FORMATS = {True: "float<ieee_64, ne>", False: "float<ieee_32, ne>"}
LEAST = {True: "1b-60", False: "1b-24"}
"""Below it the tail of sine and arctangent vanishes against r; above it no product underflows."""

TURNS = {True: 20, False: 13}
"""Exponents of the most quarter turns that are taken off an angle."""


class Bound(NamedTuple):
    """What Gappa proved: of which kernel, in f64 or f32, the largest rounding error [of 1, or of r where relative]."""

    name: str
    double: bool
    error: float


def exact(root: Term) -> str:
    """The term in real arithmetic, as Gappa writes it."""
    if root.op in ("var", "const"):
        return decimal(root.leaf) if isinstance(root.leaf, Fraction) else root.leaf
    return "(" + f" {root.op} ".join(map(exact, root.parts)) + ")"


def script(kernel: Kernel, double: bool) -> str:
    """The question: how large is the rounding error of a kernel?"""
    r = variable("r")
    lines: list[str] = []
    head = f"@rnd = {FORMATS[double]};\nr = rnd(real);\n"
    if not kernel.relative:
        result = gappa(term(kernel.whole(r, double)), "rnd", lines)
        return (
            head
            + "\n".join(lines)
            + (f"\nM = {exact(term(kernel.whole(r, double)))};\n{{ |r| in [0,{float(kernel.most)}] -> {result} - M in ? }}\n")
        )
    tail = term(kernel.tail(r, double))
    t = gappa(tail, "rnd", lines)
    return (
        head
        + "\n".join(lines)
        + f"""
sum = rnd(r + {t});
T = {exact(tail)};
Q = {exact(over_r(tail, term(r)))};
M = r + T;
{{ |r| in [{LEAST[double]},{float(kernel.most)}] -> (sum - M) / r in ? }}
T / r -> Q {{ r <> 0 }};
{t} / r -> (({t} - T) / T) * (T / r) + T / r {{ r <> 0, T <> 0 }};
(sum - M) / r -> ((sum - (r + {t})) / (r + {t})) * (1 + {t} / r) + (({t} - T) / T) * (T / r) {{ r <> 0, T <> 0 }};
r + {t} -> r * (1 + {t} / r) {{ r <> 0 }};
"""
    )


def over_r(product: Term, r: Term) -> Term:
    """A product that holds the factor r, without it."""
    left, right = product.parts
    if left is r:
        return term(right)
    return term(over_r(left, r) * right)


def reduction_script(double: bool, octave: int) -> str:
    """How far is the reduced angle from x - n (high + middle + low), n whole, from 2^octave to twice that?"""
    x, n = variable("x"), variable("n")
    lines: list[str] = []
    angle = term(reduced(x, n, double))
    result = gappa(angle, "rnd", lines)
    quarter = Fraction(0) + sum(map(Fraction, kept(QUARTER_TURN, double)))
    grid = (53 if double else 24) - octave  # as x >= 2^octave pi / 2 - pi / 4
    return (
        f"@rnd = {FORMATS[double]};\nx = rnd(real);\n"
        + "\n".join(lines)
        + f"""
M = {exact(angle)};
{{ @FIX(n, 0) /\\ @FIX(x, {-grid}) /\\ |n| in [{2**octave},{2 ** (octave + 1)}] /\\
  |x - n * {decimal(quarter)}| <= 0.79 -> {result} - M in ? }}
"""
    )


def asked(text: str) -> float:
    """The bound that Gappa proves. Raises UnprovedError if it proves none."""
    answer = subprocess.run(["gappa"], input=text, capture_output=True, text=True, check=False)
    found = re.findall(r"\{(-?[0-9.e+-]+), ", answer.stdout + answer.stderr)
    if answer.returncode or len(found) != 2:
        raise UnprovedError(f"Gappa: {answer.stderr.strip()}")
    return max(abs(float(number)) for number in found)


def proved() -> Iterable[Bound]:
    """Every kernel, in f64 and f32, and the reduction of angles."""
    for double in (True, False):
        for kernel in KERNELS:
            yield Bound(kernel.name, double, asked(script(kernel, double)))
        octaves = (asked(reduction_script(double, octave)) for octave in range(TURNS[double]))
        yield Bound("angle", double, max(octaves))
