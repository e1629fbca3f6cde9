"""Tuning with equal budgets: one cost for all, and searches that resume where they stopped."""

import json
import math

import pytest

from quadstep.comparison import training
from quadstep.comparison.training import Journal, over_all, read_lines, train
from quadstep.mission.check import check
from quadstep.mission.tune import TuneSection
from quadstep.tuning.judge import Judge, Judged
from tests.studies import SMALL, TUNING, study

VEHICLE = "research-2.6kg"
JUDGE = Judge(check(TuneSection, {"gains": {"controller.k_x": {}}}, "m.toml"), 10.0)


def judged(objective, lost=0):
    cost = objective / (1.0 + objective) if math.isfinite(objective) else 1.0
    return Judged(objective, {"position_rmse": objective}, lost, 0.0, cost + (2.0 + 1.5 * lost if lost else 0.0))


def test_the_objective_is_the_mean_over_situations_in_a_unit_that_no_controller_decides():
    found = over_all([judged(0.1), judged(0.3)], [JUDGE, JUDGE])
    assert found.objective == pytest.approx(0.2)
    assert found.cost == pytest.approx(0.2 / 1.2)
    assert found.parts["position_rmse"] == pytest.approx(0.2)


def test_whoever_loses_a_flight_in_any_situation_is_worse_than_whoever_loses_none():
    careful = over_all([judged(5.0), judged(9.0)], [JUDGE, JUDGE])
    daring = over_all([judged(0.01), judged(0.01, lost=1)], [JUDGE, JUDGE])
    reckless = over_all([judged(0.01), judged(0.01, lost=2)], [JUDGE, JUDGE])
    assert careful.cost < daring.cost < reckless.cost
    assert (daring.lost, reckless.lost) == (1, 2)
    assert over_all([judged(math.nan, lost=64), judged(0.1)], [JUDGE, JUDGE]).cost > reckless.cost


def task():
    one = study(SMALL + TUNING)
    return training.task(one, VEHICLE, "PID", one.file.controllers["PID"], one.knowing(VEHICLE, {"type": "pid"}))


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    journal = tmp_path_factory.mktemp("journal") / "one.jsonl"
    return train(task(), journal), journal


def test_it_keeps_to_its_budget_and_to_its_ranges(trained):
    found, journal = trained
    assert found.flights <= 4500 < found.flights + 64 * 6 + 64
    assert (found.tuned, found.seeds) == (2, 64)
    assert found.objective <= found.objective_before
    assert all(1.0 <= found.values[f"controller.velocity.{axis}"] <= 20.0 for axis in range(3))
    assert found.values.keys() == {f"controller.{name}.{axis}" for name in ("position", "velocity") for axis in range(3)}
    assert read_lines(journal)[-1]["flights"] == found.flights


def test_a_search_that_was_stopped_goes_on_and_ends_as_if_nothing_had_been(trained, tmp_path, monkeypatch):
    found, journal = trained
    lines = journal.read_text(encoding="utf-8").splitlines(keepends=True)
    half = tmp_path / "half.jsonl"
    half.write_text("".join(lines[:5]) + lines[5][:40], encoding="utf-8")  # killed while it wrote
    flown, real = [], training.Ground.fly
    monkeypatch.setattr(training.Ground, "fly", lambda *given: flown.append(1) or real(*given))
    assert train(task(), half) == found
    assert len(flown) == len(lines) - 5
    assert half.read_text(encoding="utf-8") == journal.read_text(encoding="utf-8")


def test_a_journal_of_another_search_is_not_believed(trained, tmp_path):
    _, journal = trained
    first = json.loads(journal.read_text(encoding="utf-8").splitlines()[0])
    known = Journal(journal)
    assert known.taken([{"controller.k_x": 1.0}]) is None
    assert known.taken(first["values"]) == [Judged(*one) for one in first["judged"]]
    (tmp_path / "other.jsonl").write_text("nonsense\n[1, 2]\n", encoding="utf-8")
    assert read_lines(tmp_path / "other.jsonl") == []
    assert read_lines(tmp_path / "none.jsonl") == []


def test_what_decides_gains_is_all_in_their_digest():
    one = task()
    assert one.decisive == task().decisive
    for other in (one._replace(budget=4600), one._replace(seed=2), one._replace(missions=one.missions * 2)):
        assert other.decisive != one.decisive
