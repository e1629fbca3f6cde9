"""Files from outside: only regular ones, bounded in size, lines, depth and numbers; and lines that are safe in a terminal."""

import os
import re
import socket
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from quadstep.io import files
from quadstep.io.documents import DEEPEST, parse_toml, read_json
from quadstep.io.errors import LONGEST, UserError, one_line
from quadstep.io.run_record import read_manifest
from quadstep.mission.data_files import MOST_ROWS
from quadstep.mission.listings import read_vehicle
from quadstep.mission.read import plan_mission, read_mission
from quadstep.studies.campaign import LARGEST_CHUNK, MOST_CHUNKS, MOST_FLIGHTS
from quadstep.studies.campaign.manifest import CampaignManifest
from quadstep.studies.campaign.schema import read_campaign
from tests.patience import PATIENCE
from tests.terminals import in_terminal

LINE = '[path]\ntype = "minimum-jerk"\nend = [1.0, 0.0, 0.0]\nduration = 1.0\n'
SMALL = files.FileKind("a small file", 10)


# What may be opened


def odd(folder, kind):
    """Something that is no regular file."""
    path = folder / "odd"
    if kind == "a folder":
        path.mkdir()
    elif kind == "a pipe":
        os.mkfifo(path)
    elif kind == "a socket":
        with socket.socket(socket.AF_UNIX) as one:
            one.bind(str(path))
    else:
        path.symlink_to("/dev/zero")
    return path


@pytest.mark.parametrize("kind", ["a folder", "a pipe", "a socket", "a device"])
def test_only_regular_files_are_opened(tmp_path, kind):
    with pytest.raises(UserError, match=rf"odd: cannot be read: it is {kind}; a TOML file must be a regular file$"):
        files.read_text(odd(tmp_path, kind), files.TOML)


def test_a_file_of_just_the_size_is_read_and_a_larger_one_is_not(tmp_path):
    (tmp_path / "a").write_bytes(b"x" * 10)
    assert files.read_bytes(tmp_path / "a", SMALL) == b"x" * 10
    (tmp_path / "a").write_bytes(b"x" * 11)
    with pytest.raises(UserError, match=r"a: too large; a small file may have at most 1e-05 MB"):
        files.read_bytes(tmp_path / "a", SMALL)


def test_a_file_that_says_it_is_empty_and_is_not_is_bounded_too():
    assert Path("/proc/self/environ").stat().st_size == 0
    with pytest.raises(UserError, match="too large"):
        files.read_bytes(Path("/proc/self/environ"), SMALL)


def test_a_sparse_file_larger_than_memory_is_refused_at_once(tmp_path):
    with (tmp_path / "m.toml").open("wb") as file:
        file.truncate(1 << 42)
    with pytest.raises(UserError, match="too large; a TOML file may have at most 2 MB"):
        read_mission(tmp_path / "m.toml")


@pytest.mark.parametrize("name", ["a\0b", "\ud800", "n" * 300, "n/" * 3000, ""])
def test_names_that_no_file_has(tmp_path, name):
    with pytest.raises(UserError, match="cannot be read"):
        files.read_bytes(tmp_path / name, SMALL)
    assert not files.is_file(tmp_path / name)


def test_links_are_followed_or_not(tmp_path):
    (tmp_path / "a").write_text("1", encoding="utf-8")
    (tmp_path / "link").symlink_to("a")
    assert files.read_text(tmp_path / "link", SMALL) == "1"
    with pytest.raises(UserError, match="it is a link"):
        files.read_text(tmp_path / "link", SMALL, links=False)


def test_lines_of_a_table_are_bounded(tmp_path):
    path = tmp_path / "t.csv"
    path.write_text("a" * files.LONGEST_LINE + "\nb\n", encoding="utf-8")
    with files.table(path, files.LOG) as lines, pytest.raises(UserError, match=r"line 1: longer than 65536 characters"):
        list(lines)
    path.write_text("a" * (files.LONGEST_LINE - 1) + "\nb\n", encoding="utf-8")
    with files.table(path, files.LOG) as lines:
        assert [len(line) for line in lines] == [files.LONGEST_LINE, 2]


# TOML and JSON

DEEP = {
    "dotted key": ".".join("a" * (DEEPEST + 2)) + " = 1",
    "dotted key, quoted": "'a'." * (DEEPEST + 1) + '"a" = 1',
    "dotted key, blanks": "a . " * (DEEPEST + 1) + "a = 1",
    "header": f"[{'.'.join('a' * (DEEPEST + 2))}]",
    "lists": "a = " + "[" * 2000 + "]" * 2000,
    "tables": "a = " + "{a=" * 40 + "1" + "}" * 40,
    "after four quotes": 'a = ["""x"""", ' + "[" * 40 + "]" * 40 + "]",
    "header and tables": f"[{'.'.join('a' * 20)}]\na = " + "{a=" * 20 + "1" + "}" * 20,
}


