"""What a mission must satisfy for Theorem 5.1 to apply; anything else is refused in one line."""

from typing import cast

import numpy as np

from quadstep.control.backstepping import Backstepping
from quadstep.engines.fly import FlightPlan
from quadstep.io.errors import UserError
from quadstep.proofs.certify.arrays import Array, as_rows
from quadstep.proofs.certify.history import History, reference_at
from quadstep.proofs.certify.smoothness import check_path
from quadstep.vehicle.plants.lagrange import Lagrange

MOST_SAMPLES = 500_000
FEWEST_SAMPLES = 10

LEAST_FORCE = 0.01
"""Least y-z part of the commanded force, as a share of the weight: the rates of theta_d and phi_d grow with its inverse."""

AGREEMENT = 1e-6
"""Largest difference between the law recomputed from the log and the flight, relative beyond 1."""


def check_plan(plan: FlightPlan) -> None:
    """Before the flight. Raises UserError."""
    if type(plan.loop.controller) is not Backstepping:
        raise UserError(
            f"controller: {type(plan.loop.controller).__name__} is not the law of Theorem 5.1 (its r1, r2 and two nets are "
            'missing); certify needs controller.type = "backstepping"'
        )
    gains, ticks = plan.parameters.gains, plan.ticks
    learns = gains.learning_start <= ticks.step * ticks.last
    for name, net in (("F1", gains.force_net), ("F2", gains.torque_net)):
        if learns and net.learning_rate <= 0.0:
            raise UserError(f"controller.nets.{name} = 0: L of Eq. 55 needs its inverse; certify needs {name} > 0, or no nets")
    samples = ticks.last // ticks.every[0] + 1
    if not FEWEST_SAMPLES <= samples <= MOST_SAMPLES:
        raise UserError(f"simulation: {samples} control samples; certify takes {FEWEST_SAMPLES} to {MOST_SAMPLES}")
    t: Array = np.arange(samples) * np.float64(ticks.step * ticks.every[0])
    check_path(plan, t)
    wanted = as_rows(reference_at(plan, t).acceleration, samples)
    demand = plan.parameters.vehicle.mass * (wanted + np.array([0.0, 0.0, plan.parameters.vehicle.gravity]))
    undefined = first_undefined(plan, demand)
    if undefined is not None:
        raise UserError(f"path: it requires {too_little(plan, demand, undefined)} at t = {t[undefined]:.4g} s{ZERO_THRUST}")


ZERO_THRUST = ", so theta_d and phi_d are not differentiable there; the thrust must stay away from zero"


def sideways(force: Array) -> Array:
    """B of Eq. 45, the y-z part of a force, (n,) [N]."""
    return np.hypot(force[:, 1], force[:, 2])


def first_undefined(plan: FlightPlan, force: Array) -> int | None:
    """The first sample whose commanded force leaves theta_d or phi_d without a rate: too small beside x, or passing below."""
    vehicle = plan.parameters.vehicle
    small = sideways(force) < LEAST_FORCE * vehicle.mass * vehicle.gravity
    phi = np.arctan2(force[:, 1], force[:, 2])
    wrapped = np.append(np.abs(np.diff(phi)) > np.pi, False)
    found = np.flatnonzero(small | wrapped)
    return int(found[0]) if len(found) else None


def too_little(plan: FlightPlan, force: Array, sample: int) -> str:
    """The demand at a sample in words."""
    weight = plan.parameters.vehicle.mass * plan.parameters.vehicle.gravity
    part = sideways(force)[sample]
    if part >= LEAST_FORCE * weight:
        return "a thrust straight down, where phi_d jumps by 2 pi,"
    return f"a thrust whose y-z part is {part:.3g} N, below {LEAST_FORCE:g} of the weight ({LEAST_FORCE * weight:.3g} N),"


def check_flight(plan: FlightPlan, h: History) -> None:
    """After the flight. Raises UserError where rotor limits changed the law's commands."""
    bitten = np.flatnonzero(h.excess > AGREEMENT * (1.0 + np.abs(h.thrust) + np.linalg.norm(h.torque, axis=1)))
    if cast(Lagrange, plan.loop.plant).rotor_limits and len(bitten):
        raise UserError(
            f"vehicle.rotors.limits: active in {len(bitten)} of {len(h.t)} control samples, first at t = "
            f"{h.t[bitten[0]]:.4g} s; Theorem 5.1 assumes no saturation: wider limits are needed for this flight"
        )
    if len(bitten) or h.mismatch > AGREEMENT:
        raise UserError(f"the flight does not follow from the paper's law (relative difference {h.mismatch:.2g})")
