"""Sections of a mission for a real airframe: what they build, and one clear line for everything they refuse."""

import math
from pathlib import Path

import pytest
from pydantic import TypeAdapter, ValidationError

from quadstep.io.errors import UserError
from quadstep.mission.air import WindSection
from quadstep.mission.airframe import LAYOUTS, NO_GROUND, AirframeSection
from quadstep.mission.listings import load_preset, parameters, read_vehicle
from quadstep.mission.multirotor import AnyEvent, build_events, check_events, event_warnings
from quadstep.mission.presets import is_airframe
from quadstep.mission.sensing import SensorsSection
from quadstep.vehicle.airframe_plant import mass_properties

OWN = """\
mass = 1.2
inertia = [0.01, 0.01, 0.02]
layout = "hexa-x"
arm = 0.3
[rotor]
thrust_coefficient = 1e-5
torque_coefficient = 2e-7
rise_time = 0.02
fall_time = 0.03
fastest = 900.0
radius = 0.1
"""


def written(folder: Path, content: str, name: str = "own.toml") -> Path:
    path = folder / name
    path.write_text(content, encoding="utf-8")
    return path


def section(**keys):
    return AirframeSection.model_validate(keys)


def rotors(*spins, axis=(0.0, 0.0, 1.0), ahead=0.0):
    """As many rotors around a circle whose centre is `ahead`, as a user writes them."""
    angles = [2.0 * math.pi * i / len(spins) for i in range(len(spins))]
    return [
        {"position": [ahead + 0.2 * math.cos(a), 0.2 * math.sin(a), 0.0], "axis": list(axis), "spin": spin}
        for a, spin in zip(angles, spins, strict=True)
    ]


def test_a_file_of_ones_own_gives_a_vehicle(tmp_path):
    built = read_vehicle(written(tmp_path, OWN)).build()
    assert [mount.spin for mount in built.geometry.mounts] == [-1, 1, -1, 1, -1, 1]
    first = built.geometry.mounts[0]
    assert first.position == pytest.approx((0.3 * math.cos(math.pi / 6), 0.15, 0.0))
    assert first.axis == (0.0, 0.0, 1.0)
    airframe = built.airframe
    assert (airframe.mass, list(airframe.inertia), airframe.gravity) == (1.2, [0.01, 0.01, 0.02], 9.81)
    assert (airframe.rotor.rise, airframe.rotor.fall, airframe.rotor.slowest) == (0.02, 0.03, 0.0)
    assert airframe.ground == NO_GROUND
    assert built.allocation.most == pytest.approx(8.1)
    effects = built.effects
    assert (effects.battery, effects.ground, effects.gyroscopic, effects.drag) == (False, False, True, True)


def test_a_vehicle_may_start_from_a_preset_or_a_file_and_change_any_key(tmp_path):
    preset = section(preset="hummingbird", mass=0.65, drag={"flapping": 1e-5}, effects={"gyroscopic": False})
    assert preset.mass == 0.65
    assert preset.drag.flapping == 1e-5
    assert preset.drag.parasitic == (0.005, 0.005, 0.01)
    assert preset.inertia == load_preset("hummingbird").inertia
    assert not preset.build().effects.gyroscopic
    written(tmp_path, OWN)
    changed = written(tmp_path, 'file = "own.toml"\nrotor.fastest = 1000.0\nsources.mass = "a scale"\n', "changed.toml")
    assert read_vehicle(changed).rotor.fastest == 1000.0
    assert read_vehicle(changed).rotor.radius == 0.1
    mine = written(tmp_path, 'file = "changed.toml"\nmass = 3.0\n', "mine.toml")
    assert (read_vehicle(mine).mass, read_vehicle(mine).rotor.fastest) == (3.0, 1000.0)
    inside = AirframeSection.model_validate({"file": "own.toml", "ground": 0.5}, context={"folder": tmp_path})
    assert inside.build().airframe.ground == 0.5


def test_rotors_placed_in_one_way_replace_those_placed_in_the_other():
    assert len(section(preset="crazyflie", layout="octo-x", arm=0.05).geometry().mounts) == 8
    assert len(section(preset="research-2.6kg", rotors=rotors("ccw", "cw", "ccw", "cw", "ccw")).geometry().mounts) == 5


