"""Missions for real vehicles on the command line: the files they write, and one line for every mistake in them."""

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadstep.engines.eager import fly_floats
from quadstep.engines.fly import FlightPlan
from quadstep.interfaces.closed_loop import Outcome
from quadstep.mission.multirotor import MultirotorMission
from quadstep.mission.presets import preset_names
from quadstep.mission.read import check_mission
from quadstep.numbers import flatten
from tests.commands import quadstep
from tests.missions import accepted_or_refused, garbage, places, refusal, replaced

PRESETS = ("crazyflie", "hummingbird", "paper", "research-2.6kg", "x500")
VEHICLE = '[vehicle]\npreset = "hummingbird"\n'
PATH = '[path]\ntype = "step"\nstart = [0.0, 0.0, 1.0]\nend = [0.0, 0.0, 1.0]\nduration = 10.0\n'
MISSION = VEHICLE + PATH
ROTORS = "rotors = [{ position = [0.1, 0.1, 0.0], spin = 'cw' }]\n"


def own(vehicle: str) -> str:
    """A mission whose vehicle has these lines beside its preset."""
    return f"{VEHICLE}{vehicle}\n{PATH}"


def event(lines: str) -> str:
    return f"{MISSION}[[events]]\n{lines}\n"


def controller(kind: str, lines: str = "") -> str:
    return f'{MISSION}[controller]\ntype = "{kind}"\n{lines}\n'


def section(name: str, lines: str) -> str:
    return f"{MISSION}[{name}]\n{lines}\n"


