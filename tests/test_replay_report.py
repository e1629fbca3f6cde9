"""`quadstep replay --out`: the report, its figures and tables."""

import csv
import dataclasses
import json
import re
from html import unescape

import numpy as np
import pytest

from quadstep.commands.identify import read_logs
from quadstep.identify.averages import matrices
from quadstep.identify.flown_setpoints import FlightComparison, Tracking
from quadstep.identify.replay import ErrorTable, Predictions, Replayed
from quadstep.identify.replay_report import answer, error_table, likeness, share
from quadstep.identify.starts import HORIZONS
from quadstep.identify.vehicle_file import as_toml, with_marks
from quadstep.metrics.statistics import Estimate
from quadstep.mission.listings import load_preset
from tests.commands import files, quadstep
from tests.made_flights import MAPPING, logged, table, write

pytestmark = pytest.mark.usefixtures("undrawn")

FELT = 'acceleration = { columns = ["ax", "ay", "az"], unit = "m/s^2" }\n'


def felt(flight):
    """Specific force in body axes, from velocity and attitude."""
    pull = np.gradient(flight.channel("velocity"), flight.period, axis=0) + np.array([0.0, 0.0, 9.80665])
    return np.einsum("nji,nj->ni", matrices(flight.channel("attitude")), pull)


def text_of(page):
    """What a page says, without the style and the figures."""
    body = re.sub(r"<(style|svg).*?</\1>", "", page.read_text(), flags=re.DOTALL)
    return " ".join(unescape(re.sub(r"<[^>]*>", " ", body)).replace("\u00a0", " ").split())


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    """Two logs with an accelerometer, and their mapping."""
    folder = tmp_path_factory.mktemp("logs")
    (folder / "map.toml").write_text(MAPPING + FELT)
    for i, flight in enumerate(logged(0)[:2]):
        header, rows = table(flight)
        more = [[repr(float(value)) for value in row] for row in felt(flight)]
        write(folder / f"B{i}_made.csv", [*header, "ax", "ay", "az"], [a + b for a, b in zip(rows, more, strict=True)])
    return folder


def replayed(logs, out, *more, count=2):
    flights = [logs / f"B{i}_made.csv" for i in range(count)]
    return quadstep("replay", *flights, "--vehicle", "crazyflie", "--mapping", logs / "map.toml", "--out", out, *more)


def rows_of(path):
    with path.open() as file:
        return list(csv.DictReader(file))


def test_flights_of_equal_errors_on_opposite_sides_are_not_called_alike():
    time, still = np.arange(300) * 0.01, np.zeros((300, 3))
    side, follows = still + np.eye(3)[0] * 0.2, Tracking(0.2, 0.1, 0.1, 0.1)
    opposite = FlightComparison("a", follows, follows, time, still, side, -side, "")
    said = "The simulated RMSE is within a factor of two of the real one in {}, and the simulated position is {} from the real"
    assert likeness([opposite]).startswith(said.format("1 of 1 flight", "400\N{NO-BREAK SPACE}mm"))
    same = opposite._replace(flown_position=side)
    assert "0\N{NO-BREAK SPACE}m to 400\N{NO-BREAK SPACE}mm from the real one (RMS)." in likeness([opposite, same])
    quicker = same._replace(simulated=Tracking(0.6, 0.1, 0.1, 0.3))
    assert " But simulated flights turn 1.0 to 3.0 times as fast as the real ones (mean rate)" in likeness([same, quicker])
    lost = opposite._replace(lost="diverged after 1 s")
    assert likeness([same, lost]).endswith("(RMS); 1 were lost.")
    assert likeness([lost]).endswith("in 0 of 1 flight: all simulated flights were lost.")


