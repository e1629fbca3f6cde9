"""The parts of a figure."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

LOG, SIGNED_LOG = "log", "symlog"
COMMANDED, SETPOINT = "commanded", "setpoint"
ASKED_FOR = (COMMANDED, SETPOINT)
"""Names of lines that are drawn as a band below what comes of them."""


class Panel(NamedTuple):
    """One set of axes over time: what is drawn, its unit, and the lines by legend entry.

    scale: `LOG`, `SIGNED_LOG`, or nothing: linear, unless a short peak would flatten all the rest. reach: the largest value of
    panels that are shown in the same unit.
    """

    label: str
    unit: str
    lines: dict[str, NDArray[np.float64]]
    scale: str = ""
    reach: float = 0.0


class Track(NamedTuple):
    """A flight in space. distance [m]: from its path; wanted, flown: points [m], shape (samples, 3)."""

    distance: NDArray[np.float64]
    wanted: NDArray[np.float64]
    flown: NDArray[np.float64]
