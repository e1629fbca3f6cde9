"""Pictures of a comparison: marks for a few controllers, a square each for many."""

import math

import pytest

from quadstep.analysis.statistics import Estimate
from quadstep.comparison.found import Comparison, Result
from quadstep.comparison.heat import said
from quadstep.comparison.picture import MANY, draw_vehicle
from quadstep.comparison.ranking import Ranked
from quadstep.comparison.spread import Effort, Spread
from quadstep.comparison.study import Situation
from quadstep.report.sheet import SCREEN, USUAL, sheet

WHERE = Situation("crazyflie", "hover", "calm")


def result(name, median, lost=0.0):
    estimate = Estimate(median, math.nan, math.nan)
    return Result(WHERE, name, 500, Estimate(lost, 0.0, 1.0), {"e": Spread(median, estimate, estimate)}, Effort(0.0, 0.0, 0.0))


def comparison(count):
    results = tuple(result(f"law {i}", 0.01 * (i + 1) if i < count - 1 else math.inf, lost=i / count) for i in range(count))
    ranked = Ranked({one.controller: float(i) for i, one in enumerate(results)}, 0.0, ())
    return Comparison("x", "x.toml", 500, 1, {"e": "e[m]"}, (WHERE,), results, {WHERE: ranked}, (), {}, {}, {}, ())


@pytest.mark.parametrize("count", [2, MANY + 1])
def test_any_number_of_controllers_can_be_drawn(tmp_path, count):
    draw_vehicle(tmp_path / "one", comparison(count), "crazyflie", sheet(USUAL, None, SCREEN))
    assert (tmp_path / "one.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("median", "lost", "words"),
    [(0.0123, 0.0, "1.23"), (0.0123, 0.044, "1.23\n4.4 % lost"), (0.5, 0.999, "50\n99.9 % lost"), (math.inf, 1.0, "lost")],
)
def test_a_square_says_the_median_and_what_is_lost(median, lost, words):
    assert said(result("law", median, lost), "e", 100.0) == words
