"""Every public command in real terminals and on broken streams: no traceback, nothing cut, the right exit code."""

import re

import pytest
from rich.cells import cell_len
from typer.main import get_command

from quadstep.commands import cli
from tests import campaigns, made_flights, made_logs, studies, tuning
from tests.autopilots import free_port, listening
from tests.commands import quadstep
from tests.needs import package
from tests.sheets import SHEET
from tests.terminals import ASCII, in_terminal, with_streams

CALM = """
vehicle = { preset = "research-2.6kg" }
controller = { type = "geometric" }
path = { type = "minimum-jerk", end = [0.0, 0.0, 0.0], duration = 0.5 }
simulation = { duration = 0.5, guidance_period = 0.002 }
"""
NAME = "Übung 飛行 ±"
REAL = f"name = '{NAME}'\n{campaigns.NOISY}"
TO_COPY = ("Report: ", "Results: ", "Wrote ", "Page: ", "Article: ", "Map: ", "  quadstep fly ", "quadstep: ", "Results in ")
"""Beginnings of lines that are never broken, because they hold a path or a command."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder in which every command has something to do."""
    folder = tmp_path_factory.mktemp("terminal")
    campaigns.written(folder, campaigns.MASS, head="flights = 6")
    tuning.written(folder, campaigns.SHORT + tuning.LAMBDA, "tune.toml")
    (folder / "real.toml").write_text(REAL, encoding="utf-8")
    (folder / "calm.toml").write_text(CALM, encoding="utf-8")
    studies.written(folder, studies.SMALLEST)
    (folder / "sheet.toml").write_text(SHEET, encoding="utf-8")
    mapping = made_flights.MAPPING.rpartition("setpoint")[0]  # without setpoints half as much is fitted
    (folder / "map.toml").write_text(mapping, encoding="utf-8")
    header, rows = made_flights.table(made_flights.logged(0)[0])
    made_flights.write(folder / "log.csv", header, rows[:900])
    (folder / "course.toml").write_text('[[tasks]]\nname = "a"\nasks = "Fly well, without losing the vehicle."\n')
    (folder / "chirp.bin").write_bytes(made_logs.excited(*made_logs.looped(), {}))
    return folder


COMMANDS = {
    "version": ["--version"],
    "fly": ["fly", "real.toml", "--signals", "position"],
    "vehicles": ["vehicles"],
    "vehicle": ["vehicles", "x500"],
    "certify": ["certify", "mission.toml"],
    "verify": ["verify", "--only", "5"],
    "page": ["page", "mission.toml"],
    "explain": ["explain"],
    "check": ["check", "a", "mission.toml", "--course", "course.toml"],
    "campaign": ["campaign", "camp.toml", "--overwrite"],
    "envelope": ["envelope", "mission.toml", "--x", "vehicle.mass=0.8:1.2:2", "--y", "disturbance.scale=0,1"],
    "tune": ["tune", "tune.toml", "--budget", "60"],
    "compare": ["compare", "study.toml", "--overwrite"],
    "reproduce": ["reproduce", "--overwrite"],
    "export": ["export", "calm.toml", "--overwrite"],
    "linear": ["linear", "calm.toml", "--overwrite"],
    "what-if": ["what-if", "crazyflie-pid", "pid_rate.yaw_kp=90", "--vehicle", "crazyflie", "--flights", "4", "--overwrite"],
    "prove": ["prove", "calm.toml"],
    "replay": ["replay", "log.csv", "--vehicle", "crazyflie", "--mapping", "map.toml"],
    "vehicle fit": ["vehicle", "fit", "sheet.toml", "--overwrite"],
    "completion": ["completion", "bash"],
    "advise": ["advise", "chirp.bin", "--overwrite"],
    "identify": ["identify", "log.csv", "--vehicle", "crazyflie", "--mapping", "map.toml", "--no-report", "--overwrite"],
}
"""What each command is tried with."""

BOTH = {"version", "fly", "vehicle", "certify", "export", "explain"}
"""Bars, tables, lists and prose: an ordinary run has the others in one terminal."""

WIDTHS = 80, pytest.param(200, marks=pytest.mark.thorough)

SAID = {
    "version": "quadstep 0",
    "fly": "rotors saturated",
    "vehicles": "research-2.6kg",
    "vehicle": "rotor.torque_coefficient",
    "certify": "Theorem 5.1",
    "verify": "vehicle.paper:rotor_map",
    "page": "Page: out/mission.html",
    "explain": "Article: out/article.html",
    "check": "a solved: Fly well",
    "campaign": "quadstep fly camp.toml --flight ",
    "envelope": "Map: out/mission-envelope/envelope.png",
    "tune": "Lambda1 [1/s]",
    "compare": "median (largest)",
    "reproduce": "What is undecided",
    "export": "geometric tracking on SE(3) in C99, f32",
    "linear": "one loop opened at a time",
    "what-if": "In gusts, at rest, and in a step in calm air",
    "prove": "Proved: every flight whose start is within",
    "replay": "mean error after",
    "vehicle fit": "Wrote sheet",
    "completion": "complete -o default -F _quadstep_completion quadstep",
    "identify": "IMU tilt about x",
    "advise": "margins of roll",
}
HERE = """
from tests.studies import here
from quadstep.studies.comparison import cost, jobs
jobs.drawing_pool, cost.REPEATS = here, 1
"""
"""A comparison without processes of its own, which measures once."""

