"""The files of an exported law: header, source, parameters."""

import re
from collections.abc import Mapping
from typing import NamedTuple

from quadstep.c99.functions import STEPS, functions
from quadstep.c99.law import Code, Subject, begins, measured_part
from quadstep.c99.structs import fields_of, has_numbers, initialiser, members
from quadstep.c99.words import (
    COMMAND_WORDS,
    MADE_WORDS,
    MEASURED_WORDS,
    PLANT_WORDS,
    REFERENCE_WORDS,
    VEHICLE_WORDS,
    from_table,
    of_gains,
)
from quadstep.control.controller import Measured
from quadstep.numbers import Structure, flatten

STATUS = (
    ("NOT_STARTED", "start() has not been called, or reset() has: the command is zero"),
    ("NOT_FINITE", "an input is NaN or infinite: the memory is as before, the command the last one"),
    ("STALE", "what was measured is older than params->most_age: the memory is as before, the command the last one"),
    ("DIVERGED", "the law gave NaN or infinity: the command is the last one; call start() before going on"),
    ("SATURATED", "the actuators make less than was asked for"),
)
"""Bits of the status that the functions return; 0: all is well."""


class Clocked(NamedTuple):
    """When samples are due. step [s]. every: steps from one sample to the next, of each loop and the law, by name. last: tick
    of the flight's end.
    """

    step: float
    every: Mapping[str, int]
    last: int

    def period(self, loop: str) -> float:
        """[s]."""
        return self.step * self.every[loop]


class Exported(NamedTuple):
    """A law and how it is to be called. name: begins every name. about: lines of its origin, for the head of each file.

    most_age: of a measurement [s].
    """

    subject: Subject
    code: Code
    name: str
    precise: bool
    clocked: Clocked
    about: tuple[str, ...] = ()
    most_age: float = 0.1


def title(exported: Exported) -> str:
    """What the law is called."""
    return exported.subject.controller.label or exported.name


def c_name(text: str) -> str:
    """A name of a controller as one of C."""
    name = re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_").lower()
    return name if name and not name[0].isdigit() else f"law_{name}"


def head(exported: Exported, what: str) -> str:
    """The comment at the head of a file."""
    lines = [what, *exported.about]
    return "\n".join(["/*", *(f" * {line}".rstrip() for line in lines), " */"])


def struct(name: str, lines: list[str], comment: str) -> str:
    """A struct of its own name."""
    return "\n".join([f"/** {comment} */", "typedef struct", "{", *lines, f"}} {name};"])


def header(exported: Exported) -> str:
    """The header."""
    name, code, subject = exported.name, exported.code, exported.subject
    guard = f"{name.upper()}_H"
    measured_words = MEASURED_WORDS if isinstance(subject.measured, Measured) else PLANT_WORDS
    gains = members(subject.gains, of_gains(subject.controller, subject.gains), depth=2)
    vehicle = members(code.vehicle, from_table(VEHICLE_WORDS), depth=2)
    parameters = [
        *(["    struct", "    {", *gains, "    } gains;"] if gains else []),
        *(["    struct", "    {", *vehicle, "    } vehicle;"] if vehicle else []),
        "    real most_age; /* s, of what was measured; older is refused */",
    ]
    memory = [f"    {name}_memory memory;"] if has_numbers(code.memory) else []
    state = [*memory, f"    {name}_command held; /* the last command */", "    uint32_t ready; /* 1 after start() */"]
    kind = "double" if exported.precise else "float"
    steps = [f"#define {name.upper()}_{word} {1 << place}u /* {said} */" for place, (word, said) in enumerate(STATUS)]
    parts = [
        head(exported, f"{subject.controller.label or name}: a control law in C99."),
        f"#ifndef {guard}\n#define {guard}",
        "#include <stdint.h>",
        '#ifdef __cplusplus\nextern "C" {\n#endif',
        f"#ifndef QS_REAL\n#define QS_REAL\ntypedef {kind} real;\n#endif",
        "/* What the functions return: 0, or a sum of these. */\n" + "\n".join([f"#define {name.upper()}_OK 0u", *steps]),
        struct(f"{name}_params", parameters, "Gains, and what is known of the vehicle. Constant during a flight."),
        struct(
            f"{name}_measured",
            members(measured_part(subject.measured), from_table(measured_words)),
            "What the law is told. SI units.",
        ),
        struct(f"{name}_reference", members(subject.reference, from_table(REFERENCE_WORDS)), "The wanted motion. SI units."),
        struct(f"{name}_command", members(code.command, from_table(COMMAND_WORDS)), "What the law asks for."),
        struct(
            f"{name}_actuators", members(code.made, from_table(MADE_WORDS)), "What the actuators are told, and what they make."
        ),
        *(
            [struct(f"{name}_memory", members(code.memory, lambda _: ""), "What the law keeps from sample to sample.")]
            if memory
            else []
        ),
        struct(
            f"{name}_state", state, "All that lives from sample to sample. The caller's; the functions have no other memory."
        ),
        CLOCK.replace("NAME", name),
        f"/** The gains and the vehicle of the mission. */\nextern const {name}_params {name}_mission;",
        "\n\n".join(f"{said}\n{line};" for _, line, said in prototypes(exported)),
        "#ifdef __cplusplus\n}\n#endif",
        "#endif",
    ]
    return "\n\n".join(parts) + "\n"


