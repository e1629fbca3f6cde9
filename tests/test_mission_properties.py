"""Property tests of mission files: garbage is refused in one line, valid missions survive being written and read."""

import json
import tomllib

from hypothesis import given, settings
from hypothesis import strategies as st

from quadstep import UserError
from quadstep.engines.fly import fingerprint
from quadstep.mission.read import check_mission
from tests.missions import accepted_or_refused, garbage, places, replaced

VALID = {
    "name": "Everything said",
    "vehicle": {"mass": 1.2, "inertia": [4.0, 5.0, 6.0], "gravity": 9.81, "kinematics": "standard",
        "rotors": {"arm": 0.2, "moment": 0.05, "limits": [0.0, 9.0]}},
    "path": {"type": "minimum-jerk", "start": [0.0, 0.0, 0.0], "end": [1.0, 2.0, 3.0], "duration": 5.0, "yaw_end": 1.0},
    "controller": {"type": "backstepping", "mass": 1.0, "Lambda1": 1.0, "K_r1": [3.0, 3.0, 3.0], "filter_frequency": 100.0,
        "nets": {"enabled": True, "start": 1.0, "neurons": 4, "seed": 3, "F1": 5.0, "kappa1": 0.01}},
    "start": {"position": [0.1, 0.0, 0.0], "attitude": [0.0, 0.1, 0.0]},
    "disturbance": {"scale": 1.0, "force": [0.1, 0.0, 0.0], "torque": [0.0, 0.0, 0.0]},
    "simulation": {"duration": 6.0, "step": 0.002, "control_period": 0.004, "log_period": 0.01},
    "limits": {"distance": 50.0, "rate": 60.0, "pitch": 1.5},
}  # fmt: skip

OTHER_PATHS = [
    {"type": "waypoints", "waypoints": [{"t": 0.0, "position": [0.0, 0.0, 0.0]}, {"t": 2.0, "position": [1.0, 0.0, 0.0]}]},
    {"type": "circle", "radius": 1.0, "period": 9.0, "clockwise": True, "ramp": 1.0},
    {"type": "figure-eight", "length": 2.0, "width": 1.0, "period": 9.0, "plane": "vertical"},
    {"type": "recorded", "file": "nowhere.csv", "columns": {"t": "time", "psi": "yaw"}, "psi_unit": "deg"},
]
NESTED = {"type": "nested-saturation", "a_z": [3.0, 0.5], "bounds": [2.0, 1.0, 0.2, 0.1]}
MISSIONS = [VALID, {**VALID, "controller": NESTED}, *({**VALID, "path": path} for path in OTHER_PATHS)]


@settings(max_examples=250, deadline=None, derandomize=True)
@given(st.data())
def test_garbage_at_any_place_is_refused_in_one_line_or_harmless(data):
    mission = data.draw(st.sampled_from(MISSIONS))
    way = data.draw(st.sampled_from(places(mission)))
    accepted_or_refused(replaced(mission, way, data.draw(garbage)))


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.data())
def test_an_unknown_key_at_any_place_is_refused_in_one_line(data):
    mission = data.draw(st.sampled_from(MISSIONS))
    ways = [(), *(way for way in places(mission) if isinstance(at(mission, way), dict))]
    key = data.draw(st.text(max_size=8).map(lambda text: f"unknown {text}"))
    content = replaced(mission, (*data.draw(st.sampled_from(ways)), key), data.draw(garbage))
    try:
        check_mission(content, "mission.toml")
    except UserError as error:
        assert len(str(error).splitlines()) == 1
        assert "unknown key" in str(error)
    else:
        raise AssertionError("accepted")


def at(mission, way):
    for key in way:
        mission = mission[key]
    return mission


@settings(max_examples=50, deadline=None, derandomize=True)
@given(st.dictionaries(st.text(max_size=8) | st.sampled_from(sorted(VALID)), garbage, max_size=4))
def test_garbage_alone_is_refused_in_one_line(content):
    accepted_or_refused(content)


def numbers(least, greatest):
    return st.floats(least, greatest).map(lambda value: round(value, 6)) | st.integers(int(least) + 1, int(greatest))


