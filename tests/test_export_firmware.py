"""The adapters of firmware, compiled against headers of our own that say what their documentation says, and run."""

import math
import subprocess
from pathlib import Path

import numpy as np
import pytest

from quadstep.c99.subject import exported
from quadstep.errors import UserError
from quadstep.export.c99 import c99_files
from quadstep.export.firmware import firmware_files
from tests.commands import quadstep, write
from tests.exports import paper_mission, real_mission
from tests.needs import C_COMPILER, needs

STUBS = Path(__file__).parent / "firmware"
BITS = ["-ffp-contract=off", "-fno-math-errno"]


def adapter(folder, target, kind="pid", vehicle="crazyflie"):
    """The files of a target in a folder; gives the law's name and plan."""
    plan = real_mission({"type": kind}, vehicle).plan()
    law = exported(plan, False)
    for name, text in firmware_files(target, law, c99_files(law, plan)).items():
        (folder / name).write_text(text, encoding="utf-8")
    return law.name, plan


def flown(folder, target, name, program, *units):
    """What a program prints that flies the adapter."""
    driver = STUBS / target / program
    (folder / program).write_text(driver.read_text(encoding="utf-8").replace("NAME", name), encoding="utf-8")
    strict = ["-Wall", "-Wextra", "-Werror", "-Wno-unused-const-variable", "-I.", f"-I{STUBS / target}"]
    objects = []
    for unit in (program, *units, f"{name}.c", f"{name}_params.c"):
        plus = unit.endswith(".cpp")
        line = [
            "g++" if plus else "gcc",
            "-std=c++17" if plus else "-std=gnu11",
            "-O1",
            *BITS,
            *strict,
            "-c",
            unit,
            "-o",
            f"{unit}.o",
        ]
        built = subprocess.run(line, cwd=folder, capture_output=True, text=True, check=False)
        assert built.returncode == 0, built.stderr
        objects.append(f"{unit}.o")
    subprocess.run(["g++", *objects, "-lm", "-o", "fly"], cwd=folder, check=True)
    return subprocess.run([folder / "fly"], capture_output=True, text=True, check=True, timeout=60).stdout.splitlines()


def numbers(lines, word):
    return np.array([[float(one) for one in line.split()[1:]] for line in lines if line.startswith(word)])


@needs(C_COMPILER)
@pytest.mark.parametrize("kind", ["pid", "rotation-backstepping"])
def test_the_crazyflie_flies_the_law_in_its_units(tmp_path, kind):
    name, _ = adapter(tmp_path, "crazyflie", kind)
    lines = flown(tmp_path, "crazyflie", name, "fly.c", "controller_quadstep.c")
    assert lines[0] == "idle 0 0"  # a setpoint without a position
    samples = numbers(lines, "sample")
    assert len(samples) == 20
    scale = np.abs(samples[:, 4:]).max(axis=0)
    assert np.abs((samples[:, :4] - samples[:, 4:]) / scale).max() < 1e-4  # degrees and back round differently
    assert numbers(lines, "held")[0, 0] > 0.0
    assert (numbers(lines, "lost") == 0.0).all()


@needs(C_COMPILER)
def test_px4_flies_the_law_in_its_axes(tmp_path):
    name, plan = adapter(tmp_path, "px4", "pid", "x500")
    lines = flown(tmp_path, "px4", name, "fly.cpp", "QuadstepControl.cpp")
    assert lines[:2] == ["asked for Quadstep", "checked 7 1"]
    samples = numbers(lines, "sample")
    assert len(samples) == 12
    fastest = float(plan.parameters.airframe.rotor.fastest)
    np.testing.assert_allclose(samples[:, :4], samples[:, 4:] / fastest, atol=2e-4)


@needs(C_COMPILER)
def test_ardupilot_turns_the_way_it_wants(tmp_path):
    name, _ = adapter(tmp_path, "ardupilot", "pid", "x500")
    lines = flown(tmp_path, "ardupilot", name, "fly.cpp", "AC_CustomControl_Quadstep.cpp")
    mixed = np.array([[float(one) for one in line.split()] for line in lines])
    np.testing.assert_allclose(mixed[0], 0.0, atol=1e-6)
    for axis in range(3):  # to the right, nose up, to the right: each about its own axis, positive
        assert mixed[1 + axis, axis] > 0.02
        assert np.abs(np.delete(mixed[1 + axis], axis)).max() < 0.2 * mixed[1 + axis, axis]
    assert math.isfinite(mixed.sum())


def test_what_a_target_cannot_fly_is_said(tmp_path):
    law = exported(paper_mission({"type": "backstepping"}).plan(), False)
    with pytest.raises(UserError, match="needs a mission for a real vehicle"):
        firmware_files("px4", law, {})
    with pytest.raises(UserError, match="computes in f32"):
        firmware_files("px4", exported(real_mission({"type": "pid"}).plan(), True), {})
    slow = real_mission({"type": "pid"}, simulation={"step": 0.0005, "control_period": 0.0025}).plan()
    with pytest.raises(UserError, match=r"law runs every 0\.0025 s, not a multiple of 1 ms"):
        firmware_files("crazyflie", exported(slow, False), {})
    text = '[vehicle]\npreset = "crazyflie"\n[path]\ntype = "step"\nend = [0.0, 0.0, 1.0]\nduration = 2.0\n'
    run = quadstep("export", write(tmp_path, text), "--target", "crazyflie", "--precision", "f64", "--out", tmp_path / "o")
    assert run.refused
    assert not (tmp_path / "o").exists()
