"""The answer of a comparison: who is best where, by how much, and whom no flight tells apart.

One rule decides, pair by pair: a controller is better than another if it certainly keeps closer to its path flight by flight,
by more than next to nothing, has no larger median, and does not certainly lose more flights. Whom nobody is better than leads
its situation: alone it is best, several are tied. A median alone decides nothing.
"""

import math
from statistics import median as middle
from typing import NamedTuple

from quadstep.metrics.verdict import FlightGrade
from quadstep.report.units import DIGITS, interval, listed, metric, number, percent, suited, unit_suffix
from quadstep.studies.comparison.cells import Situation
from quadstep.studies.comparison.entrants import Comparison, SituationResult
from quadstep.studies.comparison.ranking import POWER, Pair, flights_to_decide
from quadstep.studies.tuning.objective import NEGLIGIBLE

MOST_NAMED = 4
"""Situations that the answer names; more are counted."""

SEVERAL = 8
"""Controllers that a sentence names; more are counted, and tables have them."""

MOST_FLIGHTS = 100_000
"""Of a cell (`--seeds`)."""


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
    """Who is best where, or tied; of many situations, in how many."""
    graded = [one.grade for one in results.results]  # none of an autopilot
    short = all(one and one.grade is not FlightGrade.AS_ASKED for one in graded)
    lines = [f"No {results.kind} flies as asked{' in any situation' * (len(results.ranked) > 1)}:"] * short
    lines += [overall(results)] * (len(results.ranked) > 1)
    lines += [of_situation(results, one) for one in results.ranked] if len(results.ranked) <= MOST_NAMED else []
    return " ".join(lines)


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
    """Who leads in how many of several situations, in a sentence."""
    who, most = first(results)
    each, many = [leaders(results, one) for one in results.ranked], len(results.ranked)
    if not who:
        return f"Every {results.kind} loses at least half of its flights in each situation."
    alone = each.count(who) if len(who) == 1 else 0
    how = "best" if alone == most else "best or tied for best" if alone else "tied for best"
    every = "both" if many == 2 else f"all {many}"
    if most == many:
        return f"{several(who)} {'is' if len(who) == 1 else 'are'} {how} in {every} situations."
    nearest = f"{several(who)} {'leads' if len(who) == 1 else 'each lead'} in {most}, more than any other"
    return f"No {results.kind} leads, alone or tied, in {every} situations: {nearest}."


def of_situation(results: Comparison, situation: Situation) -> str:
    """Who is best in a situation, by how much, or who is tied and what would tell them apart; who loses flights."""
    cells = {one.controller: one for one in results.of(situation)}
    ranked, names = results.ranked[situation], leaders(results, situation)
    place = results.place(situation, whole=True) if len(results.ranked) > 1 else ""
    tuned = " (tuned in)" * (situation in results.tuned_in)
    quote = "'" * (" " in place)
    where = f"In {quote}{place}{quote}{tuned}, " if place else ""
    if not names:
        return f"{where}{'every' if where else 'Every'} {results.kind} loses at least half of its flights."
    rest = sorted((name for name in cells if name not in names), key=lambda name: median(results, cells[name]))
    named = [*names, *rest[:1]]
    what = f"{'' if ranked.copies else 'median '}{metric(results.metrics[results.metric])[0]}"
    texts = dict(zip(named, medians(results, [cells[name] for name in named]), strict=True))
    notes = {name: remarks(cells[name]) for name in names}
    if len(names) == 1 and len(cells) > 1:
        by = f", next {rest[0]} with {texts[rest[0]]}{more(results, situation, names[0], rest[0])}"
        next_best = by * math.isfinite(median(results, cells[rest[0]]))
        text = f"{names[0]} is best ({what} {texts[names[0]]}{notes[names[0]]}){next_best}"
    elif len(names) == 1:
        text = f"{names[0]} has a {what} of {texts[names[0]]}{notes[names[0]]}"
    elif len(names) > SEVERAL:
        text = f"{len(names)} of {len(cells)} {results.kind}s are tied for best, {names[0]} with the smallest {what}, "
        text += f"{texts[names[0]]}{notes[names[0]]}"
    else:
        each = [
            f"{several([name])} ({f'{what} ' * (not place_)}{texts[name]}{notes[name]})" for place_, name in enumerate(names)
        ]
        text = f"{listed(each)} are tied for best{apart(results, situation, names)}"
    lost = {name: cells[name].lost.value for name in rest if cells[name].lost.value}
    if len(lost) > 2:
        text += f"; {len(lost)} others lose flights"
    elif lost:
        text += f"; {listed([f'{several([name])} loses {percent(share)}' for name, share in lost.items()])} of its flights"
    return f"{where}{text}."


