"""A flight is as commanded, flew but, or was lost: one that breaks each rule, and the same grade on the page."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

from quadstep.engines.fly import fly
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.log import FlightLog
from quadstep.metrics.reductions import late_growth
from quadstep.metrics.registry import AT_REST, flight_metrics
from quadstep.metrics.verdict import RULES, FlightGrade, graded
from quadstep.mission.read import read_mission
from quadstep.mission.schema import Mission
from tests.commands import quadstep
from tests.graded import CASE_1, FLIGHTS


@pytest.mark.parametrize("name", FLIGHTS)
def test_a_flight_breaks_the_rules_that_it_breaks(name):
    content, broken = FLIGHTS[name]
    mission = Mission.model_validate(content)
    log = fly(mission.plan())
    assert log.outcome is Outcome.COMPLETED
    metrics, _ = mission.flight_metrics(log)
    found = graded(metrics)
    assert [rule.metric for rule in RULES if (metrics.get(rule.metric) or 0.0) > rule.most] == broken
    assert found.grade is (FlightGrade.FLEW_BUT if broken else FlightGrade.AS_COMMANDED)
    assert len(found.reasons) == len(broken)
    large = [reason for reason in found.reasons if "its error is large" in reason]
    assert all(("of ten arm lengths" in one) == (content["path"]["type"] == "step") for one in large)
    assert all(f"limit {limit:g}" in reason for limit, reason in zip(limits(broken), found.reasons, strict=True))
    assert all(
        ("rms" in reason) == (metric in ("heading_error[rad]", "shaking[rad]") or "of ten arm lengths" in reason)
        for metric, reason in zip(broken, found.reasons, strict=True)
    )


def limits(broken):
    """The numbers that the sentences name."""
    named = {
        "relative_error": 10,
        "heading_error[rad]": 30,
        "overturned[rad]": 90,
        "shaking[rad]": 5,
        "saturated_share": 10,
        "error_growth": 2,
        "rate_growth": 2,
    }
    return [named[metric] for metric in broken]


def test_a_vehicle_that_starts_upside_down_and_recovers_is_as_commanded():
    mission = read_mission(Path(__file__).parent.parent / "examples" / "upside_down.toml")
    metrics, _ = mission.flight_metrics(fly(mission.plan()))
    assert metrics["largest_tilt[rad]"] > 3.0
    assert graded(metrics).grade is FlightGrade.AS_COMMANDED


@pytest.mark.parametrize(("more", "grows"), [(0.0, True), (5.0, False)])
def test_a_flight_that_is_merely_cut_grows_towards_its_end_and_settles_if_it_goes_on(more, grows):
    path = {**CASE_1, "duration": 4.0}
    mission = Mission.model_validate({"name": "cut", "path": path, "simulation": {"duration": 4.0 + more}})
    metrics, _ = mission.flight_metrics(fly(mission.plan()))
    found = graded(metrics)
    assert (found.labels, found.advice != "") == ((("angular rates still growing",), True) if grows else ((), False))
    assert found.sentence.endswith("; limit 2). A longer flight would show whether it settles.") == grows
    assert metrics["position"]["x"]["final[m]"] < 1e-3 or grows


@pytest.mark.parametrize(("rest", "advised"), [("sound", True), ("fragile", True), ("unstable", False)])
def test_a_longer_flight_is_not_advised_where_the_loop_at_rest_is_unstable(rest, advised):
    found = graded({"outcome": "completed", "error_growth": 20.0, AT_REST: {"grade": rest, "why": "a mode grows"}})
    assert found.sentence.endswith("; limit 2).") != advised and found.sentence.endswith("whether it settles.") == advised
    for more in ("overturned[rad]", "saturated_share", "relative_error"):  # as of rotors that cannot lift the vehicle
        assert graded({"outcome": "completed", "error_growth": 20.0, more: 3.0}).advice == ""
    assert graded({"outcome": "completed", "shaking[rad]": 0.2, AT_REST: {"grade": rest}}).advice == ""


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.metric)
def test_a_value_barely_over_its_limit_is_written_as_more_than_that(rule):
    (reason,) = graded({"outcome": "completed", rule.metric: 1.0003 * rule.most}).reasons
    value, limit = map(float, re.findall(r"\d+(?:\.\d+)?", reason))
    assert value > limit


def test_every_rule_is_broken_by_a_flight():
    assert {metric for _, broken in FLIGHTS.values() for metric in broken} == {rule.metric for rule in RULES}


def test_numbers_are_written_as_a_reader_wants_them():
    said = [graded({"outcome": "completed", "relative_error": value}).reasons[0] for value in (14.7349, 9080.0)]
    assert [one.partition(":")[2].partition("%")[0] for one in said] == [" 1,470 ", " 908,000 "]


@pytest.mark.parametrize(("arm", "large"), [(0.25, False), (1e-9, True)])
def test_an_error_that_is_tiny_beside_the_vehicle_is_not_large(arm, large):
    t = np.linspace(0.0, 0.1, 101)
    rows = np.column_stack([t, 0.3e-3 * t, 1e-3 * t])
    log = FlightLog({"t": "s", "x": "m", "x_d": "m"}, rows, Outcome.COMPLETED, 0.1, None)
    assert ("large error" in graded(flight_metrics(log, arm=arm)).labels) == large


def test_a_flight_that_ends_early_is_lost_whatever_its_numbers():
    assert graded({"outcome": "off_path", "relative_error": 0.0}).grade is FlightGrade.LOST
    assert graded({}).grade is FlightGrade.LOST


def log_of(error):
    """A vehicle that rests at a metre's distance from a path along x, but for an error along y."""
    t = np.linspace(0.0, 1.0, len(error))
    rows = np.column_stack([t, np.zeros(len(t)), error, 10.0 * t, np.zeros(len(t))])
    return FlightLog({"t": "s", "x": "m", "y": "m", "x_d": "m", "y_d": "m"}, rows, Outcome.COMPLETED, 1.0, None)


