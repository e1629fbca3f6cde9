"""Python files of users: found, run by content and apart from each other, blamed by line."""

import io
import shutil
import subprocess
import sys
import warnings

import pytest

from quadstep import read_mission
from quadstep.engines.fly import fingerprint
from quadstep.io import user_code
from quadstep.io.code_identity import own_code
from quadstep.io.errors import UserError
from quadstep.io.places import Place, digests, place
from quadstep.io.user_code import load
from tests.commands import quadstep, quadstep_process

pytestmark = pytest.mark.usefixtures("no_figures", "ungraded")

LAW = """
from dataclasses import dataclass
from typing import NamedTuple
from quadstep.interfaces.controller import Command, Controller, Measured
from quadstep.interfaces.gain import believed, gain
from quadstep.numbers import Number, Vector, vector
from helper import K
class Gains(NamedTuple):
    mass: Number = believed("mass")
    k: Number = gain(K, "1/s^2", "position")
@dataclass(frozen=True)
class Hover(Controller):
    name = "hover"
    Gains = Gains
    measures = Measured
    def law(self, memory, measured, reference, gains, t, period):
        up = 9.81 + gains.k * (reference.position[2] - measured.position[2]) - 2.0 * measured.velocity[2]
        return Command(gains.mass * up, -0.5 * measured.rates), memory
"""
MISSION = """
vehicle = { preset = "x500" }
path = { type = "step", start = [0.0, 0.0, 2.0], end = [0.0, 0.0, 2.0], time = 0.2, duration = 1.0 }
controller = { type = "law.py:Hover" }
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "law.py").write_text(LAW)
    (tmp_path / "helper.py").write_text("K = 4.0\n")
    (tmp_path / "mission.toml").write_text(MISSION)
    return tmp_path


@pytest.mark.parametrize(
    ("text", "where"),
    [
        ("law.py:Hover", "law.py"), ("laws/my law.py:X", "laws/my law.py"),
        ("../law.py:Hover", "../law.py"), ("a.b.c:D", "a.b.c"),
        ("Case 1: down", None), ("law.py", None), (":X", None), ("law.py:", None), ("law.py:a.b", None), (7, None),
    ],
)  # fmt: skip
def test_what_names_a_thing_of_the_users(text, where):
    found = place(text)
    assert (found.where if found else None) == where


def test_a_file_is_run_once_for_each_content(folder):
    first = load(Place("law.py", "K"), folder)
    assert (first, load(Place("law", "Hover"), folder)) == (4.0, load(Place("law.py", "Hover"), folder))
    before = digests(Place("law.py", "Hover"), folder)
    (folder / "helper.py").write_text("K = 5.0\n")
    assert load(Place("law.py", "K"), folder) == 5.0
    assert digests(Place("law.py", "Hover"), folder) != before
    (folder / "unrelated.py").write_text("x = 1\n")
    assert load(Place("law.py", "K"), folder) == 5.0


FUNCTION = """
def controller(t, measured, reference):
    return 20.0, (0.0, 0.0, 0.0)
"""


def plan_of(folder, law="law.py:Hover"):
    """The flight of this law."""
    (folder / "other.toml").write_text(MISSION.replace("law.py:Hover", law))
    return read_mission(folder / "other.toml").plan(folder)


def test_a_flight_is_identified_by_what_the_users_code_says_wherever_it_is(folder, tmp_path_factory):
    before = fingerprint([plan_of(folder)])
    (folder / "law.py").write_text(LAW + "# a comment\n")
    assert fingerprint([plan_of(folder)]) == before
    moved = tmp_path_factory.mktemp("moved")
    shutil.copytree(folder, moved, dirs_exist_ok=True)
    assert fingerprint([plan_of(moved)]) == before
    (folder / "helper.py").write_text("K = 2.0 + 2.0\n")
    assert fingerprint([plan_of(folder)]) != before


def test_so_is_that_of_a_function(folder):
    (folder / "function.py").write_text(FUNCTION)
    before = own_code(plan_of(folder, "function.py:controller").loop)
    (folder / "function.py").write_text(FUNCTION.replace("20.0", "21.0"))
    assert len(before) == 1
    assert before != own_code(plan_of(folder, "function.py:controller").loop)


HOLDING = """
from dataclasses import dataclass
from functools import cache, partial
import numpy as np
from helper import K
def made(k):
    def controller(t, measured, reference):
        def up():
            return k
        return up(), (0.0, 0.0, 0.0)
    return controller
