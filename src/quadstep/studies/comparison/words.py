"""What a comparison has found, in words: what is decided, and what is not."""

import math
from collections.abc import Mapping, Sequence

from quadstep.linear.grade import WORST_FIRST
from quadstep.metrics.registry import at_rest
from quadstep.metrics.statistics import Estimate
from quadstep.metrics.verdict import RULES
from quadstep.report.units import counted, listed, metric, number, percent, prose
from quadstep.studies.comparison.answer import (
    MOST_NAMED,
    SEVERAL,
    answer,
    first,
    leaders,
    negligible,
    of_situation,
    several,
    unit_of,
)
from quadstep.studies.comparison.cells import Situation
from quadstep.studies.comparison.cost import BOARD
from quadstep.studies.comparison.entrants import Comparison, SituationResult
from quadstep.studies.comparison.ranking import by_chance, fewest
from quadstep.studies.tuning.objective import NEGLIGIBLE

LOST, NOTHING = "lost", "-"

ALIKE, ONCE = "all identical, so there are no statistics", "since nothing is random and more would be identical"
"""Of flights that do not differ: many, and one that stands for all."""

SAME_FLIGHTS = {
    "controller": "All controllers fly the same flights in a situation: the same path and draws, and the same wind and noise "
    "where simulation.step is the same.",
    "mission": "All missions fly the same path, with the same random numbers where simulation.step is the same.",
}
METHOD = (
    "{} A lost flight counts as worse than any other. Pairs are compared by Wilcoxon's signed-rank test and, for lost "
    "flights, by McNemar's exact test; the p-values of all pairs in all situations get Holm's correction, so that the chance "
    "of any false decision is at most 5 %. A {} is better than another if Wilcoxon's test decides for it, its median is no "
    "larger, McNemar's test does not decide against it, and the difference is at least 0.1 %. It is best if it is better than "
    "all others; those that none is better than are tied for best, which does not show that they are equal. Decisions hold "
    "for these gains, vehicles and paths."
)


def method(results: Comparison) -> str:
    """What is the same for all, and the tests where anything is random."""
    same = SAME_FLIGHTS[results.kind] if results.seeds > 1 else f"All {results.kind}s fly the same path."
    return same if results.copies else " ".join(filter(None, (METHOD.format(same, results.kind), searches(results))))


def large_errors(known: Sequence[tuple[Situation, float]]) -> dict[Situation, float]:
    """Above which position RMSE errors are large, where all flights of a situation agree: grades count only the second half
    of a flight that holds a point, and measure others against their own starts.
    """
    found: dict[Situation, list[float]] = {}
    for place, one in known:
        found.setdefault(place, []).append(one)
    return {place: min(one) for place, one in found.items() if len(one) > 1 and 0.0 < max(one) < 1.001 * min(one)}


def limit(results: Comparison, vehicle: str) -> str:
    """Above what an error is large, in a sentence after a blank; nothing where no flight says so."""
    known = {
        place: one for place, one in results.limits.items() if place.vehicle == vehicle and results.metric == "position_rmse"
    }
    texts = {place: unit_of(results, results.metric).text(one) for place, one in known.items()}
    each = [f"{text} in {results.place(place)}" for place, text in texts.items()]
    above = listed(each if len(set(texts.values())) > 1 else [*texts.values()][:1])
    size = f"{percent(RULES[0].most)} of that of a vehicle that never leaves its start"
    return f" An error is large above {above}: {size}." if texts else ""


def situation_caption(results: Comparison, situation: Situation) -> str:
    """What a vehicle's figure calls a situation."""
    return prose(results.place(situation)) or "missions"


def title(results: Comparison, name: str) -> str:
    """A metric, by its name without unit, with the unit it is shown in."""
    words, unit = metric(name)[0], unit_of(results, name).name
    return f"{words} [{unit}]" if unit != "-" else words


def measured(results: Comparison) -> str:
    """What a table of situations and controllers has of each."""
    what = title(results, results.metric)
    return f"{what}, median ({results.high})" if results.spreads else what


