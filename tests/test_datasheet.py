"""Vehicles from data sheets: measured values are recovered, errors are named, and the result flies."""

import tomllib
from itertools import product

import numpy as np
import pytest

from quadstep.identify.datasheet import Datasheet
from quadstep.identify.vehicle_estimate import estimate, rotor_inertia, vehicle_of
from quadstep.identify.vehicle_file import campaign_text
from tests.campaigns import fly
from tests.commands import quadstep
from tests.sheets import SHEET

SPEED, EXPONENT, K_F, K_M = 2600.0, 0.9, 1.7e-6, 2.2e-8


def stand(**columns):
    throttle = np.linspace(0.1, 1.0, 10)
    speed = SPEED * throttle**EXPONENT
    known = {"throttle": throttle, "thrust": K_F * speed**2, **columns}
    return "[stand]\n" + "\n".join(f"{key} = {[float(one) for one in value]}" for key, value in known.items()) + "\n"


def made(text):
    return Datasheet.model_validate(tomllib.loads(text))


def test_what_a_stand_measured_is_found():
    speed = SPEED * np.linspace(0.1, 1.0, 10) ** EXPONENT
    found = estimate(made(SHEET + stand(speed=speed, torque=K_M * speed**2)))
    assert found.thrust.value == pytest.approx(K_F, rel=1e-9)
    assert found.torque.value == pytest.approx(K_M, rel=1e-9)
    assert found.exponent.value == pytest.approx(EXPONENT, rel=1e-9)
    assert found.fastest.value == pytest.approx(SPEED, rel=1e-9)
    assert found.thrust.source.startswith("measured")
    assert found.thrust.spread < 0.01
    assert found.voltage_exponent.source.startswith("usual")


def test_without_a_stand_formulas_are_within_their_own_uncertainty():
    found = estimate(made(SHEET))
    assert found.thrust.source.startswith("estimated")
    assert abs(np.log(found.thrust.value / K_F)) < 3.0 * found.thrust.spread
    vehicle = vehicle_of(made(SHEET), found)
    assert not vehicle.warnings()
    assert vehicle.inertia[2] > vehicle.inertia[0]


def test_torque_follows_from_current_where_nothing_better_is_known():
    speed = SPEED * np.linspace(0.1, 1.0, 10) ** EXPONENT
    current = K_M * speed**2 / (60.0 / (2.0 * np.pi * 1950.0))
    found = estimate(made(SHEET + stand(speed=speed, current=current)))
    assert found.torque.value == pytest.approx(K_M, rel=0.05)


STAND = "[stand]\nthrottle = [0.1, 0.5, 1.0]\nthrust = [1.0, 4.0, 9.0]\n"


@pytest.mark.parametrize(("text", "said"), [
    (SHEET.replace("mass = 0.62", "mass = 62.0"), "times the weight"),
    (SHEET.replace("kv = 1950\n", ""), "kv is required"),
    (SHEET.replace("kv = 1950\n", "kv = 1e9\n"), "kv: "),
    (SHEET.replace("wheelbase = 0.22", "wheelbase = 1e6"), "sheet.toml: wheelbase: "),
    (SHEET.replace("wheelbase = 0.22", "wheelbase = 220"), "wheelbase: 220 m does not fit propellers of 0.1"),
    (SHEET.replace("wheelbase = 0.22", "wheelbase = 1e-9"), "sheet.toml: wheelbase: "),
    (SHEET.replace("kv = 1950\n", "kv = 1e-6\n"), "sheet.toml: kv: "),
    (SHEET.replace("[5.1, 4.3]", "[1e-3, 4.3]"), "sheet.toml: propeller: inches: the diameter should be from 0.4"),
    (SHEET.replace("inches = [5.1, 4.3]", "diameter = 1e3"), "sheet.toml: propeller.diameter: "),
    (SHEET.replace("[5.1, 4.3]", "[5.1, 4.3], mass = 1"), "propeller.mass: 4 propellers of 1 kg"),
    (SHEET.replace("capacity = 1.5", "capacity = 1e9"), "sheet.toml: capacity: "),
    (SHEET + STAND + "voltage = [1e-3, 1e-3, 1e-3]\n", "voltage: its largest number should be from 1 to 1000 V"),
    (SHEET + STAND + "speed = [1, 2, 3]\n", "speed: its largest number should be from 10 to 100000 rad/s, not 3"),
    (SHEET + STAND + "current = [1e-5, 1e-5, 1e-5]\n", "current: its largest number should be from 0.01"),
    (SHEET + "[stand]\nthrottle = [0.1, 0.5]\nthrust = [1.0, 2.0]\n", "at least 3"),
    (SHEET + "[stand]\nthrottle = [10, 50, 100]\nthrust = [1.0, 2.0, 3.0]\n", "not a percentage"),
    (SHEET + "[stand]\nthrottle = [0.1, 0.5, 1.0]\nthrust = [100.0, 500.0, 1200.0]\n", "in grams"),
    (SHEET + "[stand]\nthrottle = [0.1, 0.5, 1.0]\nthrust = [3.0, 2.0, 1.0]\n", "does not rise"),
    (SHEET.replace("0.033", "0.33"), "leave nothing"),
    (SHEET.replace("inches = [5.1, 4.3]", "pitch = 0.1"), "give either diameter"),
])  # fmt: skip
def test_a_wrong_sheet_is_one_line(tmp_path, text, said):
    (tmp_path / "sheet.toml").write_text(text)
    run = quadstep("vehicle", "fit", tmp_path / "sheet.toml", "--out", tmp_path / "v.toml")
    assert run.code == 2
    assert said in run.err
    assert run.err.count("\n") == 1
    assert not (tmp_path / "v.toml").exists()


