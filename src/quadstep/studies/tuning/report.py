"""report.html of a tuning run: its gains, what they are worth, and what the search was."""

import math
import re
from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from quadstep.linear.grade import UNKNOWN, UNSTABLE, WORST_FIRST
from quadstep.metrics.registry import at_rest
from quadstep.metrics.statistics import Estimate
from quadstep.metrics.verdict import Case
from quadstep.mission.read import check_mission
from quadstep.mission.tune import Constraint
from quadstep.report import markup, units
from quadstep.report.evidence import Evidence, Figure, TableSection
from quadstep.report.publish import booktabs
from quadstep.studies.tuning.convergence import gain_texts
from quadstep.studies.tuning.ground import TuningRequest
from quadstep.studies.tuning.objective import AGGREGATES, NEGLIGIBLE, UNCHANGED, Compared, Row, as_asked, certain_sign
from quadstep.studies.tuning.search import SearchResult

HEADER = ("", "current", "tuned", "tuned - current")
GAINS = ("gain", "current", "tuned", "factor", "", "meaning")


def evidence(
    request: TuningRequest,
    result: SearchResult,
    compared: Compared,
    search: Sequence[Figure],
    record: dict[str, object],
    first: str = "",
    loop: Mapping[str, str] = MappingProxyType({}),
) -> Evidence:
    """What was tuned, and what it is worth. search: figures of it. record: of metrics.json. first: a sentence that
    comes before all others. loop: the grade of that at rest where nothing else does.
    """
    gains, measured, many = gain_rows(request, result), measured_rows(compared), compared.flights > 1
    both_ways = success_but(compared, loop)
    said = [both_ways] if both_ways else [*filter(None, [first]), answer(compared)]
    if compared.lacking:
        said += [f"The flight shown is not as commanded with the tuned gains: {units.listed(compared.lacking)}."]
    success = f"A flight succeeds if it completes{' and keeps every constraint on flights' if compared.kept else ''}."
    flights = f"{units.counted(compared.flights, 'flight')} with each set of gains"
    both = f"{flights}, the same for both; 95 % intervals. Differences of metrics are over flights completed with both."
    alone = "Nothing is random in this mission, so there is one flight with each set of gains."
    notes = both if many else alone, success, objective(request), compared.from_the_start
    return Evidence(
        name=request.mission.name,
        kind="Tuning",
        answer=" ".join(said),
        sentences=said,
        record=record,
        facts=facts(compared),
        sections=[
            TableSection(
                "On unseen flights" if many else "Both flights", "unseen", HEADER, measured, " ".join(filter(None, notes))
            ),
            TableSection("The gains", "gains", GAINS, gains, set_as=units.rich),
            markup.links([("tuned.toml", "the mission with the tuned gains"), ("history.csv", "every candidate")]),
            TableSection("The search", "search", text=searched(request, result, record["budget"])),
            *search,
        ],
        fold=["search"],
        paper=booktabs(
            HEADER, [[(*one[:3], "") for one in gains], measured], [f"{request.mission.name}: {flights}, 95 % intervals"]
        ),
        cases=(Case("tuned"),),
        whose="the loop with the tuned gains",
    )


def objective(request: TuningRequest) -> str:
    """What is made small, in a sentence."""
    named = [(*units.metric(request.names[name]), weight) for name, weight in request.section.objective.items()]
    terms = [f"{f'{weight:g} × ' * (weight != 1.0)}{words}{f' [{unit}]' * (unit != '-')}" for words, unit, weight in named]
    over = f", {AGGREGATES[request.section.aggregate]} over the flights" * (request.seeds > 1)
    return f"The objective is {' + '.join(terms)}{over}."


def searched(request: TuningRequest, result: SearchResult, budget: object) -> str:
    """What the search has found and when, and how many flights were flown."""
    best, last = result.best, result.history[-1].flights
    before, after = (units.number(one.judged.objective) for one in (result.present, best))
    found = f"{before} with the current gains"
    if best is not result.present:
        rest = f"; the other {last - best.flights:,} found none better" * (best.flights < last)
        found += f", {after} with the tuned ones, found within {units.counted(best.flights, 'flight')}{rest}"
    more = " The last generation still found better ones, so a larger budget may find more." * (
        best.run > 0 and best.flights == last
    )
    return (
        f"Objective over the flights used for tuning: {found}. Flights: {last:,} in the search and {2 * request.unseen} in "
        f"the comparison, {last + 2 * request.unseen:,} of a budget of {budget:,}.{more}"
    )


def caution(present: Mapping[str, str], tuned: Mapping[str, str]) -> str:
    """What to say first of tuned gains whose loop at rest is graded worse than the present one, or unstable; else nothing."""
    before, after = (one.get("grade", UNKNOWN) for one in (present, tuned))
    if after != UNSTABLE and WORST_FIRST.index(after) >= WORST_FIRST.index(before):
        return ""
    why = {"why": "ask `quadstep linear`"} if after == UNKNOWN else {}
    said = at_rest({"grade": after, **tuned, **why}, "the loop with the tuned gains")
    return f"Before you fly them: {said}."


