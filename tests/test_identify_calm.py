"""What calm flights do not determine is refused, what is given holds; names, voltages and wind do not mislead."""

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

from quadstep.commands.identify import read_logs
from quadstep.identify.averages import blocks
from quadstep.identify.fit import UNDETERMINED, WINDY, Fitted, Identified, anew, by_rotors, identify
from quadstep.identify.guesses import from_averages
from quadstep.identify.intervals import AVERAGED, DYNAMIC, noise_bias
from quadstep.identify.known import fitted
from quadstep.identify.logs.flight import FlightRecord
from quadstep.identify.mean_forces import MOST_TILT, ForceNumbers, exponents, forces, wind_lean
from quadstep.identify.parameters import VEHICLE, before_fit, numbers_of
from quadstep.identify.replay import ErrorTable, ready
from quadstep.identify.run import Identification, answer, evidence, for_test, same_setpoints, untested
from quadstep.identify.run import run as run_identification
from quadstep.identify.uses import LATENESS, cards, reach, uses
from quadstep.identify.vehicle_file import as_toml, identified_vehicle
from quadstep.io.errors import UserError
from quadstep.mission.airframe_tables import CommandSection
from quadstep.mission.listings import load_preset
from quadstep.mission.read import check_mission
from quadstep.numbers import vector
from quadstep.report.units import number, percent
from quadstep.vehicle.allocation import mixing
from tests import made_flights
from tests.calm_flights import WOBBLY, logged, start, true_values
from tests.challenge.identified import off
from tests.independent_flights import cases
from tests.made_flights import MAPPING, hover_ratio, table, write

pytestmark = pytest.mark.usefixtures("optimised")


def test_what_a_calm_circle_does_not_determine_is_refused_and_the_vehicle_and_its_missions_say_so(tmp_path):
    found = identify([logged("x500", "circle", 1, 15.0)], start("x500"), lambda _: None, predictors=False)
    for key in ("rotor.rise_time", "command.delay", "rotor.inertia", "rotor.torque_coefficient"):
        assert found.kept[key] == UNDETERMINED
        assert key not in found.fitted
    assert "command.exponent" in found.kept
    assert found.numbers.airframe.rotor.torque == start("x500").rotor.torque_coefficient  # as it was
    truth = true_values("x500")
    assert {"command.speed", "drag.rotor[0]"} <= set(found.fitted)
    assert all(off(key, one, truth[key]) <= 1.0 for key, one in found.fitted.items())
    text = as_toml(identified_vehicle(start("x500"), found, "made", "given"))
    assert text.startswith("# Not determined by the flights that it was identified from, and as it was before: ")
    assert "rotor.rise_time" in text.splitlines()[0]
    (tmp_path / "mine.toml").write_text(text)
    mission = {"path": {"type": "minimum-jerk", "end": [1.0, 0.0, 0.0], "duration": 1.0}, "vehicle": {"file": "mine.toml"}}
    warnings = check_mission(mission, "m.toml", tmp_path).plan(tmp_path).warnings
    assert any("do not determine" in one and "rotor.rise_time" in one for one in warnings)


def test_commands_that_answer_to_noise_do_not_determine_their_exponent():
    random = np.random.default_rng(0)
    flight, command = np.zeros(200, dtype=np.int64), random.normal(0.0, 0.02, 200)
    still = np.zeros(200)
    free, why, _ = exponents(flight, command, still, random.normal(0.0, 0.02, 200), False)
    assert free == []
    assert "of the changes in thrust" in why["command.exponent"]
    assert why["command.voltage_exponent"] == "the voltage never changes, or was not logged"
    assert exponents(flight, command, still, 2.0 * command + random.normal(0.0, 0.01, 200), False)[0] == ["exponent"]


def test_a_full_speed_is_no_surer_than_the_exponent_that_leads_to_it():
    flight, vehicle = logged("x500", "circle", 1, 12.0, 0.1), start("x500")
    bent = replace(flight, motors=flight.motors ** (1.0 / 0.85))  # speed = fastest command^0.85
    every = (*DYNAMIC, *AVERAGED)
    p, told, why, _ = from_averages([bent], vehicle, numbers_of(vehicle, [bent]))
    moved = by_rotors([bent], vehicle, p, every, np.zeros(len(every)))
    assert "command.exponent" in why
    away = abs(np.log(told["command.speed"].value / vehicle.rotor.fastest))
    assert 0.05 < away < moved["command.speed"] < 0.5


