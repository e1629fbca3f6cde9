"""NumPy's scalars of f64 and f32: the steps on their bits that the elementary functions need."""

from typing import NamedTuple, TypeAlias, cast

import numpy as np

Scalar: TypeAlias = np.float64 | np.float32

REAL: dict[bool, type[Scalar]] = {True: np.float64, False: np.float32}
"""The kinds: f64 (True) and f32 (False)."""


class Layout(NamedTuple):
    """Of the bits of a number. whole: an integer of as many. mantissa: how many it has. exponent: all of its own set."""

    whole: type[np.uint64 | np.uint32]
    mantissa: int
    bias: int
    exponent: int


LAYOUTS = {True: Layout(np.uint64, 52, 1023, 0x7FF), False: Layout(np.uint32, 23, 127, 0xFF)}


def steps(precise: bool) -> dict[str, object]:
    """By name: `bit`, `power`, `fraction`, `exponent` of `Elementary`, `sqrt`; `word` and `real`, to and from an integer."""
    real, (whole, mantissa, bias, exponents) = REAL[precise], LAYOUTS[precise]
    below = (1 << mantissa) - 1

    def bits(x: Scalar) -> int:
        return int(x.view(whole))

    def of_bits(all_bits: int) -> Scalar:
        return cast(Scalar, whole(all_bits).view(real))

    return {
        "real": real,
        "sqrt": np.sqrt,
        "word": lambda x: int(x) if np.isfinite(x) else 0,
        "bit": lambda x, mask: bits(x) & mask != 0,
        "power": lambda m: of_bits((bits(m) + bias & exponents) << mantissa),
        "fraction": lambda x: of_bits(bits(x) & below | bias - 1 << mantissa),
        "exponent": lambda x: real((bits(x) >> mantissa & exponents) - bias + 1),
    }
