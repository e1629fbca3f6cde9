"""Exported laws as the tests make and run them."""

import shutil
import subprocess
from pathlib import Path

from quadstep import Mission
from quadstep.c99.compiler import BITS, WARNINGS
from quadstep.c99.subject import exported
from quadstep.export.c99 import c99_files

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
    run = subprocess.run([program], capture_output=True, text=True, check=False, timeout=60)
    return run.stdout, run.returncode, built.stderr


def example(name):
    return Path(__file__).parent.parent / "examples" / name
