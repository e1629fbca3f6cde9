"""The fitted parameters: those of a vehicle that flights can determine, and those of the predictor."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from quadstep.identify.logs.flight import FlightRecord, Floats
from quadstep.identify.prediction import Curve, PredictorParameters
from quadstep.identify.starts import laid_out
from quadstep.mission.airframe import AirframeSection
from quadstep.numbers import Table, flatten, leaf_names, rebuild, vector
from quadstep.vehicle.airframe_plant import Observer

PREFIX = "parameters."


class Free(NamedTuple):
    """A parameter to fit. key: in the vehicle file. leaves: of `PredictorParameters`, which all take its value. unit.

    logarithmic: whether it is searched on a logarithmic scale (then it is positive). scale: a small but noticeable change, of
    its logarithm or of itself. low, high: its bounds. grows: what it is proportional to of what no flight reveals, the mass m,
    the rotors' thrust coefficient k_f and the inertia about z J_z: flights determine only its ratio to that.
    """

    key: str
    leaves: tuple[str, ...]
    unit: str
    logarithmic: bool = True
    scale: float = 0.1
    low: float = -math.inf
    high: float = math.inf
    grows: str = ""


SPEED = Free("command.speed", ("curve.speed",), "rad/s", scale=0.02, grows="√(m / k_f)")
EXPONENT = Free("command.exponent", ("curve.exponent",), "", scale=0.02, low=0.05, high=3.0)
VOLTAGE = Free("command.voltage_exponent", ("curve.voltage_exponent",), "", False, 0.1, 0.0, 3.0)

VEHICLE = (
    SPEED,
    EXPONENT,
    VOLTAGE,
    Free("rotor.rise_time", ("airframe.rotor.rise", "airframe.rotor.fall"), "s", low=2e-3, high=0.5),
    Free("command.delay", ("curve.delay",), "s", False, 2e-3, 0.0, 0.1),
    Free("inertia[0]", ("airframe.inertia.0",), "kg m^2", grows="m"),
    Free("inertia[1]", ("airframe.inertia.1",), "kg m^2", grows="m"),
    Free("rotor.torque_coefficient", ("airframe.rotor.torque",), "N m s^2", low=1e-15, grows="J_z k_f / m"),
    Free("rotor.inertia", ("airframe.rotor.inertia",), "kg m^2", low=1e-15, grows="J_z √(k_f / m)"),
    Free("drag.rotor[0]", ("airframe.drag.rotor.0", "airframe.drag.rotor.1"), "N s^2/(m rad)", low=1e-15, grows="√(m k_f)"),
    Free("drag.rotor[2]", ("airframe.drag.rotor.2",), "N s^2/(m rad)", low=1e-15, grows="√(m k_f)"),
    Free("drag.flapping", ("airframe.drag.flapping",), "N m s^2/(m rad)", low=1e-15, grows="√(m k_f)"),
    Free("centre_of_gravity[0]", ("offset.0",), "m", False, 1e-4, -0.5, 0.5),
    Free("centre_of_gravity[1]", ("offset.1",), "m", False, 1e-4, -0.5, 0.5),
    Free("imu.tilt[0]", ("tilt.0",), "rad", False, 1e-3, -0.5, 0.5),
    Free("imu.tilt[1]", ("tilt.1",), "rad", False, 1e-3, -0.5, 0.5),
)
"""What flights determine. `rotor.thrust_coefficient` stays, since flights determine only the thrust, and so does the inertia
about z, since they determine only its ratio to the yaw torque.
"""

GROWS = {one.key: one.grows for one in VEHICLE if one.grows}


def pair(name: str, unit: str, scale: float, logarithmic: bool = False, low: float = -math.inf) -> tuple[Free, Free]:
    """An observer's number for x and y, and that for z."""
    first, second = (
        Free(f"prediction.{name}[{i}]", (f"observer.{name}.{i}",), unit, logarithmic, scale, low, math.inf) for i in (0, 1)
    )
    return first, second


GAINS = (
    *pair("rates", "", 0.05),
    *pair("attitude", "", 0.05),
    *pair("velocity", "", 0.05),
    *pair("torque", "1/s", 0.5),
    *pair("trend", "1/s", 0.05),
    *pair("force", "1/s", 0.2),
    *pair("torque_fade", "1/s", 0.2, True, 1e-3),
    *pair("force_fade", "1/s", 0.2, True, 1e-3),
)
"""The observer's gains, which depend on the noise of the flights."""

ANSWERS = (
    *pair("authority", "", 0.05, True, 1e-3),
    *pair("leak", "1/s", 0.3),
    Free("prediction.spring", ("observer.spring",), "1/s^2", False, 1.0),
    Free("prediction.delay", ("observer.delay",), "s", False, 2e-3, 0.0, 0.1),
)
"""How far a prediction trusts commands that respond to disturbances it cannot see."""

