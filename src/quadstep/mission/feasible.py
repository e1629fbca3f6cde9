"""Whether a vehicle can fly a path at all: the thrust that its acceleration takes, against what the rotors have."""

import math
from typing import cast

import numpy as np

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
    times = duration * np.arange(INSTANTS + 1) / INSTANTS
    found = path.law.reference(cast("float", times), path.parameters)
    thrusts = np.broadcast_to(mass * (Vector(found.acceleration) + vector(0.0, 0.0, gravity)).norm(), times.shape)
    taken, at = thrusts.max(), times[thrusts.argmax()]
    if not taken > most_thrust:
        return []
    fastest = np.max(Vector(found.velocity).norm())
    return [
        f"path: this vehicle cannot fly it: at {at:.3g} s it takes {taken:.3g} N of thrust, and all rotors together have "
        f"{most_thrust:.3g} N; its greatest speed is {fastest:.3g} m/s (lengths are in m, times in s)"
    ]
