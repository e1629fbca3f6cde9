"""Default gains hold a hover with margin on presets and on vehicles from random data sheets."""

from itertools import product

import numpy as np
import pytest

from quadstep.control.registry import STOCK, names
from quadstep.identify.datasheet import Datasheet
from quadstep.interfaces.controller import Measured
from quadstep.interfaces.gain import usual
from quadstep.interfaces.plant import Model
from quadstep.linear.grade import FRAGILE, SOUND
from quadstep.mission.listings import preset_names
from quadstep.numbers import vector
from tests.random_sheets import UNGRADED, any_vehicle, hover, hover_grade, random_sheet, vehicle

LAWS = [law for law in names(Measured) if law not in (*UNGRADED, *STOCK)]
LEARNING = [law for law in LAWS if hover({"preset": "x500"}, law).controller.table is not None]
SEVEN = {"name": "Seven inch", "mass": 0.95, "wheelbase": 0.3, "kv": 1300.0, "cells": 6, "propeller": {"inches": [7.0, 4.0]}}


@pytest.mark.parametrize("law", ["geometric", "pid", "lqr"])
def test_a_vehicle_from_a_random_data_sheet_hovers_with_margin(law):
    table = vehicle(random_sheet(np.random.default_rng(names(Measured).index(law))))
    found = hover_grade(table, law)
    assert found.word == SOUND, f"{law}: {found.why}"


HEAVY = {
    "name": "Small rotors", "mass": 0.65, "wheelbase": 0.27, "layout": "hexa-plus", "kv": 1440.0, "cells": 7,
    "motor_mass": 0.05,
}  # fmt: skip
"""Heavy for its propellers, whose torque turns it fifteen times more slowly than their thrust tilts it."""


def test_an_observer_that_also_turns_the_heading_is_no_faster_than_that_allows():
    sheet = Datasheet.model_validate({**HEAVY, "propeller": {"inches": [3.1, 1.55]}})
    found = hover_grade(vehicle(sheet), "mpc")
    assert found.word == SOUND, found.why


SLOW = {"preset": "research-2.6kg", "rotor": {"rise_time": 0.15, "fall_time": 0.15}}
"""Lag alone, nearly: what a loop of given gains is slowed by the most."""


@pytest.mark.parametrize("law", [pytest.param(law, marks=pytest.mark.thorough) if law == "mpc" else law for law in LAWS])
def test_gains_need_no_help_of_the_air(law):
    """In an ordinary run, that of the slowest law to grade is tried on two other vehicles."""
    found = hover_grade({**SLOW, "effects": {"drag": False}}, law)
    assert found.word == SOUND, f"{law}: {found.why}"


@pytest.mark.slow
@pytest.mark.parametrize("law", LEARNING)
def test_gains_have_margin_while_nets_learn(law):
    found = hover_grade({**SLOW, "effects": {"drag": False}}, law, learning=True)
    assert found.word == SOUND, f"{law}: {found.why}"


@pytest.mark.thorough
@pytest.mark.parametrize("law", LAWS)
def test_random_vehicles_hover_with_margin_with_drag_or_without(law):
    random = np.random.default_rng(1)
    for table in (any_vehicle(random) for _ in range(100)):
        found = hover_grade(table, law)
        assert found.word == SOUND, f"{law} on {table}: {found.why}"


@pytest.mark.thorough
@pytest.mark.parametrize("law", LAWS)
def test_vehicles_from_500_random_data_sheets_hover_with_margin(law):
    random = np.random.default_rng(0)
    for sheet in (random_sheet(random) for _ in range(500)):
        found = hover_grade(vehicle(sheet), law)
        assert found.word == SOUND, f"{law} on {sheet.name}: {found.why}"


VEHICLES = (*({"preset": preset} for preset in preset_names()), vehicle(Datasheet.model_validate(SEVEN)))


@pytest.mark.parametrize("rest", [False, pytest.param(True, marks=pytest.mark.thorough)])
@pytest.mark.parametrize("law", LAWS)
def test_every_preset_and_the_tutorials_vehicle_hover_with_margin(law, rest):
    """An ordinary run tries one: every law on a vehicle with drag, every vehicle under every sixth law."""
    for turn, (drag, table) in enumerate(product((True, False), VEHICLES), LAWS.index(law)):
        if (turn % len(VEHICLES) > 0 or not drag) == rest:
            found = hover_grade({**table, "effects": {"drag": drag}}, law)
            assert found.word == SOUND, f"{law} on {table.get('preset', 'seven inches')}, drag {drag}: {found.why}"


