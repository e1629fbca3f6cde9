"""Identification: of flights whose every number is known, and through the commands."""

import json
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from quadstep.identify import pages, uses
from quadstep.identify.averages import AverageEstimate, blocks, rotor_speeds, torques
from quadstep.identify.fit import CHECKED, LONG_WEIGHTS, Fitted, Identified, identify, in_step
from quadstep.identify.flown_setpoints import FlightComparison, Tracking, as_flown, is_wrong, span_of_thrust
from quadstep.identify.guesses import EFFECTS, limits_guess
from quadstep.identify.intervals import IN_STEP, StandardErrors, freedom, jackknife, with_values
from quadstep.identify.logs.flight import spectrum
from quadstep.identify.mean_forces import forces
from quadstep.identify.parameters import LIMITS, numbers_of
from quadstep.identify.prediction import Predictor, desired_thrust_axis
from quadstep.identify.prediction_problem import PredictionBatch, as_states, solved
from quadstep.identify.replay import predictions_of, read_starts, ready
from quadstep.identify.residual import trained
from quadstep.identify.run import Identification, evidence, followers
from quadstep.identify.starts import differences, laid_out, starts_at
from quadstep.identify.starts import logged as measured_at
from quadstep.identify.vehicle_file import as_toml, as_written, identified_vehicle
from quadstep.io.errors import UserError
from quadstep.mission.listings import read_vehicle
from quadstep.numbers import Vector
from quadstep.vehicle.rigid_body import AirframeState
from tests import identified as identification
from tests.commands import quadstep
from tests.made_flights import MAPPING, NOMINAL, TRUTH, logged, misgiven, start, table, true_value, write

pytestmark = pytest.mark.usefixtures("optimised")

LEAVES = {
    "curve.speed": "command.speed",
    "curve.exponent": "command.exponent",
    "curve.voltage_exponent": "command.voltage_exponent",
    "curve.delay": "command.delay",
    "airframe.rotor.rise": "rotor.rise_time",
    "airframe.rotor.fall": "rotor.rise_time",
    "airframe.inertia.0": "inertia[0]",
    "airframe.inertia.1": "inertia[1]",
    "airframe.rotor.torque": "rotor.torque_coefficient",
    "airframe.rotor.inertia": "rotor.inertia",
    "airframe.drag.rotor.0": "drag.rotor[0]",
    "airframe.drag.rotor.1": "drag.rotor[0]",
    "airframe.drag.rotor.2": "drag.rotor[2]",
    "airframe.drag.flapping": "drag.flapping",
    "offset.0": "centre_of_gravity[0]",
    "offset.1": "centre_of_gravity[1]",
    "tilt.0": "imu.tilt[0]",
    "tilt.1": "imu.tilt[1]",
}


@pytest.fixture(scope="module")
def flights():
    return logged(0)


@pytest.fixture(scope="module")
def truth(flights):
    """The true numbers."""
    p = numbers_of(start(), flights)
    p = p._replace(curve=p.curve._replace(nominal=NOMINAL))
    return with_values(p, {leaf: TRUTH[key] for leaf, key in LEAVES.items()})


def gone_wrong(flights, p, horizon=10):
    """Mean error of the rates and of the velocity, `horizon` samples ahead, over how much they change until then."""
    laid = laid_out(flights[:1])
    starts = starts_at(flights[:1], laid, [np.arange(300, 1700, 20)])
    batch = PredictionBatch(
        Predictor(start().geometry(), EFFECTS, (horizon,)), flights[0].period, starts, p._replace(rows=laid.rows)
    )
    states, _ = batch.run([np.zeros(0)])
    later, now = measured_at(flights[:1], starts, horizon), measured_at(flights[:1], starts, 0)
    parts, changes = differences(as_states(states[0][0]), later), differences(now, later)
    return [float(np.linalg.norm(parts[i], axis=1).mean() / np.linalg.norm(changes[i], axis=1).mean()) for i in (3, 1)]