@pytest.mark.parametrize("case", DEEP)
def test_what_is_nested_too_deep_is_refused(case):
    with pytest.raises(UserError, match=rf"^f: nested too deep; at most {DEEPEST} levels are allowed$"):
        parse_toml(DEEP[case], "f")


@pytest.mark.parametrize("text", ["'{}'", '"{}"', "'''\n{}'''", '"""\n{} \\""" """', "1 # {}"])
def test_what_looks_deep_inside_a_text_is_none(text):
    content = "a = " + text.format("a." * 100 + "[" * 100)
    assert parse_toml(content, "f") == tomllib.loads(content)


def test_the_deepest_that_is_allowed_is_read():
    assert parse_toml(".".join("a" * DEEPEST) + " = 1", "f")


@pytest.mark.parametrize("number", [str(2**63), str(-(2**63) - 1), "9" * 400, "0x" + "f" * 200_000])
def test_numbers_of_more_than_64_bits_are_refused_with_their_key(number):
    with pytest.raises(UserError, match=r"^f: a\.b\[1\]: is too large; whole numbers go from -2\^63 to 2\^63 - 1$"):
        parse_toml(f"a.b = [1, {number}]", "f")


@pytest.mark.parametrize("text", ["NaN", "[Infinity]", '{"a": 1e999}', "9" * 400, "[" * 100_000, "{", "", '{"a": "\\ud800"'])
def test_json_has_finite_numbers_and_little_depth(tmp_path, text):
    (tmp_path / "a.json").write_text(text, encoding="utf-8")
    with pytest.raises(UserError, match=r"a\.json: "):
        read_json(tmp_path / "a.json")


def test_a_large_and_honest_grid_is_read(tmp_path):
    values = ", ".join(f"{1.0 + 1e-7 * i:.9f}" for i in range(100_000))
    (tmp_path / "m.toml").write_text(LINE, encoding="utf-8")
    (tmp_path / "c.toml").write_text(
        f'mission = "m.toml"\n[vary]\n"vehicle.mass" = {{ type = "grid", values = [{values}] }}\n', encoding="utf-8"
    )
    assert read_campaign(tmp_path / "c.toml").flights == 100_000


# Numbers of campaigns and rows of recordings


@pytest.mark.parametrize(("flights", "chunk", "said"), [
    (MOST_FLIGHTS, 16, f"make {MOST_FLIGHTS // 16} files; allowed: at most {MOST_CHUNKS}: choose a chunk of 50000"),
    (10**7, 10**7, f"chunk: should be less than or equal to {LARGEST_CHUNK}"),
    (10**30, 65_536, "flights: is too large"),
    (MOST_FLIGHTS + 1, 65_536, f"flights: should be less than or equal to {MOST_FLIGHTS}"),
    (MOST_FLIGHTS, 65_536, ""),
    (MOST_CHUNKS * 16, 16, ""),
])  # fmt: skip
def test_a_campaign_has_a_bounded_number_of_bounded_files(tmp_path, flights, chunk, said):
    (tmp_path / "m.toml").write_text(LINE, encoding="utf-8")
    (tmp_path / "c.toml").write_text(
        f'mission = "m.toml"\nflights = {flights}\nchunk = {chunk}\n'
        '[vary]\n"vehicle.mass" = { type = "uniform", low = 0.9, high = 1.1 }\n',
        encoding="utf-8",
    )
    try:
        campaign = read_campaign(tmp_path / "c.toml")
        campaign.check_count(campaign.flights)
    except UserError as error:
        assert said
        assert said in str(error)
    else:
        assert not said


