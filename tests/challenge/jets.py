"""Slopes of laws at a point, as proofs of instability use them, against differences of random programs."""

from collections.abc import Iterable

import numpy as np

from quadstep.numbers.enclosure import UndefinedError
from quadstep.proofs.prove.jet import Jet, bounded, jets
from tests.challenge.search import Attempt, Search
from tests.random_programs import BENT, JUMPS, ROOTED, SMOOTH, program

FAR, NEAR, WAYS = 1e-3, 1e-6, 8
"""Distances from the point, and directions of each."""

BENDS = 0.1
"""What is smooth is nearer to its line by more than this, relative to the distance, at the smaller distance."""

NOTHING = 1e-5
"""Of the differences' own rounding."""


def slopes(seed: int) -> Iterable[Attempt]:
    """2 for a slope that differences do not have, or a number called Lipschitz whose differences grow without bound."""
    random = np.random.default_rng(seed)
    while True:
        law, text = program(random, 2, int(random.integers(1, 7)), SMOOTH, BENT, ROOTED, JUMPS)
        point = [0.0, 0.0] if random.random() < 0.7 else [0.0, 0.25]
        try:
            with np.errstate(all="ignore"):
                found = law(jets(point))
        except UndefinedError:
            continue
        if not isinstance(found, Jet) or not bounded(found):
            continue
        line = np.zeros(2) if found.kinked else np.broadcast_to(found.slopes.centre[:, 0], 2)
        value, ways = law(point), random.normal(size=(WAYS, 2))
        far, near = (
            max(
                abs(law([p + size * w for p, w in zip(point, way, strict=True)]) - value - size * (line @ way)) for way in ways
            )
            / size
            for size in (FAR, NEAR)
        )
        limit = NOTHING * (1.0 + np.abs(line).max()) + (10.0 if found.kinked else BENDS) * far
        inside = found.value.low[0] <= value <= found.value.high[0]
        yield Attempt(
            0.0 if inside and near <= limit else 2.0, f"{text} at {point}, {'Lipschitz' if found.kinked else line.tolist()}"
        )


SEARCHES = [Search("slopes at a point", "a law has the slopes at its rest from which hover is said to be unstable", slopes)]