def test_the_true_numbers_predict_best(flights, truth):
    best = gone_wrong(flights, truth)
    assert best[0] < 0.08  # the gyro's noise alone is 0.07 of how much these calm flights turn
    assert best[1] < 0.04
    for leaf, factor in (
        ("airframe.inertia.0", 1.4),
        ("airframe.rotor.rise", 0.4),
        ("airframe.drag.flapping", -1.0),
        ("offset.1", -1.0),
        ("curve.speed", 1.05),
    ):
        wrong = with_values(truth, {leaf: factor * TRUTH[LEAVES[leaf]]})
        assert sum(gone_wrong(flights, wrong)) > sum(best), leaf


def test_averages_tell_thrust_tilt_and_centre_of_gravity(flights, truth):
    block = blocks(flights, TRUTH["command.delay"], TRUTH["rotor.rise_time"], 9.81)
    begun = numbers_of(start(), flights)
    begun = begun._replace(curve=begun.curve._replace(nominal=NOMINAL))
    found, why = forces(block, begun, start().geometry(), speeds=False)
    assert not why
    for key, within in (
        ("command.speed", 0.01), ("command.exponent", 0.01), ("command.voltage_exponent", 0.05), ("imu.tilt[0]", 0.1),
        ("imu.tilt[1]", 0.1), ("drag.rotor[0]", 0.03),
    ):  # fmt: skip
        assert found[key].value == pytest.approx(TRUTH[key], rel=within), key
    found = torques(block, truth, start().geometry(), False)
    for key, within in (("centre_of_gravity[0]", 0.1), ("centre_of_gravity[1]", 0.05), ("drag.flapping", 0.08)):
        assert found[key].value == pytest.approx(TRUTH[key], rel=within), key


def test_measured_rotor_speeds_tell_the_same_torques_as_the_commands_behind_them(flights, truth):
    block = blocks(flights, TRUTH["command.delay"], TRUTH["rotor.rise_time"], 9.81)
    speeds = rotor_speeds(block.commands, block.volts, truth.curve, measured=False)
    measured = torques(block._replace(commands=speeds / TRUTH["command.speed"]), truth, start().geometry(), True)
    for key, value in torques(block, truth, start().geometry(), False).items():
        assert measured[key].value == pytest.approx(value.value, rel=1e-9), key


def test_averages_of_logs_without_noise_are_exact(truth):
    flights = logged(0, noise=0.0)
    block = blocks(flights, TRUTH["command.delay"], TRUTH["rotor.rise_time"], 9.81)
    found, _ = forces(block, truth, start().geometry(), speeds=False)
    for key, value in torques(block, truth, start().geometry(), False).items():
        found[key] = value
    # in a log, commands vary in straight lines between rows
    for key, within in (
        ("command.speed", 2e-4), ("command.exponent", 5e-4), ("command.voltage_exponent", 1e-3), ("imu.tilt[0]", 1e-3),
        ("imu.tilt[1]", 1e-3), ("drag.rotor[0]", 1e-4), ("drag.rotor[2]", 5e-3), ("centre_of_gravity[0]", 5e-4),
        ("centre_of_gravity[1]", 5e-4), ("drag.flapping", 5e-4),
    ):  # fmt: skip
        assert found[key].value == pytest.approx(TRUTH[key], rel=within), key


def test_what_the_commands_do_not_vary_stays_with_a_reason(flights, truth):
    block = blocks(flights, 0.013, 0.04, 9.81)
    still = block._replace(volts=np.full_like(block.volts, NOMINAL))
    _, why = forces(still, truth, start().geometry(), speeds=False)
    assert why["command.voltage_exponent"] == "the voltage never changes, or was not logged"


