"""Candidates on the proving ground: gains from which no law can be built count as lost flights and do not end the search."""

from pathlib import Path

import numpy as np
import pytest

from quadstep.engines.scored import names_without_units
from quadstep.io.errors import UserError
from quadstep.mission.read import check_mission
from quadstep.studies.tuning.ground import CandidateFlyer, tuning_request

MISSION = {
    "vehicle": {"preset": "research-2.6kg"},
    "path": {"type": "step", "start": [0.0, 0.0, 5.0], "end": [0.0, 0.0, 5.0], "time": 0.5, "duration": 1.0},
    "controller": {"type": "loop-shaping"},
    "simulation": {"duration": 2.0},
    "wind": {"mean": [3.0, 0.0, 0.0], "turbulence": {"wind_20": 3.0, "height": 6.0}},
    "tune": {"gains": {"controller.corner": {"low": 0.01, "high": 20.0}, "controller.pace": {}}, "seeds": 8},
}
GOOD = {"controller.corner": 0.25, "controller.pace": 5.5}
NONE = {"controller.corner": 10.0, "controller.pace": 0.014}  # the weights differ too much for its Riccati equation


@pytest.fixture(scope="module")
def ground():
    return CandidateFlyer(tuning_request(Path("m.toml"), "", MISSION, Path()), 1)


def test_gains_without_a_law_are_one_line_of_a_mission():
    mission = {**MISSION, "controller": {"type": "loop-shaping", "corner": 10.0, "pace": 0.014}}
    with pytest.raises(UserError, match=r"^controller: loop-shaping has no law for these gains: "):
        check_mission(mission, "m.toml", Path()).plan(Path())


def test_a_candidate_without_a_law_loses_its_flights_and_the_others_fly_as_ever(ground):
    alone = ground.fly([GOOD], 0, 8)[0]
    good, none, again = ground.fly([GOOD, NONE, GOOD], 0, 8)
    assert alone.completed.all()
    assert not none.completed.any()
    assert (none.ended == 0.0).all()
    for one in (good, again):
        assert np.array_equal(one.metrics, alone.metrics)


def test_margins_are_kept_for_who_tunes_and_cost_nobody_else_a_linearisation(ground):
    assert ground.asked.names == names_without_units(ground.asked.mission.scores)


def test_candidates_none_of_which_has_a_law_are_an_error(ground):
    with pytest.raises(UserError, match="has no law for these gains"):
        ground.fly([NONE, NONE], 0, 8)


def test_gains_that_change_together_need_not_fit_one_without_the_other():
    gains = {"controller.MPC_THR_MIN": {"low": 0.12, "high": 0.55}, "controller.MPC_THR_HOVER": {"low": 0.5, "high": 0.6}}
    mission = {**MISSION, "controller": {"type": "px4-cascade"}, "tune": {"gains": gains}}
    with pytest.raises(UserError, match=r"MPC_THR_MIN cannot be 0\.55: .* PX4 v1\.15 needs MPC_THR_MIN <= MPC_THR_HOVER"):
        tuning_request(Path("m.toml"), "", mission, Path())
    together = tuning_request(Path("m.toml"), "", mission, Path(), apart=False)
    assert together.present == {"controller.MPC_THR_MIN": 0.12, "controller.MPC_THR_HOVER": 0.5}