def test_the_report_shows_predictions_simulations_and_estimates(tmp_path, logs):
    run = replayed(logs, tmp_path / "r", "--controller", "pid", "--estimator")
    assert run.code == 0, run.err
    assert run.out.splitlines()[-1] == f"Report: {tmp_path / 'r' / 'report.html'}"
    said = text_of(tmp_path / "r" / "report.html")
    content = json.loads((tmp_path / "r" / "metrics.json").read_text())
    error = 1e3 * content["position_error_50_ahead[m]"]
    assert re.search(
        rf"The position predicted 0\.5 s ahead from commands alone is off by {error:.3g}\d* mm on average, \d", said
    )
    assert re.search(
        r"The simulated RMSE is within a factor of two of the real one in \d of 2 flights, and the simulated", said
    )
    assert "The Kalman filter’s position is off by" in said
    for words in (
        "Bitcraze Crazyflie 2.1 (crazyflie) on 2 flights",
        "position error after 0.5 s",
        "the better baseline",
        "(of 2 flights, the one whose position is predicted worst): measured, and predicted 0.1 s earlier",
        "Flights: B0_made, B1_made.",
        "zero rate",
        "B0_made: setpoint, real",
        "B1_made: how far estimates",
        "Thrust",
        "The other flight B1",
    ):
        assert words.lower() in said.lower(), words
    names = files(tmp_path / "r")
    for name in ("errors", "predicted0", "again0", "again1", "estimate0", "estimate1"):
        assert {f"figures/{name}.png", f"figures/{name}.svg"} <= set(names)
    assert (tmp_path / "r" / "report.html").read_text().count("<figure") == 6
    assert '<a href="tracking.csv">' in (tmp_path / "r" / "report.html").read_text()
    assert [row["which"] for row in rows_of(tmp_path / "r" / "tracking.csv")] == ["real", "simulated"] * 2
    assert [row["flight"] for row in rows_of(tmp_path / "r" / "estimates.csv")] == ["B0_made", "B1_made"]
    errors = rows_of(tmp_path / "r" / "prediction_errors.csv")
    assert [int(row["samples_ahead"]) for row in errors] == [1, 2, 5, 10, 20, 50] * 2
    half = [float(row["position[m]"]) for row in errors if row["samples_ahead"] == "50"]
    assert content["position_error_50_ahead[m]"] == sum(half) / 2


def saved_again(path, out, rows, digits=9, shift=0.0):
    """Some rows of a log under another name, with so many digits and another clock."""
    with path.open() as file:
        header, *lines = csv.reader(file)
    clock = header.index("t")
    kept = [[float(value) + shift * (i == clock) for i, value in enumerate(line)] for line in lines[rows]]
    write(out, header, [[f"{value:.{digits}g}" for value in line] for line in kept])
    return out


def test_a_recording_to_which_a_vehicle_was_fitted_is_known_by_its_motion_and_is_no_test(tmp_path, logs):
    flights = read_logs([logs / "B0_made.csv"], str(logs / "map.toml"))
    mine = tmp_path / "mine.toml"
    mine.write_text(as_toml(with_marks(load_preset("crazyflie"), flights)))
    renamed = saved_again(logs / "B0_made.csv", tmp_path / "tuesday.csv", slice(None), 7, 1e4)
    half = saved_again(logs / "B0_made.csv", tmp_path / "half.csv", slice(300, 900))
    other = tmp_path / "B0_made.csv"
    other.write_bytes((logs / "B1_made.csv").read_bytes())

    def message_of(*paths):
        run = quadstep("replay", *paths, "--vehicle", mine, "--mapping", logs / "map.toml")
        assert run.code == 0, run.err
        return " ".join(run.out.split())

    known = "The vehicle was identified from the recording of {}, so this does not test it: "
    for path in (logs / "B0_made.csv", renamed, half):
        said = message_of(path)
        assert known.format("this flight") in said
        assert "the model predicts" not in said
    assert known.format("half") in message_of(half, other)
    assert "the model predicts" not in message_of(half, other)
    said = message_of(other)
    assert "does not test it" not in said
    assert ": on this flight, the model predicts" in said


def test_parts_of_one_recording_are_not_two_flights(tmp_path, logs):
    whole = logs / "B0_made.csv"
    first, last = (
        saved_again(whole, tmp_path / name, rows) for name, rows in (("a.csv", slice(700)), ("z.csv", slice(500, None)))
    )
    both = ("--vehicle", "crazyflie", "--mapping", logs / "map.toml")
    run = quadstep("replay", first, last, *both)
    assert run.refused
    assert "z: 2 s of it are in a, too; a flight counts once" in run.err
    apart = saved_again(whole, tmp_path / "y.csv", slice(700, None))
    assert quadstep("replay", first, apart, *both).code == 0