def test_a_vehicle_that_stays_where_it_started_has_a_relative_error_of_one():
    assert flight_metrics(log_of(np.zeros(101)))["relative_error"] == pytest.approx(1.0)


@pytest.mark.parametrize(("error", "grows"), [
    (lambda t: 0.1 * t, False),
    (lambda t: 0.1 * t**3, True),
    (lambda t: 0.1 * np.exp(4.0 * t) * np.sin(60.0 * t), True),
    (lambda t: 0.1 * np.exp(-4.0 * t) * np.sin(60.0 * t), False),
    (lambda t: 1e-6 * np.exp(4.0 * t), False),
    (lambda t: 0.1 * np.sin(9.0 * t), False),
])  # fmt: skip
def test_growth_is_faster_than_in_proportion_to_time(error, grows):
    t = np.linspace(0.0, 1.0, 2000)
    (growth,) = late_growth(np.column_stack([np.abs(error(t)), np.ones(len(t)), np.zeros(len(t))]), t)
    assert (growth > 2.0) == grows


@pytest.mark.parametrize(("asks", "early", "grows"), [
    ([(0.1, 0.101)], 0.1, True),  # a step, and what it moves
    ([(0.7, 0.701)], 0.7, False),  # it came too late to be over
    ([], 0.2, True),  # a gust while it holds a point
    ([], 0.6, False),  # a later one
    ([(0.0, 1.0)], 0.2, False),  # the path asks for it
    ([(0.0, 0.7)], 0.2, False),  # it has just come to rest
])  # fmt: skip
def test_growth_is_compared_with_what_is_like_the_end(asks, early, grows):
    t = np.linspace(0.0, 1.0, 2000)
    asked = np.max([np.zeros(len(t)), *((begin <= t) & (t <= end) for begin, end in asks)], axis=0)
    value = np.where((early <= t) & (t < early + 0.1), 1.0, 0.0) + np.where(t > 0.98, 50.0 * (t - 0.98), 0.0)
    (growth,) = late_growth(np.column_stack([value, np.ones(len(t)), asked]), t)
    assert (growth > 2.0) == grows


def test_the_documentation_states_every_rule():
    text = (Path(__file__).parent.parent / "docs" / "metrics.md").read_text()
    for rule in RULES:
        most = f"{math.degrees(rule.most):g}°" if rule.metric.endswith("[rad]") else f"{rule.most:g}"
        assert f"| `{rule.metric.partition('[')[0]}` | {most} | {rule.label} |" in text


def test_json_and_junit_say_the_grade(tmp_path, no_figures):
    path = tmp_path / "fast.toml"
    path.write_text('name = "fast"\n[path]\ntype = "minimum-jerk"\nend = [20.0, 5.0, 10.0]\nduration = 0.5\n')
    run = quadstep("fly", path, "--out", tmp_path / "out", "--json", "--junit", tmp_path / "out.xml")
    said = json.loads(run.out)
    assert said["grade"] == "flew, but"
    assert "(limit 90°)" in said["grade_reasons"][1]
    assert 'name="grade" value="flew, but"' in (tmp_path / "out.xml").read_text()
    assert f'name="grade_reasons" value="{"; ".join(said["grade_reasons"])}"' in (tmp_path / "out.xml").read_text()
    kept = json.loads((tmp_path / "out" / "metrics.json").read_text())
    assert (kept["grade"], kept["grade_reasons"]) == (said["grade"], said["grade_reasons"])
    assert ">However, its error is large: " in (tmp_path / "out" / "report.html").read_text()