def medians(results: Comparison, cells: list[SituationResult]) -> list[str]:
    """The medians of some cells, with as many digits as tell them apart, up to six."""
    values, unit = [median(results, one) for one in cells], unit_of(results, results.metric)
    tried = [[unit.text(one, digits) for one in values] for digits in range(DIGITS, 7)]
    return next((texts for texts in tried if len(set(texts)) == len(set(values))), tried[0])


def remarks(one: SituationResult) -> str:
    """What speaks against a leader: lost flights, and why its median flight is not as asked."""
    loses = f", though it loses {percent(one.lost.value)} of its flights" if one.lost.value else ""
    return loses + (f", but not as asked: {listed(one.grade.labels)}" if one.grade and one.grade.labels else "")


def more(results: Comparison, situation: Situation, best: str, other: str) -> str:
    """How much larger the other's error is, flight by flight, with its interval; nothing where that is not shown."""
    pair = next(one for one in results.ranked[situation].pairs if {best, other} == {*one[:2]})
    gap, low, high = pair.difference if pair.second == best else (-one for one in pair.difference)
    low, high = sorted((low, high))
    if results.ranked[situation].copies or not low > 0.0:
        return ""
    larger = interval(gap, low, high, metric(results.metrics[results.metric])[1], gap)
    return f" ({larger} more, flight by flight)".replace("\N{NO-BREAK SPACE}", " ")


def apart(results: Comparison, situation: Situation, names: list[str]) -> str:
    """Why none of these is better than another, and how many flights would tell two of them apart; after a colon."""
    ranked = results.ranked[situation]
    if ranked.copies:
        return f": they differ by less than {100.0 * NEGLIGIBLE:g} %"
    pairs = [pair for pair in ranked.pairs if pair.first in names and pair.second in names]
    said = [text for pair in pairs if (text := traded(results, situation, pair))]
    said = said if len(said) <= 2 else [f"{len(said)} pairs of them differ, but not in errors and losses alike"]
    said += [
        text for name in results.metrics if name != results.metric and (text := elsewhere(results, situation, names, name))
    ]
    open_pairs = [pair for pair in pairs if pair.winner is pair.keeper is None]
    flights = max(one.flights for one in results.of(situation))
    if not open_pairs:
        return f": {'; '.join(said)}"
    by = ""
    if len(pairs) == 1:
        by = interval(*pairs[0].difference, metric(results.metrics[results.metric])[1]).replace("\N{NO-BREAK SPACE}", " ")
        by = f" ({pairs[0].first} less {pairs[0].second}: {by}, flight by flight)".replace("-", "−")
    said.append(f"{flights:,} flights do not tell {'them' if len(pairs) == 1 else 'all of them'} apart{by}")
    enough = {flights_to_decide(pair, results.undecided): pair for pair in reversed(open_pairs)}
    if (least := min(enough)) > flights and results.searches < 2:
        who = "" if len(pairs) == 1 else f" tell {enough[least].first} from {enough[least].second}"
        count = f"about {least:,} would" if least <= MOST_FLIGHTS else f"not even {MOST_FLIGHTS:,} would"
        said.append(f"{count}{who} with a chance of {100.0 * POWER:.0f} %, if their differences are as found")
    return f": {'; '.join(said)}"


def elsewhere(results: Comparison, situation: Situation, names: list[str], name: str) -> str:
    """The medians of another metric where the least and the largest of those who are tied have intervals that lie apart."""
    cells = [(one.spreads[name].median, one.controller) for one in results.of(situation) if one.controller in names]
    cells.sort(key=lambda one: one[0].value)
    if not cells[0][0].high < cells[-1][0].low < math.inf:
        return ""
    each = [f"{unit_of(results, name).text(median.value)} ({who})" for median, who in cells if math.isfinite(median.value)]
    return f"their medians of {metric(results.metrics[name])[0]} differ, {listed(each)}"


def traded(results: Comparison, situation: Situation, pair: Pair) -> str:
    """What one of a pair has over the other, though neither is better; nothing where nothing is shown."""
    if pair.winner and pair.keeper and pair.winner != pair.keeper:
        return f"{pair.winner} keeps closer to its path, but {pair.keeper} loses fewer flights"
    if pair.winner and negligible(results, situation, pair):
        return f"{pair.winner} is better than {pair.other(pair.winner)}, by less than {100.0 * NEGLIGIBLE:g} %"
    if pair.winner:
        return (
            f"{pair.winner} is better flight by flight, but its median is not smaller than that of {pair.other(pair.winner)}"
        )
    return f"{pair.keeper} loses fewer flights than {pair.other(pair.keeper)}" if pair.keeper else ""


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
    return listed([f"'{name}'" if "," in name else name for name in names])