def test_intervals_hold_where_few_parts_of_flight_tell_most():
    """A slope of zero from 40 parts, six of which lie ten times as far out as the others; each column is a trial."""
    random = np.random.default_rng(3)
    place, noise = np.where(np.arange(40) < 6, 1.0, 0.1)[:, None], random.normal(0.0, 1.0, (40, 4000))
    scores, information = place * noise, place * place
    slope = scores.sum(axis=0) / information.sum()
    shifts = (scores.sum(axis=0) - scores) / (information.sum() - information) - slope
    every = StandardErrors(jackknife(shifts), np.full(4000, 39.0), np.zeros(4000))
    found = every._replace(freedom=freedom(shifts))
    held, naive = (np.mean(np.abs(slope) < one.halves(0.0)) for one in (found, every))
    assert naive < 0.93 < held < 0.96
    assert freedom(np.ones((5, 2))) == pytest.approx([4.0, 4.0])  # nothing varies
    alike = freedom(random.normal(0.0, 1.0, (40, 4000)))
    assert np.median(alike) == pytest.approx(39.0, abs=2.0)
    assert (alike <= 39.0).all()


@pytest.fixture(scope="module")
def begun():
    """Wrong also in mass, thrust coefficient and inertia about z, which no flight reveals; for J_z, see docs/logs.md."""
    return misgiven(start(), 1.1, 0.8, 1.0)


@pytest.fixture(scope="module")
def found(flights, begun, optimised):
    return identify(flights, begun, lambda what: None, predictors=False, still=True)


def test_a_known_vehicle_is_found_again(begun, found):
    for key, one in found.fitted.items():
        assert one.value == pytest.approx(true_value(key, begun), rel=0.2 if key == "command.delay" else 0.08), key
        assert one.low < one.value < one.high
    # 95 % of these intervals should hold the true number: `python -m tests.identified coverage 100`
    inside = [key for key, one in found.fitted.items() if one.low <= true_value(key, begun) <= one.high]
    assert len(inside) >= len(found.fitted) - 2, set(found.fitted) - set(inside)


def test_the_gain_of_a_loop_is_known_whatever_the_mass_and_as_well_as_its_interval_says(begun, found):
    speed = true_value("command.speed") / found.fitted["command.speed"].value
    thrust = speed**2 * start().rotor.thrust_coefficient / begun.rotor.thrust_coefficient
    for axis, key in uses.TUNED.items():
        low, high = uses.reach(found, axis)
        assert low < 0.3 and high < 0.3
        assert -low < thrust * found.fitted[key].value / TRUTH[key] - 1.0 < high
    late = found.late
    assert late.low < TRUTH["rotor.rise_time"] + TRUTH["command.delay"] < late.high
    parts = [found.fitted[key] for key in ("rotor.rise_time", "command.delay")]
    assert late.value == pytest.approx(sum(one.value for one in parts))
    assert late.high - late.low < 0.8 * sum(one.high - one.low for one in parts)  # of which one is too long, one too short
    low, high = (1e3 * end for end in late[1:3])
    assert uses.cards(found, None, 0.01)[2].more == f"95 % interval: {low:.0f} to {high:.0f}\N{NO-BREAK SPACE}ms"
    unthrust = found._replace(fitted={key: one for key, one in found.fitted.items() if key != "command.speed"})
    assert uses.within(unthrust, "roll") == "not determined"  # it is the thrust that is not, and no sign
    assert max(uses.reach(found, uses.LATENESS)) == pytest.approx(
        max(late.high / late.value - 1.0, 1.0 - late.low / late.value)
    )


def test_a_setpoint_pulls_and_tilts_no_more_than_the_limits(truth):
    observer = truth.observer._replace(path=8.0, drift=4.0, reach=4.0, steepest=0.3)
    state = AirframeState(*[Vector([0.0] * 3)] * 4, speeds=Vector([0.0] * 4), charge=0.0)

    def lean(goal, speed, **limits):
        moving = state._replace(velocity=Vector((speed, 0.0, 0.0)))
        return desired_thrust_axis(moving, Vector((goal, 0.0, 1.0)), observer._replace(**limits), 10.0)[0]

    assert lean(0.25, 0.0) == pytest.approx(0.2)
    assert lean(9.0, 0.5) == pytest.approx(0.2)  # 4 m/s^2 at most, less 4 x 0.5
    assert lean(9.0, 0.0) == pytest.approx(0.3)
    assert lean(-9.0, 0.0, steepest=1.0) == pytest.approx(-0.4)


