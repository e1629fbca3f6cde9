"""Pictures of a comparison: marks for a few controllers, a square each for many. Its headline."""

import math
import re

import pytest

from quadstep.control.cascaded_pid import CascadedPid
from quadstep.linear.grade import FRAGILE, NO_REST, SOUND, UNKNOWN, UNSTABLE
from quadstep.metrics.statistics import Estimate
from quadstep.metrics.verdict import FlightGrade, Graded, error_limit
from quadstep.report.sheet import SCREEN, USUAL, sheet
from quadstep.studies.comparison.answer import answer
from quadstep.studies.comparison.cells import Situation
from quadstep.studies.comparison.cost import Cost
from quadstep.studies.comparison.entrants import Comparison, Entrant, SituationResult
from quadstep.studies.comparison.picture import MANY, draw_vehicle, square_text
from quadstep.studies.comparison.ranking import Effort, Pair, Ranked, Spread
from quadstep.studies.comparison.report import facts
from quadstep.studies.comparison.robustness import Linear, rows, unlinearised
from quadstep.studies.comparison.run import large_errors
from quadstep.studies.comparison.tables import best, cell_rows, matrix
from quadstep.studies.comparison.training import Trained
from quadstep.studies.comparison.words import common, limit, missed_limits, of_all, of_situation, prices

WHERE = Situation("crazyflie", "hover", "calm")


def result(name, median, lost=0.0):
    estimate = Estimate(median, math.nan, math.nan)
    return SituationResult(
        WHERE, name, 500, Estimate(lost, 0.0, 1.0), {"e": Spread(median, estimate, estimate)}, Effort(0.0, 0.0, 0.0)
    )


def comparison(count):
    results = tuple(result(f"law {i}", 0.01 * (i + 1) if i < count - 1 else math.inf, lost=i / count) for i in range(count))
    ranked = Ranked({one.controller: float(i) for i, one in enumerate(results)}, 0.0, ())
    return Comparison("x", "x.toml", 500, 1, {"e": "e[m]"}, (WHERE,), results, {WHERE: ranked}, (), {}, {}, {}, ())


def lead(found):
    """Without the number of its rank."""
    return re.sub(r", -?\d\.\d\d from 0 \(always first\) to 1 \(always last\)", "", " ".join(of_all(found)))


@pytest.mark.parametrize("count", [2, MANY + 1])
def test_any_number_of_controllers_can_be_drawn(tmp_path, count):
    draw_vehicle(tmp_path / "one", comparison(count), "crazyflie", sheet(USUAL, None, SCREEN))
    assert (tmp_path / "one.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("median", "lost", "words"),
    [(0.0123, 0.0, "12.3"), (0.0123, 0.044, "12.3\n4.4 % lost"), (0.5, 0.999, "500\n99.90 % lost"), (math.inf, 1.0, "lost")],
)
def test_a_square_says_the_median_and_what_is_lost(median, lost, words):
    assert square_text(result("law", median, lost), "e", 1000.0) == words


@pytest.mark.parametrize(("grades", "words"), [
    ((SOUND, FRAGILE), "On second at rest where the path begins, the loop of law 0 is fragile: why 1"),
    ((UNSTABLE, FRAGILE), "On first at rest where the path begins, the loop of law 0 is unstable: why 0"),
    ((SOUND, UNKNOWN), "On second at rest where the path begins, the loop of law 0 is not linearised: why 1"),
    ((SOUND, NO_REST), "On second no rest was found for the loop of law 0: why 1"),
    ((SOUND, SOUND), "On first at rest where the path begins, the loop of law 0 is sound: why 0"),
])  # fmt: skip
def test_the_headline_names_the_winner_with_the_worst_grade_of_its_loops(grades, words):
    vehicles = "first", "second"
    margins = {"phase_margin": 0.5}
    loops = [Linear(word, f"why {i}", [word], {} if word in (UNKNOWN, NO_REST) else margins) for i, word in enumerate(grades)]
    found = comparison(2)._replace(linear=dict(zip([(one, "law 0") for one in vehicles], loops, strict=True)))
    (situation, ranked) = next(iter(found.ranked.items()))
    second = situation._replace(path="circle")
    everywhere = (*found.results, *(one._replace(situation=second) for one in found.results))
    twice = found._replace(ranked={situation: ranked, second: ranked}, results=everywhere)
    assert lead(twice).startswith(
        f"law 0 has the best mean rank. {words}. In flight its rotor activity is 0 N/s on average. 2 controllers"
    )
    lost = [one._replace(lost=Estimate(0.044, 0.01, 0.1)) for one in found.results]
    lossy = twice._replace(results=(*lost, *everywhere[len(lost) :]))
    assert lead(lossy).startswith(
        f"law 0 has the best mean rank, though it loses flights in 1 of 2 situations, up to 4.4 % of them. {words}"
    )
    assert of_situation(lossy, situation, ranked).startswith(
        "hover, calm: law 0, though it loses 4.4 % of its flights, has the smallest median"
    )
    filtered = twice._replace(linear={key: one._replace(estimator=True) for key, one in twice.linear.items()})
    assert "the loop of law 0 without the estimator" in lead(filtered)
    assert "at rest" not in of_situation(found, situation, ranked)  # on another vehicle
    assert [row[2] for row in rows(found.linear)] == list(grades)
    assert len(unlinearised(found.linear)) == (not all(one.metrics for one in loops))


