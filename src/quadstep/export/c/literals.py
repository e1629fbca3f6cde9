"""Literals of C99, and templates with words to be filled in."""

import math
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from quadstep.io.errors import UserError


def filled(path: Path, words: Mapping[str, str]) -> str:
    """A template with each of these words replaced, where it stands alone or begins a name."""
    text = path.read_text(encoding="utf-8")
    known = "|".join(map(re.escape, sorted(words, key=len, reverse=True)))
    return re.sub(rf"\b(?:{known})", lambda found: words[found[0]], text)


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
