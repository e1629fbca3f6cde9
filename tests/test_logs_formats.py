"""Logs of autopilots: what was written is read, in the simulator's axes; what is cut short is refused."""

import dataclasses
import re
import struct
import tracemalloc

import numpy as np
import pytest

from quadstep.identify.averages import rotor_speeds
from quadstep.identify.logs import ardupilot, ulog
from quadstep.identify.logs.flight import refuse_shared
from quadstep.identify.logs.judge import judge
from quadstep.identify.logs.mapping import load_mapping
from quadstep.identify.logs.read import read_log
from quadstep.identify.parameters import numbers_of
from quadstep.identify.replay import compare, law_of, ready
from quadstep.identify.starts import voltage_of
from quadstep.io.errors import UserError
from tests import made_logs
from tests.made_flights import logged, start


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


def test_a_part_of_a_ulog_has_the_same_rows_wherever_it_is_cut(tmp_path, flight, motors):
    quick = dataclasses.replace(flight, time=0.25 * flight.time)  # a message every 2.5 ms, rows of 10 ms
    for name, rows in (("whole", slice(None)), ("part", slice(1501, None))):
        channels = {key: one[rows] for key, one in quick.channels.items()}
        one = dataclasses.replace(quick, time=quick.time[rows], channels=channels)
        (tmp_path / f"{name}.ulg").write_bytes(made_logs.ulog(one, motors[rows]))
    whole, part = (read_log(tmp_path / f"{name}.ulg") for name in ("whole", "part"))
    with pytest.raises(UserError, match=r"part: [\d.]+ s of it are in whole, too"):
        refuse_shared([whole, part])


def test_ulog(tmp_path, flight, motors):
    content = made_logs.ulog(flight, motors)
    (tmp_path / "a.ulg").write_bytes(content)
    same(read_log(tmp_path / "a.ulg"), flight, motors, 5e-3)
    for factor in (0.3, 1.0):  # thrusts are logged; its model of the motors makes signals of them after that
        thrusts = factor * motors**2 + (1.0 - factor) * motors
        (tmp_path / "c.ulg").write_bytes(made_logs.ulog(flight, thrusts, {"THR_MDL_FAC": factor}))
        same(read_log(tmp_path / "c.ulg"), flight, motors, 5e-3)
    for bad, said in ((b"", "is empty"), (b"no log at all", "as a ULog: damaged"), (bytes(5000), "as a ULog: damaged")):
        (tmp_path / "b.ulg").write_bytes(bad)
        with pytest.raises(UserError, match=said):
            read_log(tmp_path / "b.ulg")


def test_ardupilot(tmp_path, flight, motors):
    (tmp_path / "a.BIN").write_bytes(made_logs.ardupilot(flight, motors))
    same(read_log(tmp_path / "a.BIN"), flight, motors, 5e-3)
    for bad, said in ((b"", "is empty"), (bytes(5000), "as an ArduPilot log: damaged, or another kind")):
        (tmp_path / "b.bin").write_bytes(bad)
        with pytest.raises(UserError, match=said):
            read_log(tmp_path / "b.bin")
    (tmp_path / "b.bin").write_bytes(made_logs.ardupilot(flight, motors).replace(b"RCOU", b"RCIN"))
    with pytest.raises(
        UserError, match=r"RCOU.C1: this motor command .* it has ATT, BAT, IMU, XKF1: set bit 10 of LOG_BITMASK"
    ):
        read_log(tmp_path / "b.bin")


def test_what_an_exported_law_logged_is_read_and_told(tmp_path, flight, motors):
    rows, section = flight.rows, start()
    numbers = numbers_of(section, [flight])
    lift = (numbers.airframe.rotor.thrust * rotor_speeds(motors, voltage_of(flight), numbers.curve, False) ** 2).sum(axis=1)
    torque, period, rejected = np.arange(3.0 * rows).reshape(rows, 3), np.full(rows, 0.004), np.zeros(rows)
    period[701], rejected[900:] = 0.012, 3.0
    data = np.zeros((rows, 11))
    data[:, 1:6] = np.stack([np.zeros(rows), rejected, period, rejected, rejected], axis=1)
    data[:, 6], data[:, 8:] = lift / 0.9, torque
    data[:, 0] = 20819.0
    data[1::3] = 7.0  # somebody else's
    (tmp_path / "a.ulg").write_bytes(made_logs.ulog(flight, motors, debug_array=("float id;float[10] data", data)))
    fields = np.concatenate([np.stack([period, rejected], axis=1), torque], axis=1)
    qstp = (9, "Qfffff", "TimeUS,Dt,Rej,TX,TY,TZ", fields)
    (tmp_path / "b.BIN").write_bytes(made_logs.ardupilot(flight, motors, QSTP=qstp))
    thrust = r"the logged commands make 0\.(90|89)\d times the thrust that it asked for\."
    for name, more in (("a.ulg", thrust), ("b.BIN", "")):
        found = read_log(tmp_path / name)
        inner = slice(10, found.rows - 10)
        wanted = (torque * made_logs.FLIP)[: found.rows][inner]
        np.testing.assert_allclose(found.channels["law_torque"][inner], wanted, atol=0.5)
        said = law_of(found, section)
        assert re.search(
            rf"an exported law flew \d+\.\d s of it, its samples up to about 12 ms apart, 3 of them rejected(; )?{more}", said
        ), said
    (tmp_path / "c.ulg").write_bytes(made_logs.ulog(flight, motors))
    assert law_of(read_log(tmp_path / "c.ulg"), section) == ""


