"""Recorded numbers in C99: literals, and the text of each operation around its operands."""

import math

import numpy as np

from quadstep.io.errors import UserError
from quadstep.numbers.script import ScriptNumber
from quadstep.numbers.script_functions import ScriptSteps

C_TEXT = {
    "+": "({} + {})",
    "-": "({} - {})",
    "*": "({} * {})",
    "/": "({} / {})",
    "negative": "(-{})",
    "<": "({} < {})",
    "<=": "({} <= {})",
    ">": "({} > {})",
    ">=": "({} >= {})",
    "==": "qs_equal({}, {})",
    "!=": "(!qs_equal({}, {}))",
    "and": "({} && {})",
    "or": "({} || {})",
    "not": "(!{})",
    "where": "({} ? {} : {})",
    "sqrt": "qs_sqrt({})",
    "magnitude": "qs_abs({})",
    "bit": "((qs_bits({}) & {}) != 0u)",
    "power": "qs_power({})",
    "fraction": "qs_fraction({})",
    "exponent": "qs_exponent({})",
    "entry": "{}[(int32_t){}]",
    "number": "((real){})",
    "word": "((uint32_t){})",
    "word +": "({} + {})",
    "word &": "({} & {})",
    "word |": "({} | {})",
    "word ^": "({} ^ {})",
    "word <<": "({} << {})",
    "word >>": "({} >> {})",
}
"""Brackets keep each operation separate, so that none can be combined with its neighbours."""


def literal(value: float, precise: bool) -> str:
    """A number as C reads it: f64 where precise, else the nearest f32. Raises UserError where an f32 cannot hold it."""
    if value != value:  # noqa: PLR0124 (NaN)
        return "((real)NAN)"
    if math.isinf(value):
        return "((real)INFINITY)" if value > 0.0 else "(-(real)INFINITY)"
    text = repr(float(value)) if precise else str(in_single(value))
    text += "" if "." in text or "e" in text else ".0"
    text += "" if precise else "f"
    return f"({text})" if text.startswith("-") else text


def in_single(value: float) -> np.float32:
    """The nearest f32. Raises UserError if that is infinite, or zero for a nonzero number."""
    with np.errstate(all="ignore"):
        single = np.float32(value)
    if np.isinf(single) or (single == 0.0 and value != 0.0):
        raise UserError(f"{value:g} does not fit f32; export with --precision f64, or change it")
    return single


class CSteps(ScriptSteps):
    """sin and its like, written out for numbers of one kind."""

    def __init__(self, precise: bool) -> None:
        self._precise = precise

    def precise(self, x: ScriptNumber | float) -> bool:
        return self._precise


def bare(text: str) -> str:
    """An expression without its outer brackets."""
    if not text.startswith("("):
        return text
    depth = 0
    for place, sign in enumerate(text):
        depth += (sign == "(") - (sign == ")")
        if depth == 0:
            return text[1:-1] if place == len(text) - 1 else text
    return text