class Limited:
    """A problem whose error is least at one pair of limits, or does not depend on them."""

    def __init__(self, best):
        self.batch = SimpleNamespace(free=LIMITS)
        self.best = best

    def residuals(self, points):
        off = [sum(abs(x - math.log(y)) for x, y in zip(point, self.best or np.exp(point), strict=True)) for point in points]
        return np.array(off).reshape(-1, 1, 1, 1, 1) * np.ones((1, len(LONG_WEIGHTS.horizons), 4, 1, 3))


def test_limits_are_those_that_predict_best_or_stay():
    begun = np.log([1e3, 0.5])
    assert limits_guess(Limited((4.8, 0.31)), begun, LONG_WEIGHTS) == pytest.approx(np.log([5.0, 0.3]))
    assert list(limits_guess(Limited(None), begun, LONG_WEIGHTS)) == list(begun)


def test_a_replayed_vehicle_flies_with_the_limits_of_its_flights(tmp_path, truth):
    vehicle = read_vehicle(written(tmp_path, truth))
    seen = vehicle.guided_prediction.model_copy(
        update={"path": 8.0, "drift": 4.0, "spring": 120.0, "leak": (18.0, 5.0), "reach": 4.4, "steepest": 0.4}
    )
    gains = as_flown(vehicle.model_copy(update={"guided_prediction": seen}))
    assert gains["axis_speed"] == pytest.approx(1.1)
    assert math.tan(gains["most_tilt"]) == pytest.approx(0.4)
    assert gains["attitude"][:2] == pytest.approx([120.0 / 18.0] * 2)
    quick = as_flown(vehicle.model_copy(update={"guided_prediction": seen.model_copy(update={"spring": 1e4})}))
    assert quick["attitude"][:2] == pytest.approx([0.3 * quick["rate"][0]] * 2)  # not faster than the rotors allow


def test_the_span_of_thrust_shows_a_battery_that_sags(tmp_path, flights, truth):
    vehicle = read_vehicle(written(tmp_path, truth))
    whole = flights[0]
    time = whole.time - whole.time[0]
    low, high = span_of_thrust([whole], vehicle)
    assert 0.99 < low < high < 1.01
    assert not is_wrong((low, high))
    fading = replace(
        whole, motors=whole.motors * (1.0 + 0.1 * time / time[-1])[:, None]
    )  # what an autopilot adds as volts fall
    low, high = span_of_thrust([fading], vehicle)
    power = 2.0 * TRUTH["command.exponent"]
    assert (low, high) == pytest.approx(((1.0 + 0.1 / 6.0) ** power, (1.0 + 0.5 / 6.0) ** power), abs=0.015)
    assert is_wrong((low, high))
    assert span_of_thrust([whole, fading], vehicle)[0] == pytest.approx(span_of_thrust([whole], vehicle)[0])
    assert span_of_thrust([replace(whole, lost=time > 4.0)], vehicle) is None


def test_a_fit_that_leaves_what_vehicles_may_have_is_one_line(truth):
    far = with_values(truth, {"airframe.rotor.inertia": 1e-18})
    with pytest.raises(UserError, match=r"^the fit is outside the range of .*: rotor\.inertia: .*suit the vehicle"):
        identified_vehicle(start(), with_fitted(Identified(far, None, {}, {})), "made", "given")
    with pytest.raises(UserError, match=r"^the fit breaks down: .*suit the vehicle"):
        solved(np.zeros((2, 2)), np.ones(2))


def written(folder, truth):
    """A vehicle file with the true numbers and a predictor."""
    observer = truth.observer._replace(leak=Vector((1.0, 1.0)), path=4.0, drift=3.0)
    found = Identified(truth, observer, {}, {})
    content = identified_vehicle(start().model_copy(update={"sources": {}}), with_fitted(found), "made", "given")
    (folder / "v.toml").write_text(as_toml(content))
    return folder / "v.toml"


