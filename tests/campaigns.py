"""Shared by the tests of campaigns: small missions, campaigns written to a folder, and the content of a campaign's folder."""

import json
import os
import subprocess
import sys
import time
import tomllib
from contextlib import contextmanager

import numpy as np
import pyarrow.parquet as pq
import pytest

from quadstep.mission.check import check
from quadstep.studies.campaign.schema import CampaignFile, read_campaign
from tests.commands import heeding_interrupts, quadstep, replace, without_grade
from tests.needs import PS, without
from tests.patience import PATIENCE

SHORT = """
[path]
type = "minimum-jerk"
end = [0.4, 0.1, 0.2]
duration = 0.4
[simulation]
step = 0.004
control_period = 0.004
log_period = 0.02
[start]
position = [0.0, 0.0, 0.0]
attitude = [0.0, 0.0, 0.0]
"""
"""A tenth of a thousand steps of the paper's plant."""

NOISY = """
[vehicle]
preset = "research-2.6kg"
[path]
type = "step"
end = [0.2, 0.0, 1.0]
time = 0.1
duration = 0.3
[controller]
type = "geometric"
[wind]
mean = [2.0, 0.0, 0.0]
turbulence = { wind_20 = 8.0, height = 6.0 }
[sensors]
position_noise = 0.01
gyro_noise = 0.01
"""
"""A real vehicle whose flights differ by their noise."""

MASS = '"vehicle.mass" = {type="normal", mean=1.0, deviation=0.1, low=0.6, high=1.4}\n'


def of(text):
    """A campaign file as checked."""
    return check(CampaignFile, {"mission": "m.toml", **tomllib.loads(text)}, "c.toml")


def varying(**distributions):
    """A campaign file in which these keys vary."""
    return check(CampaignFile, {"mission": "m.toml", "vary": distributions}, "c.toml")


def distribution(**content):
    """A distribution as checked."""
    return varying(key=content).vary["key"]


def written(folder, vary="", mission=SHORT, head="", name="camp.toml"):
    """A campaign file and its mission, written into a folder; the campaign's path."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "mission.toml").write_text(mission, encoding="utf-8")
    path = folder / name
    path.write_text(f'mission = "mission.toml"\n{head}\n[vary]\n{vary}\n', encoding="utf-8")
    return path


def campaign(folder, vary="", mission=SHORT, head=""):
    """The campaign of such files."""
    return read_campaign(written(folder, vary, mission, head))


def flights(folder):
    """The Parquet files of a campaign, by name, as bytes."""
    return {path.name: path.read_bytes() for path in sorted((folder / "flights").glob("*.parquet"))}


def rows(folder):
    """The flights in a folder as anybody would read them, as a table in the order of the files."""
    return pq.read_table(folder / "flights")


def manifest(folder):
    """campaign.json."""

    def refuse(constant):
        raise AssertionError(f"{constant} in campaign.json")

    return json.loads((folder / "campaign.json").read_text(encoding="utf-8"), parse_constant=refuse)


def leftovers(folder):
    """Whatever is half-written."""
    return [path.name for path in folder.rglob(".writing-*")]


REPORT = "quadstep.studies.campaign.report"


@contextmanager
def no_report():
    """The report takes seconds to draw, as the grade of the loop at rest takes to find; both are tested by themselves."""
    with pytest.MonkeyPatch.context() as patch:
        replace(patch, f"{REPORT}.write_report", lambda *of: of[2])
        without_grade(patch)
        yield


WITHOUT_REPORT = (
    "import sys, types\n"
    f"sys.modules['{REPORT}'] = types.SimpleNamespace(write_report=lambda *of: of[2])\n"
    "sys.modules['quadstep.linear.grade'] = types.SimpleNamespace(quick_grade=lambda _: {})\n"
    "from quadstep.commands import cli\n"
    "cli.main()"
)
"""The command line, but for the report and the grade."""


def fly(path, out, *more):
    """`quadstep campaign` in this process."""
    with no_report():
        return quadstep("campaign", path, "--out", out, *more)


def refused(run, *parts):
    """One line on the error stream that says these, and exit code 2."""
    assert run.refused, run
    missing = [part for part in parts if str(part) not in run.err]
    assert not missing, f"{missing} not in {run.err}"
    return run.err


def started(path, out, *more, before=heeding_interrupts):
    """`quadstep campaign` in a process of its own."""
    return subprocess.Popen(
        [sys.executable, "-c", WITHOUT_REPORT, "campaign", str(path), "--out", str(out), *map(str, more)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "COLUMNS": "200"},
        start_new_session=True,
        preexec_fn=before,  # noqa: PLW1509 (set before any thread of the child)
    )


def ended(process):
    """(exit code, what it said, error stream) of a process that ends by itself."""
    try:
        out, err = process.communicate(timeout=PATIENCE)
    finally:
        if process.poll() is None:
            process.kill()
            process.communicate()
    return process.returncode, out, err


def soon(true):
    """Whether something comes true."""
    deadline = time.monotonic() + PATIENCE
    while not (found := true()) and time.monotonic() < deadline:
        time.sleep(0.02)
    return found  # as it was seen: between two tasks of a driver that was interrupted no worker flies


def processes():
    """Process, parent, session and command line of all that run on this machine, but for those that only wait to be reaped."""
    if not PS.here():
        without(PS)
    said = subprocess.run(["ps", "-wweo", "pid=,ppid=,sid=,stat=,args="], check=True, capture_output=True, text=True).stdout
    lines = [line.split(None, 4) for line in said.splitlines()]
    return [(*map(int, numbers), line) for *numbers, state, line in lines if not state.startswith("Z")]


def number(column):
    """A column as an array, what is missing as NaN."""
    return np.array([np.nan if value is None else value for value in column.to_pylist()])
