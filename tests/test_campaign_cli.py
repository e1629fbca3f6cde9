"""`quadstep campaign`: its output, and one line for every mistake in a campaign file or on the command line."""

import re
import shlex
import subprocess
import sys

import pytest

from quadstep.studies.campaign.flyer import Flyer
from quadstep.studies.campaign.schema import read_campaign
from tests.campaigns import (
    MASS,
    NOISY,
    SHORT,
    WITHOUT_REPORT,
    ended,
    fly,
    manifest,
    no_report,
    refused,
    rows,
    started,
    written,
)
from tests.commands import quadstep
from tests.patience import PATIENCE

UNIFORM = '{type="uniform", low=0.5, high=1.0}'


def test_it_says_how_often_and_how_well_the_mission_succeeds(tmp_path):
    path = written(tmp_path, MASS, head="flights = 60\n")
    run = fly(path, tmp_path / "out")
    assert (run.code, run.err) == (0, "")
    only = "Success means reaching the end, however large the error."
    assert (
        f"All 60 flights reached the end (95 % interval 94 % to 100 %). No flight that reaches the end is graded. {only}"
        in run.out
    )
    assert "Position RMSE of the 60 completed flights: 50 % below" in run.out
    assert f"{tmp_path / 'out' / 'report.html'}" in run.out.replace("\n", "")
    worst = [one["flight"] for one in manifest(tmp_path / "out")["summary"]["worst"]]
    assert manifest(tmp_path / "out")["mission"]["controller"]["type"], "though the file does not say it"
    order = sorted(range(60), key=lambda i: (-rows(tmp_path / "out")["largest_error[m]"][i].as_py(), i))
    assert worst == order[:5]


@pytest.mark.parametrize("name", ["camp.toml", "my [red] camp.toml", "it's; a camp.toml"])
@pytest.mark.parametrize("columns", ["40", "80", "200"])
def test_the_command_it_prints_flies_the_worst_flight_again_as_it_stands(tmp_path, name, columns, monkeypatch):
    """To be copied from the screen into a shell."""
    monkeypatch.setenv("COLUMNS", columns)
    path = written(tmp_path / "deep" / "folder of mine", MASS, head="flights = 30\n", name=name)
    out = fly(path, tmp_path / "out").out
    worst = [one["flight"] for one in manifest(tmp_path / "out")["summary"]["worst"]]
    commands = [shlex.split(found) for found in re.findall(r"quadstep fly [^\n│]*--flight \d+", out)]
    assert commands == [["quadstep", "fly", str(path), "--flight", str(worst[0])]]


def test_the_number_of_flights_is_the_files_or_the_command_lines(tmp_path):
    path = written(tmp_path, MASS, head="flights = 20")
    assert "20 flights" in fly(path, tmp_path / "a").out
    assert "33 flights" in fly(path, tmp_path / "b", "--flights", 33).out


def test_the_folder_is_called_after_the_campaign(tmp_path, monkeypatch):
    path = written(tmp_path, MASS, head="flights = 5", name="mine.toml")
    monkeypatch.chdir(tmp_path)
    with no_report():
        assert quadstep("campaign", path).code == 0
    assert (tmp_path / "out" / "mine" / "campaign.json").exists()


