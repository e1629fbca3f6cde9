"""The answer of a comparison: who is shown to be best where, and by what number."""

import math
from collections.abc import Sequence
from statistics import median as middle
from typing import NamedTuple

from quadstep.metrics.verdict import FlightGrade
from quadstep.report.units import DIGITS, listed, metric, number, percent, suited, unit_suffix
from quadstep.studies.comparison.cells import Situation
from quadstep.studies.comparison.entrants import Comparison
from quadstep.studies.comparison.ranking import Pair
from quadstep.studies.tuning.objective import NEGLIGIBLE

MOST_NAMED = 4
"""Situations that the answer names; more are counted."""

SEVERAL = 8
"""Controllers that a sentence names; more are counted, and tables have them."""


class Unit(NamedTuple):
    """What a metric is shown in. factor: times the value in SI."""

    name: str
    factor: float

    def text(self, value: float, digits: int = DIGITS) -> str:
        """A value in SI, as a sentence has it."""
        return number(self.factor * value, digits) + unit_suffix(self.name).replace("\N{NO-BREAK SPACE}", " ")


def unit_of(results: Comparison, name: str) -> Unit:
    """Of a metric by its name without unit, the same wherever it is shown: one that suits the middle of its medians."""
    medians = [abs(value) for one in results.results if math.isfinite(value := one.spreads[name].median.value)]
    return Unit(*suited(metric(results.metrics[name])[1], middle(medians) if medians else 0.0))


def answer(results: Comparison) -> str:
    """Who is best where that is shown; elsewhere who leads, and over whom that is not shown."""
    found = {situation: leading(results, situation) for situation in results.ranked}
    won = {where: best for where, (best, rivals) in found.items() if best and not rivals}
    short = all(one.grade and one.grade.grade is not FlightGrade.AS_ASKED for one in results.results)  # none of an autopilot
    nobody = f"No {results.kind} flies as asked{' in any situation' * (len(found) > 1)}: "
    untuned = results.entrants and results.kind == "controller" and not any(one.trained for one in results.entrants)
    return (
        (nobody if short else "")
        + (named(results, found, won) if len(found) <= MOST_NAMED else numbered(results, list(won.values())))
        + (" No gains were tuned for this comparison." if untuned else "")
    )


def leading(results: Comparison, situation: Situation) -> tuple[str, list[str]]:
    """Who has the smallest median, nobody where all lose half of their flights; than whom it is not shown to be better by
    more than next to nothing, or loses more flights for sure.
    """
    medians = {one.controller: one.spreads[results.metric].median.value for one in results.of(situation)}
    best = min(medians, key=medians.__getitem__)
    if not math.isfinite(medians[best]):
        return "", []
    if results.ranked[situation].copies:
        near = medians[best] + NEGLIGIBLE * abs(medians[best])
        return best, [name for name, value in medians.items() if name != best and value <= near]
    beaten = {
        other
        for pair in results.ranked[situation].pairs
        for one, other in (pair[:2], pair[1::-1])
        if pair.winner == best == one and pair.keeper != other and not negligible(results, situation, pair)
    }
    return best, [name for name in medians if name not in (best, *beaten)]


def named(results: Comparison, found: dict[Situation, tuple[str, list[str]]], won: dict[Situation, str]) -> str:
    """Situation by situation."""
    copies = all(one.copies for one in results.ranked.values())
    words = f"{'' if copies else 'median '}{metric(results.metrics[results.metric])[0]}"
    parts: list[str] = []
    for name in dict.fromkeys(won.values()):
        there = [where for where, best in won.items() if best == name]
        places = [f"{within(results, where)}({worth(results, where, name)})" for where in there]
        parts.append(f"{several([name])} {'' if parts else 'is best '}{listed(places)}")
    if parts:
        parts[0] = parts[0].replace("(", f"({words} ", 1)
    said = [f"{', '.join(parts[:-1])}{', and ' if parts[1:] else ''}{parts[-1]}."] if parts else []
    for where, (best, rivals) in found.items():
        place = within(results, where).strip()
        start = f"I{place[1:]}, " if place else ""
        if not best:
            said.append(f"{start}{'every' if start else 'Every'} {results.kind} loses at least half of its flights.")
        elif rivals:
            equal = tied(results, where, best)
            pairs = [pair for pair in results.ranked[where].pairs if best in pair[:2]]
            worse = [pair.winner for pair in pairs if pair.winner in rivals]
            lossy = [pair.keeper for pair in pairs if pair.keeper in rivals]
            left = [name for name in rivals if name not in (*equal, *worse, *lossy)]
            beside = f" ({median(results, where, left[0])})" if len(left) == 1 < len(results.ranked) else ""
            slight = any(negligible(results, where, pair) for pair in pairs)
            by = f" by {100.0 * NEGLIGIBLE:g} % or more" if slight or results.ranked[where].copies else ""
            but = [f"is not shown to be better{by} than {several(left)}{beside}"] * bool(left)
            but += [f"flight by flight is worse than {several(worse)}"] * bool(worse)
            but += [f"certainly loses more flights than {several(lossy)}"] * bool(lossy)
            has = "has" if equal == [best] else "share"
            text = f"{start}{several(equal)} {has} the smallest {words} ({worth(results, where, best)})"
            said.append(f"{text}{', but ' * bool(but)}{listed(but)}.")
    return " ".join(said)


