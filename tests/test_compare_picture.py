"""Pictures of a comparison: marks for a few controllers, a square each for many. Its headline."""

import math
import re
from itertools import combinations

import pytest

from quadstep.control.cascaded_pid import CascadedPid
from quadstep.linear.grade import FRAGILE, NO_REST, SOUND, UNKNOWN, UNSTABLE
from quadstep.metrics.registry import HELD
from quadstep.metrics.statistics import Estimate
from quadstep.metrics.verdict import FlightGrade, Graded, error_limit
from quadstep.report.colours import CURVES
from quadstep.report.sheet import SCREEN, USUAL, sheet
from quadstep.studies.comparison.answer import answer, decisions, leaders, warned
from quadstep.studies.comparison.cells import Situation
from quadstep.studies.comparison.entrants import Comparison, Entrant, SituationResult
from quadstep.studies.comparison.picture import MANY, draw_vehicle, square_text
from quadstep.studies.comparison.ranking import Effort, Pair, Ranked, Spread
from quadstep.studies.comparison.report import facts, medians
from quadstep.studies.comparison.robustness import Linear, rows, unlinearised
from quadstep.studies.comparison.tables import cell_rows, latex_tables, marks, matrix
from quadstep.studies.comparison.training import Trained
from quadstep.studies.comparison.words import activity, advice, large_errors, limit, missed_limits, unsound

WHERE = Situation("crazyflie", "hover", "calm")


def result(name, median, lost=0.0):
    estimate = Estimate(median, math.nan, math.nan)
    return SituationResult(
        WHERE, name, 500, Estimate(lost, 0.0, 1.0), {"e": Spread(median, estimate, estimate)}, Effort(0.0, 0.0, 0.0)
    )


def comparison(count):
    results = tuple(result(f"law {i}", 0.01 * (i + 1) if i < count - 1 else math.inf, lost=i / count) for i in range(count))
    return Comparison("x", "x.toml", 500, 1, {"e": "e[m]"}, results, {WHERE: ordered([one.controller for one in results])})


def ordered(names, p=0.001, **more):
    """Each better than those after it."""
    gap = Estimate(-0.01, -0.02, -0.005)
    pairs = [Pair(*both, gap, 1.0, -1.0, p, 0.0, 1.0)._replace(**more) for both in combinations(names, 2)]
    return Ranked(tuple(pairs))


def elsewhere(found, **more):
    """The same in a second situation."""
    second = WHERE._replace(path="circle")
    results = (*found.results, *(one._replace(situation=second) for one in found.results))
    return found._replace(ranked={WHERE: found.ranked[WHERE], second: found.ranked[WHERE]}, results=results, **more)


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
    ((SOUND, FRAGILE), "On second, hovering at the start of its path, the loop of law 0 is fragile: why 1"),
    ((UNSTABLE, FRAGILE), "On first, hovering at the start of its path, the loop of law 0 is unstable: why 0"),
    ((SOUND, UNKNOWN), "On second, hovering at the start of its path, the loop of law 0 is not linearised: why 1"),
    ((SOUND, NO_REST), "On second, no rest was found for the loop of law 0: why 1"),
    ((SOUND, SOUND), "On first, hovering at the start of its path, the loop of law 0 is sound: why 0"),
])  # fmt: skip
def test_the_headline_names_the_winner_with_the_worst_grade_of_its_loops(grades, words):
    vehicles = "first", "second"
    margins = {"phase_margin": 0.5}
    loops = [Linear(word, f"why {i}", [word], {} if word in (UNKNOWN, NO_REST) else margins) for i, word in enumerate(grades)]
    found = comparison(2)._replace(linear=dict(zip([(one, "law 0") for one in vehicles], loops, strict=True)))
    twice = elsewhere(found)
    assert unsound(twice) == [] if words.endswith("why 0") and grades[0] == SOUND else [f"{words}."]
    lost = [one._replace(lost=Estimate(0.044, 0.01, 0.1)) for one in found.results]
    lossy = twice._replace(results=(*lost, *twice.results[len(lost) :]))
    assert warned(lossy) == ["Lost flights: law 0 4.4 % in hover."]
    filtered = twice._replace(linear={key: one._replace(estimator=True) for key, one in twice.linear.items()})
    assert all("the loop of law 0 without the estimator" in one for one in unsound(filtered))
    assert [row[2] for row in rows(found.linear)] == list(grades)
    assert len(unlinearised(found.linear)) == (not all(one.metrics for one in loops))


