"""report.html of a tuning run."""

import math
from html import escape
from pathlib import Path

from quadstep.metrics.statistics import Estimate
from quadstep.mission.key_units import label
from quadstep.report import page, units
from quadstep.report.latex import booktabs
from quadstep.report.symbols import prose
from quadstep.studies.tuning.ground import Asked
from quadstep.studies.tuning.search import Found
from quadstep.studies.tuning.unseen import AGGREGATES, UNCHANGED, Compared, Row, certain


def write_report(path: Path, asked: Asked, found: Found, compared: Compared, figure: str) -> None:
    """Write it beside tuned.toml. figure: of the search, its file without ending."""
    before, after = found.present.judged.objective, found.best.judged.objective
    drawn = page.figure(path.parent / figure, "The search: objective and gains of the candidates, over the flights flown")
    gains, measured, many = gain_rows(asked, found), measured_rows(compared), compared.flights > 1
    both_fly = (
        f"{units.counted(compared.flights, 'flight')} with each set of gains, the same for both; 95 % intervals. "
        "Differences are paired by flight."
    )
    alone = "Nothing is random in this mission, so there is one flight with each set of gains."
    body = [
        page.summary(answer(compared), facts(compared), [drawn]),
        page.heading("The gains", "gains"),
        page.table(("gain", "present", "tuned", ""), gains, lambda text: prose(escape(text))),
        page.heading("On unseen flights" if many else "Both flights", "unseen"),
        page.paragraph(both_fly if many else alone),
        page.table(("", "present", "tuned", "tuned - present"), measured),
        page.heading("The search", "search"),
        page.paragraph(
            f"Objective over the flights tuned on, their {AGGREGATES[asked.section.aggregate]}: {units.number(before)} "
            f"before, {units.number(after)} after {found.history[-1].flights} flights. Every candidate is in history.csv."
        ),
    ]
    page.write_page(path, asked.mission.name, body, "Tuning")


def write_table(path: Path, asked: Asked, found: Found, compared: Compared) -> None:
    """The gains, and what flights with them measure, for a paper."""
    header = ("", "present", "tuned", "tuned - present")
    gains = [(*one[:3], "") for one in gain_rows(asked, found)]
    comment = f"{asked.mission.name}: {units.counted(compared.flights, 'flight')} with each set of gains, 95 % intervals"
    path.write_text(booktabs(header, [gains, measured_rows(compared)], [comment]), encoding="utf-8")


def gain_rows(asked: Asked, found: Found) -> list[tuple[str, ...]]:
    """Each gain, present and tuned, and whether it ends at an edge of its range."""
    both = (found.present.values, found.best.values)
    return [
        (label(asked.mission, one.key), *(listed([values[leaf.key] for leaf in one.leaves]) for values in both),
         one.edge(found.best.values))
        for one in asked.gains
    ]  # fmt: skip


def measured_rows(compared: Compared) -> list[list[str]]:
    """Success, the objective and the metrics, with each set of gains."""
    return [shares(compared), *(row(one) for one in (compared.objective, *compared.rows))]


def answer(compared: Compared) -> str:
    """The verdict, and by how much."""
    before, difference = compared.objective.present, compared.objective.difference
    present, tuned = compared.success
    if certain(compared.success_difference, compared.flights == 1):  # which decides
        moved = "rises" if tuned.value > present.value else "falls"
        return f"{compared.verdict} Success {moved} from {units.percent(present.value)} to {units.percent(tuned.value)}."
    if compared.verdict == UNCHANGED or not before or not difference or not before.value:
        return compared.verdict
    change = difference.value / before.value
    return f"{compared.verdict} The objective {'falls' if change < 0.0 else 'rises'} by {100.0 * abs(change):.3g} %."


def listed(values: list[float]) -> str:
    """Some numbers, or just one where all are equal."""
    return ", ".join(units.number(value, 4) for value in (values if len(set(values)) > 1 else values[:1]))


def facts(compared: Compared) -> list[page.Fact]:
    """Success with either, and what the objective gains."""
    found = []
    for name, one in zip(("succeed with present gains", "succeed with tuned gains"), compared.success, strict=True):
        many = compared.flights > 1
        more = f"95 % interval: {units.percent(one.low)} to {units.percent(one.high)}" if many else ""
        span = page.Span("", one.low, one.value, one.high) if many else None
        found.append(page.Fact(name, units.percent(one.value), more, span))
    before, difference = compared.objective.present, compared.objective.difference
    if before and difference and before.value:
        low, value, high = (100.0 * part / before.value for part in (difference.low, difference.value, difference.high))
        size = max(abs(one) for one in (low, value, high) if math.isfinite(one))
        more = f"95 % interval: {low:+.3g} to {high:+.3g} %".replace("-", "−") if math.isfinite(low) else ""
        span = page.Span("", low, value, high, -1.2 * size, 1.2 * size) if math.isfinite(low) and size else None
        found.append(page.Fact("objective, tuned - present", f"{value:+.3g} %".replace("-", "−"), more, span))
    return found


def shares(compared: Compared) -> list[str]:
    """The row of success."""
    return [
        "succeed",
        *(units.percent(*(one if compared.flights > 1 else one[:1])) for one in compared.success),
        f"{100.0 * compared.success_difference.value:+.3g} points".replace("-", "−"),
    ]


def row(one: Row) -> list[str]:
    """The row of a metric."""
    words, unit = units.metric(one.name)
    return [words, *(shown(part, unit) for part in (one.present, one.tuned, one.difference))]


def shown(one: Estimate | None, unit: str) -> str:
    """A value with its interval."""
    return "–" if one is None else units.interval(*one, unit)
