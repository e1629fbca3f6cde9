"""A map that was flown, in numbers."""

from typing import NamedTuple

from quadstep.studies.envelope.cells import Cells
from quadstep.studies.envelope.request import Request


class Panel(NamedTuple):
    """A panel of the map in numbers. name: the value of --by, empty without it.

    flyable: cells of so many. success: share of all flights. causes: flights that did not succeed, by why. rmse: the
    least and the largest of the flyable cells [m], None if there is none.
    """

    name: str
    cells: int
    flyable: int
    success: float
    causes: dict[str, int]
    rmse: tuple[float, float] | None


class Envelope(NamedTuple):
    """A map that was flown."""

    asked: Request
    cells: Cells
    panels: list[Panel]
