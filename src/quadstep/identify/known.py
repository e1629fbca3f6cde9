"""How well the numbers of a vehicle are known from its flights, beside those that it began with."""

import math

from quadstep.identify.fit import Fitted, Identified
from quadstep.identify.parameters import GROWS, VEHICLE
from quadstep.identify.vehicle_file import fraction
from quadstep.mission.airframe import AirframeSection
from quadstep.mission.fields import words
from quadstep.mission.listings import numbers
from quadstep.report.evidence import TableSection
from quadstep.report.units import counted, handy, interval_texts, listed, number, prose

GRADES = {"well": " (to within 10 %)", "roughly": " (to within 50 %)", "barely": ""}
"""How well a number is known, by its 95 % interval."""

SIGNED = [one.key for one in VEHICLE if one.low < 0.0 and not one.logarithmic]
"""Offsets and angles, of which a share means nothing."""

READING = (
    "Well known: the interval is within 10 % of the value; roughly: within 50 %; barely: wider. “Outside”: the interval does "
    "not contain the value of the starting vehicle."
)


def in_words(key: str) -> str:
    """A parameter as a sentence has it: inertia[0] is the inertia about x."""
    return words(key.replace("[", ".").removesuffix("]"))


def grade(key: str, one: Fitted) -> str:
    """One of `GRADES`; none for `SIGNED`."""
    share = max(one.high / one.value, 2.0 - one.low / one.value) - 1.0 if one.value else 1.0
    return "" if key in SIGNED else "well" if share <= 0.1 else "roughly" if share <= 0.5 else "barely"


def graded(fit: Identified) -> str:
    """How many numbers are known, how well, and what that rests on."""
    grades, count = [grade(key, one) for key, one in fit.fitted.items()], len(fit.fitted) + len(fit.kept)
    how = [f"{grades.count(one) or 'none'} {one}{width}" for one, width in GRADES.items()]
    signs = f"; {grades.count('')} can have either sign" if "" in grades else ""
    scaled = sum(key in GROWS for key in fit.fitted)
    rests = f" Of these, {scaled} can be no more accurate than the given mass, thrust coefficient and yaw inertia."
    said = f"{len(fit.fitted)} of {counted(count, 'vehicle parameter')} were identified: {listed(how)}{signs}."
    return said + rests * bool(scaled)


def number_of(vehicle: AirframeSection, key: str, usual: float) -> float:
    """The number of a vehicle by its key, such as inertia[0], or the usual one where it has none."""
    name, _, axis = key.removesuffix("]").partition("[")
    value = {one: value for one, value, _ in numbers(vehicle)}.get(name)
    part = value[int(axis)] if isinstance(value, tuple) and axis else value
    return part if isinstance(part, float) else usual


def outside(fit: Identified, given: AirframeSection) -> str:
    """A sentence on the numbers of the starting vehicle that lie outside the intervals, if any."""
    found = [in_words(key) for key, one in fit.fitted.items() if not one.low <= number_of(given, key, one.value) <= one.high]
    return f"Outside the fit's intervals: the starting vehicle's {listed(found)}." if found else ""


def fitted(fit: Identified, given: AirframeSection, upright: float) -> list[TableSection]:
    """What flights determine by themselves, and what only over what they do not. upright: inertia about z [kg m^2]."""
    rows: tuple[list[tuple[str, ...]], list[tuple[str, ...]]] = [], []
    for key, one in fit.fitted.items():
        unit, factor = handy(one.unit, abs(one.value)) if one.unit in ("m", "s") else (prose(one.unit), 1.0)
        value, low, high, _ = interval_texts(factor * one.value, factor * one.low, factor * one.high, "-")
        before = number_of(given, key, math.nan)
        theirs = number(factor * before) + ", outside" * bool(before < one.low or before > one.high)
        over = GROWS.get(key, "")
        name, span = in_words(key) + f" [{unit}]" * bool(unit), fraction(one) if over else f"{low} to {high}"
        rows[bool(over)].append((name, value, span, theirs, grade(key, one) or "–", over))
    mass, thrust, about_z, before_z = map(number, (given.mass, given.rotor.thrust_coefficient, upright, given.inertia[2]))
    whole = "These intervals hold whatever the vehicle weighs; they take its rotors to be where the given vehicle has them."
    scale = (
        "No flight reveals the mass m, the rotors' thrust coefficient k_f or the inertia about z, J_z. The next table is for "
        f"m = {mass} kg and k_f = {thrust} N s^2, as given, and J_z = {about_z} kg m^2 (given: {before_z}), in proportion to "
        "the inertias about x and y. If one is wrong, so are the values, in proportion (nearly, where it is J_z); the fit's "
        "own error adds to that."
    )
    header = ("parameter", "value", "95 % interval", "given", "known", "proportional to")
    ratio = "Known only up to the mass m, thrust coefficient k_f and yaw inertia J_z"
    found = (
        TableSection("", "", header, rows[0], f"{whole} {READING}", shown="Identified"),
        TableSection("", "", (*header[:2], "fit alone, 95 %", *header[3:]), rows[1], scale, shown=ratio),
    )
    return [one for one in found if one.rows]
