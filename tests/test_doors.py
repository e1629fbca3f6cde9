"""What another distribution registers is used by its name, like what the package has itself."""

import re

import pytest

from quadstep import Mission, UserError, fly
from quadstep.engines.engine import Engine
from quadstep.export.run import TARGETS, ExportRequest, export_mission
from quadstep.identify.logs.read import read_topics
from quadstep.io import doors, user_code
from quadstep.io.user_code import NAMED
from quadstep.mission.own_controller import AUTOPILOTS
from quadstep.report.panels import flight_jobs
from tests.commands import LINE, quadstep, write
from tests.doors import DOORS

MODULE = '''
from quadstep.bridges.autopilots import PilotedLaw
from quadstep.engines.fly import on_floats
from quadstep.identify.logs.series import Series, Topics
from quadstep.mission.own_controller import PilotedSection
from quadstep.report.drawing import FigureJob
from quadstep.report.panel import Panel


def greet(name: str) -> None:
    """Greet somebody."""
    print(f"hello {name}")


def flown(plans):
    return on_floats(plans)


def files(exported, texts):
    return {"law.txt": exported.name}


def fail(name: str) -> None:
    """Fail."""
    raise ValueError("no " + name)


NUMBER = 3


def read(path, wanted):
    return Topics({name: Series([0.0, 1.0], [2.0, 3.0]) for name in wanted}, 0)


def jobs(log, name, efforts):
    return [FigureJob("height", name, log.column("t"), [Panel("z", "m", {"z": log.column("z")})])]


def racer():
    return {"preset": "x500", "description": "a racer"}


class Section(PilotedSection):
    controller = PilotedLaw
    def matching(self, plan): ...
    def watch(self, told, first_wait): ...
'''

ENTRIES = """[quadstep.commands]
greet = tiny:greet
broken = tiny:absent
fail = tiny:fail
leave = leave:command
number = tiny:NUMBER
twice = tiny:greet
[quadstep.engines.flights]
slow = tiny:flown
wrong = tiny:greet
[quadstep.targets]
text = tiny:files
[quadstep.log_readers]
tiny = tiny:read
[quadstep.figures]
height = tiny:jobs
[quadstep.autopilots]
mine = tiny:Section
px4 = tiny:absent
wrong = tiny:greet
[quadstep.paths]
absent = no_such_module:Path
attribute = tiny:Section.connect
number = tiny:NUMBER
raises = raises:Path
[quadstep.vehicles]
racer = tiny:racer
heavy = raises:heavy
"""


