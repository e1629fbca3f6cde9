"""The source of an exported law, its parameters, and the elementary functions, generated from the engines' own, with the same
bits.
"""

import re
from collections.abc import Iterable
from functools import cache, reduce
from typing import NamedTuple, cast

from quadstep.export.c.branches import HALVES, ScanRecord
from quadstep.export.c.expressions import Naming
from quadstep.export.c.guards import finite, guards
from quadstep.export.c.header import Exported, head, title
from quadstep.export.c.structs import INDENT, TEXTS, StoredStructures, StructOutput, has_numbers, initialiser
from quadstep.export.c.writing import CWriter
from quadstep.numbers.elementary import turn
from quadstep.numbers.kinds import Number
from quadstep.numbers.operation import OPERATIONS, Kind
from quadstep.program.recorded import RECORDED

STEPS = {re.findall(r"qs_(\w+)\(", one)[0]: one for one in (TEXTS / "steps.c").read_text("utf-8").strip().split("\n\n")}
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
    if name in HALVES:
        text = f"static inline real qs_{name}(real x)\n{{\n{INDENT}return qs_sincos(x).{HALVES[name]};\n}}"
        return Function(text, ("sincos",))
    arguments = OPERATIONS["sin" if name == "sincos" else name].arguments
    given = ", ".join(f"real {one}" for one in arguments)
    record = ScanRecord(inline=True, precise=precise)
    numbers = [cast(Number, record.input(one)) for one in arguments]
    writer = CWriter(record, precise, Naming({}, {}), frozenset(("result", *arguments)))
    if name == "sincos":
        results = sine_cosine(RECORDED, *numbers)
        outputs = [
            StructOutput(f"result.{one}", record.at(number)) for one, number in zip(HALVES.values(), results, strict=True)
        ]
        body = ["qs_sine_cosine result;", *writer.body(StoredStructures(outputs, [])), "return result;"]
        head = f"{PAIR}\n\nstatic qs_sine_cosine qs_sincos({given})"
    else:
        result = OPERATIONS[name].steps(RECORDED, *numbers)
        *body, last = writer.body(StoredStructures([StructOutput("result", record.at(result))], []))
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


def source(exported: Exported) -> str:
    name, code = exported.name, exported.code
    raw = {what: f"static void {what}_step" for what in code.functions}
    parts = [
        head(exported, f"{title(exported)}: a control law in C99. Do not edit."),
        f'#include "{name}.h"\n\n#include <math.h>\n#include <stdbool.h>\n#include <stddef.h>\n#include <string.h>',
        (TEXTS / "pragmas.c").read_text("utf-8").strip(),
        functions(("bits", *code.used), exported.precise),
        finite(exported),
    ]
    for what, lines in code.functions.items():
        body = "\n".join(f"    {line}" for line in lines)
        arguments = step_arguments(exported, what)
        said = re.sub(r"/\*.*?\*/", "", body, flags=re.S)
        unused = [one for one in arguments if not re.search(rf"\b{one.rsplit('*')[-1].split()[-1]}\b", said)]
        voids = "".join(f"    (void){one.rsplit('*')[-1].split()[-1]};\n" for one in unused)
        parts.append(f"{raw[what]}({', '.join(arguments) or 'void'})\n{{\n{voids}{body}\n}}")
    parts += guards(exported)
    return "\n\n".join(parts) + "\n"


def step_arguments(exported: Exported, what: str) -> list[str]:
    """Parameters of the function that contains the law's own statements."""
    name = exported.name
    memory = [f"{name}_memory *memory"] if has_numbers(exported.code.memory) else []
    params = [f"const {name}_params *params"]
    if what == "made":
        return [*params, f"const {name}_command *command", f"{name}_actuators *made"]
    if what == "start":
        return [*params, *memory, f"const {name}_measured *measured"]
    if what == "enter":
        return [*params, *memory, f"const {name}_measured *measured", f"const {name}_reference *reference"]
    command = [f"{name}_command *command"] if what == "law" else []
    sample = [f"const {name}_measured *measured", f"const {name}_reference *reference", "real t", "real period"]
    return [*params, *memory, *sample, *command]


def parameters(exported: Exported) -> str:
    """The file of the parameters. Raises UserError for one that does not fit."""
    name = exported.name
    inner = [
        *part(".gains =", initialiser(exported.subject.gains, exported.precise, depth=2)),
        *part(".vehicle =", initialiser(exported.code.vehicle, exported.precise, depth=2)),
        f"    .most_age = {exported.most_age!r}{'' if exported.precise else 'f'},",
    ]
    return (
        "\n\n".join(
            [
                head(exported, "The mission's gains and vehicle."),
                f'#include "{name}.h"\n\n#include <math.h>',
                "\n".join([f"const {name}_params {name}_mission =", "{", *inner, "};"]),
            ]
        )
        + "\n"
    )


def part(start: str, lines: list[str]) -> list[str]:
    """A member that is a struct."""
    return [f"    {start}", "    {", *lines, "    },"] if lines else []
