"""The vehicles that come with the package: they hover, turn in the commanded direction, and every number has a source."""

import importlib.util
import math
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
from pydantic import TypeAdapter
from scipy.optimize import fsolve

from quadstep.mission.air import WindSection
from quadstep.mission.airframe import LAYOUTS, AirframeSection
from quadstep.mission.lagrange import VehicleSection
from quadstep.mission.listings import load_preset, numbers, parameters, read_vehicle
from quadstep.mission.multirotor import AnyEvent, build_events
from quadstep.mission.presets import preset_names
from quadstep.mission.sensing import SensorsSection
from quadstep.numbers import Vector, vector
from quadstep.numbers.rotations import IDENTITY, from_rotation_vector
from quadstep.vehicle.airframe_plant import Events, derivative, efficiencies, mass_properties
from quadstep.vehicle.allocation import allocate, columns
from quadstep.vehicle.paper import Rotors, mix
from quadstep.vehicle.rigid_body import AirframeState
from quadstep.vehicle.rotor import electrical_power, terminal_voltage

ROOT = Path(__file__).parent.parent
ZERO = vector(0.0, 0.0, 0.0)
IDENTIFIED = {"command", "imu", "prediction", "guided_prediction", "undetermined", "identified_from"}
"""Tables that `quadstep identify` writes, for `quadstep replay` alone (docs/logs.md)."""

EVERY = pytest.mark.parametrize("name", preset_names())
VEHICLES = {name: load_preset(name) for name in preset_names()}
LAID_OUT = {
    layout: AirframeSection.model_validate({"preset": "research-2.6kg", "layout": layout, "rotor": {"fastest": 700.0}})
    for layout in LAYOUTS
}
EVERY_SHAPE = pytest.mark.parametrize("vehicle", (VEHICLES | LAID_OUT).values(), ids=VEHICLES | LAID_OUT)


def rates(vehicle, speeds, wind=ZERO, attitude=IDENTITY, **effects):
    """Rates of a vehicle at rest, level if nothing else is said, whose rotors turn steadily at these speeds."""
    built = vehicle.build()
    state = AirframeState(ZERO, ZERO, attitude, ZERO, Vector(speeds), 0.0)
    events = Events()
    properties, efficiency = mass_properties(built.airframe, events, 0.0), efficiencies(events, len(state.speeds), 0.0)
    return derivative(
        built.geometry, built.airframe, properties, efficiency, state, state.speeds, wind, built.effects.__class__(**effects)
    )


def commanded(vehicle, torque, share=1.0):
    """Rotor speeds for `share` times the weight and a torque."""
    built = vehicle.build()
    speeds, _, made = allocate(built.geometry, built.allocation, share * vehicle.mass * vehicle.gravity, Vector(torque))
    assert list(made) == list(torque)
    return speeds


def test_there_are_the_five_vehicles():
    assert preset_names() == ["crazyflie", "hummingbird", "paper", "research-2.6kg", "x500"]


@EVERY_SHAPE
def test_hover_thrust_is_the_weight_and_turns_nothing(vehicle):
    moved = rates(vehicle, commanded(vehicle, (0.0, 0.0, 0.0)))
    assert list(moved.velocity) == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    assert list(moved.rates) == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)
    assert vehicle.warnings() == []


@EVERY_SHAPE
@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_torque_turns_the_vehicle_about_its_axis_as_much_as_its_inertia_lets_it(vehicle, axis, sign):
    built, torque = vehicle.build(), [0.0, 0.0, 0.0]
    reach = max(math.hypot(*mount.position) for mount in built.geometry.mounts)
    lever = reach if axis < 2 else built.airframe.rotor.torque / built.airframe.rotor.thrust
    torque[axis] = sign * 0.1 * lever * vehicle.mass * vehicle.gravity / len(built.geometry.mounts)
    moved = rates(vehicle, commanded(vehicle, torque))
    wanted = [one / inertia for one, inertia in zip(torque, vehicle.inertia, strict=True)]
    assert list(moved.rates) == pytest.approx(wanted, rel=1e-9, abs=1e-9)
    assert moved.velocity[2] == pytest.approx(0.0, abs=1e-12)


