"""What a user's controller may command, measure and know in advance; and the loops that it may have."""

import re

import numpy as np
import pytest

from quadstep import Mission, UserError, fly
from quadstep.control.rate_loop import RateGains, rate_loop
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.controller import BodyRates, Measured
from quadstep.mission.template import template
from quadstep.numbers import vector

HEAD = '''
from dataclasses import dataclass
from typing import NamedTuple

from quadstep.interfaces.controller import BodyRates, RotorSpeeds, RotorThrusts
from quadstep.interfaces.controller import Command, Controller
from quadstep.interfaces.gain import believed, gain, given
from quadstep.control.vectoring import up_axis, desired_attitude
from quadstep.numbers import Number, Vector, maximum, sqrt, vector
from quadstep.numbers.rotations import cross, rotation_matrix


class Gains(NamedTuple):
    mass: Number = believed("mass")
    gravity: Number = given(lambda model: model.gravity)
    k_p: Number = gain(6.0, "1/s^2", "position")
    k_v: Number = gain(4.0, "1/s", "velocity")
    k_R: Number = gain(12.0, "1/s", "attitude")


def force(measured, reference, gains):
    pull = gains.k_p * (reference.position - measured.position) + gains.k_v * (reference.velocity - measured.velocity)
    return gains.mass * (reference.acceleration + pull + vector(0.0, 0.0, gains.gravity))


def body_rates(measured, wanted, gains):
    """Towards the wanted thrust axis; yaw is left alone."""
    rotation = rotation_matrix(measured.attitude)
    return gains.k_R * (rotation.T @ cross(up_axis(rotation), (1.0 / wanted.norm()) * wanted))
'''

RATES = (
    HEAD
    + """
@dataclass(frozen=True)
class Own(Controller):
    name = "own"
    Gains = Gains
    commands = BodyRates

    def law(self, memory, measured, reference, gains, t, period):
        wanted = force(measured, reference, gains)
        thrust = wanted @ up_axis(rotation_matrix(measured.attitude))
        return BodyRates(thrust, body_rates(measured, wanted, gains)), memory
"""
)

ROTORS = (
    HEAD
    + """
class RotorGains(NamedTuple):
    law: Gains
    inertia: Vector = believed("inertia")
    k_w: Number = gain(30.0, "1/s", "body rates")
    shares: tuple = given(lambda model: model.shares)
    per_speed: Number = given(lambda model: model.per_speed)


@dataclass(frozen=True)
class Own(Controller):
    name = "own"
    Gains = RotorGains
    commands = RotorThrusts

    def law(self, memory, measured, reference, gains, t, period):
        wanted = force(measured, reference, gains.law)
        thrust = wanted @ up_axis(rotation_matrix(measured.attitude))
        torque = gains.inertia * (gains.k_w * (body_rates(measured, wanted, gains.law) - measured.rates))
        thrusts = Vector(share @ vector(thrust, *torque) for share in gains.shares)
        return COMMAND, memory
"""
)
THRUSTS = ROTORS.replace("COMMAND", "RotorThrusts(thrusts)")
SPEEDS = (
    ROTORS.replace("COMMAND", "RotorSpeeds(Vector(sqrt(maximum(one, 0.0) / gains.per_speed) for one in thrusts))")
    .replace("commands = RotorThrusts", "commands = RotorSpeeds")
    .replace("import Number, Vector, sqrt", "import Number, Vector, maximum, sqrt")
)
WRENCH = ROTORS.replace("COMMAND", "Command(thrust, torque)").replace("commands = RotorThrusts", "")

SENSES = (
    HEAD
    + """
class Memory(NamedTuple):
    told: Vector


@dataclass(frozen=True)
class Own(Controller):
    name = "own"
    Gains = Gains
    commands = BodyRates
    also_measures = ("specific_force", "rotor_speeds", "age")

    def start(self, measured, gains):
        return Memory(vector(*measured.specific_force, measured.rotor_speeds[0], measured.age))

    def law(self, memory, measured, reference, gains, t, period):
        wanted = force(measured, reference, gains)
        thrust = wanted @ up_axis(rotation_matrix(measured.attitude))
        told = vector(*measured.specific_force, measured.rotor_speeds[0], measured.age)
        return BodyRates(thrust, body_rates(measured, wanted, gains), vector(told[2], told[3], told[4])), Memory(told)
"""
)

