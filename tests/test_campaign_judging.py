"""`quadstep campaign --require`, `--json`, `--junit`."""

import json

import pytest

from quadstep.studies.campaign.planner import is_random
from quadstep.studies.campaign.schema import read_campaign
from tests.campaigns import MASS, SHORT, fly, manifest, written
from tests.verdicts import checked, properties

ONLY = "success rate of all flights should be at least {} %, but is only shown to be above {} %"
BELOW = "success rate of all flights should be at least {} %, but is shown to be below {} %"
FAILING = f"{MASS}[failure]\nlargest_error = 1e-9\n"


UNDEFINED = """from quadstep.own import Metric


class Undefined(Metric):
    name, unit = "undefined", "m"

    def start(self):
        return 0.0

    def add(self, sums, sample):
        return sums

    def value(self, sums):
        return sums / sums
"""


def success(folder):
    return manifest(folder)["summary"]["success"]


@pytest.mark.parametrize(("limits", "good"), [("", 1.0), ("[failure]\nundefined = 8.0\n", 0.0)])
def test_a_metric_without_a_value_fails_a_flight_only_where_it_has_a_limit(tmp_path, limits, good):
    (tmp_path / "undefined.py").write_text(UNDEFINED, encoding="utf-8")
    path = written(tmp_path, MASS + limits, 'metrics = ["undefined.py:Undefined"]\n' + SHORT, "flights = 10\n")
    assert fly(path, tmp_path / "out").code == 0
    assert success(tmp_path / "out")["value"] == good


def test_the_lower_end_of_the_interval_must_reach_what_is_required(tmp_path):
    path, out = written(tmp_path, MASS, head="flights = 60\n"), tmp_path / "out"
    assert fly(path, out, "--require", "0.94").code == 0
    low = success(out)["low"]
    assert 0.94 < low < 0.941
    met = fly(path, out, "--resume", "--require", repr(low))
    assert (met.code, met.err) == (0, "")
    assert "Met: at least 0.9403705077 of all flights succeed, with 95 % confidence\n" in met.out
    missed = fly(path, out, "--resume", "--require", "0.941")
    assert missed.code == 4
    assert f"NOT MET: {ONLY.format('94.1', '94.03')}; so few" in missed.out


def test_a_campaign_that_was_over_before_is_judged_too(tmp_path):
    path, out = written(tmp_path, FAILING, head="flights = 30\n"), tmp_path / "out"
    assert fly(path, out).code == 0
    before = (out / "flights" / "00000.parquet").read_bytes()
    run = fly(path, out, "--resume", "--require", "0.5", "--json", "--junit", tmp_path / "junit.xml")
    assert run.code == 4
    assert run.err == f"quadstep: NOT MET: {BELOW.format(50, 11.58)}\n"
    found = json.loads(run.out)
    assert found["requirement"] == {"least": 0.5, "measured": 0.0, "shown": 0.0, "met": False} and "graded" not in found
    assert (found["passed"], found["exit_code"], found["flights"]) == (False, 4, 30)
    assert found["success"] == success(out)
    suite, cases = checked((tmp_path / "junit.xml").read_text(encoding="utf-8"))
    assert list(cases.values()) == [None, BELOW.format(50, 11.58)]
    assert float(properties(suite)["success.low"]) == 0.0
    assert (out / "flights" / "00000.parquet").read_bytes() == before


