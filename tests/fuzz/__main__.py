"""`python -m tests.fuzz [--cases N] [--processes N] [--again KIND NUMBER]`."""

import argparse
import sys
import tempfile
import time
from pathlib import Path

from tests.fuzz.run import many, one

SHOWN = 12
"""Failures that are told in full."""


def main() -> int:
    """Exit code 1 where a case failed."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--cases", type=int, default=100_000)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--again", nargs=2, metavar=("KIND", "NUMBER"), help="one case, its files kept")
    asked = parser.parse_args()
    if asked.again:
        kind, number = asked.again[0], int(asked.again[1])
        folder = Path(tempfile.mkdtemp(prefix="fuzz-"))
        verdict = one(kind, number, folder)
        print(f"{kind} {number} in {folder}: {verdict.outcome}\n{verdict.said}")
        return int(verdict.outcome == "failed")
    began, found = time.perf_counter(), many(asked.cases, asked.processes)
    print(f"{'kind':18}{'cases':>8}{'accepted':>10}{'refused':>9}{'failed':>8}{'ms a case':>11}{'longest [s]':>13}")
    for each in found:
        counts = [each.outcomes[name] for name in ("accepted", "refused", "failed")]
        speed = 1e3 * each.seconds / max(1, sum(counts))
        print(f"{each.kind:18}{sum(counts):8}{counts[0]:10}{counts[1]:9}{counts[2]:8}{speed:11.1f}{each.longest:13.2f}")
    failures = [failure for each in found for failure in each.failures]
    tried, seconds = sum(sum(each.outcomes.values()) for each in found), time.perf_counter() - began
    print(f"{tried} cases in {seconds:.0f} s, {len(failures)} failed")
    for failure in failures[:SHOWN]:
        print(f"\n{failure.kind} {failure.number}: python -m tests.fuzz --again '{failure.kind}' {failure.number}")
        print(failure.said)
    return int(bool(failures))


if __name__ == "__main__":
    sys.exit(main())
