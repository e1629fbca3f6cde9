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

MARGINS = """
[margins]                   # required of a sound loop (quadstep linear)
# gain = 6.0                # dB, upwards and downwards
# phase = 0.5235987755982988 # rad: 30 degrees
# delay = 0.02              # example [s]; default: twice the latency of sensors and commands
"""
"""The end of every template."""

TEMPLATE = """\
# A quadstep mission on the paper's plant, with the paper's controller. Fly it: quadstep fly THIS_FILE
# SI units, angles in radians, z up; commented lines show defaults, or an example where it says so. Only [path] is needed.

# name = "My first flight"  # default: the name of this file

[path]
# From rest to rest with the least jerk; the end point is held.
type = "minimum-jerk"
start = [0.0, 0.0, 0.0]     # m
end = [20.0, 5.0, 10.0]     # m
duration = 10.0             # s
# yaw_start = 0.0           # rad
# yaw_end = 0.0
#
# Other paths:
# type = "waypoints"        # least jerk through waypoints, at rest at both ends
# waypoints = [
#   { t = 0.0, position = [0.0, 0.0, 0.0] },
#   { t = 4.0, position = [2.0, 0.0, 1.5], yaw = 0.5 },
#   { t = 9.0, position = [4.0, 3.0, 1.0] },
# ]
#
# type = "circle"           # centre, radius [m], period [s], turns, clockwise = false, yaw, yaw_rate [rad/s], ramp [s]
# type = "figure-eight"     # centre, length, width [m], period [s], turns, plane = "horizontal" or "vertical",
#                           # yaw, yaw_rate [rad/s], ramp [s]
# type = "step"             # start, end, time of the step [s], duration [s], yaw
#
# type = "recorded"         # a CSV of t, x, y, z and optionally psi, smoothed
# file = "flight.csv"       # relative to this file's folder
# columns = { t = "t", x = "x", y = "y", z = "z" }   # header names; psi = "..." for yaw
# psi_unit = "rad"          # or "deg"
# smoothing = 0.15          # s; faster motion is treated as noise

[vehicle]                   # the paper's numbers. No real vehicle of 1 kg has this inertia (radius of gyration 2.2 m);
                            # for a real vehicle: quadstep new
NUMBERS
# rotors.limits = [0.0, 80.0] # example: smallest and largest thrust of one rotor [N]; default: none

CONTROLLER
[start]                     # missing keys follow the path, or are zero
NUMBERS

[disturbance]
NUMBERS

[simulation]
NUMBERS

[limits]                    # when a flight counts as diverged
NUMBERS
"""


VEHICLE_TEMPLATE = """\
# A quadstep mission for a real vehicle. Fly it: quadstep fly THIS_FILE
# SI units, angles in radians, z up; commented lines show defaults, or an example where it says so.

# name = "My first flight"  # default: the name of this file
# seed = 1                  # of all noise and turbulence
# score_from = 0.0          # s; errors count from here on

[vehicle]
preset = "PRESET"           # `quadstep vehicles` lists them; or file = "my.toml", see docs/vehicles.md
# mass = 2.0                # example: further keys override the preset [kg]
# ground = 0.0              # example: height of the ground [m]; the vehicle crashes on it
# legs = 0.1                # example: height of the origin above the ground on which it stands [m]; then it can take off
# effects = { drag = true, gyroscopic = true, ground = false, battery = false }

[path]
# Others: minimum-jerk, waypoints, circle, step, recorded; `quadstep new FILE --paper` shows their keys.
type = "figure-eight"
centre = [0.0, 0.0, 3.0]    # m
length = 6.0                # m
width = 3.0                 # m
period = 8.0                # s

CONTROLLER
[start]                     # missing keys follow the path, or are zero
NUMBERS

[wind]                      # world axes
NUMBERS
# gust = { velocity = [5.0, 0.0, 0.0], start = 3.0, length = 1.0 }          # example
# turbulence = { wind_20 = 5.0, height = 6.0, airspeed = 5.0 }              # example; or intensity = "light"

[sensors]                   # without noise and latency the controller knows the true state
NUMBERS

# [[events]]                # examples
# type = "payload"          # a point mass; or "centre-of-gravity" with shift = [m]
# time = 5.0                # s; until = 10.0
# mass = 0.3                # kg
# position = [0.0, 0.0, -0.1] # m, body axes
# [[events]]
# type = "rotor"
# time = 8.0
# rotor = 1
# efficiency = 0.8

[simulation]
NUMBERS

[limits]                    # when a flight counts as lost
NUMBERS
"""


PLANT_TEMPLATE = """\
# A quadstep mission for LABEL. Fly it: quadstep fly THIS_FILE
# SI units, angles in radians, z up; commented lines show defaults.

# name = "My first flight"  # default: the name of this file

[vehicle]
type = "PRESET"
NUMBERS

[path]
# From rest to rest with the least jerk; the end point is held.
type = "minimum-jerk"
end = [2.0, 0.0, 1.0]       # m
duration = 4.0              # s

CONTROLLER
[simulation]
NUMBERS

[limits]                    # when a flight counts as lost
NUMBERS
"""


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
    text = PLANT_TEMPLATE.replace("LABEL", vehicle.plant.label or kind)
    return filled(text, kind, section, lines, mission, duration=4.0)


def filled(
    text: str, preset: str, section: type[ControllerSection], lines: Iterable[str], mission: type[Mission], **shown: object
) -> str:
    """A template with the lines of its controller, and those of its tables' numbers. shown: keys without a default."""
    values = {**sample_times(section.controller, mission), **shown}

    def numbers(found: re.Match[str]) -> str:
        table = cast(type[Section], mission.model_fields[found[1]].annotation)
        own = values if found[1] in ("start", "sensors", "simulation") else {}
        return "\n".join([found[0].removesuffix("\nNUMBERS"), *number_lines(table, own)])

    text = re.sub(r"^\[(\w+)\][^\[]*?\nNUMBERS$", numbers, text, flags=re.MULTILINE)
    return text.replace("PRESET", preset).replace("CONTROLLER", "\n".join(lines)) + MARGINS


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
        return filled(VEHICLE_TEMPLATE, preset, section, lines, MultirotorMission, duration=17.5, position=here)
    return filled(TEMPLATE, "", section, lines, LagrangeMission, duration=10.0)
