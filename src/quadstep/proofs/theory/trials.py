"""Test cases for the theory: random closed loops, and flights of the paper's and the completed controller.

Closed loops are states, gains, ideal weights and errors, many at once as NumPy arrays, each a point of the unit cube. Errors,
residuals and differences between gains are cubes of uniform numbers, so each is often near zero beside the others: the
inequalities of docs/theory.md are tight there. The weights' error correlates with the ideal weights, the residuals with r.

Flights are over inner-loop gains, t_f, disturbance and nets. Two more laws show what each part of the completion gains: the
counter-term without the rigid-body torque, and the completed law without the counter-term.
"""

from typing import NamedTuple, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from quadstep.control.backstepping import FORCE_INPUTS, TORQUE_INPUTS, BacksteppingGains, BacksteppingMemory, position_loop
from quadstep.control.completed_backstepping import CompletedBackstepping, CompletedGains, CompletedMemory
from quadstep.control.filters import Filtered
from quadstep.engines.fly import FlightPlan, fly_all
from quadstep.interfaces.learning import Net
from quadstep.interfaces.plant import Reference
from quadstep.metrics.registry import flight_metrics, metric
from quadstep.numbers import Matrix, Number, Vector, vector
from quadstep.studies.paper.cases import HOLD, case_1
from quadstep.vehicle.paper import Rotors, State, Vehicle, thrust_direction

NEURONS = 3
"""Enough for the inequalities, which hold for any number."""

PERIOD = 0.002
"""Sampling period of the controller [s]."""

DIMENSIONS = 201
"""Numbers that define a closed loop."""

Cube: TypeAlias = NDArray[np.float64]
"""Points of the unit cube, shape (DIMENSIONS, closed loops)."""


class LoopBatch(NamedTuple):
    """A batch of closed loops. ideal: W_1 and W_2; residual: eps_1 [N] and eps_2 [N m]; period: of the law [s]."""

    vehicle: Vehicle
    state: State
    reference: Reference
    gains: CompletedGains
    memory: CompletedMemory
    ideal: tuple[Matrix, Matrix]
    residual: tuple[Vector, Vector]
    period: Number = PERIOD


class Draw:
    """Numbers read off the points of a cube, coordinate by coordinate."""

    def __init__(self, cube: Cube) -> None:
        self.cube, self.read = cube, 0

    def number(self, low: float, high: float) -> Number:
        self.read += 1
        return low + (high - low) * cast(Number, self.cube[self.read - 1])

    def error(self, bound: float) -> Number:
        """In [-bound, bound], often near zero."""
        number = self.number(-1.0, 1.0)
        return bound * (number * number * number)

    def vector(self, low: float, high: float, length: int = 3) -> Vector:
        return Vector([self.number(low, high) for _ in range(length)])

    def errors(self, bound: float, length: int = 3) -> Vector:
        return Vector([self.error(bound) for _ in range(length)])

    def gain(self, low: float, high: float) -> Vector:
        """Positive entries between the bounds, often nearly equal."""
        base, apart = self.number(low, high), self.error(1.0)
        return Vector([base + apart * apart * (self.number(low, high) - base) for _ in range(3)])

    def matrix(self, bound: float, rows: int, columns: int) -> Matrix:
        """Entries in [-bound, bound], the whole often near zero."""
        size = self.error(1.0)
        return size * Matrix([self.vector(-bound, bound, columns) for _ in range(rows)])


def draw_sample(seed: int, count: int) -> LoopBatch:
    return sample_at(np.random.default_rng(seed).random((DIMENSIONS, count)))


def sample_at(cube: Cube) -> LoopBatch:
    """The closed loops of a cube's points, far beyond any flight: |theta| to 1.4 rad, all rolls and yaws, unequal inertias,
    gains over decades.
    """
    draw = Draw(cube)
    inertia = draw.gain(0.5, 6.0)
    vehicle = Vehicle(draw.number(0.5, 3.0), inertia, 9.81, Rotors(0.25, 0.05, 0.0, 0.0))
    attitude = Vector((draw.number(-4.0, 4.0), draw.number(-1.4, 1.4), draw.number(-np.pi, np.pi)))
    state = State(draw.vector(-20.0, 20.0), draw.vector(-10.0, 10.0), attitude, draw.errors(3.0))
    slope_1, slope_2 = draw.gain(0.3, 3.0), draw.gain(0.5, 20.0)
    e1, r1, e2, r2, counter = draw.errors(2.0), draw.errors(8.0), draw.errors(3.0), draw.errors(20.0), draw.errors(1.0, 2)
    wanted_rates = state.rates + r2 - slope_2 * e2 - Vector((0.0, *counter))
    reference = Reference(
        state.position + e1,
        state.velocity + r1 - slope_1 * e1,
        Vector((0.0, 0.0, 0.0)),
        attitude[0] + e2[0],
        wanted_rates[0],
        yaw_acceleration=draw.number(-5.0, 5.0),
    )
    ideal = draw.matrix(5.0, NEURONS, 3), draw.matrix(20.0, NEURONS, 3)
    known = draw.number(-0.5, 1.0)
    kappa = draw.number(0.001, 0.1)  # one, as in Eq. 54
    paper = BacksteppingGains(
        mass=vehicle.mass,
        gravity=vehicle.gravity,
        slope_1=slope_1,
        gain_1=draw.gain(0.5, 20.0),
        integral_1=draw.gain(0.0, 2.0),
        slope_2=slope_2,
        gain_2=draw.gain(1.0, 400.0),
        integral_2=draw.gain(0.0, 20.0),
        filter_frequency=draw.number(20.0, 200.0),
        force_net=Net(input_weights(draw, FORCE_INPUTS), draw.number(0.5, 10.0), kappa),
        torque_net=Net(input_weights(draw, TORQUE_INPUTS), draw.number(0.5, 10.0), kappa),
        learning_start=0.0,
        weights_1=known * ideal[0] + draw.matrix(5.0, NEURONS, 3),
        weights_2=known * ideal[1] + draw.matrix(20.0, NEURONS, 3),
    )
    filtered = Filtered(Vector((attitude + e2).entries[1:]), Vector(wanted_rates.entries[1:]))
    before = BacksteppingMemory(draw.errors(3.0), draw.errors(1.0), filtered, paper.weights_1, paper.weights_2)
    pushing = thrust_direction(Vector((0.0, *(filtered.value + draw.errors(1.5, 2)))))  # beside where the filter is
    outer = position_loop(paper, before, state, reference, 1.0)
    lacking = draw.number(1.0, 60.0) * pushing - outer.u_d * thrust_direction(Vector((0.0, *outer.tilt)))
    along, across = draw.error(1.0), draw.error(1.0)
    sample = LoopBatch(
        vehicle=vehicle,
        state=state,
        reference=reference._replace(acceleration=lacking * (1.0 / vehicle.mass)),
        gains=CompletedGains(paper, draw.gain(2.0, 200.0), inertia, Vector((1e9, 1e9)), Vector((1e9, 1e9))),
        memory=CompletedMemory(before, Filtered(counter, draw.errors(5.0, 2))),
        ideal=ideal,
        residual=(along * r1 + across * draw.vector(-1.0, 1.0), along * r2 + across * draw.vector(-1.0, 1.0)),
    )
    assert draw.read == DIMENSIONS, draw.read
    return sample


def input_weights(draw: Draw, inputs: int) -> Matrix:
    """V of a net with its bias, uniform in [-1, 1]."""
    return Matrix([draw.vector(-1.0, 1.0, inputs + 1) for _ in range(NEURONS)])


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
