"""How well the numbers of a vehicle are known from its flights, beside those that it began with."""

import math

from quadstep.identify.fit import Identified
from quadstep.identify.parameters import GROWS
from quadstep.identify.vehicle_file import fraction
from quadstep.mission.airframe import AirframeSection
from quadstep.mission.fields import words
from quadstep.mission.listings import numbers
from quadstep.report.evidence import TableSection
from quadstep.report.units import handy, interval_texts, number, prose


def in_words(key: str) -> str:
    """A parameter as a sentence has it: inertia[0] is the inertia about x."""
    return words(key.replace("[", ".").removesuffix("]"))


def number_of(vehicle: AirframeSection, key: str, usual: float) -> float:
    """The number of a vehicle by its key, such as inertia[0], or the usual one where it has none."""
    name, _, axis = key.removesuffix("]").partition("[")
    value = {one: value for one, value, _ in numbers(vehicle)}.get(name)
    part = value[int(axis)] if isinstance(value, tuple) and axis else value
    return part if isinstance(part, float) else usual


def fitted(fit: Identified, given: AirframeSection, upright: float) -> list[TableSection]:
    """What flights determine by themselves, and what only over what they do not. upright: inertia about z [kg m^2]."""
    rows: tuple[list[tuple[str, ...]], list[tuple[str, ...]]] = [], []
    for key, one in fit.fitted.items():
        unit, factor = ("°", math.degrees(1.0)) if one.unit == "rad" else (prose(one.unit), 1.0)
        unit, factor = handy(unit, abs(one.value)) if unit in ("m", "s") else (unit, factor)
        value, low, high, _ = interval_texts(factor * one.value, factor * one.low, factor * one.high, "-")
        before = number_of(given, key, math.nan)
        theirs = number(factor * before) + ", outside" * bool(before < one.low or before > one.high)
        over = key in GROWS
        name, span = in_words(key) + f" [{unit}]" * bool(unit), fraction(one) if over else f"{low} to {high}"
        rows[over].append((name, value, span, theirs))
    mass, thrust, about_z, before_z = map(number, (given.mass, given.rotor.thrust_coefficient, upright, given.inertia[2]))
    whole = "These intervals hold whatever the vehicle's mass; they assume the given rotor positions."
    kept = "as given" if upright == given.inertia[2] else f"in proportion to the inertias about x and y (given: {before_z})"
    scale = (
        "No flight reveals the mass m, the rotors' thrust coefficient k_f or the inertia about z, J_z. The next table is for "
        f"m = {mass} kg and k_f = {thrust} N s^2, as given, and J_z = {about_z} kg m^2, {kept}. If one of them is wrong, so "
        "are the values, in the proportion that the vehicle's file gives (for J_z nearly); the intervals do not cover that."
    )
    header = ("parameter", "value", "95 % interval", "given")
    ratio = "Known only up to the mass m, thrust coefficient k_f and yaw inertia J_z"
    found = (
        TableSection(
            "",
            "",
            header,
            rows[0],
            f"{whole} “Outside”: the interval does not contain the given value.",
            shown="Estimated from the flights alone",
        ),
        TableSection("", "", (*header[:2], "fit alone, 95 %", *header[3:]), rows[1], scale, shown=ratio, columns=(0, 1, 2)),
    )
    return [one for one in found if one.rows]
