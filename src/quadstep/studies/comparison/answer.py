"""The answer of a comparison: who is best where, by how much, and whom no flight tells apart.

One rule decides, pair by pair: a controller is better than another if it certainly keeps closer to its path flight by flight,
by more than next to nothing, has no larger median, and does not certainly lose more flights. Whom nobody is better than leads
its situation: alone it is best, several are tied. A median alone decides nothing.
"""

import math
from statistics import median as middle
from typing import NamedTuple

from quadstep.io.grouping import by_first
from quadstep.metrics.verdict import FlightGrade
from quadstep.report.units import DIGITS, interval, listed, metric, number, percent, suited, unit_suffix
from quadstep.studies.comparison.cells import Situation
from quadstep.studies.comparison.entrants import Comparison, SituationResult
from quadstep.studies.comparison.ranking import Pair
from quadstep.studies.tuning.objective import NEGLIGIBLE

MOST_NAMED = 4
"""Situations that the answer names; more are counted."""

SAME = "They differ in no setting, so their flights are the same."

SEVERAL = 8
"""Controllers that a sentence names; more are counted, and tables have them."""


class Unit(NamedTuple):
    """What a metric is shown in. factor: times the value in SI."""

    name: str
    factor: float

    def text(self, value: float, digits: int = DIGITS) -> str:
        """A value in SI, as a sentence has it; what is infinite is lost."""
        if not math.isfinite(value):
            return "lost"
        return number(self.factor * value, digits) + unit_suffix(self.name).replace("\N{NO-BREAK SPACE}", " ")


def unit_of(results: Comparison, name: str) -> Unit:
    """Of a metric by its name without unit, the same wherever it is shown: one that suits the middle of its medians."""
    medians = [abs(value) for one in results.results if math.isfinite(value := one.spreads[name].median.value)]
    return Unit(*suited(metric(results.metrics[name])[1], middle(medians) if medians else 0.0))


def answer(results: Comparison) -> str:
    """Who is best where, in a sentence."""
    graded = [one.grade for one in results.results]  # none of an autopilot
    if results.unlike == SAME:
        return SAME.replace("They", several(results.controllers))
    short = all(one and one.grade is not FlightGrade.AS_COMMANDED for one in graded)
    begins = f"No {results.kind} flies as commanded{' in any situation' * (len(results.ranked) > 1)}: " * short
    text = overall(results) if len(results.ranked) > 1 else alone(results)
    return begins + (text[:1].upper() + text[1:] if text.startswith(("every", "by ")) and not begins else text)


def better(results: Comparison, situation: Situation, pair: Pair) -> str | None:
    """Who of a pair is better; None where neither is. Of flights that are all alike, whose number is smaller."""
    medians = {one.controller: median(results, one) for one in results.of(situation)}
    if results.ranked[situation].copies:
        low, high = sorted(pair[:2], key=lambda name: medians[name])
        return low if (1.0 + NEGLIGIBLE) * medians[low] < medians[high] else None
    if not (one := pair.winner) or pair.keeper == (other := pair.other(one)) or negligible(results, situation, pair):
        return None
    return one if medians[one] <= medians[other] else None


def leaders(results: Comparison, situation: Situation) -> list[str]:
    """Whom nobody is better than, the smallest median first; nobody where all lose half of their flights."""
    cells = sorted(results.of(situation), key=lambda one: median(results, one))
    if not math.isfinite(median(results, cells[0])):
        return []
    winners = [(pair, better(results, situation, pair)) for pair in results.ranked[situation].pairs]
    beaten = {name for pair, winner in winners if winner for name in pair[:2] if name != winner}
    return [one.controller for one in cells if one.controller not in beaten]


def first(results: Comparison) -> tuple[list[str], int]:
    """Who is best or tied in the most situations, and in how many."""
    lead = [name for one in results.ranked for name in leaders(results, one)]
    most = max((lead.count(name) for name in results.controllers), default=0)
    return [name for name in results.controllers if most and lead.count(name) == most], most


