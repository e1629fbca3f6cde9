"""The unknowns of a flight: whatever is proved holds for all of their values."""

from __future__ import annotations

from typing import NamedTuple, cast

import numpy as np

from quadstep.engines.fly import FlightPlan
from quadstep.engines.loop import Numbers
from quadstep.io.errors import UserError
from quadstep.numbers import Number, Vector
from quadstep.numbers.enclosure import Array, Enclosure
from quadstep.vehicle.paper import Disturbance
from quadstep.vehicle.plants.lagrange import Parameters

PUSHES, CONSTANTS = 6, 4


class Unknown(NamedTuple):
    """Bounds. force [N], torque [N m]: per axis, constant from sample to sample, otherwise arbitrary. mass, inertia:
    of the vehicle, constant, relative to the mission's (0.01: within 1 %). start [m], start_velocity [m/s], start_attitude
    [rad], start_rates [rad/s]: of the state at the start, per axis, in the coordinates of the plant's state; a quaternion is
    turned about the vehicle's axes. Whatever else a start determines (memories, delay lines, estimates) moves with it.
    """

    force: float = 0.0
    torque: float = 0.0
    mass: float = 0.0
    inertia: float = 0.0
    start: float = 0.0
    start_velocity: float = 0.0
    start_attitude: float = 0.0
    start_rates: float = 0.0

    @property
    def pushes(self) -> Array:
        """Bounds on the unknowns that may change at every sample: three forces, three torques."""
        return np.array([self.force] * 3 + [self.torque] * 3)

    @property
    def shares(self) -> Array:
        """Bounds on the constant unknowns: mass, three inertias, each as a share."""
        return np.array([self.mass] + [self.inertia] * 3)


LARGEST = Unknown(1e3, 1e3, 0.9, 0.9, start=1e3, start_velocity=1e3, start_attitude=1.0, start_rates=1e3)
"""The largest bounds."""


def refuse_out_of_range(unknown: Unknown, key: str) -> None:
    """Raises UserError for a bound that is negative, too large or not a number. key: its name, with {} for the field's."""
    for name, value, most in zip(Unknown._fields, unknown, LARGEST, strict=True):
        if not 0.0 <= value <= most:
            raise UserError(f"{key.format(name.replace('_', '-'))}: should be from 0 to {most:g}, not {value:g}")


def check_unknown(plan: FlightPlan, unknown: Unknown) -> None:
    """Raises UserError if a plan has no such numbers, or for invalid bounds."""
    refuse_out_of_range(unknown, "--{}")
    given = [name for name, value in zip(Unknown._fields[:4], unknown, strict=False) if value]
    paper = isinstance(plan.parameters, Parameters) and isinstance(plan.parameters.disturbance, Disturbance)
    if given and not paper:
        raise UserError(f"--{given[0]}: supported only on the paper's plant with its own disturbance; leave it out")


def with_unknown(p: Numbers, unknown: Unknown, first: int, total: int, samples: int) -> Numbers:
    """The parameters as enclosures whose directions begin at `first`, of `total`."""

    def number(value: float, radius: float, place: int) -> Number:
        if not radius:
            return value
        parts = np.zeros((total, samples))
        parts[first + place] = radius
        width = np.full(samples, abs(radius))
        return cast(Number, Enclosure(np.full(samples, float(value)), parts, np.zeros(samples), width))

    if not isinstance(p, Parameters) or not any(unknown[:4]):
        return p
    force, torque, shares = unknown.pushes[:3], unknown.pushes[3:], unknown.shares
    before = cast(Disturbance, p.disturbance)
    disturbance = before._replace(
        force=Vector(number(x, r, i) for i, (x, r) in enumerate(zip(before.force, force, strict=True))),
        torque=Vector(number(x, r, 3 + i) for i, (x, r) in enumerate(zip(before.torque, torque, strict=True))),
    )
    inertia = p.vehicle.inertia
    vehicle = p.vehicle._replace(
        mass=number(p.vehicle.mass, shares[0] * p.vehicle.mass, PUSHES),
        inertia=Vector(number(x, r * x, PUSHES + 1 + i) for i, (x, r) in enumerate(zip(inertia, shares[1:], strict=True))),
    )
    return p._replace(disturbance=disturbance, vehicle=vehicle)
