"""Sliders and switches: how each is made, and those that every controller of a flight shares."""

import math
from collections.abc import Callable, Sequence
from operator import attrgetter
from typing import TYPE_CHECKING, Any, cast

from quadstep.engines.fly import FlightPlan
from quadstep.interfaces.closed_loop import Ticks
from quadstep.interfaces.gain import ANGLES, AXES, BELIEF, Gain, gains_in
from quadstep.mission.fields import LEAST, MOST
from quadstep.mission.lagrange import LagrangeMission
from quadstep.mission.paths import CirclePath, FigureEightPath, MinimumJerkPath, OwnPathSection
from quadstep.mission.schema import Mission
from quadstep.numbers import Vector
from quadstep.page.model import Component, Control, Effect
from quadstep.vehicle.airframe_plant import Events
from quadstep.vehicle.paper import Disturbance
from quadstep.world.air import Wind

if TYPE_CHECKING:
    from quadstep.mission.multirotor import MultirotorMission

BELIEVES = "Changes only the vehicle; the controller keeps its own value."

LONGEST_TICKS = 300_000
"""Steps of the longest flight that the page flies."""


def parameter(name: str, factor: float = 1.0, power: int = 1, offset: float = 0.0) -> Effect:
    """A parameter takes the control's value."""
    return Effect("parameter", name, factor, power, offset)


def control(
    name: str, label: str, unit: str, components: Sequence[Component], span: tuple[float, float],
    hint: str = "", scale: str = "linear", bounds: tuple[float, float] = (-MOST, MOST),
) -> Control:  # fmt: skip
    """A slider over `span`, widened to hold the file's values. Its group is given by `grouped`."""
    values = [component.value for component in components]
    least, most = min(span[0], *values), max(span[1], *values)
    least, most = two_digits(least, math.floor), two_digits(most, math.ceil)
    least, most = max(least, bounds[0]), min(most, bounds[1])
    step = 10.0 ** math.floor(math.log10(max(most - least, LEAST) / 100.0))
    return Control(name, label, unit, "", hint, "number", scale, least, most, *bounds, step, tuple(components))


def two_digits(value: float, towards: Callable[[float], int]) -> float:
    """A number, rounded to two digits towards one side.

    >>> two_digits(1.461, math.floor), two_digits(146.1, math.ceil), two_digits(-1.234, math.floor)
    (1.4, 150.0, -1.3)
    """
    if value == 0.0:
        return value
    place = math.floor(math.log10(abs(value))) - 1
    return float(f"{towards(round(value / 10.0**place, 9))}e{place}")


POSITIVE, NOT_NEGATIVE = (LEAST, MOST), (0.0, MOST)


def positive(name: str, label: str, unit: str, components: Sequence[Component], hint: str = "") -> Control:
    """A slider over two decades, around the file's value, for what must be above zero."""
    values = [component.value for component in components]
    return control(name, label, unit, components, (min(values) / 10.0, max(values) * 10.0), hint, "log", POSITIVE)


def from_zero(name: str, label: str, unit: str, components: Sequence[Component], most: float, hint: str = "") -> Control:
    return control(name, label, unit, components, (0.0, most), hint, bounds=NOT_NEGATIVE)


def grouped(group: str, *controls: Control) -> list[Control]:
    return [one._replace(group=group) for one in controls]


def vector_components(values: Sequence[float] | Vector, labels: Sequence[str], prefix: str) -> list[Component]:
    """A component for each entry of the vector `prefix` of the parameters."""
    return [
        Component(label, float(value), (parameter(f"{prefix}.{place}"),))
        for place, (label, value) in enumerate(zip(labels, values, strict=True))
    ]


def one(value: float, *effects: Effect) -> list[Component]:
    """The single component of a plain slider."""
    return [Component("", float(value), effects)]


def slider(gain: Gain, value: Any, place: str) -> Control:
    """The slider of one gain, at this place of the parameters."""
    components = vector_components(value, gain.parts, place) if gain.parts else one(value, parameter(place))
    values = [component.value for component in components]
    low, high, scale = gain.span(min(values), max(values))
    name = f"believed_{gain.key}" if gain.group == BELIEF else gain.key
    hint = f"{gain.meaning[:1].upper()}{gain.meaning[1:]}."
    bounds = (-MOST, MOST) if gain.signed else NOT_NEGATIVE if gain.zero else POSITIVE
    made = control(name, gain.label, gain.unit, components, (low, high), hint, scale, bounds)
    return made._replace(group=gain.group)