@EVERY_SHAPE
def test_a_rotor_that_turns_counter_clockwise_pushes_the_body_clockwise_and_lifts_its_side(vehicle):
    hover = list(commanded(vehicle, (0.0, 0.0, 0.0)))
    for place, mount in enumerate(vehicle.geometry().mounts):
        speeds = [1.02 * speed if i == place else speed for i, speed in enumerate(hover)]
        roll, pitch, yaw = rates(vehicle, speeds).rates
        assert yaw * mount.spin < 0.0
        x, y, _ = mount.position
        assert math.copysign(1.0, roll) == math.copysign(1.0, y) or abs(y) < 1e-9
        assert math.copysign(1.0, pitch) == -math.copysign(1.0, x) or abs(x) < 1e-9


WHERE = {
    "crazyflie": ["front right ccw", "rear right cw", "rear left ccw", "front left cw"],
    "hummingbird": ["front left cw", "front right ccw", "rear right cw", "rear left ccw"],
    "x500": ["front right ccw", "rear left ccw", "front left cw", "rear right cw"],
    "research-2.6kg": ["front left cw", "rear left ccw", "rear right cw", "front right ccw"],
    "paper": ["right ccw", "rear cw", "left ccw", "front cw"],
}


@EVERY
def test_each_rotor_is_where_its_maker_counts_it_and_turns_as_it_does(name):
    said = []
    for mount in VEHICLES[name].geometry().mounts:
        x, y, z = mount.position
        along = "front " if x > 1e-6 else "rear " if x < -1e-6 else ""
        across = "left " if y > 1e-6 else "right " if y < -1e-6 else ""
        said.append(along + across + ("ccw" if mount.spin > 0 else "cw"))
        assert z == 0.0
    assert said == WHERE[name]


@EVERY
def test_every_number_says_its_unit_and_where_it_is_from(name):
    vehicle = VEHICLES[name]
    for parameter in parameters(vehicle):
        assert parameter.source, parameter.key
        assert parameter.unit or parameter.key in {"battery.efficiency", "layout"}
    keys = {key for key, _, _ in numbers(vehicle)}
    tables = {key.partition(".")[0] for key in keys} | {"rotors", "layout"}
    assert set(vehicle.sources) <= keys | tables
    assert vehicle.description


@EVERY
def test_the_rotors_lift_between_one_and_a_half_times_and_five_times_the_weight(name):
    vehicle = VEHICLES[name]
    built = vehicle.build()
    assert 1.4 < 4.0 * built.allocation.most / (vehicle.mass * vehicle.gravity) < 5.0
    assert built.allocation.least * 4.0 < 0.2 * vehicle.mass * vehicle.gravity


@pytest.mark.parametrize(
    ("name", "minutes"), [("crazyflie", 7.0), ("hummingbird", 20.0), ("x500", 12.0), ("research-2.6kg", 15.0)]
)
def test_a_full_battery_holds_the_vehicle_up_for_as_long_as_is_usual(name, minutes):
    vehicle = VEHICLES[name]
    airframe, hover = vehicle.build().airframe, commanded(vehicle, (0.0, 0.0, 0.0))
    power = electrical_power(airframe.battery, airframe.rotor.torque, hover)
    half = terminal_voltage(airframe.battery, 0.5 * airframe.battery.capacity, power)
    assert airframe.battery.capacity * half / power / 60.0 == pytest.approx(minutes, rel=0.15)
    assert airframe.rotor.fastest * half / airframe.battery.full > 1.02 * hover[0]


@pytest.mark.parametrize("speed", [4.2, 8.5, 12.1])
def test_wind_drags_the_research_vehicle_as_in_its_published_flights(speed):
    vehicle = VEHICLES["research-2.6kg"]
    weight = vehicle.mass * 9.81

    def moved(lean_and_thrust):
        lean, thrust = lean_and_thrust
        speeds = Vector([math.sqrt(0.25 * thrust / vehicle.rotor.thrust_coefficient)] * 4)
        attitude = from_rotation_vector(vector(0.0, -lean, 0.0))  # into the wind
        velocity = rates(vehicle, speeds, vector(speed, 0.0, 0.0), attitude).velocity
        return velocity[0], velocity[2]

    lean, thrust = fsolve(moved, [0.3, weight], xtol=1e-12)
    wanted = 0.92 * speed + 0.033 * speed * speed
    assert thrust * math.sin(lean) == pytest.approx(wanted, abs=0.06)


