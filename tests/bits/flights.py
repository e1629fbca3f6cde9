"""What is flown on one processor after the other; `python -m tests.bits.flights` prints what the bits of each come to (with 0
or 1 behind it, of each campaign in one precision).

Case 1 with its log and campaigns of the paper's vehicle, of a real one in turbulence and of one that flies on its Kalman
filter, each in f64 and f32, whose draws are correlated, cut off, log-normal and Sobol; and every function of a number.
"""

import hashlib
import json
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np

from quadstep.engines.kernel import fly_lanes
from quadstep.metrics.registry import flight_metrics
from quadstep.numbers import atan2, cos, exp, log, sigmoid, sin, sqrt
from quadstep.studies.campaign.flyer import Flyer
from quadstep.studies.campaign.schema import read_campaign
from tests.campaigns import NOISY, SHORT, written
from tests.flights import CASE_1, parameters, state, through_lanes
from tests.sweeps import TICKS

ESTIMATED = NOISY + "accelerometer_noise = 0.02\nestimator = true\n"
PAPER = """
"vehicle.mass" = { type = "normal", mean = 1.0, deviation = 0.1, low = 0.7, high = 1.3 }
"disturbance.scale" = { type = "log-normal", median = 0.5, sigma = 0.5 }
"start.position.2" = { type = "sobol", low = -0.001, high = 0.001 }
[[correlated]]
keys = ["start.position.0", "start.position.1"]
mean = [0.0, 0.001]
covariance = [[1e-6, 4e-7], [4e-7, 1e-6]]
"""
REAL = '"wind.mean.0" = { type = "normal", mean = 3.0, deviation = 1.0 }'
CAMPAIGNS = {"paper": (SHORT, PAPER), "turbulence": (NOISY, REAL), "filter": (ESTIMATED, REAL)}
FLIGHTS = 40

SPECIAL = [0.0, -0.0, 1.0, -1.0, 5e-324, 2.2e-308, 1e-300, 709.0, -708.0, 1e6, 1.7e6, 1e22, 1.7e308, -np.inf, np.inf, np.nan]
FUNCTIONS = {"sin": sin, "cos": cos, "exp": exp, "log": log, "sqrt": sqrt, "sigmoid": sigmoid}


def inputs(count, double=True):
    """Random bits, and numbers as flights have them."""
    random = np.random.default_rng(7)
    kind, whole = (np.float64, np.uint64) if double else (np.float32, np.uint32)
    bits = random.integers(0, np.iinfo(whole).max, count, dtype=whole).view(kind)
    usual = np.ldexp(random.normal(size=count), random.integers(-20, 20, count)).astype(kind)
    with np.errstate(over="ignore"):
        return np.concatenate([bits, usual, np.array(SPECIAL).astype(kind)])


def functions(x, y):
    """All functions of a number, of x; and the angle of (x, y)."""
    return [*(function(x) for function in FUNCTIONS.values()), atan2(y, x)]


def same(values):
    """The bits, with one NaN for all: which of them an operation gives is up to the processor."""
    array = np.array(values)
    array[np.isnan(array)] = np.nan
    return array.tobytes()


def results(turn=None):
    """Name and bytes of each; of a campaign in one precision only where its turn is given, which changes with the campaign."""
    warnings.simplefilter("ignore")
    for double in (True, False):
        kind = "f64" if double else "f32"
        x = inputs(4096, double)
        yield f"functions {kind}", same(through_lanes(functions, x, x[::-1].copy(), double=double))
        flown = fly_lanes(CASE_1, [parameters()], [state()], TICKS, double=double)[0]
        yield f"case 1 {kind}", flown.rows.tobytes() + json.dumps(flight_metrics(flown)).encode()
        for place, (name, (mission, vary)) in enumerate(CAMPAIGNS.items()):
            if turn is not None and (place + turn + double) % 2:
                continue
            with tempfile.TemporaryDirectory() as folder:
                file = written(Path(folder), vary, mission, f'precision = "{kind}"')
                table = Flyer(read_campaign(file)).fly(0, FLIGHTS)
            yield f"{name} {kind}", json.dumps(table.to_pydict()).encode()


if __name__ == "__main__":
    print(json.dumps({name: hashlib.sha256(content).hexdigest() for name, content in results(*map(int, sys.argv[1:]))}))  # noqa: T201
