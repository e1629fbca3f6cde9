"""The hand-written C of the benchmarks flies the engine's flights, also where it takes a branch that is rarely needed."""

from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks import many_flights
from benchmarks.airframes import CALM, plans
from benchmarks.beside_c import summary
from benchmarks.vehicles import NOISY, QUIET, Vehicles
from benchmarks.yardstick import PAPER, Yardstick
from quadstep.engines.fly import FlightPlan
from quadstep.engines.kernel import fly_lanes
from quadstep.engines.scored import scored
from quadstep.engines.sweep import Sweep, places
from quadstep.numbers import flatten, leaf_names, rebuild
from tests.needs import C_COMPILER, needs
from tests.quick_gains import QUICK

pytestmark = needs(C_COMPILER)

FLIGHTS, SECONDS, SAMPLE = 32, 2.0, 0.02

HARD: dict[str, Any] = {
    **CALM,
    "controller": {**CALM["controller"], **QUICK["rotation-backstepping"], "nets": {"F1": 6.5, "F2": 36.0}},
    "wind": {"mean": [6.0, 2.0, 0.5], "swing": [1.0, 0.5, 0.2], "swing_frequency": 4.0,
        "gust": {"velocity": [3.0, -1.0, 0.5], "start": 0.2, "length": 0.6}},
    "start": {"position": [0.5, -0.4, 2.5], "attitude": [1.0, 0.3, 1.9], "rates": [3.0, -2.0, 1.0]},
    "limits": {"distance": 7.0, "rate": 100.0},
}  # fmt: skip
"""A start on its side and turning, and a quick loop: rotors at their limits, large turns, and some flights are lost. With the
defaults, which are slow for the delay, all would drift too far.
"""

LOOSE: dict[str, tuple[float, float]] = {
    "parameters.airframe.mass": (2.4, 2.9),
    "start.rates.0": (-6.0, 6.0),
    "start.rates.1": (-6.0, 6.0),
    "parameters.airframe.drag.flapping": (0.0, 1e-3),
    "parameters.airframe.drag.translational_lift": (0.0, 1e-2),
    "parameters.airframe.rotor.fall": (0.03, 0.06),
    "parameters.gains.weight_bounds.0": (0.1, 3.0),
    "parameters.gains.weight_bounds.1": (0.1, 3.0),
    "parameters.gains.integral_bounds.0": (0.05, 0.5),
    "parameters.gains.integral_bounds.1": (0.05, 0.5),
    "parameters.path.ramp": (-1.0, 2.0),
}


Case = tuple[Path, FlightPlan, Sweep, np.ndarray]


def paper(double: bool) -> Case:
    """Of the paper's loop."""
    one = many_flights.plan()
    return PAPER, one, shortened(one, many_flights.VARYING, double), many_flights.drawn(FLIGHTS)


def hard(double: bool) -> Case:
    """Of a real vehicle in trouble."""
    one, (low, high) = plans(HARD, 1)[0], np.array(list(LOOSE.values())).T
    values = np.random.default_rng(3).uniform(low, high, (FLIGHTS, len(LOOSE)))
    return QUIET.source, one, shortened(one, tuple(LOOSE), double), values


def real(vehicles: Vehicles, double: bool) -> Case:
    """Of the benchmark's vehicles."""
    return vehicles.source, vehicles.plan(), vehicles.sweep(double, SECONDS, SAMPLE), vehicles.drawn(FLIGHTS)


CASES = {"paper": paper, "hard": hard, "quiet": partial(real, QUIET), "noisy": partial(real, NOISY)}


def shortened(one: FlightPlan, varying: tuple[str, ...], double: bool) -> Sweep:
    """A sweep of flights like this one."""
    loop, ticks = scored(one.loop, one.ticks._replace(last=round(SECONDS / one.ticks.step)), SAMPLE)
    return Sweep(loop, ticks, one.start, one.parameters, places(one.start, one.parameters, varying), double)


USUAL = (True, False), (False, True)
"""Ways that an ordinary run takes in turn: f64 as written, f32 with fused products."""


@pytest.mark.parametrize(
    ("case", "double", "fused"),
    [
        pytest.param(case, *way, marks=() if way == USUAL[place % 2] else pytest.mark.thorough)
        for place, case in enumerate(CASES)
        for way in product((True, False), repeat=2)
    ],
)
def test_the_c_flies_the_same_flights(case: str, double: bool, fused: bool, tmp_path: Path) -> None:
    source, one, sweep, values = CASES[case](double)
    swept = sweep.fly(values)
    lost = np.count_nonzero(swept.outcome)
    assert 0 < lost < FLIGHTS if case == "hard" else lost == 0
    by_hand = Yardstick(source, sweep, one.start, one.parameters, values, tmp_path, fused).fly()
    assert np.allclose(by_hand.scores, summary(swept), rtol=1e-12 if double else 2e-4, atol=0.0)


@pytest.mark.parametrize("case", ["quiet", "noisy"])
def test_the_c_reaches_the_same_state_and_has_learned_the_same(case: str, tmp_path: Path) -> None:
    source, one, sweep, values = CASES[case](True)
    by_hand = Yardstick(source, sweep, one.start, one.parameters, values, tmp_path, fused=False).fly()
    starts, parameters = [], []
    for row in values:
        leaves = flatten((one.start, one.parameters))
        for place, value in zip(sweep.varying, row.tolist(), strict=True):
            leaves[place] = value
        start, numbers = rebuild((one.start, one.parameters), iter(leaves))
        starts.append(start)
        parameters.append(numbers)
    finals = [log.final for log in fly_lanes(one.loop, parameters, starts, one.ticks._replace(last=sweep.ticks.last))]
    names = leaf_names(finals[0], "cycle")
    kept = [i for i, name in enumerate(names) if name.startswith(("cycle.state", "cycle.memory.w", "cycle.memory.i"))]
    assert len(kept) > 80
    assert np.allclose(
        by_hand.cycles[:, kept], np.array([flatten(final) for final in finals])[:, kept], rtol=1e-11, atol=1e-12
    )