@pytest.mark.parametrize("name", ["v.toml", "v_campaign.toml"])
def test_a_file_that_holds_something_else_is_not_replaced_unasked(tmp_path, name):
    (tmp_path / "sheet.toml").write_text(SHEET)
    arguments = ("vehicle", "fit", tmp_path / "sheet.toml", "--out", tmp_path / "v.toml")
    assert quadstep(*arguments).code == 0
    assert quadstep(*arguments).code == 0  # the same again
    (tmp_path / name).write_text("mine = 1\n")
    run = quadstep(*arguments)
    assert (run.code, run.err.count("\n")) == (2, 1)
    assert f"{name}: exists; replace it with --overwrite" in run.err
    assert (tmp_path / name).read_text() == "mine = 1\n"
    assert quadstep(*arguments, "--overwrite").code == 0
    assert (tmp_path / name).read_text() != "mine = 1\n"


def test_the_vehicle_and_its_campaign_fly(tmp_path):
    (tmp_path / "sheet.toml").write_text(SHEET + stand())
    assert quadstep("vehicle", "fit", tmp_path / "sheet.toml", "--out", tmp_path / "v.toml").code == 0
    text = (tmp_path / "v_campaign.toml").read_text().replace("flights = 2000", "flights = 16")
    (tmp_path / "v_campaign.toml").write_text(text)
    run = fly(tmp_path / "v_campaign.toml", tmp_path / "out")
    assert run.code == 0
    assert "All 16 flights succeeded" in run.out


@pytest.mark.parametrize(
    "inertia", [(0.003, 0.003, 0.0058), (0.01, 0.02, 0.025), (0.004, 0.02, 0.0165), (0.003, 0.003, 0.006), (1.0, 1.0, 1e-3)]
)
def test_every_inertia_that_its_campaign_draws_is_a_body_and_the_likeliest_is_within(inertia):
    sheet = made(SHEET + f"inertia = {list(inertia)}\n")
    vary = tomllib.loads(campaign_text(sheet, estimate(sheet), "v.toml"))["vary"]["vehicle"].get("inertia", {})
    drawn = [vary.get(str(axis), {"low": value, "median": value, "high": value}) for axis, value in enumerate(inertia)]
    assert all(one["low"] <= one["median"] <= one["high"] for one in drawn)
    for corner in product(*((one["low"], one["high"]) for one in drawn)):
        assert 2.0 * max(corner) <= sum(corner) * (1.0 + 1e-12)


ROTORS = [  # diameter [m], mass of the motor [kg], J_r [kg m^2]
    (0.047, 0.0, 3.5e-8),  # Crazyflie 2: crazyflow 0.4.0, prop_inertia, propeller alone
    (0.254, 0.0, 2.65e-5),  # PX4's Gazebo model x500_base, propeller alone
    (
        0.254,
        0.057,
        2.573e-5,
    ),  # Robbe Roxxy 2827-34 with EPP 10x4.5: J_M of hector_quadrotor (Meyer and others 2012), identified
    (0.305, 0.057, 4.142e-5),  # the same motor with EPP 12x4.5
    (0.3, 0.0, 6.0e-5),  # OS4, its motor behind a gear: Bouabdallah's thesis (EPFL 3727, 2007), J_r
]
"""Published inertias of propellers, with their motor's bell where a mass is given."""


def test_the_estimate_of_a_rotors_inertia_is_as_sure_as_it_says():
    off = []
    for diameter, motor, published in ROTORS:
        text = SHEET.replace("inches = [5.1, 4.3]", f"diameter = {diameter}").replace("0.033", f"{motor or 1e-9}")
        sheet = made(text)
        found = rotor_inertia(sheet, 4)
        off.append(np.log(found.value / published) / found.spread)
    assert np.abs(off).max() < 1.5
    assert np.abs(np.mean(off)) < 2.0 / np.sqrt(len(off)), "no bias that these tell"
