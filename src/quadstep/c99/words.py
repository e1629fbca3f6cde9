"""Units, frames and meanings of a law's inputs and outputs, as comments of a header."""

from collections.abc import Callable

from quadstep.control.controller import Controller
from quadstep.control.gain import Gain

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
}

COMMAND_WORDS = {
    "thrust": "N, along the body's z",
    "torque": "N m, about the body's axes",
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
}

VEHICLE_WORDS = {
    "allocation.matrix": "thrust of each rotor per (thrust, torque about x, y, z)",
    "allocation.least": "N, of one rotor",
    "allocation.most": "N, of one rotor",
    "allocation.thrust": "N s^2, thrust over speed squared",
}

MODEL_WORDS = {
    "gravity": "m/s^2",
    "most_thrust": "N, of all rotors together",
    "lag": "s, time constant of rotor thrust",
    "slowest": "rad/s, of a rotor",
    "fastest": "rad/s, of a rotor",
}
"""Quantities without a key that a law takes from the vehicle."""


def from_table(words: dict[str, str]) -> Callable[[str], str]:
    """Comments by dotted name."""
    return lambda name: words.get(name, "")


def of_gains(controller: Controller, gains: object) -> Callable[[str], str]:
    """Unit and meaning of a gain, as declared by its law; for computed gains, as declared by these."""
    declared = dict(getattr(type(gains), "_field_defaults", {})) | dict(type(controller).declarations())

    def comment(name: str) -> str:
        declaration = declared.get(name)
        if not isinstance(declaration, Gain):
            return MODEL_WORDS.get(name.rpartition(".")[2], "") if declaration is not None else ""
        return ", ".join(part for part in (declaration.unit if declaration.unit != "-" else "", declaration.meaning) if part)

    return comment
