"""How far each controller's loop is from unstable: its margins at rest where the path of its first situation begins."""

from collections.abc import Mapping, Sequence

from quadstep.comparison.study import Cell
from quadstep.errors import UserError
from quadstep.linear import worst
from quadstep.linear.analysis import Analysis, studied
from quadstep.linear.worst import ROW_HEADER, cells
from quadstep.mission.multirotor import MultirotorMission
from quadstep.mission.read import check_mission
from quadstep.mission.schema import Mission

Linear = Analysis | str
"""The loop, or why it cannot be linearised."""

HEADER = ("vehicle", "controller", *ROW_HEADER[1:])


def linear_of(cell: Cell) -> Linear:
    """Of a cell's mission."""
    campaign = cell.campaign
    try:
        mission = without_estimator(check_mission(campaign.content, campaign.source, campaign.folder))
        return studied(mission).analysis
    except UserError as error:
        return str(error).removeprefix(f"{campaign.source}: ")


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
    return [
        [vehicle or "-", controller, *(["not linearised", *["-"] * 5] if isinstance(one, str) else cells(one))]
        for (vehicle, controller), one in found.items()
    ]


def refused(found: Mapping[tuple[str, str], Linear]) -> list[str]:
    """A line for each that cannot be linearised."""
    return worst.refused(
        [(" on ".join(filter(None, (controller, vehicle))), one) for (vehicle, controller), one in found.items()]
    )


def loops_of(wanted: Sequence[Cell]) -> dict[tuple[str, str], Linear]:
    """By vehicle and controller, each at its first cell."""
    found: dict[tuple[str, str], Linear] = {}
    for cell in wanted:
        whose = (cell.situation.vehicle, cell.controller)
        if whose not in found:
            found[whose] = linear_of(cell)
    return found
