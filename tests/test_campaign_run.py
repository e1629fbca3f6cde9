"""A campaign flown: the same flights however they are flown, each what it is by itself, failures as outcomes, no NaN."""

import csv
import json

import numpy as np
import pyarrow as pa
import pytest

from quadstep.engines.eager import fly_floats
from quadstep.engines.engine import Engine
from quadstep.engines.fly import fly as fly_plan
from quadstep.engines.sweep import Sweep
from quadstep.interfaces.closed_loop import Outcome
from quadstep.io.errors import InterruptedRun, UserError
from quadstep.studies.campaign import run as run_module
from quadstep.studies.campaign.flyer import Flyer
from quadstep.studies.campaign.schema import read_campaign
from quadstep.studies.campaign.single_flight import replay
from quadstep.studies.campaign.store import parquet
from quadstep.studies.fly import planned
from tests.campaigns import MASS, NOISY, SHORT, campaign, flights, fly, manifest, no_report, number, refused, rows, written
from tests.commands import Listener, quadstep
from tests.flights import METRICS

MANY = (
    MASS
    + '"path.duration" = {type="uniform", low=0.3, high=0.4}\n'
    + '"start.position.2" = {type="sobol", low=-0.1, high=0.1}\n'
    + '"vehicle.kinematics" = {type="choice", values=["standard", "rigid"]}\n'
)
REAL = (
    '"vehicle.mass" = {type="normal", mean=2.6, deviation=0.1}\n"wind.mean.0" = {type="uniform", low=0.5, high=8.0}\n'
    '"sensors.latency" = {type="grid", values=[0.0, 0.01]}\n'
)

CASES = {"paper": (SHORT, MANY), "real": (NOISY, REAL)}
PRECISIONS = pytest.mark.parametrize("precision", ["f64", "f32"])


def fly_campaign(*arguments, **more):
    """As of the package, but for the report."""
    with no_report():
        return run_module.fly_campaign(run_module.CampaignRequest(*arguments, **more))


# The same flights however they are flown


@pytest.fixture(scope="module", params=[("paper", "f64"), ("paper", "f32"), ("real", "f64")], ids=str)
def one(request, tmp_path_factory):
    """A campaign, and all of its flights flown in one go."""
    name, precision = request.param
    mission, vary = CASES[name]
    head = f'precision = "{precision}"\nflights = 100\n'
    made = campaign(tmp_path_factory.mktemp("one"), vary, mission, head)
    return made, Flyer(made).fly(0, 100)


@pytest.mark.parametrize("size", [1, 7, 16, 33])
def test_flights_are_the_same_to_the_bit_in_chunks_of_any_size(one, size):
    made, whole = one
    flyer = Flyer(made)
    last = 2 * size if size == 1 else 100
    parts = [flyer.fly(first, min(first + size, last)) for first in range(0, last, size)]
    assert parquet(pa.concat_tables(parts).combine_chunks()) == parquet(whole.slice(0, last).combine_chunks())


def test_flights_are_the_same_whatever_was_flown_before(one):
    made, whole = one
    flyer = Flyer(made)
    for first, past in ((90, 100), (0, 16), (40, 41)):
        assert flyer.fly(first, past).to_pylist() == whole.slice(first, past - first).to_pylist()


@pytest.fixture(scope="module")
def straight(tmp_path_factory):
    """A campaign of four files, and the folder that it was flown into in one go."""
    folder = tmp_path_factory.mktemp("straight")
    path = written(folder, MANY, head="chunk = 16\nflights = 60")
    fly_campaign(path, folder / "whole")
    return path, folder / "whole"


@pytest.mark.parametrize("stop", [0, 1, 2, 3])
def test_a_run_that_was_interrupted_anywhere_goes_on_to_the_same_files(straight, tmp_path, monkeypatch, stop):
    path, whole = straight
    real, count = Flyer.fly, []

    def broken(self, first, past, progress=None):
        count.append(first)
        if len(count) > stop:
            raise KeyboardInterrupt
        return real(self, first, past, progress)

    with monkeypatch.context() as patch:
        patch.setattr(Flyer, "fly", broken)
        with pytest.raises(InterruptedRun, match=f"{stop} of 4 files"):
            fly_campaign(path, tmp_path / "out")
    assert len(flights(tmp_path / "out")) == stop
    assert manifest(tmp_path / "out")["complete"] is False
    fly_campaign(path, tmp_path / "out", resume=True)
    assert flights(tmp_path / "out") == flights(whole)
    assert manifest(tmp_path / "out") == manifest(whole)