def test_where_a_choice_decides_json_has_each_value_and_the_required_share_is_said_to_be_of_all_flights(tmp_path):
    far = ", ".join(f"{{position=[{x}, 0.0, 0.0], attitude=[0.0, 0.0, 0.0]}}" for x in (0.0, 0.5))
    choice = f'"start" = {{type="choice", values=[{far}]}}\n{MASS}[failure]\nlargest_error = 0.45\n'
    path, out = written(tmp_path, choice, head="flights = 80\n"), tmp_path / "out"
    run = fly(path, out, "--require", "0.3", "--json")
    found = json.loads(run.out)
    near, off = sorted(found["by_choice"].values(), key=lambda one: one["success"]["value"], reverse=True)
    assert (near["success"]["value"], off["success"]["value"]) == (1.0, 0.0)
    assert near["flights"] + off["flights"] == found["flights"] == 80
    assert near["success"]["low"] > 0.85 and near["outcomes"] == {"completed": near["flights"]}
    assert near["quantiles"]["largest_error[m]"]["0.5"]["value"] < 0.45
    assert off["quantiles"]["largest_error[m]"]["0.5"]["value"] == pytest.approx(0.5, rel=0.1)
    share, low = near["flights"] / 80, found["success"]["low"]
    assert run.code == (0 if low >= 0.3 else 4) and found["requirement"]["shown"] == low
    assert found["requirement"]["measured"] == share
    said = fly(path, out, "--resume", "--require", "0.3").out
    rate = f"{100 * share:.3g} % succeeded (95 % interval {100 * low:.1f} % to"
    assert f"Of all 80 flights, which --require judges, {rate}" in said


def test_json_is_all_that_is_printed(tmp_path):
    path = written(tmp_path, MASS, head="flights = 20\n")
    run = fly(path, tmp_path / "out", "--json")
    assert (run.code, run.err) == (0, "")
    found = json.loads(run.out)
    assert (found["command"], found["passed"], found["requirement"], found["exit_code"]) == ("campaign", True, None, 0)
    worst = manifest(tmp_path / "out")["summary"]["worst"]
    assert [one["flight"] for one in found["worst"]] == [one["flight"] for one in worst]
    again = f"quadstep fly {path} --flight {found['worst'][0]['flight']} --results {tmp_path / 'out'}"
    assert found["worst"][0]["replay"] == again


@pytest.mark.parametrize("share", ["nan", "1.5", "-1", "", "abc"])
def test_a_share_that_is_none_is_refused_before_anything_is_flown(tmp_path, share):
    path = written(tmp_path, MASS, head="flights = 20\n")
    run = fly(path, tmp_path / "out", f"--require={share}")
    assert run.refused, run
    assert ("between 0 and 1" if share else "--require: is empty") in run.err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("options", [("--flights", 8, "--require", "0.5"), ("--until", "0.3")])
def test_copies_of_one_flight_show_nothing_of_others(tmp_path, options):
    path, out = written(tmp_path, "", head="flights = 8\n"), tmp_path / "out"
    run = fly(path, out, *options)
    assert run.refused
    assert f"{options[-2]}: its flights do not differ and say nothing about others" in run.err
    assert not out.exists()
    assert fly(path, out).code == 0


CALM = (
    '[mission]\nvehicle = { preset = "crazyflie" }\npath = { type = "minimum-jerk", end = [0.1, 0.0, 0.0], duration = 0.5 }\n'
)


@pytest.mark.parametrize(("more", "alike"), [
    ("", True),
    ("wind = { mean = [1.0, 0.0, 0.0] }\n", True),
    ("sensors = { gyro_noise = 0.01 }\n", False),
    ("wind = { turbulence = { wind_20 = 5.0, height = 6.0 } }\n", False),
    ('controller = { type = "mppi" }\n', False),
])  # fmt: skip
def test_flights_that_draw_random_numbers_are_no_copies(tmp_path, more, alike):
    path = tmp_path / "camp.toml"
    path.write_text(f"flights = 3\n{CALM}{more}")
    assert is_random(read_campaign(path)) != alike


@pytest.mark.parametrize(("more", "random"), [
    ('wind.mean.0 = { type = "grid", values = [0.0, 1.0] }\n', False),
    ('wind.mean.0 = { type = "uniform", low = 0.0, high = 1.0 }\n', True),
    ('sensors.gyro_noise = { type = "grid", values = [0.0, 0.0, 0.01] }\n', True),
    ('controller.type = { type = "grid", values = ["pid", "mppi"] }\n', True),
])  # fmt: skip
def test_points_of_a_grid_show_nothing_of_others_unless_there_is_noise(tmp_path, more, random):
    path = tmp_path / "camp.toml"
    path.write_text(f"flights = 6\n{CALM}[vary]\n{more}")
    assert is_random(read_campaign(path)) == random


