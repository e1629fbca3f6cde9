"""report.html of a tuning run, and its picture: the objective and the gains of every candidate over the flights."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from quadstep.linear.grade import UNKNOWN, UNSTABLE, WORST_FIRST
from quadstep.metrics.registry import at_rest, at_rest_sentences
from quadstep.metrics.statistics import Estimate
from quadstep.metrics.verdict import Case
from quadstep.mission.fields import label
from quadstep.mission.tune import Constraint
from quadstep.report import markup, units
from quadstep.report.axes import plain_decades
from quadstep.report.canvas import LINES, figure_at, legend_columns
from quadstep.report.colours import COLOURS
from quadstep.report.evidence import Evidence, Figure, TableSection
from quadstep.report.publish import booktabs
from quadstep.report.sheet import PHONE, Sheet
from quadstep.studies.tuning.gains import TunedGain
from quadstep.studies.tuning.ground import TuningRequest
from quadstep.studies.tuning.objective import AGGREGATES, NEGLIGIBLE, UNCHANGED, Compared, Row, certain_sign
from quadstep.studies.tuning.search import Candidate, SearchResult

HEADER = ("", "present", "tuned", "tuned - present")


def evidence(
    request: TuningRequest, result: SearchResult, compared: Compared, figure: str, record: dict[str, object], first: str = ""
) -> Evidence:
    """What was tuned, and what it is worth. figure: of the search, its file without ending. record: of metrics.json. first: a
    sentence that comes before all others.
    """
    before, after = result.present.judged.objective, result.best.judged.objective
    gains, measured, many = gain_rows(request, result), measured_rows(compared), compared.flights > 1
    success = f"A flight succeeds if it completes{' and keeps every constraint on flights' if compared.kept else ''}."
    flights = f"{units.counted(compared.flights, 'flight')} with each set of gains"
    both = f"{flights}, the same for both; 95 % intervals. Differences are paired by flight."
    alone = "Nothing is random in this mission, so there is one flight with each set of gains."
    search = (
        f"Objective ({AGGREGATES[request.section.aggregate]} over the flights used for tuning): {units.number(before)} "
        f"before, {units.number(after)} after {result.history[-1].flights} flights."
    )
    missed = any(not one.judged.feasible and math.isfinite(one.judged.objective) for one in result.history)
    return Evidence(
        name=request.mission.name,
        kind="Tuning",
        answer=" ".join(filter(None, (first, answer(compared)))),
        sentences=[*filter(None, [first]), answer(compared)],
        record=record,
        facts=facts(compared),
        figures=[
            Figure(
                figure,
                f"Above: the objective of each candidate, {units.number(before)} at first, {units.number(after)} at last"
                f"{'; a cross is a candidate that misses a constraint or loses a flight' * missed}. "
                "Below: the best gains so far, each from the low to the high end of its range, which the legend says.",
            )
        ],
        sections=[
            markup.links([("tuned.toml", "the mission with the tuned gains"), ("history.csv", "every candidate")]),
            TableSection("The gains", "gains", ("gain", *HEADER[1:3], ""), gains, set_as=units.rich),
            TableSection(
                "On unseen flights" if many else "Both flights",
                "unseen",
                HEADER,
                measured,
                f"{both if many else alone} {success}",
            ),
            TableSection("The search", "search", text=search),
        ],
        paper=booktabs(
            HEADER, [[(*one[:3], "") for one in gains], measured], [f"{request.mission.name}: {flights}, 95 % intervals"]
        ),
        cases=(Case("tuned"),),
        whose="the loop with the tuned gains",
    )


def caution(present: Mapping[str, str], tuned: Mapping[str, str]) -> str:
    """What to say first of tuned gains whose loop at rest is graded worse than the present one, or unstable; else nothing."""
    before, after = (one.get("grade", UNKNOWN) for one in (present, tuned))
    if after != UNSTABLE and WORST_FIRST.index(after) >= WORST_FIRST.index(before):
        return ""
    why = {"why": "ask `quadstep linear`"} if after == UNKNOWN else {}
    said = at_rest({"grade": after, **tuned, **why}, "the loop with the tuned gains")
    return " ".join(
        [f"Before you fly them: {said}.", *at_rest_sentences({"grade": before}, "the loop with the present gains")]
    )


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
            f"misses its limit by {units.percent(excess)}"
            if len(names) == 1
            else f"miss their limits by {units.percent(excess)} in all"
        )
        where = f" in the {request.seeds} flights used for tuning" if compared.flights > 1 else ""
        missed.append(f"{units.listed(names)} {beyond}{where}")
    said = f"The best gains found do not keep every constraint: {'; '.join(missed)}."
    return said.replace("\N{NO-BREAK SPACE}", " ")


def gain_rows(request: TuningRequest, result: SearchResult) -> list[tuple[str, ...]]:
    """Each gain, present and tuned, and whether it ends at an edge of its range."""
    both = (result.present.values, result.best.values)
    return [
        (label(request.mission, one.key), *(listed([values[leaf.key] for leaf in one.leaves]) for values in both),
         one.edge(result.best.values))
        for one in request.gains
    ]  # fmt: skip


def measured_rows(compared: Compared) -> list[list[str]]:
    """Success, the objective and the metrics, with each set of gains."""
    rows = [with_limit(one, compared.limits[one.name]) if one.name in compared.limits else one.texts for one in compared.rows]
    alone = compared.flights == 1
    kept = [
        shares(f"{what}{f', in {units.percent(asked)} of the flights' * (not alone)}", alone, found, asked)
        for what, (*found, asked) in compared.kept.items()
    ]
    success = shares("succeed", alone, [*compared.success, compared.success_difference])
    return [success, *kept, compared.objective.texts, *rows]


def with_limit(row: Row, limit: Constraint) -> list[str]:
    """A margin with its limit, and whether either gains meet that."""
    words, unit = units.metric(row.name)
    *cells, asked = units.in_one_unit([*row[1:], (limit.value, math.nan, math.nan)], unit)
    for place, one in enumerate((row.present, row.tuned)):
        if one:
            cells[place] += ", met" if limit.keeps(np.array([one.value])).all() else ", not met"
    return [f"{words}, at {'least' if limit.most is None else 'most'} {asked}", *cells]


def answer(compared: Compared) -> str:
    """The verdict, by how much, and what share succeeds where some do not."""
    present, tuned = compared.success
    errors = compared.rows[:2] if compared.better else []  # whatever the objective
    moves = "".join(move(one, compared.flights == 1) for one in errors)
    if certain_sign(compared.success_difference, compared.flights == 1):  # which decides
        moved = "rises" if tuned.value > present.value else "falls"
        shares = (units.percent(*(one if compared.flights > 1 else one[:1])) for one in (present, tuned))
        return with_number(compared, f"success {moved} from {' to '.join(shares)}.") + moves
    said = compared.verdict
    if compared.verdict != UNCHANGED and compared.change:
        value, *ends = compared.change
        low, high = sorted(map(abs, ends)) if ends[0] * ends[1] > 0.0 and ends[1] - ends[0] > 1e-9 else (math.nan, math.nan)
        by = units.percent(abs(value), low, high)
        said = with_number(compared, f"the objective {'falls' if value < 0.0 else 'rises'} by {by}.")
    said += moves
    if tuned.value < 1.0:
        share = f"{units.percent(tuned.value)} of the flights succeed"
        share += f", {units.percent(present.value)} with the present gains" if present.value != tuned.value else ""
        said += f" With them {share if compared.flights > 1 else 'the flight fails'}."
    return said


def with_number(compared: Compared, said: str) -> str:
    """The verdict with the number that it rests on, in one sentence where it is short enough for that."""
    return f"{compared.verdict[:-1]}: {said}" if compared.better else f"{compared.verdict} {said[:1].upper()}{said[1:]}"


def move(one: Row, alone: bool) -> str:
    """That a metric certainly rises or falls, in a sentence after a blank; nothing where that is not shown, or negligible."""
    if not (one.present and one.tuned and one.difference):
        return ""
    sign, change = certain_sign(one.difference, alone), one.difference.value
    if (
        abs(change) <= NEGLIGIBLE * one.present.value
        or sign * change <= 0.0
        or sign * (one.tuned.value - one.present.value) <= 0.0
    ):
        return ""
    words, unit = units.metric(one.name)
    both = units.in_one_unit([(each.value, math.nan, math.nan) for each in (one.present, one.tuned)], unit)
    before, after = (each.replace("\N{NO-BREAK SPACE}", " ") for each in both)
    said = f" The {'' if alone else 'mean '}{words} {'rises' if sign > 0 else 'falls'} from {before} to {after}."
    return said if before != after else ""


def listed(values: list[float]) -> str:
    """Some numbers, or just one where all are equal."""
    return ", ".join(units.number(value, 4) for value in (values if len(set(values)) > 1 else values[:1]))


def facts(compared: Compared) -> list[markup.Fact]:
    """Success with either, and what the objective gains."""
    found = []
    for name, one in zip(("succeed with present gains", "succeed with tuned gains"), compared.success, strict=True):
        many = compared.flights > 1
        more = f"95 % interval: {units.percent(one.low)} to {units.percent(one.high)}" if many else ""
        found.append(markup.Fact(name, units.percent(one.value), more))
    if compared.change:
        value, low, high = (100.0 * part for part in compared.change)
        more = f"95 % interval: {low:+.3g} to {high:+.3g} %".replace("-", "−") if math.isfinite(low) else ""
        found.append(markup.Fact("objective, tuned - present", f"{value:+.3g} %".replace("-", "−"), more))
    return found


def shares(words: str, alone: bool, found: Sequence[Estimate], asked: float = math.nan) -> list[str]:
    """A row of shares of flights with present and tuned gains, whether they are as large as asked, and the difference."""
    cells = [units.percent(*(one[:1] if alone else one)) for one in found[:2]]
    if not math.isnan(asked):
        cells = [f"{cell}, {'met' if one.value >= asked else 'not met'}" for cell, one in zip(cells, found, strict=False)]
    return [words, *cells, f"{100.0 * found[2].value:+.3g} points".replace("-", "−")]


def draw_search(path: Path, request: TuningRequest, result: SearchResult, sheet: Sheet) -> None:
    """Write `path` in the sheet's formats."""
    rows = len(request.gains)  # of the legend of the gains, at most
    height = 3.9 + 0.16 * rows
    apart = (0.27 + 0.16 * rows) / (0.5 * (height - 1.3 - 0.16 * rows))
    sides = 0.18, 0.48 / height, 0.955, 1.0 - 0.55 / height, 0.2, apart
    with figure_at(path, sheet, (PHONE, height, 4.2), *sides) as figure:
        top, bottom = figure.subplots(2, 1, sharex=True)
        draw_objective(top, result)
        draw_gains(bottom, request, result)
        for axes, most in ((top, 3), (bottom, 4)):
            marks, names = axes.get_legend_handles_labels()
            if marks:
                ncols = legend_columns(figure.get_figwidth(), names, most)
                legend = axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.1, ncols=ncols)
                for text in legend.get_texts():
                    text.set_parse_math(True)
        bottom.set_xlabel("flights")
        figure.align_ylabels()