def number_sliders(numbers: object, place: str) -> list[Control]:
    """A slider for each of a structure of declared numbers, which stands at this place of the parameters."""
    made = [slider(one, attrgetter(name)(numbers), f"{place}.{name}") for name, one in gains_in(type(numbers)).items()]
    return [one._replace(id=f"{place}_{one.id}") for one in made]


def shared_controls(mission: LagrangeMission, plan: FlightPlan) -> list[Control]:
    """Path, vehicle, disturbance and start of a mission on the paper's plant."""
    tilt: Vector = plan.start.attitude
    angles = [
        Component(angle, float(tilt[place]), (Effect("start", f"attitude.{place}"),)) for place, angle in enumerate(ANGLES)
    ]
    tilted = control("tilt", "initial attitude", "rad", angles, (-1.0, 1.0), "The angles at t = 0.", bounds=(-1.5, 1.5))
    return [
        *grouped("Path", *path_controls(mission, plan.ticks)),
        *grouped("Vehicle", *vehicle_controls(mission)),
        *grouped("Disturbance", *disturbance_controls(mission, plan.parameters.disturbance)),
        *grouped("Start", moved_start(), tilted),
    ]


def airframe_controls(mission: Mission, plan: FlightPlan) -> list[Control]:
    """Path, mass, wind and start of a mission for a real vehicle."""
    airframe = plan.parameters.airframe
    carried = [Effect("hover", "speeds")] if cast("MultirotorMission", mission).start.hovering else []
    return [
        *grouped("Path", *path_controls(mission, plan.ticks)),
        *grouped(
            "Vehicle",
            positive("mass", "true mass", "kg", one(airframe.mass, parameter("airframe.mass"), *carried), BELIEVES),
            positive(
                "inertia", "true inertia", "kg m^2", vector_components(airframe.inertia, AXES, "airframe.inertia"), BELIEVES
            ),
        ),
        *grouped("Wind", *wind_controls(plan.parameters.wind)),
        *grouped("Events", *event_controls(plan.parameters.events)),
        *grouped("Start", moved_start()),
    ]


def event_controls(events: Events) -> list[Control]:
    """What rotors keep that fail, and the mass of payloads."""
    faults = [
        control(
            f"fault_{place + 1}", f"thrust left in rotor {round(float(fault.rotor)) + 1}", "-",
            one(fault.efficiency, parameter(f"events.faults.{place}.efficiency")), (0.0, 1.0),
            f"Share of its thrust that it keeps from {float(fault.start):g} s on.", bounds=(0.0, 1.0),
        )
        for place, fault in enumerate(events.faults)
    ]  # fmt: skip
    payloads = [
        from_zero(
            f"payload_{place + 1}", f"payload {place + 1}", "kg",
            one(payload.mass, parameter(f"events.payloads.{place}.mass")), 2.0 * float(payload.mass),
            f"Carried from {float(payload.start):g} s" + (f" to {float(payload.end):g} s." if payload.end < MOST else " on."),
        )
        for place, payload in enumerate(events.payloads)
    ]  # fmt: skip
    return [*faults, *payloads]


def wind_controls(wind: object) -> list[Control]:
    """Mean and gust, or what a wind of the user's own declares."""
    if not isinstance(wind, Wind):
        return number_sliders(wind, "wind")
    mean, gust = (vector_components(one, AXES, f"wind.{name}") for name, one in (("mean", wind.mean), ("gust", wind.gust)))
    return [
        control("wind", "mean wind", "m/s", mean, (-20.0, 20.0), "Velocity of the air without gust and turbulence."),
        control("gust", "gust", "m/s", gust, (-10.0, 10.0), "Velocity of the air at its peak, added to the mean wind."),
    ]


def moved_start(axes: Sequence[str] = AXES) -> Control:
    offset = [Component(axis, 0.0, (Effect("start", f"position.{place}", add=True),)) for place, axis in enumerate(axes)]
    return control("start", "start offset", "m", offset, (-5.0, 5.0), "Added to the start in the mission file.")


def path_controls(mission: Mission, ticks: Ticks) -> list[Control]:
    """What of the path a slider can move; knots of waypoints and recordings stay as they are."""
    path = mission.path
    if isinstance(path, MinimumJerkPath):
        return jerk_controls(path, ticks)
    if isinstance(path, CirclePath | FigureEightPath) and path.ramp > 0.0:  # else its start is in motion
        return orbit_controls(path, mission, ticks)
    return number_sliders(path.numbers(), "path") if isinstance(path, OwnPathSection) else []


