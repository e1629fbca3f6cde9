"""Tables that `quadstep study region` prints."""

from fractions import Fraction

from quadstep.proofs.theory.edge import Edge
from quadstep.proofs.theory.region import NORMS, Region, root_above

MEANINGS = {
    "r1": ("|r1|", "m/s"), "I1": ("|int r1|", "m"), "e1": ("|e1|: position", "m"), "e2": ("|e2|: attitude", "rad"),
    "r2": ("|r2|", "rad/s"), "I2": ("|int r2|", "rad"), "a": ("command filter, first stage", "rad"),
    "b": ("command filter, second stage", "rad"),
}  # fmt: skip
UNITS = {"position": "m", "velocity": "m/s", "attitude": "rad", "rates": "rad/s"}


def region_rows(region: Region, least_frequency: Fraction) -> list[tuple[str, str]]:
    """Level, rate and their consequences, each with its unit."""
    bounds = region.bounds
    ending = root_above(region.ultimate / region.level)
    rows = [
        ("L", f"{float(region.level):g} J"),
        ("time constant of the root of L", f"{1.0 / float(region.rate):.3g} s"),
        ("ultimate L", f"{float(region.ultimate):.2g} J"),
    ]
    for name, (what, unit) in MEANINGS.items():
        most = bounds.largest[NORMS.index(name)]
        rows.append((what, f"{float(most):.3g} {unit}, in the end {float(most * ending):.2g}"))
    return [
        *rows,
        ("thrust", f"{float(bounds.thrust):.3g} N"),
        ("least thrust upwards", f"{float(bounds.vertical):.3g} N (at least)"),
        ("filter frequency", f"{float(least_frequency):g} rad/s (at least)"),
    ]


def edge_rows(flights: list[Edge]) -> list[tuple[str, ...]]:
    rows = []
    for flight in flights:
        off = "; ".join(
            f"({', '.join(f'{number + 0.0:.3g}' for number in numbers)}) {UNITS[key]}" for key, numbers in flight.off.items()
        )
        learning = "diverged" if flight.learning is None else f"{max(flight.learning):.2f}"
        rows.append((flight.name, off, *(f"{share:.2f}" for share in flight.returned), learning))
    return rows


def line_rows(shares: dict[tuple[str, str], float]) -> list[tuple[str, str]]:
    """The share of each coefficient of Q that closed loops use, the least first."""
    return [(f"{a}, {b}", f"{max(share, 0.0):.2f}") for (a, b), share in sorted(shares.items(), key=lambda one: one[1])]
