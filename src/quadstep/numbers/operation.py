"""An elementary function of laws, declared once with all its rules, and the kinds of numbers that follow them.

`elementary.py` declares the package's own. A declaration is enough: every kind of number has the function from then on, C and
JavaScript are generated from its steps, and analyses follow its rules.

The steps are made of polynomials on short intervals, and of what reduces an argument to these. Fitted by Chebyshev
interpolation in 40 digits (`mpmath.chebyfit`); each for f64 (True) and f32 (False).
"""

import math
import os
import sys
from collections.abc import Callable
from fractions import Fraction
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, Self, TypeAlias, TypeVar

HERE = str(Path(__file__).parent)


def place() -> str:
    """File and line of the code that uses a number now."""
    frame = sys._getframe(1)
    while frame.f_back and frame.f_code.co_filename.startswith(HERE):
        frame = frame.f_back
    return f"{frame.f_code.co_filename.rpartition(os.sep)[2]}, line {frame.f_lineno}"


Rule: TypeAlias = Callable[..., object]
"""A function that a declaration states; the type checker reads steps and tangents as over floats, as it does a law."""


def nowhere(*_: float) -> bool:
    """Of a function that has a tangent everywhere."""
    return False


class Operation(NamedTuple):
    """The rules of the function of this name and these arguments.

    steps(kind, *arguments): its value by the steps of an `Elementary` kind: the same to the bit on every engine, in Python and
    as LLVM, PTX, C and JavaScript.
    tangents: of each argument (t, *arguments, value): the share of the result's tangent that comes from its tangent t.
    enclosure(*arguments): of enclosures.
    exact(*arguments): its value where that is a fraction, else None; arguments are fractions, or None where unknown.
    sympy(sympy, *arguments): the expression. coq: its name there.
    singular(*arguments): whether a float has no tangent there; `undefined` says what is there instead.
    """

    name: str
    arguments: tuple[str, ...]
    steps: Callable[..., float]
    tangents: tuple[Callable[..., float], ...]
    enclosure: Rule
    exact: Callable[..., Fraction | None]
    sympy: Rule
    coq: str
    singular: Callable[..., bool] = nowhere
    undefined: str = ""


OPERATIONS: dict[str, Operation] = {}
"""By name."""


N = TypeVar("N")


class Arithmetic(Generic[N]):
    """Mixin for kinds of number: what follows from their sums with N and their negation."""

    __slots__ = ()

    if TYPE_CHECKING:

        def __neg__(self) -> Self: ...

        def __add__(self, other: N) -> Self: ...

    def __pos__(self) -> Self:
        return self

    def __sub__(self, other: N) -> Self:
        return self + (-other)  # type: ignore[operator]

    def __rsub__(self, other: N) -> Self:
        return (-self) + other


class Kind:
    """The functions of a kind of number: a method for every operation, made by `rule` unless the kind has its own.

    refusal: the exception of one that has no bits and calls no opaque function.
    """

    refusal: type[Exception] = TypeError

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...
    else:

        def word(self, _):
            """See `quadstep.numbers.functions`."""
            raise self.refusal(f"the law manipulates the bits of a number ({place()})")

        number = word

        def opaque(self, *_):
            """See `quadstep.numbers.scan`."""
            raise self.refusal(f"it calls an opaque function, which has no equations ({place()})")

    def __init_subclass__(cls) -> None:
        KINDS.append(cls)
        for operation in OPERATIONS.values():
            cls.learn(operation)

    @classmethod
    def learn(cls, operation: Operation) -> None:
        """Have a method for this operation, unless it is written by hand, here or where this class has its rule from."""
        if operation.name not in vars(cls) and ("rule" in vars(cls) or not hasattr(cls, operation.name)):
            setattr(cls, operation.name, cls.rule(operation))

    @staticmethod
    def rule(operation: Operation) -> Rule:
        """The method of this kind for an operation, from the rules of that."""
        raise NotImplementedError


KINDS: list[type[Kind]] = []


class Elementary(Kind):
    """The functions of a kind of number that takes the steps itself, which supplies

    where(condition, yes, no), abs(x), and `precise(x)`: f64, not f32?
    bit(x, place): whether the bit of this place, 0 the lowest, is set in x;
    power(m): 2^n for m = n + SHIFTER, n within EXPONENTS (`elementary.py`);
    fraction(x), exponent(x): x = fraction 2^exponent with fraction in [1/2, 1), for a normal x > 0; else meaningless.
    """

    @staticmethod
    def rule(operation: Operation) -> Rule:
        return operation.steps


