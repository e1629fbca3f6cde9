"""`quadstep study vehicles`: what is flown, what is counted, and what is written of flights that are lost."""

import csv
import json
import math
from concurrent.futures import Future
from contextlib import nullcontext

import numpy as np
import pytest

from quadstep.analysis.statistics import Estimate
from quadstep.comparison import flights, kept, run
from quadstep.comparison.cell import NOTHING, Cell, fly_cell, scenario_table
from quadstep.comparison.flights import CONTROLLERS, FIRST_SEED, PUBLISHED, SPEEDS, VEHICLES, WINDS, mission, scenarios
from quadstep.comparison.picture import draw_vehicle, draw_wind
from quadstep.comparison.run import HARDEST, WINDY, Comparison, as_json, sentences, shown, write_cells
from quadstep.flight.closed_loop import Outcome
from quadstep.flight.engines import fly
from quadstep.mission.presets import preset_names
from tests.commands import quadstep

VEHICLE = "hummingbird"
HOVER = {"type": "step", "start": [0.0, 0.0, 5.0], "end": [0.0, 0.0, 5.0], "time": 0.001, "duration": 0.6}
REDUCED = {
    "hover": {"path": HOVER, "score_from": 0.2},
    "too far": {"path": {**HOVER, "end": [9.0, 0.0, 5.0], "time": 0.4}, "limits": {"distance": 5.0}, "score_from": 0.5},
}


class Here:
    """A pool of processes that is none: what is patched here holds there."""

    def submit(self, function, *arguments):
        future = Future()
        future.set_result(function(*arguments))
        return future


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """The command flown for one vehicle, two seeds and two scenarios, in the second of which every flight is lost."""
    folder, flown, told = tmp_path_factory.mktemp("study"), [], []

    def noted(vehicle, controller, scenario, seed):
        flown.append((vehicle, controller, seed))
        return mission(vehicle, controller, scenario, seed)

    real = run.study_vehicles

    def watched(out, seeds, vehicles, overwrite, progress):
        return real(out, seeds, vehicles, overwrite, lambda *done: told.append(done))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("quadstep.comparison.run.drawing_pool", lambda: nullcontext(Here()))
        patch.setattr("quadstep.comparison.cell.scenario_table", lambda vehicle: REDUCED)
        patch.setattr("quadstep.comparison.cell.mission", noted)
        patch.setattr("quadstep.comparison.run.study_vehicles", watched)
        command = ("study", "vehicles", "--only", VEHICLE, "--seeds", 2, "--out", folder / "out")
        result = quadstep(*command)
        again = quadstep(*command[:-3], 3, *command[-2:])
    return result, folder / "out", flown, told, again


def strict(path):
    """JSON without the NaN and infinities that Python would let pass."""

    def refuse(constant):
        raise AssertionError(constant)

    return json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)


def test_it_writes_table_numbers_pictures_and_report(study):
    result, folder, *_ = study
    assert (result.code, result.err) == (0, "")
    names = {path.name for path in folder.iterdir()}
    assert names == {"cells.csv", "metrics.json", "report.html", f"{VEHICLE}.png", f"{VEHICLE}.svg"}
    assert all(path.stat().st_size > 0 for path in folder.iterdir())


def test_every_cell_is_in_the_table_and_what_was_lost_is_empty(study):
    with (study[1] / "cells.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["scenario"], row["controller"]) for row in rows] == [
        (scenario, controller) for controller in CONTROLLERS for scenario in REDUCED
    ]
    for row in rows:
        lost = row["scenario"] == "too far"
        assert (row["vehicle"], row["flights"], float(row["lost_share"])) == (VEHICLE, "2", float(lost))
        for key in ("rmse[m]", "rmse_low[m]", "rmse_high[m]", "largest[m]", "activity[1/s]", "saturated_share"):
            assert row[key] == "" if lost else math.isfinite(float(row[key]))
        if not lost:
            assert 0.0 < float(row["rmse[m]"]) < float(row["largest[m]"]) < 0.5