SHORTENED = {
    "compare": HERE + "from quadstep.commands import cli\ncli.main()",
    "identify": """
from quadstep.identify import fit
search = fit.search
fit.search = lambda problem, point, weights, rounds, *more: search(problem, point, weights, 1, *more)
from quadstep.commands import cli
cli.main()
""",
}
"""Commands with less to compute than they have."""

STUDIES = {
    "completion --samples 100": """
from concurrent.futures import ThreadPoolExecutor
from quadstep.proofs.theory import completion, trials
from quadstep.proofs.theory import completion
completion.check_statements = lambda samples: [
    completion.StatementMargin(s.number, s.says, 0.0, samples, {"term": 1.0}) for s in completion.STATEMENTS
]
completion.drawing_pool = lambda: ThreadPoolExecutor(1)
completion.grid = lambda: []
completion.summarise = lambda *cells: trials.ComparisonSummary(0, 0, 0, 0, 0, 0, 1.0, 1.0, 1.0)
completion.draw_map = lambda folder, cells: (folder / "completion.svg").write_text("<svg></svg>")
from quadstep.commands import cli
cli.main()
""",
    "region --force 0.001 --torque 0.0001": """
from quadstep.commands import study
from quadstep.proofs.theory import edge
study.LOOPS = 200
fly_edge = edge.fly_edge
edge.fly_edge = lambda found, unknown: fly_edge(found, unknown=unknown)[:2]
from quadstep.commands import cli
cli.main()
""",
    "controllers --overwrite": f"""{HERE}
from pathlib import Path
from quadstep.studies.comparison import cells
cells.shipped_study = lambda: cells.read_study(Path("study.toml"))
from quadstep.commands import cli
cli.main()
""",
}
"""Studies with next to nothing to fly."""


def shown_of(folder, name, columns, **changes):
    """What a terminal has been shown of a command."""
    shown = in_terminal(*COMMANDS[name], cwd=folder, columns=columns, program=SHORTENED.get(name, ""), **changes)
    assert shown.code == 0, shown.text
    assert good(shown, columns)
    return shown


def good(shown, columns):
    """Whether what a terminal has been shown can be read."""
    assert "Traceback" not in shown.text
    assert "…" not in shown.text, shown.text
    for line in shown.lines:
        if not line.startswith(TO_COPY) and " " in line.strip():
            assert cell_len(line.rstrip()) <= columns, line
    return True


@pytest.mark.parametrize("name", COMMANDS)
def test_in_a_terminal_of_80_columns(folder, name):
    shown = shown_of(folder, name, 80)
    assert SAID[name] in "\n".join(shown.lines)


@pytest.mark.parametrize(
    "name", [name if name in BOTH else pytest.param(name, marks=pytest.mark.thorough) for name in COMMANDS]
)
def test_in_a_wide_and_dumb_terminal_of_ascii_without_colours(folder, name):
    shown = shown_of(folder, name, 200, **ASCII, TERM="dumb", NO_COLOR="1")
    assert SAID[name] in shown.text
    assert "\x1b" not in shown.raw
    assert "flying" not in shown.text, "a bar in a terminal that cannot draw one"
    assert shown.raw.isascii()


@pytest.mark.parametrize("columns", WIDTHS)
@pytest.mark.parametrize("study", STUDIES)
def test_a_study_in_a_terminal(folder, study, columns):
    shown = in_terminal("study", *study.split(), cwd=folder, program=STUDIES[study], columns=columns)
    assert shown.code == 0, shown.text
    assert good(shown, columns)


@pytest.mark.parametrize("columns", WIDTHS)
def test_setpoints_in_a_terminal(folder, columns):
    package("pymavlink")
    port = free_port()
    vehicle, stop = listening(port)
    words = f"serve-setpoints calm.toml --connect udpin:127.0.0.1:{port} --rate 20 --hold 0.2"
    shown = in_terminal(*words.split(), cwd=folder, columns=columns)
    stop.set()
    vehicle.close()
    assert shown.code == 0, shown.text
    assert good(shown, columns)
    assert re.search(r"Sent 1\d setpoints over 0.5 s, and the path's last point for 0.2 s.", " ".join(shown.text.split()))


def test_every_command_is_tried_in_a_terminal():
    elsewhere = {"", "new", "serve", "serve-setpoints", "study", *(f"study {one.split()[0]}" for one in STUDIES)}
    assert set(COMMANDS) - {"version"} | elsewhere == {" ".join(typed) for typed in paths(get_command(cli.built()))}