CLOCK = """/**
 * When a function is called. Time is tick * step: ticks are counted, so that it stays exact for hours.
 * tick: steps since start(). step [s]. period [s]: until the same function is called again.
 * age [s]: of what was measured.
 */
typedef struct
{
    uint32_t tick;
    real step;
    real period;
    real age;
} NAME_clock;"""


def prototypes(exported: Exported) -> list[tuple[str, str, str]]:
    """Each function: what it is, its line, and its comment."""
    name = exported.name
    given = f"const {name}_params *params, {name}_state *state, const {name}_measured *measured"
    sample = f"{given}, const {name}_reference *reference, const {name}_clock *clock"
    periods = {what: f"{exported.clocked.period(what):g}" for what in (*loops(exported), "law")}
    return [
        ("reset", f"void {name}_reset({name}_state *state)", "/** Forgets everything: law() gives zero until start(). */"),
        (
            "start",
            f"uint32_t {name}_start({given})",
            "/** Before the first sample, and after a pause: the memory at this motion. */",
        ),
        *(
            (
                loop,
                f"uint32_t {name}_{loop}({sample})",
                f"/** A slower loop, in the mission every {periods[loop]} s; where both are due, before law(). */",
            )
            for loop in loops(exported)
        ),
        (
            "law",
            f"uint32_t {name}_law({sample}, {name}_command *command)",
            f"/** One sample, in the mission every {periods['law']} s. The command is defined whatever is returned. */",
        ),
        (
            "made",
            f"uint32_t {name}_made(const {name}_params *params, const {name}_command *command, {name}_actuators *made)",
            "/** What the actuators are to be told, within their limits, and what they make: feed it back. */",
        ),
    ]


def loops(exported: Exported) -> tuple[str, ...]:
    """The law's slower loops."""
    return exported.subject.controller.loops()


