"""`quadstep reproduce`, `quadstep compare` and `quadstep study`: the paper's study, laws compared, the completed law."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quadstep.commands.options import (
    EngineOption,
    FigureOptions,
    OverwriteOption,
    PlainCommand,
    check_range,
    engine_option,
    expanded,
    show,
)
from quadstep.engines.engine import JOBS, Engine
from quadstep.io.doors import needed_by
from quadstep.io.errors import BAD_INPUT, FAILED
from quadstep.report.bars import bar
from quadstep.report.screen import complain, say, say_whole, show_table, typeset
from quadstep.report.sheet import SCREEN, USUAL, sheet

if TYPE_CHECKING:
    from quadstep.studies.comparison.cells import ComparisonStudy
    from quadstep.studies.comparison.run import FinishedComparison, How


def reproduce(
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out/paper"),
    engine: EngineOption = Engine.LANES,
    overwrite: OverwriteOption = False,
    *,
    drawing: FigureOptions,
) -> None:
    """Fly the paper's cases and the stress flights, judge its claims, and write figures, CSV, JSON and report.html."""
    from quadstep.studies.paper.claims import CONTEXT, ClaimVerdict, answer
    from quadstep.studies.paper.reproduce import briefly
    from quadstep.studies.paper.reproduce import reproduce as run

    claims = run(out, engine, overwrite, drawing.sheet())
    say(answer(claims))
    say(CONTEXT)
    say("")
    for verdict, what in ((ClaimVerdict.FAILS, "fails"), (ClaimVerdict.UNDECIDED, "is undecided")):
        rows = [(typeset(one.name), typeset(briefly(one.measured))) for one in claims if one.verdict is verdict]
        show_table(f"What {what}", ("claim", "measured"), rows)
    say_whole(f"Report: {out / 'report.html'}")


MOST_SEEDS, USUAL_SEEDS = 100_000, 100

JobEngineOption = Annotated[Engine, engine_option(JOBS)]
KeepGoingOption = Annotated[
    bool, typer.Option("--keep-going", help="Continue with the others if a controller fails; exit code 2 at the end.")
]
RetuneOption = Annotated[bool, typer.Option("--retune", help="Also tune controllers for which the study supplies gains.")]


def compare(
    files: Annotated[list[Path], typer.Argument(metavar="STUDY.toml", help="A study; or two or more missions.")],
    seeds: Annotated[int | None, typer.Option(help="Flights per cell; overrides the study's (with missions: 100).")] = None,
    engine: JobEngineOption = Engine.LANES,
    retune: RetuneOption = False,
    keep_going: KeepGoingOption = False,
    out: Annotated[Path | None, typer.Option(help="Folder for the results; default: out/<study's name>.")] = None,
    overwrite: OverwriteOption = False,
    *,
    drawing: FigureOptions,
) -> None:
    """Compare controllers: tuned with equal budgets, flown through the same draws, judged with intervals (docs/compare.md).

    Writes report.html, page.html, cells.csv, pairs.csv, table.tex, gains.json, flights/*.parquet. After an interruption,
    the same command continues.

    Exit code 0: compared. 2: bad input, or something could not be flown. 130: interrupted.
    """
    check_range("--seeds", seeds, 2, MOST_SEEDS)
    drawn_on = drawing.sheet()
    folder = out or Path("out") / (files[0].stem if len(files) == 1 else "compare")
    with needed_by("`quadstep compare`"):
        from quadstep.studies.comparison.cells import read_study
        from quadstep.studies.comparison.missions import compare_missions
        from quadstep.studies.comparison.run import How

        how = How(engine, overwrite, keep_going, retune, sheet=drawn_on)
        if len(files) == 1:
            run_study(read_study(files[0]), folder, seeds, how)
            return
        with bar("flying", "flights") as shown:
            done = compare_missions(files, folder, seeds or USUAL_SEEDS, how._replace(progress=shown))
    print_outcome(done)


def run_study(study: "ComparisonStudy", folder: Path, seeds: int | None, how: "How") -> None:
    """Work a study out, and say what was found."""
    from quadstep.studies.comparison.run import compare_study

    if seeds is not None:
        study = study._replace(file=study.file.model_copy(update={"seeds": seeds}))
    with bar("tuning", "flights") as shown:
        done = compare_study(study, folder, how._replace(progress=shown))
    print_outcome(done)


def print_outcome(done: "FinishedComparison") -> None:
    """Say what was found. Raises typer.Exit where something could not be flown."""
    show(done.evidence, done.folder)
    for line in (line for one in done.found.problems for line in one.lines):
        complain(f"error: {line}")
    if done.found.problems:
        raise typer.Exit(BAD_INPUT)


LOOPS, MOST_SAMPLES = 5_000, 10**9
"""Closed loops that the lines of Theorem B are tried on; most that --samples asks for."""