def with_fitted(found):
    keys = ("rotor.rise_time", "centre_of_gravity[0]", "inertia[0]")
    return found._replace(fitted={key: Fitted(TRUTH[key], 0.0, 1.0, "", "made") for key in keys})


def test_an_identified_vehicle_reads_back_and_flies(tmp_path, truth):
    vehicle = read_vehicle(written(tmp_path, truth))
    assert vehicle.command.speed == TRUTH["command.speed"]
    assert vehicle.imu.tilt == (TRUTH["imu.tilt[0]"], TRUTH["imu.tilt[1]"])
    places = np.array([mount.position for mount in vehicle.geometry().mounts])
    assert places.mean(axis=0)[:2] == pytest.approx([-TRUTH["centre_of_gravity[0]"], -TRUTH["centre_of_gravity[1]"]])
    assert vehicle.inertia[2] == start().inertia[2]  # no flight reveals it; in proportion to the others it was 43 % too large
    assert vehicle.rotor.torque_coefficient == pytest.approx(TRUTH["rotor.torque_coefficient"], rel=1e-4)
    assert vehicle.rotor.inertia == pytest.approx(TRUTH["rotor.inertia"], rel=1e-4)
    assert "identified" in vehicle.sources["rotor.rise_time"]


def test_numbers_that_yaw_determines_are_told_as_they_are_written(truth):
    heavier = start().model_copy(update={"inertia": tuple(3.0 * one for one in start().inertia)})  # no body has this about z
    two = ("rotor.torque_coefficient", "rotor.inertia")
    fitted = {key: Fitted(TRUTH[key], 0.9 * TRUTH[key], 1.2 * TRUTH[key], "", "made") for key in two}
    base = with_fitted(Identified(truth, None, {}, {"command.exponent": "the reason"}))
    found = as_written(heavier, base._replace(fitted=base.fitted | fitted))
    written = identified_vehicle(heavier, found, "made", "given")
    factor = written.inertia[2] / heavier.inertia[2]
    assert factor < 0.9
    for key, value in zip(two, (written.rotor.torque_coefficient, written.rotor.inertia), strict=True):
        assert found.fitted[key][:3] == pytest.approx([factor * one for one in fitted[key][:3]])
        assert found.fitted[key].value == pytest.approx(value, rel=1e-5)
        assert f"{value:.4g}, proportional to J_z" in written.sources[key]
        assert "; 95 % of the fit alone: −10 to +20 %" in written.sources[key]
    assert written.sources["command.exponent"] == "as it was: the reason"
    assert as_toml(written).startswith("# Not determined by the flights that it was identified from")
    assert written.doubts() == ["vehicle: the flights from which it was identified do not determine command.exponent"]
    assert found.fitted["inertia[0]"] == base.fitted["inertia[0]"]


def test_rows_that_were_not_measured_are_predicted_from_commands(tmp_path, flights, truth):
    vehicle = read_vehicle(written(tmp_path, truth))
    flight = flights[1]
    rows = [400, 520, 640]
    masked = {name: values.copy() for name, values in flight.channels.items()}
    for row in rows:
        for name in ("position", "velocity", "attitude", "rates"):
            masked[name][row + 1 : row + 51] = np.nan
    hidden = type(flight)(**{**vars(flight), "channels": masked})
    (tmp_path / "starts.json").write_text(json.dumps({flight.name: rows}))
    p, guided = ready([hidden], vehicle)
    assert guided
    starts = read_starts(tmp_path / "starts.json", [hidden])
    found = predictions_of([hidden], vehicle, p, starts, guided)[flight.name]
    assert np.shape(found["q"]) == (3, 3, 4)
    assert np.shape(found["w"]) == (3, 3, 3)
    place = flight.channels["position"][np.array(rows) + 10]
    assert np.linalg.norm(np.array(found["p"])[:, 1] - place, axis=1).max() < 0.02
    quaternions = np.array(found["q"])[:, 0]
    true = flight.channels["attitude"][np.array(rows) + 1][:, [1, 2, 3, 0]]
    assert np.abs((quaternions * true).sum(axis=1)).min() > 0.9999