def test_a_campaign_of_many_keys_has_smaller_files(tmp_path):
    keys = "".join(f'"path.waypoints.{i}.yaw" = {{ type = "uniform", low = 0.0, high = 1.0 }}\n' for i in range(200))
    places = ", ".join(f"{{ t = {i}.0, position = [{i}.0, 0.0, 0.0] }}" for i in range(200))
    (tmp_path / "m.toml").write_text(f'[path]\ntype = "waypoints"\nwaypoints = [{places}]\n', encoding="utf-8")
    for chunk, good in ((LARGEST_CHUNK, False), (LARGEST_CHUNK // 4, True)):
        (tmp_path / "c.toml").write_text(f'mission = "m.toml"\nchunk = {chunk}\n[vary]\n{keys}', encoding="utf-8")
        campaign = read_campaign(tmp_path / "c.toml")
        if good:
            campaign.check_count(MOST_FLIGHTS)
        else:
            with pytest.raises(
                UserError, match=r"chunk: 1048576 flights of 2\d\d columns make a file larger than 1000 MB; choose"
            ):
                campaign.check_count(MOST_FLIGHTS)


def test_a_campaign_whose_mission_cannot_be_read_is_named_too(tmp_path):
    (tmp_path / "c.toml").write_text('mission = "/dev/zero"\n', encoding="utf-8")
    with pytest.raises(UserError, match=rf"^{tmp_path}/c\.toml: mission: /dev/zero: cannot be read: it is a device"):
        read_campaign(tmp_path / "c.toml")


@pytest.mark.parametrize("number", ["1e30", str(10**30), str(MOST_FLIGHTS + 1), "NaN", "-1"])
def test_a_manifest_with_an_absurd_number_is_refused(tmp_path, number):
    text = '{"name": "", "fingerprint": "", "flights": %s, "chunk": 16, "chunks": [], "machines": []}'
    (tmp_path / "campaign.json").write_text(text % 16, encoding="utf-8")
    assert read_manifest(tmp_path / "campaign.json", CampaignManifest)
    (tmp_path / "campaign.json").write_text(text % number, encoding="utf-8")
    with pytest.raises(UserError, match=r"campaign\.json: .*choose another --out"):
        read_manifest(tmp_path / "campaign.json", CampaignManifest)


def recorded(folder, rows):
    """The plan of a mission along a recording of these rows."""
    (folder / "r.csv").write_text("t,x,y,z\n" + "".join(rows), encoding="utf-8")
    (folder / "m.toml").write_text('[path]\ntype = "recorded"\nfile = "r.csv"\n', encoding="utf-8")
    return plan_mission(read_mission(folder / "m.toml"), folder / "m.toml")


def test_a_recording_of_too_many_rows_is_refused(tmp_path):
    rows = [f"{i / 1000},0,0,0\n" for i in range(MOST_ROWS + 1)]
    with pytest.raises(UserError, match=rf"path\.file: .*r\.csv: more than {MOST_ROWS} rows of data, the most"):
        recorded(tmp_path, rows)


# Lines for the terminal


def test_a_line_prints_whatever_it_is_made_of():
    text = "a\x1b[31m\u202e\0\x07\x9b\ud800\u200b\ufeff\u2028\r\n\tb é 飞 ✈ \\"
    assert one_line(text) == r"a\x1b[31m\u202e\x00\x07\x9b\ud800\u200b\ufeff b é 飞 ✈ " + "\\"
    assert one_line(one_line(text)) == one_line(text)


@pytest.mark.parametrize("sign", ["x", "\0", " x", "\U000e0001"])
def test_a_line_has_a_bounded_length_and_keeps_both_ends(sign):
    line = one_line("begin " + sign * 100_000 + " end")
    assert len(line) <= LONGEST
    assert line.startswith("begin")
    assert line.endswith("end")
    assert line.isprintable()
    assert len(str(UserError("x" * 100_000))) <= LONGEST


KEY = "\\u001b[31m\\u202e\\u0000" + "k" * 100_000


@pytest.mark.parametrize("text", [
    f'"{KEY}" = 1\n' + LINE,
    LINE + f'[vehicle]\n"{KEY}" = 1\n',
    LINE + f'[vehicle]\nkinematics = "{KEY}"\n',
    LINE + f'[controller]\ntype = "{KEY}"\n',
    f'[path]\ntype = "recorded"\nfile = "{KEY}"\n',
    f'[path]\ntype = "recorded"\nfile = "p.csv"\ncolumns = {{ x = "{KEY}" }}\n',
    LINE + f'vehicle = {{ preset = "{KEY}" }}\n',
    LINE + f'[tune]\n"{KEY}" = 1\n',
    f'"{KEY}" = 1\n"{KEY}" = 2\n',
])  # fmt: skip
def test_keys_and_values_reach_the_terminal_as_short_text_that_prints(tmp_path, text):
    (tmp_path / "p.csv").write_text("t,x\x1b[31m,y,z\n", encoding="utf-8")
    (tmp_path / "m.toml").write_text(text, encoding="utf-8")
    with pytest.raises(UserError) as raised:
        plan_mission(read_mission(tmp_path / "m.toml"), tmp_path / "m.toml")
    assert str(raised.value).isprintable()
    assert len(str(raised.value)) <= LONGEST
    assert str(raised.value).startswith(str(tmp_path / "m.toml"))


def test_texts_of_a_vehicle_file_are_shown_as_text(tmp_path):
    (tmp_path / "v.toml").write_text(
        'preset = "x500"\ndescription = "\\u001b[31mred"\nsources = { mass = "\\u202e\\u001b]0;title\\u0007" }\n',
        encoding="utf-8",
    )
    run = subprocess.run(
        [sys.executable, "-m", "quadstep", "vehicles", str(tmp_path / "v.toml")],
        capture_output=True,
        check=False,
        timeout=PATIENCE,
    )
    assert run.returncode == 0
    assert r"\x1b[31mred" in run.stdout.decode()
    assert all(line.isprintable() for line in run.stdout.decode().splitlines())


# Which file is to blame


@pytest.mark.parametrize(("base", "own", "said"), [
    ('preset = "x500"\nmass = -1', "", "vehicle.file: FOLDER/v.toml: mass: should be greater than 0, not -1"),
    ('preset = "x500"\nmass = -1', "mass = -2", "vehicle.mass: should be greater than 0, not -2"),
    ('preset = "x500"\nmass = 1', "mass = -2", "vehicle.mass: should be greater than 0, not -2"),
    ('preset = "x500"\n[rotor]\nradius = -1', "rotor.inertia = 1e-5", "vehicle.file: FOLDER/v.toml: rotor.radius: "),
    ('preset = "x500"\n[rotor]\nradius = -1', "rotor.radius = -2", "vehicle.rotor.radius: "),
    ('preset = "x500"\ninertia = [9.0, 1.0, 1.0]', "", "vehicle.file: FOLDER/v.toml: inertia breaks the triangle"),
    ('preset = "nope"', "", "vehicle.file: FOLDER/v.toml: unknown preset 'nope'"),
    ('file = "w.toml"', "", "vehicle.file: FOLDER/w.toml: file not found"),
    ('file = "x.toml"', "", "vehicle.file: FOLDER/x.toml: mass: should be"),
    ("mass = ", "", "vehicle.file: FOLDER/v.toml: not valid TOML"),
    ("mass = 1.0", "", "vehicle.file: FOLDER/v.toml: inertia is required"),
])  # fmt: skip
def test_an_error_in_a_vehicle_file_names_that_file(tmp_path, base, own, said):
    (tmp_path / "v.toml").write_text(base, encoding="utf-8")
    (tmp_path / "x.toml").write_text('preset = "x500"\nmass = "heavy"', encoding="utf-8")
    (tmp_path / "m.toml").write_text(f'{LINE}[vehicle]\nfile = "v.toml"\n{own}\n', encoding="utf-8")
    with pytest.raises(UserError, match="^" + re.escape(f"{tmp_path}/m.toml: {said.replace('FOLDER', str(tmp_path))}")):
        read_mission(tmp_path / "m.toml")


def test_an_error_in_the_file_of_a_listed_vehicle_names_that_file(tmp_path):
    (tmp_path / "v.toml").write_text('file = "w.toml"', encoding="utf-8")
    (tmp_path / "w.toml").write_text('preset = "x500"\nmass = -1', encoding="utf-8")
    with pytest.raises(UserError, match=rf"^{tmp_path}/v\.toml: file: {tmp_path}/w\.toml: mass: should be greater than 0"):
        read_vehicle(tmp_path / "v.toml")


# Through the real command line, in bounded memory and time

HOSTILE = {
    "a device": (["fly", "/dev/zero"], ""),
    "a pipe": (["fly", "pipe"], ""),
    "a vehicle that never ends": (["fly", "m.toml"], LINE + '[vehicle]\nfile = "/dev/zero"\n'),
    "a path that never ends": (["fly", "m.toml"], '[path]\ntype = "recorded"\nfile = "/dev/zero"\n'),
    "weights from a pipe": (["fly", "m.toml"], LINE + '[controller]\ntype = "backstepping"\nnets.weights = "pipe"\n'),
    "a table 2,000 deep": (["fly", "m.toml"], "a = " + "[" * 2000 + "]" * 2000),
    "a key of 200,000 parts": (["fly", "m.toml"], "a" + ".a" * 200_000 + " = 1\n"),
    "60,000 waypoints": (["fly", "m.toml"],
        '[path]\ntype = "waypoints"\nwaypoints = [' + "{t=0,position=[0,0,0]}," * 60_000 + "]\n"),
    "a campaign in a pipe": (["campaign", "pipe"], ""),
    "a page over a pipe": (["page", "m.toml", "--out", "pipe"], LINE),
}  # fmt: skip
BOUNDED = (
    "import resource, sys; resource.setrlimit(resource.RLIMIT_AS, (4 << 30,) * 2)\n"
    "from quadstep.commands.cli import main; main()"
)


@pytest.mark.parametrize("case", HOSTILE)
def test_the_command_line_refuses_hostile_files_in_bounded_time_and_memory(tmp_path, case):
    arguments, text = HOSTILE[case]
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "m.toml").write_text(text, encoding="utf-8")
    shown = in_terminal(*arguments, cwd=tmp_path, program=BOUNDED, TERM="dumb")  # where there are no bars
    assert shown.code == 2
    assert re.fullmatch(r"quadstep: error: [^\n]+\n", shown.text)
    assert len(shown.text) < 1100
