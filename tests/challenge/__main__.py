"""`python -m tests.challenge [--seconds S] [--seed N] [--only NAME]... [--processes N]`."""

import argparse
import os
import sys
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does; before NumPy is loaded

from tests.challenge.search import LOOSE, challenge, searches


def main() -> int:
    """Exit code 1 where a verdict was contradicted or a search failed."""
    known = searches()
    parser = argparse.ArgumentParser(prog="python -m tests.challenge", description=__doc__)
    parser.add_argument("--seconds", type=float, default=300.0, help="for all searches together")
    parser.add_argument("--seed", type=int, default=20261124)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--only", action="append", choices=sorted(known), help="this search; may be repeated")
    asked = parser.parse_args()
    print(f"seed {asked.seed}, {asked.seconds:g} s on {asked.processes} processes", flush=True)
    print(f"{'search':34}{'tried':>8}{'nearest':>10}{'s':>7}", flush=True)
    began, failed = time.perf_counter(), []
    for outcome in challenge(asked.only or list(known), asked.seed, asked.seconds, asked.processes):
        nearest = "-" if outcome.nearest is None else f"{100 * outcome.nearest.reached:.4g} %"
        loose = known[outcome.name].bound and outcome.nearest is not None and outcome.nearest.reached < LOOSE
        note = "  CONTRADICTED" if outcome.failed else "  loose: nobody came near" if loose else ""
        print(f"{outcome.name:34}{outcome.tried:8,}{nearest:>10}{outcome.seconds:7.0f}{note}", flush=True)
        if outcome.failed:
            failed.append(outcome)
    for outcome in failed:
        print(f"\n{outcome.name}: {known[outcome.name].verdict}")
        print(outcome.error or (f"contradicted by {outcome.nearest.case}" if outcome.nearest else "it tried nothing"))
        print(f"again: python -m tests.challenge --only {outcome.name} --seed {asked.seed} --seconds {asked.seconds:g}")
    print(f"{len(failed)} verdicts contradicted in {time.perf_counter() - began:.0f} s")
    return int(bool(failed))


if __name__ == "__main__":
    sys.exit(main())