def test_a_report_of_predictions_says_what_the_terminal_says(tmp_path, logs):
    run = replayed(logs, tmp_path / "r", "--figures", "pdf", "--width", "88mm", count=1)
    assert run.code == 0, run.err
    plain = quadstep("replay", logs / "B0_made.csv", "--vehicle", "crazyflie", "--mapping", logs / "map.toml")
    assert run.out.startswith(plain.out.rstrip())
    names = files(tmp_path / "r")
    assert {"figures/errors.pdf", "figures/errors.svg"} <= set(names)
    assert not {"tracking.csv", "estimates.csv", "figures/errors.png"} & set(names)
    assert "Estimates" not in text_of(tmp_path / "r" / "report.html")


def test_a_replay_is_drawn_with_the_signals_that_are_asked_for(tmp_path, logs, monkeypatch):
    monkeypatch.undo()
    run = replayed(logs, tmp_path / "r", "--controller", "pid", "--figures", "svg", "--signals", "position,rates,z", count=1)
    assert run.code == 0, run.err
    names = [name for name in files(tmp_path / "r") if name.startswith("figures/")]
    axes = {name: (tmp_path / "r" / name).read_text().count('<g id="axes') for name in names}
    assert axes == {"figures/again0.svg": 1, "figures/errors.svg": 2}
    run = replayed(logs, tmp_path / "t", "--figures", "svg", "--signals", "yaw rate", count=1)
    assert run.code == 0, run.err
    assert (tmp_path / "t" / "figures" / "predicted0.svg").read_text().count('<g id="axes') == 1
    run = replayed(logs, tmp_path / "s", "--signals", "tilt")
    assert run.refused
    assert (
        "--signals: unknown signal 'tilt'; allowed: errors, predicted, position, velocity, attitude, rates, roll rate"
        in run.err
    )


@pytest.mark.parametrize(("ratio", "said"), [
    (Estimate(0.23, np.nan, np.nan), "23 % of the error"),
    (Estimate(0.23, 0.2, 0.26), "23.0 [20.0, 26.0] % of the error"),
    (Estimate(39.011, np.nan, np.nan), "39.0 times the error"),
    (Estimate(39.011, 38.2, 41.7), "39 [38, 42] times the error"),
])  # fmt: skip
def test_a_ratio_above_two_is_told_in_times(ratio, said):
    assert share(ratio, "the error") == said


def test_a_flight_of_which_nothing_is_predicted_is_named_first(tmp_path, logs):
    header, rows = table(dataclasses.replace(logged(0)[1], motors=np.zeros_like(logged(0)[1].motors)))
    write(tmp_path / "still.csv", header, rows)
    flights = [logs / "B0_made.csv", tmp_path / "still.csv"]
    (tmp_path / "map.toml").write_text(MAPPING)
    run = quadstep("replay", *flights, "--vehicle", "crazyflie", "--mapping", tmp_path / "map.toml")
    assert "Nothing is predicted for still: the motors never ran." in " ".join(run.out.split()), run.err


@pytest.mark.parametrize("channel", ["position", "velocity", "attitude", "rates"])
def test_what_was_not_measured_is_left_out_of_the_errors(tmp_path, logs, channel):
    flight = logged(0)[0]
    hole = flight.channel(channel).copy()
    hole[300:320, 0] = np.nan
    header, rows = table(dataclasses.replace(flight, channels=flight.channels | {channel: hole}))
    (tmp_path / "map.toml").write_text(MAPPING)
    write(tmp_path / "B0_made.csv", header, rows)
    runs = [replayed(folder, tmp_path / f"r{i}", count=1) for i, folder in enumerate((logs, tmp_path))]
    assert [run.code for run in runs] == [0, 0], runs[1].err
    assert "nan" not in runs[1].out
    whole, part = (json.loads((tmp_path / f"r{i}" / "metrics.json").read_text()) for i in range(2))
    assert part["predictions"] < whole["predictions"]
    for name in ("position_error_1_ahead[m]", "velocity_error_10_ahead[m/s]", "attitude_error_50_ahead[rad]"):
        assert part[name] == pytest.approx(whole[name], rel=0.2)