def test_progress_tells_flights_over_and_in_all(tmp_path):
    path, told = written(tmp_path, MANY, head="chunk = 16\nflights = 40"), Listener()
    fly_campaign(path, tmp_path / "out", progress=told)
    overs = [over for over, _ in told.heard]
    assert {total for _, total in told.heard} == {40}
    assert (overs[0], overs[-1]) == (0, 40)
    assert overs == sorted(overs)
    (tmp_path / "out/flights/00001.parquet").unlink()
    again = Listener()
    fly_campaign(path, tmp_path / "out", resume=True, progress=again)
    assert (again.heard[0], again.heard[-1]) == ((24, 40), (40, 40))


# Each flight is what it is by itself


def row_of(folder, flight):
    return rows(folder).slice(flight, 1).to_pylist()[0]


@pytest.mark.parametrize("name", CASES)
def test_a_row_is_what_the_flights_own_log_says(name, tmp_path):
    mission, vary = CASES[name]
    path = written(tmp_path, vary, mission, "chunk = 16\nflights = 20")
    assert fly(path, tmp_path / "out").code == 0
    for flight in (0, 13):
        own, plan, _ = planned(path, flight)
        log = fly_plan(plan, Engine.LANES)
        row, wanted = row_of(tmp_path / "out", flight), own.flight_metrics(log)[0]
        assert row["outcome"] == "completed"
        assert row["position_rmse[m]"] == pytest.approx(wanted["position_rmse[m]"], rel=1e-9)
        off = np.linalg.norm(log.table("x", "y", "z") - log.table("x_d", "y_d", "z_d"), axis=1)
        assert row["largest_error[m]"] == pytest.approx(off.max(), rel=1e-9)
        names = ("u", "tau_psi", "tau_theta", "tau_phi") if name == "paper" else ("u_a", "tau_x_a", "tau_y_a", "tau_z_a")
        inputs = log.table(*names)
        efforts = [row[metric] for metric in METRICS if metric.startswith("effort")]
        variations = [row[metric] for metric in METRICS if metric.startswith("variation")]
        np.testing.assert_allclose(efforts, np.sqrt((inputs**2).mean(axis=0)), rtol=1e-9)
        np.testing.assert_allclose(variations, np.abs(np.diff(inputs, axis=0)).sum(axis=0), rtol=1e-7)


@pytest.mark.parametrize("name", CASES)
def test_quadstep_fly_flies_a_flight_of_a_campaign_again(name, tmp_path, no_figures, monkeypatch):
    monkeypatch.setattr("quadstep.mission.schema.flight_jobs", lambda *_: [])
    mission, vary = CASES[name]
    path = written(tmp_path, vary, mission, "chunk = 16\nflights = 20")
    assert fly(path, tmp_path / "out").code == 0
    run = quadstep("fly", path, "--flight", 7, "--out", tmp_path / "alone")
    assert run.code == 0, run.err
    metrics = json.loads((tmp_path / "alone" / "metrics.json").read_text())
    row = row_of(tmp_path / "out", 7)
    assert row["position_rmse[m]"] == pytest.approx(metrics["position_rmse[m]"], rel=1e-9)
    assert metrics["mission"]["vehicle"]["mass"] == row["vehicle.mass"]
    with (tmp_path / "alone" / "flight.csv").open(newline="") as file:
        assert len(list(csv.reader(file))) > 10
    refused(quadstep("fly", path, "--flight", -1, "--out", tmp_path / "b"), "--flight")
    refused(quadstep("fly", path, "--flight", 10**9, "--out", tmp_path / "b"), "--flight")
    refused(quadstep("fly", path.parent / "mission.toml", "--flight", 1, "--out", tmp_path / "b"), "looks like a mission")


