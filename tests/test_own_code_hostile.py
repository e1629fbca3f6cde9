"""Code of users that is wrong in every way: one line that names it, and nothing else."""

import json
import textwrap
from contextlib import chdir
from importlib.metadata import EntryPoint

import pytest

from quadstep import read_mission
from quadstep.control.opaque import opaque_law
from quadstep.io import doors
from quadstep.io.errors import UserError
from quadstep.io.places import place
from quadstep.io.user_code import NAMED, blamed, message_of
from quadstep.studies.campaign.schema import digests
from quadstep.studies.tuning.ground import read_request
from quadstep.studies.tuning.run import named_files
from tests.commands import quadstep, quadstep_process

LAW = """
import math
from dataclasses import dataclass
from typing import NamedTuple

from quadstep.interfaces.controller import Command, Condition, Controller
from quadstep.interfaces.gain import believed, gain, given, usual
from quadstep.numbers import Number, Vector, vector

class Gains(NamedTuple):
    mass: Number = believed("mass")
    gravity: Number = given(lambda model: model.gravity)
    GAIN

@dataclass(frozen=True)
class Hover(Controller):
    name = "hover"
    Gains = Gains
    MORE

    def start(self, measured, gains):
        START

    def law(self, memory, measured, reference, gains, t, period):
        torque = -0.001 * measured.rates
        LAW
"""
MISSION = """
name = "Hover"
vehicle = { preset = "x500" }
path = { type = "minimum-jerk", start = [0.0, 0.0, 5.0], end = [0.01, 0.0, 5.0], duration = 0.1 }
controller = { type = "law.py:Hover" }
"""
WELL = "return Command(gains.mass * gains.gravity, torque), memory"


def law(gain="k: Number = gain(1.0, '1/s', 'damping')", more="pass", start="return ()", law=WELL):
    """The text of a law."""
    text = LAW
    for spot, code in (("    GAIN", gain), ("    MORE", more), ("        START", start), ("        LAW", law)):
        space = spot[: len(spot) - len(spot.lstrip())]
        text = text.replace(spot, textwrap.indent(textwrap.dedent(code), space))
    return text


def mission(folder, text, kind="law.py:Hover"):
    """A mission file beside a law of this text."""
    (folder / "law.py").write_bytes(text if isinstance(text, bytes) else text.encode())
    path = folder / "hover.toml"
    path.write_text(MISSION.replace("law.py:Hover", kind))
    return path


def command(folder, *arguments):
    """What the command line does with them there, with no code of users' named before."""
    NAMED.clear()
    with chdir(folder):
        return quadstep(*arguments)