def completion(
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out/completion"),
    samples: Annotated[int, typer.Option(help="Number of random closed loops to check the theorem on.")] = 1_000_000,
    overwrite: OverwriteOption = False,
) -> None:
    """Check the repaired theorem (docs/theory.md) on random states and fly the completed controller beside the paper's.

    Exit code 0: every statement holds. 1: one does not, or is loose, as it holds even with a term of its bound
    scaled by 0.9. 2: bad input.
    """
    from quadstep.proofs.theory.completion import study_completion

    check_range("--samples", samples, 1, MOST_SAMPLES)
    found = study_completion(out, samples, overwrite)
    show(found, out)
    if found.cases[0].failure:
        raise typer.Exit(FAILED)


def region(
    force: Annotated[float, typer.Option(help="Bound on the unknown force [N], 0 to 1000.")] = 0.0,
    torque: Annotated[float, typer.Option(help="Bound on the unknown torque [N m], 0 to 1000.")] = 0.0,
    bias: Annotated[
        float, typer.Option(help="Bound on a constant unknown force [N], 0 to 1000, such as from a wrong mass.")
    ] = 0.0,
) -> None:
    """Certify the region of Theorem B (docs/theory.md) for the completed law's default gains, and fly from its edge.

    The certificate is computed in exact rational numbers.

    Exit code 0: certified. 1: the certificate fails, the region contains no flight that starts at rest on its path, a flight
    without nets leaves it, or L_dot exceeds its bound. 2: bad input.
    """
    from quadstep.proofs.theory import edge
    from quadstep.proofs.theory.flow import Flow, draw, shares_of_lines

    for name, bound in (("--force", force), ("--torque", torque), ("--bias", bias)):
        check_range(name, bound, 0.0, 1000.0)
    found, unknown = edge.default_region(force, torque, bias), edge.Pushes(force, torque, bias)
    if found is None:
        say(f"No region is certified {unknown.words}.")
        raise typer.Exit(FAILED)
    level, least = float(found.level), edge.level_at_start(edge.mission({}, False).plan(), found, bias)
    rows = edge.region_rows(found, edge.least_frequency(found, unknown))
    show_table("What L <= level implies, for ever, for the completed law without nets", ("quantity", "at most"), rows)
    if least > level:
        begun = f"a flight that begins on its path with its integrals at zero is outside: there L is {least:.3g} J"
        say(f"Certified in exact rationals {unknown.words}, but {begun}, and the region ends at {level:g} J.")
        raise typer.Exit(FAILED)
    flights = edge.fly_edge(found, unknown=unknown)
    header = ("start off the path", "by", "|r1|", "|e1|", "|r2|", "with nets")
    show_table("Flights from the edge: largest norm over its bound", header, edge.edge_rows(flights))
    flow = Flow(found, force, torque)
    slope, lines = draw(flow, 1, LOOPS), shares_of_lines(flow, 1, LOOPS)
    show_table("Lines of Q: share of the coefficient that closed loops use", ("between", "used"), edge.line_rows(lines))
    farthest, used = max(max(flight.returned) for flight in flights), max(lines.values())
    holds = farthest <= 1.0 and slope.used <= 1.0 and used <= 1.0 + 1e-6
    what = "Certified in exact rationals, and nothing flown contradicts it" if holds else "CONTRADICTED by what was flown"
    law = "the completed law without nets, with its default gains on Case 1's path"
    say(f"{what}: {unknown.words}, {law}, never leaves L <= {level:g} J.")
    say(f"{len(flights)} flights from its edge, pushed by as much, reach {farthest:.2f} of what it allows.")
    say(f"On {LOOPS:,} closed loops inside L_dot + s^T Q s is at most {slope.used:.2f} of d . s.")
    if not holds:
        raise typer.Exit(FAILED)


def controllers(
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out/controllers"),
    seeds: Annotated[int | None, typer.Option(help="Flights per cell; overrides the study's.")] = None,
    engine: JobEngineOption = Engine.LANES,
    retune: RetuneOption = False,
    keep_going: KeepGoingOption = False,
    overwrite: OverwriteOption = False,
) -> None:
    """Compare the controllers of the package on the 2.6 kg vehicle and the Crazyflie: wind, payload, faults, latency,
    estimator.

    The study that `quadstep compare` would read is in the package, with the gains that it found; --retune repeats the search.
    """
    check_range("--seeds", seeds, 2, MOST_SEEDS)
    with needed_by("`quadstep study controllers`"):
        from quadstep.studies.comparison.cells import shipped_study
        from quadstep.studies.comparison.run import How

        how = How(engine, overwrite, keep_going, retune, sheet=sheet(USUAL, None, SCREEN))
        run_study(shipped_study(), out, seeds, how)


studies = typer.Typer(help="Run further studies.", rich_markup_mode=None)
for one in (completion, region, controllers):
    studies.command(cls=PlainCommand)(expanded(one))