CASES = {
    # the vehicle
    "negative drag": (own("drag.parasitic = [-0.1, 0.0, 0.0]"), "vehicle.drag.parasitic", "zero or more"),
    "one number for drag": (own("drag.parasitic = 0.1"), "vehicle.drag.parasitic", "list of three", "0.1"),
    "rotor limits": (own("rotor.slowest = 900.0"), "vehicle.rotor", "fastest = 838", "above slowest = 900"),
    "zero time constant": (own("rotor.rise_time = 0.0"), "vehicle.rotor.rise_time", "greater than 0"),
    "time constant below the step": (
        own("rotor.fall_time = 1e-4"),
        "vehicle.rotor",
        "0.0001 s",
        "simulation.step",
        "0.00025 s",
    ),
    "unknown preset": ('[vehicle]\npreset = "x50"\n' + PATH, "vehicle", "'x50'", "mean x500? Allowed: ", *PRESETS),
    "preset with a line break": ('[vehicle]\npreset = "a\\nb"\n' + PATH, "vehicle", "unknown", "allowed"),
    "preset as a list": ('[vehicle]\npreset = ["x500"]\n' + PATH, "vehicle", "allowed", *PRESETS),
    "preset and file": (own('file = "own.toml"'), "vehicle", "preset and file", "one of them"),
    "file that is missing": ('[vehicle]\nfile = "nowhere.toml"\n' + PATH, "nowhere.toml", "file not found"),
    "file that is a folder": ('[vehicle]\nfile = "."\n' + PATH, "cannot be read", "it is a folder"),
    "file that is no TOML": ('[vehicle]\nfile = "bad.toml"\n' + PATH, "bad.toml", "not valid TOML", "line 2"),
    "file that is no text": ('[vehicle]\nfile = "binary.toml"\n' + PATH, "binary.toml", "UTF-8"),
    "file that is a mission": ('[vehicle]\nfile = "mission.toml"\n' + PATH, "mission.toml: vehicle: unknown key"),
    "file with a wrong key": ('[vehicle]\nfile = "wrong.toml"\n' + PATH, "vehicle.file", "wrong.toml: masss: unknown"),
    "file with a zero byte": ('[vehicle]\nfile = "a\\u0000b"\n' + PATH, "vehicle", "name of a TOML file", "x00"),
    "layout and rotors": (own("layout = 'x'\narm = 0.2\n" + ROTORS), "vehicle", "either", "layout and arm", "not both"),
    "too few rotors": (own(ROTORS), "vehicle", "1 given", "4 to 8"),
    "rotors as a table": (own("rotors.arm = 0.2"), "vehicle.rotors", "list"),
    "rotor without its turn": (own("rotors = [{ position = [0.1, 0.1, 0.0] }]"), "vehicle.rotors[0].spin", "is required"),
    "rotor at no place": (own("rotors = [{ position = [nan, 0.1, 0.0], spin = 'cw' }]"), "rotors[0].position[0]", "finite"),
    "nothing but a layout": ('[vehicle]\nlayout = "x"\n' + PATH, "vehicle.mass", "is required"),
    "key of the paper's plant": (own('kinematics = "rigid"'), "vehicle.kinematics", "unknown key", "allowed", "preset"),
    "mass that is no number": (own("mass = nan"), "vehicle.mass", "finite", "nan"),
    "endless inertia": (own("inertia = [inf, 1.0, 1.0]"), "vehicle.inertia[0]", "finite"),
    "inertia of no body": (own("inertia = [1.0, 1.0, 3.0]"), "vehicle", "triangle inequality"),
    "mass beyond floats": (own(f"mass = {10**400}"), "vehicle.mass", "number"),
    "mass too small": (own("mass = 1e-300"), "vehicle.mass", "at least 1e-09"),
    "arm too long": (own("layout = 'x'\narm = 1e300"), "vehicle.arm", "1000000000"),
    "ground as text": (own('ground = "0"'), "vehicle.ground", "number", "'0'"),
    "effect as a number": (own("effects.drag = 1"), "vehicle.effects.drag", "true or false"),
    "unknown effect": (own("effects.wind = true"), "vehicle.effects.wind", "allowed", "battery, drag, ground, gyroscopic"),
    "ground effect without a ground": (own("effects.ground = true"), "vehicle", "height", "ground"),
    # sensors
    "negative noise": (section("sensors", "gyro_noise = -0.1"), "sensors.gyro_noise", "greater than or equal to 0", "-0.1"),
    "noise that is no number": (section("sensors", "position_noise = nan"), "sensors.position_noise", "finite"),
    "latency of more than the flight": (section("sensors", "latency = 12.0"), "sensors.latency", "12 s", "flight of 10 s"),
    "latency of a whole flight": (section("sensors", "imu_latency = 10.0"), "sensors.imu_latency", "flight of 10 s"),
    "latency of too many samples": (section("sensors", "latency = 2.0"), "sensors.latency", "1000 samples", "at most 250"),
    "latency of half a sample": (section("sensors", "latency = 0.003"), "sensors.latency", "multiple", "imu_period = 0.002"),
    "negative latency": (section("sensors", "latency = -0.02"), "sensors.latency", "0"),
    "gyro between steps": (section("sensors", "imu_period = 0.003"), "sensors.imu_period", "multiple", "step = 0.002"),
    "fixes between samples": (section("sensors", "fix_period = 0.005"), "sensors.fix_period", "multiple", "0.002"),
    "fixes within a sample": (
        section("sensors", "fix_period = 0.001\nimu_period = 0.002"),
        "fix_period = 0.001 s",
        "multiple",
    ),
    "estimator as a number": (section("sensors", "estimator = 1"), "sensors.estimator", "true or false"),
    "unknown sensor": (section("sensors", "noise = 1.0"), "sensors.noise", "unknown key", "llowed here", "gyro_walk"),
    "sensors as a number": ("sensors = 3\n" + MISSION, "sensors", "table", "3"),
    # events
    "event after the end": (event("type = 'payload'\ntime = 10.0\nmass = 0.1"), "events[0].time", "10 s", "flight's end"),
    "event before the start": (event("type = 'payload'\ntime = -1.0\nmass = 0.1"), "events[0].time", "0"),
    "rotor that is not there": (
        event("type = 'payload'\ntime = 1.0\nmass = 0.1\n[[events]]\ntype = 'rotor'\ntime = 1.0\nrotor = 9\nefficiency = 0.5"),
        "events[1].rotor: 9 is not one of the vehicle's rotors, 1 to 4",
    ),
    "rotor 0": (event("type = 'rotor'\ntime = 1.0\nrotor = 0\nefficiency = 0.5"), "events[0].rotor", "equal to 1"),
    "half a rotor": (event("type = 'rotor'\ntime = 1.0\nrotor = 1.5\nefficiency = 0.5"), "events[0].rotor", "whole number"),
    "efficiency of 2": (
        event("type = 'rotor'\ntime = 1.0\nrotor = 1\nefficiency = 2.0"),
        "events[0].efficiency",
        "less than or equal to 1",
        "2.0",
    ),
    "efficiency below 0": (
        event("type = 'rotor'\ntime = 1.0\nrotor = 1\nefficiency = -0.1"),
        "events[0].efficiency: should be greater than or equal to 0",
    ),
    "payload of nothing": (event("type = 'payload'\ntime = 1.0\nmass = 0.0"), "events[0].mass", "greater than 0"),
    "payload for no time": (
        event("type = 'payload'\ntime = 1.0\nuntil = 1.0\nmass = 1.0"),
        "until = 1 s must be after time = 1 s",
    ),
    "payload in the plane": (
        event("type = 'payload'\ntime = 1.0\nmass = 0.1\nposition = [0, 0]"),
        "position",
        "three numbers",
    ),
    "unknown event": (event("type = 'rain'\ntime = 1.0"), "events[0].type", "rain", "payload, centre-of-gravity, rotor"),
    "event without a type": (event("time = 1.0"), "events[0].type", "is required", "payload, centre-of-gravity, rotor"),
    "unknown key of an event": (event("type = 'payload'\ntime = 1.0\nmass = 0.1\nweight = 1"), "events[0].weight", "mass"),
    "17 events": (
        MISSION + "[[events]]\ntype = 'payload'\ntime = 1.0\nmass = 0.1\n" * 17,
        "events",
        "at most 16 entries",
        "not 17",
    ),
    "events as numbers": ("events = [3]\n" + MISSION, "events[0]", "table", "3"),
    "events as a table": (section("events", "type = 'payload'"), "events", "list"),
    # air
    "wind in the plane": (section("wind", "mean = [1.0, 2.0]"), "wind.mean", "list of three numbers", "[1.0, 2.0]"),
    "endless wind": (section("wind", "mean = [inf, 0.0, 0.0]"), "wind.mean[0]", "finite"),
    "swing without a frequency": (section("wind", "swing = [1.0, 0.0, 0.0]"), "wind", "swing_frequency [rad/s]"),
    "turbulence without strength": (
        section("wind", "mean = [5.0, 0.0, 0.0]\nturbulence = {}"),
        "wind.turbulence",
        "wind_20 [m/s]",
        "light, moderate, severe",
    ),
    "turbulence of a kind": (section("wind", "turbulence.intensity = 'mild'"), "wind.turbulence.intensity", "severe", "mild"),
    "turbulence twice": (
        section("wind", "turbulence = {wind_20 = 5.0, intensity = 'light'}"),
        "wind.turbulence",
        "either wind_20",
    ),
    "negative turbulence": (section("wind", "turbulence.wind_20 = -5.0"), "wind.turbulence.wind_20", "equal to 0"),
    "turbulence too high": (section("wind", "turbulence = {wind_20 = 5.0, height = 1e3}"), "wind.turbulence.height", "305"),
    "turbulence in the ground": (section("wind", "turbulence.height = 1.0"), "wind.turbulence.height", "3", "1.0"),
    "turbulence as a bool": (section("wind", "turbulence = true"), "wind.turbulence", "table", "True"),
    "gust after the end": (
        section("wind", "gust = { velocity = [1, 0, 0], start = 10.0, length = 1.0 }"),
        "wind.gust.start",
        "10 s",
    ),
    "gust of no length": (
        section("wind", "gust = { velocity = [1, 0, 0], start = 1.0, length = 0.0 }"),
        "wind.gust.length",
        "greater than 0",
    ),
    # controllers
    "unknown controller": (
        controller("sliding-mode"),
        "controller.type",
        "unknown value 'sliding-mode'; allowed: geometric, pid, lqr, ",
        ", or your own FILE.py:NAME",
    ),
    "controller of the paper's plant": (
        controller("completed-backstepping"),
        "controller.type = 'completed-backstepping' needs the paper's plant",
        "leave out preset",
    ),
    "controller without a type": (section("controller", "k_x = 3.0"), "controller.type", "is required; allowed: geometric"),
    "unknown key of a controller": (controller("geometric", "K_R = 3.0"), "controller.K_R", "unknown key", "k_R", "k_Omega"),
    "key of another controller": (controller("backstepping", "P = 3.0"), "controller.P", "unknown key", "K_r1"),
    "gain zero": (controller("geometric", "k_x = 0.0"), "controller.k_x", "greater than 0"),
    "gain in the plane": (controller("pid", "attitude = [1.0, 1.0]"), "controller.attitude", "number or a list of three"),
    "gain that is no number": (controller("pid", "most_speed = nan"), "controller.most_speed", "finite"),
    "gain too large": (controller("rotation-backstepping", "P = 1e300"), "controller.P", "1000000000"),
    "too few weights of an LQR": (controller("lqr", "level = [1.0, 2.0]"), "controller.level[2]", "is required"),
    "weight zero of an LQR": (controller("lqr", "turn = [1.0, 1.0, 0.0]"), "controller.turn[2]", "greater than 0"),
    "one bound": (controller("rotation-backstepping", "weight_bounds = [1.0]"), "controller.weight_bounds"),
    "no neurons": (controller("rotation-backstepping", "nets.neurons = 0"), "controller.nets.neurons", "1"),
    "weights that are missing": (
        controller("rotation-backstepping", "nets.weights = 'nowhere.json'"),
        "nowhere.json",
        "controller.nets.weights",
        "file not found",
    ),
    "weights of other nets": (
        controller("rotation-backstepping", "nets.weights = 'weights.json'"),
        "weights.json",
        "neurons = 2, seed = 1",
        "neurons = 10",
    ),
    "gains that follow from a vehicle of no use": (
        own("mass = 1e9") + '[controller]\ntype = "backstepping"\n',
        "controller",
        "K_r1",
        "1000000000",
    ),
    # clock, limits, score, seed
    "position loop between steps": (
        section("simulation", "guidance_period = 0.003"),
        "simulation",
        "guidance_period",
        "0.002",
    ),
    "attitude loop between steps": (
        section("simulation", "control_period = 0.003"),
        "simulation",
        "control_period",
        "multiple",
    ),
    "air between steps": (section("simulation", "air_period = 0.003"), "simulation", "air_period", "multiple"),
    "unknown period": (section("simulation", "imu_period = 0.002"), "simulation.imu_period", "llowed here", "guidance_period"),
    "limit of pitch": (section("limits", "pitch = 1.0"), "limits.pitch", "unknown key", "distance, rate"),
    "disturbance": (section("disturbance", "scale = 1.0"), "[disturbance] needs the paper's plant"),
    "score after the end": ("score_from = 10.0\n" + MISSION, "score_from", "10 s", "last row of the log at 10 s"),
    "score after the last row": (
        "score_from = 0.605\n" + section("simulation", "duration = 0.608"),
        "score_from",
        "0.605 s",
        "last row of the log at 0.6 s",
    ),
    "score before the start": ("score_from = -1.0\n" + MISSION, "score_from", "0", "-1.0"),
    "negative seed": ("seed = -1\n" + MISSION, "seed", "greater than or equal to 0", "-1"),
    "seed too large": (f"seed = {2**63}\n" + MISSION, "seed", "2^63"),
    "half a seed": ("seed = 1.5\n" + MISSION, "seed", "whole number"),
    "start beyond floats": (section("start", "velocity = [1e300, 0.0, 0.0]"), "start.velocity[0]", "1000000000"),
    "start in two angles": (section("start", "attitude = [0.0, 1.0]"), "start.attitude", "three numbers"),
    "unknown key of the start": (section("start", "pitch = 1.0"), "start.pitch", "allowed", "hovering"),
    "no path": (VEHICLE, "path", "is required"),
}


