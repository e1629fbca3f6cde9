"""How much a controller tolerates, compared with flights whose limits are known."""

import json
import math

import numpy as np
import pytest

from quadstep.metrics.statistics import Estimate
from quadstep.studies.comparison import robustness
from quadstep.studies.comparison.cells import FIRST
from quadstep.studies.comparison.robustness import (
    as_json,
    by_steps,
    find,
    flight_by_flight,
    from_json,
    raised,
    tolerance,
    tried,
)
from quadstep.studies.comparison.schema import MarginEntry
from quadstep.studies.comparison.tables import range_text
from tests.studies import SMALL, study

VEHICLE = "research-2.6kg"


def entry(**more):
    return MarginEntry(keys=("wind.mean.0",), path="up", scenario="calm", low=0.0, high=16.0, **more)


class Known:
    """Flights that fail from a value of their own on."""

    def __init__(self, entry, limits):
        self.entry, self.limits, self.flown, self.first = entry, np.asarray(limits), 0, []

    def failed(self, values, first):
        self.flown += len(values)
        self.first.append(first)
        return values >= self.limits


def test_each_flight_is_bisected_by_itself():
    limits = np.linspace(2.0, 12.0, 200)
    half, few = flight_by_flight(Known(entry(flights=200), limits))
    fine = 16.0 / 2**robustness.HALVINGS
    assert half.value == pytest.approx(np.median(limits), abs=fine + 0.05)
    assert few.value == pytest.approx(np.quantile(limits, 0.05), abs=fine + 0.05)
    assert half.low < half.value < half.high
    assert few.low < few.value < few.high
    assert half.low > few.high


def test_what_never_fails_and_what_always_does_is_said_so():
    half, few = flight_by_flight(Known(entry(flights=100), np.r_[np.full(60, 99.0), np.full(40, 5.0)]))
    assert half.value == math.inf
    assert few.value == pytest.approx(5.0, abs=16.0 / 2**robustness.HALVINGS)
    half, few = flight_by_flight(Known(entry(flights=100), np.full(100, -1.0)))
    assert (half.value, few.value) == (0.0, 0.0)


def test_multiples_of_a_step_are_bisected_by_the_share_that_fails():
    proving = Known(entry(flights=100, step=1.0), np.linspace(3.5, 9.5, 100))
    half, few = by_steps(proving)
    assert (half.value, few.value) == (7.0, 4.0)  # at 6 49 fail; at 4 9
    assert half.low <= half.value <= half.high
    assert proving.flown <= 10 * 100
    half, few = by_steps(Known(entry(flights=100, step=1.0), np.full(100, 99.0)))
    assert (half.value, few.value) == (math.inf, math.inf)


@pytest.mark.parametrize(("point", "flights"), [(0.5, 40), (0.05, 40), (0.05, 200)])
def test_the_tolerance_holds_the_numbers_that_the_point_explains(point, flights):
    low, high = tolerance(point, flights)
    assert low < point * flights <= high
    assert low >= -1


def test_a_point_is_tried_on_other_flights():
    proving = Known(entry(flights=50), np.r_[np.full(10, 3.0), np.full(40, 9.0)])
    assert tried(proving, 5.0).value == pytest.approx(0.2)
    assert proving.first == [FIRST + robustness.AGAIN]
    assert tried(proving, math.inf) is None


def test_infinity_survives_json():
    found = robustness.Margin(Estimate(math.inf, 3.0, math.inf), Estimate(2.0, 1.0, 3.0), None, 10)
    assert from_json(as_json(found)) == found


def test_an_end_that_few_flights_leave_open_survives_json_and_is_no_number():
    found = robustness.Margin(Estimate(2.0, math.nan, math.inf), Estimate(2.0, 1.0, 3.0), None, 10)
    again = from_json(json.loads(json.dumps(as_json(found), allow_nan=False)))
    assert [range_text(one, 0.0, 16.0) for one in again.half] == ["2", "-", "> 16"]


def test_wind_is_raised_until_a_soft_controller_is_lost_before_a_firm_one():
    text = SMALL + (
        '[margins.wind]\nkeys = ["wind.mean.0", "wind.turbulence.wind_20"]\npath = "up"\nscenario = "windy"\nhigh = 60.0\n'
        "low = 1.0\nflights = 20\nerror = 0.6\n"
    )
    one, found = study(text), {}
    for name in ("soft", "firm"):
        found[name] = find(raised(one, VEHICLE, "wind", name, one.knowing(VEHICLE, one.file.controllers[name].controller)))
    assert 1.0 < found["soft"].half.value < found["firm"].half.value < 60.0
    assert found["firm"].few.value <= found["firm"].half.value
    assert found["firm"].checked.low <= 0.5 <= found["firm"].checked.high


def test_a_latency_is_raised_in_whole_steps():
    text = SMALL + (
        '[margins.delay]\nkeys = ["sensors.latency"]\npath = "up"\nscenario = "calm"\nhigh = 0.2\nstep = 0.04\nflights = 20\n'
        "error = 0.8\n"
    )
    one = study(text)
    found = find(raised(one, VEHICLE, "delay", "firm", one.knowing(VEHICLE, {"type": "geometric"})))
    assert any(found.half.value == pytest.approx(0.04 * place) for place in range(1, 6)) or found.half.value == math.inf
    assert found.few.value <= found.half.value
