"""The command line: help, version, exit codes, and one line for every error."""

import re
from pathlib import Path

import pytest

from docs.site.reference.commands import commands
from quadstep import __version__, read_mission
from quadstep.commands.arguments import worded
from quadstep.commands.cli import COMMANDS, HEADINGS
from tests.commands import LINE, quadstep, quadstep_process, write


@pytest.fixture
def mission(tmp_path):
    return write(tmp_path, LINE)


def test_the_version_is_the_packages():
    run = quadstep("--version")
    first, engine, python = run.out.splitlines()
    assert (run.code, run.err, first) == (0, "", f"quadstep {__version__}")
    assert re.fullmatch(r"engine lanes: LLVM [\d.]+, [248] numbers in f64 at once, for [\w.-]+", engine)
    assert python.startswith("Python 3.")


def test_help_names_every_command():
    run = quadstep("--help")
    assert run.code == 0
    listed = re.findall(r"^(\S.*):$|^  ([\w-]+)  ", run.out.partition("--help")[2], re.MULTILINE)
    assert [command for _, command in listed if command] == list(COMMANDS.own)
    assert [heading for heading, _ in listed if heading] == list(HEADINGS.values()), "each once"
    assert "--version" in run.out


HELP = {
    "reproduce": ("--out", "--engine", "--overwrite", "lanes", "python", "out/paper", "report.html"),
    "fly": ("MISSION", "--out", "--engine", "--overwrite", "lanes", "python", "TOML", "flight.csv", "metrics.json"),
    "new": ("MISSION", "mission file"),
}


@pytest.mark.parametrize("command", HELP)
def test_the_help_of_a_command_names_its_options(command):
    run = quadstep(command, "--help")
    assert run.code == 0
    assert run.err == ""
    for part in HELP[command]:
        assert part.lower() in run.out.lower()


def test_every_help_says_the_exit_codes():
    for name, command in commands():
        text = " ".join(command.get_help(command.make_context(name, [], resilient_parsing=True)).split())
        assert re.search(r"Exit code 0: .* 2: bad input", text), name
    assert re.search(r"Exit codes .*: 0: .* 2: bad input.* 130: interrupted", " ".join(quadstep("--help").out.split()))


TYPERS = re.compile(r"\w <\w+[>\[]|\{[A-Z]|x[<>]=")
"""What typer makes of an argument: {FILE}, FILE <path>, and of a range."""


def test_the_help_shows_every_value_in_one_form():
    for name, command in commands():
        assert not TYPERS.search(command.get_help(command.make_context(name, [], resilient_parsing=True))), name


def test_the_help_of_fly_says_what_the_exit_codes_mean():
    run = quadstep("fly", "--help")
    assert re.search(r"0: completed.*2: bad input.*3: .*lost", " ".join(run.out.replace("│", " ").split()))


def test_without_a_command_the_help_is_shown_and_nothing_else_is_said():
    run = quadstep()
    assert "reproduce" in run.out
    assert "error" not in run.err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["fly"], "MISSION.toml is required (see quadstep fly --help)"),
        (
            ["tune", "m.toml"],
            "--budget is required, for instance --budget 2000 (flights) (see quadstep tune --help)",
        ),
        (["replay", "a.csv"], "--vehicle is required (see quadstep replay --help)"),
        (["completion"], "SHELL is required; allowed: bash, zsh, fish (see quadstep completion --help)"),
        (["fly", "a b", "it's"], '"it\'s": not expected; the command takes no further argument (see quadstep fly --help)'),
        (["flu"], "unknown command 'flu'; did you mean fly? (see quadstep --help)"),
        (["fyl"], "unknown command 'fyl'; did you mean fly? (see quadstep --help)"),
        (["it's"], 'unknown command "it\'s" (see quadstep --help)'),
        (["fly", "m.toml", "--out"], "--out: missing its value (see quadstep fly --help)"),
        (["fly", "m.toml", "--json=3"], "--json: takes no value (see quadstep fly --help)"),
    ],
)
def test_the_parsers_errors_are_worded_as_the_others(arguments, said):
    assert quadstep(*arguments).err == f"quadstep: error: {said}\n"


