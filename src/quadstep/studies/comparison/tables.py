"""A comparison as tables: CSV and Parquet for machines, LaTeX for a paper, and rows of text for the screen and the report."""

import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import pyarrow as pa

from quadstep.report.publish import booktabs, cell, write_csv
from quadstep.report.units import counted, listed, number, percent
from quadstep.studies.campaign.store import parquet
from quadstep.studies.comparison.answer import leaders, unit_of
from quadstep.studies.comparison.cost import BOARD
from quadstep.studies.comparison.entrants import Comparison, SituationResult
from quadstep.studies.comparison.words import NOTHING, activity, interval_text, measured, share_lost, title

Row = dict[str, object]


def cell_rows(results: Comparison) -> Iterator[Row]:
    """One row per cell, SI units; what is infinite (lost) or missing is None."""
    for one in results.results:
        row: Row = {**one.situation._asdict(), "controller": one.controller, "flights": one.flights}
        row |= {"lost_share": one.lost.value, "lost_low": one.lost.low, "lost_high": one.lost.high}
        for name, spread in one.spreads.items():
            unit = results.metrics[name].removeprefix(name)
            row[f"{name}_mean{unit}"] = spread.mean
            for what, estimate in (("median", spread.median), ("p95", spread.high)):
                row |= {f"{name}_{what}{unit}": estimate.value}
                row |= {f"{name}_{what}_low{unit}": estimate.low, f"{name}_{what}_high{unit}": estimate.high}
        graded = one.grade
        row |= {"grade": graded and graded.grade.value, "grade_reasons": "; ".join(graded.reasons) if graded else None}
        row |= dict(zip(("energy[J]", "rotor_activity[N/s]", "saturation"), one.effort, strict=True))
        yield {name: cell(value) for name, value in row.items()}


def pair_rows(results: Comparison) -> Iterator[Row]:
    """One row per pair of controllers and situation, SI units."""
    unit = results.metrics[results.metric].removeprefix(results.metric)
    for situation, ranked in results.ranked.items():
        for one in ranked.pairs:
            row: Row = {
                **situation._asdict(),
                "first": one.first,
                "second": one.second,
                f"difference{unit}": one.difference.value,
                f"difference_low{unit}": one.difference.low,
                f"difference_high{unit}": one.difference.high,
                "first_better_share": one.better,
                "rank_biserial": one.effect,
                "p_holm": one.p,
                "better": one.winner,
                "lost_difference": one.lost,
                "p_lost_holm": one.p_lost,
                "loses_fewer": one.keeper,
            }
            yield {name: cell(value) for name, value in row.items()}


def write_tables(out: Path, results: Comparison) -> None:
    """cells.csv, cells.parquet, pairs.csv, pairs.parquet, and times.csv: what is measured, never twice the same."""
    for name, rows in (("cells", list(cell_rows(results))), ("pairs", list(pair_rows(results)))):
        if rows:
            write_csv(out / f"{name}.csv", list(rows[0]), (list(row.values()) for row in rows))
            (out / f"{name}.parquet").write_bytes(parquet(pa.Table.from_pylist(rows)))
    times = [(*controller, one.nanoseconds) for controller, one in results.costs.items()]
    write_csv(out / TIMES, ("vehicle", "controller", "nanoseconds_per_sample"), times)


# Text


def short(results: Comparison, one: SituationResult) -> str:
    """A cell in few words: median, 95 % quantile, what is lost, and whether its median flight is not as commanded."""
    spread, factor = one.spreads[results.metric], unit_of(results, results.metric).factor
    parts = [number(factor * value) if math.isfinite(value) else "lost" for value in (spread.median.value, spread.high.value)]
    lost = f", {share_lost(one)}" if one.lost.value > 0.0 else ""
    return f"{parts[0]}{f' ({parts[1]})' * results.spreads}{lost}{' !' * bool(one.grade and one.grade.labels)}"


def marks(results: Comparison, vehicle: str) -> str:
    """What the mark of a flight that is not as commanded means, in a sentence after a blank; nothing where there is none."""
    graded = [one.grade for one in results.results if one.grade and one.situation.vehicle == vehicle]
    why = dict.fromkeys(label for one in graded for label in one.labels)
    return f" !: the median flight is not as commanded ({listed([*why])})." * bool(why)


def matrix(results: Comparison, vehicle: str) -> tuple[list[str], list[list[str]]]:
    """Header and rows: situations of a vehicle by controller."""
    names = list(dict.fromkeys(one.controller for one in results.results if one.situation.vehicle == vehicle))
    rows = []
    for situation in results.ranked:
        if situation.vehicle == vehicle:
            there = {one.controller: short(results, one) for one in results.of(situation)}
            rows.append([results.place(situation) or "the missions", *(there.get(name, NOTHING) for name in names)])
    return ["", *names], rows