def interval_text(estimate: Estimate, factor: float = 1.0) -> str:
    """A number with its interval; what is infinite is lost, an end for which there are too few flights a dash."""
    text, low, high = (end(one * factor) for one in estimate)
    alone = not math.isfinite(estimate.value) or estimate.low == estimate.value == estimate.high
    return text if alone else f"{text} [{low}, {high}]"


def end(value: float) -> str:
    return number(value) if math.isfinite(value) else LOST if value > 0.0 else NOTHING


def share_lost(one: SituationResult) -> str:
    """What a controller loses in a situation."""
    return f"{percent(one.lost.value)} lost"


# Sentences


def sentences(results: Comparison) -> list[str]:
    """The answer, what holds for all, then situation by situation where the answer has not named them."""
    lines = [answer(results), *of_all(results)]
    lines += [of_situation(results, one) for one in results.ranked] if len(results.ranked) > MOST_NAMED else []
    lines += missed_limits(results)
    lines += [problem.line for problem in results.problems]
    return lines


def missed_limits(results: Comparison) -> list[str]:
    """Whose gains miss the limits that they were to keep, and who was tuned without."""
    lines = []
    for one in results.entrants:
        if one.trained and one.trained.violation > 0.0:
            lines.append(f"{one.name} on {one.vehicle}: no gains were found that meet every limit (tuning.constraints).")
        if one.trained and one.trained.unconstrained:
            lines.append(f"{one.name} on {one.vehicle}: tuned without limits on its margins: {one.trained.unconstrained}.")
    return lines


def not_counted(results: Comparison) -> list[str]:
    """For whom instructions could not be counted, and why."""
    why: dict[str, dict[str, None]] = {}
    for (_, name), one in results.costs.items():
        if one.uncounted:
            why.setdefault(one.uncounted, {})[name] = None
    everybody = {name for _, name in results.costs}
    return [
        f"Instructions were not counted{'' if set(names) == everybody else ' for ' + ', '.join(names)}: {reason}."
        for reason, names in why.items()
    ]


def of_all(results: Comparison) -> list[str]:
    """What to do with the answer, what the controllers take, what was flown, and how much is decided."""
    if len(results.controllers) < 2:
        return []
    pairs = [pair for one in results.ranked.values() if not one.copies for pair in one.pairs]
    kept = sum(pair.keeper is not None for pair in pairs)
    tiny = sum(negligible(results, situation, pair) for situation, one in results.ranked.items() for pair in one.pairs)
    slight = f" (in {tiny} of these by less than {100.0 * NEGLIGIBLE:g} %)" if tiny else ""
    over = f" over {len(results.ranked)} situations" if len(results.ranked) > 1 else ""
    lines = [advice(results), *in_its_median_flight(results), *activity(results)]
    lines += [line for name in first(results)[0][:MOST_NAMED] for line in with_grade(results, name)]
    lines += prices(results)
    everywhere = " in every situation" if results.kind == "controller" else ""
    alike = f", {ALIKE if results.seeds > 1 else ONCE}" if results.copies else ""
    lines.append(
        f"{counted(len(results.controllers), results.kind)}, {counted(results.seeds, 'flight')} each{everywhere}{alike}."
    )
    lines += [results.unlike] if results.unlike else []
    if results.problems:
        out = dict.fromkeys(one.controller[1] if one.controller else "a whole situation" for one in results.problems)
        lines.append(f"Missing from some or all situations because they failed: {several(list(out))}.")
    if pairs:
        differs = f"{len(pairs) - results.undecided} of {counted(len(pairs), 'pair')}{over}{slight}"
        lines.append(f"Tracking differs significantly in {differs}, the number of lost flights in {kept or 'none'}.")
    return lines


