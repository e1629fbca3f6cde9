"""The template of `quadstep new`: it flies as it is, and every commented line shows the default it claims to show."""

import re
import tomllib

import pytest

from quadstep import UserError, fly, read_mission
from quadstep.control.registry import controllers
from quadstep.engines.fly import fingerprint
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.controller import Measured
from quadstep.mission.read import check_mission
from quadstep.mission.template import template, write_template
from quadstep.numbers import Table, flatten
from quadstep.vehicle.paper import State

COMMENTED = re.compile(r"^# ([A-Za-z][\w.]*) = (.*)$")
TEMPLATE = template()
EXAMPLES = {"vehicle.rotors.limits", "controller.nets.weights"}
"""Commented lines that show what can be written, not a default."""

USUAL = "geometric", "backstepping", "mpc", "raptor"
"""Laws whose templates an ordinary run flies: with nets, with periods of their own, and without either."""


def commented(text=TEMPLATE):
    """Dotted name and line of every line of the template; the name is empty where the line shows no key."""
    section = ""
    for line in text.splitlines():
        if line.startswith("["):
            section = line.partition("]")[0][1:]
        match = COMMENTED.match(line)
        yield (f"{section}.{match[1]}" if match else ""), line


def test_the_template_of_a_vehicle_says_where_the_keys_of_each_path_are_shown():
    (other,) = (line for line in template("x500").splitlines() if line.startswith("# Others: "))
    assert "`quadstep new FILE --paper`" in other  # which writes TEMPLATE
    for kind in ("minimum-jerk", "waypoints", "circle", "figure-eight", "step", "recorded"):
        assert f'type = "{kind}"' in TEMPLATE


def uncommented(wanted, controller="backstepping"):
    """The template with the commented lines taken in whose dotted name is `wanted`, and the names of these."""
    lines = list(commented(template(controller=controller)))
    names = [name for name, _ in lines if name and wanted(name)]
    text = "\n".join(line.removeprefix("# ") if name in names else line for name, line in lines)
    return check_mission(tomllib.loads(text), "template"), names


def outside_the_path(name):
    return "." in name and not name.startswith(("path.", "."))


def every_default(name):
    """Keys outside the path, without examples."""
    return outside_the_path(name) and name not in EXAMPLES


def every_key(model, prefix=""):
    """Dotted names of all keys of a section and the sections inside it."""
    for key, field in model.model_fields.items():
        inside = getattr(field.annotation, "model_fields", None)
        yield from every_key(field.annotation, f"{prefix}{key}.") if inside else (f"{prefix}{key}",)


def test_the_template_is_a_mission():
    mission = check_mission(tomllib.loads(TEMPLATE), "template")
    assert mission.path.end == (20.0, 5.0, 10.0)
    assert mission.plan().warnings == ()


@pytest.mark.parametrize("controller", controllers(State))
def test_every_commented_line_shows_its_default(controller):
    mission, names = uncommented(every_default, controller)
    assert mission.controller.type == controller
    assert len(names) > 20
    plain, _ = uncommented(lambda _: False, controller)
    assert fingerprint([mission.plan()]) == fingerprint([plain.plan()])


@pytest.mark.parametrize("name", ["path.yaw_start", "path.yaw_end"])
def test_commented_keys_of_the_path_show_their_defaults(name):
    mission, names = uncommented(lambda candidate: candidate == name)
    assert names == [name]
    assert mission == check_mission(tomllib.loads(TEMPLATE), "template")


def test_the_examples_of_limits_and_weights_are_valid():
    mission, names = uncommented(lambda name: name in EXAMPLES)
    assert set(names) == EXAMPLES
    assert mission.vehicle.rotors.limits == (0.0, 80.0)
    assert mission.controller.nets.weights == "weights.json"


@pytest.mark.parametrize("controller", controllers(State))
def test_the_template_shows_every_key_outside_the_path(controller):
    mission, _ = uncommented(lambda _: False, controller)
    shown = {name for name, _ in commented(template(controller=controller)) if outside_the_path(name)}
    for section in ("vehicle", "controller", "start", "disturbance", "simulation", "limits"):
        keys = {f"{section}.{key}" for key in every_key(type(getattr(mission, section)))}
        keys -= {"controller.type", "simulation.loop_periods"}  # the latter for controllers with further loops
        assert keys <= shown, keys - shown


