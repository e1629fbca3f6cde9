"""Whether a vehicle can fly a path at all: the thrust that its acceleration takes, against what the rotors have."""

import math

from quadstep.mission.paths import BuiltPath
from quadstep.numbers import Vector, vector
from quadstep.world.guidance.declared import DeclaredPath

INSTANTS = 400
"""At which a path is looked at; a peak between two of them is missed."""


def path_warnings(path: BuiltPath, duration: float, mass: float, gravity: float, most_thrust: float) -> list[str]:
    """What is said of a path whose accelerations, in a flight of `duration` [s], take more than all rotors have.

    mass [kg], gravity [m/s^2]. most_thrust: of all rotors [N], infinite where there is no limit. Nothing is said of a path of
    the user's own.
    """
    if not math.isfinite(most_thrust) or isinstance(path.law, DeclaredPath):
        return []
    times = [duration * step / INSTANTS for step in range(INSTANTS + 1)]
    references, up = [path.law.reference(t, path.parameters) for t in times], vector(0.0, 0.0, gravity)
    taken, at = max(
        (mass * float((Vector(one.acceleration) + up).norm()), t) for one, t in zip(references, times, strict=True)
    )
    if not taken > most_thrust:
        return []
    fastest = max(float(Vector(one.velocity).norm()) for one in references)
    return [
        f"path: this vehicle cannot fly it: at {at:.3g} s it takes {taken:.3g} N of thrust, and all rotors together have "
        f"{most_thrust:.3g} N; its greatest speed is {fastest:.3g} m/s (lengths are in m, times in s)"
    ]
