"""Why the attitude of a flight in wind stays off its command, where it does."""

import math

import numpy as np

from quadstep.interfaces.log import FlightLog

FROM, WIND = 5.0, 1.0
"""What is off [degrees], and a wind [m/s], from which on it is explained; both are means over the second half of a flight."""


def off_command(log: FlightLog, why: str) -> str:
    """A sentence; "" where there is nothing to explain. why: as the controller's `off_command`."""
    if not (why and {"wind_x", "pitch_d", "roll_d"} <= log.columns.keys() and len(log.rows)):
        return ""
    late = slice(len(log.rows) // 2, None)
    wind = math.hypot(*(float(log.column(f"wind_{axis}")[late].mean()) for axis in "xyz"))
    off = {
        angle: abs(math.degrees(np.unwrap(log.column(f"{angle}_d") - log.column(angle))[late].mean()))
        for angle in ("pitch", "roll")
    }
    angle, half = max(off, key=lambda one: off[one]), "in the second half of the flight"
    if not (wind >= WIND and off[angle] >= FROM):
        return ""
    return f"In this wind {angle} is on average {off[angle]:.0f}° off its command {half}; one reason: {why}."