def test_a_vehicle_far_from_the_logs_is_no_fault_of_the_program():
    """Logs of a Crazyflie beside an x500: nothing pulls on its axial drag."""
    errors = SimpleNamespace(errors=np.array([0.1]), pulls=np.array([0.0]))
    averages = {CHECKED[0]: AverageEstimate(2.0, 0.01)}
    assert in_step([SimpleNamespace(key=CHECKED[0])], np.array([0.0]), errors, averages) == IN_STEP


def test_replay_through_the_command_line(tmp_path, flights, truth):
    vehicle = written(tmp_path, truth)
    write(tmp_path / "log.csv", *table(flights[0]))
    (tmp_path / "map.toml").write_text(MAPPING.replace("full = 1.5", "full = 1.2"))
    # commands are shares of another full one: the thrust is off, and replay says by how much
    run = quadstep("replay", tmp_path / "log.csv", "--vehicle", vehicle, "--mapping", tmp_path / "map.toml")
    assert run.code == 0
    assert "from commands and setpoints" in run.out
    (tmp_path / "starts.json").write_text('{"log": [400], "other": [1]}')
    run = quadstep(
        "replay", tmp_path / "log.csv", "--vehicle", vehicle, "--mapping", tmp_path / "map.toml", "--starts",
        tmp_path / "starts.json", "--predictions", tmp_path / "p.json",
    )  # fmt: skip
    assert run.code == 0
    assert set(json.loads((tmp_path / "p.json").read_text())) == {"log"}


def test_bad_requests_are_one_line(tmp_path, flights, truth):
    vehicle = written(tmp_path, truth)
    write(tmp_path / "log.csv", *table(flights[0]))
    (tmp_path / "map.toml").write_text(MAPPING.replace("rad/s", "deg/s"))  # about which replay warns where it has a result
    mapping = ("--mapping", tmp_path / "map.toml")
    asked = {
        '{"log": [99999]}': "but the log has rows",
        '{"log": ["a"]}': "whole numbers",
        "[1]": "object of flights",
        '{"x": [1]}': "does not name any of the flights",
    }
    for text, said in asked.items():
        (tmp_path / "s.json").write_text(text)
        run = quadstep(
            "replay", tmp_path / "log.csv", "--vehicle", vehicle, *mapping, "--starts", tmp_path / "s.json", "--predictions",
            tmp_path / "p.json",
        )  # fmt: skip
        assert run.code == 2
        assert said in run.err
        assert run.err.count("\n") == 1
        assert not (tmp_path / "p.json").exists()
    taken = tmp_path / "taken.toml"
    taken.write_text("mine = 1\n")
    (tmp_path / "circle.csv").symlink_to("circle.csv")
    for arguments, said in (
        (("replay", tmp_path / "log.csv", "--vehicle", "hexa", *mapping), "unknown preset"),
        (("replay", tmp_path / "none.csv", "--vehicle", "crazyflie", *mapping), "file not found"),
        (("replay", tmp_path / "circle.csv", "--vehicle", "crazyflie", *mapping), "Too many levels of symbolic links"),
        (
            ("replay", tmp_path / "log.csv", "--vehicle", "crazyflie", *mapping, "--controller", "no"),
            "error: --controller: unknown value 'no'; allowed",
        ),
        (("replay", tmp_path / "log.csv", tmp_path / "log.csv", "--vehicle", "crazyflie", *mapping), "given twice"),
        (("replay", tmp_path / "log.csv", "--vehicle", "crazyflie", *mapping, "--starts", "s.json"), "must be given together"),
        (("identify", tmp_path / "log.csv", "--vehicle", "crazyflie", *mapping, "--out", "v.txt"), "should end in .toml"),
        (("identify", tmp_path / "log.csv", "--vehicle", "crazyflie", *mapping, "--mass", "-1"), "--mass"),
        (("identify", tmp_path / "log.csv", "--vehicle", "crazyflie", *mapping, "--out", taken), "exists; replace it"),
    ):
        run = quadstep(*arguments)
        assert run.code == 2, arguments
        assert said in run.err
        assert run.err.count("\n") == 1