def overall(results: Comparison) -> str:
    """Who leads where, in a sentence; of many situations, in how many."""
    who, most = first(results)
    each, many = [leaders(results, one) for one in results.ranked], len(results.ranked)
    if not who:
        return f"every {results.kind} loses at least half of its flights in each situation."
    by, every = f"by {metric(results.metrics[results.metric])[0]}, ", "both" if many == 2 else f"all {many}"
    if most == many and all(one == each[0] for one in each):
        return f"{by}{several(who)} {'is best' if len(who) == 1 else 'are tied for best'} in {every} situations."
    if many <= MOST_NAMED:
        return f"{by}{where_each(results)}."
    if most == many:
        return f"{by}{several(who)} {'is' if len(who) == 1 else 'are'} best or tied for best in {every} situations."
    nearest = f"{several(who)} {'leads' if len(who) == 1 else 'each lead'} in {most}, more than any other"
    return f"{by}no {results.kind} leads, alone or tied, in {every} situations: {nearest}."


def where_each(results: Comparison) -> str:
    """Who leads in which situations, each named once."""
    places = by_first((tuple(leaders(results, one)), quoted(results, one)) for one in results.ranked)
    best = [f"{several([*who])} is best in {listed(where)}" for who, where in places.items() if len(who) == 1]
    best[1:] = [one.replace(" is best in ", " in ", 1) for one in best[1:]]
    tied = [f"{several([*who])} are tied in {listed(where)}" for who, where in places.items() if len(who) > 1]
    lost = [
        f"every {results.kind} loses at least half of its flights in {listed(where)}"
        for who, where in places.items()
        if not who
    ]
    return "; ".join([", ".join(best), *tied, *lost] if best else [*tied, *lost])


def alone(results: Comparison) -> str:
    """Who leads the only situation, with the medians that say so."""
    (situation,) = results.ranked
    cells, names = {one.controller: one for one in results.of(situation)}, leaders(results, situation)
    if not names:
        return f"every {results.kind} loses at least half of its flights."
    what = f"{'' if results.ranked[situation].copies else 'median '}{metric(results.metrics[results.metric])[0]}"
    if len(names) > 1:
        why = f": {decision(results, situation, *names)}" if len(names) == 2 else ""
        return f"{several(names)} are tied for best by {metric(results.metrics[results.metric])[0]}{why}."
    if not (second := nearest(results, situation)):
        return f"{names[0]} has a {what} of {medians(results, [cells[names[0]]])[0]}."
    own, other = medians(results, [cells[names[0]], cells[second]])
    return f"{names[0]} is best ({what} {own}), next {second}{f' ({other})' * (other != 'lost')}."


def quoted(results: Comparison, situation: Situation) -> str:
    """A situation as a sentence names it."""
    place = results.place(situation, whole=True)
    return f"{f'“{place}”' if ' ' in place else place}{' (tuned in)' * (situation in results.tuned_in)}"


def nearest(results: Comparison, situation: Situation) -> str | None:
    """Who of those that somebody is better than has the smallest median."""
    rest = [one for one in results.of(situation) if one.controller not in leaders(results, situation)]
    return min(rest, key=lambda one: median(results, one)).controller if rest else None


def medians(results: Comparison, cells: list[SituationResult]) -> list[str]:
    """The medians of some cells, with as many digits as tell them apart, up to six."""
    values, unit = [median(results, one) for one in cells], unit_of(results, results.metric)
    tried = [[unit.text(one, digits) for one in values] for digits in range(DIGITS, 7)]
    return next((texts for texts in tried if len(set(texts)) == len(set(values))), tried[0])


def decisions(results: Comparison) -> list[list[str]]:
    """What decides each situation: who has the smallest median of those that lead, beside each who is tied with it, or the
    next; how much larger the other's error is, flight by flight, with its interval; and what that shows.
    """
    rows = []
    for situation in results.ranked:
        lead, place = leaders(results, situation), results.place(situation, whole=True) * (len(results.ranked) > 1)
        others = lead[1:] or [one for one in [nearest(results, situation)] if one]
        for other in others if lead else []:
            why = decision(results, situation, lead[0], other)
            rows.append([place, f"{lead[0]}, {other}", difference(results, situation, lead[0], other), why])
    return rows


