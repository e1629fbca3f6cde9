"""Many flights of a real vehicle beside hand-written C: with turbulence and noise, and without."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.airframes import CALM, FLIGHTS, FULL, plans
from benchmarks.beside_c import Row, beside_c
from quadstep.engines.fly import FlightPlan
from quadstep.engines.scored import scored
from quadstep.engines.sweep import Sweep, places
from quadstep.numbers.noise import key

VARYING = (
    "parameters.airframe.mass",
    *(f"parameters.wind.mean.{axis}" for axis in range(2)),
    *(f"start.position.{axis}" for axis in range(3)),
)
LOW = (2.4, 4.0, -4.0, -0.2, -0.2, 2.8)
HIGH = (2.9, 10.0, 4.0, 0.2, 0.2, 3.2)
"""Starts 0.3 m off made one flight in 500 tumble, which amplified differences of rounding a million times."""

KEYS = tuple(f"parameters.key.words.{place}" for place in range(4))


class Vehicles(NamedTuple):
    """Flights that differ in mass [kg], wind [m/s], start [m], and in their noise if they have any. source: the C."""

    name: str
    content: dict[str, Any]
    source: Path

    def plan(self) -> FlightPlan:
        """The flight that all others are like."""
        return plans(self.content, 1)[0]

    def drawn(self, count: int, seed: int = 1) -> NDArray[np.float64]:
        """What varies, one row per flight."""
        numbers = np.random.default_rng(seed).uniform(LOW, HIGH, (count, len(VARYING)))
        return np.column_stack([numbers, [list(key(seed, flight).words) for flight in range(count)]])

    def sweep(self, double: bool, seconds: float = 10.0, period: float = 1.0) -> Sweep:
        """Flights of the whole vehicle with a score every `period` [s], as in `airframes.rate`."""
        one = self.plan()
        loop, ticks = scored(one.loop, one.ticks._replace(last=round(seconds / one.ticks.step)), period)
        return Sweep(loop, ticks, one.start, one.parameters, places(one.start, one.parameters, (*VARYING, *KEYS)), double)

    def beside(self, folder: Path, double: bool) -> Row:
        """A row."""
        return beside_c(folder, self.name, self.source, self.plan(), self.sweep, self.drawn(FLIGHTS), double, "-")


HOME = Path(__file__).parent
NOISY = Vehicles("a real vehicle, full controller", FULL, HOME / "noisy_vehicle_yardstick.c")
QUIET = Vehicles("the same without noise and turbulence", CALM, HOME / "vehicle_yardstick.c")


def noisy_in_single(folder: Path) -> Row:
    """Everything, in f32."""
    return NOISY.beside(folder, False)


def noisy_in_double(folder: Path) -> Row:
    """Everything, in f64."""
    return NOISY.beside(folder, True)


def quiet_in_single(folder: Path) -> Row:
    """Without noise and turbulence, in f32."""
    return QUIET.beside(folder, False)


def quiet_in_double(folder: Path) -> Row:
    """Without noise and turbulence, in f64."""
    return QUIET.beside(folder, True)