def test_the_numbers_are_strict_json_with_null_for_what_no_flight_gave(study):
    metrics = strict(study[1] / "metrics.json")
    assert metrics["seeds"] == {"first": 1001, "count": 2}
    assert metrics["sensors"]["latency"] == 0.02
    lost = [cell for cell in metrics["cells"] if cell["scenario"] == "too far"]
    assert len(lost) == len(CONTROLLERS)
    for cell in lost:
        assert (cell["rmse[m]"], cell["largest[m]"], cell["activity[1/s]"]) == ([None] * 3, None, None)
        assert cell["lost"][0] == 1.0
        assert cell["lost"][1] == pytest.approx(0.025**0.5)  # exact, of two in two


def test_nothing_that_is_read_says_nan(study):
    result, folder, *_ = study
    report = (folder / "report.html").read_text(encoding="utf-8")
    for text in (result.out, report):
        assert "-; lost 100 %" in text
        assert "nan" not in text.lower()
    assert "Nowhere does the adaptive controller with nets lose more flights" in result.out
    picture = (folder / f"{VEHICLE}.svg").read_text(encoding="utf-8")
    assert "lost: nets 100 %, no nets 100 %" in picture
    assert "nan" not in picture


def test_reported_seeds_begin_at_1001_and_are_the_same_for_every_controller(study):
    _, _, flown, told, _ = study
    assert FIRST_SEED == 1001
    assert flown == [(VEHICLE, controller, seed) for controller in CONTROLLERS for _ in REDUCED for seed in (1001, 1002)]
    flights = len(CONTROLLERS) * len(REDUCED) * 2
    assert told == [(done, flights) for done in range(0, flights + 1, 2)]


class Stopped(Here):
    """A pool in which Ctrl-C comes after some cells."""

    def __init__(self, cells):
        self.left = cells

    def submit(self, function, *arguments):
        if not self.left:
            future = Future()
            future.set_exception(KeyboardInterrupt())
            return future
        self.left -= 1
        return super().submit(function, *arguments)


def test_an_interrupted_study_goes_on_where_it_was_and_ends_as_if_nothing_had_been(tmp_path, study, monkeypatch):
    monkeypatch.setattr("quadstep.comparison.cell.scenario_table", lambda vehicle: REDUCED)
    command = ("study", "vehicles", "--only", VEHICLE, "--seeds", 2, "--out", tmp_path / "out")
    monkeypatch.setattr("quadstep.comparison.run.drawing_pool", lambda: nullcontext(Stopped(4)))
    monkeypatch.setattr("quadstep.comparison.run.as_completed", list)  # in the order in which they were asked for
    stopped = quadstep(*command)
    assert stopped.code == 130
    assert f"4 cells are kept in {tmp_path / 'out'}; the same command continues" in stopped.err
    (file,) = (tmp_path / "out").iterdir()
    file.write_text(file.read_text(encoding="utf-8")[:-20], encoding="utf-8")  # killed while it wrote the last of them

    flown, real = [], run.flown.fly_cell
    monkeypatch.setattr("quadstep.comparison.cell.fly_cell", lambda *asked: flown.append(asked) or real(*asked))
    monkeypatch.setattr("quadstep.comparison.run.drawing_pool", lambda: nullcontext(Here()))
    assert quadstep(*command).code == 0
    assert len(flown) == len(CONTROLLERS) * len(REDUCED) - 3
    for name in ("cells.csv", "metrics.json", "report.html"):
        assert (tmp_path / "out" / name).read_bytes() == (study[1] / name).read_bytes()
    assert not [path for path in (tmp_path / "out").iterdir() if path.name.startswith(".")]


def test_what_is_kept_is_used_for_nothing_else():
    scenario, other = REDUCED["hover"], REDUCED["too far"]
    asked = [(VEHICLE, "PID", scenario, 2), (VEHICLE, "PID", scenario, 3), (VEHICLE, "PID", other, 2)]
    asked += [(VEHICLE, "geometric", scenario, 2), ("x500", "PID", scenario, 2)]
    assert len({kept.key(*one) for one in asked}) == len(asked)


