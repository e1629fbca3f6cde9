"""The commented mission files that `quadstep new` writes."""

from pathlib import Path
from typing import cast

from quadstep.control.registry import controllers
from quadstep.interfaces.controller import Controller, Measured
from quadstep.io.doors import CONTROLLERS
from quadstep.io.doors import PLANTS as PLANTS_OF_OTHERS
from quadstep.io.errors import UserError
from quadstep.io.files import write_beside
from quadstep.io.places import place
from quadstep.mission.clock import PERIODS, STEP, ClockSection
from quadstep.mission.declared import PLANTS, OwnVehicleSection, declared_kind, is_plant
from quadstep.mission.derived import ControllerSection, section_of, usual_step
from quadstep.mission.lagrange import LagrangeMission, VehicleSection
from quadstep.mission.listings import controller_lines, load_preset, number_lines
from quadstep.mission.multirotor import MultirotorMission
from quadstep.mission.own_controller import own_section
from quadstep.mission.own_thing import NumbersSection, unknown_type
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

name = "My first flight"

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
# mass = 1.0                # kg
# inertia = [5.0, 5.0, 5.0] # kg m^2
# gravity = 9.81            # m/s^2
# kinematics = "standard"   # T_eta of Newton-Euler; "printed" is the paper's; "rigid" fits its thrust
# rotors.arm = 0.25         # l [m]
# rotors.moment = 0.05      # c, torque per thrust [m]
# rotors.limits = [0.0, 80.0] # example: smallest and largest thrust of one rotor [N]; default: none

CONTROLLER
[start]                     # missing keys follow the path, or are zero
# position = [0.0, 0.0, 0.0]   # m
# velocity = [0.0, 0.0, 0.0]   # m/s
# attitude = [0.0, 0.0, 0.0]   # psi, theta, phi [rad]
# rates = [0.0, 0.0, 0.0]      # rad/s

[disturbance]
# scale = 1.0               # times the paper's (Eq. 67); 0 for none
# force = [0.0, 0.0, 0.0]   # constant [N]
# torque = [0.0, 0.0, 0.0]  # constant, on psi, theta, phi [N m]

[simulation]
# duration = 10.0           # s; default: that of the path
# step = 0.002              # of the integrator (RK4) [s]
# control_period = 0.002    # of the sampled controller [s], a multiple of step
LOOPS# log_period = 0.01         # s, a multiple of step

[limits]                    # when a flight counts as diverged
# distance = 100.0          # from the path [m]
# rate = 100.0              # of an Euler angle [rad/s]
# pitch = 1.57              # |theta| [rad], below pi/2
"""


VEHICLE_TEMPLATE = """\
# A quadstep mission for a real vehicle. Fly it: quadstep fly THIS_FILE
# SI units, angles in radians, z up; commented lines show defaults, or an example where it says so.

name = "My first flight"
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
# position = [0.0, 0.0, 3.0]   # m
# velocity = [0.0, 0.0, 0.0]   # m/s
# attitude = [0.0, 0.0, 0.0]   # yaw, pitch, roll [rad]
# rates = [0.0, 0.0, 0.0]      # about the body axes: roll, pitch, yaw [rad/s]
# hovering = true              # rotors start at hover speed; false: at idle

[wind]                      # world axes [m/s]
# mean = [0.0, 0.0, 0.0]
# swing = [2.0, 0.0, 0.0]   # example: amplitude of a sine
# swing_frequency = 1.0     # example [rad/s]
# gust = { velocity = [5.0, 0.0, 0.0], start = 3.0, length = 1.0 }          # example
# turbulence = { wind_20 = 5.0, height = 6.0, airspeed = 5.0 }              # example; or intensity = "light"

