"""`--engine ray` without RAY_ADDRESS: a cluster of this machine only, unreachable for others, with nothing left behind."""

import contextlib
import fcntl
import os
import re
import shutil
import signal
import stat
import subprocess
import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace

import pytest

from quadstep.io.errors import UserError
from quadstep.studies.campaign import cluster_connection, cluster_keeper
from tests import terminals
from tests.campaigns import (
    MASS,
    SHORT,
    WITHOUT_REPORT,
    ended,
    flights,
    fly,
    processes,
    refused,
    soon,
    started,
    written,
)
from tests.needs import package

LONG = SHORT.replace("duration = 0.4", "duration = 16.0")


@pytest.fixture(autouse=True)
def nameless(monkeypatch):
    """No cluster is named, though one may run on this machine."""
    monkeypatch.delenv("RAY_ADDRESS", raising=False)


@pytest.fixture
def temporary(monkeypatch):
    """A folder for the temporary files of the programs that are started, short enough for Ray's sockets; empty afterwards."""
    package("ray")
    folder = Path(tempfile.mkdtemp(prefix="q", dir="/tmp"))
    monkeypatch.setenv("TMPDIR", str(folder))
    yield folder
    gone = soon(lambda: not list(folder.iterdir()))
    shutil.rmtree(folder)
    assert gone


def keeper_of(driver):
    """The process that keeps a driver's cluster."""
    return next((process for process, parent, _, line in processes() if parent == driver and "cluster_keeper" in line), None)


def cluster_of(keeper):
    """The processes of a cluster, with their command lines: those of its keeper's session."""
    return {process: line for process, _, session, line in processes() if session == keeper}


def addresses(chosen):
    """The local addresses, as /proc has them, on which these processes can be reached."""
    places = {}
    for table in ("tcp", "tcp6", "udp", "udp6"):
        for line in Path("/proc/net", table).read_text().splitlines()[1:]:
            _, local, _, state, *_, inode = line.split()[:10]
            if state == "0A" or table.startswith("udp"):  # TCP: only what listens
                places[f"socket:[{inode}]"] = local.partition(":")[0]
    handles = [handle for process in chosen for handle in Path("/proc", str(process), "fd").iterdir()]
    found = set()
    for handle in handles:
        with contextlib.suppress(FileNotFoundError):  # closed by now
            found.add(str(handle.readlink()))
    return {places[place] for place in found if place in places}


LOOPBACK = {"0100007F", "0000000000000000FFFF00000100007F", "00000000000000000000000001000000"}
"""127.0.0.1, the same as IPv6 has it, and ::1."""


@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="needs Linux's /proc")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_nobody_else_reaches_it_and_it_ends_with_its_driver(tmp_path, temporary, monkeypatch, number):
    path, out = written(tmp_path, MASS, LONG, "chunk = 500\n"), tmp_path / "out"
    driver = started(path, out, "--engine", "ray", "--flights", 10**7)
    try:
        assert soon(lambda: flights(out) or driver.poll() is not None)
        assert driver.poll() is None, driver.communicate()
        keeper = keeper_of(driver.pid)
        named = ("gcs_server", "raylet", "ray::quadstep_span", "ray::DashboardAgent")  # between two spans its process is idle
        assert soon(lambda: all(name in " ".join(cluster_of(keeper).values()) for name in named))
        running = cluster_of(keeper)
        lines = " ".join(running.values())
        reached = addresses([driver.pid, *running])
        assert reached
        assert reached <= LOOPBACK
        assert not re.search(r"\b[0-9a-f]{64}\b", lines), "a token on a command line, for everybody to read"
        (folder,) = temporary.iterdir()
        assert stat.S_IMODE(folder.stat().st_mode) == 0o700
        if number == signal.SIGKILL:
            monkeypatch.setenv("RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER", "0")  # else Ray takes 127.0.0.1 for another address
            with pytest.raises(UserError, match="it requires its token"):
                cluster_connection.cluster_at(re.search(r"--gcs-address=(\S+)", lines)[1])
    finally:
        driver.send_signal(number)
    code, said, err = ended(driver)
    if number == signal.SIGTERM:
        assert (code, said) == (130, ""), err
        assert re.fullmatch(r"quadstep: interrupted; \d+ of \d+ files of flights are kept in .*\n", err)
    assert soon(lambda: not cluster_of(keeper)), "its cluster runs on"


def test_in_a_terminal_it_flies_the_same_and_says_nothing_of_itself(tmp_path, temporary, monkeypatch):
    path = written(tmp_path, MASS, LONG, "chunk = 1000\nflights = 4000\n")
    monkeypatch.setattr(terminals, "COMMAND", (sys.executable, "-c", WITHOUT_REPORT))
    shown = terminals.in_terminal("campaign", path, "--out", tmp_path / "ray", "--engine", "ray")
    assert shown.code == 0, shown.text
    bars, said = sides = [], []
    for line in filter(None, re.split(r"[\r\n]+", shown.text)):
        sides[not line.startswith("flying ")].append(line)
    assert any(re.search(r"\b[1-4],\d00/4,000 flights", line) for line in bars)
    assert said[0].startswith("4000 flights: "), said
    assert not re.search("raylet|gcs|pid=|WARN|INFO|Traceback", shown.raw)
    assert fly(path, tmp_path / "lanes").code == 0
    assert flights(tmp_path / "ray") == flights(tmp_path / "lanes")


# A start that fails