def test_nobody_is_best_where_nothing_tells_them_apart():
    found = comparison(3)
    same = found._replace(results=tuple(result(name, 0.01) for name in found.controllers))
    even = ordered(found.controllers, p=1.0, effect=0.0, difference=Estimate(0.0, -0.001, 0.001))
    tied = same._replace(ranked={WHERE: even})
    assert answer(tied) == "law 0, law 1 and law 2 are tied for best by e."
    shown = "0 [−1.00, 1.00] mm", "500 flights do not tell them apart"
    assert decisions(tied) == [["", f"law 0, law {i}", *shown] for i in (1, 2)]
    assert answer(elsewhere(tied)) == "By e, law 0, law 1 and law 2 are tied for best in both situations."
    assert advice(elsewhere(tied))[0].startswith("Next: choose among them by what else matters")
    assert leaders(tied, WHERE) == found.controllers and latex_tables(tied).count("textbf{") == 3
    assert leaders(found, WHERE) == ["law 0"] and latex_tables(found).count("textbf{") == 1
    lost = found._replace(results=tuple(result(name, math.inf, 1.0) for name in found.controllers))
    assert leaders(lost, WHERE) == []
    assert answer(lost) == "Every mission loses at least half of its flights.".replace("mission", lost.kind)
    once = elsewhere(found)
    (_, second) = once.ranked
    other = once._replace(
        ranked={WHERE: found.ranked[WHERE], second: ordered(["law 1", "law 2"])},
        results=tuple(one for one in once.results if one.situation == WHERE or one.controller != "law 0"),
    )
    assert answer(other) == "By e, law 0 is best in hover, law 1 in circle."
    assert advice(other) == []


def test_what_it_takes_is_compared_where_all_fly():
    found = elsewhere(comparison(2))
    efforts = {"law 0": 20.0, "law 1": 5.0}
    results = [one._replace(effort=Effort(0.0, efforts[one.controller], 0.0)) for one in found.results]
    assert activity(found._replace(results=tuple(results)), "crazyflie") == efforts
    results[3] = results[3]._replace(effort=Effort(0.0, math.nan, 0.0))
    assert activity(found._replace(results=tuple(results)), "crazyflie") == efforts
    idle = tuple(one._replace(effort=Effort(0.0, math.nan, 0.0)) for one in results)
    assert activity(found._replace(results=idle), "crazyflie") == {}


FAR = Graded(FlightGrade.FLEW_BUT, ("its error is large for its path",), ("large error",))
AS_COMMANDED = Graded(FlightGrade.AS_COMMANDED)


def test_a_winner_that_does_not_fly_as_commanded_is_said_not_to_in_the_sentence_that_names_it():
    found, second = comparison(2), WHERE._replace(path="circle")

    def all_of(*grades):
        names = [(where, name) for where in (WHERE, second) for name in found.controllers]
        results = tuple(
            result(name, 0.01 + 0.01 * (name != "law 0"))._replace(situation=where, grade=grade)
            for (where, name), grade in zip(names, grades, strict=True)
        )
        return elsewhere(found)._replace(results=results)

    one = all_of(AS_COMMANDED, FAR, FAR, AS_COMMANDED)
    assert warned(one) == ["Not as commanded: law 0 in circle (large error)."]
    nobody = all_of(AS_COMMANDED, FAR, FAR, FAR)  # law 0 leads, but in circle no other flies as commanded either
    assert warned(nobody) == ["No controller flies as commanded in circle."]
    none = all_of(FAR, FAR, FAR, Graded(FlightGrade.LOST))
    assert answer(none) == "No controller flies as commanded in any situation: by e, law 0 is best in both situations."
    assert advice(none) == ["Next: better gains (`quadstep tune`), as no median flight of law 0 is as commanded."]
    unknown = all_of(FAR, None, FAR, None)  # the other is an autopilot, whose flights are not flown again
    assert not answer(unknown).startswith("No controller flies")
    assert facts(unknown)[0][:2] == ("median flights not as commanded", "2 of 2")
    header, (first, _) = matrix(none, "crazyflie")
    assert dict(zip(header, first, strict=True))["law 0"] == "10.0 (10.0) !"
    assert marks(none, "crazyflie") == " !: the median flight is not as commanded (large error)."
    assert marks(all_of(AS_COMMANDED, AS_COMMANDED, AS_COMMANDED, AS_COMMANDED), "crazyflie") == ""
    assert [(row["grade"], row["grade_reasons"]) for row in cell_rows(one)][:2] == [
        ("as commanded", ""),
        ("flew, but", "its error is large for its path"),
    ]
    assert facts(one)[0][:3] == ("median flights not as commanded", "2 of 4", "large error")


