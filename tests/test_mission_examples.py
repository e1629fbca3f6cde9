"""The missions in examples/: all can be flown, and those of the paper are the study's own."""

import re

import numpy as np
import pytest

from quadstep import UserError, fly, read_mission
from quadstep.engines.fly import fingerprint
from quadstep.interfaces.closed_loop import Outcome
from quadstep.mission.read import plan_mission
from quadstep.studies.paper.cases import main_cases, stress
from tests.missions import EXAMPLES, MISSIONS, RECORDED
from tests.needs import CRAZYPAD, RECORDINGS, needs

DIVERGING = {"stress", "theorem_fails"}


def plan(name):
    path = EXAMPLES / f"{name}.toml"
    return plan_mission(read_mission(path), path)


@pytest.mark.parametrize("name", [name for name in MISSIONS if name != RECORDED])
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
        assert read_mission(path).name != path.stem


def test_a_mission_without_a_name_has_that_of_its_file(tmp_path):
    content = '[path]\ntype = "minimum-jerk"\nend = [1.0, 0.0, 0.0]\nduration = 1.0\n'
    for file, text, name in (("tower.toml", "", "tower"), ("a\nb.toml", "", "Flight"), ("c.toml", 'name = "Mast"\n', "Mast")):
        (tmp_path / file).write_text(text + content, encoding="utf-8")
        assert read_mission(tmp_path / file).name == name


@needs(RECORDINGS)
@pytest.mark.parametrize("recording", ["normal_motor", "string_load_motor", "added_weight_motor"])
def test_a_real_flight_is_flown_again_from_beside_the_mission_or_from_where_it_says(tmp_path, recording):
    path = tmp_path / f"{RECORDED}.toml"
    text = (EXAMPLES / path.name).read_text(encoding="utf-8")
    (tmp_path / "crazypad").symlink_to(CRAZYPAD)
    path.write_text(text.replace("normal_motor", recording), encoding="utf-8")
    mission = plan_mission(read_mission(path), path)
    assert mission.warnings == ()
    log = fly(mission)
    assert log.outcome is Outcome.COMPLETED
    times = np.genfromtxt(CRAZYPAD / f"{recording}.csv", delimiter=",", skip_header=1, usecols=0)
    assert log.column("t")[-1] == pytest.approx(times[-1], abs=0.02)
    assert 0.3 < log.column("z").max() < 0.9
    assert 1.5 < log.column("x").max() < 2.5
    path.write_text(text.replace("crazypad/normal_motor.csv", str(CRAZYPAD / f"{recording}.csv")), encoding="utf-8")
    assert fingerprint([plan_mission(read_mission(path), path)]) == fingerprint([mission])


def test_without_the_real_recording_the_error_says_where_it_was_looked_for():
    path = EXAMPLES / f"{RECORDED}.toml"
    missing = path.parent / read_mission(path).path.file
    if not missing.exists():  # a user may have put it there, as the example says
        with pytest.raises(UserError, match=rf"path\.file: {re.escape(str(missing))}: .*file not found"):
            plan(RECORDED)


def test_the_recording_that_comes_along_is_flown_to_a_centimetre_of_it():
    """Two noises of 1 cm each apart, the recording's is smoothed away."""
    log, mission = fly(plan("recorded")), read_mission(EXAMPLES / "recorded.toml")
    recorded = np.genfromtxt(EXAMPLES / mission.path.file, delimiter=",", names=True)
    at = np.searchsorted(log.column("t"), recorded["t"])[20:-20]
    apart = [log.column(name)[at] - recorded[f"{name}_m"][20:-20] for name in "xyz"]
    assert np.sqrt(np.mean(np.square(apart), axis=1)).max() < 0.02
