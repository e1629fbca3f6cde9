"""Guards around an exported law: its behaviour for non-finite numbers, for old ones, and when it diverges."""

import re
from collections.abc import Sized
from typing import NamedTuple

from quadstep.export.c.header import Exported, loops, prototypes
from quadstep.export.c.law import begins, measured_part
from quadstep.export.c.structs import TEXTS, fields_of, has_numbers
from quadstep.interfaces.controller import Command
from quadstep.numbers import Structure, leaf_names

FEW = 40
"""Most numbers that are summed inline; more go through a function, with twice the instructions and a quarter of the code."""

SUM, LOOP = ((TEXTS / name).read_text("utf-8") for name in ("sum.c", "loop.c"))
"""Whether a few numbers are finite, and whether many are."""


class Run(NamedTuple):
    """Consecutive numbers of a struct. start: index among the struct's numbers. names: in C."""

    pointer: str
    start: int
    names: tuple[str, ...]

    def finite(self) -> str:
        """The expression that tests whether all of them are finite."""
        return f"qs_all_finite(&((const real *)(const void *){self.pointer})[{self.start}], {len(self.names)}u)"


def finite(exported: Exported) -> str:
    """The functions that test whether numbers are finite. A sum that overflows is refused too."""
    text = SUM + ("" if few(exported) else LOOP)
    return text.replace("MOST", "0x7FF0000000000000u" if exported.precise else "0x7F800000u").rstrip()


def guards(exported: Exported) -> list[str]:
    """The functions of the header around those of the law."""
    name, upper = exported.name, exported.name.upper()
    memory = "&state->memory, " if has_numbers(exported.code.memory) else ""
    lines = {what: line for what, line, _ in prototypes(exported)}

    def refuse(what: str) -> str:
        checks = finite_test(exported, what)
        not_finite = f"    else if (!({checks}))\n    {{\n        status |= {upper}_NOT_FINITE;\n    }}\n" if checks else ""
        return (
            f"    if (state->ready == 0u)\n    {{\n        status |= {upper}_NOT_STARTED;\n    }}\n"
            f"{not_finite}"
            f"    else if (!(clock->age <= params->most_age))\n    {{\n        status |= {upper}_STALE;\n    }}\n"
        )

    call = "params, {memory}measured, reference, ((real)clock->tick) * clock->step, clock->period".replace("{memory}", memory)
    made, finite_command = saturation_status(exported), all_finite(exported, commanded_quantities(exported))
    texts = {
        "reset": "    const {name}_command nothing = {0};\n    state->held = nothing;\n    state->ready = 0u;\n".replace(
            "{name}", name
        ),
        "start": (
            f"    uint32_t status = {upper}_OK;\n    {name}_reset(state);\n"
            f"    if ({finite_test(exported, 'start') or 'true'})\n    {{\n"
            f"        start_step(params, {memory}measured);\n        state->ready = 1u;\n    }}\n"
            f"    else\n    {{\n        status = {upper}_NOT_FINITE;\n    }}\n    return status;\n"
        ),
        "enter": enter_body(exported, memory),
        **{
            loop: f"    uint32_t status = {upper}_OK;\n{refuse(loop)}"
            f"    else\n    {{\n        {loop}_step({call});\n    }}\n    return status;\n"
            for loop in loops(exported)
        },
        "law": (
            f"    uint32_t status = {upper}_OK;\n{refuse('law')}    else\n    {{\n        law_step({call}, command);\n"
            f"        if (!({finite_command}))\n        {{\n            status |= {upper}_DIVERGED;\n"
            "            state->ready = 0u;\n        }\n    }\n"
            f"    if (status == {upper}_OK)\n    {{\n        state->held = *command;\n    }}\n"
            "    else\n    {\n        *command = state->held;\n    }\n    return status;\n"
        ),
        "made": f"    made_step(params, command, made);\n    return {made};\n",
    }
    return [f"{lines[what]}\n{{\n{texts[what]}}}" for what in lines]