LOOPS = (
    HEAD
    + """
class Memory(NamedTuple):
    plan: Number
    guide: Number
    ahead: Vector


@dataclass(frozen=True)
class Own(Controller):
    name = "own"
    Gains = Gains
    commands = BodyRates
    preview = (0.0, 0.5)
    rates = {"plan": 0.1, "guide": 0.02, "law": 0.004}

    def start(self, measured, gains):
        return Memory(0.0, 0.0, vector(0.0, 0.0, 0.0))

    def plan(self, memory, measured, reference, gains, t, period):
        return memory._replace(plan=memory.plan + period, ahead=reference.ahead[1].position - reference.ahead[0].position)

    def guide(self, memory, measured, reference, gains, t, period):
        return memory._replace(guide=memory.guide + period)

    def law(self, memory, measured, reference, gains, t, period):
        wanted = force(measured, reference, gains)
        thrust = wanted @ up_axis(rotation_matrix(measured.attitude))
        said = vector(memory.plan, memory.guide, memory.ahead[0])
        return BodyRates(thrust, body_rates(measured, wanted, gains), desired_attitude=said), memory
"""
)

FLIGHT = {
    "vehicle": {"preset": "x500"},
    "path": {"type": "minimum-jerk", "end": [2.0, 1.0, 1.0], "duration": 3.0},
    "simulation": {"duration": 3.0, "control_period": 0.004},
}


@pytest.fixture
def mission(tmp_path, monkeypatch):
    """Makes the mission of a controller's text."""
    monkeypatch.chdir(tmp_path)

    def made(text, **changed):
        name = f"own_{abs(hash(text))}.py"
        (tmp_path / name).write_text(text)
        return Mission(**{**FLIGHT, "controller": {"type": f"{name}:Own"}, **changed})

    return made


@pytest.mark.parametrize("text", [RATES, THRUSTS, SPEEDS], ids=["body rates", "thrusts", "speeds"])
def test_every_form_of_command_flies_alike_on_floats_and_lanes(mission, text):
    one = mission(text)
    lanes, floats = fly(one), fly(one, engine="python")
    assert lanes.outcome is Outcome.COMPLETED
    assert lanes.metrics()["position_rmse[m]"] < 0.1
    np.testing.assert_array_equal(lanes.rows, floats.rows)


def test_rotors_told_their_thrusts_or_speeds_do_what_the_allocation_does_within_the_limits(mission):
    flights = [fly(mission(text)) for text in (WRENCH, THRUSTS, SPEEDS)]
    for other in flights[1:]:
        np.testing.assert_allclose(other.rows, flights[0].rows, rtol=1e-7, atol=1e-7)


def test_thrusts_beyond_the_limits_are_held_there(mission):
    flight = fly(mission(THRUSTS.replace("Vector(share @", "Vector(100.0 + share @"), limits={"distance": 1e6}))
    made, most = flight.column("u_a"), 4 * 12.13  # N, docs of the preset
    np.testing.assert_allclose(made[100:130], most, rtol=1e-3)


def test_the_rate_loop_turns_the_body_as_it_is_told():
    """Against an independent formula: J w_dot + w x J w = torque gives w_dot = k (w_d - w) + I."""
    inertia, rates = np.diag([0.02, 0.03, 0.05]), np.array([1.0, -2.0, 3.0])
    measured = Measured(*[vector(0.0, 0.0, 0.0)] * 2, vector(1.0, 0.0, 0.0, 0.0), vector(*rates), 0.0, vector(0.0, 0.0, 0.0))
    gains = RateGains(vector(0.02, 0.03, 0.05), vector(40.0, 30.0, 20.0), vector(5.0, 6.0, 7.0), 2.0)
    command, integral = rate_loop(gains, vector(0.1, 0.2, -0.3), BodyRates(9.0, vector(2.0, 1.0, -1.0)), measured, 0.01)
    turning = np.linalg.solve(inertia, np.array(list(command.torque)) - np.cross(rates, inertia @ rates))
    error = np.array([1.0, 3.0, -4.0])
    np.testing.assert_allclose(turning, np.array([40.0, 30.0, 20.0]) * error + [0.1, 0.2, -0.3], rtol=1e-12)
    np.testing.assert_allclose(list(integral), np.array([0.1, 0.2, -0.3]) + 0.01 * np.array([5.0, 6.0, 7.0]) * error)
    assert command.thrust == 9.0


def test_the_rate_loop_has_keys_of_its_own(mission):
    one = mission(RATES)
    assert one.controller.rate_p is None  # follows from the vehicle
    slow = fly(Mission(**{**FLIGHT, "controller": {"type": one.controller.type, "rate_p": 5.0}}))
    assert not np.array_equal(slow.rows, fly(one).rows)


