"""The files of a comparison: tables, figures, report, and the page on which the best fly the same flight."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from quadstep.engines.fly import fly
from quadstep.io import __version__
from quadstep.io.errors import UserError
from quadstep.metrics.verdict import RULES, FlightGrade
from quadstep.mission.derived import ControllerSection
from quadstep.page.build import build_page
from quadstep.page.flights import ShownFlight
from quadstep.page.model import identity
from quadstep.report import markup
from quadstep.report.evidence import Evidence, Figure, Section, TableSection
from quadstep.report.publish import markdown_table
from quadstep.report.sheet import Sheet
from quadstep.report.units import counted, listed, metric
from quadstep.studies.campaign.planner import planner
from quadstep.studies.campaign.single_flight import replay
from quadstep.studies.comparison import robustness, tables, words
from quadstep.studies.comparison.answer import decisions, leaders, median
from quadstep.studies.comparison.cells import FIRST, Situation, StudyCell
from quadstep.studies.comparison.entrants import Comparison
from quadstep.studies.comparison.jobs import Job
from quadstep.studies.comparison.picture import MANY, draw_vehicle

PAGE, SUMMARY = "page.html", "results.md"
IN_SUMMARY = 3
"""Figures."""


def write_results(out: Path, results: Comparison, flights: Sequence[Job[StudyCell]], sheet: Sheet) -> Evidence:
    """Everything but the flights and gains; what they say. Raises UserError."""
    tables.write_tables(out, results)
    drawn = {vehicle: Path("figures") / (identity(vehicle, ()) if vehicle else "missions") for vehicle in results.vehicles}
    (out / "figures").mkdir()
    for vehicle, name in drawn.items():
        draw_vehicle(out / name, results, vehicle, sheet.with_svg())
    done = evidence(results, flights, drawn, *write_ghosts(out, results, flights))
    done.write(out)
    (out / SUMMARY).write_text(markdown(results, done), encoding="utf-8")
    return done


def write_ghosts(out: Path, results: Comparison, flights: Sequence[Job[StudyCell]]) -> tuple[list[tuple[str, str]], str]:
    """page.html; links into it with what they show, or why there is none."""
    try:
        html, links = ghosts(results, flights)
    except UserError as error:
        return [], str(error)
    (out / PAGE).write_text(html, encoding="utf-8")
    return links, ""


GAINS = (
    "Gains derived from the vehicle use the nominal vehicle, whatever a scenario changes. Memory is the state kept between "
    "samples; numbers are the gains. Rotor activity is the mean over the situations in which all complete flights."
)
COUNTED = "Instructions are those of the exported law's worst sample."
TUNED = "All tuned gains were found with the same flights, objective and budget, and evaluated on other flights."
LOOPS = (
    "The sampled loop at rest at the start of the path, without noise: one loop is opened at a time, and the table shows the "
    "smallest margin over all channels. An estimator is left out, together with the fix latency that it compensates. "
    "`quadstep linear` gives details. A slowest pole of 0 in a sound loop is that of a number of the law, such as an adapted "
    "weight, that may have any value at rest: it neither grows nor decays. Margins of a law with a kink at or near rest have "
    "fewer digits: further ones would depend on the states at which it is linearised."
)
DECIDING = (
    "First: the smallest median of those that lead; second: tied with it, or next. Differences are medians over the flights "
    "that both complete, with 95 % intervals."
)
MEDIANS = "{} of {}{}; a lost flight ranks worse than any other. In bold: best, or tied for best.{}{}"
FAILING = "A disturbance is increased until flights fail, that is, are lost or exceed the error limit."
RAISED = f"{FAILING} The last column is the share of an equal number of other flights that fail at the 50 % point."


def evidence(
    results: Comparison,
    flights: Sequence[Job[StudyCell]],
    pictures: Mapping[str, Path],
    links: list[tuple[str, str]],
    missing: str,
) -> Evidence:
    """What was found, for its readers. pictures: the figure of each vehicle. links: into page.html, or why it is missing."""
    found, *others = words.sentences(results)
    problems = {one.line for one in results.problems}
    said = [*(one for one in (found, *others) if one not in problems), *results.left_out]
    many = len(results.controllers) > MANY
    vehicles = [one.vehicle for one in results.ranked]
    everywhere = {vehicle: " in every situation" if vehicles.count(vehicle) > 1 else "" for vehicle in pictures}
    spread = f": median with its 95 % interval, and a thin line to the {results.high}" if results.spreads and not many else ""
    large = any(one.grade is not None and RULES[0].label in one.grade.labels for one in results.results)
    opened = " Open in the first panel: the median flight has a large error." * (
        large and results.metric == "position_rmse" and not many
    )
    better = (
        "The paler, the better" if many else f"Blue: best, or tied for best, by {metric(results.metrics[results.metric])[0]}"
    )
    drawn = [words.title(results, one) for one in list(results.metrics)[: 1 if many else 2]]
    whole = f"{listed([drawn[0][0].upper() + drawn[0][1:], *drawn[1:]])} of every {results.kind}"
    figures = {
        vehicle: Figure(
            str(name), f"{whole}{everywhere[vehicle]}{f' on {vehicle}' if vehicle else ''}{spread}. {better}.{opened}"
        )
        for vehicle, name in pictures.items()
    }
    shown = list(figures.values())[:IN_SUMMARY]
    sections: list[Section] = [
        *([markup.listing(others)] if others else []),
        *([markup.heading("Limitations", "limits"), markup.listing(results.limitations)] if results.limitations else []),
        markup.links(links, "See the best two fly under the same conditions:")
        if links
        else markup.paragraph(f"There is no page with flights: {missing}."),
    ]
    if decided := [] if results.copies else decisions(results):
        title = f"Decisions: {metric(results.metrics[results.metric])[0]}, flight by flight"
        sections.append(
            TableSection("Decisions", "decisions", tables.DECISION_HEADER, decided, DECIDING, shown=title, most=12)
        )
    for vehicle, figure in figures.items():
        sections += [medians(results, flights, vehicle), *([] if figure in shown else [figure])]
    if results.linear:
        loops = robustness.rows(results.linear)
        sections.append(TableSection("Linear margins", "linear", *results.table(robustness.HEADER, loops, LOOPS)))
        sections.append(markup.listing(robustness.unlinearised(results.linear)))
    if results.margins:
        points, title = tables.margin_rows(results), "Margins, 95 % intervals"
        sections.append(TableSection("Margins", "margins", *results.table(tables.MARGIN_HEADER, points, RAISED), shown=title))
    tuned = [TUNED] * any(one.trained for one in results.entrants)
    gains = " ".join([*tuned, GAINS, *[COUNTED] * any(one.instructions for one in results.costs.values())])
    costs = results.table(tables.WHO_HEADER, tables.who_rows(results), gains, once=True)
    sections.append(TableSection("Gains and cost", "gains", *costs))
    differing = [[*(part or words.NOTHING for part in (one.vehicle, one.name, *one.differs))] for one in results.entrants]
    sections.append(TableSection("", "", *results.table(tables.DIFFERS_HEADER, differing, once=True)))
    for vehicle in figures:
        label = vehicle or "missions"
        sections.append(
            TableSection(f"All numbers: {label}", f"all-{identity(label, ())}", *tables.full_rows(results, vehicle))
        )
        effort = tables.effort_rows(results, vehicle)
        if any(cell not in markup.BLANK for row in effort for cell in row[2:]):
            sections.append(TableSection("", "", *results.table(tables.EFFORT_HEADER, effort)))
    sections.append(TableSection("How it is judged", "method", text=words.method(results)))
    return Evidence(
        name=results.name,
        kind="Comparison",
        answer=found,
        sentences=[*said, *words.not_counted(results)],
        record=as_json(results, flights),
        facts=facts(results),
        figures=shown,
        sections=sections,
        paper=tables.latex_tables(results),
        fold=("linear", "gains", "method", *(f"all-{identity(vehicle or 'missions', ())}" for vehicle in figures)),
    )


def medians(results: Comparison, flights: Sequence[Job[StudyCell]], vehicle: str) -> TableSection:
    """The median of every controller in every situation of a vehicle."""
    begins = {job.subject.campaign.content.get("score_from") or 0.0 for job in flights}
    scored = f", errors from {float(str(begins.pop())):g} s on" if len(begins) == 1 and begins != {0.0} else ""
    marked, large = tables.marks(results, vehicle), words.limit(results, vehicle)
    text = MEDIANS.format(words.measured(results), counted(results.seeds, "flight"), scored, marked, large)
    text = f"{text[:1].upper()}{text[1:]}"
    title = f"{', '.join([vehicle, *filter(None, results.shared[1:])]) + ': ' if vehicle else ''}{words.measured(results)}"
    title += f" of {counted(results.seeds, 'flight')}{marked and '; !: not as commanded'}"
    label, ((corner, *names), found_rows) = vehicle or "Missions", tables.matrix(results, vehicle)
    lead = [leaders(results, one) for one in results.ranked if one.vehicle == vehicle]
    cells: list[list[markup.Cell]] = [
        [(cell, "best") if name in best else cell for name, cell in zip(names, row, strict=True)]
        for (_, *row), best in zip(found_rows, lead, strict=True)
    ]
    places = [row[0] for row in found_rows]
    if len(names) > len(places):  # the longer list has the rows
        names, places, cells = places, names, [[*one] for one in zip(*cells, strict=True)]
    rows = [[place, *row] for place, row in zip(places, cells, strict=True)]
    return TableSection(label, identity(label, ()), (corner, *names), rows, text, shown=title)


def facts(results: Comparison) -> list[markup.Fact]:
    """How many fly as commanded, and how much is decided."""
    graded = [one.grade for one in results.results if one.grade]
    wrong = [one for one in graded if one.grade is not FlightGrade.AS_COMMANDED]
    why = dict.fromkeys(label for one in wrong for label in one.labels or ("lost",))
    asked = markup.Fact("median flights not as commanded", f"{len(wrong)} of {len(graded)}", listed([*why]))
    pairs = markup.Fact(
        "pairs decided",
        f"{results.pairs - results.undecided} of {results.pairs}",
        "with 95 % confidence in all of them jointly",
    )
    return [*([asked] if graded else []), *([pairs] if results.pairs else [])]


def as_json(results: Comparison, flights: Sequence[Job[StudyCell]]) -> dict[str, object]:
    files = {job.subject.label: f"{job.kind}/{job.key}.parquet" for job in flights}
    margin = "margin", "vehicle", "controller", "half", "few", "checked"
    return {
        "name": results.name,
        "version": __version__,
        "study": results.source,
        "seeds": results.seeds,
        "seed": results.seed,
        "metric": results.metrics[results.metric],
        "sentences": words.sentences(results),
        "cells": list(tables.cell_rows(results)),
        "pairs": list(tables.pair_rows(results)),
        "controllers": [
            {
                "vehicle": one.vehicle,
                "controller": one.name,
                "gains": one.origin,
                "tuned": one.trained and one.trained._asdict(),
            }
            for one in results.entrants
        ],
        "margins": [dict(zip(margin, row, strict=True)) for row in tables.margin_rows(results)],
        "linear": [
            {"vehicle": vehicle, "controller": controller, "grade": one.grade, "why": one.why, **one.metrics}
            for (vehicle, controller), one in results.linear.items()
        ],
        "difference_unit": results.metrics[results.metric].removeprefix(results.metric),
        "flights": files,
        "problems": [one.line for one in results.problems],
        "left_out": list(results.left_out),
    }


def markdown(results: Comparison, found: Evidence) -> str:
    """The page: what was found, and the tables of the report that are for every reader."""
    parts = [f"# {found.name}", f"Made by quadstep {__version__} from `{Path(results.source).name}`, seed {results.seed}."]
    parts += [found.answer, bullets(words.sentences(results)[1:])]
    parts += ["## Limitations", bullets(results.limitations)] if results.limitations else []
    parts += [f"![{one.caption}]({one.name}.png)" for one in found.figures]
    folded = False
    for one in (section for section in found.sections if isinstance(section, TableSection)):
        folded = one.anchor in found.fold and one.anchor != "gains" if one.title else folded
        if folded:
            continue
        rows = [[cell if isinstance(cell, str) else f"**{cell[0]}**" for cell in row] for row in one.rows]
        parts += [*([f"## {one.title}"] if one.title else []), *([one.text] if one.text else [])]
        parts += [markdown_table(one.header, rows)] if rows else []
    return "\n\n".join([*parts, words.method(results)]) + "\n"


def bullets(lines: Sequence[str]) -> str:
    return "\n".join(f"- {line}" for line in lines)


MOST_RIVALS = 3


def ghosts(results: Comparison, flights: Sequence[Job[StudyCell]]) -> tuple[str, list[tuple[str, str]]]:
    """The page, and links into it with what they show: for each vehicle the situation that is hardest for the best, and in it
    the best that can be flown again without an autopilot. Raises UserError.
    """
    shown: list[ShownFlight] = []
    links: list[tuple[str, str]] = []
    for vehicle in results.vehicles:
        situation = hardest(results, vehicle)
        lead = leaders(results, situation)
        ranked = sorted(results.of(situation), key=lambda one: (one.controller not in lead, median(results, one)))
        jobs = {job.subject.controller: job for job in flights if job.subject.situation == situation}
        again = [one.controller for one in ranked if not jobs[one.controller].subject.law.one_at_a_time]
        names = again[: MOST_RIVALS + 1]
        if not names:
            continue
        one = fly_side_by_side(
            results, situation, jobs[names[0]], {name: jobs[name] for name in names[1:]}, [flight.id for flight in shown]
        )
        shown.append(one)
        text = " and ".join(names[:2])
        ghost = f"&ghost={identity(names[1], ())}" if names[1:] else ""
        links.append((f"{PAGE}#flight={one.id}{ghost}", f"{situation.label}: {text}" if situation.label else text))
    if not shown:
        raise UserError("flights of an autopilot cannot be shown without it")
    return build_page(results.name, (), shown), links


def hardest(results: Comparison, vehicle: str) -> Situation:
    """The situation of a vehicle whose best controller has the largest median error that is known."""
    least = {one: min(median(results, cell) for cell in results.of(one)) for one in results.ranked if one.vehicle == vehicle}
    return max(least, key=lambda one: least[one] if np.isfinite(least[one]) else -1.0)


def fly_side_by_side(
    results: Comparison, situation: Situation, best: Job[StudyCell], rivals: dict[str, Job[StudyCell]], names: Sequence[str]
) -> ShownFlight:
    """The first flight of a situation, under the best controller and under its rivals."""
    campaign = best.subject.campaign
    drawn, mission, plan = replay(campaign, FIRST)
    log = fly(plan)
    metrics, warnings = mission.flight_metrics(log)
    name = situation.label or results.name
    others: dict[str, ControllerSection] = {}
    for rival, job in rivals.items():
        theirs = job.subject.campaign
        if theirs.content.get("vehicle") == campaign.content.get("vehicle"):
            others[rival] = planner(theirs).mission(drawn).controller
    return ShownFlight(
        identity(name, names), name, results.name, mission, plan, log, metrics, campaign.folder,
        warnings=tuple(warnings), called=best.subject.controller, rivals=others,
    )  # fmt: skip
