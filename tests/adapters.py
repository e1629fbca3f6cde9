"""Firmware adapters, written, compiled and run for the tests, against headers of our own or in a firmware's tree."""

import subprocess
from pathlib import Path

import numpy as np

from quadstep.export.arm import BITS
from quadstep.export.c.compiled import exported
from quadstep.export.firmware import firmware_files
from quadstep.export.run import c99_files
from tests.exports import real_mission
from tests.patience import PATIENCE
from tests.quick_gains import QUICK

STUBS = Path(__file__).parent / "firmware"


def adapter(folder, target, kind="pid", vehicle="crazyflie"):
    """The files of a target in a folder, of a loop so quick that it saturates: a Crazyflie's defaults are; gives the law's
    name and plan.
    """
    quick = {} if vehicle == "crazyflie" else QUICK.get(kind, {})
    plan = real_mission({"type": kind, **quick}, vehicle).plan()
    law = exported(plan, False)
    for name, text in firmware_files(target, law, c99_files(law, plan)).items():
        (folder / name).write_text(text, encoding="utf-8")
    return law.name, plan


def flown(folder, target, name, program, *units, level="-O1"):
    """What a program prints that flies the adapter."""
    driver = STUBS / target / program
    if not (folder / program).exists():
        (folder / program).write_text(driver.read_text(encoding="utf-8").replace("NAME", name), encoding="utf-8")
    strict = ["-Wall", "-Wextra", "-Werror", "-Wno-unused-const-variable", "-I.", f"-I{STUBS / target}"]
    objects = []
    for unit in (program, *units, f"{name}.c", f"{name}_params.c"):
        objects.append(f"{unit}.o")
        compiled = folder / f"{unit}.o"
        if compiled.exists() and compiled.stat().st_mtime > (folder / unit).stat().st_mtime:
            continue
        plus = unit.endswith(".cpp")
        language = ("g++", "-std=c++17") if plus else ("gcc", "-std=gnu11")
        line = [*language, level, *BITS, *strict, "-c", unit, "-o", f"{unit}.o"]
        built = subprocess.run(line, cwd=folder, capture_output=True, text=True, check=False)
        assert built.returncode == 0, built.stderr
    subprocess.run(["g++", *objects, "-lm", "-o", "fly"], cwd=folder, check=True)
    return subprocess.run([folder / "fly"], capture_output=True, text=True, check=True, timeout=PATIENCE).stdout.splitlines()


def numbers(lines, word):
    return np.array([[float(one) for one in line.split()[1:]] for line in lines if line.startswith(word)])
