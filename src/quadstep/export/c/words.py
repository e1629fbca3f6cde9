"""Units, frames and meanings of a law's inputs and outputs, as comments of a header."""

import re
from collections.abc import Callable, Mapping

from quadstep.export.c.naming import remark
from quadstep.export.c.structs import as_structs, fields_of, parts_of
from quadstep.interfaces.controller import Controller
from quadstep.interfaces.gain import Gain
from quadstep.numbers import Structure

PLANT_WORDS = {
    "position": "m, world, z up",
    "velocity": "m/s, world",
    "attitude": "rad, (psi, theta, phi) as docs/conventions.md has them",
    "rates": "rad/s, rates of these angles",
    "pitch": "rad, positive tilts the thrust towards -x",
    "rate": "rad/s",
    "thrust": "N",
    "torque": "N m",
}

MEASURED_WORDS = {
    **PLANT_WORDS,
    "attitude": "unit quaternion (w, x, y, z), body to world",
    "rates": "rad/s, about the body's axes: x ahead, y left, z up",
    "thrust": "N, as last returned by made()",
    "torque": "N m, as last returned by made()",
    "specific_force": "m/s^2, last sample of the accelerometer, body axes",
    "rotor_speeds": "rad/s, of each rotor",
    "age": "s, of position and velocity",
    "noise.words": "-, key of the law's random numbers: four whole numbers below 65536",
}

REFERENCE_WORDS = {
    "position": "m, world, z up",
    "velocity": "m/s",
    "acceleration": "m/s^2",
    "yaw": "rad, not wrapped",
    "yaw_rate": "rad/s",
    "jerk": "m/s^3; zero if unknown",
    "snap": "m/s^4; zero if unknown",
    "yaw_acceleration": "rad/s^2; zero if unknown",
    "ahead": "the same at the later times for which the law asks",
}

COMMAND_WORDS = {
    "thrust": "N, along the body's z",
    "thrusts": "N, of each rotor",
    "torque": "N m, about the body's axes",
    "speeds": "rad/s, of each rotor",
    "desired_attitude": "rad, (yaw, pitch, roll); for the log",
    "r1": "m/s; for the log",
    "r2": "rad/s; for the log",
    "stored": "for the log",
    "weight_norms": "for the log",
}

MADE_WORDS = {
    "speeds": "rad/s, of each rotor",
    "thrust": "N, produced by these",
    "torque": "N m, produced by these",
    "values": "what the actuators are told, as the plant takes it",
}

VEHICLE_WORDS = {
    "allocation.matrix": "thrust of each rotor per (thrust, torque about x, y, z)",
    "allocation.least": "N, of one rotor",
    "allocation.most": "N, of one rotor",
    "allocation.thrust": "N s^2, thrust over speed squared",
    "allocation": "of a command to the rotors",
    "airframe": "of the vehicle",
    "rotor": "of each of its rotors",
    "rotor.thrust": "N s^2, thrust over speed squared",
    "rotor.torque": "N m s^2, torque over speed squared",
    "slowest": "rad/s, of a rotor",
    "fastest": "rad/s, of a rotor",
    "vehicle": "of the plant",
}

MODEL_WORDS = {
    "gravity": "m/s^2",
    "most_thrust": "N, of all rotors together",
    "lag": "s, time constant of rotor thrust",
    "slowest": "rad/s, of a rotor",
    "fastest": "rad/s, of a rotor",
}
"""Quantities without a key that a law takes from the vehicle."""


SENTENCE = re.compile(r"(?<=\.)(?<!Eq\.)(?<!Eqs\.) ")
"""Where one ends in a docstring."""

UNKNOWN = "unit and meaning as in the law"


def of_gains(controller: Controller, gains: Structure) -> Callable[[str], str]:
    """Unit and meaning of a gain, as declared by its law; for computed gains, as declared by these."""
    declared = type(controller).declarations()
    known = {name: unit_and_meaning(one) for name, one in declared.items() if isinstance(one, Gain)}
    return of_structure(gains, {**MODEL_WORDS, **known})


def of_structure(value: Structure, words: Mapping[str, str]) -> Callable[[str], str]:
    """Comments on its members by dotted name: as declared, from a table by the end of the name, or from a docstring."""

    def comment(name: str) -> str:
        holder, field = found_in(value, name)
        declaration = getattr(type(holder), "_field_defaults", {}).get(field)
        if isinstance(declaration, Gain):
            return unit_and_meaning(declaration) or UNKNOWN
        parts = name.split(".")
        ends = [".".join(parts[i:]) for i in range(len(parts))]
        inner = as_structs(fields_of(holder).get(field, ()))
        return next((words[end] for end in ends if end in words), "") or described(holder, field) or first(inner) or UNKNOWN

    return comment


def unit_and_meaning(gain: Gain) -> str:
    return ", ".join(part for part in (gain.unit if gain.unit != "-" else "", gain.meaning) if part)


def found_in(value: Structure, name: str) -> tuple[Structure, str]:
    """The structure that holds a member, by dotted name, and the name of its field."""
    *places, last = name.split(".")
    for place in places:
        value = as_structs(parts_of(value)[place])[0]
    return value, last if last in fields_of(value) else re.sub(r"_\d+$", "", last)


def sentences(structure: Structure) -> list[str]:
    """Of the docstring of a structure."""
    text = " ".join((type(structure).__doc__ or "").partition(">>>")[0].split())
    return [] if text.startswith(f"{type(structure).__name__}(") else SENTENCE.split(text)


def described(structure: Structure, field: str) -> str:
    """What a docstring says of a field: the text after `field [unit]:`, or the sentence that explains it among others."""
    named = [one for one in sentences(structure) if re.search(rf"(?<![\w`(]){field}( \[|[:,;.]| and | \()", one)]
    if not named:
        return ""
    sentence = max(named, key=lambda one: ":" in one.partition(field)[2])
    alone = re.fullmatch(rf"{field}(?: \[([^]]*)\])?: (.*?)\.?", sentence)
    return remark(", ".join(filter(None, alone.groups())) if alone else sentence.rstrip("."))


def first(structures: tuple[Structure, ...]) -> str:
    """What the first of these says of itself."""
    return remark(next((one.rstrip(".") for structure in structures[:1] for one in sentences(structure)), ""))