@pytest.mark.parametrize(("name", "across", "along"), [("x500", 0.8032, 1.0139), ("crazyflie", 0.00825, 0.00608)])
def test_rotor_drag_in_hover_is_that_of_its_source(name, across, along):
    vehicle = VEHICLES[name]
    hover = commanded(vehicle, (0.0, 0.0, 0.0))
    assert vehicle.mass * rates(vehicle, hover, vector(0.5, 0.0, 0.0)).velocity[0] == pytest.approx(0.5 * across, rel=1e-3)
    assert vehicle.mass * rates(vehicle, hover, vector(0.0, 0.0, 0.5)).velocity[2] == pytest.approx(0.5 * along, rel=1e-3)


def test_the_crazyflie_has_the_thrust_of_its_curve_in_hover_and_at_its_limits():
    rotor = VEHICLES["crazyflie"].rotor

    def source(speed):
        rpm = speed * 60.0 / (2.0 * math.pi)
        return -5.382196214637237e-7 * rpm + 2.4582929831265485e-10 * rpm * rpm

    hover = commanded(VEHICLES["crazyflie"], (0.0, 0.0, 0.0))[0]
    assert rotor.thrust_coefficient * hover**2 == pytest.approx(source(hover), rel=1e-3)
    assert rotor.thrust_coefficient * rotor.fastest**2 == pytest.approx(0.0145 * 9.81, rel=1e-3)
    assert rotor.thrust_coefficient * rotor.slowest**2 == pytest.approx(0.012818, rel=1e-3)


def test_the_papers_vehicle_is_that_of_the_lagrange_plant_seen_in_right_handed_axes():
    """Eq. 5 as read in docs/conventions.md: its angles are left-handed, so its torques have the other sign."""
    vehicle, lagrange = VEHICLES["paper"], VehicleSection()
    assert (vehicle.mass, vehicle.inertia, vehicle.gravity) == (lagrange.mass, lagrange.inertia, lagrange.gravity)
    arm, moment = 2.25, vehicle.rotor.torque_coefficient / vehicle.rotor.thrust_coefficient
    assert moment == pytest.approx(lagrange.rotors.moment)
    for place, column in enumerate(columns(vehicle.geometry(), moment)):
        thrust, (tau_psi, tau_theta, tau_phi) = mix(
            Rotors(arm, moment, 0.0, 1.0), Vector(1.0 if i == place else 0.0 for i in range(4))
        )
        assert list(column) == pytest.approx([thrust, -tau_phi, -tau_theta, -tau_psi])


def document():
    """docs/vehicles.md, and the module that draws its picture."""
    spec = importlib.util.spec_from_file_location("docs_vehicles", ROOT / "docs" / "vehicles.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return (ROOT / "docs" / "vehicles.md").read_text(encoding="utf-8"), module


def test_the_table_of_the_document_is_that_of_the_presets():
    text, module = document()
    assert module.table() in text


def test_the_vehicle_of_the_document_flies_and_shows_every_key_and_default(tmp_path):
    text, _ = document()
    block = next(block for block in re.findall(r"```toml\n(.*?)```", text, re.DOTALL) if block.startswith("description"))
    path = tmp_path / "own.toml"
    path.write_text(block, encoding="utf-8")
    vehicle = read_vehicle(path)
    assert vehicle.warnings() == []
    for section in (vehicle.rotor, vehicle.drag, vehicle.effects):
        assert all(key in block for key in type(section).model_fields)
        for key, field in type(section).model_fields.items():
            assert field.is_required() or getattr(section, key) == field.default, key
    for key in type(vehicle).model_fields:
        assert key in block or key in {"preset", "file"} | IDENTIFIED


def test_the_air_sensors_and_events_of_the_document_are_read():
    text, _ = document()
    block = next(block for block in re.findall(r"```toml\n(.*?)```", text, re.DOTALL) if block.startswith("seed"))
    content = tomllib.loads(block)
    assert WindSection.model_validate(content["wind"]).build().turbulence.airspeed == 0.0  # that of the mean wind
    sensors = SensorsSection.model_validate(content["sensors"])
    assert (sensors.build(0.002, 0.002, 9.81).suite.delay, sensors.build(0.002, 0.002, 9.81).fix_steps) == (2, 5)
    assert all(key in block for key in SensorsSection.model_fields)
    events = TypeAdapter(list[AnyEvent]).validate_python(content["events"])
    assert len(build_events(events, 1.0).payloads) == 3


def test_the_vehicles_and_their_notice_travel_in_the_wheel(tmp_path):
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    inside = zipfile.ZipFile(wheel).namelist()
    for name in [*(f"{name}.toml" for name in preset_names()), "NOTICE"]:
        assert f"quadstep/vehicle/presets/{name}" in inside
