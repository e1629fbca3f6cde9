"""As in a container with `--read-only --user 12345:12345`: no name, no home, nowhere to write but the results' folder."""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest

import quadstep
from quadstep.io import code_cache
from quadstep.report import pool
from quadstep.report.pool import provide_writable
from tests.needs import MOUNTS, SUPERUSER, needs, program, without
from tests.patience import PATIENCE

SANDBOX = Path(__file__).parent / "sandbox.sh"
BARE = 12345
MISSION = """name = "Up"
path = { type = "minimum-jerk", end = [0.0, 0.0, 1.0], duration = 2.0 }
"""


@pytest.fixture(scope="module")
def bare():
    """Runs the command line there; its results are in the folder that comes with it."""
    if not program("unshare"):
        without(MOUNTS, "there is no unshare (Debian: util-linux)")
    with tempfile.TemporaryDirectory() as top:
        root, out = Path(top) / "root", Path(top) / "out"
        root.mkdir()
        out.mkdir()
        os.chown(out, BARE, BARE)
        python = Path(sys.executable).resolve().relative_to(sys.base_prefix)
        sources = Path(quadstep.__file__).parent.parent
        box = ["sh", SANDBOX, root, out, sys.base_prefix, Path(np.__file__).parent.parent, sources]

        def run(*arguments, **options):
            command = ["unshare", "--mount", "--propagation", "private", *box, f"/python/{python}", *arguments]
            return subprocess.run(command, capture_output=True, text=True, check=False, timeout=PATIENCE, **options)

        first = run("-c", "import os; print(os.getuid(), os.getgroups())")
        if "mount" in first.stderr or "unshare" in first.stderr:
            without(MOUNTS, first.stderr.splitlines()[0])
        assert first.stdout == f"{BARE} []\n", first.stderr
        yield run, out


@needs(SUPERUSER)
def test_it_is_as_bare_as_that(bare):
    run, _ = bare
    tries = """
import os, pathlib, tempfile
for what in (lambda: pathlib.Path.home(), tempfile.gettempdir, lambda: open("/new", "w"), lambda: open("/sources/new", "w")):
    try: print("could:", what())
    except (OSError, RuntimeError) as error: print(type(error).__name__)
"""
    assert run("-c", tries).stdout.split() == ["RuntimeError", "FileNotFoundError", "OSError", "OSError"]


@needs(SUPERUSER)
def test_a_mission_is_flown_and_drawn_without_a_word_too_many(bare):
    run, out = bare
    (out / "mission.toml").write_text(MISSION)
    done = run("-m", "quadstep", "fly", "/out/mission.toml", "--out", "/out/flown")
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads((out / "flown" / "metrics.json").read_text())["name"] == "Up"
    assert (out / "flown" / "figures" / "position.svg").stat().st_uid == BARE
    again = run("-m", "quadstep", "new", "/out/new.toml")
    assert (again.returncode, again.stderr) == (0, "")


@needs(SUPERUSER)
def test_a_results_folder_that_cannot_be_written_is_one_line(bare):
    run, out = bare
    (out / "mission.toml").write_text(MISSION)
    done = run("-m", "quadstep", "fly", "/out/mission.toml", "--out", "/usr/flown")
    assert done.returncode == 2
    assert done.stderr == "quadstep: error: /usr/flown: cannot be written: Read-only file system\n"


# Without becoming another user


@pytest.fixture
def homeless(monkeypatch, tmp_path):
    """No home, and Matplotlib not told of a place."""

    def unknown(*_):
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(pool.Path, "home", unknown)
    monkeypatch.setattr(code_cache.Path, "expanduser", unknown)
    for name in ("MPLCONFIGDIR", "XDG_CONFIG_HOME", "XDG_CACHE_HOME", "TMPDIR"):
        monkeypatch.setenv(name, "")  # so that it is as before afterwards
        monkeypatch.delenv(name)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(pool, "SHARED_MEMORY", tmp_path / "nowhere")
    monkeypatch.setattr(pool, "Finalize", lambda *_, **__: None)
    return tmp_path


def test_matplotlib_gets_one_folder_for_all_processes(homeless):
    provide_writable()
    made = Path(os.environ["MPLCONFIGDIR"])
    assert made.parent == homeless
    assert made.stat().st_mode & 0o777 == 0o700
    assert os.environ["XDG_CACHE_HOME"] == str(made)
    provide_writable()
    assert [made] == list(homeless.iterdir())


@pytest.mark.parametrize("home", [True, False], ids=["a home", "no home"])
def test_without_a_temporary_folder_shared_memory_will_do(homeless, monkeypatch, home):
    if home:
        monkeypatch.setattr(pool.Path, "home", lambda: homeless)
    monkeypatch.setattr(tempfile, "tempdir", str(Path.cwd()))
    monkeypatch.setattr(pool, "SHARED_MEMORY", homeless)
    provide_writable()
    made = Path(os.environ["TMPDIR"])
    assert made.parent == homeless
    assert tempfile.gettempdir() == str(made)
    assert os.environ.get("MPLCONFIGDIR") == (None if home else str(made))


def test_where_nothing_can_be_written_matplotlib_is_left_to_say_so(homeless, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(homeless / "nowhere"))
    provide_writable()
    assert "MPLCONFIGDIR" not in os.environ


def test_a_home_of_ones_own_is_used(homeless, monkeypatch):
    (homeless / "home").mkdir()
    monkeypatch.setattr(pool.Path, "home", lambda: homeless / "home")
    provide_writable()
    assert "MPLCONFIGDIR" not in os.environ
    assert list((homeless / "home").iterdir()) == []
    monkeypatch.setenv("XDG_CONFIG_HOME", "/dev/null")
    monkeypatch.setenv("XDG_CACHE_HOME", str(homeless / "home"))
    provide_writable()
    assert Path(os.environ["MPLCONFIGDIR"]).parent == homeless
    assert os.environ["XDG_CACHE_HOME"] == str(homeless / "home")


def test_a_home_that_cannot_be_searched_is_as_good_as_none(homeless, monkeypatch):
    there, closed = Path.exists, homeless / "home"

    def exists(path):
        if path.is_relative_to(closed):
            raise PermissionError(13, "Permission denied", str(path))
        return there(path)

    monkeypatch.setattr(pool.Path, "home", lambda: closed)
    monkeypatch.setattr(pool.Path, "exists", exists)
    provide_writable()
    assert Path(os.environ["MPLCONFIGDIR"]).parent == homeless
