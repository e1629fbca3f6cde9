"""Vehicle files, every number with unit, interval and source, of an identified vehicle; and a campaign over what a data sheet
leaves open.
"""

import json
import math
from collections.abc import Sequence

from pydantic import ValidationError

from quadstep.identify.datasheet import Datasheet
from quadstep.identify.fit import Fitted, Identified
from quadstep.identify.logs.flight import FlightRecord
from quadstep.identify.parameters import GROWS, leaves_of
from quadstep.identify.vehicle_estimate import Number, VehicleEstimate
from quadstep.io.errors import UserError
from quadstep.mission.airframe import AirframeSection
from quadstep.mission.check import describe
from quadstep.mission.listings import numbers, written
from quadstep.numbers import Vector
from quadstep.report.units import number
from quadstep.vehicle.airframe_plant import Observer

FLIGHTS = 2000


def varying(estimate: VehicleEstimate) -> list[tuple[str, Number]]:
    """The keys of a mission that vary. Inertia about z follows that about x and y only loosely, so each varies by itself."""
    return [
        ("vehicle.rotor.thrust_coefficient", estimate.thrust),
        ("vehicle.rotor.torque_coefficient", estimate.torque),
        ("vehicle.rotor.fastest", estimate.fastest),
        ("vehicle.rotor.rise_time", estimate.rise),
        ("vehicle.rotor.inertia", estimate.rotor_inertia),
        ("vehicle.inertia.0", estimate.inertia[0]),
        ("vehicle.inertia.1", estimate.inertia[1]),
    ]


def bodies(estimate: VehicleEstimate) -> tuple[tuple[float, float], tuple[float, float]]:
    """Between which the inertias about x and y may be drawn, one without the other, beside that about z as it is: each may
    use up a little less than half of what the triangle inequality leaves it, so that every draw is a rigid body.
    """
    x, y, z = (one.value for one in estimate.inertia)
    below, x_above, y_above = (0.49 * max(0.0, left) for left in (x + y - z, y + z - x, x + z - y))
    return (x - min(below, y_above), x + x_above), (y - min(below, x_above), y + y_above)


def campaign_text(sheet: Datasheet, estimate: VehicleEstimate, vehicle_file: str) -> str:
    """The campaign file: a circle, flown with the controller's usual gains, which believe in the vehicle as estimated."""
    inertia = [float(f"{one.value:.5g}") for one in estimate.inertia]
    lines = [
        f"# What the data sheet of {json.dumps(sheet.name, ensure_ascii=False)[1:-1]} leaves open: does it fly all the same?",
        f"name = {json.dumps(f'{sheet.name}, uncertain', ensure_ascii=False)}",
        f"flights = {FLIGHTS}",
        "",
        "[mission]",
        f"vehicle = {{ file = {json.dumps(vehicle_file, ensure_ascii=False)} }}",
        'path = { type = "circle", centre = [0.0, 0.0, 3.0], radius = 2.0, period = 8.0 }',
        f'controller = {{ type = "geometric", mass = {sheet.mass!r}, inertia = {inertia!r} }}',
        "simulation = { duration = 16.0 }",
        "",
        "[vary]",
    ]
    ranges = {f"vehicle.inertia.{axis}": ends for axis, ends in enumerate(bodies(estimate))}
    for key, one in varying(estimate):
        median = f"median = {one.value:.5g}, sigma = {one.spread:.3g}"
        least, most = ranges.get(key, (0.0, math.inf))
        low, high = max(least, one.value * 0.25**one.spread), min(most, one.value * 4.0**one.spread)
        if high > 1.001 * low:
            lines.append(f'{key} = {{ type = "log-normal", {median}, low = {low:.5g}, high = {high:.5g} }}  # {one.source}')
    lines += ["", "[failure]", "largest_error = 1.0  # m", ""]
    return "\n".join(lines)


DIGITS = 6

MARKS, ENOUGH = 24, 2
"""How many of a flight's marks a vehicle file keeps, and how many of them tell that another log has a part of it."""


def with_marks(vehicle: AirframeSection, flights: Sequence[FlightRecord]) -> AirframeSection:
    """A vehicle that was fitted to these flights too; of each it keeps the smallest marks, which lie anywhere in it."""
    marks = {flight.name: " ".join(f"{one:012x}" for one in flight.marks[:MARKS].tolist()) for flight in flights}
    return vehicle.model_copy(update={"identified_from": {**vehicle.identified_from, **marks}})