def test_what_the_averages_tell_holds_under_structures_that_the_log_does_not_show():
    """A battery that sags and was not logged: commands rise, and so an exponent near 0 explains that thrust does not."""
    flight, vehicle = logged("x500", "circle", 1, 12.0, 0.1), start("x500")
    sagging = replace(flight, motors=flight.motors / np.linspace(1.0, 0.85, flight.rows)[:, None])
    every = (*DYNAMIC, *AVERAGED)
    p, told, _, _ = from_averages([sagging], vehicle, numbers_of(vehicle, [sagging]))
    moved = by_rotors([sagging], vehicle, p, every, np.zeros(len(every)))
    assert "command.exponent" not in told  # at the end of its range
    ends = np.log(vehicle.rotor.fastest * np.array([1.0, 0.85]) / told["command.speed"].value)
    assert 0.05 < np.abs(ends).max() < moved["command.speed"]


def test_torques_whose_commands_answer_to_the_gyros_noise_tell_less():
    """Noise at the law's rate, of which a log sees every fifth value, and a rotor a fifth of what the log suggests."""
    random, time = np.random.default_rng(0), 0.01 * np.arange(2000)
    rows = np.array([list(row) for row in mixing(start("x500").geometry(), 1.0)])
    free = tuple(
        one for one in VEHICLE if not one.key.startswith(("imu", "centre", "command.s", "command.e", "command.v", "drag"))
    )

    def widened(*noise):
        torque = np.sin(2.0 * np.pi * 3.0 * time)[:, None] + np.array(noise) * random.normal(0.0, np.sqrt(0.5), (2000, 3))
        squares = 0.4 + 0.01 * np.c_[np.zeros(2000), torque] @ np.linalg.inv(rows).T
        position = {"position": np.c_[time, time, 5.0 * (time > 0.0)]}
        flight = FlightRecord("made", time, 0.01, np.sqrt(squares), False, position, (), np.zeros(2000, dtype=bool))
        return dict(zip((one.key for one in free), noise_bias([flight], start("x500").geometry(), free), strict=True))

    assert max(widened(0.0, 0.0, 0.0).values()) < 0.01
    found = widened(0.0, 1.0, 2.0)  # a half of the variance about y, four fifths of that about z
    assert found["inertia[0]"] < 0.01
    assert found["inertia[1]"] == found["rotor.rise_time"] == pytest.approx(np.log(2.0), abs=0.15)
    assert found["rotor.inertia"] == found["rotor.torque_coefficient"] == pytest.approx(np.log(5.0), abs=0.25)
    assert found["command.delay"] == pytest.approx(0.005, abs=0.0007)


def test_a_logged_voltage_changes_nothing_of_a_vehicle_without_the_effect():
    flight = logged("x500", "circle", 2, 8.0, 0.1, volts=np.array([16.0, 15.2]))
    assert hover_ratio(flight, start("x500")) == pytest.approx(1.0, abs=0.003)
    battery = start("x500").model_copy(update={"effects": start("x500").effects.model_copy(update={"battery": True})})
    assert hover_ratio(flight, battery) < 0.9
    plain = logged("x500", "circle", 2, 8.0, 0.1)
    assert hover_ratio(plain, battery) == pytest.approx(1.0, abs=0.003)  # what was not logged does nothing
    with pytest.raises(UserError, match="the voltage was logged in some flights only"):
        ready([flight, plain], start("x500"))


def test_a_steady_wind_is_not_taken_for_a_tilt():
    flight = logged("x500", "circle", 3, 25.0, 0.1, wind={"mean": [6.0, 2.0, 0.0]})
    p = numbers_of(start("x500"), [flight])
    block = blocks([flight], 0.001, 0.045, 9.81)
    known, why = forces(block, p, start("x500").geometry(), speeds=False)
    assert "imu.tilt[0]" not in known
    assert why["imu.tilt[0]"] == why["centre_of_gravity[1]"] == "it cannot be separated from the wind"
    # the wind is an airspeed: what it does changes with the lean and with the speed of the rotors
    assert known["drag.rotor[0]"].value == pytest.approx(true_values("x500")["drag.rotor[0]"], rel=3e-3)
    assert known["command.speed"].value == pytest.approx(1191.0, rel=1e-3)


