"""Margins as metrics and constraints of `tune`, and the command line of `linear`."""

import json
import math
import re
from html import unescape
from pathlib import Path

import numpy as np
import pytest

from quadstep import Mission, UserError, read_mission
from quadstep.linear.analysis import analyse_rest
from quadstep.linear.grade import margin_metrics, of_analysis
from quadstep.linear.worst import refused
from quadstep.metrics.registry import MARGINS, is_margin
from quadstep.mission.tune import Constraint, as_constraints
from quadstep.studies.tuning.ground import CandidateFlyer, read_request
from tests.commands import quadstep

MISSION = """
name = "Hold"
vehicle = { preset = "research-2.6kg" }
path = { type = "step", start = [0.0, 0.0, 5.0], end = [0.0, 0.0, 5.0], duration = 4.0 }
controller = { type = "pid" }
"""


@pytest.fixture
def mission(tmp_path):
    path = tmp_path / "hold.toml"
    path.write_text(MISSION)
    return path


def test_a_margin_is_held_from_below_and_a_metric_from_above():
    found = as_constraints({"phase_margin_roll": 0.5, "largest_error": 0.2, "sensitivity_peak": 2.0})
    assert (found["phase_margin_roll"].least, found["phase_margin_roll"].most) == (0.5, None)
    assert found["largest_error"].most == 0.2
    assert found["sensitivity_peak"].most == 2.0
    least = Constraint(least=0.5)
    assert least.keeps(np.array([0.4, 0.5, 0.6])).tolist() == [False, True, True]
    assert least.excess(np.array([0.4])) == pytest.approx(0.2)
    assert least.excess(np.array([0.7])) == 0.0
    assert Constraint(least=0.5, share=0.5).excess(np.array([0.4, 0.6])) == 0.0
    with pytest.raises(ValueError, match="either most or least"):
        Constraint(most=1.0, least=0.5)


@pytest.mark.parametrize(("table", "said"), [
    ({"constraints": {"phase_margins": 0.5}}, "phase_margins: unknown metric"),
    ({"objective": {"delay_margin": 1.0}}, "larger is better; make it a constraint"),
])  # fmt: skip
def test_unknown_margins_and_margins_to_be_minimised_are_refused(table, said):
    with pytest.raises(UserError, match=said):
        Mission(
            vehicle={"preset": "x500"},
            path={"type": "step", "end": [0.0, 0.0, 1.0]},
            tune={"gains": {"controller.k_x": {"low": 1.0, "high": 9.0}}, **table},
        )


def test_metrics_are_those_of_the_analysis_and_finite(mission):
    found = analyse_rest(read_mission(mission)).analysis
    metrics = of_analysis(found)
    assert set(metrics) == set(MARGINS)
    assert all(map(math.isfinite, metrics.values()))
    assert metrics["phase_margin"] == min(one.phase for one in found.margins)
    roll = dict(zip([one.name for one in found.channels], found.margins, strict=True))["roll"]
    assert metrics["delay_margin_roll"] == roll.delay
    assert 10.0 ** (metrics["gain_margin_down_roll"] / -20.0) == pytest.approx(roll.gain_down)
    assert not is_margin("sensitivity_peak_roll")
    assert margin_metrics(read_mission(mission), ["disk_margin"]) == {"disk_margin": metrics["disk_margin"]}


def test_candidates_are_given_their_own_margins(mission):
    tune = (
        "[tune]\nconstraints = { phase_margin_roll = 0.5 }\n[tune.gains]\ncontroller.position = { low = 0.1, high = 50.0 }\n"
    )
    mission.write_text(MISSION + tune)
    ground = CandidateFlyer(read_request(mission), 1)
    (place,) = ground.asked.start
    values = ground.asked.numbers([place - 0.3])
    written = Mission.model_validate({**ground.asked.with_gains(values), "tune": None})
    names = ["phase_margin_roll"]
    assert ground.margins(values, names) == margin_metrics(written, names) == ground.stability.margins(values)
    assert ground.margins(values, names) != ground.margins(ground.asked.present, names)
    assert ground.asked.names["phase_margin_roll"] == "phase_margin_roll[rad]"


