"""`quadstep identify`: fit, judge on flights held out, fit all."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from quadstep.errors import UserError
from quadstep.identify.fit import Identified, Say, identify
from quadstep.identify.replay import ready
from quadstep.identify.table import Compared, compare
from quadstep.identify.vehicle_file import identified_vehicle
from quadstep.logs.flight import FlightRecord
from quadstep.mission.airframe import AirframeSection

HELD_OUT = 4
"""One flight of so many is held out."""

MIXED = 0.2
"""Share by which the mean command in flight, times the voltage, may differ from the median of all flights."""


class Run(NamedTuple):
    """vehicle: the result. held_out: names. commands, guided: how it predicts flights that were not fitted, by what it knows;
    None where there were none.
    """

    vehicle: AirframeSection
    found: Identified
    held_out: list[str]
    commands: Compared | None
    guided: Compared | None


def run(flights: Sequence[FlightRecord], vehicle: AirframeSection, mass_source: str, hold_out: bool, say: Say) -> Run:
    """Identify a vehicle. Raises UserError."""
    ready(flights, vehicle)
    check_alike(flights)
    held = [i for i in range(len(flights)) if i % HELD_OUT == HELD_OUT - 2] if hold_out and len(flights) >= HELD_OUT else []
    fitted = [flight for i, flight in enumerate(flights) if i not in held]
    unseen = [flights[i] for i in held]
    found = identify(fitted, vehicle, say)
    commands = guided = None
    if unseen:
        commands = compare(unseen, vehicle, found.numbers)
        if found.guided:
            guided = compare(unseen, vehicle, found.numbers._replace(observer=found.guided), guided=True)
        say("all flights")
        found = identify(flights, vehicle, say, found)
    names = ", ".join(flight.name for flight in flights)
    description = f"{vehicle.description or 'A vehicle'}; identified from {names}"
    result = identified_vehicle(vehicle, found, description[:900], mass_source)
    return Run(result, found, [flight.name for flight in unseen], commands, guided)


def check_alike(flights: Sequence[FlightRecord]) -> None:
    """Refuses flights that cannot be of one vehicle. Raises UserError."""
    if len({flight.speeds for flight in flights}) > 1:
        raise UserError("some logs hold motor commands, some rotor speeds; fit them one by one")
    levels = []
    for flight in flights:
        if not flight.flying.any():
            raise UserError(f"{flight.name}: never flew: the rotors never turned off the ground; nothing can be fitted")
        volts = flight.channel("voltage")[:, 0] if "voltage" in flight.channels else np.ones(flight.rows)
        levels.append(float(np.nanmedian((flight.motors.mean(axis=1) * volts)[flight.flying])))
    middle = float(np.median(levels))
    for flight, level in zip(flights, levels, strict=True):
        if abs(level / middle - 1.0) > MIXED:
            raise UserError(
                f"{flight.name}: needs {level / middle:.2f} times the median command to fly; are these logs of one vehicle?"
            )
