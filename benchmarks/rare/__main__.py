"""Prints how often the intervals of `quadstep campaign --rare` hold the truth, and how many flights they save.

    python -m benchmarks.rare                 # the table of what is kept in measured/
    python -m benchmarks.rare fly [CASE ...]  # flies on: crude flights of the cases that need them, fifty estimates of each

What has been flown is kept; of what is missing each case gets some in turn.
"""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from quadstep.analysis.statistics import Estimate, share
from quadstep.atomic import write_beside
from quadstep.campaign.flown import SUCCESS, Flyer
from quadstep.campaign.schema import Campaign, read_campaign
from quadstep.rare.flights import Flights
from quadstep.rare.pieces import fly_piece, pieces
from quadstep.rare.summary import summarise

KNOWN = {"plane": 1e-9, "sides": 1e-5, "corner": 1e-6, "shell": 1e-5, "edge": 1e-6}
"""Cases whose probability of failure is known, with it."""

FLOWN = ("tracking", "spin", "either", "choices", "gusts")
"""Cases whose probability of failure is measured by crude flights."""

CRUDE, PORTION, REPETITIONS = 10_000_000, 50_000, 50

HERE = Path(__file__).parent


def kept(what: str, case: str) -> Path:
    """Where measurements of a case are."""
    return HERE / "measured" / f"{case}-{what}.json"


def read(path: Path) -> Any:
    """What is there, or nothing."""
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else None


def campaign_of(case: str, seed: int = 1) -> Campaign:
    """A case, with other random numbers."""
    campaign = read_campaign(HERE / "cases" / f"{case}.toml")
    return campaign._replace(file=campaign.file.model_copy(update={"seed": seed}))


def crude(case: str) -> bool:
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


def estimate(case: str) -> bool:
    """Estimate once more; whether an estimate was missing."""
    path = kept("estimates", case)
    found = read(path) or []
    if len(found) >= REPETITIONS:
        return False
    flights = Flights(campaign_of(case, seed=len(found) + 1))
    summary = summarise([fly_piece(flights, piece, lambda _: None) for piece in pieces(flights.campaign)])
    one = {"probability": list(summary.probability), "flights": summary.flights, "warnings": list(summary.warnings)}
    write_beside(path, json.dumps([*found, one]) + "\n", parents=True)
    return True


def truth(case: str) -> Estimate | None:
    """The probability of failure, with the exact interval where it was measured."""
    if case in KNOWN:
        return Estimate(KNOWN[case], KNOWN[case], KNOWN[case])
    found = read(kept("crude", case))
    return share(found["failures"], found["flights"]) if found else None


def row(case: str) -> str:
    """A line of the table."""
    found, true = read(kept("estimates", case)) or [], truth(case)
    if not found or true is None:
        return f"{case:>9}  not flown"
    values, lows, highs = np.array([one["probability"] for one in found]).T
    holds = float(((lows <= true.value) & (true.value <= highs)).mean())
    flights = float(np.mean([one["flights"] for one in found]))
    spread = float(values.std(ddof=1) / true.value)
    saved = (1.0 - true.value) / true.value / spread**2 / flights
    measured = "exact" if case in KNOWN else f"{true.low:.2e} to {true.high:.2e}"
    warned = sum(bool(one["warnings"]) for one in found)
    return (
        f"{case:>9}  {true.value:8.2e}  {measured:>20}  {values.mean() / true.value:9.3f}  {spread:6.3f}  "
        f"{float(np.median(highs / lows)):9.2f}  {100 * holds:4.0f} %  {warned:2d}/{len(found)}  {flights:7.0f}  {saved:9.3g}"
    )


def main() -> None:
    """Fly or print."""
    named = [name for name in sys.argv[1:] if name != "fly"]
    cases = named or [*KNOWN, *FLOWN]
    while "fly" in sys.argv[1:] and sum(part(case) for part in (crude, estimate) for case in cases):
        print(*(f"{case} {len(read(kept('estimates', case)))}" for case in cases), flush=True)
    print(
        f"{'case':>9}  {'truth':>8}  {'measured within':>20}  {'mean / it':>9}  {'spread':>6}  {'high/low':>9}  {'holds':>6}  "
        f"{'warned':>5}  {'flights':>7}  {'saved':>9}"
    )
    for case in cases:
        print(row(case))


if __name__ == "__main__":
    main()
