"""The files of a comparison: tables, figures, report, and the page on which the best fly the same flight."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from quadstep.io.errors import UserError
from quadstep.io.version import __version__
from quadstep.page.identity import identity
from quadstep.report import page
from quadstep.report.publish import MANIFEST, write_json
from quadstep.report.sheet import Sheet
from quadstep.report.units import counted
from quadstep.studies.comparison import linear, tables, words
from quadstep.studies.comparison.found import Comparison
from quadstep.studies.comparison.ghosts import ghosts
from quadstep.studies.comparison.jobs import Job
from quadstep.studies.comparison.picture import MANY, draw_vehicle
from quadstep.studies.comparison.study import Cell

REPORT, PAGE, SUMMARY = "report.html", "page.html", "results.md"

IN_SUMMARY = 3
"""Figures."""


def write_results(out: Path, found: Comparison, flights: Sequence[Job[Cell]], sheet: Sheet) -> None:
    """Everything but the flights and gains. Raises UserError."""
    tables.write_tables(out, found)
    vehicles = list(dict.fromkeys(one.vehicle for one in found.situations))
    drawn = {vehicle: Path("figures") / (identity(vehicle, ()) if vehicle else "missions") for vehicle in vehicles}
    (out / SUMMARY).write_text(markdown(found, drawn), encoding="utf-8")
    (out / "figures").mkdir()
    for vehicle, name in drawn.items():
        draw_vehicle(
            out / name, found, vehicle, sheet if "svg" in sheet.formats else sheet._replace(formats=(*sheet.formats, "svg"))
        )
    links, missing = write_ghosts(out, found, flights)
    write_json(out / MANIFEST, as_json(found, flights))
    page.write_page(out / REPORT, found.name, sections(out, found, drawn, links, missing), "Comparison")


def write_ghosts(out: Path, found: Comparison, flights: Sequence[Job[Cell]]) -> tuple[list[tuple[str, str]], str]:
    """page.html; links into it with what they show, or why there is none."""
    try:
        shown = ghosts(found, flights)
    except UserError as error:
        return [], str(error)
    (out / PAGE).write_text(shown.html, encoding="utf-8")
    return [(f"{PAGE}#flight={flight}{f'&ghost={ghost}' if ghost else ''}", text) for flight, ghost, text in shown.flights], ""


def sections(out: Path, found: Comparison, drawn: dict[str, Path], links: list[tuple[str, str]], missing: str) -> list[str]:
    metric = words.title(found.metrics[found.metric])
    first, *others = words.sentences(found)
    if len(found.ranked) == 1 and len(found.controllers) > 1:  # who is best there is the answer
        first, others = others[0].removeprefix(f"{words.MISSIONS}: "), [first, *others[1:]]
    figures = {
        vehicle: page.figure(
            out / name,
            f"{metric} for every situation and controller{f', {vehicle}' if vehicle else ''}: median, to the 95 % quantile",
            coded=len(found.controllers) > MANY,  # squares, whose colours are values
        )
        for vehicle, name in drawn.items()
    }
    shown = list(figures)[:IN_SUMMARY]
    body = [page.summary(first, facts(found), [figures[one] for one in shown])]
    body += [page.listing(others), page.paragraph(f"{words.METHOD} {words.searches(found)} {words.tests(found)}")]
    body += [page.heading("Limitations", "limits"), page.listing(found.limitations)] if found.limitations else []
    if links:
        body.append(page.links(links, "See the best two fly the same gust:"))
    else:
        body += [page.paragraph(f"There is no page of flights: {missing}.")]
    for vehicle in drawn:
        label = vehicle or "Missions"
        header, rows = tables.matrix(found, vehicle)
        body += [
            page.heading(label, identity(label, ())),
            *([] if vehicle in shown else [figures[vehicle]]),
            page.paragraph(
                f"{metric}: median (95 % quantile) of {counted(found.seeds, 'flight')}; a lost flight ranks worse than any "
                "other."
            ),
            page.table(header, rows),
        ]
    if len(found.controllers) > 1:
        body += [
            page.heading("Pairwise comparison", "pairs"),
            page.paragraph(
                "Number of situations in which the row's controller is significantly better than the column's / "
                "undecided / worse."
            ),
            page.table(("", *found.controllers), words.wins(found)),
            page.table(
                ("controller", f"mean rank over {words.ranked_in(found)}, from 0 (best) to 1"),
                [[name, f"{rank:.2f}"] for name, rank in found.overall().items()],
            ),
        ]
    body += [
        page.heading("Gains and cost", "gains"),
        page.paragraph(
            "All tuned gains were found with the same flights, objective and budget, and evaluated on other flights. "
            "Gains "
            "derived from the vehicle use the nominal vehicle, whatever a scenario changes. Instructions are those of the "
            f"exported law's worst sample, all its loops due, in f32; {tables.TIMES} has the time of each law alone, as "
            "scalar code on one core of this machine. " + " ".join(words.uncounted(found))
        ),
        page.table(tables.WHO_HEADER, tables.who_rows(found)),
        page.paragraph("Other differences between the controllers; everything else is the same for all:"),
        page.table(tables.DIFFERS_HEADER, tables.differing_rows(found)),
    ]
    if found.linear:
        body += [
            page.heading("Linear margins", "linear"),
            page.paragraph(
                "The sampled loop at rest at the start of the path, without noise: one loop is opened at a time, and "
                "the table "
                "shows the smallest margin over all channels. An estimator is left out, together with the fix latency that it "
                "compensates. `quadstep linear` gives details."
            ),
            page.table(linear.HEADER, linear.rows(found.linear)),
            page.listing(linear.unlinearised(found.linear)),
        ]
    if found.margins:
        body += [
            page.heading("Margins", "margins"),
            page.paragraph(
                "A disturbance is increased until flights fail, that is, are lost or exceed the error limit. The last "
                "column is the share of an equal number of other flights that fail at the 50 % point."
            ),
            page.table(tables.MARGIN_HEADER, tables.margin_rows(found)),
        ]
    for vehicle in drawn:
        header, rows = tables.full_rows(found, vehicle)
        label = vehicle or "missions"
        body += [page.heading(f"All numbers: {label}", f"all-{identity(label, ())}"), page.table(header, rows)]
        body += [page.table(tables.EFFORT_HEADER, tables.effort_rows(found, vehicle))]
    return body


def facts(found: Comparison) -> list[page.Fact]:
    """Who is best, and how much is decided."""
    controllers, situations = counted(len(found.controllers), "controller"), counted(len(found.ranked), "situation")
    flown = page.Fact("flights", f"{found.seeds} each", f"{controllers} in {situations}")
    if len(found.controllers) < 2:
        return [flown]
    (best, rank), *_ = found.overall().items()
    decided = sum(pair.winner is not None for one in found.ranked.values() for pair in one.pairs)
    first = page.Fact("best mean rank", best, f"{rank:.2f}, from 0 (best) to 1")
    pairs = page.Fact("pairs decided", f"{decided} of {found.pairs}", "with 95 % confidence in all of them jointly")
    return [first, pairs, flown] if found.pairs else [first, flown]


def as_json(found: Comparison, flights: Sequence[Job[Cell]]) -> dict[str, object]:
    files = {job.subject.label: f"{job.kind}/{job.key}.parquet" for job in flights}
    unit = found.metrics[found.metric].removeprefix(found.metric)
    return {
        "name": found.name,
        "version": __version__,
        "study": found.source,
        "seeds": found.seeds,
        "seed": found.seed,
        "metric": found.metrics[found.metric],
        "sentences": words.sentences(found),
        "cells": list(tables.cell_rows(found)),
        "pairs": list(tables.pair_rows(found)),
        "overall": found.overall(),
        "friedman": {situation.label: one.friedman for situation, one in found.ranked.items()},
        "controllers": [
            {
                "vehicle": one.vehicle,
                "controller": one.name,
                "gains": one.origin,
                "tuned": one.trained and one.trained._asdict(),
            }
            for one in found.entrants
        ],
        "margins": [
            {"margin": row[0], "vehicle": row[1], "controller": row[2], "half": row[3], "few": row[4], "checked": row[5]}
            for row in tables.margin_rows(found)
        ],
        "linear": [
            {
                "vehicle": vehicle,
                "controller": controller,
                "grade": one.grade,
                "why": one.why,
                **one.metrics,
            }
            for (vehicle, controller), one in found.linear.items()
        ],
        "difference_unit": unit,
        "flights": files,
        "problems": [one.line for one in found.problems],
        "left_out": list(found.left_out),
    }


def markdown(found: Comparison, drawn: Mapping[str, Path]) -> str:
    """The page. drawn: the figure of each vehicle, without its ending."""
    first, *others = words.sentences(found)
    parts = [f"# {found.name}", f"Made by quadstep {__version__} from `{Path(found.source).name}`, seed {found.seed}.", first]
    if found.limitations:
        parts += ["## Limitations", bullets(found.limitations)]
    for vehicle in dict.fromkeys(one.vehicle for one in found.situations):
        metric = words.title(found.metrics[found.metric])
        parts += [
            f"## {vehicle or 'Missions'}",
            f"{metric}: median (95 % quantile) of {counted(found.seeds, 'flight')}; a lost flight ranks worse than any other.",
            f"![{metric} for every situation and controller]({drawn[vehicle].as_posix()}.png)",
            table(*turned(*tables.matrix(found, vehicle))),
        ]
    if found.margins:
        parts += [
            "## Margins",
            "A disturbance is increased until flights fail, that is, are lost or exceed the error limit.",
            table(tables.MARGIN_HEADER, tables.margin_rows(found)),
        ]
    parts += ["## Situation by situation", bullets(others), " ".join(filter(None, (words.METHOD, words.searches(found))))]
    if len(found.controllers) > 1:
        ranked = [[name, f"{rank:.2f}"] for name, rank in found.overall().items()]
        parts += ["## Mean ranks", table(("controller", f"over {words.ranked_in(found)}, from 0 (best) to 1"), ranked)]
    parts += ["## Gains and cost", table(tables.WHO_HEADER, tables.who_rows(found)), *words.uncounted(found)]
    return "\n\n".join(parts) + "\n"


def turned(header: Sequence[str], rows: Sequence[Sequence[str]]) -> tuple[list[str], list[list[str]]]:
    """A table with its rows as columns: controllers are many, situations few."""
    first, *names = header
    return [first, *(row[0] for row in rows)], [[name, *(row[i + 1] for row in rows)] for i, name in enumerate(names)]


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |" for line in lines)


def bullets(lines: Sequence[str]) -> str:
    return "\n".join(f"- {line}" for line in lines)