def broken(request: TuningRequest, result: SearchResult, compared: Compared) -> str:
    """What to say first where no gains were found that lose no flight and keep the constraints; else nothing."""
    best = result.best
    if best.judged.feasible:
        return ""
    if best.judged.lost:
        return f"Even with the best gains found, {best.judged.lost} of {request.seeds} flights are lost in tuning."
    missed, excess = list(compared.missed), (best.tried.whole or best.tried.trial).violation
    if excess > 0.0:
        names = [units.metric(name)[0] for name in request.section.of_flights]
        beyond = (
            f"misses its limit by {units.percent(excess)} of it"
            if len(names) == 1
            else f"miss their limits by {units.percent(excess)} of them in all"
        )
        where = f" in the {request.seeds} flights used for tuning" if compared.flights > 1 else ""
        missed.append(f"{units.listed(names)} {beyond}{where}")
    said = f"The best gains found do not keep every constraint: {'; '.join(missed)}."
    return said.replace("\N{NO-BREAK SPACE}", " ")


def gain_rows(request: TuningRequest, result: SearchResult) -> list[tuple[str, ...]]:
    """Each gain, current and tuned, by what factor it changes, whether it ends at an edge of its range or of what the theory
    asks for, and what it is.
    """
    known, near = request.mission.controller.controller.by_key(), near_ends(request, result.best.values)
    texts = [gain_texts(request, one.values) for one in (result.present, result.best)]
    rows: list[tuple[str, ...]] = []
    for gain, name in zip(request.gains, texts[0], strict=True):
        before, after = (one.values[gain.leaves[0].key] for one in (result.present, result.best))
        factor = "unchanged" if before == after else units.number(after / before) if before * after > 0.0 else ""
        key = gain.key.removeprefix("controller.")
        rows.append(
            (
                name,
                *(one[name] for one in texts),
                factor,
                near.get(gain.key, ""),
                known[key][1].meaning if key in known else "",
            )
        )
    return rows


def near_ends(request: TuningRequest, values: Mapping[str, float]) -> dict[str, str]:
    """Gains that are near an end of their range, or the least that a condition of the theory allows, within a hundredth:
    where they are, in words.
    """
    tuned = check_mission(request.with_gains(dict(values)), str(request.path), request.path.parent)
    conditions = tuned.controller.conditions(tuned.modelled.model()) if request.section.theorem else []
    least = {
        f"controller.{one.key or one.text.split()[0]}": f"just above {one.right:g}, its limit by {one.source}"
        for one in conditions
        if one.right < one.left < 1.01 * one.right
    }
    found = {one.key: one.edge(values) or least.get(one.key, "") for one in request.gains}
    return {key: words for key, words in found.items() if words}


def measured_rows(compared: Compared) -> list[list[str]]:
    """Success, the objective and the metrics, with each set of gains."""
    rows = [with_limit(one, compared.limits[one.name]) if one.name in compared.limits else one.texts for one in compared.rows]
    alone, one = compared.flights == 1, len(compared.kept) == 1  # constraint, which is success then
    kept = [shares(f"{'success: ' * one}{what}", alone, found, asked) for what, (*found, asked) in compared.kept.items()]
    success = [] if one else [shares("success rate", alone, [*compared.success, compared.success_difference])]
    return [*success, *kept, compared.objective.texts, *rows]


def with_limit(row: Row, limit: Constraint) -> list[str]:
    """A margin with its limit, and whether either gains meet that."""
    words, unit = units.metric(row.name)
    *cells, asked = units.in_one_unit([*row[1:], (limit.value, math.nan, math.nan)], unit)
    for place, one in enumerate((row.present, row.tuned)):
        if one:
            cells[place] += ", met" if limit.keeps(np.array([one.value])).all() else ", not met"
    kept = limit.least is not None and row.present is not None and math.isclose(limit.least, row.present.value, rel_tol=1e-8)
    asked = "not below the current" if kept else f"at {'least' if limit.most is None else 'most'} {asked}"
    words = re.sub("^gain margin (up|down)", r"\1ward gain margin", words)
    return [f"{words} of the nominal mission, {asked}", *cells]