BOTH = "law 0 and law 1 are tied for best"


@pytest.mark.parametrize(("difference", "p", "who", "said"), [
    (-1e-3, 0.001, "law 0 is best", "law 0 is better"),
    (-1e-6, 0.001, BOTH, "law 0 is better by less than 0.1 %"),
    (-1e-3, 0.4, BOTH, "500 flights do not tell them apart"),
])  # fmt: skip
def test_who_leads_by_chance_or_hardly_at_all_is_not_said_to_be_best(difference, p, who, said):
    even = tuple(result(f"law {i}", 0.01) for i in range(2))
    ranked = {WHERE: ordered(["law 0", "law 1"], p, difference=Estimate(difference, -2e-3, 1e-3))}
    found = elsewhere(comparison(2)._replace(results=even, ranked=ranked))
    assert answer(found) == f"By e, {who} in both situations."
    assert [one[-1] for one in decisions(found)] == [said] * 2


@pytest.mark.parametrize(("effect", "lost", "said"), [
    (-1.0, 0.0, "law 0 is best (median e 10.000 mm), next law 1 (10.001 mm)."),
    (1.0, 0.0, "law 1 is better flight by flight, but its median is not smaller"),
    (-1.0, 0.2, "law 0 tracks better, but law 1 loses fewer flights"),
    (0.0, 0.2, "law 1 loses fewer flights"),
])  # fmt: skip
def test_the_smallest_median_is_not_best_where_another_wins_flight_by_flight_or_loses_fewer(effect, lost, said):
    pair = {"difference": Estimate(0.01 * effect, -1.0, 1.0), "effect": effect, "lost": lost, "p_lost": 0.001}
    apart = tuple(result(f"law {i}", 0.01 + 1e-6 * i) for i in range(2))
    found = comparison(2)._replace(results=apart, ranked={WHERE: ordered(["law 0", "law 1"], **pair)})
    tied = "law 0 and law 1 are tied for best by e: {}."
    assert answer(found) == (said if "is best" in said else tied.format(said))
    alike = ordered(["law 0", "law 1"], p=1.0)._replace(copies=True)
    assert answer(found._replace(ranked={WHERE: alike})) == tied.format("they differ by less than 0.1 %")


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
    ranked = {
        WHERE._replace(path=f"path {i}"): ordered(["law 0", "law 1"], 0.4 if i > 2 else 0.001, effect=-0.2) for i in range(6)
    }
    results = tuple(result(f"law {i}", 0.01 * (i + 1))._replace(situation=where) for where in ranked for i in range(2))
    found = comparison(2)._replace(results=results, ranked=ranked)
    assert answer(found) == "By e, law 0 is best or tied for best in all 6 situations."
    lossy = [one._replace(lost=Estimate(0.3, 0.1, 0.5)) if one.controller == "law 1" else one for one in results]
    two = found._replace(results=tuple(lossy), ranked=dict(list(ranked.items())[:2]))
    assert answer(two) == "By e, law 0 is best in both situations."
    assert decisions(two)[0][1:] == ["law 0, law 1", "10 [5, 20] mm", "law 0 is better"]
    few = found._replace(ranked=dict(list(ranked.items())[2:5]))
    assert answer(few) == "By e, law 0 is best in “path 2”; law 0 and law 1 are tied in “path 3” and “path 4”."


@pytest.mark.parametrize("alike", [False, True])
def test_the_axis_says_that_it_is_logarithmic_and_names_an_interval_only_where_flights_differ(tmp_path, alike):
    found = comparison(3)
    found = found._replace(ranked={WHERE: found.ranked[WHERE]._replace(copies=alike)})
    draw_vehicle(tmp_path / "one", found, "crazyflie", sheet("svg", None, SCREEN))
    text = " ".join(re.findall(r">([^<>]+)</text>", (tmp_path / "one.svg").read_text(encoding="utf-8")))
    assert "e [mm], logarithmic scale" in text and "interval" not in text, "which the caption has, where flights differ"


