"""What a figure is made of."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Panel(NamedTuple):
    """One set of axes over time: what is drawn, its unit, and the lines by legend entry."""

    label: str
    unit: str
    lines: dict[str, NDArray[np.float64]]
