"""Why the attitude of a flight through air stays off its command, where it does."""

import math

from quadstep.interfaces.log import FlightLog
from quadstep.metrics.quantities import shorter_way

FROM, AIR = 5.0, 1.0
"""What is off [degrees], and an airspeed [m/s], from which on it is explained: of means over the second half of a flight."""


def off_command(log: FlightLog, why: str) -> str:
    """A sentence; "" where there is nothing to explain. why: as the controller's `off_command`."""
    if not (why and {"v_x", "wind_x", "pitch_d", "roll_d"} <= log.columns.keys() and len(log.rows)):
        return ""
    half = slice(len(log.rows) // 2, None)
    air = math.hypot(*(float((log.column(f"v_{axis}") - log.column(f"wind_{axis}"))[half].mean()) for axis in "xyz"))
    turned = {angle: shorter_way(log.column(f"{angle}_d") - log.column(angle))[half] for angle in ("pitch", "roll")}
    off = {angle: math.degrees(abs(float(one.mean()))) for angle, one in turned.items()}
    angle = max(off, key=lambda one: off[one])
    if not (air >= AIR and off[angle] >= FROM):
        return ""
    said = f"In the second half of the flight {angle} is on average {off[angle]:.0f}° off its command"
    other = "roll" if angle == "pitch" else "pitch"
    swing = math.degrees(float(abs(turned[other]).mean()))
    swings = f" {other.capitalize()} swings more, by {swing:.0f}° on average to either side of its command."
    return f"{said}; one possible reason: {why}.{swings * (round(swing) > round(off[angle]))}"