def called(t, measured, reference, k):
    return k, (0.0, 0.0, 0.0)
def shared(t, measured, reference):
    return TABLE["up"] * K, (0.0, 0.0, 0.0)
class Held:
    def __init__(self, k):
        self.k = k
    def __call__(self, t, measured, reference):
        return self.k, (0.0, 0.0, 0.0)
def typed(k):
    class Up:
        up = k
        @staticmethod
        def controller(t, measured, reference):
            return Up.up, (0.0, 0.0, 0.0)
    return Up.controller
@dataclass(frozen=True)
class Gains:
    k: object
TABLE = {"up": VALUE}
closure, inner, array = made(VALUE), made({1: [VALUE]}), made(np.full(2000, VALUE))
default, wrapped = partial(called, k=VALUE), made(cache(made(VALUE)))
instance, own, other = Held(VALUE), made(Gains(VALUE)), typed(VALUE)
"""


@pytest.mark.parametrize("name", ["closure", "inner", "array", "default", "wrapped", "instance", "own", "other", "shared"])
def test_laws_of_one_code_are_told_apart_by_the_constants_that_they_hold(folder, name):
    """What laws of one factory hold is read from outside here, so that their files are equal."""
    (folder / "holding.py").write_text("import json\nVALUE = json.load(open(__file__[:-10] + 'value.json'))\n" + HOLDING)
    found = {}
    for value in (20.0, 21.0, 20.0):
        (folder / "value.json").write_text(str(value))
        user_code.families.clear()
        for one in [one for one in sys.modules if one.startswith(user_code.PREFIX)]:
            del sys.modules[one]
        found.setdefault(value, set()).add(own_code(plan_of(folder, f"holding.py:{name}").loop))
    assert [len(one) for one in found.values()] == [1, 1]
    assert found[20.0] != found[21.0]


def test_two_functions_of_one_file_do_not_replace_one_another(folder):
    (folder / "function.py").write_text(FUNCTION + FUNCTION.replace("controller", "other").replace("20.0", "21.0"))
    assert len({own_code(plan_of(folder, f"function.py:{name}").loop) for name in ("controller", "other")}) == 2


FACTORY = """
from dataclasses import dataclass
from quadstep.control.geometric import Geometric
def made(k):
    @dataclass(frozen=True)
    class Scaled(Geometric):
        name = "scaled"
        def law(self, memory, measured, reference, gains, t, period):
            command, memory = super().law(memory, measured, reference, gains, t, period)
            return command._replace(torque=k * command.torque), memory
    return Scaled
good, bad = made(1.0), made(9.0)
"""


def test_two_classes_of_one_factory_have_no_grade_in_common(folder):
    """Grades are cached by this: the second law, with 11 degrees of phase margin, was called sound with the first one's 36."""
    (folder / "factory.py").write_text(FACTORY)
    assert fingerprint([plan_of(folder, "factory.py:good")]) != fingerprint([plan_of(folder, "factory.py:bad")])


def test_what_a_script_says_counts(folder):
    """As does what a notebook does, whose functions are in no file."""
    (folder / "script.py").write_text(
        "import sys\nfrom pathlib import Path\nfrom quadstep.io.code_identity import own_code\n"
        "from quadstep import read_mission\nfrom quadstep.control import flying\n"
        "def law(k):\n    def controller(t, measured, reference):\n        return k, (0.0, 0.0, 0.0)\n    return controller\n"
        "class Own:\n    held = law(float(sys.argv[1]))\n"
        "if len(sys.argv) > 2:\n    del __file__\n"
        "print(sorted(own_code(Own())))\n"
    )

    def said(*arguments):
        run = subprocess.run([sys.executable, "script.py", *arguments], cwd=folder, capture_output=True, text=True, check=True)
        return run.stdout

    first = said("4.0")
    assert said("4.0") == first
    assert len({first, said("8.0"), said("4.0", "notebook")}) == 3


