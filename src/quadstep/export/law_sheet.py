"""The data sheet of an exported law: what it takes, how it was measured, where it is from; its deviations from MISRA C:2012
that cppcheck's addon finds, and why they are there.
"""

import re
import subprocess
import tempfile
import tomllib
from collections import Counter
from pathlib import Path
from typing import NamedTuple

from quadstep.export.arm import BITS, OnArm, state_size
from quadstep.export.c.header import STATUS, Exported, loops
from quadstep.io.errors import UserError
from quadstep.numbers import Table, flatten
from quadstep.report.publish import markdown_table

REASONS: dict[str, str] = tomllib.loads((Path(__file__).parent / "templates" / "misra.toml").read_text("utf-8"))
"""By rule. A rule that is not here is reported without a reason."""


LONGEST = 600
"""Seconds that the check may take."""

REMARK, STOP = re.compile(r"^ +/\* .* \*/$", re.M), 'asm("");'
"""A remark between statements, and what is written beside it for cppcheck, which stops following values there. Otherwise it
follows each to the end of its function: 4 min of the processor for `mpc` instead of 17 s. No rule here needs that.
"""


def deviations(folder: Path, files: list[str]) -> dict[str, int]:
    """How often each rule is deviated from, by rule. Raises UserError if the check does not end."""
    with tempfile.TemporaryDirectory() as place:
        for file in (*folder.glob("*.c"), *folder.glob("*.h")):
            text = REMARK.sub(rf"\g<0> {STOP}", file.read_text(encoding="utf-8"))
            (Path(place) / file.name).write_text(text, encoding="utf-8")
        line = ["cppcheck", "--addon=misra", "--std=c99", "--quiet", "--enable=style", "--inline-suppr", *files]
        try:
            run = subprocess.run(line, cwd=place, capture_output=True, text=True, check=False, timeout=LONGEST)
        except subprocess.TimeoutExpired:
            raise UserError(f"cppcheck did not finish in {LONGEST} s") from None
    found = Counter(re.findall(r"\[misra-c2012-(\d+\.\d+)\]", run.stderr))
    return dict(sorted(found.items(), key=lambda one: [int(part) for part in one[0].split(".")]))


CLOCKS = {"Cortex-M4F": (168e6, 0.7), "Cortex-M7": (216e6, 1.0)}
"""Clock [Hz] of usual flight computers, and instructions a cycle that their shares are reckoned with."""

LICENCE = (
    "The files that quadstep generates here are yours: its authors claim no rights in them, and its licence (MIT) does "
    "not extend to them. Code that you link them with may impose its own licence: the firmware of the Crazyflie and ArduPilot "
    "are under the GPL, version 3, PX4 is under the BSD licence."
)


class Facts(NamedTuple):
    """Where an export is from. mission: digest of its file; flight: of all its numbers and laws; gains: of these alone."""

    version: str
    name: str
    mission: str
    flight: str
    gains: str

    def lines(self) -> tuple[str, ...]:
        """For the head of each file."""
        name = self.name.encode("ascii", "backslashreplace").decode().replace("*/", "* /").replace("/*", "/ *")
        return (f"Written by quadstep {self.version} from the mission {name} ({self.mission}), gains {self.gains}.",)


class Measurements(NamedTuple):
    """What was measured. arm: by processor. misra: deviations by rule. apart: largest distance of the closed loop in f32 from
    that in f64 [m], over so many seconds. absent: what could not be measured, and why.
    """

    arm: dict[str, OnArm]
    misra: dict[str, int] | None
    apart: tuple[float, float] | None
    absent: tuple[str, ...]


NOTHING = Measurements({}, None, None, ("instructions, code and stack: export with --measure",))


def datasheet(exported: Exported, facts: Facts, measured: Measurements = NOTHING) -> str:
    parts = [
        f"# {exported.subject.controller.label or exported.name}: data sheet",
        origin(exported, facts),
        "## Resources",
        memory(exported),
        *processors(exported, measured),
        *([closed_loop(measured.apart)] if measured.apart else []),
        "## How it is called",
        calls(exported),
        "## What it guarantees",
        guarantees(),
        "## MISRA C:2012",
        misra(measured.misra),
        *(["## Not measured", "\n".join(f"- {one}" for one in measured.absent)] if measured.absent else []),
        "## Licence",
        LICENCE,
    ]
    return "\n\n".join(parts) + "\n"


