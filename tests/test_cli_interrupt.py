"""Ctrl-C, and a request to end: exit code 130, one line, no file and no folder left."""

import os
import signal
import subprocess
import sys
import time

import pytest

from quadstep.commands.cli import explained
from quadstep.io.files import WRITTEN, write_beside
from quadstep.report.publish import publishing
from tests.commands import LINE, files, heeding_interrupts, quadstep, write
from tests.patience import PATIENCE

ENDLESS = '[path]\ntype = "circle"\nradius = 5.0\nperiod = 20.0\nturns = 100.0\n'
LONG_ON_LANES = ENDLESS + "[simulation]\nduration = 100000.0\nlog_period = 1.0\n"


def interrupted(mission, out, number, whole_group, engine, wait=0.2):
    """Start a flight, signal it once its folder is there, and give (exit code, error stream)."""
    process = subprocess.Popen(
        [sys.executable, "-m", "quadstep", "fly", mission, "--out", out, "--engine", engine, "--overwrite"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=heeding_interrupts,  # noqa: PLW1509 (set before any thread of the child)
    )
    try:
        deadline = time.monotonic() + PATIENCE
        while not list(out.glob(".writing-*")) and process.poll() is None and time.monotonic() < deadline:
            time.sleep(0.01)
        time.sleep(wait)
        (os.killpg if whole_group else os.kill)(process.pid, number)
        _, err = process.communicate(timeout=PATIENCE)
    finally:
        if process.poll() is None:
            process.kill()
    return process.returncode, err


@pytest.mark.parametrize(
    ("engine", "number", "whole_group", "wait"),
    [
        ("python", signal.SIGINT, True, 0.0),  # as from a terminal, while the processes that draw are starting
        ("python", signal.SIGINT, True, 0.5),
        ("python", signal.SIGTERM, False, 0.2),
        ("lanes", signal.SIGINT, False, 1.0),
    ],
)
def test_an_interrupted_flight_says_so_in_one_line_and_leaves_nothing(tmp_path, engine, number, whole_group, wait):
    mission = write(tmp_path, LONG_ON_LANES if engine == "lanes" else ENDLESS)
    code, err = interrupted(mission, tmp_path / "new" / "out", number, whole_group, engine, wait)
    assert [path.name for path in tmp_path.iterdir()] == ["mission.toml"]
    assert code == 130
    assert err == "quadstep: interrupted; nothing was written\n"


def test_an_interrupted_flight_leaves_the_result_before_it(tmp_path, no_figures):
    out = tmp_path / "out"
    assert quadstep("fly", write(tmp_path, LINE), "--out", out).code == 0
    before = files(out)
    code, _ = interrupted(write(tmp_path, ENDLESS, "long.toml"), out, signal.SIGINT, True, "python")
    assert code == 130
    assert files(out) == before
    assert not list(out.glob(".*"))


INTERRUPTED_WHILE_LOADING = """
import runpy, signal, sys

class Interrupts:
    def find_spec(self, name, *_):
        if name == sys.argv[1]:
            signal.raise_signal(signal.SIGINT)

sys.meta_path.insert(0, Interrupts())
runpy.run_module("quadstep", run_name="__main__")
"""


@pytest.mark.parametrize("module", ["typer", "quadstep.commands.fly", "quadstep.io.user_code"])
def test_ctrl_c_while_the_command_line_loads_is_one_line(tmp_path, module):
    run = subprocess.run(
        [sys.executable, "-c", INTERRUPTED_WHILE_LOADING, module],
        capture_output=True, text=True, cwd=tmp_path, check=False, timeout=PATIENCE, preexec_fn=heeding_interrupts,
    )  # fmt: skip
    assert (run.returncode, run.stdout, run.stderr) == (130, "", "quadstep: interrupted; nothing was written\n")


DONE = """
import signal, sys
from quadstep.__main__ import main
try:
    main()
finally:
    signal.raise_signal(signal.SIGINT)
"""


def test_ctrl_c_after_all_is_done_changes_nothing(tmp_path):
    run = subprocess.run(
        [sys.executable, "-c", DONE, "--version"],
        capture_output=True, text=True, cwd=tmp_path, check=False, timeout=PATIENCE, preexec_fn=heeding_interrupts,
    )  # fmt: skip
    assert (run.returncode, run.stderr) == (0, "")


def test_an_interrupted_command_names_what_it_had_written(tmp_path):
    WRITTEN.clear()
    assert explained(KeyboardInterrupt()) == (["interrupted; nothing was written"], 130)
    write_beside(tmp_path / "mine.toml", "")
    with publishing(tmp_path / "out", "a", overwrite=False) as draft:
        (draft / "metrics.json").write_text("{}")
    said = f"interrupted; written before: {tmp_path / 'mine.toml'}, {tmp_path / 'out'}"
    assert explained(KeyboardInterrupt()) == ([said], 130)
    WRITTEN.clear()


HUNG_UP = """
import os, signal
from quadstep.commands import cli
signal.signal(signal.SIGHUP, signal.SIG_IGN)
run = cli.run
cli.run = lambda: (os.kill(os.getpid(), signal.SIGHUP), run())[1]
cli.main()
"""


def test_a_command_under_nohup_goes_on_when_its_terminal_has_gone():
    done = subprocess.run(
        [sys.executable, "-c", HUNG_UP, "--version"], capture_output=True, text=True, check=False, timeout=PATIENCE
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("quadstep ")