def declare(
    function: Callable[..., float], steps: Callable[..., float], tangents: tuple[Callable[..., float], ...],
    enclosure: Rule, exact: Callable[..., Fraction | None], coq: str = "", sympy: Rule | None = None,
    singular: tuple[Callable[..., bool], str] = (nowhere, ""),
) -> None:  # fmt: skip
    """Give every kind of number the function that laws call, which passes its arguments to their kind's method of its name.

    coq, sympy: of its name if they are not stated.
    """
    name = function.__name__
    operation = Operation(
        name,
        tuple(signature(function).parameters),
        steps,
        tangents,
        enclosure,
        exact,
        sympy or (lambda module, *given: getattr(module, name)(*given)),
        coq or name,
        *singular,
    )
    OPERATIONS[name] = operation
    for kind in KINDS:
        kind.learn(operation)


PI = Fraction("3.14159265358979323846264338327950288419716939937510")
LN2 = Fraction("0.69314718055994530941723212145817656807550013436026")

# (sin r - r) / r^3, (cos r - 1 + r^2/2) / r^4 over r^2; (exp r - 1 - r) / r^2 over r; (2^r - 1) / r over r;
# (atan r - r) / r^3 over r^2; (log((1 + s) / (1 - s)) - 2 s) / s^3 over s^2; each for f64 (True) and f32 (False)
SINE = {
    True: (-0.16666666666666666, 0.0083333333333307, -0.00019841269836387345, 2.755731591191116e-06,
           -2.5051092507061385e-08, 1.59153232122714e-10),
    False: (-0.16666664539989612, 0.008332724732630293, -0.0001958285585078999),
}  # fmt: skip
COSINE = {
    True: (0.041666666666666664, -0.0013888888888887241, 2.4801587298533456e-05, -2.755731715246704e-07,
           2.087612165887116e-09, -1.1380876948169717e-11),
    False: (0.04166666453694609, -0.0013888279449649538, 2.454289633694463e-05),
}  # fmt: skip
EXPONENTIAL = {
    True: (0.5, 0.1666666666666667, 0.04166666666666667, 0.008333333333325544, 0.0013888888888883327,
           0.00019841269876864356, 2.4801587327007187e-05, 2.755725283351691e-06, 2.75572718102198e-07,
           2.5106274733573296e-08, 2.0915442297780116e-09),
    False: (0.5, 0.16666573381900845, 0.04166655011030512, 0.008363773874405574, 0.0013926926614021907),
}  # fmt: skip
POWER_OF_TWO = {
    True: (0.6931471805599462, 0.24022650695910075, 0.05550410866465167, 0.009618129107618665, 0.0013333558200794592,
           0.00015403530424776529, 1.5252672924850737e-05, 1.3215451633221434e-06, 1.0205905413765595e-07,
           7.070977866508138e-09),
    False: (0.6931471805599453, 0.2402234903802036, 0.05550381013796457, 0.009666368515385448, 0.0013381302537320797),
}  # fmt: skip
ARCTANGENT = {
    True: (-0.3333333333333333, 0.19999999999999785, -0.14285714285654638, 0.11111111104652255, -0.09090908728587459,
           0.07692295658327873, -0.06666412077725274, 0.058787824694439814, -0.0522938047378184, 0.045467195095551666,
           -0.034445844423577385, 0.016148228546771868),
    False: (-0.33333331686451945, 0.1999952339722771, -0.1426336657972561, 0.1073739696716272, -0.06431038710715442),
}  # fmt: skip
LOGARITHM = {
    True: (0.666666666666667, 0.39999999999899505, 0.28571428625975487, 0.2222221113479508, 0.18182889125261723,
           0.15331721600556042, 0.14616449685043406),
    False: (0.6666668503957586, 0.3998878056602198, 0.2957994939197279),
}  # fmt: skip


def parts(value: Fraction, bits: int, count: int) -> tuple[float, ...]:
    """`value` as a sum of floats of `bits` bits each, so that a small integer times each but the last is exact."""
    result = []
    for _ in range(count - 1):
        scale = Fraction(2) ** (bits - 1 - math.floor(math.log2(value)))
        part = Fraction(math.floor(value * scale)) / scale
        result.append(float(part))
        value -= part
    return (*result, float(value))


QUARTER_TURN = {True: parts(PI / 2, 33, 3), False: parts(PI / 2, 11, 3)}
OCTAVE = {True: parts(LN2, 33, 2), False: parts(LN2, 12, 2)}

MOST_ANGLE = {True: 2.0**20 * (math.pi / 2.0), False: 2.0**13 * (math.pi / 2.0)}
"""Up to here the reduction of an angle is exact except for its last step; sine and cosine beyond it are NaN [rad]."""

EXPONENTS = {True: (-1023.0, 1024.0), False: (-127.0, 128.0)}
"""Two to the first counts as zero, to the second as infinity, as in the bits that `power` makes."""

SHIFTER = {True: 1.5 * 2.0**52, False: 1.5 * 2.0**23}
"""A number plus this has no bits for a fraction: it is rounded to the nearest integer, which its low bits then contain."""


def polynomial(x: float, coefficients: tuple[float, ...]) -> float:
    """Sum of coefficients[i] x^i by Horner's rule."""
    value: float = coefficients[-1]
    for coefficient in coefficients[-2::-1]:
        value = value * x + coefficient
    return value