def test_a_wind_is_found_under_a_heading_that_turns():
    """Its lean turns with the heading, so that its mean is no tilt; taken for still air the rotors were 0.4 % too slow."""
    flight = logged("x500", "circle", 820, 20.0, 0.1, wind={"mean": [0.115, -1.997, 0.0]}, turn=2.0 * np.pi / 10.0)
    block = blocks([flight], 0.001, 0.045, 9.81)
    known, why = forces(block, numbers_of(start("x500"), [flight]), start("x500").geometry(), speeds=False)
    assert "imu.tilt[0]" in why
    assert known["drag.rotor[0]"].value == pytest.approx(true_values("x500")["drag.rotor[0]"], rel=0.01)
    assert known["command.speed"].value == pytest.approx(1191.0, rel=5e-4)


def test_a_tilt_is_found_under_a_heading_that_turns():
    flight = logged("x500", "circle", 7, 20.0, 0.1, turn=2.0 * np.pi / 10.0)
    block = blocks([flight], 0.001, 0.045, 9.81)
    tilt = np.array([[1.0, 0.0, 0.04], [0.0, 1.0, 0.0], [-0.04, 0.0, 1.0]])  # of the sensor, whose axes are logged
    leaning = block._replace(axes=block.axes @ tilt)
    known, why = forces(leaning, numbers_of(start("x500"), [flight]), start("x500").geometry(), speeds=False)
    assert "imu.tilt[1]" not in why
    assert abs(known["imu.tilt[1]"].value) == pytest.approx(0.04, rel=0.15)


def test_what_a_light_wind_would_do_as_well_is_not_told_unless_the_air_was_still_or_the_heading_turns():
    """0.2 m/s lean an x500 by 6 mrad, of which eight times the interval of its tilt said nothing."""
    flight = logged("x500", "lively", 64, 12.0, 1.0, wind={"mean": [-0.0613, -0.2236, 0.0]})
    found = identify([flight], start("x500"), lambda _: None, predictors=False)
    truth = true_values("x500")
    assert all(off(key, one, truth[key]) <= 1.0 for key, one in found.fitted.items())
    assert found.kept["imu.tilt[0]"] == found.kept["imu.tilt[1]"] == WINDY
    assert list(found.numbers.tilt) == [0.0, 0.0]  # as it was
    block = blocks([flight], 0.001, 0.045, 9.81)
    assert wind_lean(block) == pytest.approx(MOST_TILT, rel=0.02)
    back = np.where(np.arange(len(block.row)) % 2, 1.0, -1.0)[:, None, None, None]
    assert wind_lean(block._replace(axes=back * block.axes)) < 0.1 * MOST_TILT


def test_logs_of_one_name_are_told_apart_by_their_folders(tmp_path):
    flight = logged("crazyflie", "circle", 4, 4.0, 0.1, volts=np.array([4.0, 3.9]))
    flight.channels["setpoint"] = flight.channels["position"]
    (tmp_path / "map.toml").write_text(MAPPING)
    paths = [tmp_path / day / card / "00000001.csv" for day, card in (("monday", "a"), ("monday", "b"), ("tuesday", "a"))]
    header, rows = table(flight)
    for place, path in enumerate(paths):
        path.parent.mkdir(parents=True)
        write(path, header, rows[130 * place : 130 * place + 130])
    mapping = str(tmp_path / "map.toml")
    assert [one.name for one in read_logs(paths[:2], mapping)] == ["a/00000001", "b/00000001"]
    assert [one.name for one in read_logs(paths, mapping)] == ["monday/a/00000001", "b/00000001", "tuesday/a/00000001"]
    assert [one.name for one in read_logs(paths[:1], mapping)] == ["00000001"]
    with pytest.raises(UserError, match="given twice"):
        read_logs([paths[0], paths[0]], mapping)
    copy = tmp_path / "copy.csv"
    copy.write_bytes(paths[1].read_bytes() + b"\n")
    with pytest.raises(UserError, match=r"copy: 1\.\d* s of it are in b/00000001, too; a flight counts once"):
        read_logs([*paths, copy], mapping)


def compared(ratios):
    """Errors of one flight over those of "constant", by group; rates of zero err by 0.95 of those."""
    ones = np.ones((3, 4, 1))
    return ErrorTable(
        ("a",), (1, 10, 50), ones * np.array(ratios)[None, :, None], ones, ones * [[[1.0], [1.0], [1.0], [0.95]]], 100
    )


KNOWN = Fitted(1.0, 0.95, 1.05, "", "made")
TOLD = dict.fromkeys(("command.speed", "inertia[0]", "inertia[1]", "rotor.rise_time", "command.delay"), KNOWN)


