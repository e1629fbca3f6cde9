"""Recorded paths: files like real logs are read, and every flaw is named with file, line and column."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadstep import UserError
from quadstep.mission.data_files import read_recording, unwrapped
from quadstep.mission.read import check_mission

COLUMNS = {"t": "t", "x": "x", "y": "y", "z": "z", "psi": None}
GOOD = "t,x,y,z\n0,0,0,0\n1,1,0,0\n2,2,0,0\n3,3,0,1\n"


def read(folder, content, columns=COLUMNS, unit=1.0):
    path = folder / "path.csv"
    if isinstance(content, bytes):
        path.write_bytes(content)
    else:
        path.write_text(content, encoding="utf-8", newline="")
    return read_recording(path, columns, unit)


def refusal(folder, content, columns=COLUMNS):
    with pytest.raises(UserError) as raised:
        read(folder, content, columns)
    message = str(raised.value)
    assert len(message.splitlines()) == 1
    assert message.startswith(str(folder / "path.csv"))
    return message


def rows(*changed):
    lines = ["t,x,y,z", "0,0,0,0", "1,1,0,0", "2,2,0,0", "3,3,0,1", "4,3,0,1"]
    for line, text in changed:
        lines[line - 1] = text
    return "\n".join(lines) + "\n"


def test_times_in_another_unit_are_one_line(tmp_path):
    (tmp_path / "path.csv").write_text("t,x,y,z\n0,0,0,0\n1,1,0,0\n200000000,2,0,0\n300000000,3,0,1\n400000000,3,0,1\n")
    with pytest.raises(UserError, match=r"path.file: path.csv: its times, 0 to 4e\+08 s .* are they in seconds\?"):
        check_mission({"path": {"type": "recorded", "file": "path.csv"}}, "m.toml", tmp_path).plan()


def test_a_recording_too_short_for_its_smoothing_is_one_line_that_names_file_and_row_and_what_is_allowed(tmp_path):
    tiny = "t,x,y,z\n0,0,0,0\n1e-6,1,0,0\n2e-6,2,0,0\n3e-6,3,0,1\n"
    (tmp_path / "tiny.csv").write_text(tiny)
    path = {"type": "recorded", "file": "tiny.csv"}
    with pytest.raises(UserError) as raised:
        check_mission({"path": path}, "m.toml", tmp_path).plan(tmp_path)
    assert str(raised.value) == (
        f"path.file: {tmp_path}/tiny.csv: line 5: the recording ends after 3e-06 s; with this smoothing it must last at least "
        "0.015 s"
    )
    slower = tiny.replace("e-6", "e-2")
    (tmp_path / "tiny.csv").write_text(slower)
    assert check_mission({"path": path}, "m.toml", tmp_path).plan(tmp_path).ticks.last > 0
    (tmp_path / "tiny.csv").write_text(slower + "3.001e-2,3,0,1\n3.002e-2,3,0,1\n9,3,0,1\n")
    assert check_mission({"path": path}, "m.toml", tmp_path).plan(tmp_path).ticks.last > 0


def test_yaw_makes_no_jumps_of_more_than_half_a_turn():
    turning = np.cumsum(np.random.default_rng(8).normal(size=400))
    wrapped = (turning + np.pi) % (2.0 * np.pi) - np.pi
    np.testing.assert_allclose(unwrapped(wrapped), np.unwrap(wrapped), atol=1e-12)
    half = np.array([0.0, np.pi, 0.0, -np.pi, 0.0, 1.0])
    assert unwrapped(half).tolist() == half.tolist()


def test_times_start_at_zero_and_yaw_is_zero_without_a_column(tmp_path):
    times, points = read(tmp_path, "t,x,y,z\n10,1,2,3\n11,1,2,3\n12.5,1,2,3\n13,4,5,6\n")
    assert times.tolist() == [0.0, 1.0, 2.5, 3.0]
    assert points.tolist() == [[1, 2, 3, 0], [1, 2, 3, 0], [1, 2, 3, 0], [4, 5, 6, 0]]


GOOD_FORMS = {
    "byte order mark": b"\xef\xbb\xbf" + GOOD.encode(),
    "units in brackets": GOOD.replace("t,x,y,z", "t[s],x[m],y [m],z[m]"),
    "spaces": GOOD.replace(",", " , "),
    "quotes": GOOD.replace("t,x,y,z", '"t","x","y","z"'),
    "windows line ends": GOOD.replace("\n", "\r\n"),
    "no last line end": GOOD.rstrip("\n"),
    "empty lines": GOOD.replace("\n", "\n\n"),
    "extra columns": "battery,t,name,x,y,z\n3.7,0,a,0,0,0\n,1,b,1,0,0\nx,2,c,2,0,0\nnan,3,d,3,0,1\n",
    "other order": "z,y,x,t\n0,0,0,0\n0,0,1,1\n0,0,2,2\n1,0,3,3\n",
    "exponents": "t,x,y,z\n0,0e0,-0,+0\n1e0,1.0E+0,0,0\n.2e1,2.,0,0\n3,30e-1,0,1\n",
}


@pytest.mark.parametrize("form", GOOD_FORMS)
def test_forms_that_real_logs_have_are_read_alike(tmp_path, form):
    times, points = read(tmp_path, GOOD_FORMS[form])
    assert times.tolist() == [0, 1, 2, 3]
    assert points.tolist() == [[0, 0, 0, 0], [1, 0, 0, 0], [2, 0, 0, 0], [3, 0, 1, 0]]


def test_a_column_called_psi_is_yaw_in_the_unit_that_was_named(tmp_path):
    text = "t,x,y,z,psi\n0,0,0,0,0\n1,0,0,0,90\n2,0,0,0,180\n3,0,0,0,180\n"
    _, points = read(tmp_path, text, unit=math.pi / 180)
    assert points[:, 3] == pytest.approx([0, math.pi / 2, math.pi, math.pi])


def test_yaw_that_jumps_by_a_turn_is_unwrapped(tmp_path):
    text = "t,x,y,z,psi\n" + "".join(f"{i},0,0,0,{(i + math.pi) % (2 * math.pi) - math.pi}\n" for i in range(9))
    _, points = read(tmp_path, text)
    assert points[:, 3] == pytest.approx(np.arange(9.0))


def test_columns_may_have_any_names(tmp_path):
    text = "time,state.x,state.y,state.z,heading\n0,0,0,0,1\n1,1,0,0,1\n2,2,0,0,1\n3,3,0,1,1\n"
    columns = {"t": "time", "x": "state.x", "y": "state.y", "z": "state.z", "psi": "heading"}
    _, points = read(tmp_path, text, columns)
    assert points[-1].tolist() == [3, 0, 1, 1]


FLAWS = {
    "empty file": ("", "missing", "nothing"),
    "only empty lines": ("\n\n\n", "missing", "nothing"),
    "only a header": ("t,x,y,z\n", "0 rows", "at least 4"),
    "three rows": ("t,x,y,z\n0,0,0,0\n1,0,0,0\n2,0,0,0\n", "3 rows", "at least 4"),
    "missing column": (GOOD.replace("t,x,y,z", "t,x,y,height"), "'z'", "height"),
    "no header": (GOOD.partition("\n")[2], "'t'", "missing"),
    "other separator": (GOOD.replace(",", ";"), "'t'", "missing"),
    "nan": (rows((3, "1,nan,0,0")), "line 3", "'x'", "nan"),
    "inf": (rows((6, "4,3,0,-inf")), "line 6", "'z'", "-inf"),
    "too large": (rows((6, "4,3,1e999,0")), "line 6", "'y'", "1e999"),
    "nan time": (rows((2, "nan,0,0,0")), "line 2", "'t'", "nan"),
    "text": (rows((4, "2,two,0,0")), "line 4", "'x'", "'two'"),
    "empty field": (rows((4, "2,2,,0")), "line 4", "'y'", "nothing"),
    "blank field": (rows((4, "2,2,  ,0")), "line 4", "'y'", "nothing"),
    "short row": (rows((5, "3,3")), "line 5", "'y'", "nothing"),
    "decimal comma": (rows((3, '"1,5",1,0,0')), "line 3", "'t'", "1,5"),
    "repeated time": (rows((5, "2,3,0,1")), "line 5", "repeats", "2 s, then 2 s"),
    "backward time": (rows((4, "0.5,2,0,0")), "line 4", "backward", "1 s, then 0.5 s"),
    "not UTF-8": (b"t,x,y,z\n\xff\xfe\n", "not a text file"),
    "endless time": (rows((3, "1e300,1,0,0")), "line 3"),
    "no time at all": (rows((3, "1e-300,1,0,0")), "line"),
    "beyond any place": (rows((2, "0,1e308,0,0")), "line 2"),
    "digits apart": (rows((3, "1,1_000,0,0")), "line 3"),
    "column named twice": (GOOD.replace("t,x,y,z", "t,x,x,z"), "more than once"),
    "huge field": ("t,x,y,z\n" + "9" * 200_000 + ",0,0,0\n", "line 2", "65536 characters"),
}


@pytest.mark.parametrize("flaw", FLAWS)
def test_a_flaw_is_named_with_its_place(tmp_path, flaw):
    content, *needed = FLAWS[flaw]
    message = refusal(tmp_path, content)
    for part in needed:
        assert part in message


def test_binary_junk_is_refused(tmp_path):
    refusal(tmp_path, bytes(range(256)) * 20)
    refusal(tmp_path, b"\x00" * 1000)


def test_the_line_that_is_named_counts_empty_lines_too(tmp_path):
    assert "line 5" in refusal(tmp_path, "t,x,y,z\n\n0,0,0,0\n1,1,0,0\n2,nan,0,0\n3,0,0,0\n4,0,0,0\n")
    assert "line 5" in refusal(tmp_path, "t,x,y,z\n\n0,0,0,0\n1,1,0,0\n1,2,0,0\n3,0,0,0\n4,0,0,0\n")


def test_a_header_with_line_breaks_still_gives_one_line(tmp_path):
    assert "'t'" in refusal(tmp_path, '"a\nb",x,y,z\n0,0,0,0\n')


def test_a_named_yaw_column_must_be_there(tmp_path):
    assert "'yaw'" in refusal(tmp_path, GOOD, {**COLUMNS, "psi": "yaw"})


def test_a_wide_file_is_listed_in_one_short_line(tmp_path):
    message = refusal(tmp_path, ",".join(f"column{i}" for i in range(500)) + "\n")
    assert "..." in message
    assert len(message) < 600


def test_a_missing_file_and_a_folder_are_named(tmp_path):
    with pytest.raises(UserError, match=r"path\.csv: .*file not found"):
        read_recording(tmp_path / "path.csv", COLUMNS, 1.0)
    with pytest.raises(UserError, match="it is a folder; a recording must be a regular file"):
        read_recording(tmp_path, COLUMNS, 1.0)


def test_the_file_is_looked_up_beside_the_mission(tmp_path):
    (tmp_path / "path.csv").write_text(GOOD, encoding="utf-8")
    plan = check_mission({"path": {"type": "recorded", "file": "path.csv"}}, "m.toml").plan(tmp_path)
    assert plan.ticks.last == 1500
    wanted = plan.loop.path.reference(3.0, plan.parameters.path)
    assert list(wanted.position) == pytest.approx([3, 0, 1], abs=0.3)


cell = st.one_of(
    st.sampled_from(["", " ", "t", "x", "y", "z", "psi", "nan", "inf", "1e999", '"', "0", "1"]),
    st.floats().map(str),
    st.text(max_size=8),
)


def accepted_or_refused(folder, content):
    """A recording is either refused in one line or gives rising finite times and finite points."""
    try:
        times, points = read(folder, content)
    except UserError as error:
        assert len(str(error).splitlines()) == 1
        return
    assert points.shape == (len(times), 4)
    assert len(times) >= 4
    assert np.isfinite(points).all()
    assert (np.diff(times) >= 0).all()


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.binary(max_size=300))
def test_any_bytes_are_a_path_or_refused(tmp_path_factory, content):
    accepted_or_refused(tmp_path_factory.getbasetemp(), content)
    accepted_or_refused(tmp_path_factory.getbasetemp(), b"t,x,y,z\n0,0,0,0\n1,0,0,0\n2,0,0,0\n3,0,0,0\n" + content)


@settings(max_examples=80, deadline=None, derandomize=True)
@given(
    st.sampled_from([["t,x,y,z"], ["t,x,y,z,psi"], []]),
    st.lists(st.lists(cell, max_size=6).map(",".join), max_size=8),
    st.sampled_from(["\n", "\r\n", "\r"]),
)
def test_any_rows_are_a_path_or_refused(tmp_path_factory, header, lines, end):
    content = end.join(header + lines).encode("utf-8", "surrogatepass")
    accepted_or_refused(tmp_path_factory.getbasetemp(), content)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(
    st.lists(
        st.tuples(*[st.floats(-1e6, 1e6)] * 3), min_size=4, max_size=12
    ),
    st.floats(-1e3, 1e3),
    st.floats(1e-3, 10.0),
)  # fmt: skip
def test_numbers_read_back_exactly(tmp_path_factory, points, begin, period):
    times = [begin + i * period for i in range(len(points))]
    lines = [",".join(map(repr, (t, *point))) for t, point in zip(times, points, strict=True)]
    read_times, read_points = read(tmp_path_factory.getbasetemp(), "\n".join(["t,x,y,z", *lines]))
    assert read_times.tolist() == [t - times[0] for t in times]
    assert read_points[:, :3].tolist() == [list(point) for point in points]
