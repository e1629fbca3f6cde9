"""What a law takes on Cortex-M4F and M7: sizes from the compiler, instructions counted exactly by QEMU.

QEMU runs each instruction in one tick of its clock (`-icount shift=0`), and SysTick counts 25 MHz of its 1 GHz: 40 instructions
a count. So a call is timed many times over and the counts are divided; the remainder is below one instruction.
"""

import re
import shutil
import subprocess
from pathlib import Path
from typing import NamedTuple

from quadstep.c99.compiler import compile_c
from quadstep.c99.source import Exported, guided
from quadstep.errors import UserError
from quadstep.numbers import flatten

COMPILER, MACHINE = "arm-none-eabi-gcc", "qemu-system-arm"

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


class Counted(NamedTuple):
    """Instructions of each function, on average and at worst over the golden samples, and whether the bits were the same."""

    average: dict[str, int]
    worst: dict[str, int]
    same_bits: bool


class OnArm(NamedTuple):
    """What was measured on one processor."""

    sizes: Sizes
    counted: Counted | None
    warnings: int


def missing() -> list[str]:
    """The programs that measuring needs and that are not here."""
    return [program for program in (COMPILER, MACHINE) if shutil.which(program) is None]


def measured(exported: Exported, folder: Path, work: Path) -> dict[str, OnArm]:
    """By processor. folder: with the exported files; work: a folder to build in. Raises UserError where a tool fails."""
    results = {}
    for processor, (flags, board) in PROCESSORS.items():
        build = work / re.sub(r"\W", "", processor)
        build.mkdir()
        for file in folder.iterdir():
            if file.suffix in (".c", ".h"):
                shutil.copy(file, build)
        results[processor] = one(exported, build, [*flags, *COMMON], board)
    return results


def one(exported: Exported, build: Path, flags: list[str], board: str) -> OnArm:
    """The measurements on one processor."""
    name = exported.name
    strict = ["-Wall", "-Wextra", "-Wconversion", "-Wfloat-equal", "-Wshadow", "-Wdouble-promotion"]
    told = compile_c(build, [*flags, *strict, "-fstack-usage", "-c", f"{name}.c", f"{name}_params.c"], [COMPILER])
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
        (build / "count.c").write_text(counting(exported), encoding="utf-8")
        (build / "startup.c").write_text(STARTUP, encoding="utf-8")
        (build / "memory.ld").write_text(LINKER, encoding="utf-8")
        objects = [f"{name}.o", f"{name}_params.o"]
        quiet = [*flags, "-nostartfiles", "--specs=nosys.specs", "-T", "memory.ld", "-w"]
        compile_c(build, [*quiet, "startup.c", "count.c", *objects, "-lm", "-o", "count.elf"], [COMPILER])
        counted = parsed(emulated(build / "count.elf", board))
    return OnArm(sizes, counted, told.count("warning:"))


def section(file: Path, names: str) -> int:
    """Bytes of an object's sections."""
    run = subprocess.run(["arm-none-eabi-size", "-A", file], capture_output=True, text=True, check=True, timeout=60)
    lines = (line.split() for line in run.stdout.splitlines())
    return sum(int(words[1]) for words in lines if len(words) > 1 and re.fullmatch(names, words[0]))


def state_size(exported: Exported) -> int:
    """Bytes of the state: the memory, the last command, whether it is ready."""
    return (8 if exported.precise else 4) * (len(flatten(exported.code.memory)) + len(flatten(exported.code.command))) + 4


def emulated(program: Path, board: str) -> str:
    """What a program says on QEMU. Raises UserError where it does not end."""
    line = [
        MACHINE, "-M", board, "-icount", "shift=0", "-display", "none", "-monitor", "none", "-serial", "none",
        "-semihosting-config", "enable=on,target=native", "-kernel", str(program),
    ]  # fmt: skip
    try:
        run = subprocess.run(line, capture_output=True, text=True, check=False, timeout=60)
    except subprocess.TimeoutExpired:
        raise UserError(f"{MACHINE} did not finish in 60 s") from None
    return run.stdout + run.stderr


def parsed(said: str) -> Counted:
    """The counts that the program printed."""
    words = dict(re.findall(r"^(\w+) (-?\d+)$", said, re.M))
    if "differences" not in words:
        raise UserError(f"{MACHINE} gave no counts: {said or 'nothing'}")
    names = sorted({name.split("_")[0] for name in words if "_" in name})
    average = {name: int(words[f"{name}_average"]) for name in names}
    return Counted(average, {name: int(words[f"{name}_worst"]) for name in names}, words["differences"] == "0")


