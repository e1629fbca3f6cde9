"""How far each controller's loop is from unstable: its margins at rest where the path of its first situation begins."""

from collections.abc import Mapping
from typing import NamedTuple

from quadstep.io.errors import UserError
from quadstep.linear.analysis import studied
from quadstep.linear.grade import graded, refused
from quadstep.linear.quick import of_analysis
from quadstep.linear.worst import ROW_HEADER, cells
from quadstep.mission.multirotor import MultirotorMission
from quadstep.mission.schema import Mission
from quadstep.studies.comparison.study import StudyCell

HEADER = ("vehicle", "controller", *ROW_HEADER[1:])


class Linear(NamedTuple):
    """What is said of a loop. grade, why: of `linear.grade`. cells: of `HEADER` after the names; metrics: margins by name;
    neither where it cannot be linearised. estimator: whether one was left out.
    """

    grade: str
    why: str
    cells: list[str]
    metrics: dict[str, float]
    estimator: bool = False


def linear_of(cell: StudyCell) -> Linear:
    flown = cell.mission
    mission = without_estimator(flown)
    left_out = mission is not flown
    try:
        found = studied(mission).analysis
    except UserError as error:
        grade = refused(error)
        return Linear(grade.word, grade.why.removeprefix(f"{cell.campaign.source}: "), [], {}, left_out)
    grade = graded(found)
    return Linear(grade.word, grade.why, cells(found), of_analysis(found), left_out)


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
    none = ["-"] * (len(HEADER) - 3)
    return [[vehicle or "-", controller, *(one.cells or [one.grade, *none])] for (vehicle, controller), one in found.items()]


def unlinearised(found: Mapping[tuple[str, str], Linear]) -> list[str]:
    """A line for each that cannot be linearised."""
    return [
        f"{' on '.join(filter(None, (controller, vehicle)))}: {one.why}"
        for (vehicle, controller), one in found.items()
        if not one.metrics
    ]
