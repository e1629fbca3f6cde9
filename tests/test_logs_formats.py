"""Logs of autopilots: what was written is read, in the simulator's axes; what is cut short is refused."""

import numpy as np
import pytest

from quadstep.errors import UserError
from quadstep.logs.judge import judge
from quadstep.logs.read import read_log
from tests import made_logs
from tests.made_flights import logged, start

MAPPING = """
time = { column = "log_time" }
motors = { columns = ["/motors.c[0]", "/motors.c[1]", "/motors.c[2]", "/motors.c[3]"] }
[columns]
position = { columns = ["/state.p[0]", "/state.p[1]", "/state.p[2]"] }
velocity = { columns = ["/state.v[0]", "/state.v[1]", "/state.v[2]"] }
attitude = { columns = ["/state.q[0]", "/state.q[1]", "/state.q[2]", "/state.q[3]"] }
rates = { columns = ["/state.w[0]", "/state.w[1]", "/state.w[2]"] }
voltage = { columns = ["/state.volts"] }
"""


@pytest.fixture(scope="module")
def flight():
    return logged(0)[0]


@pytest.fixture(scope="module")
def motors(flight):
    return flight.motors / 1.5


def same(read, flight, motors, within):
    """Whether a log says what the flight did, where both have rows."""
    count = min(read.rows, flight.rows) - 5
    assert read.period == pytest.approx(flight.period, rel=1e-6)
    assert count > 2000
    assert np.abs(read.motors[:count] - motors[:count]).max() < 2e-3
    for name in ("position", "velocity", "rates"):
        error = np.abs(read.channels[name][5:count] - flight.channels[name][5:count])
        assert np.median(error) < within, name
    dot = np.abs((read.channels["attitude"][5:count] * flight.channels["attitude"][5:count]).sum(axis=1))
    assert np.median(dot) > 1.0 - 1e-5
    assert [one.text for one in judge(read, start().geometry()) if one.wrong] == []


def test_ulog(tmp_path, flight, motors):
    pytest.importorskip("pyulog")
    content = made_logs.ulog(flight, motors)
    (tmp_path / "a.ulg").write_bytes(content)
    same(read_log(tmp_path / "a.ulg"), flight, motors, 5e-3)
    for bad, said in ((b"", "is empty"), (b"no log at all", "as a ULog: damaged"), (bytes(5000), "as a ULog: damaged")):
        (tmp_path / "b.ulg").write_bytes(bad)
        with pytest.raises(UserError, match=said):
            read_log(tmp_path / "b.ulg")


def test_ardupilot(tmp_path, flight, motors):
    pytest.importorskip("pymavlink")
    (tmp_path / "a.BIN").write_bytes(made_logs.ardupilot(flight, motors))
    same(read_log(tmp_path / "a.BIN"), flight, motors, 5e-3)
    for bad, said in ((b"", "is empty"), (bytes(5000), "damaged, or without data")):
        (tmp_path / "b.bin").write_bytes(bad)
        with pytest.raises(UserError, match=said):
            read_log(tmp_path / "b.bin")


def test_mcap(tmp_path, flight, motors):
    pytest.importorskip("mcap_ros2")
    made_logs.mcap(tmp_path / "a.mcap", flight, motors)
    (tmp_path / "map.toml").write_text(MAPPING)
    same(read_log(tmp_path / "a.mcap", str(tmp_path / "map.toml")), flight, motors, 1e-9)
    with pytest.raises(UserError, match="give --mapping"):
        read_log(tmp_path / "a.mcap")
    (tmp_path / "b.mcap").write_bytes(b"")
    for path, said in ((tmp_path / "b.mcap", "is empty"), (tmp_path / "none.mcap", "cannot be read: No such file")):
        for mapping in (None, str(tmp_path / "map.toml")):
            with pytest.raises(UserError, match=said):
                read_log(path, mapping)
    (tmp_path / "map.toml").write_text(MAPPING.replace("/motors", "/engines"))
    with pytest.raises(UserError, match="motors' commands are not in the log"):
        read_log(tmp_path / "a.mcap", str(tmp_path / "map.toml"))
    (tmp_path / "b.mcap").write_bytes((tmp_path / "a.mcap").read_bytes()[:5000])
    with pytest.raises(UserError, match="cannot be read as an MCAP file"):
        read_log(tmp_path / "b.mcap", str(tmp_path / "map.toml"))