[sensors]                   # without noise and latency the controller knows the true state
# gyro_noise = 0.0          # rad/s/sqrt(Hz); gyro_bias [rad/s], gyro_walk; accelerometer_noise, _bias, _walk
# position_noise = 0.0      # m, per fix; velocity_noise [m/s], attitude_noise [rad]
# imu_period = 0.002        # s; fix_period likewise; default: the control period
# latency = 0.0             # of a fix [s]; imu_latency of the gyro
# estimator = false         # true: an error-state Kalman filter
# predictor = false         # true: propagate a late fix to the present with gyro and accelerometer

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
# duration = 17.5           # s; default: that of the path
# step = 0.002              # of the integrator (RK4) [s]; all periods are multiples of it
# control_period = 0.002    # of the attitude loop [s]
# guidance_period = 0.01    # of the position loop [s]
LOOPS# air_period = 0.01         # of the turbulence [s]
# log_period = 0.01         # s

[limits]                    # when a flight counts as lost
# distance = 100.0          # from the path [m]
# rate = 100.0              # about a body axis [rad/s]
"""


PLANT_TEMPLATE = """\
# A quadstep mission for {label}. Fly it: quadstep fly THIS_FILE
# SI units, angles in radians, z up; commented lines show defaults.

name = "My first flight"

[vehicle]
type = "{kind}"
{numbers}

[path]
# From rest to rest with the least jerk; the end point is held.
type = "minimum-jerk"
end = [2.0, 0.0, 1.0]       # m
duration = 4.0              # s

{controller}
[simulation]
# duration = 4.0            # s; default: that of the path
# step = 0.002              # of the integrator (RK4) [s]; all periods are multiples of it
# control_period = 0.002    # of the controller's law [s]
# guidance_period = 0.01    # of its slower loop, if it has one [s]
{loops}# log_period = 0.01         # s

[limits]                    # when a flight counts as lost
{limits}
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
    fields = mission.model_fields
    vehicle = cast(type[OwnVehicleSection], fields["vehicle"].annotation)
    if not controller and not controllers(mission.measures):
        raise UserError(f"--controller: the package has none for {kind}; name your own, FILE.py:NAME")
    section, others = chosen(controller, mission.measures, folder)
    return (
        at_its_rates(PLANT_TEMPLATE, section.controller).format(
            kind=kind,
            label=vehicle.plant.label or kind,
            numbers="\n".join(number_lines(vehicle)),
            controller="\n".join(controller_lines(section, vehicle(type=kind).model(), others)),
            loops=loop_line(section.controller, mission),
            limits="\n".join(number_lines(cast(type[NumbersSection], fields["limits"].annotation))),
        )
        + MARGINS
    )


SAMPLED = {**{key: method for method, key in PERIODS.items()}, "imu_period": "law", "fix_period": "law"}
"""Keys of sample times, and the method of a controller whose own is their default."""


def at_its_rates(text: str, controller: type[Controller]) -> str:
    """A template with the controller's own sample times."""
    for key, method in SAMPLED.items():
        line = f"# {key} = {Controller.rates[method]!r}"
        own = f"# {key} = {controller.rates.get(method, Controller.rates[method])!r}"
        width = max(len(line), len(own))
        text = text.replace(line.ljust(width), own.ljust(width))
    line = f"# step = {STEP!r}"
    own = f"# step = {usual_step(controller)!r}"
    return text.replace(line.ljust(len(own)), own)


def loop_line(controller: type[Controller], mission: type[Mission]) -> str:
    """The line about loops that have no key of their own; nothing for a controller without any."""
    usual = {**Controller.rates, **controller.rates}
    clock = cast(type[ClockSection], mission.model_fields["simulation"].annotation)
    further = [f"{name} = {usual[name]!r}" for name in controller.loops() if PERIODS.get(name) not in clock.model_fields]
    return f"# loop_periods = {{ {', '.join(further)} }} # of the controller's further loops [s]\n" if further else ""


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
    lines = "\n".join(controller_lines(section, model, others))
    text = (VEHICLE_TEMPLATE if preset else TEMPLATE).replace("PRESET", preset or "").replace("CONTROLLER", lines)
    kind = MultirotorMission if preset else LagrangeMission
    return at_its_rates(text, section.controller).replace("LOOPS", loop_line(section.controller, kind)) + MARGINS
