"""The missions in examples/: all can be flown, and those of the paper are the study's own."""

from pathlib import Path

import pytest

from quadstep import fly, read_mission
from quadstep.flight.closed_loop import Outcome
from quadstep.mission.read import plan_mission
from quadstep.report.publish import fingerprint
from quadstep.study.cases import main_cases, stress

EXAMPLES = Path(__file__).parent.parent / "examples"
MISSIONS = sorted(path.stem for path in EXAMPLES.glob("*.toml") if "[path]" in path.read_text())
DIVERGING = {"stress", "theorem_fails"}


def plan(name):
    path = EXAMPLES / f"{name}.toml"
    return plan_mission(read_mission(path), path)


@pytest.mark.parametrize("name", MISSIONS)
def test_an_example_flies_to_its_end_without_a_warning(name):
    mission = plan(name)
    assert mission.warnings == ()
    log = fly(mission)
    assert (log.outcome is Outcome.COMPLETED) == (name not in DIVERGING)
    assert len(log.rows) > 100


def test_the_issues_examples_are_there():
    assert {"case1", "case2", "case3_adaptive", "case3_nested", "figure_eight"} <= set(MISSIONS)


@pytest.mark.parametrize("name", ["case1", "case2", "case3_adaptive", "case3_nested"])
def test_the_papers_cases_are_the_studys(name):
    study = main_cases()[name]
    assert fingerprint([plan(name)]) == fingerprint([study.plan()])
    assert read_mission(EXAMPLES / f"{name}.toml").name == study.name


def test_the_stress_example_is_the_studys():
    assert fingerprint([plan("stress")]) == fingerprint([stress(3.0, 1.0).plan()])


def test_every_example_has_a_name_and_says_what_it_is():
    for name in MISSIONS:
        path = EXAMPLES / f"{name}.toml"
        assert path.read_text(encoding="utf-8").startswith("# ")
        assert read_mission(path).name != "Flight"


def test_the_real_flight_comes_with_its_licence():
    path = EXAMPLES / "crazyflie_flight.toml"
    recording = path.parent / read_mission(path).path.file
    assert recording.is_file()
    assert "MIT" in (recording.parent / "LICENSE").read_text(encoding="utf-8")
