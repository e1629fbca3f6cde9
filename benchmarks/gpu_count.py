"""Instructions of one step, counted in the PTX, and how many steps a second a graphics processor could issue at best.

An estimate: the assembler loads many constants anew in the loop where PTX has them in registers (some 7 % more instructions
in the paper's loop), and no processor issues one in every cycle.
"""

import re
from typing import NamedTuple

from quadstep.engines.gpu_sweep import NEWEST, assembly
from quadstep.engines.scored import ScoredLoop
from quadstep.interfaces.closed_loop import Ticks

KINDS = {
    "multiply-add": r"fma",
    "multiply": r"mul\.(rn\.)?(ftz\.)?f",
    "add": r"(add|sub)\.(rn\.)?(ftz\.)?f",
    "special": r"rcp|sqrt|rsqrt|ex2|lg2|sin|cos|div",
    "choose": r"setp|selp|min|max|(and|or|xor|not)\.pred",
    "memory": r"(ld|st)\.(global|local|const)",
    "free": r"neg|abs|mov|cvta|bra|ret|ld\.param",
    "whole": r"",
}
"""How the name of an instruction begins, the first that fits; "whole" is what is left: whole numbers and conversions."""

WARP = 32

ISSUED, DOUBLES, SPECIALS = 4 * WARP, 64, 16
"""Of all threads of a processor (compute capability 9.0) in a cycle: instructions, f64 operations, special functions."""


STEPS_OF_SPECIAL = 8
"""Multiply-adds that a quotient or root takes in f64, about."""


class Chip(NamedTuple):
    """A graphics processor. clock: the highest [Hz]."""

    name: str
    processors: int
    clock: float


H200 = Chip("H200", 132, 1.98e9)


class Bound(NamedTuple):
    """What limits it and the steps a second it leaves."""

    limit: str
    steps: float


def counted(program: str, loop: ScoredLoop, ticks: Ticks, architecture: int = NEWEST) -> dict[str, float]:
    """Instructions by kind of one step of a `ptx.program`, those of a task spread over the steps between its runs."""
    weights = {task.name: 1.0 / every for task, every in zip(loop.tasks, ticks.every, strict=True)}
    counts: dict[str, float] = dict.fromkeys(KINDS, 0.0)
    share = 1.0
    *_, body = assembly(marked(program), architecture).split("// at head\n")  # the first copy of it is before the loop
    for line in body.partition("// at done\n")[0].splitlines():
        if mark := re.match(r"\s*// at (.*)", line):
            share = weights.get(mark.group(1).removesuffix(": someone flies"), 1.0)
        elif instruction := re.match(r"\s+(?:@!?%p\d+ )?([a-z]\w*[.\w]*)\s", line):
            counts[next(kind for kind, start in KINDS.items() if re.match(start, instruction.group(1)))] += share
    return counts


def marked(program: str) -> str:
    """The program with the name of every block in it, as a comment that comes through to the assembly."""

    def mark(label: re.Match[str]) -> str:
        return f'{label.group(0)}  call void asm sideeffect "// at {label.group(1)}", ""()\n'

    return re.sub(r'^"?([^"\n:]+(?:: someone flies)?)"?:\n', mark, program, flags=re.MULTILINE)


def bound(counts: dict[str, float], double: bool, chip: Chip) -> Bound:
    """What limits such a loop on a chip with every unit busy all the time."""
    issued = sum(counts[kind] for kind in KINDS if kind != "free")
    cycles = {"issue": issued / ISSUED, "special functions": counts["special"] / SPECIALS}
    if double:
        busy = sum(counts[kind] for kind in ("multiply-add", "multiply", "add", "choose"))
        cycles["f64"] = (busy + STEPS_OF_SPECIAL * counts["special"]) / DOUBLES
    limit = max(cycles, key=lambda name: cycles[name])
    return Bound(limit, chip.processors * chip.clock / cycles[limit])


def operations(counts: dict[str, float]) -> float:
    """Floating-point operations of one step, a multiply-add counting twice."""
    return 2.0 * counts["multiply-add"] + counts["multiply"] + counts["add"]