def test_the_order_of_flights_changes_neither_which_are_held_out_nor_the_fit(monkeypatch):
    """Of four flights two turn about both axes, one about pitch alone; the one before the last was held out."""
    one = logged("x500", "circle", 5, 4.0, 0.1)

    def turning(name, *sizes):
        return replace(one, name=name, channels=one.channels | {"rates": np.sin(one.time)[:, None] * sizes})

    calm, most, less, pitch = (
        turning("calm", 0.01, 0.01, 0.0), turning("most", 2.0, 2.0, 0.0), turning("less", 1.0, 1.0, 0.0),
        turning("pitch", 0.01, 3.0, 0.0),
    )  # fmt: skip
    for flights in permutations([calm, most, less, pitch]):
        assert [flight.name for flight in for_test(flights)] == ["less"]
        assert untested(for_test(flights)) == []
    rolls = [turning(f"roll{i}", 1.0 + i, 0.01, 0.0) for i in range(2)]
    pitches = [turning(f"pitch{i}", 0.01, 1.0 + i, 0.0) for i in range(2)]
    for flights in permutations([*rolls, *pitches]):
        assert untested(for_test(flights)) == []
    both, gentle = turning("both", 0.5, 0.5, 0.0), turning("gentle", 0.05, 0.05, 0.0)
    for flights in permutations([both, gentle, turning("roll", 3.0, 0.01, 0.0), turning("pitch", 0.01, 3.0, 0.0)]):
        assert [flight.name for flight in for_test(flights)] == ["gentle", "both"]  # which is the second about either axis
    assert untested(for_test([calm, calm, calm, most])) == ["roll", "pitch"]  # fit and test need one each
    seen = []

    def fit(fitted, *_, **__):
        seen.append([flight.name for flight in fitted])
        raise UserError("seen")

    monkeypatch.setattr("quadstep.identify.run.identify", fit)
    apart = [replace(each, motors=(1.0 + 1e-6 * place) * each.motors) for place, each in enumerate([calm, most, less, pitch])]
    for flights in permutations(apart):
        with pytest.raises(UserError, match="seen"):
            run_identification(flights, start("x500"), "given", True, lambda _: None)
    assert seen == [seen[0]] * 24 and "less" not in seen[0]


def test_the_first_sentence_names_what_is_wrong_and_what_to_fly_next(flight_numbers):
    found = Identified(flight_numbers, None, TOLD, {}, KNOWN)
    run = Identification(start("x500"), found, ["a"], found, compared([1.2, 0.5, 0.8, 0.6]), None)
    known = f"{number(100.0 * max(max(reach(found, key)) for key in ('roll', 'pitch', LATENESS)), 2)} %; 50 % is enough"
    ready = f"Roll and pitch (known to within {known}) can be tuned on this model; yaw is not judged: held-out flights "
    ready += "test roll and pitch only."
    assert answer(run) == ready  # whatever it predicts of the position
    assert all(row[-1] for row in uses(found).rows), "each use has flights that tell more"
    poor = Identified(flight_numbers, None, {**TOLD, "inertia[0]": Fitted(1.0, 0.3, 1.2, "", "made")}, {}, KNOWN)
    assert answer(run._replace(found=poor)) == (
        "Pitch can be tuned on this model; do not yet tune roll: the gain of roll is not known to within 50 %. Next, fly "
        "quick reversals of roll, with a motor command logged every 10 ms or faster."
    )
    none = Identified(flight_numbers, None, {"command.delay": KNOWN}, {})
    assert answer(run._replace(found=none)).endswith(
        "Next, fly climbs and descents that vary the thrust and quick reversals of roll and pitch, with a motor command "
        "logged every 10 ms or faster."
    )
    worse = run._replace(commands=compared([0.2, 0.5, 1.13, 1.63]))
    assert answer(worse) == (
        "Do not yet tune roll and pitch on this model: on held-out flights it predicts attitude and rates no better than a "
        "baseline without a model."
    )
    assert "no flight was held out to test it" in answer(run._replace(commands=None))
    sagging = answer(run._replace(thrust=(0.9, 1.1)))
    assert sagging.startswith("Do not yet tune roll and pitch on this model: its thrust is wrong by more than 5 %. The ")
    assert "The modelled thrust is 0.90 to 1.10 times the thrust needed. Predictions learn this error" in sagging
    assert cards(found, worse.commands, 0.01)[-1].more == f"{percent(1.63 / 0.95)} of the better baseline's error"