def full_rows(results: Comparison, vehicle: str) -> tuple[list[str], list[list[str]]]:
    """Header and rows: every cell of a vehicle with all its intervals."""
    names = [f"{what} {title(results, name)}" for name in results.metrics for what in ("median", "95 %", "mean")]
    rows = []
    for one in results.results:
        if one.situation.vehicle == vehicle:
            row = [results.place(one.situation), one.controller, percent(*one.lost)]
            row.append(", ".join(one.grade.labels or [one.grade.grade]) if one.grade else NOTHING)
            for name in results.metrics:
                spread, factor = one.spreads[name], unit_of(results, name).factor
                mean = number(factor * spread.mean) if math.isfinite(spread.mean) else NOTHING
                row += [interval_text(spread.median, factor), interval_text(spread.high, factor), mean]
            rows.append(row)
    return ["situation", results.kind, "lost", "median flight", *names], rows


def effort_rows(results: Comparison, vehicle: str) -> list[list[str]]:
    """What tracking takes, cell by cell."""
    return [
        [
            results.place(one.situation),
            one.controller,
            *(f"{value:.4g}" if math.isfinite(value) else NOTHING for value in one.effort[:2]),
            f"{100.0 * one.effort.saturation:.2g} %" if math.isfinite(one.effort.saturation) else NOTHING,
        ]
        for one in results.results
        if one.situation.vehicle == vehicle
    ]


TIMES = "times.csv"
EFFORT_HEADER = ("situation", "controller", "energy [J]", "rotor activity [N/s]", "rotors saturated")
WHO_HEADER = (
    "vehicle", "controller", "gains", "tuned", "flights", "flights per gain", f"instructions ({BOARD})", "memory [B]",
    "numbers [B]", "rotor activity [N/s]",
)  # fmt: skip
DIFFERS_HEADER = ("vehicle", "controller", "commands", "measures also", "looks ahead", "sample times")
DECISION_HEADER = ("situation", "first, second", "second − first", "verdict")
MARGIN_HEADER = ("margin", "vehicle", "controller", "50 % fail at", "5 % fail at", "other flights failing at the 50 % point")


def who_rows(results: Comparison) -> list[list[str]]:
    """How each controller was tuned, and what it costs."""
    rows = []
    for one in results.entrants:
        trained, cost = one.trained, results.costs.get((one.vehicle, one.name))
        tuned = (trained.tuned, trained.flights, f"{trained.flights / trained.tuned:.0f}") if trained else (None,) * 3
        costs = (cost.instructions, cost.memory, cost.numbers) if cost else (None,) * 3
        rotors = activity(results, one.vehicle).get(one.name)
        work = None if rotors is None else f"{rotors:.3g}"
        known = (NOTHING if part is None else str(part) for part in (*tuned, *costs, work))
        rows.append([one.vehicle or NOTHING, one.name, one.origin, *known])
    return rows


def margin_rows(results: Comparison) -> list[list[str]]:
    rows = []
    for (name, vehicle, controller), one in results.margins.items():
        entry = results.raised[name]
        points = []
        for estimate in (one.half, one.few):
            value, low, high = (range_text(part, entry.low, entry.high) for part in estimate)
            shown = value if low == value == high else f"{value} [{low}, {high}]"
            points.append(f"{shown}{f' {entry.unit}' if entry.unit else ''}")
        rows.append([name, vehicle, controller, *points, percent(*one.checked) if one.checked else NOTHING])
    return rows


def range_text(value: float, low: float, high: float) -> str:
    """A value within a range, or that it is beyond it; a dash for one that too few flights leave unknown."""
    if math.isnan(value):
        return NOTHING
    if value == math.inf:
        return f"> {high:g}"
    return f"{value:.3g}" if value > low else f"<= {low:g}"


# LaTeX

LOOP = (
    ("gain margin [dB]", lambda one: min(one["gain_margin_up"], one["gain_margin_down"])),
    ("phase margin [\u00b0]", lambda one: math.degrees(one["phase_margin"])),
    ("delay margin [ms]", lambda one: 1e3 * one["delay_margin"]),
)


def latex_tables(results: Comparison) -> str:
    """A table for each vehicle: medians with 95 % quantiles, in bold of those who are best or tied for best, and margins."""
    tables = []
    for vehicle in results.vehicles:
        header, rows = matrix(results, vehicle)
        there = [one for one in results.ranked if one.vehicle == vehicle]
        bold = [(0, i, header.index(name)) for i, situation in enumerate(there) for name in leaders(results, situation)]
        text = f"{results.name}: {measured(results)}, {counted(results.seeds, 'flight')} per cell"
        loops = [[name, *(loop_cell(results, vehicle, one, value) for one in header[1:])] for name, value in LOOP]
        comments = [
            text,
            *filter(None, (vehicle, marks(results, vehicle).strip())),
            "margins: the least over all channels, at rest",
        ]
        tables.append(booktabs(header, [rows, loops], comments, bold))
    return "\n".join(tables)


def loop_cell(results: Comparison, vehicle: str, controller: str, value: Callable[[Mapping[str, float]], float]) -> str:
    """A margin of a loop at rest; a dash where it is not linearised."""
    one = results.linear.get((vehicle, controller))
    return NOTHING if one is None or not one.metrics else f"{value(one.metrics):.3g}"
