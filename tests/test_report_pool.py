"""The drawing processes: what they load, what they report when something goes wrong, and that they end."""

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures.process import BrokenProcessPool, ProcessPoolExecutor
from multiprocessing import forkserver

import numpy as np
import pytest

from quadstep.engines.engine import Engine
from quadstep.io.errors import UserError
from quadstep.report.drawing import FigureJob
from quadstep.report.panel import Panel
from quadstep.report.pool import drawing_pool, start_server
from quadstep.report.publish import publishing
from quadstep.studies.fly import fly_mission
from tests.commands import LINE, quadstep, write
from tests.patience import PATIENCE

T = np.linspace(0.0, 1.0, 5)


def figure(values=T):
    return FigureJob("one", "A figure", T, [Panel("x", "m", {"x": values})])


def large():
    return bytes(100_000_000)


def end_at_once():
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.fixture
def mission(tmp_path):
    return write(tmp_path, LINE)


def test_a_worker_starts_with_matplotlib_and_without_the_command_line():
    with drawing_pool() as pool:
        loaded = pool.submit(eval, "set(__import__('sys').modules)").result()
    assert "quadstep.report.figures" in loaded
    assert "quadstep.commands.cli" not in loaded


def test_pool_and_command_line_load_nothing_heavy():
    code = (
        "import sys, quadstep.report.pool; print([name for name in ('numpy', 'matplotlib', 'asyncio') if name in sys.modules])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_figures_are_drawn(tmp_path):
    with drawing_pool() as pool:
        pool.submit(figure().draw, tmp_path).result()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one.png", "one.svg"]


def test_a_figure_that_fails_is_one_line(tmp_path):
    with pytest.raises(UserError, match=r"^figure 'one' cannot be drawn: "), drawing_pool() as pool:
        pool.submit(figure(np.array(["no number"])).draw, tmp_path).result()


def test_a_figure_that_finds_no_room_says_what_the_system_says(tmp_path):
    with pytest.raises(FileNotFoundError), drawing_pool() as pool:
        pool.submit(figure().draw, tmp_path / "missing").result()


def test_a_killed_worker_is_no_fault_of_the_folder(tmp_path):
    with pytest.raises(BrokenProcessPool), publishing(tmp_path / "out", "x", overwrite=False), drawing_pool() as pool:
        pool.submit(end_at_once).result()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("error", [BrokenPipeError(32, "Broken pipe"), EOFError("unexpected EOF"), ConnectionRefusedError()])
def test_a_worker_that_does_not_start_is_no_fault_of_the_folder(mission, tmp_path, monkeypatch, error):
    def refuse(_descriptors):
        raise error

    monkeypatch.setattr(forkserver, "connect_to_new_process", refuse)
    run = quadstep("fly", mission, "--out", tmp_path / "out")
    assert run.refused, run
    assert "could not start a process to draw figures" in run.err
    assert [path.name for path in tmp_path.iterdir()] == ["mission.toml"]


def test_a_pool_that_cannot_be_made_is_no_fault_of_the_folder(mission, tmp_path, monkeypatch):
    def refuse(*_, **__):
        raise BrokenPipeError(32, "Broken pipe")

    monkeypatch.setattr(ProcessPoolExecutor, "__init__", refuse)
    run = quadstep("fly", mission, "--out", tmp_path / "out")
    assert run.refused, run
    assert "could not start a process to draw figures" in run.err
    assert [path.name for path in tmp_path.iterdir()] == ["mission.toml"]


def test_a_server_that_was_killed_is_started_again(tmp_path):
    start_server()
    server = forkserver._forkserver._forkserver_pid
    os.kill(server, signal.SIGKILL)
    os.waitid(os.P_PID, server, os.WEXITED | os.WNOWAIT)
    with drawing_pool() as pool:
        pool.submit(figure().draw, tmp_path).result()


def test_no_worker_outlives_a_block_that_failed():
    before = multiprocessing.active_children()
    with pytest.raises(KeyboardInterrupt), drawing_pool() as pool:
        waiting = [pool.submit(time.sleep, 600.0) for _ in range(8)]
        raise KeyboardInterrupt
    assert multiprocessing.active_children() == before
    assert all(one.cancelled() or isinstance(one.exception(), BrokenProcessPool) for one in waiting)


SCRIPT = """
from pathlib import Path
from quadstep.engines.engine import Engine
from quadstep.studies.fly import fly_mission
print("run")
fly_mission(Path({mission!r}), Path({out!r}), Engine.LANES, False)
"""


def test_a_result_that_is_cut_short_by_the_end_of_its_worker_is_not_waited_for():
    """A block that fails while a worker sends: what it has sent is half of a message."""

    def fail_while_sending():
        with drawing_pool(1) as pool:
            pool.submit(large)
            while not pool._result_queue._reader.poll():
                pass
            raise KeyboardInterrupt

    ended = threading.Event()

    def run():
        with pytest.raises(KeyboardInterrupt):
            fail_while_sending()
        ended.set()

    threading.Thread(target=run, daemon=True).start()
    assert ended.wait(PATIENCE)


def test_a_script_without_a_guard_runs_once_and_its_folder_gives_no_modules(mission, tmp_path):
    """Processes of their own must neither run the script again nor take the user's files for modules."""
    folder, out = tmp_path / "folder", tmp_path / "out"
    folder.mkdir()
    for name in ("matplotlib", "random", "quadstep"):
        (folder / f"{name}.py").write_text("print('taken')\nraise SystemExit\n", encoding="utf-8")
    script = tmp_path / "script.py"
    script.write_text(SCRIPT.format(mission=str(mission), out=str(out)), encoding="utf-8")
    run = subprocess.run([sys.executable, script], capture_output=True, text=True, cwd=folder, check=False)
    assert (run.returncode, run.stdout, run.stderr) == (0, "run\n", "")
    assert (out / "figures" / "position.svg").exists()


# Stages


@pytest.mark.parametrize("engine", [Engine.LANES, Engine.PYTHON])
def test_a_flight_tells_its_stages_and_how_far_each_is(mission, tmp_path, engine):
    mission.write_text(LINE.replace("duration = 1.0", "duration = 4.0"), encoding="utf-8")
    told = []
    fly_mission(mission, tmp_path / "out", engine, False, lambda *what: told.append(what))
    stages = list(dict.fromkeys(stage for stage, _, _ in told))
    first = ["compiling"] if engine is Engine.LANES else []
    assert stages == [*first, "flying", "writing tables", "writing the page", "drawing figures"]
    assert [(done, of) for stage, done, of in told if stage == "drawing figures"] == [(i, 5) for i in range(6)]
    flying = [(done, of) for stage, done, of in told if stage == "flying"]
    assert flying == sorted(flying)
    assert len({of for _, of in flying}) == 1
    assert flying[0][0] == 0
    assert 0.9 * flying[-1][1] <= flying[-1][0] <= flying[-1][1]
    assert len(flying) >= (2 if engine is Engine.LANES else 4)