def test_what_no_held_out_flight_turns_about_is_untested_and_one_manoeuvre_flown_twice_is_said_to_be(flight_numbers):
    """Two held-out flights of one path in a vertical plane: a model with any inertia about x predicts them as well."""
    one = logged("x500", "circle", 5, 8.0, 0.1)
    rates = np.sin(one.time)[:, None] * [0.01, 1.0, 1.0]
    goal = np.c_[one.time, one.time, one.time]
    flat = replace(one, channels=one.channels | {"rates": rates, "setpoint": goal})
    lively = replace(one, channels=one.channels | {"rates": rates[:, [1, 0, 2]], "setpoint": 1.1 * goal})
    assert (untested([flat, flat]), untested([flat, lively]), untested([])) == (["roll"], [], [])
    assert same_setpoints([flat, flat]) and not same_setpoints([flat, lively]) and not same_setpoints([flat])
    found = Identified(flight_numbers, None, TOLD, {}, KNOWN)
    run = Identification(start("x500"), found, ["a"], found, compared([0.2, 0.5, 0.8, 0.6]), None)
    assert answer(run._replace(idle=["roll"])) == (
        "Pitch can be tuned on this model; do not yet tune roll: no held-out flight turns much about roll. Next, fly quick "
        "reversals of roll, with a motor command logged every 10 ms or faster."
    )
    assert "turns much about roll or pitch" in answer(run._replace(idle=["roll", "pitch"]))
    told = evidence(run._replace(alike=True), [one], start("x500"))
    assert any("Held out: a, all with the same setpoints." in part.text for part in told.sections if hasattr(part, "text"))


@pytest.fixture
def flight_numbers():
    return numbers_of(start("x500"), [logged("x500", "circle", 5, 4.0, 0.1)])


def test_a_second_fit_has_the_intervals_of_a_first_one():
    """It began at the observer of long predictions, where two steps left it: in-plane drag was said to be known within 2 %."""
    flights = made_flights.logged(0)[:1]
    first = identify(flights, made_flights.start(), lambda _: None, predictors=False, still=True)
    observer = first.numbers.observer._replace(rates=vector(0.5, 0.5), velocity=vector(0.2, 0.2), force=vector(5.0, 5.0))
    earlier = first._replace(numbers=first.numbers._replace(observer=observer))
    second = identify(flights, made_flights.start(), lambda _: None, earlier, predictors=False, still=True)
    for key, one in first.fitted.items():
        assert second.fitted[key].high - second.fitted[key].low == pytest.approx(one.high - one.low, rel=0.2), key


def test_what_is_not_known_of_the_lag_is_not_known_of_the_thrust_either():
    """A hover that wobbles by 30 degrees, whose commands change between the rows of the log."""
    flight = logged("x500", "hover", 160, 20.0, 0.1, 0.01, gains=WOBBLY)
    found = identify([flight], start("x500"), lambda _: None, predictors=False)
    truth = true_values("x500")
    speed = found.fitted["command.speed"]
    assert speed.high - speed.low > 0.02 * speed.value
    assert all(off(key, one, truth[key]) <= 1.0 for key, one in found.fitted.items())


def test_a_number_that_ends_where_its_range_does_is_not_told():
    case = list(cases(4303, 10, 8.0))[9]
    found = identify([case.flight], case.start, lambda _: None, predictors=False)
    assert (case.truth["command.delay"], found.kept["command.delay"]) == (0.006, UNDETERMINED)  # it was said to be 0.1 s
    assert all(off(key, one, case.truth[key]) < 1.0 for key, one in found.fitted.items())