def advice(results: Comparison) -> str:
    """The one thing to do next, in a sentence."""
    who, most = first(results)
    needed, many = fewest(results.pairs) if results.pairs else 0, len(results.ranked)
    if results.seeds < needed:
        return (
            f"Next: fly more. With so few flights no difference can be significant: {counted(results.pairs, 'pair')} "
            f"{'take' if results.pairs > 1 else 'takes'} at least {needed} flights each (--seeds)."
        )
    if not any(one.grade is None or not one.grade.labels for one in results.results if one.controller in who):
        return f"Next: better gains (`quadstep tune`), as no median flight of {several(who) if who else 'any'} is as asked."
    untuned = bool(results.entrants) and results.kind == "controller" and not any(one.trained for one in results.entrants)
    but = " No gains were tuned for this comparison; a table [tuning] tunes all with equal budgets." * untuned
    if most < many:
        return f"Next: choose for the situations that matter to you, as none leads in all of them.{but}"
    if len(who) == 1:
        return f"Next: choose {several(who)}, if what it takes (below) is affordable.{but}"
    return f"Next: choose among {several(who)} by what they take (below), as their errors do not decide.{but}"


def in_its_median_flight(results: Comparison) -> list[str]:
    """Why the median flights of those who lead the only situation are not as asked."""
    alone = list(results.ranked)[:1] if len(results.ranked) == 1 else []
    lead = [name for one in alone for name in leaders(results, one)]
    graded = {one.controller: one.grade.reasons for one in results.results if one.grade and one.grade.reasons}
    return [f"In {name}'s median flight, {listed(graded[name])}." for name in lead[:SEVERAL] if name in graded]


def activity(results: Comparison) -> list[str]:
    """How hard each works its rotors, over the situations in which all complete flights: a sentence where that is known."""
    cells = {where: [one.effort.activity for one in results.of(where)] for where in results.ranked}
    there = [where for where, one in cells.items() if len(one) == len(results.controllers) and all(map(math.isfinite, one))]
    rows = [{one.controller: one.effort.activity for one in results.of(where)} for where in there]
    taken = {name: sum(row[name] for row in rows) / len(rows) for name in results.controllers if rows}
    return taking(
        "Rotor activity (changes of thrust per second), mean", {name: (one, f"{one:.3g} N/s") for name, one in taken.items()}
    )


def with_grade(results: Comparison, controller: str) -> list[str]:
    """What the loop of one who leads is, the worst over vehicles: a sentence, if anything is known."""
    loops = [(one, where) for (where, name), one in results.linear.items() if name == controller]
    if not loops:
        return []
    worst, where = min(loops, key=lambda loop: WORST_FIRST.index(loop[0].grade))
    whose = f"the loop of {controller}{' without the estimator' if worst.estimator else ''}"
    text = f"{f'on {where} ' if where else ''}{at_rest({'grade': worst.grade, 'why': worst.why}, whose)}"
    return [f"{text[:1].upper()}{text[1:]}."]


def prices(results: Comparison) -> list[str]:
    """What the laws of one vehicle take to compute, where they differ: a sentence."""
    taken = {
        name: (float(one.instructions), f"{one.instructions:,}")
        for (_, name), one in results.costs.items()
        if one.instructions
    }
    return taking(f"Instructions in the worst sample on a {BOARD}", taken) if len(taken) == len(results.costs) else []


def taking(what: str, taken: Mapping[str, tuple[float, str]]) -> list[str]:
    """What each takes, the least first, and how many times that the most is: a sentence, for as many as one can name."""
    if not 1 < len(taken) <= SEVERAL:
        return []
    names = sorted(taken, key=lambda name: taken[name][0])
    least, most = taken[names[0]][0], taken[names[-1]][0]
    times = f"; {names[-1]} takes {most / least:.1f} times as much as {names[0]}" if most >= 1.1 * least > 0.0 else ""
    return [f"{what}: {listed([f'{name} {taken[name][1]}' for name in names])}{times}."]


def searches(results: Comparison) -> str:
    """What repeated searches for gains say, and do not."""
    if not results.searches:
        return ""
    if results.searches < 2:
        return (
            "Each controller's gains were searched for once, so decisions hold for these gains: another search for the "
            "same controller may find others."
        )
    return (
        f"Gains were searched for {results.searches} times for each controller, and each set flew all flights. Intervals "
        "cover the results of all of them, and a pair is decided only if every set of one is better than every set of the "
        f"other, which happens to two equal controllers with a chance of {100 * by_chance(results.searches):.2g} %."
    )