GUIDANCE = (
    Free("prediction.path", ("observer.path",), "1/s^2", False, 0.3),
    Free("prediction.drift", ("observer.drift",), "1/s", False, 0.3),
)
"""And how it uses setpoints."""

LIMITS = (
    Free("prediction.reach", ("observer.reach",), "m/s^2", low=0.1, high=1e3),
    Free("prediction.steepest", ("observer.steepest",), "", low=0.02, high=2.0),
)
"""And how far it follows them."""

USUAL_OBSERVER = Observer(
    rates=vector(0.8, 0.8), attitude=vector(0.5, 0.5), velocity=vector(0.8, 0.8), torque=vector(3.0, 1.0),
    torque_fade=vector(6.0, 6.0), trend=vector(0.1, 0.1), force=vector(1.0, 1.0), force_fade=vector(3.0, 3.0),
    authority=vector(1.0, 1.0), leak=vector(0.0, 0.0), spring=0.0, path=0.0, drift=0.0, delay=0.0,
    reach=1e3, steepest=0.5,
)  # fmt: skip
"""Defaults for a vehicle that has none of its own."""


def numbers_of(vehicle: AirframeSection, flights: Sequence[FlightRecord]) -> PredictorParameters:
    """The numbers of a vehicle file, with the rows of its first flight.

    Voltage acts where the vehicle file says so: in [command], or by effects.battery; and never where it was not logged.
    """
    built = vehicle.build()
    airframe = built.airframe
    # the rotors can do what a log commands: only commands limit them
    rotor = airframe.rotor._replace(slowest=0.0, fastest=1e6)
    command, tilt = vehicle.command, vehicle.imu.tilt if vehicle.imu else (0.0, 0.0)
    if command is None:
        full = vehicle.battery.full if vehicle.battery else 1.0
        curve = Curve(vehicle.rotor.fastest, 1.0, float(vehicle.effects.battery), full, 0.0)
    else:
        curve = Curve(command.speed, command.exponent, command.voltage_exponent, command.nominal_voltage, command.delay)
    if "voltage" not in flights[0].channels:
        curve = curve._replace(voltage_exponent=0.0)
    observer = vehicle.prediction.as_numbers(Observer) if vehicle.prediction else USUAL_OBSERVER
    rows = laid_out(flights[:1]).rows
    return PredictorParameters(
        airframe._replace(rotor=rotor), vector(0.0, 0.0, 0.0), vector(*tilt), curve, observer, rows, 0.0, 0.0
    )


def before_fit(vehicle: AirframeSection, flights: Sequence[FlightRecord]) -> PredictorParameters:
    """Where a fit begins, and what stays where flights do not tell: rotors on a battery follow its voltage."""
    p = numbers_of(vehicle, flights)
    on_battery = vehicle.command is None and vehicle.battery and "voltage" in flights[0].channels
    return p._replace(curve=p.curve._replace(voltage_exponent=1.0)) if on_battery else p


def leaves_of(parameters: PredictorParameters) -> dict[str, float]:
    """Every number by the name of its leaf, without the tables."""
    names = leaf_names(parameters, PREFIX.removesuffix("."))
    pairs = zip(names, flatten(parameters), strict=True)
    return {name.removeprefix(PREFIX): float(leaf) for name, leaf in pairs if not isinstance(leaf, Table)}


def point_of(parameters: PredictorParameters, free: Sequence[Free]) -> Floats:
    """The start of a search, on its scales."""
    known = leaves_of(parameters)
    values = [min(max(known[one.leaves[0]], one.low), one.high) for one in free]
    return np.array([math.log(value) if one.logarithmic else value for one, value in zip(free, values, strict=True)])


def values_at(point: Floats, free: Sequence[Free]) -> list[float]:
    return [
        float(min(max(np.exp(x) if one.logarithmic else x, one.low), one.high)) for one, x in zip(free, point, strict=True)
    ]


def leaf_values(free: Sequence[Free], point: Floats) -> dict[str, float]:
    return {leaf: value for one, value in zip(free, values_at(point, free), strict=True) for leaf in one.leaves}


def placed(parameters: PredictorParameters, free: Sequence[Free], point: Floats) -> PredictorParameters:
    new = leaf_values(free, point)
    names = [name.removeprefix(PREFIX) for name in leaf_names(parameters, PREFIX.removesuffix("."))]
    return rebuild(parameters, (new.get(name, leaf) for name, leaf in zip(names, flatten(parameters), strict=True)))
