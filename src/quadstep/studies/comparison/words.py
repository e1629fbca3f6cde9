"""What a comparison has found, in words: what is decided, and what is not."""

import math
from collections.abc import Sequence

from quadstep.linear.grade import WORST_FIRST
from quadstep.metrics.registry import at_rest
from quadstep.metrics.statistics import Estimate
from quadstep.metrics.verdict import FlightGrade
from quadstep.report.units import counted, listed, metric, number, percent, prose, unit_suffix
from quadstep.studies.comparison.answer import MOST_NAMED, SEVERAL, answer, leading, negligible, several, tied, unit_of
from quadstep.studies.comparison.cells import Situation
from quadstep.studies.comparison.cost import BOARD
from quadstep.studies.comparison.entrants import Comparison, SituationResult
from quadstep.studies.comparison.ranking import ALPHA, Ranked, by_chance, fewest
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
    "of any false decision is at most 5 %. Decisions hold for these gains, vehicles and paths."
)


def method(results: Comparison) -> str:
    """What is the same for all, and the tests where anything is random."""
    same = SAME_FLIGHTS[results.kind] if results.seeds > 1 else f"All {results.kind}s fly the same path."
    return same if results.copies else " ".join(filter(None, (METHOD.format(same), searches(results))))


def common(results: Comparison) -> list[str]:
    """The path and the scenario that all situations share, of several."""
    columns = list(zip(*results.situations, strict=True))[1:]
    return [one[0] for one in columns if len(results.situations) > 1 and one[0] and len(set(one)) == 1]


def limit(results: Comparison, vehicle: str) -> str:
    """Above what an error is large, in a sentence after a blank; nothing where no flight says so."""
    known = {
        place: one for place, one in results.limits.items() if place.vehicle == vehicle and results.metric == "position_rmse"
    }
    texts = {place: unit_of(results, results.metric).text(one) for place, one in known.items()}
    if len(set(texts.values())) > 1:
        return f" Errors are large above {listed([f'{text} in {results.place(place)}' for place, text in texts.items()])}."
    return f" Errors are large above {next(iter(texts.values()))}." if texts else ""


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
    value, low, high = (one * factor for one in estimate)
    if not math.isfinite(value):
        return LOST if value > 0.0 else NOTHING
    if low == value == high:
        return number(value)
    return f"{number(value)} [{end(low)}, {end(high)}]"


def end(value: float) -> str:
    return number(value) if math.isfinite(value) else LOST if value > 0.0 else NOTHING


def share_lost(one: SituationResult) -> str:
    """What a controller loses in a situation."""
    return f"{percent(one.lost.value)} lost"


# Sentences


def sentences(results: Comparison) -> list[str]:
    """The answer, what holds for all, then situation by situation."""
    lines = [answer(results), *of_all(results)] if len(results.controllers) > 1 else []
    if not 1 < len(results.ranked) <= MOST_NAMED:  # which the answer names one by one
        lines += filter(None, (of_situation(results, situation, ranked) for situation, ranked in results.ranked.items()))
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
    """Who ranks first and what its loop is, what was flown, and how much is decided."""
    pairs = [pair for one in results.ranked.values() if not one.copies for pair in one.pairs]
    decided, kept = sum(pair.winner is not None for pair in pairs), sum(pair.keeper is not None for pair in pairs)
    tiny = sum(negligible(results, situation, pair) for situation, one in results.ranked.items() for pair in one.pairs)
    slight = f" (in {tiny} of these by less than {100.0 * NEGLIGIBLE:g} %)" if tiny else ""
    many = len(results.ranked)
    over = f" over {many} situations" if many > 1 else ""
    first, *others = results.leaders
    lines = []
    if many > 1:
        flown = [one for one in results.results if one.controller == first]
        lost = [one.lost.value for one in flown if one.lost.value]
        who, whose = (first, f"{first}'s") if others else ("it", "its")
        loses = f", though {who} loses flights in {len(lost)} of {many} situations" if lost else ""
        loses += f", up to {percent(max(lost))} of them" if lost else ""
        some = f" over the {len(flown)} of {many} situations that {who} flew" if len(flown) < many else ""
        leads = f"{several(results.leaders)} share" if others else f"{first} has"
        rank = f"{min(results.overall().values()):.2f} from 0 (always first) to 1 (always last)"
        lines.append(f"{leads} the best mean rank{some}, {rank}{loses}{fall_short(results, flown, whose)}.")
    lines += [] if others else with_grade(results, first)
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
    if pairs and results.seeds < fewest(len(pairs)):
        lines.append(
            f"With so few flights no difference can be significant: {counted(len(pairs), 'pair')} "
            f"{'take' if len(pairs) > 1 else 'takes'} at least {fewest(len(pairs))} flights each."
        )
    elif pairs:
        lines.append(
            f"Tracking differs significantly in {decided} of {len(pairs)} pairs{over}{slight}, the number of lost flights in "
            f"{kept or 'none'}."
        )
    return lines