def test_two_folders_have_their_own_helpers(folder, tmp_path_factory):
    other = tmp_path_factory.mktemp("other")
    (other / "law.py").write_text("def late():\n    import helper\n    return helper.K\n")
    (other / "helper.py").write_text("K = 7.0\n")
    assert load(Place("law.py", "late"), other)() == 7.0
    assert load(Place("law.py", "K"), folder) == 4.0
    assert "helper" not in sys.modules


def test_an_installed_module_is_found_and_has_a_digest(tmp_path):
    assert load(Place("json.decoder", "JSONDecoder"), tmp_path).__name__ == "JSONDecoder"
    assert digests(Place("json.decoder", "JSONDecoder"), tmp_path) == digests(Place("json", "x"), tmp_path)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("9.81 +", "1 / 0 +"), "law.py:17: ZeroDivisionError: division by zero; the line: up = 1 / 0 + gains.k"),
        (("-0.5 * measured.rates", "0.0"), "law.py:Hover: law: the Command: should keep the shape it has at the start"),
        (("import K", "import Q"), "law.py:7: ImportError: cannot import name 'Q'"),
        (("Gains = Gains", "Gains = nothing"), "law.py:14: NameError: name 'nothing' is not defined"),
        (("class Hover(", "class Hover(("), "SyntaxError"),
        (("measures = Measured", "measures = Gains"), "provides a Gains; this one provides a Measured"),
        (("    def law", "    def other"), "has no method `law`"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_file_is_one_line(folder, change, said):
    text = (folder / "law.py").read_text()
    (folder / "law.py").write_text(text.replace(*change))
    run = quadstep("fly", folder / "mission.toml", "--out", folder / "out", "--engine", "python")
    assert run.refused, run
    assert said in run.err
    assert not (folder / "out").exists()


def test_missions_run_only_what_they_name_and_not_where_that_is_refused(folder, monkeypatch):
    run = quadstep_process("fly", "mission.toml", "--out", "out", cwd=folder)
    assert run.returncode == 0, run.stderr
    run = quadstep_process("fly", "mission.toml", "--no-user-code", "--out", "two", cwd=folder)
    assert (run.returncode, run.stdout) == (2, "")
    assert "user code is not run: --no-user-code was given" in run.stderr
    monkeypatch.setattr(user_code, "refused", "here")
    with pytest.raises(UserError, match="is not run: here"):
        load(Place("law.py", "K"), folder)


def test_a_function_is_a_controller(folder):
    (folder / "law.py").write_text(
        "def hover(t, measured, reference):\n"
        "    up = 9.81 + 4.0 * (reference.position[2] - measured.position[2]) - 2.0 * measured.velocity[2]\n"
        "    return 2.0 * up, -0.5 * measured.rates\n"
    )
    mission = folder / "mission.toml"
    mission.write_text(MISSION.replace("law.py:Hover", "law.py:hover"))
    run = quadstep("fly", mission, "--out", folder / "out")
    assert run.code == 0, run.err
    (folder / "law.py").write_text("def hover(t, measured, reference):\n    raise ValueError('no idea')\n")
    run = quadstep("fly", mission, "--out", folder / "out", "--overwrite")
    assert run.refused
    assert "law.py:2: ValueError: no idea" in run.err


@pytest.mark.parametrize(("asked", "shown"), [([], ["law.py"]), (["default"], ["law.py", "numpy.py"])])
def test_a_command_shows_warnings_of_libraries_to_who_asks(asked, shown, monkeypatch):
    monkeypatch.setattr(sys, "warnoptions", asked)
    monkeypatch.setattr(user_code, "FILES", {"law.py"})
    seen = []
    monkeypatch.setattr(warnings, "showwarning", lambda message, kind, file, *_: seen.append(file))
    quadstep("--version")
    warnings.simplefilter("always")
    monkeypatch.setattr(sys, "stderr", stderr := io.StringIO())
    for file in ("law.py", "numpy.py"):
        warnings.warn_explicit("divided by zero", RuntimeWarning, file, 7)
    assert seen + [line.partition(":")[0] for line in stderr.getvalue().splitlines()] == shown