def test_the_first_flights_of_a_replay_have_the_noise_of_their_number(tmp_path):
    made = campaign(tmp_path, "", NOISY, head="seed = 5")
    keys = [list(replay(made, flight).plan.parameters.key.words) for flight in (0, 1, 1)]
    assert keys[0] != keys[1]
    assert keys[1] == keys[2]
    table = Flyer(made).fly(0, 2)
    _, plan, _ = planned(tmp_path / "camp.toml", 1)
    log = fly_plan(plan, Engine.LANES)
    off = np.linalg.norm(log.table("x", "y", "z") - log.table("x_d", "y_d", "z_d"), axis=1)
    assert table["largest_error[m]"].to_pylist()[1] == pytest.approx(off.max(), rel=1e-9)


def test_rows_have_the_values_that_were_drawn(tmp_path):
    path = written(tmp_path, MANY, head="flights = 30")
    assert fly(path, tmp_path / "out").code == 0
    table = rows(tmp_path / "out")
    made = read_campaign(path)
    for flight in (0, 29):
        row = table.slice(flight, 1).to_pylist()[0]
        assert {key: row[key] for key in made.file.keys} == replay(made, flight).values
    assert table.column_names[:6] == ["flight", *made.file.keys, "outcome"]
    assert set(METRICS) < set(table.column_names)


def test_flights_score_as_on_another_engine(tmp_path):
    made = campaign(tmp_path, MASS)
    table = Flyer(made).fly(0, 3)
    for flight in range(3):
        log = fly_floats(*(getattr(replay(made, flight).plan, name) for name in ("loop", "parameters", "start", "ticks")))
        off = np.linalg.norm(log.table("x", "y", "z") - log.table("x_d", "y_d", "z_d"), axis=1)
        assert table["largest_error[m]"].to_pylist()[flight] == pytest.approx(off.max(), rel=1e-8)


# When samples are taken


def log_of(path):
    mission, plan, _ = planned(path, 0)
    return mission, fly_plan(plan, Engine.LANES)


def test_a_mission_that_is_scored_from_some_time_on(tmp_path):
    late = NOISY.replace("[vehicle]", "score_from = 0.15\n[vehicle]", 1)
    path = written(tmp_path, "", late, "flights = 3")
    assert fly(path, tmp_path / "late").code == 0
    row = row_of(tmp_path / "late", 0)
    mission, log = log_of(path)
    assert row["position_rmse[m]"] == pytest.approx(mission.flight_metrics(log)[0]["position_rmse[m]"], rel=1e-9)
    rows_since = log.column("t") >= 0.15 - 1e-9
    inputs = log.table("u_a", "tau_x_a", "tau_y_a", "tau_z_a")[rows_since]
    off = np.linalg.norm(log.table("x", "y", "z") - log.table("x_d", "y_d", "z_d"), axis=1)[rows_since]
    assert row["largest_error[m]"] == pytest.approx(off.max(), rel=1e-9)
    assert row["effort_thrust[N]"] == pytest.approx(np.sqrt((inputs[:, 0] ** 2).mean()), rel=1e-9)
    assert row["variation_thrust[N]"] == pytest.approx(np.abs(np.diff(inputs[:, 0])).sum(), rel=1e-8)
    written(tmp_path, "", NOISY, "flights = 3")
    assert fly(path, tmp_path / "all").code == 0
    assert row_of(tmp_path / "all", 0)["position_rmse[m]"] != row["position_rmse[m]"]


def test_a_score_period_of_ones_own(tmp_path):
    path = written(tmp_path, MASS, head="flights = 3\nscore_period = 0.1")
    assert fly(path, tmp_path / "out").code == 0
    mission, log = log_of(path)
    off = np.linalg.norm(log.table("x", "y", "z") - log.table("x_d", "y_d", "z_d"), axis=1)
    at = np.isin(np.round(log.column("t"), 6), [0.0, 0.1, 0.2, 0.3, 0.4])
    assert at.sum() == 5
    assert row_of(tmp_path / "out", 0)["position_rmse[m]"] == pytest.approx(np.sqrt((off[at] ** 2).mean()), rel=1e-9)
    assert mission.simulation.log_period == 0.02