def with_grade(results: Comparison, controller: str) -> list[str]:
    """What a winner's loop is, the worst over vehicles, and what it asks of the rotors: a sentence, if anything is known."""
    loops = [(one, where) for (where, name), one in results.linear.items() if name == controller]
    if not loops:
        return []
    worst, where = min(loops, key=lambda loop: WORST_FIRST.index(loop[0].grade))
    whose = f"the loop of {controller}{' without the estimator' if worst.estimator else ''}"
    text = f"{f'on {where} ' if where else ''}{at_rest({'grade': worst.grade, 'why': worst.why}, whose)}"
    effort = [one.effort.activity for one in results.results if one.controller == controller]
    known = [one for one in effort if math.isfinite(one)]
    flown = f" In flight its rotor activity is {sum(known) / len(known):.3g} N/s on average." if known else ""
    return [f"{text[:1].upper()}{text[1:]}.{flown}"]


def prices(results: Comparison) -> list[str]:
    """What the laws of one vehicle take to compute, where they differ: a sentence."""
    taken = {name: one.instructions for (_, name), one in results.costs.items() if one.instructions}
    if len(taken) < 2 or len(taken) < len(results.costs) or len(taken) > SEVERAL:
        return []
    least, *_, most = sorted(taken, key=taken.__getitem__)
    share = taken[most] / taken[least]
    each = listed([f"{name} {taken[name]:,}" for name in sorted(taken, key=taken.__getitem__)])
    times = f": {most} takes {share:.1f} times as many as {least}" if share >= 1.1 else ""
    return [f"Instructions in the worst sample on a {BOARD}: {each}{times}."]


def ranked_in(results: Comparison) -> str:
    """The situations that mean ranks are over."""
    there = len(results.tuned_in & results.ranked.keys())
    if 0 < there < len(results.ranked):
        return f"the {counted(len(results.ranked) - there, 'situation')} not used for tuning"
    return "all situations, all of which were used for tuning" if there else "all situations"


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


def of_situation(found: Comparison, situation: Situation, ranked: Ranked) -> str:
    """Who has the smallest median in a situation, against whom that is decided, and who loses flights; of the only one what
    the answer does not say.
    """
    results = {one.controller: one for one in found.of(situation)}
    best, losses = leading(found, situation)[0], lost_flights(results)
    where = f"{where_of(found, situation)}{' (tuned in)' if situation in found.tuned_in else ''}: " if situation.label else ""
    alone = len(found.ranked) == 1 < len(results)
    if not best:
        every = f"{where}{'every' if where else 'Every'} {found.kind} loses at least half of its flights; t"
        return f"{'T' if alone else every}racking is not compared. {losses}".strip()
    middle, share, grade = results[best].spreads[found.metric].median, results[best].lost.value, results[best].grade
    full, few = found.metrics[found.metric], math.isnan(middle.low) and not ranked.copies
    equal = tied(found, situation, best)
    has, whose = ("has", "its") if len(equal) == 1 else ("share", f"{best}'s")
    unit = unit_of(found, found.metric)
    suffix = unit_suffix(unit.name).replace("\N{NO-BREAK SPACE}", " ")
    value = number(unit.factor * middle.value) if few or ranked.copies else interval_text(middle, unit.factor)
    if alone:
        low, high = (end(unit.factor * one) for one in middle[1:])
        known = [f"The 95 % interval of {best}'s median is {low} to {high}{suffix}"] * (not ranked.copies)
        known = [f"{counted(found.seeds, 'flight')} are too few for an interval of the median"] if few else known
        known += [f"In {best}'s median flight, {listed(grade.reasons)}"] if grade and grade.reasons else []
        return " ".join(
            [*(f"{one}." for one in known), losses if sum(one.lost.value > 0.0 for one in results.values()) > 2 else ""]
        ).strip()
    loses = f", though {best if equal[1:] else 'it'} loses {percent(share)} of its flights," if share else ""
    text = f"{where}{several(equal)}{loses} {has} the smallest median {metric(full)[0]}, {value}{suffix}"
    text += f" ({counted(found.seeds, 'flight')} are too few for an interval)" if few else ""
    text += f", but in {whose} median flight, {listed(grade.reasons)}" if grade and grade.reasons else ""
    if ranked.copies:
        text += f"; {counted(results[best].flights, 'flight')} each, {ALIKE if results[best].flights > 1 else ONCE}"
    others: dict[str, list[str]] = {"significantly better": [], "not significantly better": [], "flight by flight worse": []}
    for pair in ranked.pairs:
        other = pair.second if pair.first == best else pair.first
        if best in pair[:2] and other not in equal and not ranked.copies:
            how = {None: "not significantly better", best: "significantly better"}.get(pair.winner, "flight by flight worse")
            slight = f" (by less than {100.0 * NEGLIGIBLE:g} %)" if negligible(found, situation, pair) else ""
            others[how].append(f"{other}{slight}")
    for how, names in others.items():
        whom = "all others" if len(names) == len(results) - 1 > 1 else several(names)
        text += f"; {how} than {whom}" if names else ""
    return f"{text}. {losses}".strip()