@pytest.mark.parametrize("name", ["version", "vehicle", "fly"])
def test_a_reader_who_leaves_early_is_no_error(folder, name):
    run = with_streams(*COMMANDS[name], cwd=folder, out="left", **ASCII)
    assert (run.code, "Traceback" in run.err, "roken pipe" in run.err) == (0, False, False)
    assert run.raw.endswith("\n")


@pytest.mark.parametrize("name", ["version", "vehicle", "fly", "help"])
def test_a_full_disk_is_one_line_and_exit_code_5(folder, name):
    run = with_streams(*(["campaign", "--help"] if name == "help" else COMMANDS[name]), cwd=folder, out="full")
    assert run.code == 5
    assert run.err.splitlines()[-1] == "quadstep: error: standard output: No space left on device"
    assert "Traceback" not in run.err


@pytest.mark.parametrize("err", ["full", "closed"])
def test_a_full_disk_is_exit_code_5_where_nobody_can_be_told(folder, err):
    assert with_streams("vehicles", cwd=folder, out="full", err=err).code == 5


@pytest.mark.parametrize(
    ("out", "err"), [("pipe", "full"), ("pipe", "closed"), ("closed", "pipe"), ("full", "full"), ("closed", "closed")]
)
def test_bad_input_is_exit_code_2_whatever_the_streams(folder, out, err):
    run = with_streams("fly", "nowhere.toml", cwd=folder, out=out, err=err)
    assert (run.code, run.raw) == (2, "")
    if err == "pipe":
        assert re.fullmatch(r"quadstep: error: nowhere.toml: [^\n]+\n", run.err)


def test_results_are_whole_where_every_stream_is_closed(folder):
    run = with_streams(*COMMANDS["fly"], "--out", "closed", cwd=folder, out="closed", err="closed")
    assert run.code == 0
    written = {path.name: path.stat().st_size for path in (folder / "closed").iterdir()}
    assert {"flight.csv", "metrics.json", "page.html"} <= set(written)
    assert (folder / "closed" / "flight.csv").read_text(encoding="utf-8").startswith("t[s],")


def test_what_a_stream_cannot_show_keeps_its_width(folder):
    run = with_streams(*COMMANDS["fly"], cwd=folder, **ASCII)
    assert (run.code, run.raw.splitlines()[0]) == (0, "?bung ???? ?")
    bars = [[at for at, sign in enumerate(line) if sign in "|+"] for line in run.raw.splitlines()[1:6]]
    assert bars == [bars[0]] * 5
    assert len(bars[0]) == 3


@pytest.mark.parametrize("columns", WIDTHS)
def test_new_in_a_terminal(tmp_path, columns):
    shown = in_terminal("new", "mission.toml", cwd=tmp_path, columns=columns)
    assert (shown.code, shown.text) == (0, "Wrote mission.toml. Fly it: quadstep fly mission.toml\n")


def test_new_in_a_terminal_of_40_columns_quotes_what_is_to_be_typed(tmp_path):
    shown = in_terminal("new", "my first $mission.toml", cwd=tmp_path, columns=40)
    assert (shown.code, shown.text) == (
        0, "Wrote my first $mission.toml. Fly it: quadstep fly 'my first $mission.toml'\n",
    )  # fmt: skip


@pytest.mark.parametrize("columns", WIDTHS)
def test_serve_in_a_terminal_ends_with_ctrl_c(folder, columns):
    shown = in_terminal("serve", ".", "--port", "0", cwd=folder, stop_at="Ctrl-C ends", columns=columns)
    assert shown.code == 0
    assert good(shown, columns)
    assert "Stopped." in shown.text


def test_ctrl_c_is_one_line_in_a_terminal(folder):
    shown = in_terminal("campaign", "camp.toml", "--flights", "200000", "--out", "much", cwd=folder, stop_at="flights")
    assert shown.code == 130
    assert good(shown, 80)
    assert re.search("quadstep: interrupted; (nothing was written|.* kept .*)\n$", shown.text)


def paths(command, before=()):
    """Every command there is, as what is typed."""
    yield before
    for name, one in getattr(command, "commands", {}).items():
        yield from paths(one, (*before, name))


@pytest.mark.parametrize("columns", [50, 80, 200])
@pytest.mark.parametrize("typed", list(paths(get_command(cli.built()))), ids=" ".join)
def test_help_names_every_option_whole_at_any_width(monkeypatch, typed, columns):
    monkeypatch.setenv("COLUMNS", str(columns))
    run = quadstep(*typed, "--help")
    assert (run.code, run.err) == (0, "")
    assert all(cell_len(line) <= columns for line in run.out.splitlines())
    assert not re.search(r"(?<=[a-z])(?<!toml)\.\.\.$", run.out, re.MULTILINE), "a sentence that is cut short"
    command = get_command(cli.built())
    for name in typed:
        command = command.commands[name]
    wanted = [name for parameter in command.params for name in parameter.opts if name.startswith("--")]
    assert set(wanted) | set(getattr(command, "commands", ())) <= set(run.out.split())