@pytest.fixture
def folder(tmp_path):
    """A folder with files that missions name."""
    (tmp_path / "bad.toml").write_text("mass = 1.0\nmass = = 2\n", encoding="utf-8")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    (tmp_path / "wrong.toml").write_text('preset = "x500"\nmasss = 1.0\n', encoding="utf-8")
    weights = {"neurons": 2, "seed": 1, "W1": [[0.0] * 3] * 2, "W2": [[0.0] * 3] * 2}
    (tmp_path / "weights.json").write_text(json.dumps(weights), encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize("case", CASES)
def test_bad_input_is_named_by_file_key_and_what_is_allowed(folder, case):
    content, *needed = CASES[case]
    message = refusal(folder, content)
    assert len(message) < 600  # the names of all controllers
    for part in needed:
        assert part in message


def rotor(spin, x, y):
    return {"position": [x, y, 0.0], "axis": [0.0, 0.0, 1.0], "spin": spin}


EVERY_KEY = {
    "name": "Everything said",
    "seed": 3,
    "vehicle": {
        "mass": 2.6,
        "inertia": [0.03, 0.03, 0.05],
        "gravity": 9.81,
        "rotors": [rotor("cw", 0.15, 0.15), rotor("ccw", -0.15, 0.15), rotor("cw", -0.15, -0.15), rotor("ccw", 0.15, -0.15)],
        "rotor": {
            "thrust_coefficient": 1.9e-5,
            "torque_coefficient": 3e-7,
            "inertia": 4e-5,
            "rise_time": 0.04,
            "fall_time": 0.04,
            "slowest": 150.0,
            "fastest": 866.0,
            "radius": 0.14,
        },
        "drag": {"parasitic": [0.02, 0.02, 0.02], "rotor": [4e-4, 4e-4, 4e-4], "flapping": 1e-6, "translational_lift": 1e-3},
        "battery": {"full": 16.8, "empty": 13.2, "capacity": 18000.0, "resistance": 0.02, "efficiency": 0.8},
        "ground": 0.0,
        "effects": {"battery": True, "ground": True, "gyroscopic": True, "drag": True},
    },
    "path": {"type": "step", "start": [0.0, 0.0, 2.0], "end": [1.0, 0.0, 2.0], "time": 0.01, "duration": 0.1},
    "start": {"position": [0.0, 0.0, 2.0], "attitude": [0.1, 0.1, 0.1], "rates": [0.1, 0.0, 0.0], "hovering": True},
    "wind": {
        "mean": [3.0, 1.0, 0.0],
        "swing": [1.0, 0.0, 0.0],
        "swing_frequency": 1.0,
        "gust": {"velocity": [1.0, 0.0, 0.0], "start": 0.01, "length": 0.05},
        "turbulence": {"wind_20": 4.0, "height": 6.0, "airspeed": 3.0},
    },
    "sensors": {
        "gyro_noise": 0.002,
        "gyro_bias": 0.01,
        "gyro_walk": 0.001,
        "accelerometer_noise": 0.02,
        "accelerometer_bias": 0.05,
        "accelerometer_walk": 0.001,
        "position_noise": 0.002,
        "velocity_noise": 0.02,
        "attitude_noise": 0.005,
        "imu_period": 0.002,
        "fix_period": 0.004,
        "latency": 0.02,
        "imu_latency": 0.002,
        "estimator": True,
    },
    "events": [
        {"type": "payload", "time": 0.02, "until": 0.06, "mass": 0.3, "position": [0.0, 0.0, -0.1]},
        {"type": "rotor", "time": 0.03, "rotor": 2, "efficiency": 0.8},
        {"type": "centre-of-gravity", "time": 0.01, "until": 0.05, "shift": [0.01, 0.0, 0.0]},
    ],
    "simulation": {"duration": 0.1, "step": 0.002, "control_period": 0.002, "guidance_period": 0.01, "log_period": 0.01},
    "limits": {"distance": 50.0, "rate": 60.0},
    "score_from": 0.02,
}
LAWS = [
    {"type": "geometric", "mass": 2.0, "inertia": [0.03, 0.03, 0.05], "k_x": 24.0, "k_i": [1.0, 1.0, 1.0], "k_R": 100.0},
    {"type": "pid", "position": 5.0, "most_speed": 3.0, "rate": [40.0, 40.0, 20.0], "rate_filter": 60.0},
    {"type": "lqr", "level": [40.0, 40.0, 4.0, 1.0, 0.3, 0.002], "climb": [20.0, 40.0, 4.0, 1.0], "turn": [40.0, 4.0, 0.4]},
    {"type": "rotation-backstepping", "P": 60.0, "nets": {"neurons": 3, "F1": 5.0, "start": 0.05},
        "weight_bounds": [3.0, 9.0]},
    {"type": "backstepping", "Lambda1": 1.0, "K_r2": 9.0, "nets": {"neurons": 3}},
]  # fmt: skip
ALL_MISSIONS = [{**EVERY_KEY, "controller": law} for law in LAWS]


@settings(max_examples=150, deadline=None, derandomize=True)
@given(st.data())
def test_garbage_at_any_place_is_refused_in_one_line_or_harmless(data):
    mission = data.draw(st.sampled_from(ALL_MISSIONS))
    accepted_or_refused(replaced(mission, data.draw(st.sampled_from(places(mission))), data.draw(garbage)))


def floats_of(mission):
    def at(way):
        inside = mission
        for key in way:
            inside = inside[key]
        return inside

    return [way for way in places(mission) if isinstance(at(way), float)]


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.data())
def test_numbers_of_any_size_that_are_accepted_fly_to_an_outcome(data):
    content = data.draw(st.sampled_from(ALL_MISSIONS))
    content = replaced(content, ("sensors", "estimator"), False)
    for _ in range(data.draw(st.integers(1, 2))):
        size = data.draw(st.sampled_from([1e-320, 1e-12, 1e-9, 1e-4, 0.0, 1.0, 1e4, 1e9, -1e9]))
        content = replaced(content, data.draw(st.sampled_from(floats_of(content))), size)
    plan, mission = planned(content)
    if plan is None:
        return
    log = fly_floats(plan.loop, plan.parameters, plan.start, plan.ticks._replace(last=8, log=1))
    metrics, _ = mission.flight_metrics(log)
    assert np.isfinite(log.rows).all()
    assert json.loads(json.dumps(metrics, allow_nan=False))["outcome"] == log.outcome.name.lower()