def pair_of(results: Comparison, situation: Situation, one: str, other: str) -> Pair:
    return next(pair for pair in results.ranked[situation].pairs if {one, other} == {*pair[:2]})


def difference(results: Comparison, situation: Situation, one: str, other: str) -> str:
    """The other's metric less this one's, flight by flight, with its interval; a dash where no flight has both."""
    pair = pair_of(results, situation, one, other)
    gap, low, high = pair.difference if pair.second == one else (-each for each in pair.difference)
    low, high = sorted((low, high))
    unit = metric(results.metrics[results.metric])[1]
    if not math.isfinite(gap):
        return "-"
    if not (math.isfinite(low) and math.isfinite(high)) or low == high:
        return unit_of(results, results.metric).text(gap)
    return interval(gap, low, high, unit).replace("\N{NO-BREAK SPACE}", " ")


def decision(results: Comparison, situation: Situation, one: str, other: str) -> str:
    """What is shown of two in a situation."""
    pair, flights = pair_of(results, situation, one, other), max(each.flights for each in results.of(situation))
    winner, tracks, keeps = better(results, situation, pair), pair.winner, pair.keeper
    tiny = f"by less than {100.0 * NEGLIGIBLE:g} %"
    texts = {
        "they are the same": results.unlike == SAME,
        f"{winner} is better": winner,
        f"they differ {tiny}": results.ranked[situation].copies,
        f"{tracks} tracks better, but {keeps} loses fewer flights": tracks and keeps and tracks != keeps,
        f"{tracks} is better {tiny}": tracks and negligible(results, situation, pair),
        f"{tracks} is better flight by flight, but its median is not smaller": tracks,
        f"{keeps} loses fewer flights": keeps,
    }
    open_ = f"{flights:,} flight{'s do' if flights != 1 else ' does'} not tell them apart"
    return next((text for text, holds in texts.items() if holds), open_)


def warned(results: Comparison) -> list[str]:
    """What speaks against those who lead: where no median flight is as commanded, why not, and the flights they lose."""
    nowhere, bad, losing = [], [], []
    for situation in results.ranked:
        where = f" in {quoted(results, situation)}" if len(results.ranked) > 1 else ""
        cells, lead = results.of(situation), leaders(results, situation)
        none = bool(where and lead) and all(one.grade and one.grade.grade is not FlightGrade.AS_COMMANDED for one in cells)
        nowhere += [quoted(results, situation)] * none
        for one in (each for each in cells if each.controller in lead):
            who = several([one.controller])
            bad += [f"{who}{where} ({', '.join(one.grade.labels)})"] if one.grade and one.grade.labels and not none else []
            losing += [f"{who} {percent(one.lost.value)}{where}"] if one.lost.value else []
    said = [f"No {results.kind} flies as commanded in {shortened(nowhere)}."] * (0 < len(nowhere) < len(results.ranked))
    return said + [f"{what}: {shortened(one)}." for what, one in (("Not as commanded", bad), ("Lost flights", losing)) if one]


def shortened(items: list[str]) -> str:
    return listed(items if len(items) <= MOST_NAMED else [*items[: MOST_NAMED - 1], f"{len(items) - MOST_NAMED + 1} more"])


def median(results: Comparison, one: SituationResult) -> float:
    """Of the metric that ranks; infinite where half of the flights are lost."""
    return one.spreads[results.metric].median.value


def negligible(results: Comparison, situation: Situation, pair: Pair) -> bool:
    """Whether a pair is decided, but by flights that all complete and hardly differ."""
    lower = min(median(results, one) for one in results.of(situation) if one.controller in pair[:2])
    return pair.winner is not None and pair.lost == 0.0 and abs(pair.difference.value) < NEGLIGIBLE * lower


def several(names: list[str]) -> str:
    """Names as a sentence lists them, in quotes where one has a comma itself, or how many others they are."""
    if len(names) > SEVERAL:
        return f"{len(names)} others"
    return listed([f"“{name}”" if "," in name else name for name in names])
