"""Exported laws, built and run for the tests."""

import ctypes
import shutil
import subprocess
from pathlib import Path

import numpy as np

from quadstep import Mission
from quadstep.export.arm import BITS, WARNINGS
from quadstep.export.c.branches import ScanRecord
from quadstep.export.c.compiled import exported
from quadstep.export.c.expressions import Naming
from quadstep.export.c.source import STEPS, functions
from quadstep.export.c.structs import StoredStructures, StructOutput
from quadstep.export.c.writing import CWriter
from quadstep.export.run import c99_files
from quadstep.numbers.operation import OPERATIONS
from tests.patience import PATIENCE

CIRCLE = {"type": "circle", "centre": [0.0, 0.0, 3.0], "radius": 1.0, "period": 4.0, "turns": 2.0}
LINE = {"type": "minimum-jerk", "end": [1.0, 0.5, 2.0], "duration": 6.0}
COMPILERS = [name for name in ("gcc", "clang") if shutil.which(name)]


def real_mission(controller, vehicle="crazyflie", **more):
    return Mission(vehicle={"preset": vehicle}, path=CIRCLE, controller=controller, **more)


def plane_mission(controller, **more):
    return Mission(vehicle={"type": "planar"}, path=LINE, controller=controller, **more)


def paper_mission(controller, **more):
    return Mission(path=LINE, controller=controller, **more)


def written(folder, plan, precise, logged=False):
    """The files of an export in a folder; gives the export."""
    law = exported(plan, precise, logged=logged)
    for name, text in c99_files(law, plan).items():
        (folder / name).write_text(text, encoding="utf-8")
    return law


def run_compiled(folder, name, compiler, *flags):
    """What the exported test says, compiled so; its exit code; the compiler's warnings."""
    sources = [f"{name}.c", f"{name}_params.c", f"test_{name}.c"]
    program = folder / "test"
    line = [compiler, "-std=c99", "-pedantic", *BITS, *WARNINGS, *flags, "-I.", *sources, "-lm", "-o", program]
    built = subprocess.run(line, cwd=folder, capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr
    run = subprocess.run([program], capture_output=True, text=True, check=False, timeout=PATIENCE)
    return run.stdout, run.returncode, built.stderr


def example(name):
    return Path(__file__).parent.parent / "examples" / name


def through_c(folder, law, *columns):
    """What the law gives as compiled C, an array of shape (results, samples)."""
    record = ScanRecord()
    results = law(*(record.input(f"in[{i}]") for i in range(len(columns))))
    wanted = StoredStructures([StructOutput(f"out[{i}]", record.at(result)) for i, result in enumerate(results)], [])
    body = CWriter(record, True, Naming({}, {}), frozenset(("in", "out", "i", "j", "k"))).body(wanted)
    parts = [
        "#include <math.h>\n#include <stdbool.h>\n#include <stdint.h>\n#include <string.h>\ntypedef double real;",
        functions((*STEPS, *OPERATIONS), True),
        "void law(const real *in, real *out)\n{\n" + "\n".join(body) + "\n}\n",
    ]
    (folder / "law.c").write_text("\n".join(parts), encoding="utf-8")
    line = [COMPILERS[0], "-std=c99", *BITS, "-O1", "-fPIC", "-shared", "-o", "law.so", "law.c", "-lm"]
    subprocess.run(line, cwd=folder, check=True, capture_output=True)
    code = ctypes.CDLL(str(folder / "law.so"))
    samples = np.array(np.broadcast_arrays(*columns), dtype=float).T
    out = (ctypes.c_double * len(results))()
    given = []
    for sample in samples.tolist():
        code.law((ctypes.c_double * len(columns))(*sample), out)
        given.append(list(out))
    return np.array(given).T