def draw_objective(axes: Axes, result: SearchResult) -> None:
    """Every candidate's, told apart by whether it completed and kept the constraints, and the best so far."""
    known = [one for one in result.history if math.isfinite(one.judged.objective)]
    kinds = (
        ("feasible", [one for one in known if one.judged.feasible], {"marker": ".", "color": "0.55"}),
        (
            "a constraint broken or a flight lost",
            [one for one in known if not one.judged.feasible],
            {"marker": "x", "color": COLOURS["vermillion"], "linewidths": 0.7},
        ),
    )
    for kind, candidates, marks in kinds:
        if candidates:
            places, values = zip(*((one.flights, one.judged.objective) for one in candidates), strict=True)
            axes.scatter(places, values, s=14, label=kind, **marks)
    best = [one for one in leaders(result) if math.isfinite(one.judged.objective)]
    if best:
        last = result.history[-1].flights
        axes.step(
            [*(one.flights for one in best), last], [*(one.judged.objective for one in best), best[-1].judged.objective],
            where="post", label="best so far", **LINES[0],
        )  # fmt: skip
    if known and min(one.judged.objective for one in known) > 0.0:
        axes.set_yscale("log")
        plain_decades(axes.yaxis)
    axes.set_ylabel("objective")


def draw_gains(axes: Axes, request: TuningRequest, result: SearchResult) -> None:
    """Those of the best so far, each in its range."""
    best = leaders(result)
    last = result.history[-1].flights
    for place, one in enumerate(request.gains):
        values = [candidate.point[place] for candidate in best]
        style = LINES[place % len(LINES)]
        flights = [*(candidate.flights for candidate in best), last]
        axes.step(flights, [*values, values[-1]], where="post", label=gain_range(request, one), **style)
    axes.set_ylim(-0.03, 1.03)
    axes.set_yticks([0.0, 1.0], ["low", "high"])
    axes.set_ylabel("best gain so far")


def gain_range(request: TuningRequest, one: TunedGain) -> str:
    """A gain, its unit and its range."""
    name, *unit = label(request.mission, one.key).removeprefix("controller ").partition(" [")
    return f"{units.label(name)}{''.join(unit)}: {one.range.low:.4g} to {one.range.high:.4g}"


def leaders(result: SearchResult) -> list[Candidate]:
    """Each candidate that was the best so far."""
    best: list[Candidate] = []
    for one in result.history:
        if one.leads(best[-1] if best else None):
            best.append(one)
    return best