def source(exported: Exported) -> str:
    """The source."""
    name, code = exported.name, exported.code
    used = frozenset(("bits", *(word for word in code.used if word in STEPS), *named(code.used)))
    raw = {what: f"static void {what}_step" for what in code.functions}
    parts = [
        head(exported, f"{title(exported)}: a control law in C99. Nothing here is to be edited."),
        f'#include "{name}.h"\n\n#include <math.h>\n#include <stdbool.h>\n#include <stddef.h>\n#include <string.h>',
        PRAGMAS,
        functions(used, exported.precise),
        finite(exported.precise),
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


def named(used: frozenset[str]) -> set[str]:
    """Steps by the operations that call them."""
    return {name for operation, name in OPERATIONS.items() if operation in used} | {one for one in used if one in CALLED}


OPERATIONS = {"magnitude": "abs", "sqrt": "sqrt", "==": "equal", "!=": "equal", "bit": "bits", "power": "power"}
CALLED = frozenset(("sin", "cos", "exp", "sigmoid", "log", "atan2"))

PRAGMAS = """/*
 * Bits: every operation is to be rounded by itself, in the order written. Compile with -ffp-contract=off and without
 * -ffast-math and its parts.
 */
#if defined(__FAST_MATH__)
#error "compile this file without -ffast-math"
#endif
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif"""


def finite(precise: bool) -> str:
    """Whether the numbers of a struct are all finite."""
    most = "0x7FF0000000000000u" if precise else "0x7F800000u"
    return (
        "/* Whether these numbers are all finite. */\n"
        "static bool qs_finite(const real *numbers, size_t count)\n{\n"
        "    bool all = true;\n"
        "    for (size_t i = 0u; i < count; ++i)\n    {\n"
        f"        if ((qs_bits(numbers[i]) & {most}) == {most})\n        {{\n"
        "            all = false;\n            break;\n        }\n    }\n    return all;\n}"
    )


def step_arguments(exported: Exported, what: str) -> list[str]:
    """Of the function that has the law's own statements."""
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


def guards(exported: Exported) -> list[str]:
    """The functions of the header around those of the law."""
    name, upper = exported.name, exported.name.upper()
    memory = "&state->memory, " if has_numbers(exported.code.memory) else ""
    lines = {what: line for what, line, _ in prototypes(exported)}

    def refuse(what: str) -> str:
        checks = " && ".join(spans(exported, what))
        not_finite = f"    else if (!({checks}))\n    {{\n        status |= {upper}_NOT_FINITE;\n    }}\n" if checks else ""
        return (
            f"    if (state->ready == 0u)\n    {{\n        status |= {upper}_NOT_STARTED;\n    }}\n"
            f"{not_finite}"
            f"    else if (!(clock->age <= params->most_age))\n    {{\n        status |= {upper}_STALE;\n    }}\n"
        )

    call = "params, {memory}measured, reference, ((real)clock->tick) * clock->step, clock->period".replace("{memory}", memory)
    made = saturated(exported)
    texts = {
        "reset": "    const {name}_command nothing = {0};\n    state->held = nothing;\n    state->ready = 0u;\n".replace(
            "{name}", name
        ),
        "start": (
            f"    uint32_t status = {upper}_OK;\n    {name}_reset(state);\n"
            f"    if ({' && '.join(spans(exported, 'start')) or 'true'})\n    {{\n"
            f"        start_step(params, {memory}measured);\n        state->ready = 1u;\n    }}\n"
            f"    else\n    {{\n        status = {upper}_NOT_FINITE;\n    }}\n    return status;\n"
        ),
        **{
            loop: (
                f"    uint32_t status = {upper}_OK;\n{refuse(loop)}"
                f"    else\n    {{\n        {loop}_step({call});\n    }}\n    return status;\n"
            )
            for loop in loops(exported)
        },
        "law": (
            f"    uint32_t status = {upper}_OK;\n{refuse('law')}    else\n    {{\n        law_step({call}, command);\n"
            f"        if ({asked_finite(exported)})\n        {{\n            state->held = *command;\n        }}\n"
            f"        else\n        {{\n            status |= {upper}_DIVERGED;\n"
            "            state->ready = 0u;\n        }\n    }\n"
            f"    if (status != {upper}_OK)\n    {{\n        *command = state->held;\n    }}\n    return status;\n"
        ),
        "made": f"    made_step(params, command, made);\n    return {made};\n",
    }
    return [f"{lines[what]}\n{{\n{texts[what]}}}" for what in lines]


def spans(exported: Exported, what: str) -> list[str]:
    """That every number is finite which a function takes from what it is told."""
    reads = exported.code.reads.get(what, ())
    texts = []
    for pointer, structure in (
        ("measured", measured_part(exported.subject.measured)),
        ("reference", exported.subject.reference),
    ):
        taken = [name for name in fields_of(structure) if any(begins(text, f"{pointer}->{name}") for text in reads)]
        texts += runs(pointer, structure, taken)
    return texts


def runs(pointer: str, structure: Structure, taken: list[str]) -> list[str]:
    """That these fields of a struct are finite, run by run."""
    texts = []
    place, start, count = 0, 0, 0
    for field, value in (*fields_of(structure).items(), ("", ())):
        size = len(flatten(value))
        if field in taken:
            start, count = (start, count + size) if count else (place, size)
        elif count:
            texts.append(f"qs_finite(&((const real *)(const void *){pointer})[{start}], {count}u)")
            count = 0
        place += size
    return texts


ASKED = ("thrust", "torque", "rates", "thrusts", "speeds")
"""What is never NaN in a command; the rest is for the log."""


def asked_finite(exported: Exported) -> str:
    """That what a command asks for is finite."""
    command = exported.code.command
    asked = [name for name in fields_of(command) if name in ASKED or name not in COMMAND_WORDS]
    return " && ".join(runs("command", command, asked))


def saturated(exported: Exported) -> str:
    """The status of made()."""
    upper = exported.name.upper()
    asked, given = fields_of(exported.code.command), fields_of(exported.code.made)
    pairs = []
    for field in asked:
        if field in given and field in ASKED:
            count = len(asked[field]) if hasattr(asked[field], "__len__") else 0
            places = [f"[{i}]" for i in range(count)] if count else [""]
            pairs += [
                f"(made->{field}{place} < command->{field}{place}) || (made->{field}{place} > command->{field}{place})"
                for place in places
            ]
    if not pairs:
        return f"{upper}_OK"
    return f"({' || '.join(pairs)}) ? {upper}_SATURATED : {upper}_OK"


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
