"""Whether rotors can hold a vehicle in its mean wind: a necessary condition for an equilibrium."""

import math
from typing import cast

import numpy as np

from quadstep.engines.fly import FlightPlan
from quadstep.linear.sampled import Loops
from quadstep.numbers import Vector, vector
from quadstep.numbers.rotations import from_rotation_vector, quaternion_of, rotation_matrix
from quadstep.vehicle.multirotor import Multirotor, Spun
from quadstep.vehicle.rigid_body import AirframeState

TILTS, SPEEDS, CLEARLY = 360, 5, 0.03
"""Tilts against the wind from 0° to 90°, and rotor speeds, that are tried; the share of gravity that has to be missing."""


def cannot_hover(plan: FlightPlan) -> str:
    """Why no tilt holds height and place in the mean wind, in a clause; "" where one may."""
    plant, p = plan.loop.plant, plan.parameters
    wind = getattr(p, "wind", None)  # the paper's plant has none
    x, y, z = (float(one) for one in getattr(wind, "mean", (0.0, 0.0, 0.0)))
    strength = math.hypot(x, y)
    if not (isinstance(plant, Multirotor) and strength):
        return ""
    rotor, still = p.airframe.rotor, vector(0.0, 0.0, 0.0)
    state = cast(AirframeState, Loops(plan).begin().cycle.state)
    best = -math.inf
    for tilt in np.linspace(0.0, 0.5 * math.pi, TILTS).tolist():
        lean = rotation_matrix(from_rotation_vector(vector(tilt * y / strength, -tilt * x / strength, 0.0)))
        attitude = quaternion_of(lean @ rotation_matrix(state.attitude))
        for speed in np.linspace(rotor.slowest, rotor.fastest, SPEEDS).tolist():
            speeds = Vector([speed] * len(plant.geometry.mounts))
            at = state._replace(velocity=still, rates=still, attitude=attitude, speeds=speeds)
            a, b, up = (float(one) for one in plant.rate(p, at, Spun(speeds, 0.0, still), vector(x, y, z), 0.0).velocity)
            best = max(best, min(up, -(a * x + b * y) / strength))
    if best > -CLEARLY * float(p.airframe.gravity):
        return ""
    total = math.hypot(strength, z)
    return f"it cannot hover in this wind of {total:.3g} m/s: at no tilt do its rotors carry it and hold against the wind"
