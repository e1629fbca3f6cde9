"""The commented mission files that `quadstep new` writes."""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import cast

from quadstep.control.registry import controllers
from quadstep.interfaces.controller import Controller, Measured
from quadstep.io.doors import CONTROLLERS
from quadstep.io.doors import PLANTS as PLANTS_OF_OTHERS
from quadstep.io.errors import UserError
from quadstep.io.files import write_beside
from quadstep.io.places import place
from quadstep.mission.clock import PERIODS, ClockSection
from quadstep.mission.declared import PLANTS, OwnVehicleSection, declared_kind, is_plant
from quadstep.mission.derived import ControllerSection, section_of, usual_step
from quadstep.mission.fields import Section
from quadstep.mission.lagrange import LagrangeMission, VehicleSection
from quadstep.mission.listings import controller_lines, load_preset, number_lines
from quadstep.mission.multirotor import MultirotorMission
from quadstep.mission.own_controller import own_section
from quadstep.mission.own_thing import unknown_type
from quadstep.mission.presets import preset_names
from quadstep.mission.schema import Mission
from quadstep.vehicle.paper import State

TEMPLATES = Path(__file__).parent / "templates"
"""Texts of missions, in which NUMBERS, CONTROLLER, PRESET and LABEL are filled in; and the end of each."""


def write_template(path: Path, preset: str | None = None, controller: str | None = None) -> None:
    """Write the template to a new file: for the paper's plant, or for a real vehicle.

    Raises UserError if the preset or the controller is unknown, or if the file exists or cannot be written.
    """
    text = template(preset, controller, path.parent)
    if path.suffix not in ("", ".toml") or str(path) == "-":
        raise UserError(f"{path}: missions are TOML; name a file that ends in .toml")
    try:
        if path.exists():
            raise UserError(f"{path}: already exists; `quadstep new` never overwrites a file")
    except OSError as error:  # a name too long
        raise UserError(f"{path}: cannot be written: {error.strerror or error}") from None
    write_beside(path, text)


def chosen(controller: str | None, measures: type, folder: Path, usual: str = "") -> tuple[type[ControllerSection], list[str]]:
    """The table of a controller, unless named that of `usual`, or of the first; and the others' names. Raises UserError."""
    known = controllers(measures)
    own = own_section(controller, measures, folder) if controller and controller not in known else None
    name = controller or usual or next(iter(known))
    if own is None and name not in known:
        raise UserError(f"--controller: {unknown_type(name, known, CONTROLLERS)}")
    return own or section_of(known[name]), [other for other in known if other != name]


def plant_template(kind: str, controller: str | None, folder: Path) -> str:
    """The text of a mission for a plant that declares itself. Raises UserError."""
    mission = declared_kind(kind, folder)
    vehicle = cast(type[OwnVehicleSection], mission.model_fields["vehicle"].annotation)
    if not controller and not controllers(mission.measures):
        raise UserError(f"--controller: the package has none for {kind}; name your own, FILE.py:NAME")
    section, others = chosen(controller, mission.measures, folder)
    lines = controller_lines(section, vehicle(type=kind).model(), others)
    made = filled("plant", kind, section, lines, mission, duration=4.0)
    return made.replace("LABEL", vehicle.plant.label or kind)


def filled(
    name: str, preset: str, section: type[ControllerSection], lines: Iterable[str], mission: type[Mission], **shown: object
) -> str:
    """A template with the lines of its controller, and of its tables' numbers. shown: keys without a default."""
    values = {**sample_times(section.controller, mission), **shown}

    def numbers(found: re.Match[str]) -> str:
        table = cast(type[Section], mission.model_fields[found[1]].annotation)
        own = values if found[1] in ("start", "sensors", "simulation") else {}
        return "\n".join([found[0].removesuffix("\nNUMBERS"), *number_lines(table, own)])

    text = "".join((TEMPLATES / f"{one}.toml").read_text(encoding="utf-8") for one in (name, "margins"))
    text = re.sub(r"^\[(\w+)\][^\[]*?\nNUMBERS$", numbers, text, flags=re.MULTILINE)
    return text.replace("PRESET", preset).replace("CONTROLLER", "\n".join(lines))


def sample_times(controller: type[Controller], mission: type[Mission]) -> dict[str, object]:
    """The defaults of keys of sample times, which are the controller's own, and of keys that follow the path."""
    usual = {**Controller.rates, **controller.rates}
    clock = cast(type[ClockSection], mission.model_fields["simulation"].annotation)
    further = {name: usual[name] for name in controller.loops() if PERIODS.get(name) not in clock.model_fields}
    periods = {"imu_period": usual["law"], "fix_period": usual["law"], **{key: usual[one] for one, key in PERIODS.items()}}
    follows = dict.fromkeys(("position", "velocity", "attitude"), (0.0, 0.0, 0.0))
    return {**periods, "step": usual_step(controller), "loop_periods": further or None, **follows}


def template(preset: str | None = None, controller: str | None = None, folder: Path = Path()) -> str:
    """The text of a mission: for the paper's plant, or for a real vehicle. folder: where it will be. Raises UserError."""
    if preset is not None and is_plant(preset, folder):
        return plant_template(preset, controller, folder)
    if preset is not None and preset not in preset_names() and place(preset) is None:
        raise UserError(f"--vehicle: {unknown_type(preset, (*preset_names(), *PLANTS), PLANTS_OF_OTHERS)}")
    measures, usual = (Measured, "rotation-backstepping") if preset else (State, "backstepping")
    section, others = chosen(controller, measures, folder, usual)
    period = {**Controller.rates, **section.controller.rates}["law"]
    model = load_preset(preset, folder).build(period=period).model() if preset else VehicleSection().model()
    lines = controller_lines(section, model, others)
    if preset:
        here = (0.0, 0.0, 3.0)
        return filled("airframe", preset, section, lines, MultirotorMission, duration=17.5, position=here)
    return filled("paper", "", section, lines, LagrangeMission, duration=10.0)