def enter_body(exported: Exported, memory: str) -> str:
    """The body of enter(): of the law's own, or that of start(); the present command is held."""
    name, upper, own = exported.name, exported.name.upper(), "enter" in exported.code.functions
    step = f"enter_step(params, {memory}measured, reference)" if own else f"start_step(params, {memory}measured)"
    told, given = fields_of(measured_part(exported.subject.measured)), fields_of(exported.code.command)
    held = [
        f"        (void)memcpy(&state->held.{field}, &measured->{field}, sizeof state->held.{field});\n"
        for field in ("thrust", "torque")
        if field in told and field in given
    ]
    return (
        f"    uint32_t status = {upper}_OK;\n{'' if own else '    (void)reference;' + chr(10)}    {name}_reset(state);\n"
        f"    if ({finite_test(exported, 'enter' if own else 'start') or 'true'})\n    {{\n"
        f"        {step};\n{''.join(held)}        state->ready = 1u;\n    }}\n"
        f"    else\n    {{\n        status = {upper}_NOT_FINITE;\n    }}\n    return status;\n"
    )


def checked_numbers(exported: Exported, what: str) -> list[Run]:
    """The numbers that a function takes from its inputs."""
    told = (("measured", measured_part(exported.subject.measured)), ("reference", exported.subject.reference))
    return [run for pointer, value in told for run in runs(pointer, value, fields_read(exported, [what], pointer, value))]


def joined(exported: Exported, what: str) -> list[Run]:
    """The same in as few runs as possible, including numbers in between if another function of the law takes them."""
    found = []
    for pointer, value in (("measured", measured_part(exported.subject.measured)), ("reference", exported.subject.reference)):
        own, names = fields_read(exported, [what], pointer, value), list(fields_of(value))
        between = names[names.index(own[0]) : names.index(own[-1]) + 1] if own else []
        every = fields_read(exported, list(exported.code.reads), pointer, value)
        found += runs(pointer, value, [name for name in between if name in every])
    return found


def fields_read(exported: Exported, functions: list[str], pointer: str, value: Structure) -> list[str]:
    reads = [text for what in functions for text in exported.code.reads.get(what, ())]
    return [name for name in fields_of(value) if any(begins(text, f"{pointer}->{name}") for text in reads)]


def runs(pointer: str, structure: Structure, taken: list[str]) -> list[Run]:
    found: list[Run] = []
    place, names = 0, []
    for field, value in (*fields_of(structure).items(), ("", ())):
        leaves = [one.partition(".")[2] for one in leaf_names((value,))]
        if field in taken:
            names += [re.sub(r"\.(\d+)", r"[\1]", f"{pointer}->{field}.{leaf}".rstrip(".")) for leaf in leaves]
        elif names:
            found.append(Run(pointer, place - len(names), tuple(names)))
            names = []
        place += len(leaves)
    return found


def few(exported: Exported) -> bool:
    """Whether the numbers to test are few enough to be summed inline."""
    whole = [checked_numbers(exported, what) for what in ("start", *loops(exported), "law")]
    return sum(len(run.names) for run in (*(run for found in whole for run in found), *commanded_quantities(exported))) <= FEW


def finite_test(exported: Exported, what: str) -> str:
    """The test that a function's inputs are finite; empty if it takes none."""
    return all_finite(exported, checked_numbers(exported, what) if few(exported) else joined(exported, what))


def all_finite(exported: Exported, runs: list[Run]) -> str:
    """The test that these are finite; empty for none."""
    if few(exported):
        return f"qs_finite({' + '.join(name for run in runs for name in run.names)})" if runs else ""
    return " && ".join(run.finite() for run in runs)


ASKED = ("thrust", "torque", "rates", "thrusts", "speeds")
"""Fields of a command that must be finite; the rest is for the log."""


def commanded_quantities(exported: Exported) -> list[Run]:
    command = exported.code.command
    return runs("command", command, [name for name in fields_of(command) if name in ASKED or name not in Command._fields])


def saturation_status(exported: Exported) -> str:
    """The status of made()."""
    upper = exported.name.upper()
    wanted, given = fields_of(exported.code.command), fields_of(exported.code.made)
    pairs = []
    for field in wanted:
        if field in given and field in ASKED:
            entries = wanted[field]
            count = len(entries) if isinstance(entries, Sized) else 0
            places = [f"[{i}]" for i in range(count)] if count else [""]
            pairs += [
                f"(made->{field}{place} < command->{field}{place}) || (made->{field}{place} > command->{field}{place})"
                for place in places
            ]
    if not pairs:
        return f"{upper}_OK"
    return f"({' || '.join(pairs)}) ? {upper}_SATURATED : {upper}_OK"