def test_nobody_wins_what_is_shared_and_who_flew_elsewhere_only_is_said_so():
    found = comparison(3)
    second = WHERE._replace(path="circle")
    same = found._replace(results=tuple(result(name, 0.01) for name in found.controllers))
    ranked = Ranked(dict.fromkeys(found.controllers, 2.0), 1.0, ())
    everywhere = (*same.results, *(one._replace(situation=second) for one in same.results))
    twice = same._replace(ranked={WHERE: ranked, second: ranked}, results=everywhere)
    shared = "law 0, law 1 and law 2 share the best mean rank, 0.50 from 0 (always first) to 1 (always last). 3 controllers"
    assert " ".join(of_all(twice)).startswith(shared)
    assert of_situation(twice, WHERE, ranked).startswith(
        "hover, calm: law 0, law 1 and law 2 share the smallest median e, 10.0 mm"
    )
    assert best(same, WHERE) == found.controllers
    assert best(found, WHERE) == ["law 0"]
    assert best(found._replace(results=tuple(result(name, math.inf, 1.0) for name in found.controllers)), WHERE) == []
    once = {WHERE: found.ranked[WHERE], second: Ranked({"law 1": 1.0, "law 2": 2.0}, 1.0, ())}
    elsewhere = found._replace(ranked=once)
    assert lead(elsewhere).startswith("law 0 has the best mean rank over the 1 of 2 situations that it flew. 3 controllers")


FAR = Graded(FlightGrade.FLEW_BUT, ("its error is large for its path",), ("large error",))
AS_ASKED = Graded(FlightGrade.AS_ASKED)


def test_a_winner_that_does_not_fly_as_asked_is_said_not_to_in_the_sentence_that_names_it():
    found, second = comparison(2), WHERE._replace(path="circle")
    ranked = found.ranked[WHERE]

    def all_of(*grades):
        names = [(where, name) for where in (WHERE, second) for name in found.controllers]
        results = tuple(
            result(name, 0.01 + 0.01 * (name != "law 0"))._replace(situation=where, grade=grade)
            for (where, name), grade in zip(names, grades, strict=True)
        )
        return found._replace(situations=(WHERE, second), ranked={WHERE: ranked, second: ranked}, results=results)

    one = all_of(AS_ASKED, FAR, FAR, AS_ASKED)
    assert lead(one).startswith(
        "law 0 has the best mean rank; its median flight misses the grade in 1 of 2 situations, worst in "
        "circle: its error is large for its path. "
    )
    assert ", but" not in of_situation(one, WHERE, ranked)
    assert of_situation(one, second, ranked).startswith("circle: law 0 has the smallest median e, 10.0 mm (500 ")
    assert ", but in its median flight, its error is large for its path" in of_situation(one, second, ranked)
    lost = Graded(FlightGrade.LOST)
    none = all_of(FAR, FAR, FAR, lost)
    assert answer(none).startswith("No controller flies as asked in any situation: In hover")
    assert "law 0 has the smallest median e (10.0 mm, though no controller flies as asked: large error), but is not" in answer(
        none
    )
    assert of_situation(none, WHERE, ranked).startswith("hover: law 0 has the smallest ")
    gone = "; its median flight is lost in 1 and misses the grade in 1 of 2 situations, worst of those it completes in "
    assert gone in lead(all_of(FAR, AS_ASKED, lost, AS_ASKED))
    gone = "law 0 has the best mean rank; its median flight is lost in 1 of 2 situations. "
    assert lead(all_of(AS_ASKED, AS_ASKED, lost, AS_ASKED)).startswith(gone)
    unknown = all_of(FAR, None, FAR, None)  # the other is an autopilot, whose flights are not flown again
    assert lead(unknown).startswith("law 0 has the best mean rank; its median flight misses the grade in 2 of 2 situations")
    assert facts(unknown)[1][:2] == ("median flights as asked", "0 of 2")
    header, (first, _) = matrix(none, "crazyflie")
    assert dict(zip(header, first, strict=True))["law 0"] == "10.0 (10.0), large error"
    assert [(row["grade"], row["grade_reasons"]) for row in cell_rows(one)][:2] == [
        ("as asked", ""),
        ("flew, but", "its error is large for its path"),
    ]
    assert facts(one)[1] == (
        "median flights as asked",
        "2 of 4",
        "one of each controller in each situation",
        False,
    )