def test_a_file_that_may_not_be_read_is_named_first():
    assert (
        worded("Invalid value for 'MISSION.toml': path 'm.toml' is not readable.")
        == "m.toml: cannot be read: Permission denied"
    )


def test_an_unknown_engine_is_told_which_there_are():
    assert re.search("lanes.*python", quadstep("fly", "m.toml", "--engine", "gpu").err)


BAD_FILES = {
    "unknown key": (LINE + "[vehicle]\nmas = 1.0\n", "vehicle.mas"),
    "mass": (LINE + "[vehicle]\nmass = -1.0\n", "vehicle.mass"),
    "syntax": ("[path\n", "TOML"),
    "key with a line break": ('"a\\nb" = 1\n' + LINE, "unknown"),
    "missing recording": ('[path]\ntype = "recorded"\nfile = "nowhere.csv"\n', "nowhere.csv"),
    "too short": (LINE + "[simulation]\nduration = 0.001\n", "simulation.duration"),
}


@pytest.mark.parametrize("case", BAD_FILES)
def test_a_bad_mission_is_one_line_exit_code_2_and_nothing_is_written(tmp_path, case):
    content, key = BAD_FILES[case]
    (tmp_path / "mission.toml").write_text(content, encoding="utf-8")
    run = quadstep("fly", tmp_path / "mission.toml", "--out", tmp_path / "out")
    assert run.refused
    assert str(tmp_path / "mission.toml") in run.err
    assert key in run.err
    assert [entry.name for entry in tmp_path.iterdir()] == ["mission.toml"]


@pytest.mark.parametrize("name", ["nowhere.toml", "folder", "nowhere/mission.toml", "x" * 300])
def test_a_mission_that_cannot_be_read_is_one_line(tmp_path, name):
    (tmp_path / "folder").mkdir()
    run = quadstep("fly", tmp_path / name)
    assert run.refused
    assert "cannot be read" in run.err or "file not found" in run.err


def test_a_mission_with_a_flawed_recording_names_mission_file_and_line(tmp_path):
    (tmp_path / "path.csv").write_text("t,x,y,z\n0,0,0,0\n1,0,0,0\n1,0,0,0\n2,0,0,0\n", encoding="utf-8")
    (tmp_path / "mission.toml").write_text('[path]\ntype = "recorded"\nfile = "path.csv"\n', encoding="utf-8")
    run = quadstep("fly", tmp_path / "mission.toml", "--out", tmp_path / "out")
    assert run.refused
    assert all(part in run.err for part in ("mission.toml", "path.csv", "line 4", "repeats"))


def test_new_writes_a_mission_that_flies_once(tmp_path, no_figures):
    path = tmp_path / "first.toml"
    run = quadstep("new", path, "--paper")
    assert (run.code, run.err) == (0, "")
    assert str(path) in run.out.replace("\n", "")
    written = path.read_bytes()
    again = quadstep("new", path, "--paper")
    assert again.refused
    assert "already exists" in again.err
    assert path.read_bytes() == written
    assert quadstep("fly", path, "--out", tmp_path / "out").code == 0


@pytest.mark.parametrize(("options", "preset"), [((), "x500"), (("--vehicle", "crazyflie"), "crazyflie")])
def test_new_proposes_a_vehicle_that_flies(tmp_path, options, preset):
    path = tmp_path / "first.toml"
    assert quadstep("new", path, *options).code == 0
    mission = read_mission(path)
    assert mission.vehicle.preset == preset
    assert mission.plan().warnings == ()
    assert quadstep("new", tmp_path / "other.toml", "--paper", "--vehicle", "x500").refused


@pytest.mark.parametrize("place", ["nowhere/m.toml", "file/m.toml", "x" * 300])
def test_new_where_nothing_can_be_written_is_one_line(tmp_path, place):
    (tmp_path / "file").touch()
    assert quadstep("new", tmp_path / place).refused
    assert [entry.name for entry in tmp_path.iterdir()] == ["file"]


def test_a_process_of_its_own_says_the_same(tmp_path):
    run = quadstep_process("fly", "nowhere.toml", cwd=tmp_path)
    assert run.returncode == 2
    assert run.stdout == ""
    assert run.stderr == "quadstep: error: nowhere.toml: file not found\n"
    assert quadstep_process("--version").stdout.startswith(f"quadstep {__version__}\n")
    assert list(Path(tmp_path).iterdir()) == []