def triples(least, greatest):
    return st.lists(numbers(least, greatest), min_size=3, max_size=3)


def some(**keys):
    """A section with any of these keys."""
    return st.fixed_dictionaries({}, optional=keys)


def section(kind, required, **optional):
    return st.fixed_dictionaries({"type": st.just(kind), **required}, optional=optional)


seconds, lengths, places_at = numbers(0.5, 60.0), numbers(0.1, 50.0), triples(-50.0, 50.0)
gains = numbers(0.01, 500.0) | triples(0.01, 500.0)
yaws = {"yaw": numbers(-9.0, 9.0), "yaw_rate": numbers(-2.0, 2.0), "ramp": numbers(0.0, 9.0), "centre": places_at}
waypoints = st.lists(st.tuples(numbers(0.1, 9.0), places_at, numbers(-9.0, 9.0)), min_size=2, max_size=6).map(
    lambda legs: [
        {"t": sum(leg[0] for leg in legs[1 : i + 1]), "position": leg[1], "yaw": leg[2]} for i, leg in enumerate(legs)
    ]
)
paths = st.one_of(
    section("minimum-jerk", {"end": places_at, "duration": seconds}, start=places_at, yaw_start=numbers(-9.0, 9.0)),
    section("waypoints", {"waypoints": waypoints}),
    section("circle", {"radius": lengths, "period": seconds}, turns=numbers(0.1, 5.0), clockwise=st.booleans(), **yaws),
    section(
        "figure-eight",
        {"length": lengths, "width": lengths, "period": seconds},
        plane=st.sampled_from(["horizontal", "vertical"]),
        **yaws,
    ),
)
nets = some(
    enabled=st.booleans(),
    start=numbers(0.0, 9.0),
    neurons=st.integers(1, 12),
    seed=st.integers(0, 2**63 - 1),
    F1=numbers(0.0, 9.0),
    kappa2=numbers(0.0, 1.0),
)
controllers = st.one_of(
    section("backstepping", {}, mass=lengths, Lambda1=gains, K_r1=gains, K_i2=gains, filter_frequency=lengths, nets=nets),
    section("nested-saturation", {}, mass=lengths, a_z=st.lists(numbers(0.001, 9.0), min_size=2, max_size=2)),
)
printable = st.text(st.characters(codec="utf-8", exclude_categories=["C"]), max_size=40)
missions = st.fixed_dictionaries(
    {"path": paths},
    optional={
        "name": printable,
        "controller": controllers,
        "vehicle": some(
            mass=lengths,
            inertia=triples(3.0, 6.0),
            gravity=numbers(1.0, 20.0),
            kinematics=st.sampled_from(["standard", "printed"]),
            rotors=some(arm=lengths, limits=st.tuples(numbers(0.0, 5.0), numbers(6.0, 20.0)).map(list)),
        ),
        "start": some(position=places_at, velocity=places_at, attitude=triples(-1.5, 1.5), rates=places_at),
        "disturbance": some(scale=numbers(-9.0, 9.0), force=places_at, torque=places_at),
        "simulation": some(duration=seconds, control_period=st.sampled_from([0.002, 0.004, 0.01]), log_period=st.just(0.1)),
        "limits": some(distance=lengths, rate=lengths, pitch=st.floats(0.1, 1.57)),
    },
)


def toml(value):
    """A value as TOML. JSON's text escapes are TOML's too, but for characters beyond 16 bits, which TOML takes plainly."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {toml(entry)}" for key, entry in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str | bool) else repr(value)


@settings(max_examples=80, deadline=None, derandomize=True)
@given(missions)
def test_a_valid_mission_survives_toml_and_the_models_own_form(content):
    text = "".join(f"{key} = {toml(value)}\n" for key, value in content.items())
    mission = check_mission(tomllib.loads(text), "mission.toml")
    assert mission == check_mission(content, "mission.toml")
    assert check_mission(mission.model_dump(), "dump") == mission
    again = check_mission(json.loads(mission.model_dump_json()), "json")
    assert again == mission
    plan = mission.plan()
    assert plan.ticks.last >= 1
    assert fingerprint([again.plan()]) == fingerprint([plan])
