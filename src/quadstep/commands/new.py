"""Mission files and vehicles: `quadstep new` and `quadstep check`, `quadstep vehicle` and `quadstep vehicles`."""

from pathlib import Path
from typing import Annotated

import typer

from quadstep.commands.options import Delivery, PlainCommand, ReplaceOption, expanded
from quadstep.io.errors import UNMET, UserError, one_line
from quadstep.metrics.verdict import Case, Verdict
from quadstep.report.screen import command, complain, say, say_whole, show_table


def new(
    mission: Annotated[Path, typer.Argument(metavar="MISSION.toml", help="File to write.")],
    vehicle: Annotated[
        str | None,
        typer.Option(
            metavar="VEHICLE", help="A preset listed by `quadstep vehicles`, planar, or your own FILE.py:NAME; default: x500."
        ),
    ] = None,
    paper: Annotated[bool, typer.Option("--paper", help="Use the paper's plant and controller instead of a vehicle.")] = False,
    controller: Annotated[
        str | None,
        typer.Option(
            help="Default: rotation-backstepping, or the paper's with --paper. (A mission that names none flies geometric.)"
        ),
    ] = None,
) -> None:
    """Write a commented mission file to start from."""
    from quadstep.mission.template import write_template

    if paper and vehicle:
        raise UserError("--paper and --vehicle: choose one; the paper's plant is not one of the vehicles")
    write_template(mission, None if paper else vehicle or "x500", controller)
    say_whole(f"Wrote {mission}. Fly it: {command('fly', mission)}")


def check(
    lesson: Annotated[str, typer.Argument(help="A lesson (4), or one exercise (4.5).")],
    mission: Annotated[Path | None, typer.Argument(metavar="MISSION.toml", help="Your mission (TOML).")] = None,
    course: Annotated[Path | None, typer.Option(help="A file of exercises instead of the package's (docs/lessons).")] = None,
    hint: Annotated[bool, typer.Option("--hint", help="Print hints for unsolved exercises (without a mission: all).")] = False,
    *,
    delivery: Delivery,
) -> None:
    """Check your solution of a lesson's exercise by flying it.

    Given a lesson, checks each exercise that your mission could answer. Exit code 0: one is solved. 2: bad input. 4: none is.
    """
    from quadstep.mission.read import read_mission
    from quadstep.studies.lessons import OWN, check_tasks, tasks

    asked = tasks(lesson, course or OWN)
    if mission is None:
        if not hint or delivery.as_json:
            raise UserError("name your mission's file; only --hint works without one")
        for task in asked:
            say(f"{task.name}: {task.hint or 'no hint'}")
        return
    found = check_tasks(asked, read_mission(mission))
    alike = [one for one in found if not one.strange]
    chosen = [one for one in alike if one.solved] or alike or found
    left = [one for one in found if one not in chosen]
    others, unsolved = ([one.task.name for one in left if one.strange == strange] for strange in (True, False))
    if not delivery.as_json:
        for names, why in ((others, "asks for a different mission"), (unsolved, "for such a mission, but not solved")):
            if names:
                say(f"Not counted ({why}): {', '.join(names)}.")
        unlike = not alike and len(found) > 1
        if unlike:
            say(f"This is not a mission of lesson {lesson}: it fits none of its exercises.")
            say_whole(f"To see what differs from one: {command('check', found[0].task.name, mission)}")
        for one in () if unlike else chosen:
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
    subject = f"{lesson} (not counted: {', '.join(one.task.name for one in left)})" if left else lesson
    delivery.deliver(Verdict("check", subject, cases, content, 0 if all(one.solved for one in chosen) else UNMET))


def fit(
    datasheet: Annotated[Path, typer.Argument(metavar="DATASHEET", help="Data sheet (TOML); docs/logs.md.")],
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Where to write the vehicle; default: <name>_vehicle.toml.")
    ] = None,
    overwrite: ReplaceOption = False,
) -> None:
    """Make a vehicle from its data sheet: mass, wheelbase, kV, propeller, cells and, optionally, thrust-stand data.

    Each number says whether it was measured, estimated by a formula or typical, and how uncertain it is. A campaign over
    the uncertain numbers is written next to it.
    """
    from pydantic import ValidationError

    from quadstep.identify.datasheet import Datasheet
    from quadstep.identify.vehicle_estimate import estimate, vehicle_of
    from quadstep.identify.vehicle_file import as_toml, campaign_text
    from quadstep.io.documents import read_toml
    from quadstep.io.files import check_place, refuse_other, write_beside
    from quadstep.mission.airframe import AirframeSection
    from quadstep.mission.check import check, explained
    from quadstep.mission.listings import parameters
    from quadstep.mission.read import DATASHEET, refuse_others

    target = out or Path(f"{datasheet.stem}_vehicle.toml")
    if target.suffix != ".toml":
        raise UserError(f"{target}: the name of a vehicle file should end in .toml")
    check_place(target)
    if target.exists() and datasheet.exists() and target.samefile(datasheet):
        raise UserError(f"{target}: is the data sheet itself; name another file with --out")
    content = read_toml(datasheet)
    refuse_others(content, DATASHEET, str(datasheet))
    sheet = check(Datasheet, content, str(datasheet), datasheet.parent)
    try:
        found = estimate(sheet)
        vehicle = vehicle_of(sheet, found)
    except UserError as error:
        raise UserError(f"{datasheet}: {error}") from None
    except ValidationError as error:
        raise explained(AirframeSection, {}, error, f"{datasheet}: the vehicle derived from it") from None
    except ValueError as error:
        raise UserError(f"{datasheet}: does not describe a vehicle that can fly: {error}") from None
    campaign = target.with_name(f"{target.stem}_campaign.toml")
    texts = {target: as_toml(vehicle), campaign: campaign_text(sheet, found, target.name)}
    for path, text in texts.items():
        refuse_other(path, text, overwrite)
    for path, text in texts.items():
        write_beside(path, text)
    rows = [(one.key, one.value, one.unit, one.source) for one in parameters(vehicle)]
    show_table(sheet.name, ("key", "value", "unit", "source"), rows)
    for warning in vehicle.warnings():
        say(f"warning: {warning}")
    say_whole(f"Wrote {target} and {campaign}. To fly its uncertainties: {command('campaign', campaign)}")


making = typer.Typer(help="Make a vehicle file from a data sheet.", rich_markup_mode=None)
making.callback()(lambda: None)
making.command(cls=PlainCommand)(expanded(fit))


def vehicles(
    vehicle: Annotated[
        str | None, typer.Argument(help="A preset's name, your own vehicle file (TOML), or FILE.py:NAME.")
    ] = None,
) -> None:
    """List the preset vehicles, or every parameter of one, with unit and source."""
    from quadstep.mission.listings import load_preset, parameters, preset_names, vehicle_named

    if vehicle is None:
        rows, broken = [], []
        for name in preset_names():
            try:
                section = load_preset(name)
                built = section.build()
            except UserError as error:  # another distribution's, or of a file beside
                broken.append(f"{name}: {error}")
                continue
            lift = len(built.geometry.mounts) * built.allocation.most / (section.mass * section.gravity)
            rotors = str(len(built.geometry.mounts))
            rows.append((name, section.description, f"{section.mass:g}", rotors, f"{lift:.3g}"))
        show_table("", ("preset", "description", "mass [kg]", "rotors", "thrust-to-weight ratio"), rows)
        for one in broken:
            complain(f"warning: {one}")
        return
    section = vehicle_named(vehicle)
    show_table(one_line(section.description or vehicle), ("key", "value", "unit", "meaning", "source"), parameters(section))