def was_fitted_to(vehicle: AirframeSection, flight: FlightRecord) -> bool:
    """Whether a vehicle was identified from this recording or a part of it, whatever it was called then."""
    marks = {f"{one:012x}" for one in flight.marks.tolist()}
    return any(len(marks.intersection(one.split())) >= ENOUGH for one in vehicle.identified_from.values())


def identified_vehicle(vehicle: AirframeSection, fit: Identified, description: str, mass_source: str) -> AirframeSection:
    """The fitted vehicle. Rotors are placed from its centre of gravity; parameters that flights cannot determine stay."""
    leaves = leaves_of(fit.numbers)
    content = vehicle.model_dump(exclude_none=True, exclude={"preset", "file", "layout", "arm", "rotors", "residual"})
    offset = [leaves[f"offset.{axis}"] for axis in range(3)]
    content["rotors"] = [
        {
            "position": [rounded(place - shift) for place, shift in zip(mount.position, offset, strict=True)],
            "axis": list(mount.axis),
            "spin": "ccw" if mount.spin > 0 else "cw",
        }
        for mount in vehicle.geometry().mounts
    ]
    content["description"] = description
    # yaw determines only the ratio of torque to inertia, which stays
    about_z = upright(vehicle, fit)
    stretch = about_z / vehicle.inertia[2]
    x, y = (leaves[f"airframe.inertia.{axis}"] for axis in (0, 1))
    content["inertia"] = [rounded(value) for value in (x, y, about_z)]
    rotor, drag = content["rotor"], content["drag"]
    rotor["torque_coefficient"] = rounded(stretch * leaves["airframe.rotor.torque"])
    rotor["inertia"] = rounded(stretch * leaves["airframe.rotor.inertia"])
    rotor["rise_time"] = rotor["fall_time"] = rounded(leaves["airframe.rotor.rise"])
    full = vehicle.battery.full if vehicle.battery else leaves["curve.nominal"]
    fastest = leaves["curve.speed"] * (full / leaves["curve.nominal"]) ** leaves["curve.voltage_exponent"]
    rotor["fastest"] = rounded(fastest)
    rotor["slowest"] = min(rotor["slowest"], rounded(0.2 * fastest))
    drag["rotor"] = [rounded(leaves[f"airframe.drag.rotor.{axis}"]) for axis in range(3)]
    drag["flapping"] = rounded(leaves["airframe.drag.flapping"])
    content["command"] = {
        "speed": rounded(leaves["curve.speed"]),
        "exponent": rounded(leaves["curve.exponent"]),
        "voltage_exponent": rounded(leaves["curve.voltage_exponent"]),
        "nominal_voltage": leaves["curve.nominal"],
        "delay": rounded(leaves["curve.delay"]),
    }
    content["imu"] = {"tilt": [rounded(leaves[f"tilt.{axis}"]) for axis in (0, 1)]}
    content["prediction"] = observer_content(fit.numbers.observer)
    if fit.guided:
        content["guided_prediction"] = observer_content(fit.guided)
    content["undetermined"] = list(fit.kept)
    content["sources"] = sources(vehicle, fit, stretch, mass_source)
    try:
        return AirframeSection.model_validate(content)
    except ValidationError as error:
        said = ": ".join(filter(None, describe(AirframeSection, error.errors()[0])))
        raise UserError(f"the fit is outside the range of a vehicle file: {said}; {UNLIKE}") from None


def upright(vehicle: AirframeSection, fit: Identified) -> float:
    """The inertia about z, which no flight reveals: as given or, where no rigid body has that with those about x and y, in
    proportion to them [kg m^2].
    """
    x, y = (leaves_of(fit.numbers)[f"airframe.inertia.{axis}"] for axis in (0, 1))
    given = vehicle.inertia[2]
    return given if abs(x - y) <= given <= x + y else given * (x + y) / (vehicle.inertia[0] + vehicle.inertia[1])


def as_written(vehicle: AirframeSection, fit: Identified) -> Identified:
    """The result with the numbers that yaw determines over the inertia about z as the vehicle file has them."""
    stretch = upright(vehicle, fit) / vehicle.inertia[2]
    fitted = {
        key: one._replace(value=stretch * one.value, low=stretch * one.low, high=stretch * one.high)
        if "J_z" in GROWS.get(key, "") else one
        for key, one in fit.fitted.items()
    }  # fmt: skip
    return fit._replace(fitted=fitted)