def test_help_loads_nothing_heavy():
    code = (
        "import sys\nsys.argv = ['quadstep', 'campaign', '--help']\nfrom quadstep.commands import cli\n"
        "try:\n    cli.main()\nexcept SystemExit:\n    pass\n"
        "print([name for name in ('pyarrow', 'scipy', 'cma', 'ray', 'matplotlib', 'numpy') if name in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "--resume" in run.stdout
    assert run.stdout.endswith("[]\n"), run.stdout[-80:]


# The command line


@pytest.mark.parametrize("flights", ["0", "-1", "1.5", "many", "", "1e6", "nan"])
def test_a_number_of_flights_that_is_none(tmp_path, flights):
    path = written(tmp_path, MASS, head="flights = 20")
    run = fly(path, tmp_path / "out", f"--flights={flights}")
    refused(run, "--flights")
    assert not (tmp_path / "out").exists()


@pytest.fixture
def nothing_flown(monkeypatch):
    """Whoever gets as far as flying would do so for days."""

    def never(*_):
        raise AssertionError("it is flying")

    monkeypatch.setattr(Flyer, "fly", never)


@pytest.mark.usefixtures("nothing_flown")
@pytest.mark.parametrize("flights", [10**9 + 1, 2 * 10**9])
def test_more_flights_than_a_campaign_can_have(tmp_path, flights):
    path = written(tmp_path, MASS)
    refused(fly(path, tmp_path / "out", "--flights", flights), "--flights", "1000000000")
    refused(fly(written(tmp_path, MASS, head=f"flights = {flights}"), tmp_path / "out"), "flights", "1000000000")


@pytest.mark.usefixtures("nothing_flown")
def test_more_combinations_of_the_grids_than_a_campaign_can_have(tmp_path):
    grids = "".join(f'"path.end.{i}" = {{type="grid", low=0, high=1, count=1300}}\n' for i in range(3))
    refused(fly(written(tmp_path, grids), tmp_path / "out"), "flights")


def test_other_mistakes_on_the_command_line(tmp_path):
    path = written(tmp_path, MASS, head="flights = 20")
    refused(fly(path, tmp_path / "out", "--engine", "steam"), "steam")
    refused(fly(path, tmp_path / "out", "--fast"), "--fast")
    refused(quadstep("campaign"), "CAMPAIGN.toml")
    refused(fly(tmp_path / "none.toml", tmp_path / "out"), "none.toml", "file not found")
    refused(fly(tmp_path, tmp_path / "out"), tmp_path, "it is a folder")
    assert not (tmp_path / "out").exists()


# The file


MISTAKES = {
    "flights zero": ("flights = 0", "", ["flights", "greater than or equal to 1"]),
    "flights below zero": ("flights = -5", "", ["flights"]),
    "flights broken": ("flights = 1.5", "", ["flights"]),
    "flights text": ('flights = "5"', "", ["flights"]),
    "flights a truth": ("flights = true", "", ["flights"]),
    "flights huge": (f"flights = {10**30}", "", ["flights"]),
    "unknown key": ("flight = 5", "", ["flight:", "unknown key", "flights, mission"]),
    "unknown table": ("[varies]", "", ["varies", "unknown key"]),
    "seed below zero": ("seed = -1", "", ["seed"]),
    "seed huge": (f"seed = {2**63}", "", ["seed"]),
    "chunk small": ("chunk = 3", "", ["chunk", "16"]),
    "chunk huge": ("chunk = 100000000", "", ["chunk"]),
    "precision": ('precision = "f16"', "", ["precision", "f32"]),
    "score period zero": ("score_period = 0.0", "", ["score_period"]),
    "score period infinite": ("score_period = inf", "", ["score_period"]),
    "name of two lines": ('name = "a\\nb"', "", ["name"]),
    "failure unknown": ("[failure]\nrmse = 1.0", "", ["failure", "rmse", "position_rmse"]),
    "failure zero": ("[failure]\nposition_rmse = 0.0", "", ["failure", "position_rmse"]),
    "failure nan": ("[failure]\nposition_rmse = nan", "", ["failure", "position_rmse"]),
    "failure a number": ("failure = 1.0", "", ["failure"]),
    "correlated a table": ("[correlated]\nkeys = []", "", ["correlated"]),
    "no distribution": ("", '"vehicle.mass" = 5', ["vehicle.mass", "table"]),
    "no type": ("", '"vehicle.mass" = {low=1, high=2}', ["vehicle.mass", "type is required", "uniform"]),
    "empty": ("", '"vehicle.mass" = {}', ["vehicle.mass", "type is required"]),
    "nested, no type": ("", "vehicle.mass = {low=1, high=2}", ["vehicle.mass", "type is required"]),
    "nested, no distribution": ("", "vehicle.mass = 5", ["vary.vehicle"]),
    "unknown key of a distribution": ("", '"vehicle.mass" = {type="uniform", low=0, high=1, med=1}', ["mass.med: unknown"]),
    "unknown key of the mission": ("", f'"vehicle.mas" = {UNIFORM}', ["cannot vary vehicle.mas: unknown key; ", "mean mass?"]),
    "unknown table of the mission": ("", f'"vehicles.mass" = {UNIFORM}', ["vehicles", "unknown key", "vehicle"]),
    "unknown key deep in the mission": ("", f'"vehicle.rotors.arms" = {UNIFORM}', ["rotors.arms", "unknown key", "arm"]),
    "an entry that is not there": ("", f'"path.end.7" = {UNIFORM}', ["path.end.7", "0 to 2"]),
    "a list that is not there": ("", f'"start.velocity.0" = {UNIFORM}', ["start.velocity.0", "mission"]),
    "an empty part": ("", f'"vehicle..mass" = {UNIFORM}', ["vehicle..mass"]),
    "a number for a table": ("", f'"vehicle" = {UNIFORM}', ["vehicle"]),
    "an entry of a number": ("", f'"vehicle.mass.0" = {UNIFORM}', ["vehicle.mass.0"]),
    "inside a number": ("", f'"path.duration.x" = {UNIFORM}', ["path.duration.x"]),
    "a digit of another script": ("", f'"path.end.²" = {UNIFORM}', ["path.end.²"]),
    "an endless number": ("", f'"path.end.{"9" * 5000}" = {UNIFORM}', ["path.end.999"]),
    "an empty key": ("", f'"" = {UNIFORM}', ["not a key"]),
    "the seed of a real vehicle": ("", f'seed = {UNIFORM}', ["seed", "noise"]),
}  # fmt: skip


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_in_a_campaign_file_is_one_line_that_names_file_and_key(tmp_path, name):
    head, vary, parts = MISTAKES[name]
    path = tmp_path / "camp.toml"
    (tmp_path / "mission.toml").write_text(SHORT)
    split = head.partition("[")
    path.write_text(f'mission = "mission.toml"\n{split[0]}\n[vary]\n{vary}\n{split[1]}{split[2]}')
    line = refused(fly(path, tmp_path / "out", *([] if "flights" in head else ["--flights", 32])), ".toml", *parts)
    assert "pydantic" not in line
    assert "[key]" not in line
    assert not (tmp_path / "out").exists()


def test_its_answer_names_limits_and_what_of_the_path_is_not_flown(tmp_path):
    short = SHORT.replace("[simulation]", "[simulation]\nduration = 0.2")
    path = written(tmp_path, MASS + "[failure]\nlargest_error = 400.0\neffort_thrust = 1e9", short, "flights = 8\n")
    limits = "Limits: largest error 400 m and thrust effort 1e+09 N"
    said = f" %). {limits}; only the first 0.2 s of a path of 0.4 s are flown."
    run = fly(path, tmp_path / "out")
    assert said in " ".join(run.out.split())
    longer = written(tmp_path, '"path.duration" = {type="uniform", low=0.3, high=0.9}\n', short, "flights = 8\n")
    cut = "no flight lasts longer than 0.2 s, however long its path"
    assert read_campaign(longer).meaning == f" (success means reaching the end, however large the error; {cut})"
    alone = quadstep("fly", tmp_path / "mission.toml", "--out", tmp_path / "flight")
    assert " mm; only the first 0.2 s of a path of 0.4 s are flown." in " ".join(alone.out.split())
    report = (tmp_path / "flight" / "report.html").read_text(encoding="utf-8").replace("\u00a0", " ")
    assert "; only the first 0.2 s of a path of 0.4 s are flown" in report


MISSIONS = {
    "missing": ("", ["mission", "is required"]),
    "a number": ("mission = 5", ["mission: should be text, not 5: a mission file", "or a whole mission as a table"]),
    "an empty name": ('mission = ""', ["cannot be read"]),
    "a file that is not there": ('mission = "none.toml"', ["none.toml", "file not found"]),
    "a folder": ('mission = "."', ["cannot be read"]),
    "itself": ('mission = "camp.toml"', ["camp.toml", "looks like a campaign, not a mission"]),
    "no TOML": ('mission = "bad.toml"', ["bad.toml", "not valid TOML"]),
    "a mission that cannot be flown": ('mission = "ill.toml"', ["ill.toml", "path"]),
    "of an unknown key, inside": ('mission = {path = {type="step", end=[1,0,0]}, vehicel = {}}', ["vehicel", "unknown key"]),
    "an empty table": ("mission = {}", ["path", "is required"]),
    "a name with a zero": ('mission = "a\\u0000b.toml"', ["b.toml"]),
    "a long name": ('mission = "' + "x" * 5000 + '"', ["cannot be read"]),
}


@pytest.mark.parametrize("name", MISSIONS)
def test_a_campaign_without_a_mission_that_can_be_flown(tmp_path, name):
    text, parts = MISSIONS[name]
    (tmp_path / "bad.toml").write_text("[path")
    (tmp_path / "ill.toml").write_text('[path]\ntype = "spiral"\n')
    path = tmp_path / "camp.toml"
    path.write_text(f"{text}\nflights = 5\n[vary]\n{MASS}")
    refused(fly(path, tmp_path / "out"), *parts)
    assert not (tmp_path / "out").exists()


def test_files_that_are_something_else(tmp_path):
    mission = tmp_path / "mission.toml"
    mission.write_text(SHORT)
    refused(fly(mission, tmp_path / "out"), "mission.toml", "looks like a mission", "mission = ")
    for name, content in {
        "empty": b"",
        "binary": b"\xff\xfe\x00\x01",
        "broken": b"[vary",
        "deep": b"a = " + b"[" * 5000,
    }.items():
        (tmp_path / name).write_bytes(content)
        refused(fly(tmp_path / name, tmp_path / "out"), name)
    assert not (tmp_path / "out").exists()


# Extras


WITHOUT = "import sys\nsys.modules['%s'] = None\n" + WITHOUT_REPORT


def without(package, *arguments):
    return subprocess.run(
        [sys.executable, "-c", WITHOUT % package, *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE,
    )


def test_a_package_that_is_not_installed_is_one_line_that_says_how_to_install_it(tmp_path):
    cure = f"install it: {sys.executable} -m pip install 'cma>=4' 'pyarrow>=18' 'scipy>=1.14' 'tomlkit>=0.13'\n"
    path = written(tmp_path, MASS, head="flights = 5")
    run = without("pyarrow", "campaign", path, "--out", tmp_path / "out")
    assert (run.returncode, run.stdout) == (2, "")
    assert run.stderr == f"quadstep: error: `quadstep campaign` needs pyarrow; {cure}"
    written(tmp_path, '"vehicle.mass" = {type="sobol", low=1, high=2}', head="flights = 5")
    run = without("scipy", "campaign", path, "--out", tmp_path / "out")
    assert run.returncode == 2
    assert run.stderr.endswith(f" needs scipy; {cure}"), run.stderr
    assert not (tmp_path / "out").exists()


def test_flying_one_flight_again_needs_no_extra(tmp_path):
    path = written(tmp_path, MASS, head="flights = 5")
    run = without("pyarrow", "fly", path, "--flight", 1, "--out", tmp_path / "out")
    assert (run.returncode, run.stderr) == (0, "")


def test_a_campaign_needs_nothing_that_it_does_not_use(tmp_path):
    path = written(tmp_path, MASS, head="flights = 5")
    run = without("scipy", "campaign", path, "--out", tmp_path / "out")
    assert run.returncode == 0, run.stderr[-300:]


def test_nothing_but_one_line_is_on_the_error_stream(tmp_path):
    """Not even a warning of a library."""
    vary = '"vehicle.mass" = {type="log-normal", median=1, sigma=1000}'
    code, out, err = ended(started(written(tmp_path, vary, head="flights = 64"), tmp_path / "out"))
    assert (code, out) == (2, "")
    assert re.fullmatch(r"quadstep: error: [^\n]*vehicle.mass[^\n]*\n", err), err


def test_a_default_that_the_mission_does_not_write_can_vary(tmp_path):
    """The paper's controller is what flies a mission that names none; its gains are keys like any other."""
    path = written(tmp_path, '"controller.K_r1.0" = {type="uniform", low=2.5, high=3.5}', head="flights = 20")
    run = fly(path, tmp_path / "out")
    assert run.code == 0, run.err


def test_an_entry_of_a_default_list_can_vary(tmp_path):
    still = NOISY.replace("mean = [2.0, 0.0, 0.0]", "").replace("height = 6.0", "airspeed = 3.0")
    path = written(tmp_path, '"wind.mean.0" = {type="uniform", low=2.5, high=3.5}', still, "flights = 20")
    run = fly(path, tmp_path / "out")
    assert run.code == 0, run.err