def test_mcap(tmp_path, flight, motors):
    pytest.importorskip("mcap_ros2")
    made_logs.mcap(tmp_path / "a.mcap", flight, motors)
    (tmp_path / "map.toml").write_text(made_logs.MCAP_MAPPING)
    same(read_log(tmp_path / "a.mcap", str(tmp_path / "map.toml")), flight, motors, 1e-9)
    with pytest.raises(UserError, match="give --mapping"):
        read_log(tmp_path / "a.mcap")
    (tmp_path / "b.mcap").write_bytes(b"")
    for path, said in ((tmp_path / "b.mcap", "is empty"), (tmp_path / "none.mcap", "file not found")):
        for mapping in (None, str(tmp_path / "map.toml")):
            with pytest.raises(UserError, match=said):
                read_log(path, mapping)
    (tmp_path / "map.toml").write_text(made_logs.MCAP_MAPPING.replace("/motors", "/engines"))
    with pytest.raises(UserError, match="this motor command is not in the log"):
        read_log(tmp_path / "a.mcap", str(tmp_path / "map.toml"))
    (tmp_path / "b.mcap").write_bytes((tmp_path / "a.mcap").read_bytes()[:5000])
    with pytest.raises(UserError, match="cannot be read as an MCAP file"):
        read_log(tmp_path / "b.mcap", str(tmp_path / "map.toml"))


def test_own_readers_read_what_the_formats_own_readers_do(tmp_path, flight, motors):
    pyulog, dfreader = pytest.importorskip("pyulog"), pytest.importorskip("pymavlink.DFReader")
    (tmp_path / "a.ulg").write_bytes(made_logs.ulog(flight, motors))
    found, damaged, *_ = ulog.read(tmp_path / "a.ulg", load_mapping("px4").names())
    assert damaged == 0
    theirs = {one.name: one.data for one in pyulog.ULog(str(tmp_path / "a.ulg")).data_list}
    assert len(found) > 15
    for name, series in found.items():
        topic, _, field = name.partition(".")
        assert np.array_equal(series.value, theirs[topic][field])
        assert np.array_equal(series.time, theirs[topic]["timestamp"] * 1e-6)
    topics, told = {"a": ("float x", np.zeros((1, 1)))}, {"MC_ROLLRATE_P": 0.15, "MC_ROLL_P": 6.5}
    (tmp_path / "p.ulg").write_bytes(made_logs.ulog_of(topics, [0.0], told))
    theirs = pyulog.ULog(str(tmp_path / "p.ulg")).initial_parameters
    assert ulog.read(tmp_path / "p.ulg", ["a.x"]).parameters == theirs == pytest.approx(told)
    (tmp_path / "a.bin").write_bytes(made_logs.ardupilot(flight, motors))
    found, damaged, *_ = ardupilot.read(tmp_path / "a.bin", load_mapping("ardupilot").names())
    assert damaged == 0
    assert len(found) > 15
    log = dfreader.DFReader_binary(str(tmp_path / "a.bin"))
    messages = [log.recv_match(type=["ATT", "IMU", "RCOU"]) for _ in range(300)]
    for kind, field in (("ATT", "Yaw"), ("IMU", "GyrX"), ("RCOU", "C3")):
        theirs = [getattr(one, field) for one in messages if one.get_type() == kind]
        assert found[f"{kind}.{field}"].value[: len(theirs)].tolist() == theirs