def test_a_score_that_would_have_no_sample_is_refused(tmp_path):
    late = NOISY.replace("[vehicle]", "score_from = 0.15\n[vehicle]", 1)
    path = written(tmp_path, "", late, "flights = 3\nscore_period = 1.0")
    refused(fly(path, tmp_path / "out"), "score_period")


# Failures


def failing(folder, head="", precision="f64"):
    """Half of the flights begin far from the path, some at once lost; one of the grid spins."""
    vary = '"start.position.0" = {type="grid", values=[0.0, 0.05, 0.3, 5.0]}\n'
    vary += '"start.rates.0" = {type="grid", values=[0.0, 50.0]}\n'
    mission = SHORT.replace("[start]", "[limits]\ndistance = 0.5\nrate = 40.0\n[start]\nrates = [0.0, 0.0, 0.0]")
    path = written(folder, vary, mission, f'precision = "{precision}"\nchunk = 16\nflights = 32\n{head}')
    run = fly(path, folder / "out")
    assert run.code == 0, run.err
    return run, rows(folder / "out")


@PRECISIONS
def test_what_a_flight_does_not_have_is_missing_and_never_nan(tmp_path, precision):
    run, table = failing(tmp_path, precision=precision)
    assert "nan" not in run.out.lower()
    at_once = np.array([value == 5.0 for value in table["start.position.0"].to_pylist()])
    for name in METRICS:
        assert not np.isnan(table[name].drop_null().to_numpy()).any()
        assert not np.isinf(table[name].drop_null().to_numpy()).any()
    assert at_once.sum() == 8
    assert np.isnan(number(table["position_rmse[m]"])[at_once]).all()
    assert table["time_of_failure[s]"].null_count == sum(one == "completed" for one in table["outcome"].to_pylist())
    assert str(table.schema.field("position_rmse[m]").type) == {"f64": "double", "f32": "float"}[precision]
    text = json.dumps(manifest(tmp_path / "out"))
    assert "NaN" not in text
    assert "Infinity" not in text


def test_outcomes_and_times_are_those_of_the_flights_themselves(tmp_path):
    _, table = failing(tmp_path)
    made = read_campaign(tmp_path / "camp.toml")
    for flight in range(8):
        log = fly_plan(replay(made, flight).plan, Engine.LANES)
        row = table.slice(flight, 1).to_pylist()[0]
        assert row["outcome"] == log.outcome.name.lower().replace("_", "-")
        assert (row["time_of_failure[s]"] is None) == (log.outcome is Outcome.COMPLETED)
        if row["time_of_failure[s]"] is not None:
            assert row["time_of_failure[s]"] == pytest.approx(log.ended)
    assert len(set(table["outcome"].to_pylist())) > 1


@PRECISIONS
def test_a_flight_succeeds_if_it_ends_well_and_within_the_limits(tmp_path, precision):
    _, free = failing(tmp_path / "free", precision=precision)
    through = [one == "completed" for one in free["outcome"].to_pylist()]
    assert 0 < sum(through) < 32
    assert free["success"].to_pylist() == through
    limit = float(np.nanmedian(number(free["largest_error[m]"])[through]))
    _, held = failing(tmp_path / "held", f"[failure]\nlargest_error = {limit}\neffort_thrust = 1e9", precision)
    off = held["largest_error[m]"].to_pylist()
    wanted = [ended and error <= limit for ended, error in zip(through, off, strict=True)]
    assert held["success"].to_pylist() == wanted
    assert 0 < sum(wanted) < sum(through)
    none = failing(tmp_path / "none", "[failure]\nlargest_error = 1e-9", precision)[1]
    assert not any(none["success"].to_pylist())