@pytest.mark.parametrize(("arguments", "said"), [
    (("linear", "mission.toml", "--controllers", ""), "--controllers: is empty"),
    (("new", "mission.toml", "--vehicle="), "--vehicle: is empty"),
    (("fly", ""), "an argument: is empty"),
    (("campaign", "campaign.toml", "--flights", "x"), "error: --flights: should be a whole number, not 'x' (see"),
    (("campaign", "campaign.toml", "--flights", "9" * 5000), "error: --flights: should be a smaller number, not '999"),
    (("campaign", "campaign.toml", "--engine", "floats"),
        "error: --engine: unknown value 'floats'; allowed: lanes, gpu, ray (see"),
    (("completion", "tcsh"), "error: SHELL: unknown value 'tcsh'; allowed: bash, zsh, fish (see"),
    (("serve", "--port", "70000"), "error: --port: should be from 0 to 65535, not 70000"),
    (("serve", "--port", "x"), "error: --port: should be a whole number, not 'x' (see"),
    (("study", "region", "--force", "inf"), "error: --force: should be from 0 to 1000, not inf"),
    (("fly", "--version"), "error: --version: is an option of quadstep alone: quadstep --version (see"),
    (("fly", "mission.toml", "--overwrit"), "error: unknown option '--overwrit'; did you mean --overwrite? (see"),
    (("fly", "mission.toml", "--sped"), "error: unknown option '--sped' (see"),
    (("vehicle", "fit", "sheet.toml", "--out", "a" * 300 + ".toml"), "cannot be written: File name too long"),
    (("linear", "examples/figure_eight.toml", "--controllers", "pid,nope"), "or your own FILE.py:NAME"),
    (("new", "mission.toml", "--vehicle", "x500", "--controller", "nope"), "or your own FILE.py:NAME"),
    (("fly", "examples/trust.toml"), "looks like a campaign, not a mission; `quadstep campaign` flies it"),
    (("fly", "examples/compare.toml"), "looks like a study, not a mission; `quadstep compare` takes it"),
    (("fly", "examples/crazyflie_pid.toml"), "looks like a controller alone, not a mission; a mission has a [path] too"),
    (("campaign", "examples/compare.toml"), "looks like a study, not a campaign; `quadstep compare` takes it"),
    (("tune", "examples/compare.toml", "--budget", "9"), "not a mission; `quadstep tune` takes a mission with a table [tune]"),
    (("fly", "examples/case1.toml", "--flight", "3"), "--flight: needs a campaign, and examples/case1.toml looks like"),
    (("fly", "examples/trust.toml", "--flight", "20000"), "--flight: should be from 0 to 19999, the last flight of"),
    (("fly", "examples/trust.toml", "--flight", "-1"), "--flight: should be from 0 to 19999, the last flight of"),
    (("tune", "examples/lissajous.toml", "--budget", "9"), 'gains = { "controller.k_x" = {} }; allowed: controller.k_x, '),
    (("vehicles", "examples/case1.toml"), "looks like a mission, not a vehicle file; `quadstep fly` takes it"),
    (("what-if", "px4-cascade", "MC_ROLL_P=2", "--vehicle", "examples/case1.toml"), "not a vehicle file; `quadstep fly`"),
    (("what-if", "px4-cascade", "MC_ROLL_P=2", "--vehicle", "boat"), "unknown preset 'boat'; allowed: crazyflie, "),
    (("vehicle", "fit", "examples/case1.toml"), "looks like a mission, not a data sheet; `quadstep fly` takes it"),
    (("serve", "--class", "examples/case1.toml"), 'looks like a mission, not a class; a class names one: mission = "FILE'),
    (("new", "mission.json"), "mission.json: missions are TOML; name a file that ends in .toml"),
    (("new",), "MISSION.toml is required (see"),
    (("--fast", "fly"), "error: unknown option '--fast'"),
    (("new", "-"), "-: missions are TOML; name a file that ends in .toml"),
])  # fmt: skip
def test_what_is_wrong_with_the_command_line_is_said_in_plain_words(arguments, said):
    run = quadstep(*arguments)
    assert run.refused
    assert said in run.err
