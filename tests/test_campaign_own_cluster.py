"""`--engine ray` without RAY_ADDRESS: Ray on this machine's cores, which nobody on the network reaches."""

import contextlib
import os
import re
import signal
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from quadstep.io.errors import UserError
from quadstep.studies.campaign import cluster_connection
from tests.campaigns import MASS, SHORT, WITHOUT_REPORT, ended, flights, fly, processes, refused, soon, started, written
from tests.needs import package
from tests.terminals import in_terminal

LONG = SHORT.replace("duration = 0.4", "duration = 16.0")


@pytest.fixture(autouse=True)
def nameless(monkeypatch):
    """No cluster is named, though one may run on this machine."""
    package("ray")
    monkeypatch.delenv("RAY_ADDRESS", raising=False)


def descendants(driver):
    """The processes that a driver has started, directly or not, with their command lines."""
    running, found = processes(), {driver}
    while more := {process for process, parent, *_ in running if parent in found} - found:
        found |= more
    return {process: line for process, _, _, line in running if process in found - {driver}}


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
def test_nobody_else_reaches_it_and_it_ends_with_its_driver(tmp_path, number):
    path, out = written(tmp_path, MASS, LONG, "chunk = 500\n"), tmp_path / "out"
    driver = started(path, out, "--engine", "ray", "--flights", 10**7)
    try:
        assert soon(lambda: flights(out) or driver.poll() is not None)
        assert driver.poll() is None, driver.communicate()
        running = descendants(driver.pid)
        lines = " ".join(running.values())
        assert "gcs_server" in lines
        assert "raylet" in lines
        reached = addresses([driver.pid, *running])
        assert reached
        assert reached <= LOOPBACK
        assert not re.search(r"\b[0-9a-f]{64}\b", lines), "a token on a command line, for everybody to read"
    finally:
        driver.send_signal(number)
    code, said, err = ended(driver)
    if number == signal.SIGTERM:
        assert (code, said) == (130, ""), err
        assert re.fullmatch(r"quadstep: interrupted; \d+ of \d+ files of flights are kept in .*\n", err)
    assert soon(lambda: not running.keys() & {process for process, *_ in processes()}), "its cluster runs on"


def test_in_a_terminal_it_flies_the_same_and_says_nothing_of_itself(tmp_path):
    path = written(tmp_path, MASS, LONG, "chunk = 1000\nflights = 4000\n")
    shown = in_terminal("campaign", path, "--out", tmp_path / "ray", "--engine", "ray", program=WITHOUT_REPORT)
    assert shown.code == 0, shown.text
    bars, said = sides = [], []
    for line in filter(None, re.split(r"[\r\n]+", shown.text)):
        sides[not line.startswith("flying ")].append(line)
    assert any(re.search(r"\b[1-4],\d00/4,000 flights", line) for line in bars)
    assert said[0] == "The worst flights", said
    assert "4,000 flights reached the end" in " ".join(said), " ".join(said)
    assert not re.search("raylet|gcs|pid=|WARN|INFO|Traceback", shown.raw)
    assert fly(path, tmp_path / "lanes").code == 0
    assert flights(tmp_path / "ray") == flights(tmp_path / "lanes")


def test_a_start_that_fails_is_one_line(tmp_path, monkeypatch):
    monkeypatch.setenv("RAY_gcs_server_port_wait_time_s", "0")  # so Ray gives its server no time to start
    run = started(written(tmp_path, head="flights = 16"), tmp_path / "out", "--engine", "ray")
    code, said, err = ended(run)
    assert (code, said) == (2, "")
    assert re.fullmatch(r"quadstep: error: --engine ray: Ray could not be started on this machine: \w+Error: .+\n", err)


@pytest.fixture
def ray_of_a_network(monkeypatch):
    """Ray as a program has loaded it that may be going to join a cluster."""
    util = SimpleNamespace(get_node_ip_address=lambda: "192.0.2.7")
    monkeypatch.setitem(sys.modules, "ray", SimpleNamespace(is_initialized=lambda: False, util=util, shutdown=lambda: None))


def test_a_ray_that_would_listen_on_a_network_is_not_started(ray_of_a_network, tmp_path):
    run = fly(written(tmp_path, head="flights = 16"), tmp_path / "out", "--engine", "ray")
    refused(run, "--engine ray: this program has imported ray itself", "192.0.2.7", "call ray.init()")


def test_the_environment_is_as_it_was(ray_of_a_network, monkeypatch):
    monkeypatch.setenv("RAY_AUTH_TOKEN", "of the laboratory")
    before = dict(os.environ)
    with pytest.raises(UserError), cluster_connection.connected():
        pass
    assert dict(os.environ) == before
