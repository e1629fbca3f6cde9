"""The template of `quadstep new`: it flies as it is, and every commented line shows the default it claims to show."""

import re
import tomllib

import pytest

from quadstep import UserError, fly, read_mission
from quadstep.flight.closed_loop import Outcome
from quadstep.mission.controllers import BacksteppingSection
from quadstep.mission.read import check_mission
from quadstep.mission.template import TEMPLATE, write_template
from quadstep.numbers import Table, flatten
from quadstep.report.publish import fingerprint

COMMENTED = re.compile(r"^# ([A-Za-z][\w.]*) = (.*)$")
EXAMPLES = {"vehicle.rotors.limits", "controller.nets.weights"}
"""Commented lines that show what can be written, not a default."""


def commented():
    """Dotted name and line of every line of the template; the name is empty where the line shows no key."""
    section = ""
    for line in TEMPLATE.splitlines():
        if line.startswith("["):
            section = line.partition("]")[0][1:]
        match = COMMENTED.match(line)
        yield (f"{section}.{match[1]}" if match else ""), line


def uncommented(wanted, controller="backstepping"):
    """The template with the commented lines taken in whose dotted name is `wanted`, and the names of these."""
    names = [name for name, _ in commented() if name and wanted(name)]
    text = "\n".join(line.removeprefix("# ") if name in names else line for name, line in commented())
    text = text.replace('type = "backstepping"', f'type = "{controller}"')
    return check_mission(tomllib.loads(text), "template"), names


def outside_the_path(name):
    return "." in name and not name.startswith(("path.", "."))


def every_default(name):
    """Keys of the paper's controller and of all else, without examples and keys of other controllers."""
    section, _, key = name.rpartition(".")
    return (
        outside_the_path(name)
        and name not in EXAMPLES
        and (section != "controller" or key in BacksteppingSection.model_fields)
    )


def test_every_commented_line_shows_its_default_under_the_completed_controller_too():
    mission, names = uncommented(lambda name: outside_the_path(name) and name not in EXAMPLES, "completed-backstepping")
    assert {"controller.P", "controller.weight_bounds"} <= set(names)
    plain, _ = uncommented(lambda _: False, "completed-backstepping")
    assert fingerprint([mission.plan()]) == fingerprint([plain.plan()])


def every_key(model, prefix=""):
    """Dotted names of all keys of a section and the sections inside it."""
    for key, field in model.model_fields.items():
        inside = getattr(field.annotation, "model_fields", None)
        yield from every_key(field.annotation, f"{prefix}{key}.") if inside else (f"{prefix}{key}",)


def test_the_template_is_a_mission():
    mission = check_mission(tomllib.loads(TEMPLATE), "template")
    assert mission.path.end == (20.0, 5.0, 10.0)
    assert mission.plan().warnings == ()


def test_every_commented_line_shows_its_default():
    mission, names = uncommented(every_default)
    assert len(names) > 25
    assert fingerprint([mission.plan()]) == fingerprint([check_mission(tomllib.loads(TEMPLATE), "template").plan()])


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


def test_the_template_shows_every_key_outside_the_path():
    mission, _ = uncommented(lambda _: False)
    shown = {name for name, _ in commented() if outside_the_path(name)}
    for section in ("vehicle", "controller", "start", "disturbance", "simulation", "limits"):
        keys = {f"{section}.{key}" for key in every_key(type(getattr(mission, section)))} - {"controller.type"}
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
    path = tmp_path / "mission.toml"
    write_template(path)
    assert read_mission(path).name == "My first flight"
    with pytest.raises(UserError, match=r"mission\.toml: exists already"):
        write_template(path)
    with pytest.raises(UserError, match="exists already"):
        write_template(tmp_path)
    assert [entry.name for entry in tmp_path.iterdir()] == ["mission.toml"]


@pytest.mark.parametrize("place", ["nowhere/mission.toml", "file/mission.toml", "x" * 300])
def test_a_place_that_cannot_be_written_is_refused(tmp_path, place):
    (tmp_path / "file").touch()
    with pytest.raises(UserError, match="cannot be written"):
        write_template(tmp_path / place)
    assert [entry.name for entry in tmp_path.iterdir()] == ["file"]


def test_the_template_for_a_real_vehicle_flies_and_every_line_of_it_is_known(tmp_path):
    write_template(tmp_path / "mission.toml", "x500")
    text = (tmp_path / "mission.toml").read_text()
    assert fly(read_mission(tmp_path / "mission.toml").plan()).outcome is Outcome.COMPLETED
    keys = re.compile(r"^# (?=(\[\[events\]\]|\w+ = ))", re.MULTILINE)
    everything = check_mission(tomllib.loads(keys.sub("", text)), "the template, uncommented")
    assert everything.plan().ticks.step == 0.002


def test_what_the_template_for_a_real_vehicle_calls_a_default_is_one(tmp_path):
    write_template(tmp_path / "mission.toml", "research-2.6kg")
    text = (tmp_path / "mission.toml").read_text()
    quiet = re.sub(r"# \[\[events\]\].*(?=\[simulation\])", "", text, flags=re.DOTALL)
    shown = re.sub(
        r"^# (?=\w+ = )", "", "\n".join(line for line in quiet.split("\n") if "example" not in line), flags=re.MULTILINE
    )
    bare = "\n".join(line for line in text.split("\n") if not line.startswith("#"))
    given, default = (check_mission(tomllib.loads(part), "the template") for part in (shown, bare))
    shown_numbers, numbers = (
        [leaf for leaf in flatten(mission.plan().parameters) if not isinstance(leaf, Table)] for mission in (given, default)
    )
    assert shown_numbers == pytest.approx(numbers, rel=0.01)
    assert given.plan().ticks == default.plan().ticks
    assert given.plan().loop == default.plan().loop


def test_an_unknown_vehicle_is_refused_with_the_known_ones(tmp_path):
    with pytest.raises(UserError, match="'boat' is not known; allowed: crazyflie"):
        write_template(tmp_path / "mission.toml", "boat")
    assert not list(tmp_path.iterdir())
