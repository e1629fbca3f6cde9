"""`quadstep vehicle`: making vehicles; `quadstep vehicles`: listing them."""

from pathlib import Path
from typing import Annotated

import typer

from quadstep.commands.options import ReplaceOption
from quadstep.io.errors import UserError, one_line
from quadstep.report.screen import command, complain, say, say_whole, show_table


def fit(
    datasheet: Annotated[
        Path, typer.Argument(metavar="DATASHEET", help="Data sheet (TOML); docs/logs.md.", show_default=False)
    ],
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Where to write the vehicle; default: <name>_vehicle.toml.")
    ] = None,
    overwrite: ReplaceOption = False,
) -> None:
    """Make a vehicle from its data sheet: mass, wheelbase, kV, propeller, cells, perhaps points of a thrust stand.

    Each number says whether it was measured, estimated by a formula or typical, and how uncertain it is. A campaign over
    the uncertain numbers is written next to it.
    """
    from pydantic import ValidationError

    from quadstep.identify.datasheet.campaign import campaign_text
    from quadstep.identify.datasheet.estimate import estimate, vehicle_of
    from quadstep.identify.datasheet.sheet import read_datasheet
    from quadstep.identify.vehicle_file import as_toml
    from quadstep.io.files import check_place, refuse_other, write_beside
    from quadstep.mission.airframe import AirframeSection
    from quadstep.mission.check import explained
    from quadstep.mission.vehicle_list import parameters

    target = out or Path(f"{datasheet.stem}_vehicle.toml")
    if target.suffix != ".toml":
        raise UserError(f"{target}: the name of a vehicle file should end in .toml")
    check_place(target)
    if target.exists() and datasheet.exists() and target.samefile(datasheet):
        raise UserError(f"{target}: is the data sheet itself; name another file with --out")
    sheet = read_datasheet(datasheet)
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


making = typer.Typer(help="Make vehicles.", rich_markup_mode=None)
making.callback()(lambda: None)
making.command()(fit)


def vehicles(
    vehicle: Annotated[
        str | None, typer.Argument(help="A preset's name, your own vehicle file (TOML), or FILE.py:NAME.", show_default=False)
    ] = None,
) -> None:
    """List the preset vehicles, or every parameter of one, with unit and source."""
    from quadstep.mission.vehicle_list import load_preset, parameters, preset_names, read_vehicle

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
        show_table("", ("preset", "what", "mass [kg]", "rotors", "thrust over weight"), rows)
        for one in broken:
            complain(f"warning: {one}")
        return
    section = (
        load_preset(vehicle) if vehicle in preset_names() or not vehicle.endswith(".toml") else read_vehicle(Path(vehicle))
    )
    show_table(one_line(section.description or vehicle), ("key", "value", "unit", "meaning", "source"), parameters(section))