def test_letters_of_ardupilot_that_count_in_parts_of_a_unit(tmp_path):
    out = made_logs.described(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")
    out += made_logs.described(9, 3 + 8 + 2 + 4 + 4, "X", "QcLe", "TimeUS,A,B,C")
    out += struct.pack("<BBBQhii", 0xA3, 0x95, 9, 2_000_000, -1234, 471234567, 50)
    (tmp_path / "a.bin").write_bytes(out)
    found, *_ = ardupilot.read(tmp_path / "a.bin", ["X.A", "X.B", "X.C", "X.D"])
    assert {name: series.value.tolist() for name, series in found.items()} == {
        "X.A": [pytest.approx(-12.34)], "X.B": [pytest.approx(47.1234567)], "X.C": [0.5],
    }  # fmt: skip
    assert found["X.A"].time.tolist() == [2.0]


def test_layouts_of_a_ulog_within_one_another(tmp_path):
    formats = [b"esc:uint8_t id;float[2] v;", b"status:uint64_t timestamp;esc[2] e;bool ok;uint8_t[7] _padding0;"]
    begin = b"ULog\x01\x12\x35\x01" + bytes(8)
    out = begin + b"".join(made_logs.message(b"F", one) for one in formats)
    out += made_logs.message(b"A", struct.pack("<BH", 0, 7) + b"status")
    sample = struct.pack("<HQBffBff?", 7, 3_000_000, 1, 1.0, 2.0, 2, 3.0, 4.0, True)
    (tmp_path / "a.ulg").write_bytes(out + made_logs.message(b"D", sample) + made_logs.message(b"D", sample + bytes(7)))
    found, damaged, *_ = ulog.read(
        tmp_path / "a.ulg", ["status.e[1].v[0]", "status.ok", "status.e[2].v[0]", "status.e", "status.x"]
    )
    assert damaged == 0
    assert {name: series.value.tolist() for name, series in found.items()} == {
        "status.e[1].v[0]": [3.0, 3.0], "status.ok": [1.0, 1.0],
    }  # fmt: skip
    assert found["status.ok"].time.tolist() == [3.0, 3.0]


@pytest.mark.parametrize("layout", [
    b"a:a[65535] x;",
    b"a:b[60000] x;",
    b"a:float[99999] x;",
    b"a:nothing x;",
    b"a:;",
    b"a:float x;float x;",
    b"a:float[-1] x;",
])  # fmt: skip
def test_a_layout_that_no_message_can_have_is_damage(tmp_path, layout):
    out = b"ULog\x01\x12\x35\x01" + bytes(8) + made_logs.message(b"F", b"b:float[60000] x;") + made_logs.message(b"F", layout)
    out += made_logs.message(b"A", struct.pack("<BH", 0, 7) + b"a")
    (tmp_path / "a.ulg").write_bytes(out)
    columns, damaged, *_ = ulog.read(tmp_path / "a.ulg", ["a.x"])
    assert not columns
    assert damaged > 0


@pytest.mark.parametrize(("suffix", "made"), [(".ulg", made_logs.ulog), (".bin", made_logs.ardupilot)])
def test_damage_is_left_out_and_counted_and_nothing_of_it_reaches_the_terminal(tmp_path, capfd, flight, motors, suffix, made):
    content = bytearray(made(flight, motors))
    whole = read_log(saved(tmp_path / f"a{suffix}", content))
    assert whole.damaged == 0
    content[60_000:60_000] = b"\x1b[31m\x1b]0;title\x07" * 20
    content[90_000:90_400] = bytes(400)
    del content[120_000:120_033]
    found = read_log(saved(tmp_path / f"b{suffix}", content))
    assert found.damaged == 3
    assert found.rows == whole.rows
    where = ~found.lost & np.isfinite(found.channel("rates")).all(axis=1)
    assert where.mean() > 0.99
    assert np.array_equal(found.channel("rates")[-500:], whole.channel("rates")[-500:])
    assert [one.text for one in judge(found) if "damaged" in one.text] == [
        "the file is damaged in 3 places; what could not be read is left out"
    ]
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(("suffix", "made"), [(".ulg", made_logs.ulog), (".bin", made_logs.ardupilot)])
@pytest.mark.parametrize("missing", [1, 5])
def test_a_log_cut_within_a_message_is_damaged(tmp_path, flight, motors, suffix, made, missing):
    assert read_log(saved(tmp_path / f"a{suffix}", made(flight, motors)[:-missing])).damaged == 1


def saved(path, content):
    path.write_bytes(content)
    return path


def test_a_log_of_a_few_samples_is_one_line(tmp_path, flight, motors):
    few = dataclasses.replace(flight, time=flight.time[:10])
    for suffix, made in ((".ulg", made_logs.ulog), (".bin", made_logs.ardupilot)):
        with pytest.raises(UserError, match=r"rows of 0.01 s with motor commands; a log needs at least 20"):
            read_log(saved(tmp_path / f"a{suffix}", made(few, motors)))


def packed_mcap(says, content, kind):
    """An MCAP file of one chunk that says how large it is unpacked."""
    import lz4.frame
    import zstandard

    def record(number, body):
        return bytes([number]) + struct.pack("<Q", len(body)) + body

    def text(value):
        return struct.pack("<I", len(value)) + value

    data = zstandard.compress(content) if kind == b"zstd" else lz4.frame.compress(content)
    chunk = record(6, struct.pack("<QQQI", 0, 1, says, 0) + text(kind) + struct.pack("<Q", len(data)) + data)
    magic = b"\x89MCAP0\r\n"
    return magic + record(1, text(b"") + text(b"x")) + chunk + record(15, bytes(4)) + record(2, bytes(20)) + magic


@pytest.mark.parametrize("kind", [b"zstd", b"lz4"])
def test_an_mcap_file_is_not_unpacked_further_than_it_says_and_may(tmp_path, kind):
    pytest.importorskip("mcap_ros2")
    from mcap.records import Chunk

    from quadstep.identify.logs.mcap_file import data_of, recorded

    mapping = str(saved(tmp_path / "map.toml", made_logs.MCAP_MAPPING.encode()))
    content = b"\x80" + struct.pack("<Q", 5_000_000) + bytes(5_000_000)
    for says, said in ((2_500_000_000, "unpacks to 2500 MB"), (1000, "the size or"), (9_000_000, "the size or")):
        with pytest.raises(UserError, match=said):
            read_log(saved(tmp_path / "a.mcap", packed_mcap(says, content, kind)), mapping)
    (chunk,) = (one for one in recorded(packed_mcap(1000, content, kind)) if isinstance(one, Chunk))
    tracemalloc.start()
    with pytest.raises(ValueError, match="the size or the checksum"):
        data_of(chunk)
    assert tracemalloc.get_traced_memory()[1] < 1_000_000
    tracemalloc.stop()
    with pytest.raises(UserError, match="has none of the columns"):
        read_log(saved(tmp_path / "a.mcap", packed_mcap(len(content), content, kind)), mapping)


def test_a_flipped_bit_of_an_mcap_file_is_noticed(tmp_path, flight, motors):
    pytest.importorskip("mcap_ros2")
    from mcap.writer import CompressionType, Writer

    mapping = str(saved(tmp_path / "map.toml", made_logs.MCAP_MAPPING.encode()))
    short = dataclasses.replace(flight, time=flight.time[:40])
    made_logs.mcap(tmp_path / "a.mcap", short, motors, lambda file: Writer(file, compression=CompressionType.NONE))
    content, whole = (tmp_path / "a.mcap").read_bytes(), read_log(tmp_path / "a.mcap", mapping)
    refused = 0
    for place in range(0, len(content), 256):
        flipped = bytearray(content)
        flipped[place] ^= 1 << place // 256 % 8
        try:
            found = read_log(saved(tmp_path / "b.mcap", flipped), mapping)
        except UserError:
            refused += 1
            continue
        assert np.array_equal(found.motors, whole.motors)
        assert all(np.array_equal(found.channels[name], values, equal_nan=True) for name, values in whole.channels.items())
    assert refused > 0.7 * len(content) / 256


def test_numbers_that_no_sensor_gives_are_not_measured(tmp_path, flight, motors):
    wild = dict(flight.channels)
    wild["rates"] = wild["rates"].copy()
    wild["rates"][700] = (1e30, 1.0, 1.0)
    found = read_log(saved(tmp_path / "a.ulg", made_logs.ulog(dataclasses.replace(flight, channels=wild), motors)))
    assert np.nanmax(np.abs(found.channel("rates"))) < 100.0
    assert 1 <= (~np.isfinite(found.channel("rates")).all(axis=1)).sum() <= 3


def test_a_layout_whose_name_speaks_to_the_terminal_is_none_of_ours(tmp_path, capfd, flight, motors):
    content = made_logs.ardupilot(flight, motors)
    evil = made_logs.described(9, 11, "\x1b]0;", "!!", "\x1b[2J\x1b[31mred\x07")
    assert read_log(saved(tmp_path / "a.bin", content[:89] + evil + content[89:])).rows > 2000
    assert capfd.readouterr() == ("", "")


def test_a_log_that_is_no_measurement_is_one_line(flight):
    still = {
        **flight.channels,
        "attitude": np.tile([1.0, 0.0, 0.0, 0.0], (flight.rows, 1)),
        "rates": np.zeros((flight.rows, 3)),
    }
    fixed = dataclasses.replace(flight, channels=still)
    with pytest.raises(UserError, match="attitude: exactly as if nothing acted on the vehicle"):
        compare([fixed], start(), ready([fixed], start())[0])
