"""Real flights: a vehicle identified from five of them, and how well it predicts and flies three others."""

import math

import pytest

from quadstep.identify.fit import identify
from quadstep.identify.flown_setpoints import fly_again
from quadstep.identify.logs.read import read_log
from quadstep.identify.replay import compare
from quadstep.identify.starts import GROUPS, HORIZONS
from quadstep.identify.vehicle_file import identified_vehicle
from tests.made_flights import start
from tests.needs import FLIGHTS, NANOBENCH, needs

HELD = ("B5_helix_fast_mell_rep1", "B6_linear_ramp_rep3", "B7_oval_fast_rep2")

MOST = {
    "position": (math.inf, 0.30, 0.40), "velocity": (0.45, 0.25, 0.55), "attitude": (1.02, 0.90, 0.75),
    "rates": (0.90, 0.75, 0.75),
}  # fmt: skip
"""Of the mean error over that of constant velocity and rates, 1, 10 and 50 samples ahead."""


@pytest.fixture(scope="module")
def found():
    flights = [read_log(path) for path in sorted(NANOBENCH.glob("*.csv")) if path.stem not in HELD]
    return identify(flights, start(), lambda _: None, still=True)


@pytest.fixture(scope="module")
def held():
    return [read_log(NANOBENCH / f"{name}.csv") for name in HELD]


@needs(FLIGHTS)
def test_flights_that_were_not_fitted_are_predicted(found, held):
    errors = compare(held, start(), found.numbers._replace(observer=found.guided), guided=True)
    for group in GROUPS:
        for horizon, most in zip(HORIZONS, MOST[group], strict=True):
            error, constant, zero = errors.means(horizon, group)
            assert error / constant < most, (group, horizon)
    assert error / zero < 0.95


@needs(FLIGHTS)
def test_flights_that_were_not_fitted_are_followed_as_the_real_vehicle_did(found, held):
    flown = fly_again(held, identified_vehicle(start(), found, "", ""), {"type": "pid"})
    assert all(0.5 < one.simulated.rmse / one.real.rmse < 2.0 for one in flown)
    assert sum(abs(one.simulated.lag - one.real.lag) < 0.085 for one in flown) >= 2
    # The lag is not determined and stays as in --vehicle, too slow for the position loop: the third rings (docs/logs.md).
    assert sum(abs(one.simulated.tilt - one.real.tilt) < math.radians(4.0) for one in flown) >= 2