def test_numbers_of_the_starting_vehicle_outside_the_intervals_are_marked(
    flight_numbers,
):
    given = load_preset("crazyflie")
    found = {
        "inertia[0]": Fitted(*np.array([3.2e-5, 1.9e-5, 4.8e-5]), "kg m^2", "made"),
        "inertia[1]": Fitted(1.7e-5, 1.6e-5, 1.8e-5, "kg m^2", "made"),
        "rotor.rise_time": Fitted(0.039, 0.03, 0.071, "s", "made"),
        "command.delay": Fitted(0.012, 0.006, 0.019, "s", "made"),
        "centre_of_gravity[1]": Fitted(-0.00078, -0.003, 0.0016, "m", "made"),
    }
    fit = Identified(flight_numbers, None, found, {})
    alone, scaled = fitted(fit, given, 5.5e-5)
    assert {len(row) for one in (alone, scaled) for row in (one.header, *one.rows)} == {4}  # which a phone shows whole
    assert [*alone.rows] == [
        ("rotor rise time [ms]", "39", "30 to 71", "72.0, outside"),
        ("command delay [ms]", "12", "6 to 19", "–"),
        ("centre of gravity along y [mm]", "−0.78", "−3.00 to 1.60", "–"),
    ]
    assert scaled.rows[0][2:] == ("−41 to +50 %", "1.68 × 10⁻⁵, outside")
    assert scaled.rows[1][3] == "1.68 × 10⁻⁵"
    assert "J_z = 5.50 × 10⁻⁵ kg m^2, in proportion to the inertias about x and y (given: 2.98 × 10⁻⁵)." in scaled.text
    assert "J_z = 2.98 × 10⁻⁵ kg m^2, as given." in fitted(fit, given, given.inertia[2])[1].text


def test_where_a_logged_voltage_never_changes_the_thrust_is_right_all_the_same():
    flights = [
        replace(one, channels=one.channels | {"voltage": np.full_like(volts, np.mean(volts))})
        for one in made_flights.logged(0)[:2]
        for volts in [one.channel("voltage")]
    ]
    found = identify(flights, made_flights.start(), lambda _: None, predictors=False, still=True)
    assert "command.voltage_exponent" in found.kept
    assert found.numbers.curve.voltage_exponent == 1.0  # of rotors on a battery; with 0 the thrust would be 18 % too large
    assert not any(one.unsure for key, one in found.fitted.items() if "[" not in key and key != "command.delay")
    made = identified_vehicle(made_flights.start(), found, "", "")
    assert [hover_ratio(one, made) for one in flights] == pytest.approx([1.0, 1.0], abs=0.02)


def test_where_an_exponent_stays_as_given_the_thrust_is_right_all_the_same():
    """The speed of a full command is found again for the exponent that stays, as by an identification that refuses it."""
    curve = CommandSection(speed=3000.0, exponent=0.7, voltage_exponent=1.0, nominal_voltage=4.2, delay=0.0)
    flights, given = made_flights.logged(0)[:1], made_flights.start().model_copy(update={"command": curve})
    p, told, _, _ = from_averages(flights, given, before_fit(given, flights))
    assert told["command.exponent"].value == pytest.approx(0.95, abs=0.05)
    kept = {"command.exponent": "made", **{one.key: "made" for one in DYNAMIC}}
    speed = Fitted(told["command.speed"].value, 1.0, 1e9, "rad/s", "made")
    found, fitted = anew(flights, given, p, DYNAMIC, told, {"command.speed": speed}, kept)
    assert float(found.curve.exponent) == 0.7
    assert fitted["command.speed"].value == pytest.approx(float(found.curve.speed))
    made = identified_vehicle(given, Identified(found, None, fitted, kept), "", "")
    assert hover_ratio(flights[0], made) == pytest.approx(1.0, abs=0.01)  # 1.22 with the speed of the other exponent


def test_a_fit_of_mean_forces_that_overshoots_stays_finite():
    """A hover in wind under a battery that sags, searched at another lag, had a step of hundreds, and a traceback."""
    still = np.zeros(2)
    at = ForceNumbers(np.array([7.0]), 1.0, 1.0, still, still, np.zeros((1, 2)))
    assert at.moved({"flat": 0.0}, np.array([800.0]), np.zeros((1, 2))).levels == [8.0]


def test_the_gain_of_pitch_allows_for_an_inertia_about_z_that_no_flight_reveals():
    """A vehicle that rolls while it yaws pitches, too; this was taken for an inertia about y that was 19 % too large."""
    flight, truth = logged("crazyflie", "lively", 963, 12.0, 0.1), true_values("crazyflie")
    found = identify([flight], made_flights.misgiven(start("crazyflie"), 1.0, 1.0, 0.8), lambda _: None, predictors=False)
    low, high = reach(found, "pitch")
    speed = truth["command.speed"] / found.fitted["command.speed"].value
    gain = speed**2 * found.fitted["inertia[1]"].value / truth["inertia[1]"] - 1.0
    assert -low < gain < high < 0.5
    assert max(reach(found, "roll")) < 0.1
    assert gain > 0.08  # so that it matters