def origin(exported: Exported, facts: Facts) -> str:
    kind = "f64 (double)" if exported.precise else "f32 (float)"
    rows = [
        ("law", f"`{exported.subject.controller.name or exported.name}`, {exported.subject.controller.source or 'the user'}"),
        ("numbers", kind),
        ("quadstep", facts.version),
        ("mission", f"{facts.name.replace('|', '/')}, SHA-256 {facts.mission}..."),
        ("flight (laws and all numbers)", facts.flight),
        ("gains", f"SHA-256 {facts.gains}..."),
    ]
    return markdown_table(("", ""), rows)


def memory(exported: Exported) -> str:
    """RAM and parameters, counted from the structs."""
    size = 8 if exported.precise else 4
    leaves = flatten((exported.subject.gains, exported.code.vehicle))
    numbers = sum(leaf.size if isinstance(leaf, Table) else 1 for leaf in leaves) + 1
    return (
        f"RAM: {state_size(exported)} bytes of state, owned by the caller; no globals, no heap. "
        f"Constant parameters: {size * numbers} bytes of flash."
    )


def processors(exported: Exported, measured: Measurements) -> list[str]:
    parts = []
    for processor, found in measured.arm.items():
        clock, pace = CLOCKS[processor]
        rows = [
            ("flash: code and constants", f"{found.sizes.code} bytes"),
            ("flash: parameters", f"{found.sizes.parameters} bytes"),
            ("deepest stack frame", f"{max(found.sizes.stack.values())} bytes"),
            ("compiler warnings", str(found.warnings)),
        ]
        if found.counted:
            rows += instructions(exported, found, clock, pace)
            rows.append(("golden vectors", "the same bits" if found.counted.same_bits else "DIFFERENT BITS"))
        parts.append(f"{processor}, arm-none-eabi-gcc -Os {' '.join(BITS)}:\n\n" + markdown_table(("", ""), rows))
    return parts


def instructions(exported: Exported, counts: OnArm, clock: float, pace: float) -> list[tuple[str, str]]:
    """Rows of the instructions of each function and their share of its period."""
    assert counts.counted
    clocked = exported.clocked
    periods = {"made": clocked.period("law"), **{name: clocked.period(name) for name in clocked.every}}
    rows = []
    for name, worst in counts.counted.worst.items():
        share = worst / pace / clock / periods[name]
        said = (
            f"{worst} at worst, {counts.counted.average[name]} on average; {100.0 * share:.2g} % of {1e3 * periods[name]:g} ms"
        )
        rows.append((f"instructions of {name}", f"{said} at {1e-6 * clock:g} MHz and {pace:g} a cycle"))
    due = sum(worst for name, worst in counts.counted.worst.items() if name != "made")
    rows.append(("all but made due at once", f"{due} instructions, {100.0 * due / pace / clock / 1e-3:.2g} % of 1 ms"))
    return rows


def closed_loop(apart: tuple[float, float]) -> str:
    """How far f32 leads."""
    distance, seconds = apart
    beside = f"at most {1e6 * distance:.3g} micrometres from the flight in f64"
    return f"In closed loop over {seconds:g} s, this code in f32 flies {beside}."


def calls(exported: Exported) -> str:
    name = exported.name
    given = f"&{name}_mission, &state, &measured, &reference, &clock"
    slower = "".join(f"    {name}_{loop}({given});     /* if due */\n" for loop in loops(exported))
    return (
        f"```c\n{name}_state state;\n{name}_reset(&state);\n"
        f"{name}_start(&{name}_mission, &state, &measured);  /* or, to take over in flight, {name}_enter() */\n"
        "for each sample\n{\n"
        f"{slower}"
        f"    status = {name}_law(&{name}_mission, &state, &measured, &reference, &clock, &command);\n"
        f"    {name}_made(&{name}_mission, &command, &made);\n"
        "    /* inputs of the next sample, if the law measures them */\n"
        "    measured.thrust = made.thrust; measured.torque = made.torque;\n}\n```"
    )


def guarantees() -> str:
    bits = "\n".join(f"- `{word}`: {said}" for word, said in STATUS)
    return (
        "The command is always defined. Status bits:\n\n"
        f"{bits}\n\nNo recursion, no I/O, no heap, no globals but the constant parameters; every loop has a constant number "
        "of turns, so time is bounded. The bits equal those of quadstep's flights if each operation is rounded separately: "
        f"compile with `{BITS[0]}` and without -ffast-math (the CMake file does; `test_*.c` checks it)."
    )


def misra(counts: dict[str, int] | None) -> str:
    if counts is None:
        return "Not checked: export with --measure where cppcheck is installed."
    if not counts:
        return "cppcheck's addon finds no deviation."
    rows = [(rule, str(count), REASONS.get(rule, "not judged yet")) for rule, count in counts.items()]
    return "Deviations that cppcheck's addon finds:\n\n" + markdown_table(("rule", "places", "why"), rows)
