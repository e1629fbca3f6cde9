"""How well vehicles are identified.

python -m tests.identified coverage 100: a vehicle whose numbers are known is flown so many times, with noise, lag and
jitter, and identified, beginning with a wrong mass, thrust coefficient and inertia about z; how often each number that would
be true for these lies within its 95 % interval. With a third number the position loop
runs that often [s]: at 0.01, what it does between the rows of a log stays hidden.

python -m tests.identified split LOG... --held LOG...: some flights are fitted, the others predicted.

python -m tests.identified closed: the NanoBench flights, flown in closed loop; the tables of docs/logs.md.
"""

import argparse
import math
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np

from quadstep.identify.fit import identify
from quadstep.identify.flown_setpoints import FlightComparison, fly_again
from quadstep.identify.logs.flight import FlightRecord
from quadstep.identify.logs.read import read_log
from quadstep.identify.replay import compare
from quadstep.identify.starts import GROUPS, HORIZONS
from quadstep.identify.vehicle_file import identified_vehicle
from quadstep.io.documents import read_toml
from quadstep.metrics.statistics import share
from tests.made_flights import logged, start, true_value, wrong_start
from tests.needs import NANOBENCH

FIRST_SEED = 1000


def trial(guidance: float, seed: int) -> dict[str, tuple[float, float, bool]]:
    """Of each number: its error and half its interval, both over the true one, and whether that lies inside."""
    found = identify(logged(seed, guidance), wrong_start(), lambda _: None, predictors=False, still=True)
    rows = {}
    for key, one in found.fitted.items():
        true = true_value(key, wrong_start())
        rows[key] = (one.value - true) / abs(true), 0.5 * (one.high - one.low) / abs(true), one.low <= true <= one.high
    return rows


def coverage(count: int, guidance: float) -> None:
    """Print how often the true numbers lie inside; after Ctrl-C, of the trials until then."""
    found: list[dict[str, tuple[float, float, bool]]] = []
    with ProcessPoolExecutor(2) as pool:
        try:
            for rows in pool.map(partial(trial, guidance), range(FIRST_SEED, FIRST_SEED + count)):
                found.append(rows)
                print(f"\r{len(found)} of {count}", end="", file=sys.stderr, flush=True)
        except KeyboardInterrupt:
            pool.shutdown(wait=False, cancel_futures=True)
    if len(found) < 2:
        return
    print(f"\n{len(found)} trials {'number':15}{'mean error':>12}{'scatter':>10}{'interval':>10}{'inside':>8}   95 % sure")
    for key in found[0]:
        errors, halves, inside = (np.array([rows[key][i] for rows in found if key in rows]) for i in range(3))
        held = share(int(inside.sum()), len(inside))
        numbers = f"{100 * errors.mean():+11.2f}%{100 * errors.std(ddof=1):9.2f}%{100 * np.median(halves):9.2f}%"
        print(f"{key:26}{numbers}{100 * held.value:7.0f}%   {100 * held.low:.0f} to {100 * held.high:.0f} %")
    every = [inside for rows in found for _, _, inside in rows.values()]
    print(f"all numbers together: {100 * np.mean(every):.1f} % inside")


def split(fitted: list[Path], held: list[Path]) -> None:
    """Print ratios to "constant" of flights that were not fitted: the flights' mean ratio / the ratio of their mean errors."""
    flights, unseen = ([read_log(path) for path in paths] for paths in (fitted, held))
    vehicle = start()
    found = identify(flights, vehicle, lambda what: print(f"fitting: {what}", file=sys.stderr), still=True)
    knowing = {"commands": found.numbers}
    if found.guided:
        knowing["setpoints too"] = found.numbers._replace(observer=found.guided)
    for knows, numbers in knowing.items():
        errors = compare(unseen, vehicle, numbers, guided=knows != "commands")
        print(f"\n{knows + ', samples':26}" + "".join(f"{group:>15}" for group in GROUPS) + f"{'rates to zero rate':>20}")
        for horizon in HORIZONS:
            pairs = [(errors.ratio(horizon, group).value, *errors.means(horizon, group)) for group in GROUPS]
            ratios = "".join(f"{ratio:8.2f} /{error / base:5.2f}" for ratio, error, base, _ in pairs)
            error, _, zero = errors.means(horizon, "rates")
            print(f"{horizon:<26}{ratios}{errors.ratio(horizon, 'rates', 'zero').value:13.2f} /{error / zero:5.2f}")