def test_where_errors_are_large_is_drawn_and_said_where_all_flights_agree_on_it(tmp_path):
    second = WHERE._replace(scenario="wind")
    known = [(WHERE, 0.103), (WHERE, 0.1030001), (second, 0.1), (second, 0.2)]
    assert large_errors(known) == {WHERE: 0.103}, "the grades of the second have other measures"
    assert large_errors([(WHERE, 0.1), (WHERE, 0.0)]) == large_errors(known[:1]) == {}
    assert error_limit({"position_rmse[m]": 0.305, "relative_error": 0.296}) == pytest.approx(0.1030, rel=1e-3)
    assert error_limit({"position_rmse[m]": 0.305, "relative_error": 0.296, HELD: 1.0}) == 0.0  # of its second half
    one = comparison(3)
    metrics = {"position_rmse": "position_rmse[m]", "e": "e[m]"}
    results = [each._replace(spreads={"position_rmse": each.spreads["e"], "e": each.spreads["e"]}) for each in one.results]
    found = one._replace(metrics=metrics, results=tuple(results), limits={WHERE: 0.0123})
    draw_vehicle(tmp_path / "one", found, "crazyflie", sheet("svg", None, SCREEN))
    text = (tmp_path / "one.svg").read_text(encoding="utf-8")
    assert text.count(">large above 12.3 mm<") == 1, "of two panels, that of the error that is graded"
    assert [text.count(f">{name}<") for name in found.controllers] == [2, 2, 2], "each row by its name"
    bad = results[1]._replace(grade=Graded(FlightGrade.FLEW_BUT, (), ("large error",)))
    draw_vehicle(
        tmp_path / "two", found._replace(results=(results[0], bad, results[2])), "crazyflie", sheet("svg", None, SCREEN)
    )
    marked = (tmp_path / "two.svg").read_text(encoding="utf-8").count("#ffffff")
    assert marked == text.count("#ffffff") + 1, "open is who has the table's !, not whose median is near the line"
    ranks, other = text.lower().split('id="axes1"')
    assert CURVES[0].lower() in ranks and CURVES[0].lower() not in other, "nobody is best by what does not rank"
    assert (
        limit(found, "crazyflie") == " An error is large above 12.3 mm: 10 % of that of a vehicle that never leaves its start."
    )
    assert limit(found._replace(limits={}), "crazyflie") == ""


def test_the_table_of_medians_has_rows_for_whichever_are_more():
    few = comparison(2)
    both, wide = elsewhere(few), elsewhere(comparison(3))
    assert [len(medians(one, [], "crazyflie").rows) for one in (few, both, wide)] == [2, 2, 3]
    assert [row[0] for row in medians(wide, [], "crazyflie").rows] == wide.controllers
    assert "law 0" in medians(both, [], "crazyflie").header, "of as many, situations"


def test_what_is_the_same_in_all_situations_stands_in_no_row():
    second, other = WHERE._replace(scenario="wind"), WHERE._replace(vehicle="x500", path="circle")
    found = comparison(2)._replace(ranked=dict.fromkeys((WHERE, second), ordered([])))
    assert [found.place(one) for one in found.ranked] == ["calm", "wind"]
    assert found.shared == ("crazyflie", "hover", "") and found.place(second, whole=True) == "wind"
    apart = found._replace(ranked=dict.fromkeys((WHERE, other), ordered([])))
    assert (apart.place(other), apart.place(other, whole=True)) == ("circle", "x500, circle")
    assert comparison(2).place(WHERE) == "hover, calm"
    rows = [["crazyflie", "a", "1"], ["crazyflie", "b", "2"]]
    assert found.table(("vehicle", "controller", "n"), rows) == (["controller", "n"], [["a", "1"], ["b", "2"]], "")
    header, rows = ("vehicle", "controller", "gains", "ahead"), [["x500", name, "as shipped", "-"] for name in "ab"]
    same = "The same for all: gains as shipped."
    assert found.table(header, rows, "Costs.", once=True) == (["controller"], [], f"Costs. {same}")
    assert found.table(header, rows[:1], once=True)[0] == ["controller", "gains", "ahead"]
    assert found.table(("vehicle", "controller"), [["crazyflie", "a"], ["x500", "a"]])[0] == ["vehicle", "controller"]
