"""sin, cos, exp, sigmoid, log and atan2 in C, generated from the engines' own functions, with the same bits."""

from functools import lru_cache, reduce
from typing import cast

from quadstep.c99.expressions import Naming
from quadstep.c99.scans import ScanRecord
from quadstep.c99.structs import Output, Stored
from quadstep.c99.writing import INDENT, Writer
from quadstep.numbers.c_text import CSteps, literal
from quadstep.numbers.elementary import Elementary
from quadstep.numbers.functions import Number
from quadstep.numbers.script import ScriptNumber

ARGUMENTS = {"wave": ("x", "ahead"), "sin": "x", "cos": "x", "exp": "x", "sigmoid": "x", "log": "x", "atan2": "yx"}

STEPS = {
    "abs": "static inline real qs_abs(real x)\n{\n    return {abs}(x);\n}",
    "sqrt": "static inline real qs_sqrt(real x)\n{\n    return {sqrt}(x);\n}",
    "equal": "static inline bool qs_equal(real a, real b)\n{\n    return (a <= b) && (a >= b);\n}",
    "bits": (
        "static inline {word} qs_bits(real x)\n{\n    {word} bits;\n"
        "    (void)memcpy(&bits, &x, sizeof bits);\n    return bits;\n}"
    ),
    "of_bits": (
        "static inline real qs_of_bits({word} bits)\n{\n    real x;\n    (void)memcpy(&x, &bits, sizeof x);\n    return x;\n}"
    ),
    "power": (
        "/* 2^n for m = n + 1.5 * 2^{size} */\n"
        "static inline real qs_power(real m)\n{\n    return qs_of_bits((qs_bits(m) + {bias}u) << {size});\n}"
    ),
    "fraction": (
        "/* x / 2^exponent, from 1/2 to 1, for a normal x > 0 */\n"
        "static inline real qs_fraction(real x)\n{\n    return qs_of_bits((qs_bits(x) & {mantissa}) | {half});\n}"
    ),
    "exponent": (
        "static inline real qs_exponent(real x)\n{\n"
        "    return (real)((int32_t)((qs_bits(x) >> {size}) & {exponent}) - {less});\n}"
    ),
}
"""Operations on the bits of a number, and C library functions that IEEE 754 defines to the bit."""

WAVES = {"sin": 0.0, "cos": 1.0}
"""Quarter turns by which a function leads the sine: both are one function, `wave`."""

NEEDS = {
    "power": ("bits", "of_bits"), "fraction": ("bits", "of_bits"), "exponent": ("bits",),
    "sin": ("wave",), "cos": ("wave",), "wave": ("abs", "bits"), "exp": ("power",), "sigmoid": ("power",),
    "log": ("fraction", "exponent", "equal"), "atan2": ("abs",),
}  # fmt: skip

KINDS = {
    True: {"abs": "fabs", "sqrt": "sqrt", "word": "uint64_t", "size": "52", "bias": "1023", "mantissa": "0xFFFFFFFFFFFFFu",
           "half": "0x3FE0000000000000u", "exponent": "0x7FFu", "less": "1022"},
    False: {"abs": "fabsf", "sqrt": "sqrtf", "word": "uint32_t", "size": "23", "bias": "127", "mantissa": "0x7FFFFFu",
            "half": "0x3F000000u", "exponent": "0xFFu", "less": "126"},
}  # fmt: skip
"""Words filled into these texts for f64 (True) and f32 (False)."""


def functions(used: frozenset[str], precise: bool) -> str:
    """The functions that a law uses, and those that they need, in order."""
    wanted = set(used)
    while True:
        more = wanted.union(*(NEEDS.get(name, ()) for name in wanted))
        if more == wanted:
            break
        wanted = more
    texts = []
    for name, text in STEPS.items():
        if name in wanted:
            texts.append(reduce(lambda said, one: said.replace(f"{{{one[0]}}}", one[1]), KINDS[precise].items(), text))
    texts += [written(name, precise) for name in ARGUMENTS if name in wanted]
    return "\n\n".join(texts)


@lru_cache(maxsize=32)
def written(name: str, precise: bool) -> str:
    """One function."""
    given = ", ".join(f"real {one}" for one in ARGUMENTS[name])
    head = f"static {'' if name == 'wave' else 'inline '}real qs_{name}({given})"
    if name in WAVES:
        return f"{head}\n{{\n{INDENT}return qs_wave(x, {literal(WAVES[name], precise)});\n}}"
    record = ScanRecord()
    numbers = [cast(Number, record.input(one)) for one in ARGUMENTS[name]]
    steps = CSteps(precise)
    result = cast(ScriptNumber, wave(steps, *numbers) if name == "wave" else getattr(steps, name)(*numbers))
    writer = Writer(record, precise, Naming({}, {}), frozenset(ARGUMENTS[name]))
    *body, last = writer.body(Stored([Output("result", result.place)], []))
    final = "return " + last.removeprefix("result = ")
    return "\n".join([head, "{", *(INDENT + line for line in [*body, final]), "}"])


def wave(steps: Elementary, x: Number, ahead: Number) -> Number:
    """The sine of x plus 0 or 1 quarter turns: `Elementary.sin` and `cos` to the bit."""
    sine, cosine, quarter = steps.turn(x)
    quarter = quarter + ahead
    value = steps.where(steps.bit(quarter, 0), cosine, sine)
    result: Number = steps.where(steps.bit(quarter, 1), -value, value)
    return result
