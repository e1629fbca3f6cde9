"""How far a number travels from a mission's text to the plan: the functions of the package that are passed it."""

import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

import quadstep
from quadstep.mission.read import read_mission

SOURCE = str(Path(quadstep.__file__).parent)
UNUSUAL = 7.015625
DEEPEST = 6

MOST_READING, MOST_PLANNING = 7, 19
"""Ceilings, to be lowered with the counts, which were 22 and 29 when a kind of mission was chosen in three places."""

MISSION = f"""
vehicle.preset = "x500"
path = {{ type = "circle", radius = 2.0, period = 8.0 }}
controller = {{ type = "geometric", k_x = {UNUSUAL!r} }}
"""


def parts(value):
    """What a mapping, a sequence, or an object of the package holds."""
    if isinstance(value, Mapping):
        return list(value.values())
    if isinstance(value, list | tuple):
        return value
    if isinstance(value, type) or not type(value).__module__.startswith("quadstep"):
        return []
    slots = [name for kind in type(value).__mro__ for name in getattr(kind, "__slots__", ())]
    return [*getattr(value, "__dict__", {}).values(), *(getattr(value, name) for name in slots if hasattr(value, name))]


def holds(value, depth=DEEPEST):
    """Whether the number is somewhere inside."""
    if isinstance(value, float):
        return value == UNUSUAL
    return depth > 0 and any(holds(part, depth - 1) for part in parts(value))


def walk(action):
    """What an action returns, and the functions of the package with the number among their arguments, each once."""
    places = {}

    def look(frame, event, _):
        code = frame.f_code
        if event != "call" or not code.co_filename.startswith(SOURCE) or code.co_name.endswith(("comp>", "genexpr>")):
            return
        count = code.co_argcount + code.co_kwonlyargcount + bool(code.co_flags & 4) + bool(code.co_flags & 8)
        sys.setprofile(None)
        if any(holds(frame.f_locals.get(name)) for name in code.co_varnames[:count]):
            places[code.co_filename.removeprefix(SOURCE), code.co_qualname] = None
        sys.setprofile(look)

    sys.setprofile(look)
    try:
        result = action()
    finally:
        sys.setprofile(None)
    return result, list(places)


@pytest.fixture(scope="module")
def walks(tmp_path_factory):
    file = tmp_path_factory.mktemp("walk") / "m.toml"
    file.write_text(MISSION)
    read_mission(file).plan()  # tables of laws are made when first asked for
    mission, reading = walk(lambda: read_mission(file))
    plan, planning = walk(mission.plan)
    assert holds(plan.parameters.gains)
    return reading, planning


def test_a_gain_goes_from_a_file_to_the_plan_through_few_functions(walks):
    reading, planning = walks
    names = "\n".join(" ".join(place) for place in (*reading, *planning))
    assert len(reading) <= MOST_READING, names
    assert len(planning) <= MOST_PLANNING, names


def test_the_walk_sees_where_the_gain_is_checked_and_where_it_becomes_a_vector(walks):
    reading, planning = ({name for _, name in places} for places in walks)
    assert {"check_mission", "as_diagonal", "positive"} <= reading
    assert {"Mission.plan", "ControllerSection.build", "Gain.shaped", "Vector.__init__"} <= planning
