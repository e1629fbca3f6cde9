"""Tuning with equal budgets: one cost for all, and searches that resume where they stopped."""

import math

import pytest

from quadstep.io.documents import parse_json
from quadstep.io.errors import UserError
from quadstep.mission.check import check
from quadstep.mission.read import check_mission
from quadstep.mission.tune import TuneSection
from quadstep.studies.comparison import jobs, training
from quadstep.studies.comparison.entrants import trained_of
from quadstep.studies.comparison.training import Journal, JournalPlace, over_all, read_lines, train
from quadstep.studies.tuning.ground import sound
from quadstep.studies.tuning.objective import Judge, Judged
from quadstep.studies.tuning.trial import Tried
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
    journal = JournalPlace(tmp_path_factory.mktemp("journal"), "one.jsonl")
    return train(task(), journal), journal


def test_it_keeps_to_its_budget_and_to_its_ranges(trained):
    found, journal = trained
    assert found.flights <= 4500 < found.flights + 64 * 6 + 64
    assert (found.tuned, found.seeds) == (2, 64)
    flown = [pair for line in read_lines(journal) for pair in zip(line["values"], line["tried"], strict=True)]
    assert found.objective <= max(one.judged.objective for values, one in flown if values == found.before)
    assert all(1.0 <= found.values[f"controller.velocity.{axis}"] <= 20.0 for axis in range(3))
    assert found.values.keys() == {f"controller.{name}.{axis}" for name in ("position", "velocity") for axis in range(3)}
    assert read_lines(journal)[-1]["flights"] == found.flights


def test_gains_with_which_no_flight_survives_are_kept_with_their_margins_and_read_again(limited):
    hopeless = tuple({**one, "limits": {"distance": 1e-9}} for one in limited.missions)
    kept = jobs.search(limited._replace(missions=hopeless), None)
    found = trained_of(parse_json(kept.content, "gains"))
    assert found.objective is None
    assert found.lost == 64
    assert min([found, found._replace(objective=1.0)], key=lambda one: one.order).objective == 1.0
    stability = training.stability(limited)
    assert found.margins == pytest.approx(stability.margins(found.values))
    assert found.violation == pytest.approx(stability.missed(found.margins))


def test_a_search_that_was_stopped_goes_on_and_ends_as_if_nothing_had_been(trained, tmp_path, monkeypatch):
    found, journal = trained
    lines = journal.path.read_text(encoding="utf-8").splitlines(keepends=True)
    half = JournalPlace(tmp_path, "half.jsonl")
    half.path.write_text("".join(lines[:5]) + lines[5][:40], encoding="utf-8")  # killed while it wrote
    flown, real = [], training.CandidateFlyer.fly
    monkeypatch.setattr(training.CandidateFlyer, "fly", lambda *given: flown.append(1) or real(*given))
    assert train(task(), half) == found
    assert len(flown) == 2 * (len(lines) - 5), "the first flights of a generation, and the others"
    assert half.path.read_text(encoding="utf-8") == journal.path.read_text(encoding="utf-8")


def test_a_journal_of_another_search_is_not_used(trained):
    _, journal = trained
    first, known = read_lines(journal)[0], Journal(journal)
    assert known.next_generation([{"controller.k_x": 1.0}]) is None
    assert known.next_generation(first["values"]) == first
    assert all(isinstance(one, Tried) for one in first["tried"])


def test_a_changed_journal_is_refused(trained, tmp_path):
    whole = b"".join(trained[1].path.read_bytes().splitlines(keepends=True)[:5])
    for place in range(0, len(whole), 64):
        content = bytearray(whole)
        content[place] ^= 1
        (tmp_path / "one.jsonl").write_bytes(content)
        with pytest.raises(UserError, match=r"one\.jsonl: was changed"):
            read_lines(JournalPlace(tmp_path, "one.jsonl"))


def test_no_journal_has_no_lines(tmp_path):
    assert read_lines(JournalPlace(tmp_path, "none.jsonl")) == []
    assert read_lines(JournalPlace(tmp_path / "none", "none.jsonl")) == []
    (tmp_path / "half.jsonl").write_text("cut sho", encoding="utf-8")
    assert read_lines(JournalPlace(tmp_path, "half.jsonl")) == []


@pytest.fixture(scope="module")
def limited():
    """The same task with the margins that a study asks for by default."""
    one = study(SMALL + TUNING.replace("constraints = {}\n", ""))
    return training.task(one, VEHICLE, "PID", one.file.controllers["PID"], one.knowing(VEHICLE, {"type": "pid"}))


def test_tuned_gains_must_leave_six_decibels_and_thirty_degrees_by_default(limited):
    assert {name: one.least for name, one in limited.margins.items()} == pytest.approx(
        {"gain_margin_up": 6.0, "gain_margin_down": 6.0, "phase_margin": math.pi / 6.0}
    )  # this mission has no latency
    one = study(SMALL + TUNING.replace("constraints = {}", "constraints = { largest_error = 1.0 }"))
    errors = training.task(one, VEHICLE, "PID", one.file.controllers["PID"], one.knowing(VEHICLE, {"type": "pid"}))
    assert errors.margins == limited.margins
    late = sound(check_mission({**limited.rest, "sensors": {"latency": 0.02}}, "m.toml", limited.folder))
    assert late["delay_margin"].least == pytest.approx(0.04)
    assert limited.decisive != task().decisive
    stability = training.stability(limited)
    gains = {f"controller.{name}.{axis}": value for name, value in (("position", 1.0), ("velocity", 3.0)) for axis in range(3)}
    margins = stability.margins(gains)
    stiff = stability.margins({key: 6.0 * value for key, value in gains.items()})
    assert stability.missed(margins) < stability.missed(stiff)
    missed = {name: max(0.0, 1.0 - margins[name] / limit.least) for name, limit in limited.margins.items()}
    assert stability.missed(margins) == pytest.approx(sum(missed.values()))


def test_a_loop_that_cannot_be_linearised_is_tuned_without_margins_and_says_why(limited, monkeypatch):
    def refused(*_):
        raise UserError(f"{limited.source}: no rest")

    monkeypatch.setattr(training, "margin_metrics", refused)
    search = training.Training(training.grounds(limited), limited, Journal(None))
    assert (search.unconstrained, search.stability.limits) == ("no rest", {})


def test_searches_are_repeated_with_seeds_of_their_own():
    one = study(SMALL + TUNING)
    many = [
        training.task(one, VEHICLE, "PID", one.file.controllers["PID"], one.knowing(VEHICLE, {"type": "pid"}), repeat)
        for repeat in range(3)
    ]
    assert [each.seed for each in many] == [1, 2, 3]
    assert len({repr(each.decisive) for each in many}) == 3


def test_the_best_search_comes_first_and_one_that_misses_its_margins_last():
    found = [
        training.Trained({}, {}, objective, lost, 1, 1, 1, violation=violation)
        for objective, lost, violation in ((0.1, 0, 0.3), (0.3, 0, 0.0), (0.2, 1, 0.0), (0.2, 0, 0.0))
    ]
    assert [one.objective for one in sorted(found, key=lambda one: one.order)] == [0.2, 0.3, 0.2, 0.1]


def test_what_decides_gains_is_all_in_their_digest():
    one = task()
    assert one.decisive == task().decisive
    for other in (one._replace(budget=4600), one._replace(seed=2), one._replace(missions=one.missions * 2)):
        assert other.decisive != one.decisive
