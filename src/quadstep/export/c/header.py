"""The interface of an exported law: its inputs and outputs, its functions, its header."""

import re
from collections.abc import Mapping
from typing import NamedTuple

from quadstep.export.c.comments import MEASURED_WORDS, WORDS, of_gains, of_structure
from quadstep.export.c.law import Code, Subject, measured_part
from quadstep.export.c.structs import TEXTS, filled, has_numbers, members

STATUS = (
    ("NOT_STARTED", "start() must be called: the command is zero, or after DIVERGED the last one"),
    ("NOT_FINITE", "an input is NaN or infinite: memory unchanged, last command repeated"),
    ("STALE", "the measurements are older than params->most_age: memory unchanged, last command repeated"),
    ("DIVERGED", "the law returned NaN or infinity: last command repeated; call start() before continuing"),
    ("SATURATED", "the actuators cannot produce the command"),
)
"""Bits of the status that the functions return; 0: no error."""


class SampleClock(NamedTuple):
    """When samples are due. step [s]. every: steps from one sample to the next, for each loop and the law, by name. last: tick
    of the flight's end.
    """

    step: float
    every: Mapping[str, int]
    last: int

    def period(self, loop: str) -> float:
        """[s]."""
        return self.step * self.every[loop]


class Exported(NamedTuple):
    """A law and how it is to be named. name: prefix of every name. about: lines on its origin, for the head of each file.

    most_age: of a measurement [s].
    """

    subject: Subject
    code: Code
    name: str
    precise: bool
    clocked: SampleClock
    about: tuple[str, ...] = ()
    most_age: float = 0.1


def title(exported: Exported) -> str:
    return exported.subject.controller.label or exported.name


def c_name(text: str) -> str:
    """A controller's name as a C identifier."""
    name = re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_").lower()
    return name if name and not name[0].isdigit() else f"law_{name}"


def head(exported: Exported, what: str) -> str:
    lines = [what, *exported.about]
    return "\n".join(["/*", *(f" * {line}".rstrip() for line in lines), " */"])


def struct(name: str, lines: list[str], comment: str) -> str:
    return "\n".join([f"/** {comment} */", "typedef struct", "{", *lines, f"}} {name};"])


def header(exported: Exported) -> str:
    name, code, subject = exported.name, exported.code, exported.subject
    guard = f"{name.upper()}_H"
    gains = members(subject.gains, of_gains(subject.controller, subject.gains), depth=2)
    vehicle = members(code.vehicle, of_structure(subject.parameters, WORDS), depth=2)
    parameters = [
        *(["    struct", "    {", *gains, "    } gains; /* of the law */"] if gains else []),
        *(["    struct", "    {", *vehicle, "    } vehicle; /* whose actuators made() computes */"] if vehicle else []),
        "    real most_age; /* s, of the measurements; older ones are rejected */",
    ]
    memory = [f"    {name}_memory memory; /* of the law */"] if has_numbers(code.memory) else []
    state = [*memory, f"    {name}_command held; /* the last command */", "    uint32_t ready; /* 1 after start() */"]
    kind = "double" if exported.precise else "float"
    steps = [f"#define {name.upper()}_{word} {1 << place}u /* {said} */" for place, (word, said) in enumerate(STATUS)]
    contents = [
        (
            "measured",
            measured_part(subject.measured),
            of_structure(subject.measured, MEASURED_WORDS),
            "The measurements. SI units.",
        ),
        ("reference", subject.reference, of_structure(subject.reference, {}), "The reference motion. SI units."),
        ("command", code.command, of_structure(code.asked, {}), "The command."),
        ("actuators", code.made, of_structure(code.made, WORDS), "Actuator commands, and what they produce."),
        ("memory", code.memory, of_structure(code.memory, {}), "Memory of the law from sample to sample."),
    ]
    parts = [
        head(exported, f"{subject.controller.label or name}: a control law in C99."),
        f"#ifndef {guard}\n#define {guard}",
        "#include <stdint.h>",
        '#ifdef __cplusplus\nextern "C" {\n#endif',
        f"#ifndef QS_REAL\n#define QS_REAL\ntypedef {kind} real;\n#endif",
        "/* What the functions return: 0, or a sum of these. */\n" + "\n".join([f"#define {name.upper()}_OK 0u", *steps]),
        struct(f"{name}_params", parameters, "Gains and vehicle parameters. Constant during a flight."),
        *(
            struct(f"{name}_{what}", members(one, words), said)
            for what, one, words, said in contents
            if what != "memory" or memory
        ),
        struct(f"{name}_state", state, "All state between samples. Owned by the caller; the functions have no other memory."),
        filled(TEXTS / "clock.h", {"NAME": name}).strip(),
        f"/** The gains and the vehicle of the mission. */\nextern const {name}_params {name}_mission;",
        "\n\n".join(f"{said}\n{line};" for _, line, said in prototypes(exported)),
        "#ifdef __cplusplus\n}\n#endif",
        "#endif",
    ]
    return "\n\n".join(parts) + "\n"


def prototypes(exported: Exported) -> list[tuple[str, str, str]]:
    """Each function: what it is, its line, and its comment."""
    name = exported.name
    given = f"const {name}_params *params, {name}_state *state, const {name}_measured *measured"
    sample = f"{given}, const {name}_reference *reference, const {name}_clock *clock"
    periods = {what: f"{exported.clocked.period(what):g}" for what in (*loops(exported), "law")}
    return [
        ("reset", f"void {name}_reset({name}_state *state)", "/** Clears everything: law() returns zero until start(). */"),
        (
            "start",
            f"uint32_t {name}_start({given})",
            "/** Call before the first sample and after a pause: sets the memory for this motion. */",
        ),
        (
            "enter",
            f"uint32_t {name}_enter({given}, const {name}_reference *reference)",
            "/** Instead of start(), to take over in flight: give as thrust and torque in measured what the other controller\n"
            " * commands now, and as reference the present motion. The law continues from that command. */",
        ),
        *(
            (
                loop,
                f"uint32_t {name}_{loop}({sample})",
                f"/** A slower loop, in the mission every {periods[loop]} s; if both are due, before law(). */",
            )
            for loop in loops(exported)
        ),
        (
            "law",
            f"uint32_t {name}_law({sample}, {name}_command *command)",
            f"/** One sample, in the mission every {periods['law']} s. The command is defined whatever the status. */",
        ),
        (
            "made",
            f"uint32_t {name}_made(const {name}_params *params, const {name}_command *command, {name}_actuators *made)",
            "/** Actuator commands within their limits, and what these produce: feed it back. */",
        ),
    ]


def loops(exported: Exported) -> tuple[str, ...]:
    return exported.subject.controller.loops()
