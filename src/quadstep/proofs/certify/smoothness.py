"""Whether a path is smooth enough for the theorem: position, velocity and acceleration without jumps, and fitting together."""

import numpy as np

from quadstep.engines.fly import FlightPlan
from quadstep.io.errors import UserError
from quadstep.numbers import Vector
from quadstep.proofs.certify.arrays import Array, as_rows
from quadstep.proofs.certify.history import reference_at

SUSPECTS, HALVINGS = 20, 24
"""How many control periods are searched for a jump, and how often each is halved (2 ms to 0.1 ns)."""

JUMP = 0.01
"""A change that keeps this share of itself after all halvings is a jump; a continuous one would keep 2^-24."""

SLACK = 1e-3
"""Largest mismatch between a path's changes and its rates, as a share of the way."""

PARTS = (("position", "m"), ("velocity", "m/s"), ("acceleration", "m/s^2"), ("yaw", "rad"), ("yaw rate", "rad/s"))


def path_parts(plan: FlightPlan, t: Array) -> list[Array]:
    """The `PARTS` of the path at many times, (n, 3) or (n, 1) each."""
    wanted = reference_at(plan, t)
    parts = [*wanted[:3], Vector((wanted.yaw,)), Vector((wanted.yaw_rate,))]
    return [as_rows(part, len(t)) for part in parts]


def largest_jump(plan: FlightPlan, t: Array, part: int) -> tuple[float, float]:
    """(size, time [s]) of the largest jump of one part between the times t; size 0 where there is none.

    Periods whose change differs most from their neighbours' are halved again and again, keeping the half that changes more.
    """
    values = path_parts(plan, t)[part]
    steps = np.linalg.norm(np.diff(values, axis=0), axis=1)
    bends = np.linalg.norm(np.diff(values, n=2, axis=0), axis=1)
    odd = np.maximum(np.append(bends, 0.0), np.insert(bends, 0, 0.0))
    suspects = np.unique(np.concatenate([np.argsort(odd)[-SUSPECTS:], np.argsort(steps)[-SUSPECTS:]]))
    low, high, whole = t[suspects], t[suspects + 1], steps[suspects]
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        below, centre, above = (path_parts(plan, times)[part] for times in (low, middle, high))
        upper = np.linalg.norm(above - centre, axis=1) > np.linalg.norm(centre - below, axis=1)
        low, high = np.where(upper, middle, low), np.where(upper, high, middle)
    left = np.linalg.norm(path_parts(plan, high)[part] - path_parts(plan, low)[part], axis=1)
    floor = 1e-9 * (1.0 + float(np.abs(values).max()))
    left[(left < JUMP * whole) | (left < floor)] = 0.0
    worst = int(np.argmax(left))
    return float(left[worst]), float(high[worst])


def mismatch(values: Array, rates: Array, middles: Array, period: float) -> float:
    """How far the changes of `values` are from the integral of `rates` (Simpson), as a share of the way."""
    gained = period / 6.0 * (rates[:-1] + 4.0 * middles + rates[1:])
    moved = np.diff(values, axis=0)
    rounding = 1e-12 * (1.0 + np.abs(values).max()) * len(values)
    return float(np.abs(moved - gained).sum() / (np.abs(moved).sum() + np.abs(gained).sum() + rounding / SLACK))


def check_path(plan: FlightPlan, t: Array) -> None:
    """Raises UserError for a path that jumps, or whose velocity or acceleration is not the right rate.

    t: the control samples [s].
    """
    parts = path_parts(plan, t)
    if not all(np.isfinite(part).all() for part in parts):
        raise UserError("path: not finite at every control sample; Theorem 5.1 needs a twice differentiable path")
    for part, (name, unit) in enumerate(PARTS):
        size, time = largest_jump(plan, t, part)
        if size:
            raise UserError(
                f"path: its {name} jumps by {size:.4g} {unit} at t = {time:.6g} s; "
                "Theorem 5.1 needs a twice differentiable path"
            )
    middles = path_parts(plan, 0.5 * (t[:-1] + t[1:]))
    for value, rate in ((0, 1), (1, 2), (3, 4)):
        share = mismatch(parts[value], parts[rate], middles[rate], float(t[1] - t[0]))
        if share > SLACK:
            raise UserError(
                f"path: its {PARTS[rate][0]} is not the rate of its {PARTS[value][0]} from control sample to control sample "
                f"(off by {100.0 * share:.3g} % of the way, allowed {100.0 * SLACK:g} %)"
            )
    at_start, speed = plan.start.velocity, float(np.linalg.norm(parts[1][0]))
    if speed > 0.0 and not any(at_start):
        raise UserError(
            f"path: at t = 0 it moves at {speed:.4g} m/s and the start is at rest, a jump in velocity; "
            "missing is a ramp, or a start with the path's velocity"
        )