UNLIKE = "do --vehicle and its mass suit the vehicle that flew?"


def rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}") + 0.0


def observer_content(observer: Observer) -> dict[str, object]:
    """The observer as a table of a vehicle file."""
    return {
        name: [rounded(float(one)) for one in value] if isinstance(value, Vector) else rounded(float(value))
        for name, value in observer._asdict().items()
    }


def spread(key: str, one: Fitted) -> str:
    """A 95 % interval in words; of a number in proportion to what no flight reveals, that of the fit alone."""
    if key not in GROWS:
        return f"95 % {one.low:.4g} to {one.high:.4g}"
    return f"proportional to {GROWS[key]}; 95 % of the fit alone: {fraction(one)}"


def fraction(one: Fitted) -> str:
    """A 95 % interval in shares of the value."""
    return f"−{number(100.0 - 100.0 * one.low / one.value, 2)} to +{number(100.0 * one.high / one.value - 100.0, 2)} %"


def sources(vehicle: AirframeSection, fit: Identified, stretch: float, mass_source: str) -> dict[str, str]:
    result = dict(vehicle.sources)
    result["mass"] = mass_source
    grouped: dict[str, list[str]] = {}
    said = {key: f"as it was: {reason}" for key, reason in fit.kept.items()} | {
        key: f"{'sign unknown' if one.either_sign else 'identified'}, {one.value:.4g}, {spread(key, one)} ({one.source})"
        for key, one in fit.fitted.items()
    }
    for key, one in said.items():
        base, _, axis = key.partition("[")
        where = {"0]": "x: ", "1]": "y: ", "2]": "z: "}.get(axis, "")
        base = "rotors" if base == "centre_of_gravity" else base
        grouped.setdefault(base, []).append(where + one)
    for key, parts in grouped.items():
        result[key] = "; ".join(parts)
    result["rotors"] = "from the centre of gravity, which lies off their middle [m] by " + result["rotors"]
    result["rotor.fall_time"] = result["rotor.rise_time"]
    result["rotor.fastest"] = "command.speed at a full battery"
    result["rotor.thrust_coefficient"] = "unchanged: flights determine only k_f times the speed squared. " + (
        vehicle.sources.get("rotor.thrust_coefficient", "")
    )
    how = "as it was" if stretch == 1.0 else f"times {stretch:.3g}, so that a rigid body has it with those about x and y"
    result["inertia"] += f"; z: {how}, as yaw determines only its ratio to the rotors' torque"
    result["command.nominal_voltage"] = "unchanged: voltage at which command.speed holds"
    result["prediction"] = "fitted with predictions of up to 50 samples from commands alone"
    result["guided_prediction"] = "fitted with predictions of up to 50 samples that know the setpoints"
    return result


def as_toml(vehicle: AirframeSection) -> str:
    """The vehicle as text of a vehicle file, units beside the numbers."""
    units = {key: quantity.unit for key, _, quantity in numbers(vehicle)}
    content = vehicle.model_dump(exclude_none=True, exclude_defaults=False)
    left = ", ".join(vehicle.undetermined)
    lines = [f"# Not determined by the flights that it was identified from, and as it was before: {left}."] if left else []
    lines += [f"{key} = {written(content[key])}{note(units, key)}" for key in ("description", "mass", "inertia", "gravity")]
    lines += [f"undetermined = {written(vehicle.undetermined)}"] if left else []
    if vehicle.rotors:
        lines += ["", "rotors = [", *(f"  {written(mount)}," for mount in content["rotors"]), "]"]
    else:
        lines += ["", *(f"{key} = {written(content[key])}{note(units, key)}" for key in ("layout", "arm"))]
    if "ground" in content:
        lines += ["", f"ground = {written(content['ground'])}{note(units, 'ground')}"]
    for table in ("rotor", "drag", "battery", "command", "imu", "prediction", "guided_prediction", "residual", "effects"):
        if content.get(table):
            lines += ["", f"[{table}]"]
            lines += [f"{key} = {written(value)}{note(units, f'{table}.{key}')}" for key, value in content[table].items()]
    for table in ("identified_from", "sources"):
        if content[table]:
            lines += ["", f"[{table}]", *(f"{json.dumps(key)} = {written(value)}" for key, value in content[table].items())]
    lines += [""]
    return "\n".join(lines)


def note(units: dict[str, str], key: str) -> str:
    unit = units.get(key, "")
    return f"  # {unit}" if unit else ""
