"""`quadstep compare` counts instructions with programs that may be missing or broken."""

import json
import re
import shutil

import pytest

from quadstep.export import arm
from quadstep.studies.comparison.cost import counted
from tests.commands import quadstep, write
from tests.needs import CORTEX_M, needs

pytestmark = needs(CORTEX_M)

TOOLS = (arm.COMPILER, arm.SIZE, arm.MACHINE)

MISSION = """
vehicle = { preset = "crazyflie" }
path = { type = "step", end = [0.2, 0.0, 0.3], time = 0.1, duration = 0.2 }
controller = { type = "pid" }
"""


def program(folder, name, line):
    (folder / name).write_text(f"#!/bin/sh\n{line}\n", encoding="utf-8")
    (folder / name).chmod(0o755)


@pytest.fixture
def programs(tmp_path, monkeypatch, studies_here):
    """A path on which there are the three programs and no others."""
    folder = tmp_path / "programs"
    folder.mkdir()
    for tool in TOOLS:
        program(folder, tool, f'exec {shutil.which(tool)} "$@"')
    monkeypatch.setenv("PATH", str(folder))
    monkeypatch.setattr("quadstep.studies.comparison.cost.counted", counted)  # each time
    return folder


def compared(tmp_path):
    """The instructions of two missions with the same controller, and the report as Markdown."""
    files = [write(tmp_path, MISSION, name) for name in ("one.toml", "two.toml")]
    run = quadstep("compare", *files, "--seeds", 2, "--out", tmp_path / "out")
    assert (run.code, run.err) == (0, "")
    (cost,) = (tmp_path / "out" / "costs").iterdir()
    assert "not counted" not in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")  # but in the terminal
    return json.loads(cost.read_text(encoding="utf-8"))["instructions"], run.out


@pytest.mark.parametrize("tool", TOOLS)
def test_a_program_that_is_missing_leaves_the_count_out(tmp_path, programs, tool):
    (programs / tool).unlink()
    count, said = compared(tmp_path)
    assert count is None
    assert f"Instructions were not counted: {tool} not found." in said


@pytest.mark.parametrize("tool", TOOLS)
def test_after_a_program_is_mended_the_same_command_counts(tmp_path, programs, tool):
    mended = (programs / tool).read_text(encoding="utf-8")
    program(programs, tool, "exit 1")
    count, said = compared(tmp_path)
    assert count is None
    assert re.search(rf"Instructions were not counted: .*{tool}", said)
    (programs / tool).write_text(mended, encoding="utf-8")
    count, said = compared(tmp_path)
    assert count > 0
    assert "not counted" not in said