def test_a_start_that_fails_is_one_line_and_leaves_nothing(tmp_path, temporary, monkeypatch):
    monkeypatch.setenv("RAY_gcs_server_port_wait_time_s", "0")  # so Ray gives its server no time to start
    run = started(written(tmp_path, head="flights = 16"), tmp_path / "out", "--engine", "ray")
    code, said, err = ended(run)
    assert (code, said) == (2, "")
    assert re.fullmatch(r"quadstep: error: --engine ray: Ray could not be started on this machine: \w+Error: .+\n", err)


@pytest.mark.parametrize(
    ("program", "said"),
    [
        ("import time; time.sleep(30)", "not ready after 0.5 s"),
        ("", "it ended before it was ready"),
        ("""print('{"error": "RuntimeError: no room\\\\nat all"}')""", "RuntimeError: no room"),
    ],
)
def test_a_start_without_an_address_is_refused(monkeypatch, program, said):
    monkeypatch.setattr(cluster_connection, "START", 0.5 if "sleep" in program else 60.0)
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE) as keeper:
        with pytest.raises(UserError, match=f"^--engine ray: Ray could not be started on this machine: {said}$"):
            cluster_connection.answered(keeper)
        keeper.kill()


STAND_IN = """
import subprocess, sys
from pathlib import Path
from types import SimpleNamespace
util = SimpleNamespace(get_node_ip_address=lambda: "127.0.0.1")
def init(_temp_dir, **_):
    print("Ray was here", flush=True)
    Path(_temp_dir).mkdir()
    Path(_temp_dir).chmod(0o777)
    subprocess.Popen(["sleep", "1000"])
def get_runtime_context():
    return SimpleNamespace(gcs_address="127.0.0.1:1")
def shutdown():
    sys.exit("no")
"""
"""Of Ray: writes unwanted messages, opens its folder, and leaves a process."""


@pytest.mark.parametrize("end", ["closed", "killed with the driver", "asked to end"])
def test_a_keeper_ends_what_ray_leaves(tmp_path, temporary, monkeypatch, end):
    (tmp_path / "ray.py").write_text(STAND_IN)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    command = [sys.executable, "-P", str(cluster_connection.KEEPER)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True) as keeper:
        assert cluster_connection.answered(keeper) == "127.0.0.1:1"
        assert len(cluster_of(keeper.pid)) == 2
        (folder,) = temporary.iterdir()
        assert stat.S_IMODE(folder.stat().st_mode) == 0o700
        if end == "asked to end":
            keeper.terminate()
        elif end == "closed":
            cluster_connection.ended(keeper)
    assert soon(lambda: not cluster_of(keeper.pid))


@pytest.fixture
def ray_of_a_network(monkeypatch):
    """Ray as a program has loaded it that may be going to join a cluster."""
    util = SimpleNamespace(get_node_ip_address=lambda: "192.0.2.7")
    monkeypatch.setitem(sys.modules, "ray", SimpleNamespace(is_initialized=lambda: False, util=util))


def test_a_ray_that_would_listen_on_a_network_is_not_started(ray_of_a_network, tmp_path):
    with pytest.raises(RuntimeError, match=r"would listen on 192\.0\.2\.7"):
        cluster_keeper.start(tmp_path)
    run = fly(written(tmp_path, head="flights = 16"), tmp_path / "out", "--engine", "ray")
    refused(run, "--engine ray: this program has imported ray itself", "192.0.2.7", "call ray.init()")


def test_the_environment_is_as_it_was(ray_of_a_network, monkeypatch):
    monkeypatch.setenv("RAY_AUTH_TOKEN", "of the laboratory")
    before = dict(os.environ)
    with pytest.raises(UserError), cluster_connection.connected():
        pass
    assert dict(os.environ) == before


# Its folder


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder for temporary files, empty."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(cluster_keeper, "LONGEST", 1000)
    return tmp_path


def test_a_start_removes_what_was_left_and_nothing_else(place):
    for name in ("quadstep-ray-left", "quadstep-ray-used", "kept"):
        (place / name / "session").mkdir(parents=True)
        (place / name / "session/log").write_text("")
    (place / "quadstep-ray-link").symlink_to(place / "kept")
    used = os.open(place / "quadstep-ray-used", os.O_RDONLY)
    fcntl.flock(used, fcntl.LOCK_EX)
    folder, lock = cluster_keeper.locked_folder()
    try:
        assert {path.name for path in place.iterdir()} == {"quadstep-ray-used", "quadstep-ray-link", "kept", folder.name}
        assert (place / "kept/session/log").exists()
        with pytest.raises(BlockingIOError):
            cluster_keeper.remove_unused(folder)
    finally:
        os.close(lock)
        os.close(used)


def test_a_folder_that_another_start_swept_away_is_not_taken(place, monkeypatch):
    first, lock = fcntl.flock, []

    def swept(handle, how):
        lock.append(handle)
        if len(lock) == 1:
            next(place.iterdir()).rmdir()
        first(handle, how)

    monkeypatch.setattr(fcntl, "flock", swept)
    folder, handle = cluster_keeper.locked_folder()
    assert len(lock) == 2
    assert folder.is_dir()
    os.close(handle)


def test_the_sockets_of_a_session_have_room_whatever_TMPDIR_is(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / ("long" * 10)))
    assert cluster_keeper.short_place() == "/tmp"
    monkeypatch.setattr(tempfile, "tempdir", "/var/tmp")
    assert cluster_keeper.short_place() == "/var/tmp"
    session = f"/session_2026-01-01_00-00-00_000000_{2**22}/sockets/plasma_store"
    assert cluster_keeper.LONGEST + len(f"/quadstep-ray-12345678/{cluster_keeper.ROOM}" + session) <= 103