@pytest.mark.parametrize(
    ("said", "changes"),
    [
        ("law: should return a Command and the memory; it returns NoneType", {"law": "return None"}),
        ("law: should return a Command and the memory; it returns Command", {"law": "return Command(1.0, torque)"}),
        ("it returns a tuple of tuple, tuple", {"law": "return (1.0, torque), memory"}),
        ("the Command: should be made of numbers", {"law": "return Command('a', torque), memory"}),
        ("torque is a list", {"law": "return Command(1.0, [0.0, 0.0, 0.0]), memory"}),
        ("missing: torque.2", {"law": "return Command(1.0, vector(0.0, 0.0)), memory"}),
        ("law: the memory: should keep the shape", {"law": "return Command(1.0, torque), (1.0,)"}),
        ("law: the memory: should be made of numbers", {"law": "return Command(1.0, torque), None"}),
        ("start: the memory: should be made of numbers", {"start": "return {'a': 1.0}"}),
        (
            "start: the memory: 0 is a number, 0.0, where law.py:26 takes a vector",
            {"start": "return (0.0,)", "law": "return Command(gains.mass + memory[0][1], torque), memory"},
        ),
        (
            "start: the memory: it is a number, 0.0, where law.py:26 takes a vector",
            {"start": "return 0.0", "law": "return Command(gains.mass + memory[0], torque), memory"},
        ),
        (
            "start: the memory: it is a number, but `law` returns 3 numbers for it; both should return the same shape",
            {"start": "return 0.0", "law": "return Command(gains.mass, torque), memory + measured.rates"},
        ),
        (
            "start: the memory: 0 is a number, but `law` returns 3 numbers for it; both should return the same shape",
            {"start": "return (0.0,)", "law": "return Command(gains.mass, torque), (measured.rates,)"},
        ),
        (
            "law: the Command: thrust is nan at t = 0 s; it should be finite",
            {"law": "return Command(math.nan, torque), memory"},
        ),
        ("law: the Command: thrust is inf at t = 0 s", {"law": "return Command(1.0 / (t * gains.mass), torque), memory"}),
        (
            "law: should depend on its arguments alone; called again with them, thrust is 2 after 1. What changes",
            {
                "start": "type(self).calls = 0.0; return ()",
                "law": "type(self).calls += 1.0; return Command(self.calls, torque), memory",
            },
        ),
        ("enter: the memory: should be made of numbers", {"more": "enter = lambda *_: 'none'"}),
        ("enter: the memory: should keep the shape", {"more": "enter = lambda *_: (1.0,)"}),
        (
            "called again with them, thrust is 1.0000000002 after 1.0000000001",
            {
                "start": "type(self).calls = 1.0; return ()",
                "law": "type(self).calls += 1e-10; return Command(self.calls, torque), memory",
            },
        ),
        ("law: the Command: torque.1 is nan at t = 0 s", {"law": "return Command(1.0, vector(0.0, math.nan, 0.0)), memory"}),
        ("guide: the memory", {"more": "def guide(self, *given): pass"}),
        ("guide: should be declared as guide(self, memory, ", {"more": "rates = {'guide': 1.0}\ndef guide(self): pass"}),
        ("rates: should be a dict of sample times", {"more": "rates = 0.004"}),
        ("measures: should be a class", {"more": "measures = 5"}),
        ("also_measures: should be a tuple of names", {"more": "also_measures = 'age'"}),
        ("usual: should be given a number", {"gain": "k: Number = gain(usual('x', 2), '1/s', 'x')"}),
        ("prepare: should be declared as prepare(self, gains, model)", {"more": "@staticmethod\ndef prepare(gains): pass"}),
        ("its gains: should be made of numbers", {"more": "def prepare(self, gains, model): pass"}),
        ("its gains: should be made of numbers", {"gain": "k: Number = given(lambda model: None)"}),
        ("k: its default should be a number", {"gain": "k: Number = gain(None, '1', 'x')"}),
        ("k: its default should consist of finite numbers", {"gain": "k: Number = gain('a', '1', 'x')"}),
        ("k: its default should consist of finite numbers", {"gain": "k: Number = gain(math.nan, '1', 'x')"}),
        ("k: its default should consist of finite numbers", {"gain": "k: Number = gain(-1.0, '1', 'x')"}),
        ("k: its default should be one number, or 3", {"gain": "k: Vector = gain((1.0, 2.0), '1', 'x')"}),
        ("key, unit, meaning and symbol should be text", {"gain": "k: Number = gain(1.0, None, None)"}),
        ("cannot have the key 'type'", {"gain": "k: Number = gain(1.0, '1', 'x', key='type')"}),
        ("cannot have the key 'a.b'", {"gain": "k: Number = gain(1.0, '1', 'x', key='a.b')"}),
        ("k: its default 1 should lie within its range, 2", {"gain": "k: Number = gain(1.0, '1', 'x', low=2.0, high=3.0)"}),
        ("Gains.k: needs a type, as in `k: Number = gain(...)`", {"gain": "k = gain(1.0, '1', 'x')"}),
        ("Gains.k: a gain is a Number or a Vector, not a str", {"gain": "k: str = gain(1.0, '1', 'x')"}),
        ("low = 2 must be below high = 2", {"gain": "k: Number = gain(1.0, '1', 'x', low=2.0, high=2.0)"}),
        ("scale should be 'log' or 'linear'", {"gain": "k: Number = gain(1.0, '1', 'x', scale='wrong')"}),
        ("name 'Nope' is not defined", {"gain": "k: 'Nope' = gain(1.0, '1', 'x')"}),
        ("Gains: should be a NamedTuple, not None", {"more": "Gains = None"}),
        ("Gains: should be a NamedTuple", {"more": "Gains = {'k': 1.0}"}),
        ("rates: 'lawx' should be `law`, `guide` or another method", {"more": "rates = {'lawx': 0.1}"}),
        ("defaults: unknown gain 'nope'; allowed: mass, gravity, k", {"more": "defaults = {'nope': 1.0}"}),
    ],
)
def test_what_a_law_gives_or_declares_is_refused(tmp_path, said, changes):
    with pytest.raises(UserError, match=r"law\.py") as error:
        read_mission(mission(tmp_path, law(**changes))).plan()
    assert said in str(error.value)