def test_flights_that_overflow_are_outcomes(tmp_path):
    """Numbers beyond f32, in f32."""
    mission = SHORT.replace("[path]", "[limits]\ndistance = 1e9\nrate = 1e9\n[path]")
    vary = '"start.position.0" = {type="uniform", low=-9e8, high=9e8}\n'
    vary += '"vehicle.mass" = {type="log-normal", median=1, sigma=4}\n'
    path = written(tmp_path, vary, mission, 'precision = "f32"\nflights = 64')
    run = fly(path, tmp_path / "out")
    assert (run.code, run.err) == (0, "")
    for name in METRICS:
        values = rows(tmp_path / "out")[name].drop_null().to_numpy()
        assert np.isfinite(values).all()
    assert manifest(tmp_path / "out")["complete"]


def test_one_number_for_three_is_the_same_however_it_varies(tmp_path):
    """A number that stands for a list of three is no array of three flights."""
    results = []
    for kind, value in (("choice", "4.0"), ("grid", "4.0"), ("choice", "[4.0, 4.0, 4.0]")):
        made = campaign(tmp_path, f'"vehicle.inertia" = {{type="{kind}", values=[{value}]}}')
        results.append(Flyer(made).fly(0, 20)["position_rmse[m]"].to_pylist())
    assert results[0] == results[1] == results[2]


def test_sweepers_of_another_kind_can_be_put_in(tmp_path):
    made, asked = campaign(tmp_path, MANY), []

    class Counting(Sweep):
        def fly(self, values, **more):
            asked.append(len(values))
            return super().fly(values, **more)

    table = Flyer(made, Counting).fly(0, 30)
    assert sum(asked) == 30
    assert table.to_pylist() == Flyer(made).fly(0, 30).to_pylist()


def test_values_that_are_refused_late_leave_what_was_flown(tmp_path):
    mean = '"vehicle.mass" = {type="normal", mean=0.28, deviation=0.1}'
    for seed in range(1, 30):
        path = written(tmp_path, mean, head=f"seed = {seed}\nchunk = 16\nflights = 1000")
        out = tmp_path / f"out{seed}"
        run = fly(path, out)
        if run.code == 0:
            continue
        line = refused(run, "vehicle.mass", "greater than 0")
        flight = int(line.partition("flight ")[2].split()[0])
        with pytest.raises(UserError, match=f"flight {flight} "):
            replay(read_campaign(path), flight)
        if out.exists():  # not noticed before the first was flown
            assert len(flights(out)) == flight // 16 > 0
            assert rows(out)["flight"].to_pylist() == list(range(flight // 16 * 16))
            return
    raise AssertionError("no campaign in which it happens late")


def test_what_varies_without_an_effect_makes_copies_of_one_flight(tmp_path):
    still = NOISY.partition("[wind]")[0].replace(
        'preset = "research-2.6kg"',
        'preset = "research-2.6kg"\ndrag = { parasitic = [0.0, 0.0, 0.0], rotor = [0.0, 0.0, 0.0], flapping = 0.0, '
        "translational_lift = 0.0 }",
    )
    wind = '"wind.mean.0" = { type = "uniform", low = 0.0, high = 9.0 }\n'
    path = written(tmp_path, wind, still + "[wind]\nmean = [1.0, 0.0, 0.0]\n", "flights = 32\n")
    run = fly(path, tmp_path / "out")
    assert run.code == 0, run.err
    assert "Its 32 flights do not differ, so there are no statistics." in run.out
    assert "95 %" not in run.out


def test_a_metric_that_no_campaign_could_compile_is_refused_by_fly_too(tmp_path):
    (tmp_path / "own.py").write_text(
        "from quadstep.interfaces.log import Metric\n\n\nclass Square(Metric):\n    name = 'square'\n\n"
        "    def start(self):\n        return 0.0\n\n"
        "    def add(self, sums, sample):\n        return sums + sample['x'] ** 2\n\n"
        "    def value(self, sums):\n        return sums\n"
    )
    path = written(tmp_path, MASS, 'metrics = ["own.py:Square"]\n' + SHORT, "flights = 2\n")
    said = []
    for command in (("fly", tmp_path / "mission.toml"), ("campaign", path)):
        run = quadstep(*command, "--out", tmp_path / "out")
        assert run.refused, run
        said.append(run.err)
    assert said[0] == said[1]
    assert "own.py:11: TypeError: a law cannot use powers" in said[0]