def test_the_command_writes_a_report_and_prints_json(mission, tmp_path):
    shown = quadstep("linear", mission, "--out", tmp_path / "out", "--json", "--figures", "svg")
    assert shown.code == 0, shown.err
    said = json.loads(shown.out)
    assert said["stable"] is True
    assert set(said["margins"]) == {"thrust", "roll", "pitch", "yaw"}
    names = {path.name for path in (tmp_path / "out").rglob("*") if path.is_file()}
    assert {"report.html", "linear.json", "margins.csv", "poles.csv", "bode.svg", "nyquist.svg", "step.svg"} <= names
    report = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "<dt>smallest disk margin</dt>" in report
    least = min(math.degrees(one["phase[rad]"]) for one in said["margins"].values())
    assert f">{least:.1f}°</text>" in (tmp_path / "out" / "figures" / "bode.svg").read_text(encoding="utf-8")
    told = re.search(r'data-axes="([^"]*)"', (tmp_path / "out" / "figures" / "step.svg").read_text(encoding="utf-8"))
    (axes,) = json.loads(unescape(told[1]))
    last = max(one["settling[s]"] for one in said["steps"].values())
    assert last < axes["x"]["high"] <= 2.5 * last * (1.0 + 1e-6)


def test_own_controllers_are_linearised_beside_the_package_s(mission, tmp_path):
    own = "own_airframe_controller.py"
    (mission.parent / own).write_text((Path("examples") / own).read_text())
    names = f"pid,{own}:ProportionalDerivative"
    shown = quadstep("linear", mission, "--out", tmp_path / "out", "--controllers", names, "--figures", "svg")
    assert shown.code == 0, shown.err
    assert f"{own}:ProportionalDerivative" in shown.out
    assert "Not linearised" not in shown.out


@pytest.mark.parametrize(("more", "options", "said"), [
    ("", ["--controllers", "pdi"], "--controllers: unknown value 'pdi'"),
    ("", ["--along", "--controllers", "pid"], "--controllers: requires one mission at rest"),
    ("", ["--samples", "3"], "--samples: requires --along or a campaign"),
    ("sensors = { latency = 9.0 }\n", [], "sensors.latency: 9 s is not shorter than the flight of 4 s"),
])  # fmt: skip
def test_bad_input_is_one_line(mission, tmp_path, more, options, said):
    mission.write_text(MISSION + more)
    shown = quadstep("linear", mission, "--out", tmp_path / "out", *options)
    assert shown.refused
    assert said in shown.err
    assert not (tmp_path / "out").exists()


def windy(controller):
    """Held in wind, in one loop."""
    path = {"type": "step", "end": [0.0, 0.0, 1.0]}
    simulation, wind = {"guidance_period": 0.002}, {"mean": [3.0, 0.0, 0.0]}
    return Mission(vehicle={"preset": "x500"}, path=path, controller=controller, wind=wind, simulation=simulation)


def test_laws_without_slopes_are_named():
    with pytest.raises(UserError, match="bits of a number"):
        analyse_rest(
            Mission(vehicle={"preset": "x500"}, path={"type": "step", "end": [0.0, 0.0, 1.0]}, controller={"type": "mppi"})
        )


@pytest.mark.slow
def test_a_law_that_learns_bends_at_rest_in_wind_and_has_the_worst_margins_of_its_sides():
    found = analyse_rest(windy({"type": "rotation-backstepping", "nets": {"neurons": 1}}))
    assert found.rest.pieces
    assert any(place.startswith("rotation_backstepping.py") for place in found.analysis.bends)
    assert found.analysis.holds
    assert len(found.analysis.margins) == 4


def test_loops_that_cannot_be_linearised_for_one_reason_are_one_line():
    found = [(f"flight {i}", f"no state of rest: x.{i % 2} still changes by {i}e-3 (law.py, line 7)") for i in range(9)]
    assert refused([*found, ("flight 9", "it ends")]) == [
        "5 of 10, first flight 0: no state of rest: x.0 still changes by 0e-3 (law.py, line 7)",
        "4 of 10, first flight 1: no state of rest: x.1 still changes by 1e-3 (law.py, line 7)",
        "flight 9: it ends",
    ]
    assert refused([("pid", "it ends"), ("lqr", "it ends")]) == ["pid, lqr: it ends"]