WRONG_SHAPE = "def fly(t, measured, reference):\n    return 9.8, (0.0, 0.0)\n"
METRIC = "from quadstep.own import Metric\n\nclass Sum(Metric):\n    name = unit = 'm'\n    def start(self): return 0.0\n"


@pytest.mark.parametrize(("text", "kind", "said"), [
    ("def fly(t, measured):\n    return 1.0\n", "law.py:fly", "should be declared as fly(t, measured, reference) (law.py:1)"),
    (WRONG_SHAPE, "law.py:fly",
        "should return thrust and torque, like (9.8, (0.0, 0.0, 0.0)), not (9.8, (0.0, 0.0)) (law.py:1)"),
    (law(law="return 3.0"), "law.py:Hover", "law: should return a Command and the memory; it returns float (law.py:"),
    (METRIC + "    def add(self, sums): return sums\n    def value(self, sums): return sums\n", "law.py:Sum",
        "metrics: law.py:Sum: add: should be declared as add(self, sums, sample) (law.py:6)"),
])  # fmt: skip
def test_what_code_of_ones_own_takes_and_gives_is_named_by_file_and_line(tmp_path, text, kind, said):
    path = mission(tmp_path, text, kind)
    if kind.endswith("Sum"):
        controller = path.read_text().replace('"law.py:Sum"', '"geometric"')
        path.write_text(f'metrics = ["law.py:Sum"]\n{controller}')
    run = command(tmp_path, "fly", path.name, "--out", "out")
    assert run.refused, run
    assert said in run.err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("text", "said"), [
    ("import sys\nsys.exit()", "law.py:2: SystemExit; the line: sys.exit()"),
    ("raise GeneratorExit('x')", "law.py:1: GeneratorExit: x"),
    (b"x = 1\0", "law.py: SyntaxError"),
    ("import quadstepper", "No module named 'quadstepper'; the line: import quadstepper"),
    ("from quadstep.control.gain import gain",
        "No module named 'quadstep.control.gain'; what your own code needs is in quadstep.own (docs/extending.md)"),
    ("class E(Exception):\n    def __str__(self): raise ValueError('no')\nraise E", "law.py:3: E; the line: raise E"),
])  # fmt: skip
def test_what_happens_at_import_is_one_line(tmp_path, text, said):
    with pytest.raises(UserError) as error:
        read_mission(mission(tmp_path, text))
    assert said in str(error.value)


@pytest.mark.parametrize("kind", ["la\\u0000w.py:Hover", f"{'a' * 5000}.py:Hover", f"{'a' * 5000}:Hover"])
def test_names_that_no_file_can_have(tmp_path, kind):
    with pytest.raises(UserError, match="controller"):
        read_mission(mission(tmp_path, law(), kind))


def test_names_with_spaces(tmp_path):
    path = mission(tmp_path, law(), "my law é.py:Hover")
    (tmp_path / "law.py").rename(tmp_path / "my law é.py")
    assert read_mission(path).plan().ticks.last > 0
    assert place("law.py:Hover\n") is None


