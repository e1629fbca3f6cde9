"""Many flights of a real vehicle, without noise and turbulence, beside hand-written C."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.airframes import CALM, FLIGHTS, plans
from benchmarks.beside_c import Row, beside_c
from quadstep.flight.engines import FlightPlan
from quadstep.flight.scored import scored
from quadstep.flight.sweep import Sweep, places

SOURCE = Path(__file__).with_name("vehicle_yardstick.c")

VARYING = (
    "parameters.airframe.mass",
    *(f"parameters.wind.mean.{axis}" for axis in range(2)),
    *(f"start.position.{axis}" for axis in range(3)),
)
LOW = (2.4, 4.0, -4.0, -0.3, -0.3, 2.7)
HIGH = (2.9, 10.0, 4.0, 0.3, 0.3, 3.3)


def calm() -> FlightPlan:
    """The flight that all others are like."""
    return plans(CALM, 1)[0]


def drawn(count: int, seed: int = 1) -> NDArray[np.float64]:
    """What varies, one row per flight: mass [kg], wind [m/s], start [m]."""
    return np.random.default_rng(seed).uniform(LOW, HIGH, (count, len(VARYING)))


def sweep(double: bool) -> Sweep:
    """Flights of the whole vehicle, a score every second as in `airframes.rate`."""
    one = calm()
    loop, ticks = scored(one.loop, one.ticks, 1.0)
    return Sweep(loop, ticks, one.start, one.parameters, places(one.start, one.parameters, VARYING), double)


def beside(folder: Path, double: bool) -> Row:
    """A row."""
    return beside_c(folder, "a real vehicle, full controller, no noise", SOURCE, calm(), sweep, drawn(FLIGHTS), double, "-")


def vehicle_in_single(folder: Path) -> Row:
    """In f32."""
    return beside(folder, False)


def vehicle_in_double(folder: Path) -> Row:
    """In f64."""
    return beside(folder, True)
