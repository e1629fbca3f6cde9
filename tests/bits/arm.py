"""A sweep for ARM, run by QEMU: what LLVM writes for it, linked to a C program that reads and writes its buffers."""

import subprocess

import numpy as np
from llvmlite import binding as llvm

from quadstep.engines import kernel
from quadstep.engines.sweep_trace import SweepTrace

TRIPLE = "aarch64-linux-gnu"
COMPILER, EMULATOR = "aarch64-linux-gnu-gcc", "qemu-aarch64"

PROGRAM = """
#include <stdio.h>
#include <stdlib.h>
typedef {number} number;
void sweep(long first, long past, long count, long last, number step, long *every, number *constants, number *varying,
           number *tables, number *results);
static void *part(FILE *file, long *bytes) {{
    void *memory;
    if (fread(bytes, 8, 1, file) != 1 || posix_memalign(&memory, 64, *bytes + 64)) exit(1);
    if (fread(memory, 1, *bytes, file) != (size_t)*bytes) exit(1);
    return memory;
}}
int main(int count, char **names) {{
    FILE *file = fopen(names[1], "rb");
    long bytes, *head = part(file, &bytes);
    number *step = part(file, &bytes);
    long *every = part(file, &bytes);
    number *constants = part(file, &bytes), *varying = part(file, &bytes), *tables = part(file, &bytes);
    number *results = part(file, &bytes);
    sweep(0, head[0], head[0], head[1], *step, every, constants, varying, tables, results);
    return fwrite(results, 1, bytes, stdout) != (size_t)bytes;
}}
"""


def swept_on_arm(sweep, start, parameters, values, folder):
    """What `sweep.fly(values)` gives, flown by an emulated ARM processor."""
    width = 2 if sweep.double else 4
    trace = SweepTrace(sweep.loop, start, parameters, frozenset(sweep.varying), sweep.double, width)
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    target = llvm.Target.from_triple(TRIPLE).create_target_machine(opt=3, reloc="pic")
    trace.module.triple = TRIPLE
    llvm.set_option("", "-pre-RA-sched=source")  # LLVM's options are for all it writes; an ARM host never sets x86's
    try:
        (folder / "sweep.o").write_bytes(kernel.object_code(str(trace.module), target))
    finally:
        kernel.host.cache_clear()
        kernel.host()
    (folder / "main.c").write_text(PROGRAM.format(number="double" if sweep.double else "float"))
    program = folder / "sweep"
    files = [folder / "main.c", folder / "sweep.o"]
    subprocess.run([COMPILER, "-static", *files, "-o", program], check=True, capture_output=True)
    rows = sweep.rows(values)
    length = -(-len(rows) // width) * width
    results = np.zeros((sweep.row_count, length), dtype=sweep.number)
    parts = [
        np.array([length, sweep.ticks.last], dtype=np.int64), np.array([sweep.ticks.step], dtype=sweep.number),
        sweep.every, sweep.constants, sweep.columns(rows, length), sweep.tables, results,
    ]  # fmt: skip
    with (folder / "buffers").open("wb") as file:
        for part in parts:
            file.write(np.int64(part.nbytes).tobytes() + np.ascontiguousarray(part).tobytes())
    flown = subprocess.run([EMULATOR, program, folder / "buffers"], check=True, capture_output=True).stdout
    return sweep.swept(np.frombuffer(flown, dtype=sweep.number).reshape(results.shape)[:, : len(rows)])
