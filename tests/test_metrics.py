"""Metrics of hand-made logs, whose errors, settling times and variations are known."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from quadstep import Mission
from quadstep import fly as flown
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.log import FlightLog
from quadstep.metrics.quantities import LoggedFlight, attitude_error, position_errors
from quadstep.metrics.reductions import rmse, settling_time
from quadstep.metrics.registry import REPORTED, SCORED, flight_metrics, rotor_metrics, score_names_of, warned
from quadstep.numbers import Vector
from quadstep.studies.flight_report import of_limits, worst
from quadstep.vehicle.in_space import COLUMNS


def log_of(samples, outcome=Outcome.COMPLETED, **columns):
    """A log of zeros, a row each second, with these columns."""
    rows = np.zeros((samples, len(COLUMNS)))
    rows[:, 0] = np.arange(samples)
    for name, values in columns.items():
        rows[:, list(COLUMNS).index(name)] = values
    return FlightLog(COLUMNS, rows, outcome, float(samples - 1), None)


def test_the_root_mean_square_of_three_four_is_root_of_twelve_and_a_half():
    assert rmse(np.array([3.0, -4.0])) == pytest.approx(math.sqrt(12.5))
    assert rmse(np.zeros(4)) == 0.0


def test_errors_are_wanted_minus_actual():
    log = log_of(2, x=[1.0, 2.0], x_d=[3.0, 5.0], phi=[0.1, 0.2], phi_d=[0.0, 0.0])
    assert position_errors(log).tolist() == [[2.0, 0.0, 0.0], [3.0, 0.0, 0.0]]
    assert attitude_error(LoggedFlight(log)).values[:, 2].tolist() == [-0.1, -0.2]


def test_errors_of_position_and_heading_count_from_the_same_time_on():
    log = log_of(5, x=[9, 9, 3, 0, 0], psi=[0, 0, 0.5, 0.5, 0.5], psi_d=[3, 2, 1, 1, 1])
    counted, rest = flight_metrics(log, 2.0), flight_metrics(log._replace(rows=log.rows[2:]))
    for name in ("position_rmse[m]", "heading_error[rad]"):
        assert counted[name] == rest[name] != flight_metrics(log)[name]
    assert counted["heading_error[rad]"] == pytest.approx(0.5)


def test_position_errors_axis_by_axis_and_together():
    log = log_of(4, x=[0, 3, 0, -4], y_d=[1, 1, 1, 1], z=[2, 2, 2, 2], z_d=[2, 2, 2, 2])
    metrics = flight_metrics(log)
    assert metrics["position"]["x"] == pytest.approx({"rmse[m]": 2.5, "largest[m]": 4.0, "final[m]": 4.0})
    assert metrics["position"]["y"] == pytest.approx({"rmse[m]": 1.0, "largest[m]": 1.0, "final[m]": 1.0})
    assert metrics["position"]["z"] == {"rmse[m]": 0.0, "largest[m]": 0.0, "final[m]": 0.0}
    assert metrics["position_rmse[m]"] == pytest.approx(math.sqrt(2.5**2 + 1.0))


def test_attitude_errors_by_angle():
    attitude = flight_metrics(log_of(2, theta=[0.3, -0.1], theta_d=[0.0, 0.3]))["attitude"]["theta"]
    assert attitude["rmse[rad]"] == pytest.approx(math.sqrt((0.09 + 0.16) / 2))
    assert attitude["largest[rad]"] == pytest.approx(0.4)
    assert attitude["final[rad]"] == pytest.approx(0.4)


def test_errors_of_angles_are_the_shorter_way_round():
    attitude = flight_metrics(log_of(3, phi=[-3.0, 6.2, 0.1], phi_d=[3.0, 0.0, 0.3]))["attitude"]["phi"]
    shorter = [2.0 * math.pi - 6.0, 2.0 * math.pi - 6.2, 0.2]
    assert attitude["rmse[rad]"] == pytest.approx(math.sqrt(sum(one**2 for one in shorter) / 3))
    assert attitude["largest[rad]"] == pytest.approx(shorter[0])
    assert flight_metrics(log_of(2, phi=[0.5, 2.0 * math.pi], phi_d=[0.0, 0.0]))["attitude"]["phi"]["angle_settling[s]"] == 1.0
    wanted, flown = np.random.default_rng(1).uniform(-1.5, 1.5, (2, 100))
    found = attitude_error(LoggedFlight(log_of(100, phi_d=wanted, phi=flown))).values[:, 2]
    assert np.array_equal(found, wanted - flown)  # bit for bit


SETTLING = {
    "at once": ([0.0, 0.004, -0.005, 0.001], 0.0),
    "later": ([0.1, -0.02, 0.004, 0.0], 2.0),
    "after coming back": ([0.1, 0.0, -0.1, 0.0], 3.0),
    "never": ([0.1, 0.0, 0.0, 0.006], None),
    "never, outside all along": ([1.0, 1.0, 1.0, 1.0], None),
    "negative outside counts": ([-0.1, 0.0, 0.0, 0.0], 1.0),
}


@pytest.mark.parametrize("case", SETTLING)
def test_settling_is_when_the_band_of_5_mrad_is_entered_for_good(case):
    values, expected = SETTLING[case]
    assert settling_time(np.arange(4.0), np.array(values)) == expected


def test_settling_starts_from_the_time_of_the_log():
    assert settling_time(np.array([2.0, 3.0]), np.zeros(2)) == 2.0


def test_an_error_may_settle_before_its_angle_does():
    metrics = flight_metrics(log_of(5, phi=[0.2, 0.2, 0.2, 0.0, 0.0], phi_d=[0.0, 0.2, 0.2, 0.0, 0.0]))
    assert metrics["attitude"]["phi"]["error_settling[s]"] == 1.0
    assert metrics["attitude"]["phi"]["angle_settling[s]"] == 3.0


def test_an_angle_settles_towards_its_last_command():
    metrics = flight_metrics(log_of(4, psi=[0.0, 0.5, 1.0, 1.0], psi_d=[0.0, 0.5, 1.0, 1.0]))
    assert metrics["attitude"]["psi"]["error_settling[s]"] == 0.0
    assert metrics["attitude"]["psi"]["angle_settling[s]"] == 2.0


def test_largest_input_and_total_variation():
    metrics = flight_metrics(log_of(4, u=[9, 11, 8, 8], tau_phi=[0, -5, 0, 0]))
    assert metrics["u"] == {"largest[N]": 11.0, "total_variation[N]": 5.0}
    assert metrics["tau_phi"] == {"largest[N m]": 5.0, "total_variation[N m]": 10.0}
    assert metrics["tau_psi"] == {"largest[N m]": 0.0, "total_variation[N m]": 0.0}


def test_rotors_least_and_largest_over_all_four():
    metrics = flight_metrics(log_of(2, f1=[1, 2], f2=[3, 4], f3=[-1, 5], f4=[2, 2]))
    assert metrics["rotors"] == {"least[N]": -1.0, "largest[N]": 5.0}


def test_largest_weight_norms():
    metrics = flight_metrics(log_of(3, norm_W1=[0, 2, 1], norm_W2=[3, 0, 0]))
    assert metrics["largest_weight_norm"] == {"norm_W1": 2.0, "norm_W2": 3.0}


@pytest.mark.parametrize(
    ("theta", "phi", "tilt"),
    [(0.3, 0.0, 0.3), (0.0, -0.4, 0.4), (0.0, math.pi, math.pi), (0.3, 0.4, math.acos(math.cos(0.3) * math.cos(0.4)))],
)
def test_tilt_is_the_angle_between_thrust_and_vertical(theta, phi, tilt):
    metrics = flight_metrics(log_of(2, theta=[0.0, theta], phi=[0.0, phi]))
    assert metrics["largest_tilt[rad]"] == pytest.approx(tilt)


def test_outcome_and_time_are_told():
    metrics = flight_metrics(log_of(3, outcome=Outcome.OFF_PATH))
    assert (metrics["outcome"], metrics["ended[s]"]) == ("off_path", 2.0)
    assert "position" in metrics


@pytest.mark.parametrize("samples", [0, 1])
def test_a_flight_without_two_rows_has_only_its_end(samples):
    log = log_of(samples, outcome=Outcome.SINGULAR)._replace(ended=0.0)
    assert flight_metrics(log) == {"outcome": "singular", "ended[s]": 0.0}


def test_metrics_are_plain_json():
    rng = np.random.default_rng(0)
    log = log_of(20, **{name: rng.normal(size=20) for name in COLUMNS if name != "t"})
    assert json.loads(json.dumps(flight_metrics(log), allow_nan=False)) == flight_metrics(log)


@pytest.mark.parametrize("score", SCORED, ids=lambda one: one.name)
def test_summed_sample_by_sample_a_metric_is_that_of_the_whole_log(score):
    rows = np.abs(np.random.default_rng(3).normal(size=(50, 3)))
    sums, samples = score.sums.start(Vector(rows[0].tolist())), 0.0
    for row in rows.tolist():
        sums, samples = sums.add(Vector(row), 1.0 if samples else 0.0), samples + 1.0
    assert [float(value) for value in sums.values(samples)] == pytest.approx(score.sums.of(rows, np.arange(50.0)), rel=1e-12)


def test_names_of_scores_take_axes_inputs_and_nets_from_the_plant():
    names = score_names_of({"thrust": "N", "torque": "N m"}, ())
    assert names[2:] == ("effort_thrust[N]", "effort_torque[N m]", "variation_thrust[N]", "variation_torque[N m]")
    assert score_names_of({}, ("norm_V",))[-1] == "largest_norm_V"


def test_a_log_has_the_metrics_that_its_columns_allow():
    columns = {"t": "s", "s": "m", "s_d": "m", "pull": "N"}
    rows = np.array([[0.0, 1.0, 1.0, 2.0], [1.0, 2.0, 1.0, -3.0]])
    metrics = flight_metrics(FlightLog(columns, rows, Outcome.COMPLETED, 1.0, None), efforts={"pull": "N"})
    assert list(metrics) == [
        "outcome", "ended[s]", "holds_a_point", "position", "position_rmse[m]", "largest_error[m]", "relative_error",
        "error_growth", "pull",
    ]  # fmt: skip
    assert metrics["pull"] == {"largest[N]": 3.0, "total_variation[N]": 5.0}
    assert metrics["largest_error[m]"] == 1.0


def test_the_documentation_names_every_metric_and_says_what_it_means():
    lines = (Path(__file__).parent.parent / "docs" / "metrics.md").read_text().splitlines()
    for one in (*REPORTED, *SCORED):
        assert any(f"`{one.name}`" in line and line.endswith(f"| {one.meaning} |") for line in lines), one.name


def test_the_papers_plant_has_what_the_documentation_says_all_flights_have():
    metrics = flown(Mission(path={"type": "step", "end": [0.0, 0.0, 1.0], "duration": 2.0})).metrics()
    lines = (Path(__file__).parent.parent / "docs" / "metrics.md").read_text().splitlines()
    others = [line.split("`")[1] for line in lines if "| real vehicles and other plants |" in line]
    assert others == ["rotors.activity", "mean_thrust"]
    assert metrics["largest_error[m]"] == 1.0
    assert "mean_thrust[N]" not in metrics
    assert "activity[N/s]" not in metrics["rotors"]


def test_saturation_says_by_which_limit():
    """One rotor asked for less than it can give in half of the rows, another for more in a quarter; once rounding alone."""
    rows = np.zeros((8, 3))
    rows[:, 0], rows[:, 1:] = np.arange(8.0), 2.0
    asked = np.full((8, 2), 2.0)
    asked[:4, 0], asked[2:4, 1] = -1.0, 9.0
    log = FlightLog({"t": "s", "f1": "N", "f2": "N"}, rows, Outcome.COMPLETED, 7.0, None)
    found, (said,) = warned(rotor_metrics(log, asked, 0.0, 4.0))
    assert found == {
        "saturated_share": 0.5, "lowest_thrust_share": 0.5, "full_thrust_share": 0.25, "largest_thrust_share": 0.5,
    }  # fmt: skip
    assert said == "the rotors were saturated 50 % of the time: by the lowest thrust 50 %, by full thrust 25 %"
    assert {one.what: (one.value, one.more) for one in of_limits(found)}["rotors saturated"] == (
        "50 %", "of the time: by the lowest thrust 50 %, by full thrust 25 %",
    )  # fmt: skip
    assert warned(rotor_metrics(log, np.full((8, 2), 2.0), 0.0, 4.0))[1] == []
    tilt = {"largest_tilt[rad]": 0.8}
    tilts = [of_limits(tilt, counted=since)[0].more for since in ("", " from 15 s on")]
    assert tilts == ["between thrust and vertical", "between thrust and vertical, in the whole flight"]


@pytest.mark.parametrize(("least", "shown"), [(-302.4, True), (0.0, False), (1e-9, False)])
def test_a_thrust_that_no_rotor_can_give_is_shown_where_rotors_have_no_limits(least, shown):
    facts = of_limits({"rotors": {"least[N]": least, "largest[N]": 253.1}})
    assert [one.value for one in facts] == (["−302 to 253\u00a0N"] if shown else [])
    assert [one.more for one in facts] == ["rotors cannot thrust downwards, but this vehicle does not limit them"] * shown
    assert not any("realisable" in one.what for one in of_limits({"rotors": {"least[N]": least}, "saturated_share": 0.1}))


@pytest.mark.parametrize(
    ("more", "after"),
    [
        ({}, ""),
        ({"events": [{"type": "payload", "time": 1.0, "mass": 0.1, "until": 4.0}]}, ", 2.00 s after a payload was taken up"),
        ({"events": [{"type": "payload", "time": 1.0, "mass": 0.1, "until": 2.0}]}, ", 1.00 s after a payload was released"),
        ({"events": [{"type": "rotor", "time": 3.5, "rotor": 1, "efficiency": 0.9}]}, ""),  # later
        ({"wind": {"gust": {"velocity": [1.0, 0.0, 0.0], "start": 1.0, "length": 1.5}}}, ", 0.50 s after the gust ended"),
    ],
)
def test_the_largest_error_names_what_had_happened_last_before_it(more, after):
    path = {"type": "step", "end": [0.0, 0.0, 5.0], "duration": 5.0}
    mission = Mission(vehicle={"preset": "x500"}, path=path, **more)
    rows = np.zeros((6, 7))
    rows[:, 0], rows[3, 1] = np.arange(6.0), 1.0
    columns = {"t": "s", **dict.fromkeys(("x", "y", "z", "x_d", "y_d", "z_d"), "m")}
    log = FlightLog(columns, rows, Outcome.COMPLETED, 5.0, None)
    said = worst(log, 0.0, mission.moments).replace("\N{NO-BREAK SPACE}", " ")
    assert said == f", at 3 s{after}"
    assert [one.time for one in mission.moments if one.word == "released"] == [
        one["until"] for one in more.get("events", ()) if "until" in one
    ]  # so that what follows is not put down to the next event