def test_the_results_of_other_seeds_are_not_replaced_unasked(study):
    again = study[-1]
    assert again.refused
    assert "--overwrite" in again.err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--only", "x50"], "'x50' is not known; allowed: crazyflie, hummingbird, x500, research-2.6kg, paper"),
        (["--only", "x500", "--only", "drone"], "'drone' is not known"),
        (["--seeds", "0"], "--seeds"),
        (["--seeds", "many"], "--seeds"),
    ],
)
def test_a_wrong_command_is_one_line(tmp_path, arguments, said):
    result = quadstep("study", "vehicles", "--out", tmp_path / "out", *arguments)
    assert result.refused
    assert said in result.err
    assert not (tmp_path / "out").exists()


def test_a_cell_is_the_mean_of_what_its_flights_logged():
    scenario = REDUCED["hover"]
    cell = fly_cell(VEHICLE, "geometric", "hover", scenario, 2)
    logs = [fly(mission(VEHICLE, "geometric", scenario, FIRST_SEED + i).plan()) for i in range(2)]
    assert all(log.outcome is Outcome.COMPLETED for log in logs)
    errors = [np.linalg.norm(log.table("x", "y", "z") - [0.0, 0.0, 5.0], axis=1)[log.column("t") >= 0.2] for log in logs]
    changes = [np.abs(np.diff(log.table("f1", "f2", "f3", "f4"), axis=0)).sum() / 0.6 for log in logs]
    assert cell.rmse.value == pytest.approx(np.mean([math.sqrt(np.mean(error**2)) for error in errors]))
    assert cell.largest == pytest.approx(max(error.max() for error in errors))
    assert cell.activity == pytest.approx(np.mean(changes) / (0.5 * 9.81))
    assert (cell.flights, cell.saturated, cell.lost.value) == (2, 0.0, 0.0)
    assert errors[0].max() != errors[1].max()


# What is flown


def test_every_vehicle_and_controller_of_the_package_is_compared():
    assert sorted(VEHICLES) == preset_names()
    kinds = [section["type"] for section in CONTROLLERS.values()]
    assert kinds == ["rotation-backstepping", "rotation-backstepping", "backstepping", "geometric", "pid"]
    assert CONTROLLERS["adaptive, no nets"]["nets"] == {"enabled": False}


@pytest.mark.parametrize("vehicle", VEHICLES)
def test_every_scenario_can_be_flown_with_noise_and_latency(vehicle):
    table = scenario_table(vehicle)
    assert len(table) == 1 + len(SPEEDS) + 1 + len(WINDS) + 2
    for place, scenario in enumerate(table.values()):
        one = mission(vehicle, list(CONTROLLERS)[place % 5], scenario, 1001)
        plan = one.plan()
        assert (one.sensors.latency, one.sensors.noisy, one.seed) == (0.02, True, 1001)
        assert plan.loop.sensing.delay * plan.ticks.every[-3] * plan.ticks.step == pytest.approx(0.02)
        assert one.score_from < plan.ticks.last * plan.ticks.step
        assert plan.warnings == ()


def reference(scenario, times):
    plan = mission(VEHICLE, "geometric", scenario, 1).plan()
    found = [plan.loop.path.reference(float(t), plan.parameters.path) for t in times]
    return np.array([list(one.position) for one in found]), np.array([list(one.velocity) for one in found])


@pytest.mark.parametrize("speed", [1.0, 6.0])
def test_a_level_eight_is_flown_at_its_speed_where_it_is_fastest(speed):
    scenario = flights.eight(speed)
    period = scenario["path"]["period"]
    positions, velocities = reference(scenario, flights.RAMP + np.linspace(0.0, period, 2001))
    assert np.linalg.norm(velocities, axis=1).max() == pytest.approx(speed, rel=1e-4)
    assert np.ptp(positions, axis=0) == pytest.approx([10.0, 5.0, 0.0], abs=1e-3)
    assert scenario["simulation"]["duration"] - flights.RAMP >= min(period, 20.0)


def test_the_vertical_eight_is_that_of_the_published_flights():
    times = np.linspace(10.0, 20.0, 101)
    positions, _ = reference(flights.vertical_eight(0.0, 0.0), times)
    x, y, z = positions.T - np.array([[0.0], [0.0], [3.0]])
    np.testing.assert_allclose(y, 0.0, atol=1e-12)
    phase = np.arctan2(x[0], math.sqrt(1.25**2 - x[0] ** 2) * np.sign(x[1] - x[0]))
    np.testing.assert_allclose(x, 1.25 * np.sin(phase + times - times[0]), atol=1e-9)
    np.testing.assert_allclose(np.abs(z), np.abs(0.75 * np.sin(2.0 * (phase + times - times[0]))), atol=1e-9)


