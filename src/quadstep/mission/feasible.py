"""Whether a vehicle can fly a path at all: the thrust that its acceleration takes, against what the rotors have."""

import math
from collections.abc import Sequence

from quadstep.interfaces.reference import Reference
from quadstep.numbers import Vector, vector

INSTANTS = 400
"""At which a path is looked at; a peak between two of them is missed."""


def instants(duration: float) -> list[float]:
    """The times [s] at which a path is looked at."""
    return [duration * step / INSTANTS for step in range(INSTANTS + 1)]


def path_warnings(
    times: Sequence[float], path: Sequence[Reference], mass: float, gravity: float, most_thrust: float
) -> list[str]:
    """What is said of a path, given at these times [s], whose accelerations take more than all rotors have.

    mass [kg], gravity [m/s^2]. most_thrust: of all rotors [N], infinite where there is no limit.
    """
    if not math.isfinite(most_thrust):
        return []
    up = vector(0.0, 0.0, gravity)
    taken, at = max((mass * float((Vector(one.acceleration) + up).norm()), t) for one, t in zip(path, times, strict=True))
    if not taken > most_thrust:
        return []
    fastest = max(float(Vector(one.velocity).norm()) for one in path)
    return [
        f"path: this vehicle cannot fly it: at {at:.3g} s it takes {taken:.3g} N of thrust, and all rotors together have "
        f"{most_thrust:.3g} N; its greatest speed is {fastest:.3g} m/s (lengths are in m, times in s)"
    ]
