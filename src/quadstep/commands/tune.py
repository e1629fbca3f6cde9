"""`quadstep tune`."""

import math
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quadstep.commands.deliver import Delivery
from quadstep.commands.options import Drawing, OverwriteOption, check_seed
from quadstep.io.doors import needed_by
from quadstep.report.bars import bar
from quadstep.report.screen import command, say, say_whole, show_table

if TYPE_CHECKING:
    from quadstep.studies.tuning.run import Tuned


def tune(
    mission: Annotated[
        Path, typer.Argument(metavar="MISSION.toml", help="Mission file with a table [tune].", show_default=False)
    ],
    budget: Annotated[int, typer.Option(help="Maximum number of flights in total.", show_default=False)],
    out: Annotated[Path | None, typer.Option(help="Folder for the results; default: out/<mission's name>-tuned.")] = None,
    seed: Annotated[int, typer.Option(help="Seed of the search and of the differences between flights.")] = 1,
    overwrite: OverwriteOption = False,
    *,
    delivery: Delivery,
    drawing: Drawing,
) -> None:
    """Find better gains by flying: CMA-ES over many flights at once, compared at the end on flights not used for tuning.

    Writes tuned.toml, report.html, history.csv, a picture, table.tex and metrics.json. The mission's table
    [tune] says what may change, and what is better (docs/tuning.md).
    """
    check_seed(seed)
    folder, drawn_on = out or Path("out") / f"{mission.stem}-tuned", drawing.sheet()
    with bar("tuning", "flights", budget) as progress, needed_by("`quadstep tune`"):
        from quadstep.linear.grade import quick_grade
        from quadstep.studies.tuning.run import tune as run

        done = run(mission, budget, folder, seed, overwrite, progress, drawn_on, quick_grade)
    if not delivery.as_json:
        show(done, folder)
    delivery.deliver(done.evidence.verdict("tune", folder))


def show(done: "Tuned", folder: Path) -> None:
    """Print what is to be read first, the gains, the comparison and its verdict."""
    from quadstep.studies.tuning.judge import AGGREGATES

    found, compared = done.found, done.compared
    *first, verdict = done.evidence.sentences
    for sentence in first:
        say(sentence)
    gains = [
        (one.key, *(listed([values[leaf.key] for leaf in one.leaves]) for values in (found.present.values, done.values)))
        for one in done.asked.gains
    ]
    show_table(done.asked.mission.name, ("gain", "present", "tuned"), gains)
    many = compared.flights > 1
    said = f"{compared.flights} unseen flights each, 95 % intervals" if many else "one flight each: all flights are identical"
    shares = (*compared.success, compared.success_difference)
    whole = compared.objective._replace(name=f"objective ({AGGREGATES[done.asked.section.aggregate]})")
    rows = [
        ("succeed [%]", *(interval_text(one, 100.0) if many else f"{100.0 * one.value:.4g}" for one in shares)),
        *((row.name, *(interval_text(one) for one in row[1:])) for row in (whole, *compared.rows)),
    ]
    show_table(said[0].upper() + said[1:], ("", "present", "tuned", "tuned - present"), rows)
    flights = found.history[-1].flights
    before, after = found.present.judged.objective, found.best.judged.objective
    say(f"Objective over the flights tuned on: {number(before)} -> {number(after)}, after {flights} flights.")
    if not found.best.judged.feasible:
        lost = found.best.judged.lost
        wrong = f"{lost} of {done.asked.seeds} flights are lost" if lost else "constraints are broken"
        say(f"Even with the best gains found, {wrong} in tuning.")
    for sentence in (verdict, *done.evidence.graded):
        say(sentence)
    for gain in done.asked.gains:
        if edge := gain.edge(done.values):
            say(f"{gain.key} is {edge}; a wider range may give more.")
    for name in done.elsewhere:
        say(f"tuned.toml names {name}, which is not in the mission's folder: copy both there.")
    say_whole(f"Results: {folder}; fly it: {command('fly', folder / 'tuned.toml')}")


def listed(values: list[float]) -> str:
    """Some numbers, or just one where all are equal."""
    return ", ".join(f"{value:.6g}" for value in (values if len(set(values)) > 1 else values[:1]))


def interval_text(estimate: Iterable[float] | None, factor: float = 1.0) -> str:
    """A value with its interval."""
    if estimate is None:
        return "-"
    value, low, high = (factor * part for part in estimate)
    return f"{value:.4g}" if math.isnan(low) else f"{value:.4g} [{low:.4g}, {high:.4g}]"


def number(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else "none"