def test_the_other_paths_of_the_template_are_valid():
    """The commented waypoints and recording, each in place of the minimum-jerk path."""
    lines = TEMPLATE[TEMPLATE.index("# Other paths") : TEMPLATE.index("[vehicle]")].splitlines()
    plain = [line.removeprefix("#").removeprefix(" ") for line in lines]
    for kind in ("waypoints", "recorded"):
        first = next(i for i, line in enumerate(plain) if line.startswith(f'type = "{kind}"'))
        last = next(i for i in range(first, len(plain)) if not plain[i].strip())
        mission = check_mission(tomllib.loads("[path]\n" + "\n".join(plain[first:last])), "template")
        assert mission.path.type == kind
    for kind in ("circle", "figure-eight"):
        assert any(line.startswith(f'type = "{kind}"') for line in plain)


def test_the_template_is_written_once_and_never_over_something(tmp_path):
    path = tmp_path / "still.toml"
    write_template(path)
    assert read_mission(path).name == "still"
    with pytest.raises(UserError, match=r"still\.toml: already exists"):
        write_template(path)
    with pytest.raises(UserError, match="already exists"):
        write_template(tmp_path)
    assert [entry.name for entry in tmp_path.iterdir()] == ["still.toml"]


@pytest.mark.parametrize(
    "controller", [one if one in USUAL else pytest.param(one, marks=pytest.mark.thorough) for one in controllers(Measured)]
)
def test_the_template_for_a_real_vehicle_flies(tmp_path, controller):
    write_template(tmp_path / "mission.toml", "x500", controller)
    assert fly(read_mission(tmp_path / "mission.toml").plan()).outcome is Outcome.COMPLETED


@pytest.mark.parametrize("controller", controllers(Measured))
def test_every_line_of_the_template_for_a_real_vehicle_is_known(tmp_path, controller):
    write_template(tmp_path / "mission.toml", "x500", controller)
    text = (tmp_path / "mission.toml").read_text()
    keys = re.compile(r"^# (?=(\[\[events\]\]|[\w.]+ = ))", re.MULTILINE)
    text = keys.sub("", "\n".join(line for line in text.split("\n") if "# example: " not in line))
    everything = check_mission(tomllib.loads(text), "the template, uncommented")
    assert everything.controller.type == controller
    assert everything.plan().ticks.step == min(0.002, everything.simulation.control_period)


@pytest.mark.parametrize("controller", controllers(Measured))
@pytest.mark.parametrize("preset", ["research-2.6kg", "crazyflie"])
def test_what_the_template_for_a_real_vehicle_calls_a_default_is_one(tmp_path, preset, controller):
    write_template(tmp_path / "mission.toml", preset, controller)
    text = (tmp_path / "mission.toml").read_text()
    quiet = re.sub(r"# \[\[events\]\].*(?=\[simulation\])", "", text, flags=re.DOTALL)
    shown = re.sub(
        r"^# (?=[\w.]+ = )", "", "\n".join(line for line in quiet.split("\n") if "example" not in line), flags=re.MULTILINE
    )
    bare = "\n".join(line for line in text.split("\n") if not line.startswith("#"))
    given, default = (check_mission(tomllib.loads(part), "the template") for part in (shown, bare))
    shown_numbers, numbers = (
        [leaf for leaf in flatten(mission.plan().parameters) if not isinstance(leaf, Table)] for mission in (given, default)
    )
    assert shown_numbers == pytest.approx(numbers, rel=1e-3)
    assert given.plan().ticks == default.plan().ticks
    assert given.plan().loop == default.plan().loop


def test_an_unknown_vehicle_is_refused_with_the_known_ones(tmp_path):
    with pytest.raises(UserError, match="unknown value 'boat'; allowed: crazyflie"):
        write_template(tmp_path / "mission.toml", "boat")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("preset", "name"), [(None, "geometric"), ("x500", "completed-backstepping"), ("x500", "boat")])
def test_a_controller_that_this_vehicle_does_not_fly_is_refused_with_those_that_it_does(tmp_path, preset, name):
    allowed = ", ".join(controllers(Measured if preset else State))
    other = {"geometric": "real vehicles", "completed-backstepping": "the paper's plant"}.get(name)
    said = f"{name} flies only {other}" if other else f"unknown value '{name}'"
    with pytest.raises(UserError, match=f"--controller: {said}; allowed: {allowed}"):
        write_template(tmp_path / "mission.toml", preset, name)
    assert not list(tmp_path.iterdir())