@pytest.mark.parametrize("layout", LAYOUTS)
def test_layouts_go_counter_clockwise_from_the_front_and_alternate(layout):
    mounts = section(preset="research-2.6kg", layout=layout).geometry().mounts
    angles = [math.atan2(mount.position[1], mount.position[0]) % (2.0 * math.pi) for mount in mounts]
    assert angles == sorted(angles)
    assert angles[0] == pytest.approx(0.0 if "plus" in layout else math.pi / len(mounts))
    assert all(math.hypot(*mount.position) == pytest.approx(0.225) for mount in mounts)
    assert [mount.spin for mount in mounts] == [-1, 1] * (len(mounts) // 2)


def test_an_axis_is_made_exactly_a_unit_vector():
    tilted = rotors("ccw", "cw", "ccw", "cw", axis=(0.0, 0.6, 0.8004))
    mounts = section(preset="hummingbird", rotors=tilted).geometry().mounts
    assert math.hypot(*mounts[0].axis) == pytest.approx(1.0, abs=1e-15)


REFUSED = {
    "negative translational lift": ({"drag": {"translational_lift": -1.0}}, "drag.translational_lift",
        "greater than or equal to 0"),
    "drag of a disc that is not round": ({"drag": {"rotor": [1e-4, 2e-4, 0.0]}}, "drag", "must be equal"),
    "zero fall time": ({"rotor": {"fall_time": 0.0}}, "rotor.fall_time", "greater than 0"),
    "no thrust": ({"rotor": {"thrust_coefficient": 0.0}}, "rotor.thrust_coefficient", "greater than 0"),
    "negative slowest": ({"rotor": {"slowest": -1.0}}, "rotor.slowest"),
    "three rotors": ({"rotors": rotors("ccw", "cw", "ccw")}, "3 given", "4 to 8"),
    "nine rotors": ({"rotors": rotors(*["ccw", "cw"] * 4, "ccw")}, "9 given", "4 to 8"),
    "axis too long": ({"rotors": rotors("ccw", "cw", "ccw", "cw", axis=(0.0, 0.0, 2.0))}, "rotors[0]", "length 1, not 2"),
    "axis zero": ({"rotors": rotors("ccw", "cw", "ccw", "cw", axis=(0.0, 0.0, 0.0))}, "rotors[0]", "length 1, not 0"),
    "spin as a number": ({"rotors": [{"position": [0.1, 0.1, 0.0], "spin": 1}] * 4}, "rotors[0].spin", "ccw"),
    "all turn alike": ({"rotors": rotors(*["ccw"] * 4)}, "same way", "yaw"),
    "yaw only with roll": ({"rotors": rotors("ccw", "ccw", "cw", "cw")}, "independently"),
    "no torque at all": ({"rotor": {"torque_coefficient": 0.0}}, "independently"),
    "all on one side": ({"rotors": rotors("ccw", "cw", "ccw", "cw", ahead=0.5)}, "push down"),
    "a rotor pushes down": ({"rotors": rotors("ccw", "cw", "ccw", "cw", axis=(0.0, 0.0, -1.0))}, "push down"),
    "layout without arm": ({"layout": "x"}, "rotors: missing", "arm"),
    "unknown layout": ({"layout": "y"}, "layout", "hexa-x"),
    "zero inertia": ({"inertia": [0.0, 1.0, 1.0]}, "inertia", "greater than 0"),
    "no mass": ({"mass": 0.0}, "mass", "greater than 0"),
    "unknown key": ({"rotor": {"fastets": 3.0}}, "rotor.fastets", "unknown key", "fastest"),
    "unknown table": ({"drags": {}}, "drags", "unknown key", "preset"),
    "battery empty above full": ({"battery": {"empty": 13.0}}, "battery", "below full"),
    "battery efficiency": ({"battery": {"efficiency": 1.2}}, "battery.efficiency", "less than or equal to 1"),
    "no battery to sag": ({"preset": "paper", "effects": {"battery": True}}, "effects.battery", "table battery"),
    "preset is a number": ({"preset": 3}, "preset 3", "allowed"),
    "file is a number": ({"preset": None, "file": 3}, "file", "3"),
    "file starts from itself": ({"preset": None, "file": "own.toml"}, "more than 8 files"),
}  # fmt: skip


@pytest.mark.parametrize(("keys", "said"), [(keys, said) for keys, *said in REFUSED.values()], ids=REFUSED)
def test_bad_vehicles_are_refused_in_one_line(keys, said, tmp_path):
    table = {"preset": "hummingbird", **keys}
    table = {key: value for key, value in table.items() if value is not None}
    path = written(tmp_path, as_toml(table))
    with pytest.raises(UserError) as raised:
        read_vehicle(path)
    message = str(raised.value)
    assert message.startswith(str(path))
    assert len(message.splitlines()) == 1
    assert len(message) < 500
    for words in said:
        assert words in message


def as_toml(table):
    """A table as TOML text, inline."""
    return "".join(f"{key} = {as_value(value)}\n" for key, value in table.items())


def as_value(value):
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {as_value(inner)}" for key, inner in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(as_value, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    return f'"{value}"' if isinstance(value, str) else repr(value)


def test_rotors_that_cannot_carry_the_vehicle_are_warned_of():
    assert section(preset="hummingbird").warnings() == []
    weak = section(preset="hummingbird", rotor={"fastest": 460.0}).warnings()
    assert len(weak) == 1
    assert "0.5 kg weigh 4.905 N, its rotors lift at most 4.714 N" in weak[0]
    assert "at least" in section(preset="hummingbird", rotor={"slowest": 500.0}).warnings()[0]
    places = [(0.3, 0.2), (0.3, -0.2), (-0.1, -0.2), (-0.1, 0.2)]
    uneven = [{"position": [x, y, 0.0], "spin": spin} for (x, y), spin in zip(places, ("cw", "ccw") * 2, strict=True)]
    said = section(preset="hummingbird", rotors=uneven, rotor={"fastest": 500.0}).warnings()
    assert any("rotor 3 carries 1.83" in line for line in said)


def test_steps_too_long_for_the_rotors_are_refused():
    section(preset="hummingbird").check_step(0.01)
    with pytest.raises(ValueError, match=r"0\.005 s is too short for simulation\.step = 0\.02 s; .* 0\.0125 s"):
        section(preset="hummingbird").check_step(0.02)


def test_which_vehicle_tables_are_airframes():
    assert is_airframe({"preset": "x500"})
    assert is_airframe({"file": "own.toml"})
    assert is_airframe({"mass": 1.0, "rotor": {}})
    assert not is_airframe({"mass": 1.0, "rotors": {"arm": 0.25}})
    assert not is_airframe({})


def test_a_source_of_a_table_holds_for_its_keys(tmp_path):
    content = OWN + '[sources]\nmass = "a scale"\nrotor = "a bench"\n"rotor.radius" = "a ruler"\n'
    listed = {parameter.key: parameter for parameter in parameters(read_vehicle(written(tmp_path, content)))}
    assert listed["mass"].source == "a scale"
    assert listed["rotor.fastest"].source == "a bench"
    assert listed["rotor.radius"].source == "a ruler"
    assert (listed["rotor.radius"].value, listed["rotor.radius"].unit) == ("0.1", "m")
    assert listed["layout"].value == "hexa-x"
    assert listed["rotor 2"].value == "(0, 0.3, 0), ccw"


# Wind


def test_wind_builds_what_is_written():
    wind = WindSection.model_validate(
        {
            "mean": [8.5, 0.0, 0.0],
            "swing": [2.4, 0.0, 0.0],
            "swing_frequency": 1.0,
            "gust": {"velocity": [0.0, 3.0, 0.0], "start": 2.0, "length": 1.5},
            "turbulence": {"intensity": "moderate", "height": 10.0},
        }
    )
    built = wind.build()
    assert (list(built.mean), list(built.swing), built.swing_frequency) == ([8.5, 0.0, 0.0], [2.4, 0.0, 0.0], 1.0)
    assert (list(built.gust), built.gust_start, built.gust_length) == ([0.0, 3.0, 0.0], 2.0, 1.5)
    assert built.turbulence.wind_20 == pytest.approx(15.433, abs=1e-3)
    assert (built.turbulence.height, built.turbulence.airspeed) == (10.0, 0.0)  # that of the mean wind
    assert wind.air.stirs
    still = WindSection()
    assert not still.air.stirs
    assert list(still.build().mean) == [0.0, 0.0, 0.0]
    assert list(still.build().gust) == [0.0, 0.0, 0.0]
    assert still.build().turbulence.wind_20 == 0.0


def test_turbulence_without_a_mean_wind_stands_still_and_is_warned_of():
    still = WindSection.model_validate({"mean": [0.0, 0.0, 0.0], "turbulence": {"intensity": "light"}})
    assert still.build().turbulence.airspeed == 0.0
    assert ["a single one blows all the time" in line for line in still.warnings()] == [True]
    for table in (
        {"mean": [0.1, 0.0, 0.0], "turbulence": {"intensity": "light"}},
        {"turbulence": {"intensity": "light", "airspeed": 3.0}},
        {"turbulence": {"wind_20": 0.0}},
        {},
    ):
        assert WindSection.model_validate(table).warnings() == []


# Sensors


def test_sensors_build_suite_numbers_and_rates():
    sensors = SensorsSection(
        gyro_noise=1e-3, position_noise=0.01, imu_period=0.004, fix_period=0.012, latency=0.02, estimator=True
    )
    built = sensors.build(step=0.002, control_period=0.004, gravity=9.81)
    assert (built.imu_steps, built.fix_steps) == (2, 6)
    assert (built.suite.delay, built.suite.lag) == (1, 2)  # 5 samples, a fix every 3
    assert built.suite.estimator
    assert built.suite.noisy
    assert (built.sensors.gyro_noise, built.sensors.position_noise, built.sensors.gravity) == (1e-3, 0.01, 9.81)
    assert (built.sensors.gyro_bias, built.sensors.attitude_noise) == (0.0, 0.0)


def test_left_out_sensors_are_perfect_and_follow_the_control_period():
    built = SensorsSection().build(step=0.001, control_period=0.004, gravity=9.81)
    assert (built.imu_steps, built.fix_steps) == (4, 4)
    assert (built.suite.delay, built.suite.lag, built.suite.imu_delay, built.suite.noisy) == (0, 0, 0, False)
    late = SensorsSection(imu_latency=0.008).build(step=0.001, control_period=0.004, gravity=9.81)
    assert late.suite.imu_delay == 2


@pytest.mark.parametrize(
    "key", ["gyro_noise", "accelerometer_bias", "position_noise", "attitude_noise", "latency", "imu_latency"]
)
def test_negative_noise_and_latency_are_refused(key):
    with pytest.raises(ValidationError, match="greater than or equal to 0"):
        SensorsSection.model_validate({key: -0.1})


# Events

EVENTS = TypeAdapter(list[AnyEvent])
ALL = [
    {"type": "payload", "time": 5.0, "mass": 0.3, "position": [0.0, 0.1, -0.1]},
    {"type": "rotor", "time": 6.0, "rotor": 2, "efficiency": 0.8},
    {"type": "centre-of-gravity", "time": 1.0, "until": 2.0, "shift": [0.02, 0.0, 0.0]},
]


def test_events_build_what_is_written():
    events = EVENTS.validate_python(ALL)
    check_events(events, rotors=4, duration=10.0)
    built = build_events(events, mass=2.0)
    payload, away, there = built.payloads
    assert (payload.start, payload.mass, list(payload.position)) == (5.0, 0.3, [0.0, 0.1, -0.1])
    assert payload.end > 1e6
    assert (away.mass, list(away.position)) == (-2.0, [0.0, 0.0, 0.0])
    assert (there.start, there.end, there.mass, list(there.position)) == (1.0, 2.0, 2.0, [0.02, 0.0, 0.0])
    (fault,) = built.faults
    assert (fault.start, fault.rotor, fault.efficiency) == (6.0, 1.0, 0.8)
    assert build_events([], mass=2.0).payloads == ()


def test_a_shifted_centre_of_gravity_leaves_mass_and_inertia_alone():
    airframe = load_preset("hummingbird").build().airframe
    event = {"type": "centre-of-gravity", "time": 1.0, "until": 2.0, "shift": [0.02, -0.01, 0.03]}
    events = build_events(EVENTS.validate_python([event]), airframe.mass)
    shifted = mass_properties(airframe, events, 1.5)
    assert shifted.mass == pytest.approx(0.5, abs=1e-15)
    assert list(shifted.offset) == pytest.approx([0.02, -0.01, 0.03])
    diagonal = [airframe.inertia[i] if i == j else 0.0 for i in range(3) for j in range(3)]
    assert [entry for row in shifted.inertia for entry in row] == pytest.approx(diagonal, abs=1e-15)
    assert list(mass_properties(airframe, events, 2.5).offset) == [0.0, 0.0, 0.0]


def test_a_centre_of_gravity_beyond_the_rotors_is_warned_of():
    places = [(0.2, 0.0, 0.0)]
    assert event_warnings(EVENTS.validate_python(ALL), places) == []
    (last, *_) = sorted(EVENTS.validate_python(ALL), key=lambda event: -event.time)
    assert event_warnings([last], places, last.time + 0.11) == []
    (late,) = event_warnings([last], places, last.time + 0.09)
    assert late.endswith(", so its effect hardly shows")
    far = EVENTS.validate_python([{"type": "centre-of-gravity", "time": 1.0, "shift": [0.3, 0.0, 0.0]}])
    assert "events[0].shift: 0.3 m is beyond the rotors, at 0.2 m" in event_warnings(far, places)