def where_of(results: Comparison, situation: Situation) -> str:
    """A situation, with its vehicle where there are several."""
    several_vehicles = len({one.vehicle for one in results.situations}) > 1
    return ", ".join(filter(None, (situation.vehicle * several_vehicles, results.place(situation))))


def fall_short(found: Comparison, results: Sequence[SituationResult], whose: str) -> str:
    """In how many situations the median flight of a controller is lost or not as asked, and why where its error is largest."""
    lost = sum(one.grade is not None and one.grade.grade is FlightGrade.LOST for one in results)
    short = [one for one in results if one.grade and one.grade.reasons]
    counts = [f"{what} in {count}" for what, count in (("is lost", lost), ("misses the grade", len(short))) if count]
    if not counts:
        return ""
    text = f"; {whose} median flight {listed(counts)} of {len(results)} situations"
    if short:
        worst = max(short, key=lambda one: one.spreads[found.metric].median.value)
        where = "worst of those it completes" if lost else "worst"
        text += f", {where} in {where_of(found, worst.situation)}: {listed(worst.grade.reasons if worst.grade else ())}"
    return text


def lost_flights(results: dict[str, SituationResult]) -> str:
    lost = {name: one.lost for name, one in results.items() if one.lost.value > 0.0}
    if len(lost) > SEVERAL:
        every = sum(share.value == 1.0 for share in lost.values())
        return f"{len(lost)} of {len(results)} lose flights{f', {every} of them lose all' if every else ''}."
    return f"Lost: {', '.join(f'{several([name])} {percent(*share)}' for name, share in lost.items())}." if lost else ""


def wins(results: Comparison) -> list[list[str]]:
    """For each controller against each other: situations in which it is certainly better, undecided, and certainly worse."""
    rows = []
    for one in results.controllers:
        row = [one]
        for other in results.controllers:
            every = (pair for ranked in results.ranked.values() for pair in ranked.pairs)
            pairs = [pair for pair in every if {pair.first, pair.second} == {one, other}]
            better = sum(pair.winner == one for pair in pairs)
            worse = sum(pair.winner == other for pair in pairs)
            found = f"{better} better" * bool(better), f"{worse} worse" * bool(worse)
            row.append(NOTHING if one == other or not pairs else ", ".join(filter(None, found)) or "undecided")
        rows.append(row)
    return rows


def tests(results: Comparison) -> str:
    """The size of what was corrected for."""
    certain = sum(one.friedman < ALPHA / max(1, len(results.ranked)) for one in results.ranked.values())
    return (
        f"{counted(results.pairs, 'pair')} in each family of tests. By Friedman's test the {results.kind}s differ in "
        f"{certain} of {len(results.ranked)} situations (with Bonferroni's correction)."
    )
