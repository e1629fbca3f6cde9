"""The elementary functions in C, generated from the engines' own functions, with the same bits."""

from collections.abc import Iterable
from functools import cache, reduce
from typing import NamedTuple, cast

from quadstep.export.c.branches import HALVES
from quadstep.export.c.expressions import Naming
from quadstep.export.c.scans import ScanRecord
from quadstep.export.c.structs import INDENT, Output, Stored
from quadstep.export.c.writing import Writer
from quadstep.numbers.elementary import turn
from quadstep.numbers.kinds import Number
from quadstep.numbers.operation import OPERATIONS, Kind
from quadstep.program.recorded import RECORDED

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

PAIR = "typedef struct\n{\n    real sine;\n    real cosine;\n} qs_sine_cosine;"

CALLS = {"magnitude": "abs", "==": "equal", "!=": "equal", "bit": "bits"}
"""Recorded operations by another name than that of the step that they call."""

NEEDS = {"power": ("bits", "of_bits"), "fraction": ("bits", "of_bits"), "exponent": ("bits",)}
"""Steps that call others."""

KINDS = {
    True: {"abs": "fabs", "sqrt": "sqrt", "word": "uint64_t", "size": "52", "bias": "1023", "mantissa": "0xFFFFFFFFFFFFFu",
           "half": "0x3FE0000000000000u", "exponent": "0x7FFu", "less": "1022"},
    False: {"abs": "fabsf", "sqrt": "sqrtf", "word": "uint32_t", "size": "23", "bias": "127", "mantissa": "0x7FFFFFu",
            "half": "0x3F000000u", "exponent": "0xFFu", "less": "126"},
}  # fmt: skip
"""Words filled into these texts for f64 (True) and f32 (False)."""


class Function(NamedTuple):
    """text: in C. uses: the operations in it."""

    text: str
    uses: tuple[str, ...]


def functions(used: Iterable[str], precise: bool) -> str:
    """The functions that these operations call, and those that they need, in order."""
    known = ("sincos", *OPERATIONS)
    wanted: set[str] = set()
    waiting = list(used)
    while waiting:
        operation = waiting.pop()
        name = CALLS.get(operation, operation)
        if name not in wanted and (name in STEPS or name in known):
            wanted.add(name)
            waiting += NEEDS.get(name, ()) if name in STEPS else written(name, precise).uses
    texts = []
    for name, text in STEPS.items():
        if name in wanted:
            texts.append(reduce(lambda said, one: said.replace(f"{{{one[0]}}}", one[1]), KINDS[precise].items(), text))
    texts += [written(name, precise).text for name in known if name in wanted]
    return "\n\n".join(texts)


@cache
def written(name: str, precise: bool) -> Function:
    """One function."""
    if name in HALVES:
        text = f"static inline real qs_{name}(real x)\n{{\n{INDENT}return qs_sincos(x).{HALVES[name]};\n}}"
        return Function(text, ("sincos",))
    arguments = OPERATIONS["sin" if name == "sincos" else name].arguments
    given = ", ".join(f"real {one}" for one in arguments)
    record = ScanRecord(inline=True, precise=precise)
    numbers = [cast(Number, record.input(one)) for one in arguments]
    writer = Writer(record, precise, Naming({}, {}), frozenset(("result", *arguments)))
    if name == "sincos":
        results = sine_cosine(RECORDED, *numbers)
        outputs = [Output(f"result.{one}", record.at(number)) for one, number in zip(HALVES.values(), results, strict=True)]
        body = ["qs_sine_cosine result;", *writer.body(Stored(outputs, [])), "return result;"]
        head = f"{PAIR}\n\nstatic qs_sine_cosine qs_sincos({given})"
    else:
        result = OPERATIONS[name].steps(RECORDED, *numbers)
        *body, last = writer.body(Stored([Output("result", record.at(result))], []))
        body.append("return " + last.removeprefix("result = "))
        head = f"static inline real qs_{name}({given})"
    text = "\n".join([head, "{", *(INDENT + line for line in body), "}"])
    return Function(text, tuple({node.operation for node in record.nodes}))


def sine_cosine(steps: Kind, x: Number) -> tuple[Number, Number]:
    """Sine and cosine to the bit, from one reduction of the angle."""
    sine, cosine, quarter = turn(steps, x)
    odd, back = steps.bit(quarter, 0), steps.bit(quarter, 1)
    rise, run = steps.where(odd, cosine, sine), steps.where(odd, -sine, cosine)
    return steps.where(back, -rise, rise), steps.where(back, -run, run)