@pytest.mark.parametrize(
    ("factor", "said"),
    [(0.0, "the motors never ran"), (10.0, "100 % of the motor commands are above the full one, `full` in the mapping")],
)
def test_motors_that_never_run_or_are_beyond_full_are_named(tmp_path, logs, factor, said):
    flight = logged(0)[0]
    header, rows = table(dataclasses.replace(flight, motors=factor * np.maximum(flight.motors, 0.2)))
    (tmp_path / "map.toml").write_text(MAPPING)
    write(tmp_path / "B0_made.csv", header, rows)
    run = replayed(tmp_path, tmp_path / "r", count=1)
    assert run.code == 2
    assert f"B0_made: {said}" in run.err


def test_a_wrong_thrust_comes_before_what_rests_on_it(tmp_path, logs):
    right = ErrorTable(("a",), HORIZONS, *([np.full((3, 4, 1), size) for size in (0.1, 1.0, 1.0)]), 100)
    half = error_table("predictions", right._replace(zero=0.5 * right.zero), 0.01)
    assert half.rows[0] == (
        "position [mm]",
        "100",
        "100",
        "0.200",
    )  # by the better baseline, in columns that a phone shows whole
    found = Replayed(0.01, [Predictions("predictions", right)], (0.83, 1.02), [], [])
    better = "assuming constant velocity and rates: on this flight, the model predicts position, velocity, attitude and rates "
    better += "better than both baselines."
    said = (
        "The modelled thrust is 0.83 to 1.02 times the thrust needed. Predictions learn this error from the log and correct it"
    )
    assert answer(found).endswith(f"{better} {said}; simulated flights cannot.")
    assert answer(found._replace(thrust=(0.97, 1.04))).endswith(better)
    assert answer(found._replace(thrust=None)).endswith(better)
    log = logs / "B0_made.csv"
    vehicle = tmp_path / "heavy.toml"
    vehicle.write_text('preset = "crazyflie"\nmass = 0.045\n')
    run = quadstep("replay", log, "--vehicle", vehicle, "--mapping", logs / "map.toml")
    assert re.search(r"\. The modelled thrust is 0\.\d\d( to 0\.\d\d)? times the thrust needed. ", run.out)


def test_a_folder_holds_one_replay(tmp_path, logs):
    assert replayed(logs, tmp_path / "r", count=1).code == 0
    first = files(tmp_path / "r")
    assert replayed(logs, tmp_path / "r", count=1).code == 0
    assert files(tmp_path / "r") == first
    run = replayed(logs, tmp_path / "r", "--commands-only", count=1)
    assert run.code == 2
    assert "holds other results (Bitcraze Crazyflie 2.1 (crazyflie) on B0_made)" in run.err
    assert files(tmp_path / "r") == first
    assert replayed(logs, tmp_path / "r", "--commands-only", "--overwrite", count=1).code == 0


def test_a_log_that_contradicts_its_mapping_is_named_in_the_report(tmp_path, logs):
    other = tmp_path / "map.toml"
    other.write_text((logs / "map.toml").read_text().replace("rad/s", "deg/s"))
    log = logs / "B0_made.csv"
    run = quadstep("replay", log, "--vehicle", "crazyflie", "--mapping", other, "--out", tmp_path / "r")
    assert run.code == 0
    assert "warning: B0_made: rates: x: radians where degrees are expected" in run.err
    assert "B0_made: rates: x: radians where degrees are expected" in text_of(tmp_path / "r" / "report.html")


@pytest.mark.parametrize(("more", "said"), [
    (("--starts", "s.json", "--predictions", "p.json"), "--out: cannot be combined with --starts"),
    (("--figures", "gif"), "--figures: unknown format 'gif'"),
])  # fmt: skip
def test_bad_requests_are_one_line(tmp_path, logs, more, said):
    run = replayed(logs, tmp_path / "r", *more)
    assert run.code == 2
    assert said in run.err
    assert run.err.count("\n") == 1
    assert not (tmp_path / "r").exists()