def test_an_error_of_the_user_is_told_from_others(tmp_path):
    with pytest.raises(SystemExit) as error:
        read_mission(mission(tmp_path, law(law="raise SystemExit"))).plan()
    assert blamed(error.value)
    assert message_of(error.value) == "SystemExit"


@pytest.mark.parametrize("changes", [
    {"law": "raise SystemExit"},
    {"more": "def conditions(self, gains, model): return [Condition('abc', 1.0, 2.0, 'x')]"},
    {"more": "def conditions(self, gains, model): return 'none'"},
    {"more": "def guide(self, memory): return memory"},
])  # fmt: skip
def test_no_traceback_unless_it_is_asked_for(tmp_path, changes):
    mission(tmp_path, law(**changes))
    run = command(tmp_path, "fly", "hover.toml", "--out", "out")
    assert run.code == 2
    assert run.err.count("\n") == 1
    assert "law.py" in run.err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["hover.toml", "law.py"]


def test_a_traceback_where_it_is_asked_for(tmp_path):
    mission(tmp_path, "x = 1 / 0")
    run = quadstep_process("fly", "hover.toml", "--out", "out", "--traceback", cwd=tmp_path)
    assert run.returncode == 2
    assert run.stderr.count("Traceback") == 1
    assert run.stderr.splitlines()[-1].startswith("quadstep: error: hover.toml: controller.type: ")


def test_what_user_code_prints_is_no_result(tmp_path):
    mission(tmp_path, "print('noise')\n" + law(law=f"print('more')\n{WELL}"))
    run = quadstep_process("fly", "hover.toml", "--out", "out", "--json", cwd=tmp_path)
    assert run.returncode == 0
    assert json.loads(run.stdout)["name"] == "Hover"
    assert "noise" in run.stderr


def test_a_function_makes_flights_alike(tmp_path):
    path = mission(tmp_path, "def controller(t, measured, reference):\n    return 20.0, (0.0, 0.0, 0.0)", "law.py:controller")
    assert read_mission(path).plan().loop == read_mission(path).plan().loop


class Unhashable(list):
    """May be called all the same."""

    def __call__(self, t, measured, reference):
        return 20.0, (0.0, 0.0, 0.0)


def test_a_callable_need_not_be_hashable():
    law = opaque_law(Unhashable(), "own")
    assert law().prepare(None, None) == law().prepare(None, None)


def test_a_name_that_looks_like_code_can_be_tuned(tmp_path):
    path = mission(tmp_path, law())
    path.write_text(path.read_text().replace('"Hover"', '"Case:one"') + "[tune.gains]\n'controller.k' = {}")
    assert named_files(read_request(path)) == (["law.py"], [])


@pytest.fixture
def entry_point(monkeypatch):
    """An installed entry point `hovering`, whose module is the standard library's textwrap."""
    found = EntryPoint("hovering", "textwrap:indent", doors.CONTROLLERS)
    monkeypatch.setattr("importlib.metadata.entry_points", lambda group: [found] if group == found.group else [])
    doors.registered.cache_clear()
    yield
    doors.registered.cache_clear()


@pytest.mark.usefixtures("entry_point")
def test_an_entry_point_is_no_file_beside_the_mission(tmp_path):
    path = mission(tmp_path, law(), "hovering")
    (tmp_path / "textwrap.py").write_text("1 / 0")
    assert read_mission(path).controller.controller.name == "indent"


@pytest.mark.usefixtures("entry_point")
def test_an_entry_point_is_part_of_an_identity(tmp_path):
    assert len(digests({"controller": {"type": "hovering"}}, tmp_path)) == 1
    assert digests({"controller": {"type": "pid"}}, tmp_path) == {}


LATE = """
from quadstep.numbers import where
return Command(where(t > 0.05, math.nan, gains.mass * gains.gravity), torque), memory
"""
DRAWN = """
from quadstep.numbers import where
return Command(where(gains.k > 2.0, math.nan, gains.mass * gains.gravity), torque), memory
"""


