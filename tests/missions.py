"""Missions for tests: the examples, corrupted ones, and how they are refused."""

from copy import deepcopy
from pathlib import Path

import pytest
from hypothesis import strategies as st

from quadstep import UserError, read_mission
from quadstep.mission.read import check_mission, plan_mission

EXAMPLES = Path(__file__).parent.parent / "examples"
MISSIONS = sorted(path.stem for path in EXAMPLES.glob("*.toml") if "[path]" in path.read_text())
RECORDED = "crazyflie_flight"
"""Its recording is not included."""


def refusal(folder: Path, content: str | bytes) -> str:
    """What is said of a mission file with this content, of several mistakes first; fails if it is accepted."""
    return refusals(folder, content)[0]


def refusals(folder: Path, content: str | bytes) -> list[str]:
    """The same of each mistake; fails if one takes more than a line, or does not name the file."""
    path = folder / "mission.toml"
    if isinstance(content, str):
        path.write_text(content, encoding="utf-8")
    else:
        path.write_bytes(content)
    with pytest.raises(UserError) as raised:
        plan_mission(read_mission(path), path)
    lines = raised.value.lines
    assert all(len(line.splitlines()) == 1 and line.startswith(str(path)) for line in lines)
    return [line.removeprefix(str(path)) for line in lines]


scalars = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.sampled_from([0, -1, 10**30, 10**400, 1e-320, 1e-200, 1e200]),
    st.floats(),
    st.text(max_size=12),
    st.sampled_from(["backstepping", "circle", "waypoints", "recorded", "a\nb", "\x00", ".", "/"]),
)
garbage = st.recursive(
    scalars, lambda inner: st.lists(inner, max_size=5) | st.dictionaries(st.text(max_size=6), inner, max_size=4), max_leaves=8
)


def places(value, way=()):
    """The way to every value inside a mission."""
    found = [way] if way else []
    children = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return found + [place for key, child in children for place in places(child, (*way, key))]


def replaced(mission, way, value):
    """A mission with the value at `way` replaced."""
    mission = deepcopy(mission)
    inside = mission
    for key in way[:-1]:
        inside = inside[key]
    inside[way[-1]] = value
    return mission


def accepted_or_refused(content):
    try:
        check_mission(content, "mission.toml").plan()
    except UserError as error:
        assert len(str(error).splitlines()) == 1