NOT_SHOWN = (
    "In hover, law 0 has the smallest median e (10.0 mm), but is not shown to be better{} than law 1 (10.0 mm). In circle, "
)


@pytest.mark.parametrize(("difference", "p", "said", "differs", "better"), [
    (-1e-3, 0.001, "law 0 is best in hover (median e 10.0 mm) and in circle (10.0 mm).",
        "in 2 of 2 pairs over 2 situations, the", "significantly better than law 1."),
    (-1e-6, 0.001, NOT_SHOWN.format(" by 0.1 % or more"),
        "in 2 of 2 pairs over 2 situations (in 2 of these by less than 0.1 %), the", "law 1 (by less than 0.1 %)."),
    (-1e-3, 0.4, NOT_SHOWN.format(""), "in 0 of 2 pairs over 2 situations, the", "not significantly"),
])  # fmt: skip
def test_who_leads_by_chance_or_hardly_at_all_is_not_said_to_be_best(difference, p, said, differs, better):
    second = WHERE._replace(path="circle")
    pair = Pair("law 0", "law 1", Estimate(difference, -1.0, 1.0), 1.0, -1.0, p, 0.0, 1.0)
    ranked = Ranked({"law 0": 1.0, "law 1": 2.0}, 0.0, (pair,))
    results = tuple(result(name, 0.01)._replace(situation=where) for where in (WHERE, second) for name in ranked.ranks)
    found = comparison(2)._replace(results=results, ranked={WHERE: ranked, second: ranked})
    assert answer(found).startswith(said)
    assert f"Tracking differs significantly {differs} number of lost flights in none." in lead(found)
    assert better in of_situation(found, WHERE, ranked)


@pytest.mark.parametrize(("effect", "lost", "said"), [
    (-1.0, 0.0, "law 0 is best (median e 10.0 mm, next law 1 with the same, but flight by flight worse)."),
    (1.0, 0.0, "law 0 has the smallest median e (10.0 mm, next law 1 with the same), but flight by flight is worse than "
        "law 1."),
    (-1.0, 0.2, "law 0 has the smallest median e (10.0 mm, next law 1 with the same, but flight by flight worse), but "
        "certainly loses more flights than law 1."),
])  # fmt: skip
def test_the_smallest_median_is_not_best_where_another_wins_flight_by_flight_or_loses_fewer(effect, lost, said):
    pair = Pair("law 0", "law 1", Estimate(0.01 * effect, -1.0, 1.0), 1.0, effect, 0.001, lost, 0.001)
    ranked = {WHERE: Ranked({"law 0": 1.0, "law 1": 2.0}, 0.0, (pair,))}
    found = comparison(2)._replace(results=tuple(result(f"law {i}", 0.01) for i in range(2)), ranked=ranked)
    assert answer(found) == said
    apart = found._replace(results=tuple(result(f"law {i}", 0.01 + 1e-6 * i) for i in range(2)))
    assert "10.000 mm, next law 1 with 10.001 mm" in answer(apart)
    assert of_situation(apart, WHERE, ranked[WHERE]) == "500 flights are too few for an interval of the median."
    alike = Ranked({"law 0": 1.5, "law 1": 1.5}, 1.0, (), copies=True)
    assert answer(found._replace(ranked={WHERE: alike})) == "law 0 and law 1 share the smallest e (10.0 mm)."


@pytest.mark.parametrize(("violation", "unconstrained", "said"), [
    (0.0, "", []),
    (0.1, "", ["law on crazyflie: no gains were found that meet every limit (tuning.constraints)."]),
    (0.0, "no rest", ["law on crazyflie: tuned without limits on its margins: no rest."]),
])  # fmt: skip
def test_gains_that_miss_a_limit_are_named(violation, unconstrained, said):
    found = Trained({}, {}, None, 16, 2000, 16, 3, violation=violation, unconstrained=unconstrained)
    entrant = Entrant("crazyflie", "law", {}, "tuned", CascadedPid, found)
    assert missed_limits(comparison(2)._replace(entrants=(entrant,))) == said


