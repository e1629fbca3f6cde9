"""Prints how often the intervals of `quadstep campaign --rare` hold the truth, and how many flights they save.

    python -m benchmarks.rare                                # the table of what is kept in measured/, for the default method
    python -m benchmarks.rare subset                         # and for the other
    python -m benchmarks.rare fly [subset] [CASE ...]        # flies on: fifty estimates of each case, and crude flights

What has been flown is kept; of what is missing each case gets some in turn.
"""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.rare.starts import Starts
from quadstep.io.files import write_beside
from quadstep.metrics.statistics import Estimate, share
from quadstep.studies.campaign.flyer import SUCCESS, Flyer
from quadstep.studies.campaign.schema import Campaign, Method, RareSection, read_campaign
from quadstep.studies.rare.point_flyer import PointFlyer
from quadstep.studies.rare.replicates import fly_piece, pieces
from quadstep.studies.rare.summary import summarise

KNOWN = {"plane": 1e-9, "sides": 1e-5, "corner": 1e-6, "shell": 1e-5, "edge": 1e-6}
"""Cases whose probability of failure is known, with it."""

FLOWN = ("tracking", "spin", "either", "choices", "gusts")
"""Cases whose probability of failure is measured by crude flights."""

CRUDE, PORTION, REPETITIONS = 80_000_000, 50_000, 50

SEED = 101
"""Of the first estimate. The methods were made with smaller ones."""

REPLICATES = {Method.CROSS_ENTROPY: RareSection().replicates, Method.SUBSET: 10}
"""Replicates of an estimate."""

HERE = Path(__file__).parent


def kept(what: str, case: str) -> Path:
    """Where measurements of a case are."""
    return HERE / "measured" / f"{case}-{what}.json"


def read(path: Path) -> Any:
    """What is there, or nothing."""
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else None


def campaign_of(case: str, seed: int, method: Method = Method.CROSS_ENTROPY) -> Campaign:
    """A case, with other random numbers, by one of the methods."""
    campaign = read_campaign(HERE / "cases" / f"{case}.toml")
    rare = campaign.file.rare.model_copy(update={"method": method, "replicates": REPLICATES[method]})
    return campaign._replace(file=campaign.file.model_copy(update={"seed": seed, "rare": rare}))


def crude(case: str, _: Method) -> bool:
    """Fly some of the crude flights; whether any were missing."""
    path = kept("crude", case)
    found = read(path) or {"flights": 0, "failures": 0}
    first = found["flights"]
    if first >= CRUDE or case in KNOWN:
        return False
    success = Flyer(campaign_of(case, seed=10**6)).fly(first, first + PORTION)[SUCCESS].to_numpy()
    found = {"flights": first + PORTION, "failures": found["failures"] + int((~success).sum())}
    write_beside(path, json.dumps(found) + "\n", parents=True)
    return True


def estimate(case: str, method: Method) -> bool:
    """Estimate once more; whether an estimate was missing."""
    path = kept(method, case)
    found = read(path) or []
    if len(found) >= REPETITIONS:
        return False
    flights = (Starts if case in KNOWN else PointFlyer)(campaign_of(case, SEED + len(found), method))
    done = [fly_piece(flights, piece, lambda _: None) for piece in pieces(flights.campaign)]
    summary = summarise(done)
    one = {
        "probability": list(summary.probability),
        "replicates": list(summary.replicates),
        "flights": summary.flights,
        "warnings": list(summary.warnings),
    }
    write_beside(path, json.dumps([*found, one]) + "\n", parents=True)
    return True


def truth(case: str) -> Estimate | None:
    """The probability of failure, with the exact interval where it was measured."""
    if case in KNOWN:
        return Estimate(KNOWN[case], KNOWN[case], KNOWN[case])
    found = read(kept("crude", case))
    return share(found["failures"], found["flights"]) if found else None


def row(case: str, method: Method) -> str:
    """A line of the table."""
    found, true = read(kept(method, case)) or [], truth(case)
    if not found or true is None:
        return f"{case:>9}  not flown"
    values, lows, highs = np.array([one["probability"] for one in found]).T
    holds, mean = (float(((lows <= one) & (one <= highs)).mean()) for one in (true.value, values.mean()))
    flights = float(np.mean([one["flights"] for one in found]))
    spread = float(values.std(ddof=1) / true.value)
    saved = (1.0 - true.value) / true.value / spread**2 / flights
    measured = "exact" if case in KNOWN else f"{true.low:.2e} to {true.high:.2e}"
    warned = sum(bool(one["warnings"]) for one in found)
    return (
        f"{case:>9}  {true.value:8.2e}  {measured:>20}  {values.mean() / true.value:9.3f}  {spread:6.3f}  "
        f"{float(np.median(highs / lows)):9.2f}  {100 * holds:4.0f} %  {warned:2d}/{len(found)}  {flights:7.0f}  {saved:9.3g}"
        f"  {100 * mean:6.0f} %"
    )


def main() -> None:
    """Fly or print."""
    named = sys.argv[1:]
    method = Method.SUBSET if Method.SUBSET in named else Method.CROSS_ENTROPY
    cases = [name for name in named if name not in ("fly", *Method)] or [*KNOWN, *FLOWN]
    while "fly" in named and sum(part(case, method) for part in (estimate, crude) for case in cases):
        print(*(f"{case} {len(read(kept(method, case)))}" for case in cases), flush=True)
    print(
        f"{'case':>9}  {'truth':>8}  {'measured within':>20}  {'mean / it':>9}  {'spread':>6}  {'high/low':>9}  {'holds':>6}  "
        f"{'warned':>5}  {'flights':>7}  {'saved':>9}  {'hold mean':>8}"
    )
    for case in cases:
        print(row(case, method))


if __name__ == "__main__":
    main()