def planned(content) -> tuple[FlightPlan | None, MultirotorMission | None]:
    try:
        mission = check_mission(content, "mission.toml")
        return mission.plan(), mission
    except Exception as error:
        assert type(error).__name__ == "UserError"
        return None, None


@pytest.mark.parametrize("place", range(len(LAWS)))
def test_a_mission_survives_its_own_form(place):
    mission = check_mission(ALL_MISSIONS[place], "mission.toml")
    assert isinstance(mission, MultirotorMission)
    assert check_mission(mission.model_dump(), "dump") == mission
    again = check_mission(json.loads(mission.model_dump_json()), "json")
    assert again == mission
    assert flatten(again.plan().parameters) == flatten(mission.plan().parameters)


@pytest.mark.parametrize("preset", preset_names())
def test_a_mission_with_a_preset_survives_its_own_form(preset):
    mission = check_mission({"vehicle": {"preset": preset, "ground": 0.0}, "path": EVERY_KEY["path"]}, "mission.toml")
    assert check_mission(json.loads(mission.model_dump_json()), "json") == mission


# Start


def begun(**start):
    mission = check_mission({**EVERY_KEY, "controller": {"type": "geometric"}, "start": start}, "mission.toml")
    return mission.plan()


def test_a_flight_starts_on_its_path_in_hover_unless_told_otherwise():
    plan = begun()
    assert list(plan.start.position) == [0.0, 0.0, 2.0]
    assert list(plan.start.attitude) == [1.0, 0.0, 0.0, 0.0]
    thrusts = 1.9e-5 * np.array(list(plan.start.speeds)) ** 2
    assert thrusts == pytest.approx(2.6 * 9.81 / 4.0)
    told = begun(position=[1.0, 2.0, 3.0], velocity=[4.0, 5.0, 6.0], attitude=[math.pi / 2, 0.0, 0.0], hovering=False)
    assert (list(told.start.position), list(told.start.velocity)) == ([1.0, 2.0, 3.0], [4.0, 5.0, 6.0])
    assert list(told.start.attitude) == pytest.approx([math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)])
    assert list(told.start.speeds) == [150.0] * 4
    assert fly_floats(told.loop, told.parameters, told.start, told.ticks).outcome is Outcome.COMPLETED


