"""A flight followed by a vehicle's laws, and a small network for what they do not explain, trained on the residuals.

Its hidden layer is drawn at random and stays fixed (Huang, Zhu and Siew 2006), so training is one regression: equal weights in
every run. The strength of its regularisation is chosen by leaving out one flight after the other.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from quadstep.identify.averages import followed as turned
from quadstep.identify.averages import matrices, rotor_speeds
from quadstep.identify.logs.flight import FlightRecord, Floats
from quadstep.identify.prediction import PredictorParameters
from quadstep.identify.replay import predictions
from quadstep.identify.starts import HORIZONS, States, logged, usable, voltage_of
from quadstep.mission.airframe import AirframeSection
from quadstep.numbers import Vector, matrix
from quadstep.vehicle.airframe_plant import INPUTS, Residual

LONGEST = 20.0
"""Longest stretch that is followed [s]."""


class Followed(NamedTuple):
    """Rows of a flight, one after the other. time (n,) [s]: of the flight. measured, predicted: states a horizon after each
    row, by horizon.
    """

    name: str
    period: float
    time: Floats
    measured: dict[int, States]
    predicted: dict[int, States]


def followed(flight: FlightRecord, vehicle: AirframeSection, p: PredictorParameters, guided: bool = False) -> Followed | None:
    """The longest stretch of a flight that can be predicted from each row, at most `LONGEST`; None where it is under 3 s."""
    rows = usable(flight, HORIZONS)
    pieces = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
    chosen = max(pieces, key=len)[: round(LONGEST / flight.period)]
    if len(chosen) * flight.period < 3.0:
        return None
    starts, states, _ = predictions([flight], vehicle, p, [chosen], guided=guided)
    return Followed(
        flight.name,
        flight.period,
        flight.time[chosen] - flight.time[0],
        {horizon: logged([flight], starts, horizon) for horizon in HORIZONS},
        dict(zip(HORIZONS, states, strict=True)),
    )


HIDDEN = 12
STRIDE = 5
STRENGTHS = (1e-3, 1e-2, 1e-1, 1.0, 10.0)
"""Candidate ridge penalties, as shares of the number of samples."""


class TrainedResidual(NamedTuple):
    """The network, and the share of the unexplained accelerations' variance left on left-out flights (angular, linear)."""

    net: Residual
    left: Floats


def samples(
    flights: Sequence[FlightRecord], vehicle: AirframeSection, p: PredictorParameters
) -> tuple[Floats, Floats, Floats]:
    """Inputs of the network (n, 7), targets (n, 6), and the flight of each row (n,)."""
    rows = [usable(flight, HORIZONS, STRIDE) for flight in flights]
    starts, _, rest = predictions(flights, vehicle, p, rows)
    wanted = np.concatenate([rest[:, :3] + rest[:, 3:6], rest[:, 6:]], axis=1)
    seen = [inputs(flight, p)[chosen] for flight, chosen in zip(flights, rows, strict=True)]
    return np.concatenate(seen), wanted, starts.flight.astype(np.float64)


def inputs(flight: FlightRecord, p: PredictorParameters) -> Floats:
    """Velocity and rates in body axes, mean rotor speed, of every row, shape (n, 7)."""
    turn = matrices(flight.channel("attitude"))
    body = np.einsum("nij,ni->nj", turn, flight.channel("velocity"))
    commands = turned(flight, float(p.curve.delay), float(p.airframe.rotor.rise))
    speeds = rotor_speeds(commands, voltage_of(flight), p.curve, flight.speeds)
    return np.concatenate([body, flight.channel("rates"), speeds.mean(axis=1, keepdims=True)], axis=1)


def trained(flights: Sequence[FlightRecord], vehicle: AirframeSection, p: PredictorParameters) -> TrainedResidual:
    """The network that does best on flights left out of its training."""
    seen, wanted, flight = samples(flights, vehicle, p)
    middle, spread = seen.mean(axis=0), seen.std(axis=0) + 1e-9
    random = np.random.default_rng(0)
    weights, biases = random.normal(size=(HIDDEN, INPUTS)), random.normal(size=HIDDEN)
    hidden = 1.0 / (1.0 + np.exp(-((seen - middle) / spread @ weights.T + biases)))
    names = np.unique(flight)

    def solved(some: np.ndarray, strength: float) -> tuple[Floats, Floats]:
        centre, aim = hidden[some].mean(axis=0), wanted[some].mean(axis=0)
        inside = hidden[some] - centre
        square = inside.T @ inside / some.sum() + strength * np.eye(HIDDEN) * inside.var()
        found = np.linalg.solve(square, inside.T @ (wanted[some] - aim) / some.sum())
        return found.T, aim - centre @ found

    def left(strength: float) -> Floats:
        rest = np.empty_like(wanted)
        for name in names:
            outputs, offsets = solved(flight != name, strength)
            rest[flight == name] = wanted[flight == name] - hidden[flight == name] @ outputs.T - offsets
        return np.mean(rest**2, axis=0) / np.mean(wanted**2, axis=0)

    tried = [left(strength) for strength in STRENGTHS] if len(names) > 1 else [np.full(6, np.nan)] * len(STRENGTHS)
    best = int(np.argmin([one.mean() for one in tried])) if len(names) > 1 else len(STRENGTHS) - 1
    outputs, offsets = solved(np.ones(len(flight), dtype=bool), STRENGTHS[best])
    scaled = weights / spread
    net = Residual(
        matrix(*(tuple(map(float, row)) for row in scaled)),
        Vector(map(float, biases - scaled @ middle)),
        matrix(*(tuple(map(float, row)) for row in outputs)),
        Vector(map(float, offsets)),
    )
    return TrainedResidual(net, tried[best])
