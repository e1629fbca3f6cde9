"""The controller's conditions: no candidate that violates them flies, and the result satisfies them."""

import math

import numpy as np
import pytest

from quadstep import read_mission
from quadstep.io.errors import UserError
from quadstep.report.progress import SILENT
from quadstep.studies.tuning import run
from quadstep.studies.tuning.ground import CandidateFlyer, read_request
from quadstep.studies.tuning.search import Search
from tests.tuning import PAPER, ground, history, tuned, written

STEEP = """
[tune]
seeds = 4
unseen = 8
constraints = {{}}
{more}
[tune.gains]
controller.Lambda1 = {{ low = 0.3, high = 30.0 }}
controller.K_r1 = {{ low = 0.5, high = 3.2 }}
{vary}
"""
MASS = '[tune.vary]\nvehicle.mass = { type = "uniform", low = 0.9, high = 1.3 }\n'


def mission(more="", vary="", text=PAPER):
    return text + STEEP.format(more=more, vary=vary)


def slopes(values):
    return values["controller.Lambda1.0"], values["controller.K_r1.0"]


def test_the_result_keeps_them_where_the_best_gains_would_not(tmp_path):
    weak = PAPER.replace("K_r1 = [3.0, 3.0, 3.0]", "K_r1 = [1.2, 1.2, 1.2]")
    free, kept = (mission(more, text=weak).replace("high = 3.2", "high = 1.5") for more in ("theorem = false", ""))
    free = Search([ground(tmp_path, free)], 800, 1, SILENT).run()
    slope, gain = slopes(free.best.values)
    assert gain < slope, "this case must be one in which the conditions cost something"
    done = run.tune(written(tmp_path, kept), 800, tmp_path / "out")
    slope, gain = slopes(done.values)
    assert slope < gain < 1.01 * slope, "right at the border"
    saved = read_mission(tmp_path / "out" / "tuned.toml")
    assert saved.plan().warnings == ()
    assert all(one["conditions"] == "true" for one in history(tmp_path / "out"))
    assert any(float(one["moved"]) > 0.0 for one in history(tmp_path / "out"))


def test_nothing_that_breaks_them_is_flown(tmp_path, monkeypatch):
    flown = []
    original = CandidateFlyer.fly

    def noted(self, candidates, *more, **named):
        flown.extend(candidates)
        return original(self, candidates, *more, **named)

    monkeypatch.setattr(CandidateFlyer, "fly", noted)
    Search([ground(tmp_path, mission())], 150, 1, SILENT).run()
    assert len(flown) > 100
    assert all(gain > slope for slope, gain in map(slopes, flown))


def test_they_hold_for_every_vehicle_that_is_flown(tmp_path):
    there = ground(tmp_path, mission(vary=MASS))
    found = Search([there], 400, 1, SILENT).run()
    heaviest = max(there.draws(0, 4).drawn["vehicle.mass"].values)
    assert heaviest > 1.0
    for one in found.history:
        slope, gain = slopes(one.values)
        assert gain > heaviest * slope
    there = ground(tmp_path, mission(vary=MASS).replace('type = "backstepping"', 'type = "backstepping"\nmass = 1.0'))
    conditions = there.conditions()  # those of the mass that flies, though the controller assumes another
    steep = {"controller.Lambda1.0": 1.9, "controller.K_r1.0": 2.0}
    assert steep["controller.K_r1.0"] < heaviest * steep["controller.Lambda1.0"]
    assert conditions.broken(steep) and not conditions.hold([0.5, 1.0])


def test_present_gains_that_break_them_are_replaced_though_they_fly_better(tmp_path):
    text = PAPER.replace("K_r1 = [3.0, 3.0, 3.0]", "K_r1 = [1.0, 1.0, 1.0]\nLambda1 = [1.787, 1.787, 1.787]")
    text = mission(text=text).replace("high = 3.2", "high = 1.0")
    found = Search([ground(tmp_path, text)], 100, 1, SILENT).run()
    assert found.present.moved == math.inf
    assert found.present.judged.cost < found.best.judged.cost
    slope, gain = slopes(found.best.values)
    assert gain > slope


def test_a_point_is_moved_no_farther_than_needed(tmp_path):
    conditions = ground(tmp_path, mission()).conditions()
    anchor = conditions.anchor([0.2, 0.8], 1)
    assert anchor == [0.2, 0.8]
    random = np.random.default_rng(3)
    moved = 0
    for point in random.random((100, 2)).tolist():
        there = conditions.moved(point, anchor)
        assert conditions.hold(there)
        if conditions.hold(point):
            assert there == point
            continue
        moved += 1
        share = math.dist(anchor, there) / math.dist(anchor, point)
        beyond = [a + min(1.0, share + 1e-4) * (b - a) for a, b in zip(anchor, point, strict=True)]
        assert not conditions.hold(beyond)
    assert moved > 20


def test_ranges_in_which_they_cannot_hold_are_refused(tmp_path):
    text = mission(text=PAPER.replace("K_r1 = [3.0, 3.0, 3.0]", "K_r1 = [0.6, 0.6, 0.6]"))
    text = text.replace("low = 0.3", "low = 1.0").replace("high = 3.2", "high = 0.9")
    with pytest.raises(UserError, match=r"no gains in these ranges .* Theorem 5.1.*theorem = false"):
        run.tune(written(tmp_path, text), 500, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_controller_without_conditions_flies_what_is_asked(tmp_path):
    text = PAPER.replace('type = "backstepping"\nK_r1 = [3.0, 3.0, 3.0] # keep', 'type = "nested-saturation"')
    text += "[tune]\n[tune.gains]\ncontroller.a_z.0 = { low = 1.0, high = 9.0 }\n"
    done = run.tune(written(tmp_path, text), 60, tmp_path / "out")
    assert all(one.moved == 0.0 for one in done.found.history)
    assert read_request(tmp_path / "out" / "tuned.toml").content == tuned(tmp_path / "out")