def test_points_of_a_grid_flown_often_have_no_intervals(tmp_path):
    path, out = tmp_path / "camp.toml", tmp_path / "out"
    path.write_text(f'flights = 60\n{CALM}[vary]\nwind.mean.0 = {{ type = "grid", values = [1.0, 2.0] }}\n')
    run = fly(path, out, "--require", "0.5")
    assert run.refused
    assert "--require: its flights are points of a grid, without noise, and say nothing about others" in run.err
    run = fly(path, out)
    assert "Its 60 flights are 2 points of a grid, without noise, so there are no statistics." in run.out
    assert "95 %" not in run.out
    assert "[" not in run.out.partition("Position RMSE")[2]
    assert manifest(out)["summary"]["points"] == 2


@pytest.mark.parametrize(
    ("flights", "said", "more"),
    [(20, "20 flights do not cover its grid of 30 points evenly", 30), (70, "do not cover its grid of 30", 90)],
)
def test_flights_that_leave_points_of_a_grid_out_show_nothing_of_the_campaign(tmp_path, flights, said, more):
    path, out = tmp_path / "camp.toml", tmp_path / "out"
    noisy, winds = "sensors = { gyro_noise = 0.01 }", '{ type = "grid", low = 0.0, high = 9.0, count = 30 }'
    path.write_text(f"flights = {flights}\n{CALM}{noisy}\n[vary]\nwind.mean.0 = {winds}\n")
    run = fly(path, out, "--require", "0.5")
    assert run.refused
    assert f"{flights} flights cannot cover the 30 points of its grid equally often; --flights {more} can" in run.err
    assert not out.exists()
    run = fly(path, out)
    assert said in run.out
    assert "95 %" not in run.out
    assert manifest(out)["summary"]["uneven_grid"] == 30
    assert not manifest(out)["summary"]["quantiles"], "some points would count more often"
    assert "Position RMSE" not in run.out
    assert "(95 % interval " in fly(path, out, "--resume", "--flights", 60).out


def test_one_flight_of_which_nothing_is_drawn_is_no_grid(tmp_path):
    path, out = tmp_path / "camp.toml", tmp_path / "out"
    path.write_text(f"flights = 1\n{CALM}")
    assert "It is a single flight, which gives no success rate." in fly(path, out).out
    required = fly(path, tmp_path / "other", "--require", "0.5")
    assert required.refused
    assert "--require: its flights do not differ and say nothing about others" in required.err


def test_one_flight_shows_no_share_though_it_is_drawn_at_random(tmp_path):
    path, out = tmp_path / "camp.toml", tmp_path / "out"
    path.write_text(f"flights = 1\n{CALM}sensors = {{ gyro_noise = 0.01 }}\n")
    run = fly(path, out)
    assert "The only flight reached the end. " in " ".join(run.out.split())
    assert "It is a single flight, which gives no success rate." in " ".join(run.out.split())
    assert "95 %" not in run.out
    assert fly(path, tmp_path / "other", "--require", "0.5").code == 4


def test_what_a_plant_of_ones_own_draws_shows_only_in_flight(tmp_path):
    content = (
        '[mission]\nvehicle = { type = "planar" }\npath = { type = "minimum-jerk", end = [0.1, 0.0, 0.0], duration = 0.5 }\n'
    )
    path, out = tmp_path / "camp.toml", tmp_path / "out"
    path.write_text(f"flights = 3\n{content}")
    run = fly(path, out, "--require", "0.5")
    assert run.refused
    assert "--require: its flights do not differ and say nothing about others" in run.err
    assert manifest(out)["flights"] == 3


def test_a_campaign_is_resumed_or_replaced(tmp_path):
    run = fly(written(tmp_path, MASS, head="flights = 20\n"), tmp_path / "out", "--resume", "--overwrite")
    assert run.refused
    assert "--resume and --overwrite: choose one" in run.err
    assert not (tmp_path / "out").exists()


def test_a_folder_is_no_junit_file(tmp_path):
    run = fly(written(tmp_path, MASS, head="flights = 20\n"), tmp_path / "out", "--junit", tmp_path)
    assert run.refused
    assert not (tmp_path / "out").exists()