def answer(compared: Compared) -> str:
    """The verdict, by how much, which errors rise all the same, and what share succeeds where some do not."""
    present, tuned = compared.success
    moves = ""
    if compared.better:  # whatever the objective
        told = [said for one in compared.rows[:2] if " rises " in (said := moved(compared, one))]
        moves = "".join(f" The {said}." for said in told) + price(compared)
    if certain_sign(compared.success_difference, compared.flights == 1):  # which decides
        verb = "rises" if tuned.value > present.value else "falls"
        shares = (units.percent(one.value) for one in (present, tuned))
        return with_number(compared, f"success {verb} from {' to '.join(shares)}.") + moves
    said = compared.verdict
    if compared.verdict != UNCHANGED and compared.change:
        value = compared.change.value
        said = with_number(compared, f"the objective {'falls' if value < 0.0 else 'rises'} by {units.percent(abs(value))}.")
    said += moves
    if tuned.value < 1.0:
        share = f"{units.percent(tuned.value)} of the flights succeed"
        share += f", {units.percent(present.value)} with the current gains" if present.value != tuned.value else ""
        said += f" With them {share if compared.flights > 1 else 'the flight fails'}."
    return said


def success_but(compared: Compared, loop: Mapping[str, str]) -> str:
    """That more flights succeed, but that the loop is bad, and the price; nothing where that is not what decides."""
    if not (loop and compared.better and compared.flights > 1 and certain_sign(compared.success_difference, False) > 0):
        return ""
    shares = " to ".join(units.percent(one.value) for one in compared.success)
    why = loop.get("why", "").partition("; as the mission")[0]
    said = f"Success on new flights rises from {shares}, but the loop is {loop['grade']}{f': {why}' if why else ''}."
    return said + price(compared)


def with_number(compared: Compared, said: str) -> str:
    """The verdict with the number that it rests on, in one sentence where it is short enough for that."""
    return f"{compared.verdict[:-1]}: {said}" if compared.better else f"{compared.verdict} {said[:1].upper()}{said[1:]}"


def price(compared: Compared) -> str:
    """What certainly gets worse beside the errors, in a sentence after a blank: what the objective weighs, and margins; those
    that miss their limits stand before all this.
    """
    worse, less = [], []
    for one in compared.rows[2:]:
        limit, said, name = compared.limits.get(one.name), moved(compared, one), units.metric(one.name)[0]
        worse += [f"more {name}"] * (one.name in compared.weighed and " rises " in said)
        less += [f"less {name}"] * bool(limit and one.tuned and " falls " in said and limit.slack(one.tuned.value) >= 0.0)
    worse += less if len(less) < 2 else ["smaller margins"]
    return f" The price: {units.listed(worse)}." if worse else ""


def moved(compared: Compared, one: Row) -> str:
    """That a metric, or its mean, certainly rises or falls, as a clause; nothing where that is not shown, or negligible."""
    if not (one.present and one.tuned and one.difference):
        return ""
    alone = compared.flights == 1
    sign, change = certain_sign(one.difference, alone), one.difference.value
    if (
        abs(change) <= NEGLIGIBLE * one.present.value
        or sign * change <= 0.0
        or sign * (one.tuned.value - one.present.value) <= 0.0
    ):
        return ""
    words, unit = units.metric(one.name)
    before, after, _ = (each.replace("\N{NO-BREAK SPACE}", " ") for each in units.in_one_unit(one[1:], unit, units.estimate))
    mean = "" if alone or one.name in compared.limits else "mean "
    return f"{mean}{words} {'rises' if sign > 0 else 'falls'} from {before} to {after}" if before != after else ""


def facts(compared: Compared) -> list[markup.Fact]:
    """What becomes of the error and of the objective."""
    if not compared.change or compared.verdict == UNCHANGED:
        return []
    words = "mean " * (compared.flights > 1) + compared.rows[0].texts[0]
    before, after, _ = units.in_one_unit(compared.rows[0][1:], "m", units.estimate)
    value, low, high = (100.0 * part for part in compared.change)
    more = f"95 % interval: [{low:+.3g}, {high:+.3g}] %".replace("-", "−") if math.isfinite(low) else ""
    changed = markup.Fact("objective, tuned - current", f"{value:+.3g} %".replace("-", "−"), more)
    return [markup.Fact(f"{words}, current to tuned", f"{before} → {after}"), changed]


def shares(words: str, alone: bool, found: Sequence[Estimate], asked: float = math.nan) -> list[str]:
    """A row of shares of flights with current and tuned gains, whether they are as large as asked, and the difference."""
    cells = [units.percent(*(one[:1] if alone else one)) for one in found[:2]]
    if not math.isnan(asked):
        cells = [f"{cell}, {as_asked(one, asked, alone)}" for cell, one in zip(cells, found, strict=False)]
    words += f", in {units.percent(asked)} of the flights{' flown' * (asked == 1.0)}" * (asked > 0.0 and not alone)
    value, *ends = (f"{100.0 * one + 0.0:+.3g}" for one in found[2])
    between = f" [{', '.join(ends)}]" * (math.isfinite(found[2].low) and not alone)
    return [words, *cells, f"{value}{between} points".replace("-", "−")]