def test_of_many_situations_the_answer_counts_in_how_many_each_is_best():
    pair = Pair("law 0", "law 1", Estimate(-0.01, -0.02, -0.005), 1.0, -1.0, 0.001, 0.0, 1.0)
    ranked = {
        WHERE._replace(path=f"path {i}"): Ranked(
            {"law 0": 1.0, "law 1": 2.0}, 0.0, (pair._replace(p=0.4 if i > 2 else 0.001),)
        )
        for i in range(6)
    }
    results = tuple(result(f"law {i}", 0.01 * (i + 1))._replace(situation=where) for where in ranked for i in range(2))
    found = comparison(2)._replace(results=results, ranked=ranked)
    said = "law 0 is shown to be best in 3 of 6 situations. In 3, no controller is shown to be better than all others."
    assert answer(found) == said
    lossy = [one._replace(lost=Estimate(0.3, 0.1, 0.5)) if one.controller == "law 1" else one for one in results]
    two = found._replace(results=tuple(lossy), ranked=dict(list(ranked.items())[:2]))
    assert answer(two) == (
        "law 0 is best in 'path 0' (median e 10.0 mm, while law 1 loses 30 % of its flights) and in 'path 1' (10.0 mm, while "
        "law 1 loses 30 % of its flights)."
    )


@pytest.mark.parametrize("alike", [False, True])
def test_the_axis_says_that_it_is_logarithmic_and_names_an_interval_only_where_flights_differ(tmp_path, alike):
    found = comparison(3)
    found = found._replace(ranked={WHERE: found.ranked[WHERE]._replace(copies=alike)})
    draw_vehicle(tmp_path / "one", found, "crazyflie", sheet("svg", None, SCREEN))
    text = " ".join(re.findall(r">([^<>]+)</text>", (tmp_path / "one.svg").read_text(encoding="utf-8")))
    assert "e [mm], logarithmic scale" in text and ("interval" in text) == (not alike)


def test_where_errors_are_large_is_drawn_and_said_where_all_flights_agree_on_it(tmp_path):
    second = WHERE._replace(scenario="wind")
    known = [(WHERE, 0.103), (WHERE, 0.1030001), (second, 0.1), (second, 0.2)]
    assert large_errors(known) == {WHERE: 0.103}, "the grades of the second have other measures"
    assert large_errors([(WHERE, 0.1), (WHERE, 0.0)]) == large_errors(known[:1]) == {}
    assert error_limit({"position_rmse[m]": 0.305, "relative_error": 0.296}) == pytest.approx(0.1030, rel=1e-3)
    one = comparison(3)
    metrics = {"position_rmse": "position_rmse[m]", "e": "e[m]"}
    results = [each._replace(spreads={"position_rmse": each.spreads["e"], "e": each.spreads["e"]}) for each in one.results]
    found = one._replace(metrics=metrics, results=tuple(results), limits={WHERE: 0.0123})
    draw_vehicle(tmp_path / "one", found, "crazyflie", sheet("svg", None, SCREEN))
    text = (tmp_path / "one.svg").read_text(encoding="utf-8")
    assert text.count(">large above 12.3 mm<") == 1, "of two panels, that of the error that is graded"
    assert [text.count(f">{name}<") for name in found.controllers] == [2, 2, 2], "each row by its name"
    assert limit(found, "crazyflie") == " Errors are large above 12.3 mm."
    assert limit(found._replace(limits={}), "crazyflie") == ""


def test_what_is_the_same_in_all_situations_stands_in_no_row():
    second, other = WHERE._replace(scenario="wind"), WHERE._replace(vehicle="x500", path="circle")
    found = comparison(2)._replace(situations=(WHERE, second))
    assert [found.place(one) for one in found.situations] == ["calm", "wind"] and common(found) == ["hover"]
    assert found._replace(situations=(WHERE, other)).place(other) == "circle"
    rows = [["crazyflie", "a", "1"], ["crazyflie", "b", "2"]]
    assert found.table(("vehicle", "controller", "n"), rows) == (["controller", "n"], [["a", "1"], ["b", "2"]])
    assert found.table(("vehicle", "controller"), [["crazyflie", "a"], ["x500", "a"]])[0] == ["vehicle", "controller"]


def test_the_cost_of_laws_is_told_as_a_sentence():
    costs = {("crazyflie", name): Cost(1.0, 8, 8, many) for name, many in (("PID", 801), ("adaptive", 3859), ("LQR", 608))}
    (said,) = prices(comparison(2)._replace(costs=costs))
    assert said.endswith(": LQR 608, PID 801 and adaptive 3,859: adaptive takes 6.3 times as many as LQR.")
    costs["crazyflie", "LQR"] = Cost(1.0, 8, 8)
    assert prices(comparison(2)._replace(costs=costs)) == []