WAYS = (
    (("B2_circle_fast", "B2_circle_slow", "B3"), ("B5", "B6", "B7"), ("B8_star_fast", "B8_star_slow")),
    (("B2_circle_fast", "B6", "B8_star_fast"), ("B2_circle_slow", "B5", "B8_star_slow"), ("B3", "B7")),
)
"""Two ways of holding out two or three of the eight, by the beginnings of their names."""


def row(one: FlightComparison) -> str:
    """How far one simulated flight is from the real one."""
    real, made = one.real, one.simulated
    parts = f"RMSE {made.rmse / real.rmse:5.2f}  lag {made.lag - real.lag:+6.2f} s"
    return f"  {one.name:24} {parts}  tilt {math.degrees(made.tilt - real.tilt):+6.1f} deg  rates {made.rate / real.rate:5.2f}"


def right(flown: list[FlightComparison]) -> str:
    """On how many the RMSE is within a factor of 2, the lag within 85 ms, the tilt within 4 degrees."""
    rmse = sum(0.5 < one.simulated.rmse / one.real.rmse < 2.0 for one in flown)
    lag = sum(abs(one.simulated.lag - one.real.lag) < 0.085 for one in flown)
    tilt = sum(abs(one.simulated.tilt - one.real.tilt) < math.radians(4.0) for one in flown)
    return f"RMSE right on {rmse}, lag on {lag}, tilt on {tilt} of {len(flown)}"


def flown_by(fitted: list[FlightRecord], flights: list[FlightRecord], controller: dict[str, object]) -> list[FlightComparison]:
    """Flights by the vehicle that others identify."""
    return fly_again(
        flights, identified_vehicle(start(), identify(fitted, start(), lambda _: None, still=True), "", ""), controller
    )


def closed() -> None:
    """Print how the eight NanoBench flights are flown by a vehicle identified from them, and by those of the other flights."""
    flights = [read_log(path) for path in sorted(NANOBENCH.glob("*.csv"))]
    found = identified_vehicle(start(), identify(flights, start(), lambda _: None, still=True), "", "")
    own: dict[str, object] = read_toml(Path("examples/crazyflie_pid.toml"))["controller"]
    for name, controller in (("pid", {"type": "pid"}), ("examples/crazyflie_pid.toml", own)):
        flown = fly_again(flights, found, controller)
        print(f"all eight identified, --controller {name}: {right(flown)}", *map(row, flown), sep="\n", flush=True)
    for way in WAYS:
        flown = []
        for held in way:
            rest = [one for one in flights if not one.name.startswith(held)]
            flown += flown_by(rest, [one for one in flights if one.name.startswith(held)], {"type": "pid"})
        print(f"held out {way}: {right(flown)}", *map(row, flown), sep="\n", flush=True)


def main() -> None:
    """Read the command line."""
    reader = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = reader.add_subparsers(dest="command", required=True)
    one = commands.add_parser("coverage")
    one.add_argument("count", type=int)
    one.add_argument("guidance", type=float, nargs="?", default=0.002)
    other = commands.add_parser("split")
    other.add_argument("logs", type=Path, nargs="+")
    other.add_argument("--held", type=Path, nargs="+", required=True)
    commands.add_parser("closed")
    given = reader.parse_args()
    if given.command == "coverage":
        coverage(given.count, given.guidance)
    elif given.command == "split":
        split(given.logs, given.held)
    else:
        closed()


if __name__ == "__main__":
    main()