def counting(exported: Exported) -> str:
    """The program that counts: every golden sample, each function many times on the same memory."""
    name = exported.name
    calls = {
        "law": f"{name}_law(&{name}_mission, &work, &measured, &reference, &clock, &command)",
        "made": f"{name}_made(&{name}_mission, &command, &made)",
    }
    if guided(exported):
        calls = {"guide": f"{name}_guide(&{name}_mission, &work, &measured, &reference, &clock)", **calls}
    numbers = {what: place for place, what in enumerate(calls)}
    body = []
    for what, call in calls.items():
        period = "golden_guide_period" if what == "guide" else "golden_law_period"
        body += [
            f"        clock.period = {period};",
            f"        work = state; reading = SYST[2]; for (int k = 0; k < REPEATS; ++k) {{ work = state; (void){call}; }}",
            "        with = (reading - SYST[2]) & 0xFFFFFFu;",
            "        reading = SYST[2]; for (int k = 0; k < REPEATS; ++k) { spare = state; __asm volatile(\"\" ::: \"memory\"); }",
            f"        note({numbers[what]}, with - ((reading - SYST[2]) & 0xFFFFFFu));",
        ]
        if what != "made":
            body.append("        state = work;")
    prints = [
        f'    say("{what}_{kind}", {expression.format(place)});'
        for what, place in numbers.items()
        for kind, expression in (("average", "total[{}] / GOLDEN_SAMPLES"), ("worst", "worst[{}]"))
    ]
    text = COUNT.replace("NAME", name).replace("BODY", "\n".join(body)).replace("PRINTS", "\n".join(prints))
    memory = "differences += differing(&state.memory, golden_memory[0], sizeof golden_memory[0]);"
    return text.replace("MEMORY", memory if hasattr(exported.code.memory, "_fields") and exported.code.memory else "")  # type: ignore[truthy-bool]


STARTUP = """#include <stdint.h>
extern uint32_t __stack, __bss_start, __bss_end;
int main(void);
static void leave(void)
{
    register int r0 __asm("r0") = 0x18; register int r1 __asm("r1") = 0x20026;
    __asm volatile("bkpt 0xAB" :: "r"(r0), "r"(r1) : "memory");
    for (;;) {}
}
void Reset(void)
{
    *(volatile uint32_t *)0xE000ED88 |= 0xF00000;
    __asm volatile("dsb\\nisb");
    for (uint32_t *p = &__bss_start; p < &__bss_end; ++p) *p = 0;
    main();
    leave();
}
void Fault(void) { leave(); }
__attribute__((section(".vectors"), used)) const void *const vectors[16] = {&__stack, Reset, Fault, Fault, Fault, Fault, Fault};
"""

LINKER = """MEMORY { FLASH (rx) : ORIGIN = 0, LENGTH = 4M  RAM (rwx) : ORIGIN = 0x20000000, LENGTH = 4M }
ENTRY(Reset)
SECTIONS {
  .text : { KEEP(*(.vectors)) *(.text*) *(.rodata*) . = ALIGN(4); } > FLASH
  .ARM.exidx : { *(.ARM.exidx*) } > FLASH
  .data : { *(.data*) } > RAM AT > FLASH
  .bss : { __bss_start = .; *(.bss*) *(COMMON) . = ALIGN(4); __bss_end = .; end = .; } > RAM
  __stack = ORIGIN(RAM) + 1M;
}
"""

COUNT = """#include "NAME.h"
#include <string.h>
#include "NAME_golden.h"
#define SYST ((volatile uint32_t *)0xE000E010)
#define REPEATS 40
static NAME_state state, work, spare;
static NAME_measured measured;
static NAME_reference reference;
static NAME_command command;
static NAME_actuators made;
static uint32_t total[3], worst[3];
static void put(const char *text)
{
    register int r0 __asm("r0") = 4; register const char *r1 __asm("r1") = text;
    __asm volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
}
static void say(const char *what, uint32_t value)
{
    char text[16]; int i = 15; text[i] = 0;
    do { text[--i] = (char)('0' + value % 10u); value /= 10u; } while (value);
    put(what); put(" "); put(&text[i]); put("\\n");
}
static void note(int which, uint32_t counts)
{
    const uint32_t instructions = counts * 40u / REPEATS;
    total[which] += instructions;
    if (instructions > worst[which]) worst[which] = instructions;
}
static uint32_t differing(const void *found, const real *wanted, unsigned size)
{
    uint32_t different = 0;
    for (unsigned i = 0; i < size / sizeof(real); ++i)
    {
        real a; memcpy(&a, (const char *)found + i * sizeof(real), sizeof a);
        different += memcmp(&a, &wanted[i], sizeof a) != 0 && !(a == 0 && wanted[i] == 0);
    }
    return different;
}
int main(void)
{
    SYST[1] = 0xFFFFFF; SYST[2] = 0; SYST[0] = 5;
    uint32_t differences = 0, reading, with;
    NAME_clock clock = {0};
    clock.step = golden_step;
    memcpy(&measured, golden_start[0], sizeof measured);
    (void)NAME_start(&NAME_mission, &state, &measured);
    for (int i = 0; i < GOLDEN_SAMPLES; ++i)
    {
        memcpy(&measured, golden_measured[i], sizeof measured);
        memcpy(&reference, golden_reference[i], sizeof reference);
        clock.tick = golden_tick[i];
BODY
        differences += differing(&command, golden_command[i], sizeof golden_command[i]);
        differences += differing(&made, golden_made[i], sizeof golden_made[i]);
    }
    MEMORY
PRINTS
    say("differences", differences);
    return 0;
}
"""