def test_its_wind_swings_and_is_as_turbulent_as_it_is_strong():
    winds = {name: flights.vertical_eight(*wind)["wind"] for name, wind in WINDS.items()}
    assert winds["0"] == {"mean": [0.0, 0.0, 0.0]}
    assert winds["12.1"] == {"mean": [12.1, 0.0, 0.0], "turbulence": {"wind_20": 12.1, "height": 6.0}}
    swinging = winds["8.5 + 2.4 sin t"]
    assert (swinging["swing"], swinging["swing_frequency"]) == ([2.4, 0.0, 0.0], 1.0)
    assert all(len(values) == len(WINDS) for values in PUBLISHED.values())


def test_the_load_is_30_percent_and_the_weak_rotor_has_80():
    table = scenarios(2.0, 0.2)
    (payload,), (fault,) = table["mass +30 %"]["events"], table["rotor 1 at 80 %"]["events"]
    assert payload["mass"] == pytest.approx(0.6)
    assert payload["position"] == pytest.approx([0.0, 0.0, -0.05])
    assert (fault["rotor"], fault["efficiency"]) == (1, 0.8)


# What is said of it


def cell(scenario=HARDEST, controller="geometric", rmse=0.1, lost=0.0, vehicle=WINDY):
    around = NOTHING if math.isnan(rmse) else Estimate(rmse, 0.9 * rmse, 1.1 * rmse)
    return Cell(vehicle, scenario, controller, 30, around, 3.0 * rmse, 2.0 * rmse, 0.01, Estimate(lost, 0.0, 1.0))


def compared(lost=0.0, rmse=0.04):
    """The 2.6 kg vehicle at every wind; the controller with nets with this error and this share lost at the strongest."""
    names = [f"vertical eight, wind {wind}" for wind in WINDS]
    return Comparison(
        30,
        [
            cell(name, controller, rmse if first else 0.12, lost if first and name == HARDEST else 0.0)
            for controller, first in zip(CONTROLLERS, [True, *[False] * 4], strict=True)
            for name in names
        ],
    )


def test_a_cell_is_shown_in_centimetres_with_its_interval_and_what_was_lost():
    assert shown(cell(rmse=0.1234)) == "12.3 [11.1, 13.6]"
    assert shown(cell(rmse=0.1, lost=0.1)) == "10 [9, 11]; lost 10 %"
    assert shown(cell(rmse=math.nan, lost=1.0)) == "-; lost 100 %"
    assert shown(cell()._replace(rmse=Estimate(0.1, math.nan, math.nan))) == "10"


def test_sentences_say_what_was_found_and_where_more_is_lost():
    first, second = sentences(compared(), [WINDY])
    assert "within 4 [3.6, 4.4] cm with nets, 12 [10.8, 13.2] without" in first
    assert second.startswith("Nowhere")
    first, second = sentences(compared(lost=1.0, rmse=math.nan), [WINDY])
    assert "within -; lost 100 % cm with nets" in first
    assert second == f"The adaptive controller with nets loses more flights than the geometric one in: {WINDY}, {HARDEST}."


@pytest.mark.parametrize("found", [compared(), compared(1.0, math.nan)], ids=["all flown", "some lost"])
def test_pictures_table_and_json_are_drawn_whatever_was_lost(tmp_path, found):
    draw_wind(tmp_path, found.cells)
    draw_vehicle(tmp_path, WINDY, found.cells)
    write_cells(tmp_path / "cells.csv", found.cells)
    json.loads(json.dumps(as_json(found), allow_nan=False))
    for name in ("wind", WINDY):
        picture = (tmp_path / f"{name}.svg").read_text(encoding="utf-8")
        assert "position RMSE [cm]" in picture
        assert "nan" not in picture
        assert (tmp_path / f"{name}.png").read_bytes().startswith(b"\x89PNG")
    assert "Neural-Fly (real flights)" in (tmp_path / "wind.svg").read_text(encoding="utf-8")
    assert "nan" not in (tmp_path / "cells.csv").read_text(encoding="utf-8")