def numbered(results: Comparison, winners: Sequence[str]) -> str:
    """In how many situations who is best."""
    count = {name: winners.count(name) for name in sorted(set(winners), key=lambda name: (-winners.count(name), name))}
    first = " is shown to be best in {} of " + f"{len(results.ranked)} situations"
    parts = [f"{name}{f' in {many}' if place else first.format(many)}" for place, (name, many) in enumerate(count.items())]
    rest = len(results.ranked) - len(winners)
    nobody = f"no {results.kind} is shown to be better than all others"
    if not parts:
        return f"In none of {len(results.ranked)} situations is one {results.kind} shown to be better than all others."
    return f"{listed(parts[:SEVERAL])}.{f' In {rest}, {nobody}.' if rest else ''}"


def within(results: Comparison, situation: Situation) -> str:
    """In which situation, without what all share, in quotes where it is more than a word, and a blank."""
    parts = [part for place, part in enumerate(situation) if len({one[place] for one in results.ranked}) > 1]
    name = ", ".join(filter(None, parts))
    return "" if not parts else f"in '{name}' " if " " in name else f"in {name} "


def median(results: Comparison, situation: Situation, name: str, digits: int = 3) -> str:
    """Of a controller's flights."""
    value = next(one.spreads[results.metric].median.value for one in results.of(situation) if one.controller == name)
    return unit_of(results, results.metric).text(value, digits) if math.isfinite(value) else "lost"


def worth(results: Comparison, situation: Situation, best: str) -> str:
    """The median of the best, what speaks against it, of one situation the next best too, and who loses flights."""
    cells = {one.controller: one for one in results.of(situation)}
    lost, grade = cells[best].lost.value, cells[best].grade
    loses = f", though it loses {percent(lost)} of its flights" if lost else ""
    if grade and grade.labels:
        nobody = len(cells) > 1 and all(one.grade and one.grade.grade is not FlightGrade.AS_ASKED for one in cells.values())
        loses += f", {f'though no {results.kind} flies' if nobody else 'but not'} as asked: {listed(grade.labels)}"
    text = median(results, situation, best) + loses
    others = {name: one for name, one in cells.items() if name not in tied(results, situation, best)}
    if others and len(results.ranked) == 1:
        second = min(others, key=lambda name: others[name].spreads[results.metric].median.value)
        both = [[median(results, situation, name, digits) for name in (best, second)] for digits in range(3, 7)]
        worse = any(pair.winner == best and second in pair[:2] for pair in results.ranked[situation].pairs)
        same = both[0][0], f"the same{', but flight by flight worse' * worse}"
        text, least = next((pair for pair in both if pair[0] != pair[1]), same)
        text += f"{loses}, next {second} with {least}" if least != "lost" else loses
    losing = [f"{name} loses {percent(one.lost.value)}" for name, one in others.items() if one.lost.value]
    if len(losing) > 2:
        return f"{text}, while {len(losing)} others lose flights"
    return f"{text}, while {listed(losing)} of its flights" if losing else text


def tied(results: Comparison, situation: Situation, best: str) -> list[str]:
    """Who has the median and the mean rank of the best, itself among them."""
    ranks = results.ranked[situation].ranks
    places = {
        one.controller: (one.spreads[results.metric].median.value, ranks[one.controller]) for one in results.of(situation)
    }
    return [name for name, place in places.items() if place == places[best]]


def negligible(results: Comparison, situation: Situation, pair: Pair) -> bool:
    """Whether a pair is decided, but by flights that all complete and hardly differ."""
    lower = min(one.spreads[results.metric].median.value for one in results.of(situation) if one.controller in pair[:2])
    return pair.winner is not None and pair.lost == 0.0 and abs(pair.difference.value) < NEGLIGIBLE * lower


def several(names: Sequence[str]) -> str:
    """Names as a sentence lists them, in quotes where one has a comma itself, or how many others they are."""
    if len(names) > SEVERAL:
        return f"{len(names)} others"
    return listed([f"'{name}'" if "," in name else name for name in names])