# Vehicles


def test_vehicles_lists_every_preset():
    run = quadstep("vehicles")
    assert (run.code, run.err) == (0, "")
    for name in PRESETS:
        assert name in run.out
    assert "mass [kg]" in run.out


def test_vehicles_shows_every_number_of_one_with_unit_and_source():
    run = quadstep("vehicles", "crazyflie")
    assert run.code == 0
    for words in ("mass", "0.0328", "kg m^2", "rotor 4", "ccw", "rotor.rise_time", "rad/s", "source", "battery.full"):
        assert words in run.out


def test_vehicles_shows_a_file_of_ones_own(tmp_path):
    (tmp_path / "own.toml").write_text('preset = "x500"\nmass = 2.5\nsources.mass = "a scale"\n', encoding="utf-8")
    run = quadstep("vehicles", tmp_path / "own.toml")
    assert run.code == 0
    for words in ("2.5", "a scale", "rotor.fastest"):
        assert words in run.out


@pytest.mark.parametrize(("name", "content", "said"), [
    ("x50", None, ("'x50'", "did you mean x500? Allowed: crazyflie, hummingbird, paper, research-2.6kg, x500")),
    ("", None, ("is empty", "--help")),
    ("nowhere.toml", None, ("nowhere.toml", "file not found")),
    ("own.toml", 'preset = "x500"\nmass = -1.0', ("own.toml", "mass", "greater than 0")),
    ("own.toml", "mass = = 1", ("own.toml", "not valid TOML")),
    ("own.toml", 'preset = "x500"\nmas = 1.0', ("own.toml", "mas", "unknown key", "mass")),
])  # fmt: skip
def test_a_vehicle_that_is_not_there_or_wrong_is_one_line(tmp_path, monkeypatch, name, content, said):
    monkeypatch.chdir(tmp_path)
    if content:
        (tmp_path / name).write_text(content, encoding="utf-8")
    run = quadstep("vehicles", name)
    assert run.refused
    for words in said:
        assert words in run.err
