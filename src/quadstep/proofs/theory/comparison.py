"""The paper's and the completed controller over inner-loop gains, t_f, disturbance and nets.

Two more laws show what each part of the completion gains: the counter-term without the rigid-body torque, and the
completed law without the counter-term.
"""

from typing import NamedTuple

import numpy as np

from quadstep.control.completed_backstepping import CompletedBackstepping, CompletedGains
from quadstep.engines.fly import FlightPlan, fly_all
from quadstep.metrics.registry import flight_metrics, metric
from quadstep.numbers import Number, Vector, vector
from quadstep.studies.paper.cases import HOLD, case_1

INNER_LOOPS = ((250.0, 15.0), (120.0, 10.0), (60.0, 6.0), (31.0, 3.0), (15.0, 1.4), (10.5, 1.0))
"""(K_r2 [N m s], Lambda_2 [1/s]). All but (60, 6) keep the printed condition K_r2 > J_M Lambda_2, J_M = 10."""

PAPER, COUNTER_ONLY, COMPLETED, UNCOUNTERED = "the paper's", "counter-term only", "completed", "completed, no counter-term"
LAWS: dict[str, dict[str, object]] = {
    PAPER: {"type": "backstepping"},
    COUNTER_ONLY: {"type": "completed-backstepping", "P": 20.0, "inertia": 1e-9},
    COMPLETED: {"type": "completed-backstepping"},
    UNCOUNTERED: {"type": "completed-backstepping"},
}


class Uncountered(CompletedBackstepping):
    """The completed law with its counter-rate at zero."""

    def countering(self, gains: CompletedGains, u_d: Number, tilt: Vector, wanted: Vector, r1: Vector) -> Vector:
        return vector(0.0, 0.0)


TIMES = (10.0, 8.0, 6.0, 5.0, 4.0, 3.0)
SCALES = (0.0, 1.0, 5.0)
TOLERANCE = 1.01
"""The completed controller should never be worse by more than 1 %."""


class GridFlight(NamedTuple):
    """One flight of the grid. rmse [m]: of the position, None where it diverged at `ended` [s]. law: of LAWS."""

    gain: float
    slope: float
    time: float
    scale: float
    nets: bool
    law: str
    rmse: float | None
    ended: float


def plan_of(gain: float, slope: float, time: float, scale: float, nets: bool, law: str) -> FlightPlan:
    mission = case_1(
        duration=time,
        disturbance={"scale": scale},
        controller={**LAWS[law], "K_r2": gain, "Lambda2": slope, "nets": {"enabled": nets}},
        simulation={"duration": time + HOLD},
    )
    plan: FlightPlan = mission.plan()
    return plan.with_controller(Uncountered(), plan.parameters.gains) if law == UNCOUNTERED else plan


def grid() -> list[GridFlight]:
    """Fly every law over the whole grid."""
    keys = [
        (gain, slope, time, scale, nets, law)
        for gain, slope in INNER_LOOPS
        for scale in SCALES
        for nets in (True, False)
        for time in TIMES
        for law in LAWS
    ]
    metrics = [flight_metrics(log) for log in fly_all([plan_of(*key) for key in keys])]
    return [
        GridFlight(*key, metric(m, "position_rmse[m]") if m["outcome"] == "completed" else None, metric(m, "ended[s]"))
        for key, m in zip(keys, metrics, strict=True)
    ]


def disturbance_over_weight(times: tuple[float, ...] = TIMES) -> dict[float, float]:
    """Largest entry of the paper's disturbance (scale 1) over the weight, along the path flown without it, by t_f."""
    plans = [case_1(duration=t, disturbance={"scale": 0.0}).plan() for t in times]
    result = {}
    for t, log in zip(times, fly_all(plans), strict=True):
        products = log.table("x_dot", "y_dot", "z_dot") * log.table("phi_dot", "theta_dot", "psi_dot")
        result[t] = float(np.abs(products).max()) / 9.81
    return result


class ComparisonSummary(NamedTuple):
    """A law compared with another over the grid: flights, survivors, flights gained, lost and worse, ratios of RMSE."""

    flights: int
    other_flies: int
    law_flies: int
    gained: int
    lost: int
    worse: int
    worst_ratio: float
    median_ratio: float
    best_ratio: float


def summarise(cells: list[GridFlight], law: str, beside: str = PAPER) -> ComparisonSummary:
    """Pair the cells of a law with another's by flight and compare."""
    other = {cell[:5]: cell for cell in cells if cell.law == beside}
    pairs = [(other[cell[:5]], cell) for cell in cells if cell.law == law]
    ratios = [ours.rmse / theirs.rmse for theirs, ours in pairs if ours.rmse is not None and theirs.rmse is not None]
    return ComparisonSummary(
        flights=len(pairs),
        other_flies=sum(theirs.rmse is not None for theirs, _ in pairs),
        law_flies=sum(ours.rmse is not None for _, ours in pairs),
        gained=sum(theirs.rmse is None and ours.rmse is not None for theirs, ours in pairs),
        lost=sum(theirs.rmse is not None and ours.rmse is None for theirs, ours in pairs),
        worse=sum(ratio > TOLERANCE for ratio in ratios),
        worst_ratio=max(ratios),
        median_ratio=float(np.median(ratios)),
        best_ratio=min(ratios),
    )