@pytest.fixture
def tiny(tmp_path, monkeypatch):
    """An installed distribution with one thing for each door."""
    (tmp_path / "tiny.py").write_text(MODULE)
    (tmp_path / "leave.py").write_text("raise SystemExit(7)")
    (tmp_path / "raises.py").write_text("raise ValueError('no licence')")
    for name, entries in (("tiny", ENTRIES), ("other", "[quadstep.commands]\ntwice = other:twice\n")):
        about = tmp_path / f"{name}-1.5.dist-info"
        about.mkdir()
        (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.5\n")
        (about / "entry_points.txt").write_text(entries)
    monkeypatch.syspath_prepend(tmp_path)
    doors.registered.cache_clear()
    before = set(NAMED)
    NAMED.clear()
    yield tmp_path
    NAMED.clear()
    NAMED.update(before)
    doors.registered.cache_clear()


@pytest.mark.parametrize("door", DOORS, ids=lambda door: door.group)
def test_what_the_package_lists_is_there(door):
    assert door.names[: len(door.own)] == tuple(door.own)
    assert all(door.load(name) is not None for name in door.own)


@pytest.mark.usefixtures("tiny")
def test_a_command():
    assert quadstep("greet", "you").out == "hello you\n"
    assert "completion" not in quadstep("greet", "--help").out
    shown = quadstep("--help").out
    assert "greet" in shown
    assert "Greet somebody" in shown


@pytest.mark.usefixtures("tiny")
@pytest.mark.parametrize(("name", "why"), [
    ("broken", "broken, which tiny 1.5 registers for quadstep.commands, cannot be loaded: AttributeError"),
    ("leave", "leave, which tiny 1.5 registers for quadstep.commands, cannot be loaded: SystemExit: 7"),
    ("number", "number, which tiny 1.5 registers for quadstep.commands: should be a function or a class, not int"),
    ("twice", "other 1.5 and tiny 1.5 both register twice for quadstep.commands; uninstall one of them"),
    ("fail", "fail, which tiny 1.5 registers for quadstep.commands: ValueError: no argument"),
])  # fmt: skip
def test_a_broken_command_names_its_distribution_in_one_line_whatever_its_arguments(name, why):
    run = quadstep(name, "argument")
    assert run.refused
    assert why in run.err
    assert quadstep("--help").code == 0


@pytest.mark.usefixtures("tiny")
@pytest.mark.parametrize(("kind", "why"), [
    ("absent", "tiny 1.5 registers it, but there is no installed module no_such_module"),
    ("attribute", "attribute, which tiny 1.5 registers for quadstep.paths: should be module:name, not 'tiny:Sec"),
    ("number", "number, which tiny 1.5 registers for quadstep.paths: should be a subclass of quadstep.own.Path"),
    ("raises", "raises:Path, which tiny 1.5 registers: "),
    ("loop", "figure-eight, step, recorded, absent, number, raises, or your own"),
])  # fmt: skip
def test_a_broken_path_names_its_distribution(kind, why):
    with pytest.raises(UserError, match=re.escape(why)):
        Mission(path={"type": kind})


@pytest.mark.usefixtures("tiny")
def test_vehicles_lists_all_but_what_is_broken():
    run = quadstep("vehicles")
    assert run.code == 0
    assert "a racer" in run.out
    assert "heavy" not in run.out
    assert run.err.count("\n") == 1
    assert "warning: heavy: raises:heavy, which tiny 1.5 registers: " in run.err
    assert "no licence" in run.err
    with pytest.raises(UserError, match=r"unknown preset 'x50'; did you mean x500\? .* x500, heavy, racer, or your own"):
        Mission(vehicle={"preset": "x50"}, path={"type": "minimum-jerk", "end": [1.0, 0.0, 2.0]})


@pytest.mark.usefixtures("tiny")
def test_an_engine():
    mission = Mission(path={"type": "minimum-jerk", "end": [1.0, 0.0, 2.0], "duration": 0.1})
    assert (fly(mission, engine="slow").rows == fly(mission, engine="python").rows).all()
    assert Engine("slow") == "slow"
    with pytest.raises(UserError, match="allowed: lanes, python, c, slow, wrong"):
        fly(mission, engine="fast")


def test_an_export_target(tiny):
    done = export_mission(write(tiny, LINE), tiny / "out", ExportRequest("text"))
    assert done.files[0] == "law.txt"
    assert (tiny / "out" / "law.txt").read_text()
    assert quadstep("export", tiny / "mission.toml", "--target", "word").err.count("ardupilot, text") == 1


def test_a_reader_of_logs(tiny):
    assert read_topics(write(tiny, "anything", "log.tiny"), ["a.b"]).columns["a.b"].value == [2.0, 3.0]


@pytest.mark.usefixtures("tiny")
def test_a_figure():
    log = fly(Mission(path={"type": "minimum-jerk", "end": [1.0, 0.0, 2.0], "duration": 0.1}), engine="python")
    assert [job.name for job in flight_jobs(log, "Flight")][-1] == "height"


@pytest.mark.usefixtures("tiny")
def test_an_autopilot_but_not_by_a_name_that_is_taken():
    real = {"vehicle": {"preset": "x500"}, "path": {"type": "minimum-jerk", "end": [1.0, 0.0, 2.0], "duration": 1.0}}
    assert type(Mission(**real, controller={"type": "mine"}).controller).__module__ == "tiny"
    assert AUTOPILOTS.load("px4").__module__.startswith("quadstep.")
    with pytest.raises(UserError, match=r"wrong: the object registered for quadstep.autopilots should be a subclass"):
        Mission(**real, controller={"type": "wrong"})


@pytest.mark.usefixtures("tiny")
def test_where_no_code_of_users_is_run_that_of_others_is_not_loaded(monkeypatch):
    monkeypatch.setattr(user_code, "refused", "--no-user-code was given")
    with pytest.raises(UserError, match="user code is not run"):
        TARGETS.load("text")
    assert TARGETS.load("px4")
