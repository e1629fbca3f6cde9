"""The source of an exported law, and its parameters."""

import re

from quadstep.export.c.functions import functions
from quadstep.export.c.guards import finite, guards
from quadstep.export.c.interface import Exported, head, title
from quadstep.export.c.structs import has_numbers, initialiser


def source(exported: Exported) -> str:
    """The source."""
    name, code = exported.name, exported.code
    raw = {what: f"static void {what}_step" for what in code.functions}
    parts = [
        head(exported, f"{title(exported)}: a control law in C99. Do not edit."),
        f'#include "{name}.h"\n\n#include <math.h>\n#include <stdbool.h>\n#include <stddef.h>\n#include <string.h>',
        PRAGMAS,
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


PRAGMAS = """/*
 * Bits: every operation must be rounded separately, in the order written. Compile with -ffp-contract=off and without
 * -ffast-math and its parts.
 */
#if defined(__FAST_MATH__)
#error "compile this file without -ffast-math"
#endif
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif"""


def step_arguments(exported: Exported, what: str) -> list[str]:
    """Parameters of the function that contains the law's own statements."""
    name = exported.name
    memory = [f"{name}_memory *memory"] if has_numbers(exported.code.memory) else []
    params = [f"const {name}_params *params"]
    if what == "made":
        return [*params, f"const {name}_command *command", f"{name}_actuators *made"]
    if what == "start":
        return [*params, *memory, f"const {name}_measured *measured"]
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
