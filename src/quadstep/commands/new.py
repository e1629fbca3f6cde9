"""`quadstep new`, and `quadstep check`."""

from pathlib import Path
from typing import Annotated

import typer

from quadstep.commands.deliver import Delivery
from quadstep.io.errors import UNMET, UserError
from quadstep.metrics.verdict import Case, Verdict
from quadstep.report.screen import command, say, say_whole


def new(
    mission: Annotated[Path, typer.Argument(help="File to write.", show_default=False)],
    vehicle: Annotated[
        str | None,
        typer.Option(
            help="A preset listed by `quadstep vehicles`, planar, or your own FILE.py:NAME; default: x500.", show_default=False
        ),
    ] = None,
    paper: Annotated[bool, typer.Option("--paper", help="Use the paper's plant and controller instead of a vehicle.")] = False,
    controller: Annotated[
        str | None,
        typer.Option(help="Default: rotation-backstepping, or the paper's with --paper.", show_default=False),
    ] = None,
) -> None:
    """Write a commented mission file to start from."""
    from quadstep.mission.template import write_template

    if paper and vehicle:
        raise UserError("--paper and --vehicle: choose one; the paper's plant is not one of the vehicles")
    write_template(mission, None if paper else vehicle or "x500", controller)
    say_whole(f"Wrote {mission}. Fly it: {command('fly', mission)}")


def check(
    lesson: Annotated[str, typer.Argument(help="A lesson (4), or one exercise (4.5).", show_default=False)],
    mission: Annotated[Path, typer.Argument(help="Your mission (TOML).", show_default=False)],
    course: Annotated[
        Path | None, typer.Option(help="A file of exercises instead of the package's (docs/lessons).", show_default=False)
    ] = None,
    hint: Annotated[bool, typer.Option("--hint", help="Give a hint for each unsolved exercise.")] = False,
    *,
    delivery: Delivery,
) -> None:
    """Check your solution of a lesson's exercise by flying it.

    For a lesson, checks the exercises that your mission fits. Exit code 0: solved. 2: bad input. 4: not solved.
    """
    from quadstep.mission.read import read_mission
    from quadstep.studies.lessons import OWN, checked, tasks

    found = checked(tasks(lesson, course or OWN), read_mission(mission))
    others = [one for one in found if one.strange]
    chosen = found if len(others) == len(found) else [one for one in found if not one.strange]
    if not delivery.as_json:
        if len(chosen) < len(found):
            say(f"Not checked, since they are about other missions: {', '.join(one.task.name for one in others)}.")
        for one in chosen:
            say(f"{one.task.name} {'solved' if one.solved else 'not solved'}: {one.task.asks}")
            for case in one.cases:
                say(f"  {case.sentence}")
            if hint and not one.solved and one.task.hint:
                say(f"  Hint: {one.task.hint}")
    cases = tuple(
        Case(f"{one.task.name}: {case.name}", case.failure and f"{one.task.name}: {case.failure}")
        for one in chosen
        for case in one.cases
    )
    content: dict[str, object] = {
        "mission": str(mission),
        "exercises": [{"name": one.task.name, "solved": one.solved, "checked": not one.strange} for one in found],
    }
    solved = all(one.solved for one in chosen)
    verdict = Verdict("check", lesson, cases, content, 0 if solved else UNMET)
    delivery.deliver(verdict)
