"""Logs opened in the page: read as they were written, beside the flight, or refused in one line."""

import numpy as np
import pytest

from quadstep.identify.logs.flight import FlightRecord
from quadstep.page.build import missions_page
from tests import made_logs
from tests.dropped import DROP, carried
from tests.needs import CHROMIUM, needs, package
from tests.pages import FLIGHTS, flown

package("playwright")
pytestmark = needs(CHROMIUM)


@pytest.fixture(scope="module")
def page_file(tmp_path_factory):
    file = tmp_path_factory.mktemp("page") / "page.html"
    file.write_text(missions_page([flown("case", FLIGHTS["other clock"])]), encoding="utf-8")
    return file


@pytest.fixture(scope="module")
def record():
    rng = np.random.default_rng(1)
    time = 5.0 + 0.01 * np.arange(50)
    widths = {"position": 3, "velocity": 3, "attitude": 4, "rates": 3, "voltage": 1}
    channels = {name: rng.normal(size=(50, width)) for name, width in widths.items()}
    return FlightRecord("made", time, 0.01, np.zeros((50, 4)), False, channels, (), np.zeros(50, bool))


def take(page, path):
    """What the page says of a file."""
    page.evaluate("document.getElementById('notice').hidden = true")
    page.set_input_files("#log-file", path)
    page.wait_for_selector("#notice:not([hidden])")
    return page.locator("#notice span").inner_text()


def drop(page, path):
    """What the page says of a file that is dropped on it."""
    return page.evaluate(f"([name, content]) => ({DROP})(name, content)", carried(path.name, path.read_bytes()))


def signal(page, name):
    times, values = page.evaluate("name => quadstep.signal(name)", name)
    return np.array(times), np.array(values)


def test_logs_are_read_as_they_were_written(open_page, tmp_path, record):
    page = open_page()
    position = record.channels["position"]
    csv = tmp_path / "log.csv"
    rows = "\n".join(
        f"{t},{x},{v}" for t, x, v in zip(record.time, position[:, 0], record.channels["voltage"][:, 0], strict=True)
    )
    csv.write_text(f"time[s],x[m],volts[V]\n{rows}\n")
    assert take(page, csv).startswith("Opened log.csv: CSV with 2 signals, 0.5 s long.")
    times, values = signal(page, "x")
    np.testing.assert_array_equal(values, position[:, 0])
    np.testing.assert_array_equal(times, record.time - record.time[0])
    assert "file" in page.locator("#plot-position .roles").inner_text()

    ulg = tmp_path / "log.ulg"
    ulg.write_bytes(made_logs.ulog(record, record.motors) + b"\x40\x00D cut")
    assert ": ULog with " in take(page, ulg)
    for name, column in (("x", position[:, 0]), ("y", position[:, 1]), ("z", position[:, 2])):
        np.testing.assert_array_equal(signal(page, name)[1], column.astype("f4"))
    np.testing.assert_array_equal(signal(page, "vehicle_attitude.q[1]")[1], record.channels["attitude"][:, 1].astype("f4"))

    from mcap.writer import CompressionType, Writer

    mcap = tmp_path / "log.mcap"
    made_logs.mcap(mcap, record, record.motors, lambda file: Writer(file, compression=CompressionType.NONE))
    assert ": MCAP with " in take(page, mcap)
    np.testing.assert_array_equal(signal(page, "state.p[2]")[1], position[:, 2])
    made_logs.mcap(mcap, record, record.motors)
    assert "the page reads JSON messages in uncompressed chunks" in take(page, mcap)
    page.click(".chip button")
    assert page.evaluate("quadstep.log()") is None


def test_logs_are_dropped_on_the_page(open_page, tmp_path, record):
    from mcap.writer import CompressionType, Writer

    page = open_page()
    csv, ulg, mcap = (tmp_path / f"log.{ending}" for ending in ("csv", "ulg", "mcap"))
    csv.write_text("t,x[m]\n10,1\n10.5,2\n11,4\n")
    ulg.write_bytes(made_logs.ulog(record, record.motors))
    made_logs.mcap(mcap, record, record.motors, lambda file: Writer(file, compression=CompressionType.NONE))
    for path, kind, name in ((csv, "CSV", "x"), (ulg, "ULog", "x"), (mcap, "MCAP", "state.p[0]")):
        said = drop(page, path)
        assert said.startswith(f"Opened {path.name}: {kind} with ") and "quadstep advise" in said
        assert page.locator(".chip:visible").inner_text().startswith(path.name)
        values = signal(page, name)[1]
        wanted = [1.0, 2.0, 4.0] if path is csv else record.channels["position"][:, 0].astype("f4" if path is ulg else "f8")
        np.testing.assert_array_equal(values, wanted)
    (tmp_path / "notes.txt").write_text("hello")
    assert drop(page, tmp_path / "notes.txt").startswith("Could not open notes.txt: ")
    assert page.evaluate("quadstep.log().name") == "log.mcap"  # what could not be read takes nothing away


BROKEN = [
    ("a.csv", b"", "not a table"),
    ("a.csv", b"t,x\n0,1\n1\n", "line 3 has 1 entry, but the first line has 2"),
    ("a.csv", b"t,x\n1,1\n0,2\n", "line 3: its time, column t"),
    ("a.csv", b"t,x\nnow,1\nthen,2\n", "line 2: its time, column t"),
    ("a.csv", b"t,x\n0,a\n1,b\n", "without a signal"),
    ("a.bin", bytes(100), "is not a CSV, ULog or MCAP file; “quadstep advise” reads it"),
    ("a.png", bytes(100), "is not a CSV, ULog or MCAP file."),
    ("a.ulg", b"ULog\x01\x12\x35\x01" + bytes(8), "ULog without a signal"),
    ("a.ulg", b"ULog\x01\x12\x35\x01" + bytes(range(256)) * 4, "ULog"),
    ("a.mcap", b"\x89MCAP0\r\n" + b"\x04" + bytes([255] * 8), "MCAP"),
    ("<b>.csv", b"t,x\n", "<b>.csv: it is not a table"),
]


def test_a_broken_log_is_one_line_and_nothing_is_taken(open_page, tmp_path):
    page = open_page()
    for name, content, words in BROKEN:
        (tmp_path / name).write_bytes(content)
        said = take(page, tmp_path / name)
        assert words in said
        assert said.startswith("Could not open ") and said.endswith(".")
        assert "\n" not in said
        assert page.evaluate("quadstep.log()") is None
