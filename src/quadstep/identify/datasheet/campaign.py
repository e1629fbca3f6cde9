"""A campaign over what a data sheet leaves open."""

import json
import math

from quadstep.identify.datasheet.estimate import Number, VehicleEstimate
from quadstep.identify.datasheet.sheet import Datasheet

FLIGHTS = 2000


def varying(found: VehicleEstimate) -> list[tuple[str, Number]]:
    """The keys of a mission that vary. Inertia about z follows that about x and y only loosely, so each varies by itself."""
    return [
        ("vehicle.rotor.thrust_coefficient", found.thrust),
        ("vehicle.rotor.torque_coefficient", found.torque),
        ("vehicle.rotor.fastest", found.fastest),
        ("vehicle.rotor.rise_time", found.rise),
        ("vehicle.rotor.inertia", found.rotor_inertia),
        ("vehicle.inertia.0", found.inertia[0]),
        ("vehicle.inertia.1", found.inertia[1]),
    ]


def bodies(found: VehicleEstimate) -> tuple[tuple[float, float], tuple[float, float]]:
    """Between which the inertias about x and y may be drawn, one without the other, beside that about z as it is: each may
    use up a little less than half of what the triangle inequality leaves it, so that every draw is a rigid body.
    """
    x, y, z = (one.value for one in found.inertia)
    below, x_above, y_above = (0.49 * max(0.0, left) for left in (x + y - z, y + z - x, x + z - y))
    return (x - min(below, y_above), x + x_above), (y - min(below, x_above), y + y_above)


def campaign_text(sheet: Datasheet, found: VehicleEstimate, vehicle_file: str) -> str:
    """The campaign file: a circle, flown with the controller's usual gains, which believe in the vehicle as estimated."""
    inertia = [float(f"{one.value:.5g}") for one in found.inertia]
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
    ranges = {f"vehicle.inertia.{axis}": ends for axis, ends in enumerate(bodies(found))}
    for key, number in varying(found):
        spread = f"median = {number.value:.5g}, sigma = {number.spread:.3g}"
        least, most = ranges.get(key, (0.0, math.inf))
        low, high = max(least, number.value * 0.25**number.spread), min(most, number.value * 4.0**number.spread)
        if high > 1.001 * low:
            lines.append(f'{key} = {{ type = "log-normal", {spread}, low = {low:.5g}, high = {high:.5g} }}  # {number.source}')
    lines += ["", "[failure]", "largest_error = 1.0  # m", ""]
    return "\n".join(lines)
