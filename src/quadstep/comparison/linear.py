"""How far each controller's loop is from unstable: its margins at rest where the path of its first situation begins."""

from collections.abc import Mapping
from typing import NamedTuple

from quadstep.comparison.study import Cell
from quadstep.errors import UserError
from quadstep.linear.analysis import studied
from quadstep.linear.metrics import of_analysis
from quadstep.linear.worst import ROW_HEADER, cells
from quadstep.mission.multirotor import MultirotorMission
from quadstep.mission.schema import Mission

HEADER = ("vehicle", "controller", *ROW_HEADER[1:])


class Linear(NamedTuple):
    """What is said of a loop. cells: of `HEADER` after the names; metrics: margins by name.

    refused: why it cannot be linearised, and then it has neither; empty where it can.
    """

    cells: list[str]
    metrics: dict[str, float]
    refused: str = ""


def linear_of(cell: Cell) -> Linear:
    """Of a cell's mission."""
    try:
        found = studied(without_estimator(cell.mission)).analysis
    except UserError as error:
        return Linear([], {}, str(error).removeprefix(f"{cell.campaign.source}: "))
    return Linear(cells(found), of_analysis(found))


def without_estimator(mission: Mission) -> Mission:
    """The loop without a Kalman filter and the latency of fixes that it makes up for: its covariance has hundreds of
    states, the same for every controller.
    """
    if not isinstance(mission, MultirotorMission) or not mission.sensors.estimator:
        return mission
    sensors = mission.sensors.model_copy(update={"estimator": False, "latency": 0.0})
    return mission.model_copy(update={"sensors": sensors})


def rows(found: Mapping[tuple[str, str], Linear]) -> list[list[str]]:
    """A row of `HEADER` for each controller: the least margins of all its channels."""
    none = ["not linearised", *["-"] * (len(HEADER) - 3)]
    return [[vehicle or "-", controller, *(one.cells or none)] for (vehicle, controller), one in found.items()]


def refused(found: Mapping[tuple[str, str], Linear]) -> list[str]:
    """A line for each that cannot be linearised."""
    return [
        f"{' on '.join(filter(None, (controller, vehicle)))}: {one.refused}"
        for (vehicle, controller), one in found.items()
        if one.refused
    ]
