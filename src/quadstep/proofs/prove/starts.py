"""Everything that lives at the start of a flight, over all of its starts: memories, delay lines and estimates move with it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from quadstep.engines.loop import Loop, Numbers
from quadstep.io.errors import UserError
from quadstep.numbers import Structure, Vector, flatten, leaf_names, rebuild
from quadstep.numbers.enclosure import Enclosure
from quadstep.numbers.rotations import from_rotation_vector, multiply
from quadstep.proofs.prove.box import seeded
from quadstep.proofs.prove.unknown import Unknown
from quadstep.vehicle.plants.multirotor import Multirotor

Leaf: TypeAlias = Enclosure | float

NAMES = {
    "start": ("position",),
    "start_velocity": ("velocity",),
    "start_attitude": ("attitude", "pitch"),
    "start_rates": ("rates", "rate"),
}
"""What plants call the parts of their states that an `Unknown` bounds."""

STARTS = 3 * len(NAMES)
"""Directions of a start."""


def displaced(state: Structure, values: Sequence[float], loop: Loop, unknown: Unknown) -> list[Leaf]:
    """The leaves of a plant's state, off these values by as much as is unknown. Raises UserError for a plant without one."""
    found: list[Leaf] = list(values)
    names = leaf_names(state)
    for part, (field, called) in enumerate(NAMES.items()):
        radius = float(getattr(unknown, field))
        places = [i for i, name in enumerate(names) if name.partition(".")[0] in called]
        turned = field == "start_attitude" and isinstance(loop.plant, Multirotor)
        if not radius:
            continue
        if not 0 < len(places) <= 3 and not turned:
            option = field.replace("_", "-")
            raise UserError(
                f"--{option}: this plant's state has no {' or '.join(f'`{name}`' for name in called)} of 1 to 3 numbers"
            )
        size = min(3, len(places))
        spread = np.zeros((size, STARTS))
        spread[range(size), range(3 * part, 3 * part + size)] = radius
        middle = np.zeros(3) if turned else np.array([values[i] for i in places])
        moved: Sequence[Enclosure] = seeded(middle[:, None], spread)
        if turned:
            moved = multiply(Vector([values[i] for i in places]), from_rotation_vector(Vector(moved)))  # type: ignore[arg-type, assignment]
        for place, number in zip(places, moved, strict=True):
            found[place] = number
    return found


def started(loop: Loop, start: tuple[Structure, ...], parameters: Numbers, unknown: Unknown) -> list[Leaf]:
    """All leaves of the cycle before the first tick, over all starts. Raises UserError, UndefinedError."""
    values = [float(leaf) for leaf in flatten(start)]
    leaves = displaced(start, values, loop, unknown)
    try:
        return flatten(loop.start(rebuild(start, iter(leaves)), parameters))
    except TypeError as error:
        raise UserError(f"controller: nothing can be proved about its memory at the start: {error}") from None
