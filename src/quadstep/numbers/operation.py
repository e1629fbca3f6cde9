"""An elementary function of laws, declared once with all its rules, and the kinds of numbers that follow them.

`elementary.py` declares the package's own. A declaration is enough: every kind of number has the function from then on, C and
JavaScript are generated from its steps, and analyses follow its rules.
"""

import os
import sys
from collections.abc import Callable
from fractions import Fraction
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

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


class Kind:
    """The functions of a kind of number: a method for every operation, made by `rule` unless the kind has its own."""

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...

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
    function: Callable[..., float],
    steps: Callable[..., float],
    tangents: tuple[Callable[..., float], ...],
    enclosure: Rule,
    exact: Callable[..., Fraction | None],
    coq: str = "",
    sympy: Rule | None = None,
    singular: tuple[Callable[..., bool], str] = (nowhere, ""),
) -> None:
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