SAID = [("raptor", "x500", SOUND), ("raptor", "research-2.6kg", FRAGILE)]  # on the hummingbird: tests/test_linear_grade.py


@pytest.mark.slow
@pytest.mark.parametrize(("law", "preset", "word"), SAID)
def test_laws_whose_gains_do_not_follow_from_delay_are_graded_as_the_docs_say(law, preset, word):
    pytest.importorskip("foundation_policy")
    found = hover_grade({"preset": preset}, law, simulation={"control_period": 0.01, "guidance_period": 0.01})
    assert found.word == word


def pace(**changes):
    return hover({"preset": "x500", **changes.pop("vehicle", {})}, "geometric", **changes).modelled.model()


def test_delay_slows_the_loops_wherever_it_is():
    plain = pace().agility
    assert plain == pytest.approx(0.043 / (0.045 + 3.0 * 0.001))
    late = pace(vehicle={"command": {"speed": 1000.0, "delay": 0.01}})
    assert late.agility == pytest.approx(0.043 / (0.045 + 3.0 * 0.011))
    assert pace(sensors={"latency": 0.01, "imu_latency": 0.01}).agility == pytest.approx(late.agility)
    assert pace(simulation={"control_period": 0.01}).agility == pytest.approx(0.043 / (0.045 + 3.0 * 0.005))


def test_late_fixes_slow_the_loops_around_the_gyros_more_than_that_of_the_rates():
    late = pace(sensors={"latency": 0.02})
    assert late.rate_agility == pytest.approx(0.043 / (0.048 + 0.7 * 0.02))
    assert 1.0 / late.agility == pytest.approx(1.0 / late.rate_agility + 0.02 / 0.07)
    later = pace(sensors={"latency": 0.1})
    assert (later.rate_agility, later.agility) == pytest.approx((0.21, 0.21 / (1.0 + 0.021 / 0.07)))
    assert pace(sensors={"latency": 0.1, "estimator": True}).agility == pace().agility


def late(law, latency, table):
    return hover_grade(table, law, sensors={"latency": latency})


@pytest.mark.parametrize("law", ["geometric", "pid", "lqr"])
def test_a_hover_on_late_fixes_has_margin(law):
    found = late(law, 0.02, {"preset": "research-2.6kg"})
    assert found.word == SOUND, f"{law}: {found.why}"


@pytest.mark.slow
def test_the_quickest_loop_of_rates_stands_two_further_delays_of_late_fixes():
    found = late("indi-velocity", 0.04, {"preset": "research-2.6kg"})
    assert found.word == SOUND, found.why


@pytest.mark.thorough
@pytest.mark.parametrize("latency", [0.01, 0.02, 0.04])
@pytest.mark.parametrize("law", LAWS)
def test_every_preset_hovers_with_margin_on_late_fixes(law, latency):
    for preset in preset_names():
        found = late(law, latency, {"preset": preset})
        assert found.word == SOUND, f"{law} on {preset}: {found.why}"


def test_heavy_rotors_slow_the_loop_of_the_heading_alone():
    light, heavy = (pace(vehicle={"rotor": {"inertia": inertia}}) for inertia in (0.0, 1e-3))
    assert light.yaw_agility == light.agility == heavy.agility
    assert heavy.yaw_agility < 0.5 * light.yaw_agility


def test_late_fixes_slow_the_heading_of_heavy_rotors_less_than_a_late_gyro():
    late, latest = (
        hover({"preset": "hummingbird"}, "pid", sensors=sensors).modelled.model().yaw_agility
        for sensors in ({"latency": 0.04}, {"latency": 0.04, "imu_latency": 0.04})
    )
    assert late == pytest.approx(0.0621, rel=1e-2)
    assert latest < 0.25 * late


def test_usual_gains_take_the_agility_of_their_axes():
    model = Model(mass=1.0, inertia=vector(1.0, 1.0, 1.0), gravity=9.81, agility=0.5, rate_agility=0.8, yaw_agility=0.1)
    assert usual(8.0, 2)(model) == 2.0
    assert usual(8.0, 1, "yaw")(model) == pytest.approx(0.8)
    assert usual((8.0, 8.0, 10.0), 2, "body")(model) == pytest.approx((2.0, 2.0, 0.1))
    assert usual((8.0, 8.0, 10.0), 1, "rate")(model) == pytest.approx((6.4, 6.4, 1.0))
    assert usual((8.0, 4.0, 1.0), (3, 1, 0))(model) == (1.0, 2.0, 1.0)