def identified(folder):
    """The command on a log and its mapping in a folder."""
    files = "--mapping", folder / "map.toml", "--out", folder / "v.toml"
    return quadstep("identify", folder / "log.csv", "--vehicle", "crazyflie", *files)


def test_the_report_says_what_was_found_and_what_is_left(tmp_path, flights, truth):
    vehicle = read_vehicle(written(tmp_path, truth))
    found = Identified(
        truth, None, {"rotor.rise_time": Fitted(0.04, 0.03, 0.05, "s", "made")}, {"command.exponent": "the reason"}
    )
    two = {"rotor.rise_time": Fitted(0.04, 0.03, 0.05, "s", ""), "inertia[0]": Fitted(2e-5, 1.9e-5, 2.4e-5, "kg m^2", "")}
    run = Identification(vehicle, found._replace(fitted=two), [], None, None, None)
    left = followers(run, flights[:1], start())
    told = evidence(run, flights[:1], start(), left, ["made0: yaw is barely excited"])
    pages.write_identification(tmp_path / "r.html", told, run, flights[0].period, left)
    text = (tmp_path / "r.html").read_text().replace("\u00a0", " ")
    for words in (
        "rotor rise time [ms]</td><td>40</td><td>30 to 50</td><td>",
        "inertia about x [kg m²]</td><td>2.0 × 10⁻⁵</td><td>−5.0 to +20 %</td><td>",
        "the reason",
        "no flight was held out",
        "not determined",
        "<p>made0: yaw is barely excited</p>",
    ):
        assert words in text, words


def test_a_network_learns_what_the_laws_lack(flights, truth):
    lacking = with_values(truth, {"airframe.drag.rotor.0": 1e-9, "airframe.drag.rotor.1": 1e-9})
    assert trained(flights, start(), truth).left[3:5].min() > 0.7
    assert trained(flights, start(), lacking).left[3:5].max() < 0.5


def test_a_spectrum_has_a_sine_where_it_belongs():
    time = 0.01 * np.arange(2048)
    frequencies, density = spectrum(np.sin(2.0 * np.pi * 12.5 * time)[:, None], 0.01)
    assert frequencies[np.argmax(density[:, 0])] == pytest.approx(12.5)
    assert np.sqrt((density[:, 0] ** 2).sum() * frequencies[0]) == pytest.approx(np.sqrt(0.5), rel=0.01)


def test_a_log_that_contradicts_its_mapping_is_not_fitted(tmp_path, flights):
    write(tmp_path / "log.csv", *table(flights[0]))
    (tmp_path / "map.toml").write_text(MAPPING.replace("rad/s", "deg/s"))
    run = identified(tmp_path)
    assert run.refused
    assert "rates: x: radians where degrees are expected" in run.err
    assert "--trust-mapping skips these checks" in run.err
    assert not (tmp_path / "v.toml").exists()


def test_a_bench_log_never_flew(tmp_path, flights):
    header, rows = table(flights[0])
    for row in rows:
        row[1:5] = ["0.0"] * 4
    write(tmp_path / "log.csv", header, rows)
    (tmp_path / "map.toml").write_text(MAPPING)
    run = identified(tmp_path)
    assert run.code == 2
    assert "never flew: the rotors never turned" in run.err


def test_the_table_of_closed_loops_counts_what_a_comparison_has():
    """`python -m tests.identified closed` takes minutes; its rows take the fields that `fly_again` gives."""
    real, made = Tracking(0.05, 0.5, 0.3, 0.4), Tracking(0.06, 0.6, 0.31, 0.4)
    nothing = np.zeros((1, 3))
    one = FlightComparison("eight", real, made, np.zeros(1), nothing, nothing, nothing, "")
    assert identification.right([one]) == "RMSE right on 1, lag on 0, tilt on 1 of 1"
    assert "lag  +0.10 s" in identification.row(one)
