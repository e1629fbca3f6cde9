"""Default gains hold a hover with margin: random vehicles under every law whose loop is graded within seconds."""

import math
from collections.abc import Iterator

import numpy as np

from quadstep.control.registry import STOCK, names
from quadstep.interfaces.controller import Measured
from quadstep.linear.grade import Grade
from tests.challenge.search import Attempt, Search
from tests.random_sheets import UNGRADED, any_vehicle, hover_grade


def reached(found: Grade) -> float:
    """The limit of a margin over the margin, of the one that is nearest to its limit."""
    shares = [one.limit / one.value if math.isfinite(one.value) else 0.0 for one in found.measures]
    return max(shares, default=math.inf)


def hovers(seed: int) -> Iterator[Attempt]:
    random = np.random.default_rng(seed)
    laws = [law for law in names(Measured) if law not in (*UNGRADED, *STOCK)]
    while True:
        table, law = any_vehicle(random), str(random.choice(laws))
        found = hover_grade(table, law)
        yield Attempt(reached(found), f"{law} on {table}: {found.sentence}")


SEARCHES = [
    Search("default gains", "any vehicle hovers with margin under every law's default gains, with drag or without", hovers)
]