def jerk_controls(path: MinimumJerkPath, ticks: Ticks) -> list[Control]:
    """Target, time and final yaw; the flight goes on after t_f for as long as the file says."""
    reach = max(30.0, *(abs(value) for value in path.end))
    stretch = Effect("duration", "", 1.0, 1, -path.duration, add=True)
    longest = LONGEST_TICKS * ticks.step - (ticks.last * ticks.step - path.duration)
    time = one(path.duration, parameter("path.duration"), stretch)
    haste = "From start to target; the shorter, the faster the path."
    yaw = one(path.yaw_end, parameter("path.yaw_end"))
    return [
        control("t_f", "time t_f", "s", time, (2.0, 60.0), haste, "log", (0.5, max(longest, path.duration))),
        control(
            "target", "target", "m", vector_components(path.end, AXES, "path.end"), (-reach, reach), "Where the path ends."
        ),
        control("yaw_end", "final yaw", "rad", yaw, (-math.pi, math.pi), "Yaw where the path ends."),
    ]


def orbit_controls(path: CirclePath | FigureEightPath, mission: Mission, ticks: Ticks) -> list[Control]:
    """Size and speed of a circle or figure eight."""
    harmonics = (1.0, 1.0, 1.0) if isinstance(path, CirclePath) else (1.0, 2.0, 2.0)
    effects = [parameter(f"path.frequency.{axis}", times * 2.0 * math.pi, -1) for axis, times in enumerate(harmonics)]
    if mission.simulation.duration is None:
        effects.append(Effect("duration", "", path.turns, 1, -path.turns * path.period, add=True))
    longest = (LONGEST_TICKS - ticks.last) * ticks.step / path.turns + path.period
    turn, bounds = one(path.period, *effects), (0.5, max(longest, path.period))
    period = control("period", "time per turn", "s", turn, (3.0, 60.0), "Once around the path.", "log", bounds)
    if isinstance(path, CirclePath):
        sizes = [parameter("path.amplitude.0"), parameter("path.amplitude.1", -1.0 if path.clockwise else 1.0)]
        if cast("MultirotorMission | LagrangeMission", mission).start.position is None:
            sizes.append(Effect("start", "position.0", 1.0, 1, -path.radius, add=True))
        return [period, positive("radius", "radius", "m", one(path.radius, *sizes), "Radius of the circle.")]
    across = 1 if path.plane == "horizontal" else 2
    halves = [
        Component("length", path.length, (parameter("path.amplitude.0", 0.5),)),
        Component("width", path.width, (parameter(f"path.amplitude.{across}", 0.5),)),
    ]
    return [period, positive("size", "length and width", "m", halves, "Size of the figure eight.")]


def vehicle_controls(mission: LagrangeMission) -> list[Control]:
    """The true vehicle; the controller goes on believing what it did."""
    vehicle = mission.vehicle
    factors = [parameter(f"vehicle.inertia.{axis}", value) for axis, value in enumerate(vehicle.inertia)]
    controls = [
        positive("mass", "true mass", "kg", one(vehicle.mass, parameter("vehicle.mass")), BELIEVES),
        positive("inertia", "true inertia (× original)", "-", one(1.0, *factors), BELIEVES),
    ]
    if vehicle.rotors.limits:
        least, greatest = vehicle.rotors.limits
        limits = [
            Component("least", least, (parameter("vehicle.rotors.minimum"),)),
            Component("greatest", greatest, (parameter("vehicle.rotors.maximum"),)),
        ]
        controls.append(from_zero("limits", "thrust limits of a rotor", "N", limits, 2.0 * greatest, "For every rotor."))
    return controls


def disturbance_controls(mission: LagrangeMission, disturbance: object) -> list[Control]:
    """The paper's disturbance, and steady ones; or what one of the user's own declares."""
    if not isinstance(disturbance, Disturbance):
        return number_sliders(disturbance, "disturbance")
    weight = mission.vehicle.mass * mission.vehicle.gravity
    times = one(disturbance.scale, parameter("disturbance.scale"))
    hint = "1 is the paper's disturbance, which has almost no effect in the paper's own cases."
    force, torque = (
        vector_components(disturbance.force, AXES, "disturbance.force"),
        vector_components(disturbance.torque, ANGLES, "disturbance.torque"),
    )
    return [
        control("disturbance", "disturbance (× Eq. 67)", "-", times, (0.0, 10.0), hint),
        control("wind", "wind, as a steady force", "N", force, (-0.5 * weight, 0.5 * weight), "Constant force in world axes."),
        control("torque", "steady torque", "N m", torque, (-5.0, 5.0), "Constant torque on psi, theta, phi."),
    ]