def test_what_is_measured_beside_the_motion(mission):
    """The accelerometer of a hovering vehicle feels its weight; a fix ages until the next."""
    sensors = {"fix_period": 0.02, "latency": 0.012, "imu_period": 0.004}
    still = {"type": "minimum-jerk", "end": [0.0, 0.0, 0.0], "duration": 3.0}
    flight = fly(mission(SENSES, sensors=sensors, path=still))
    feels, speed, age = (flight.column(name) for name in ("yaw_d", "pitch_d", "roll_d"))
    assert feels[50:] == pytest.approx(9.81, abs=0.05)
    assert 8.54858e-6 * speed**2 == pytest.approx(flight.column("f1"), rel=1e-3)
    t = flight.column("t")
    since = np.floor(t / 0.004 + 1e-9) % 5 * 0.004  # the law runs every 0.004 s, a row holds its last sample
    assert age == pytest.approx(0.012 + since, abs=1e-9)


def test_with_an_estimator_age_is_that_of_the_board(mission):
    sensors = {"fix_period": 0.02, "latency": 0.012, "imu_period": 0.004, "imu_latency": 0.008, "estimator": True}
    flight = fly(mission(SENSES, sensors=sensors))
    assert flight.column("roll_d") == pytest.approx(0.008)
    assert flight.column("yaw_d")[100:].mean() == pytest.approx(9.81, abs=0.3)


def test_the_accelerometer_has_the_noise_of_the_mission(mission):
    sensors = {"accelerometer_noise": 0.02, "imu_period": 0.004}
    still = {"type": "minimum-jerk", "end": [0.0, 0.0, 0.0], "duration": 3.0}
    feels = fly(mission(SENSES, sensors=sensors, path=still)).column("yaw_d")[50:]
    assert feels.std() == pytest.approx(0.02 / 0.004**0.5, rel=0.15)


def test_loops_run_at_their_own_rates_and_the_path_ahead_is_told(mission):
    flight = fly(mission(LOOPS))
    t, plan, guide, ahead = (flight.column(name) for name in ("t", "yaw_d", "pitch_d", "roll_d"))
    sampled = np.floor(t / 0.004 + 1e-9) * 0.004
    assert plan == pytest.approx(0.1 * (np.floor(sampled / 0.1 + 1e-9) + 1))
    assert guide == pytest.approx(0.02 * (np.floor(sampled / 0.02 + 1e-9) + 1))
    x_d = lambda t: 2.0 * (10 * (t / 3) ** 3 - 15 * (t / 3) ** 4 + 6 * (t / 3) ** 5)  # noqa: E731
    at = np.floor(sampled / 0.1 + 1e-9) * 0.1
    early = at < 2.4
    assert ahead[early] == pytest.approx((x_d(at + 0.5) - x_d(at))[early], abs=1e-9)
    slower = fly(mission(LOOPS, simulation={**FLIGHT["simulation"], "loop_periods": {"plan": 0.5}}))
    assert slower.column("yaw_d")[-1] == pytest.approx(3.5)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("commands = BodyRates", "commands = dict", "commands: should be one of Command, BodyRates, RotorThrusts"),
        ("commands = BodyRates", "also_measures = ('smell',)", "also_measures: unknown measurement 'smell'; allowed: spec"),
        ("commands = BodyRates", "preview = (-1.0,)", "preview: should consist of times from 0 to 60 s, not -1.0"),
        ("commands = BodyRates", "rates = {'nowhere': 0.1}", "rates: 'nowhere' should be `law`"),
        ("commands = BodyRates", "rates = {'law': 0.0}", "rates: law should be a sample time above 0 s, not 0.0"),
        ("commands = BodyRates", "commands = RotorSpeeds", "law: should return a RotorSpeeds and the memory"),
        ("return BodyRates(thrust", "return Command(thrust", "should return a BodyRates"),
    ],
)  # fmt: skip
def test_a_wrong_declaration_is_one_line(mission, old, new, said):
    with pytest.raises(UserError, match=re.escape(said)) as caught:
        fly(mission(RATES.replace(old, new)))
    assert "\n" not in str(caught.value)


def test_a_command_for_other_rotors_is_one_line(mission):
    with pytest.raises(UserError, match="should have an entry for each of the 4 rotors, not 3"):
        fly(mission(THRUSTS.replace("for share in gains.shares)", "for share in gains.shares[:3])")))


def test_a_loop_that_there_is_not_is_one_line(mission):
    with pytest.raises(UserError, match=r"loop_periods\.plan: the controller has no such loop; allowed: none"):
        mission(RATES, simulation={"loop_periods": {"plan": 0.5}})


def test_a_written_mission_shows_the_loops_of_its_controller(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.py").write_text(LOOPS)
    assert "# loop_periods = { plan = 0.1 } #" in template("x500", "own.py:Own", tmp_path)
    assert "loop_periods" not in template("x500")