@pytest.mark.parametrize("engine", ["lanes", "python"])
def test_a_law_that_is_not_finite_later_ends_its_flight_and_is_named(tmp_path, engine):
    run = command(tmp_path, "fly", mission(tmp_path, law(law=LATE)).name, "--engine", engine)
    assert run.code == 3
    assert "Lost at 0.052 s: a number was no longer finite: the law's thrust was nan. The log" in run.out
    assert "the law’s thrust was nan" in (tmp_path / "out/hover/report.html").read_text()


def test_a_function_that_is_not_finite_at_once_is_refused_and_later_loses_the_flight(tmp_path):
    function = "def controller(t, measured, reference):\n    return 1.0, (0.0, float('inf') if t >= START else 0.0, 0.0)\n"
    path = mission(tmp_path, function.replace("START", "0.0"), "law.py:controller")
    run = command(tmp_path, "fly", path.name)
    assert (run.code, run.out, run.err.count("\n")) == (2, "", 1)
    assert "law.py:controller: ValueError: should return finite thrust and torque at t = 0 s, not (1.0, (0.0, inf," in run.err
    assert "(law.py:1)" in run.err
    (tmp_path / "law.py").write_text(function.replace("START", "0.05"))
    run = command(tmp_path, "fly", path.name)
    assert run.code == 3
    assert "a number was no longer finite: the law's torque.1 was inf. The log" in run.out


@pytest.mark.parametrize("drawn", ["", "vary = {'vehicle.mass' = {type = 'uniform', low = 1.9, high = 2.1}}\n"])
def test_a_law_that_is_never_finite_is_refused_by_every_command(tmp_path, drawn):
    mission(tmp_path, law(law="return Command(math.nan, torque), memory"))
    (tmp_path / "many.toml").write_text(f"mission = 'hover.toml'\nflights = 8\n{drawn}")
    for given in ("fly hover.toml", "export hover.toml", "campaign many.toml", "linear hover.toml", "page hover.toml"):
        run = command(tmp_path, *given.split())
        assert (run.code, run.out) == (2, "")
        assert run.err.count("\n") == 1
        assert "controller: law.py:Hover: law: the Command: thrust is nan at t = 0 s" in run.err
    assert not (tmp_path / "out").exists()


def test_a_drawn_flight_that_is_not_finite_at_once_is_lost_and_no_error(tmp_path):
    mission(tmp_path, law(law=DRAWN))
    (tmp_path / "many.toml").write_text(
        "mission = 'hover.toml'\nflights = 8\nvary = {'controller.k' = {type = 'uniform', low = 1.0, high = 3.0}}\n"
    )
    run = command(tmp_path, "campaign", "many.toml")
    assert (run.code, run.err) == (0, "")
    assert "not-finite" in run.out
    number = next(line.split()[-1] for line in run.out.splitlines() if "--flight" in line)
    run = command(tmp_path, "fly", "many.toml", "--flight", number)
    assert (run.code, run.err) == (3, "")
    assert "the law's thrust was nan" in run.out


@pytest.mark.parametrize(
    "returned", ["None", "3.0", "(1.0, 2.0)", "(1.0, (0.0, 0.0))", "('a', (0.0, 0.0, 0.0))", "[1, 2, 3, 4]"]
)
def test_a_function_that_returns_no_thrust_and_torque_is_told_what_to_return(tmp_path, returned):
    run = command(
        tmp_path, "fly", mission(tmp_path, f"def f(t, measured, reference):\n    return {returned}\n", "law.py:f").name
    )
    assert (run.code, run.out, run.err.count("\n")) == (2, "", 1)
    assert f"Error: should return thrust and torque, like (9.8, (0.0, 0.0, 0.0)), not {returned}" in run.err
    assert "error: law.py:f: " in run.err
    assert not (tmp_path / "out").exists()
