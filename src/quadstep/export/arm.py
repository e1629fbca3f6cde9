"""What C compilers make of a law: that of this machine; and on Cortex-M4F and M7 its size, and instructions counted by QEMU.

QEMU runs each instruction in one tick of its clock (`-icount shift=0`), and SysTick counts 25 MHz of its 1 GHz, so every 40
instructions. A call is therefore timed many times over and the counts are divided; the remainder is below one instruction.
"""

import os
import re
import shlex
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from quadstep.export.c.header import Exported, loops
from quadstep.export.c.structs import filled, has_numbers
from quadstep.io.errors import ToolError, UserError
from quadstep.numbers import flatten

BITS = ("-ffp-contract=off", "-fno-math-errno")
"""Flags that preserve the bits, and one that allows a square root as one instruction."""

WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-Wfloat-equal", "-Wshadow")

LONGEST = 120.0
"""Seconds that a compiler may take."""


def compiler() -> list[str]:
    """The command of the compiler: `CC`, or cc, gcc or clang. Raises UserError if there is none."""
    said = shlex.split(os.environ.get("CC", ""))
    if said:
        if shutil.which(said[0]) is None:
            raise UserError(f"the C compiler {said[0]} named by CC is not on the path")
        return said
    for name in ("cc", "gcc", "clang"):
        if shutil.which(name):
            return [name]
    raise UserError("no C compiler found: cc, gcc and clang are not on the path; install one (Debian: gcc), or set CC")


def compile_c(folder: Path, arguments: list[str], command: list[str] | None = None) -> str:
    """Run the compiler in a folder and return its warnings. Raises UserError with its first line if it fails."""
    line = [*(command or compiler()), "-std=c99", *BITS, *arguments]
    try:
        run = subprocess.run(line, cwd=folder, capture_output=True, text=True, check=False, timeout=LONGEST)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise UserError(f"the C compiler {line[0]} did not finish: {error}") from None
    said = next((text for text in run.stderr.splitlines() if "error" in text), run.stderr)
    if run.returncode:
        why = f"rejected the law: {said}" if said.strip() else f"ended with exit code {run.returncode} and no message"
        raise UserError(f"the C compiler {line[0]} {why}")
    if "-o" in arguments and not (folder / arguments[arguments.index("-o") + 1]).exists():
        raise UserError(f"the C compiler {line[0]} wrote nothing: is it a C compiler?")
    return run.stderr


TEMPLATES = Path(__file__).parent / "templates"

COMPILER, SIZE, MACHINE = "arm-none-eabi-gcc", "arm-none-eabi-size", "qemu-system-arm"

PROCESSORS = {
    "Cortex-M4F": (("-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16"), "mps2-an386"),
    "Cortex-M7": (("-mcpu=cortex-m7", "-mfpu=fpv5-sp-d16"), "mps2-an500"),
}
"""Flags of the compiler, and QEMU's board."""

COMMON = ("-mthumb", "-mfloat-abi=hard", "-Os", "-ffunction-sections", "-fdata-sections")


class Sizes(NamedTuple):
    """Bytes. code: of the functions and their constants; parameters: in flash; state: in RAM; stack: by function."""

    code: int
    parameters: int
    state: int
    stack: dict[str, int]


class InstructionCounts(NamedTuple):
    """Instructions of each function, on average and at worst over the golden samples, and whether the bits were the same."""

    average: dict[str, int]
    worst: dict[str, int]
    same_bits: bool


class OnArm(NamedTuple):
    """What was measured on one processor."""

    sizes: Sizes
    counted: InstructionCounts | None
    warnings: int


def missing_programs() -> list[str]:
    """The programs that measuring needs and that are not here."""
    return [program for program in (COMPILER, SIZE, MACHINE) if shutil.which(program) is None]


def instruction_counts(
    exported: Exported, folder: Path, work: Path, processors: Sequence[str] = tuple(PROCESSORS)
) -> dict[str, OnArm]:
    """By processor. folder: with the exported files; work: a folder to build in. Raises ToolError."""
    results = {}
    for processor in processors:
        flags, board = PROCESSORS[processor]
        build = work / re.sub(r"\W", "", processor)
        build.mkdir()
        for file in folder.iterdir():
            if file.suffix in (".c", ".h"):
                shutil.copy(file, build)
        try:
            results[processor] = one(exported, build, [*flags, *COMMON], board)
        except UserError as error:
            raise ToolError(str(error)) from None
    return results


