"""`quadstep vehicles`."""

from pathlib import Path
from typing import Annotated

import typer

from quadstep.io.errors import UserError, one_line
from quadstep.report.terminal.screen import complain
from quadstep.report.terminal.tables import show_table


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
