"""What a mission must satisfy for Theorem 5.1 to apply, and all numbers of a certificate, from one flight."""

import math
from typing import NamedTuple, cast

import numpy as np

from quadstep.engines.fly import FlightPlan, fly
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.log import FlightLog
from quadstep.io.errors import UserError
from quadstep.numbers import Vector
from quadstep.proofs.certify.history import (
    History,
    IdealWeights,
    ideal_weights,
    recall,
    reference_at,
    residual_bound,
    targets,
    weight_bound,
)
from quadstep.proofs.certify.lyapunov import ConditionMargins, Lyapunov, conditions, lyapunov, matrices
from quadstep.proofs.plain import Array, Mask, as_rows, lengths
from quadstep.vehicle.lagrange import Lagrange

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
            f"path: at t = 0 it moves at {speed:.4g} m/s but the vehicle starts at rest, a jump in velocity; "
            "add a ramp, or start with the path's velocity"
        )


MOST_SAMPLES = 500_000
FEWEST_SAMPLES = 10

LEAST_FORCE = 0.01
"""Least y-z part of the commanded force, as a share of the weight: the rates of theta_d and phi_d grow with its inverse."""

AGREEMENT = 1e-6
"""Largest difference between the law recomputed from the log and the flight, relative beyond 1."""


def check_plan(plan: FlightPlan) -> None:
    """Before the flight. Raises UserError."""
    if not plan.loop.controller.theorem:
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


NO_RATES = ", so theta_d and phi_d are not differentiable there"
ZERO_THRUST = f"{NO_RATES}; the thrust must stay away from zero"


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
        return "a thrust that swings past straight down, where phi_d jumps by 360°"
    least = f"{100.0 * LEAST_FORCE:g} % of the weight ({LEAST_FORCE * weight:.3g} N)"
    return f"a thrust whose y-z part is {part:.3g} N, below {least}"


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


def error_radius(weight_bound: float, residual_bound: float, kappa: float, k_min: float) -> float | None:
    """b_r = (kappa W_B^2 / 4 + eps_N) / K_min (Eq. 63, which prints it without kappa); None if K_min is not positive."""
    return (kappa * (weight_bound * weight_bound) / 4.0 + residual_bound) / k_min if k_min > 0.0 else None


def weight_radius(weight_bound: float, residual_bound: float, kappas: tuple[float, float]) -> float | None:
    """b_w = W_B/2 + sqrt(W_B^2/4 + eps_N/kappa) (Eq. 65); None without damping.

    Where the nets have different kappas it is the larger root of kappa_min w^2 - kappa_max W_B w = eps_N.
    """
    least, most = min(kappas), max(kappas)
    if least <= 0.0:
        return None
    half = 0.5 * weight_bound * most / least
    return half + math.sqrt(half**2 + residual_bound / least)


class FlightCertificate(NamedTuple):
    """What Theorem 5.1 says about a flight and what the flight did.

    outcome, ended [s]: of the flight; until [s]: the last sample judged; undefined: what is commanded next, if that defines no
    attitude; later: |r| of the samples that follow. conditions, ideal, lyapunov: as in their files.
    weight_bound: W_B; residual_bound: eps_N [N, N m]; with _plain: of least squares without a ridge.
    b_r, b_r_printed, b_w: Eqs 63 and 65, None where there is no such radius. r, missing: |r| and |W_tilde| (n,).
    entered: the first sample with |r| <= b_r, which ends the transient; None if there is none.
    """

    outcome: Outcome
    ended: float
    until: float
    undefined: str
    later: Array
    history: History
    conditions: ConditionMargins
    ideal: IdealWeights
    lyapunov: Lyapunov
    weight_bound: float
    residual_bound: float
    weight_bound_plain: float
    residual_bound_plain: float
    b_r: float | None
    b_r_printed: float | None
    b_r_plain: float | None
    b_w: float | None
    r: Array
    missing: Array
    entered: int | None

    @property
    def outside(self) -> Mask:
        """Which samples have |r| > b_r; none without b_r."""
        return self.r > (np.inf if self.b_r is None else self.b_r)

    @property
    def coupling_ratio(self) -> Array:
        """|r1| |delta| / (K_min |r|^2) at the samples with |r| > 0; empty if K_min is not positive."""
        moving = self.r > 0.0
        if self.conditions.k_min <= 0.0:
            return np.zeros(0)
        size = lengths(self.history.r1) * lengths(self.history.delta)
        return size[moving] / (self.conditions.k_min * np.square(self.r[moving]))


def certify_plan(plan: FlightPlan) -> FlightCertificate:
    """Fly a plan and certify it. Raises UserError where Theorem 5.1 does not apply.

    A diverging flight is examined up to where its commanded force last defined an attitude.
    """
    check_plan(plan)
    plan = plan._replace(ticks=plan.ticks._replace(log=plan.ticks.every[0]))
    log = fly(plan)
    with np.errstate(over="ignore"):  # a saturated sigmoid is zero or one
        return certify_flight(plan, log)


def certify_flight(plan: FlightPlan, log: FlightLog) -> FlightCertificate:
    """The certificate of a flight of this plan, logged at every control sample. Raises UserError."""
    if len(log.rows) < FEWEST_SAMPLES:
        raise UserError(f"the flight diverged after {len(log.rows)} control samples; certify needs {FEWEST_SAMPLES}")
    history = recall(plan, log)
    check_flight(plan, history)
    undefined, what, r = first_undefined(plan, history.wanted), "", history.size
    if undefined is not None:
        what = too_little(plan, history.wanted, undefined)
        if log.outcome is Outcome.COMPLETED or undefined < FEWEST_SAMPLES:
            raise UserError(f"the controller commands {what} at t = {history.t[undefined]:.4g} s{ZERO_THRUST}")
        history = recall(plan, log._replace(rows=log.rows[:undefined]))
    return certificate(plan, log, history, what, r)


def certificate(plan: FlightPlan, log: FlightLog, history: History, undefined: str, all_r: Array) -> FlightCertificate:
    """all_r: |r| of the whole flight, of which `history` may be the first part."""
    gains = plan.parameters.gains
    about = matrices(plan, history)
    ideal = ideal_weights(plan, history, targets(plan, history, about.inertia, about.coriolis))
    asked = conditions(plan, about.inertia, history.thrust)
    kappas = (gains.force_net.damping, gains.torque_net.damping)
    kappa = max(kappas) if ideal.used else 0.0
    size, error = weight_bound(ideal.fits), residual_bound(ideal.fits)
    plain_size, plain_error = weight_bound(ideal.plain), residual_bound(ideal.plain)
    b_r = error_radius(size, error, kappa, asked.k_min)
    r, later = np.split(all_r, [len(history.t)])
    inside = np.flatnonzero(r <= (-1.0 if b_r is None else b_r))
    return FlightCertificate(
        outcome=log.outcome,
        ended=log.ended,
        until=float(history.t[-1]),
        undefined=undefined,
        later=later,
        history=history,
        conditions=asked,
        ideal=ideal,
        lyapunov=lyapunov(plan, history, about, ideal),
        weight_bound=size,
        residual_bound=error,
        weight_bound_plain=plain_size,
        residual_bound_plain=plain_error,
        b_r=b_r,
        b_r_printed=error_radius(size, error, 1.0, asked.k_min_printed),
        b_r_plain=error_radius(plain_size, plain_error, kappa, asked.k_min),
        b_w=weight_radius(size, error, kappas) if ideal.used else None,
        r=r,
        missing=np.hypot(lengths(ideal.missing(1, history)), lengths(ideal.missing(2, history))),
        entered=int(inside[0]) if len(inside) else None,
    )
