"""What a comparison has found, in words: what is decided, and what is not."""

import math
from collections.abc import Sequence

from quadstep.io.grouping import by_first
from quadstep.linear.grade import WORST_FIRST
from quadstep.metrics.registry import SOUND, at_rest
from quadstep.metrics.statistics import Estimate
from quadstep.metrics.verdict import RULES
from quadstep.report.units import counted, listed, metric, number, percent, prose
from quadstep.studies.comparison.answer import MOST_NAMED, SAME, answer, first, leaders, several, unit_of, warned
from quadstep.studies.comparison.cells import Situation
from quadstep.studies.comparison.entrants import Comparison, SituationResult
from quadstep.studies.comparison.ranking import by_chance, fewest

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
    return {place: min(one) for place, one in by_first(known).items() if len(one) > 1 and 0.0 < max(one) < 1.001 * min(one)}


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
    """The answer with what speaks against it and what to do next, then what is missing or unlike."""
    lines = [" ".join([answer(results), *warned(results), *unsound(results), *advice(results)]), *missed_limits(results)]
    if results.copies:
        alike = ALIKE if results.seeds > 1 else ONCE
        count = counted(len(results.controllers), results.kind)
        lines.append(f"{count}, {counted(results.seeds, 'flight')} each, {alike}.")
    lines += [results.unlike] if results.unlike not in ("", SAME) else []
    if out := dict.fromkeys(one.controller[1] if one.controller else "a whole situation" for one in results.problems):
        lines.append(f"Missing from some or all situations because they failed: {several(list(out))}.")
    return [*lines, *(problem.line for problem in results.problems)]


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


def advice(results: Comparison) -> list[str]:
    """The one thing to do next."""
    who, most = first(results)
    needed, many = fewest(results.pairs) if results.pairs else 0, len(results.ranked)
    if len(results.controllers) < 2 or results.unlike == SAME:
        return []
    if results.seeds < needed:
        return [f"Next: fly at least {needed} flights each (--seeds), as with fewer no difference can be significant."]
    if not any(one.grade is None or not one.grade.labels for one in results.results if one.controller in who):
        return [
            f"Next: better gains (`quadstep tune`), as no median flight of {several(who) if who else 'any'} is as commanded."
        ]
    untuned = bool(results.entrants) and results.kind == "controller" and not any(one.trained for one in results.entrants)
    but = ["No gains were tuned for this comparison; a table [tuning] tunes all with equal budgets."] * untuned
    if most < many:
        return but
    if len(who) == 1:
        return [f"Next: choose {several(who)}, if what it takes (gains and cost) is acceptable.", *but]
    return ["Next: choose among them by what else matters to you, such as rotor activity or cost.", *but]


def activity(results: Comparison, vehicle: str) -> dict[str, float]:
    """How hard each works its rotors, mean over the situations of a vehicle in which all complete flights [N/s]."""
    cells = [results.of(where) for where in results.ranked if where.vehicle == vehicle]
    there = [one for one in cells if all(math.isfinite(each.effort.activity) for each in one)]
    names = {each.controller for one in there for each in one}
    rows = [{each.controller: each.effort.activity for each in one} for one in there if len(one) == len(names)]
    return {name: sum(row[name] for row in rows) / len(rows) for name in names if rows}


def unsound(results: Comparison) -> list[str]:
    """Of those who lead anywhere, whose loop is not sound, the worst over vehicles: a sentence each."""
    lead = dict.fromkeys(name for one in results.ranked for name in leaders(results, one))
    lines = []
    for controller in list(lead)[:MOST_NAMED]:
        loops = [(one, where) for (where, name), one in results.linear.items() if name == controller and one.grade != SOUND]
        for worst, where in sorted(loops, key=lambda loop: WORST_FIRST.index(loop[0].grade))[:1]:
            whose = f"the loop of {controller}{' without the estimator' if worst.estimator else ''}"
            text = f"{f'on {where}, ' if where else ''}{at_rest({'grade': worst.grade, 'why': worst.why}, whose)}"
            lines.append(f"{text[:1].upper()}{text[1:]}.")
    return lines


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