def one(exported: Exported, build: Path, flags: list[str], board: str) -> OnArm:
    name = exported.name
    told = compile_c(build, [*flags, *WARNINGS, "-fstack-usage", "-c", f"{name}.c", f"{name}_params.c"], [COMPILER])
    sizes = Sizes(
        code=section(build / f"{name}.o", r"\.(text|rodata)\S*"),
        parameters=section(build / f"{name}_params.o", r"\.rodata\S*"),
        state=state_size(exported),
        stack={
            line.split("\t")[0].split(":")[-1]: int(line.split("\t")[1])
            for line in (build / f"{name}.su").read_text(encoding="utf-8").splitlines()
        },
    )
    counted = None
    if shutil.which(MACHINE):
        (build / "count.c").write_text(counting_program(exported), encoding="utf-8")
        shutil.copy(TEMPLATES / "startup.c", build)
        shutil.copy(TEMPLATES / "memory.ld", build)
        objects = [f"{name}.o", f"{name}_params.o"]
        quiet = [*flags, "-nostartfiles", "--specs=nosys.specs", "-T", "memory.ld", "-w"]
        compile_c(build, [*quiet, "startup.c", "count.c", *objects, "-lm", "-o", "count.elf"], [COMPILER])
        counted = parsed(emulated(build / "count.elf", board))
    return OnArm(sizes, counted, told.count("warning:"))


def section(file: Path, names: str) -> int:
    """Bytes of an object's sections. Raises ToolError."""
    try:
        run = subprocess.run([SIZE, "-A", file], capture_output=True, text=True, check=True, timeout=60)
    except (OSError, subprocess.SubprocessError) as error:
        raise ToolError(f"{SIZE} failed: {getattr(error, 'stderr', '') or error}") from None
    lines = (line.split() for line in run.stdout.splitlines())
    return sum(int(words[1]) for words in lines if len(words) > 1 and re.fullmatch(names, words[0]))


def state_size(exported: Exported) -> int:
    """Bytes of the state: the memory, the last command, whether it is ready."""
    return (8 if exported.precise else 4) * (len(flatten(exported.code.memory)) + len(flatten(exported.code.command))) + 4


def emulated(program: Path, board: str) -> str:
    """What a program says on QEMU. Raises ToolError where it does not end."""
    line = [
        MACHINE, "-M", board, "-icount", "shift=0", "-display", "none", "-monitor", "none", "-serial", "none",
        "-semihosting-config", "enable=on,target=native", "-kernel", str(program),
    ]  # fmt: skip
    try:
        run = subprocess.run(line, capture_output=True, text=True, check=False, timeout=60)
    except subprocess.TimeoutExpired:
        raise ToolError(f"{MACHINE} did not finish in 60 s") from None
    except OSError as error:
        raise ToolError(f"{MACHINE} failed: {error}") from None
    return run.stdout + run.stderr


def parsed(said: str) -> InstructionCounts:
    """The counts that the program printed. Raises ToolError where it printed none."""
    words = dict(re.findall(r"^(\w+) (-?\d+)$", said, re.M))
    if "differences" not in words:
        raise ToolError(f"{MACHINE} gave no counts: {said or 'nothing'}")
    names = sorted({name.removesuffix("_worst") for name in words if name.endswith("_worst")})
    average = {name: int(words[f"{name}_average"]) for name in names}
    return InstructionCounts(average, {name: int(words[f"{name}_worst"]) for name in names}, words["differences"] == "0")


def counting_program(exported: Exported) -> str:
    """The program that counts: every golden sample, each function many times on the same memory."""
    name = exported.name
    calls = {
        "law": f"{name}_law(&{name}_mission, &work, &measured, &reference, &clock, &command)",
        "made": f"{name}_made(&{name}_mission, &command, &made)",
    }
    given = f"&{name}_mission, &work, &measured, &reference, &clock"
    calls = {**{loop: f"{name}_{loop}({given})" for loop in loops(exported)}, **calls}
    numbers = {what: place for place, what in enumerate(calls)}
    body = []
    for what, call in calls.items():
        period = f"golden_{'law' if what == 'made' else what}_period"
        body += [
            f"        clock.period = {period};",
            f"        work = state; reading = SYST[2]; for (int k = 0; k < REPEATS; ++k) {{ work = state; (void){call}; }}",
            "        with = (reading - SYST[2]) & 0xFFFFFFu;",
            '        reading = SYST[2]; for (int k = 0; k < REPEATS; ++k) { spare = state; __asm volatile("" ::: "memory"); }',
            f"        note({numbers[what]}, with - ((reading - SYST[2]) & 0xFFFFFFu));",
        ]
        if what != "made":
            body.append("        state = work;")
    prints = [
        f'    say("{what}_{kind}", {expression.format(place)});'
        for what, place in numbers.items()
        for kind, expression in (("average", "total[{}] / GOLDEN_SAMPLES"), ("worst", "worst[{}]"))
    ]
    memory = "differences += differing(&state.memory, golden_memory[0], sizeof golden_memory[0]);"
    words = {
        "NAME": name,
        "BODY": "\n".join(body),
        "PRINTS": "\n".join(prints),
        "MEMORY": memory if has_numbers(exported.code.memory) else "",
    }
    return filled(TEMPLATES / "count.c", words)
