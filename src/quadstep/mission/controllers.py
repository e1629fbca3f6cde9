"""The controllers that a mission on the paper's plant can name."""

from typing import TYPE_CHECKING

from quadstep.control.backstepping import Backstepping
from quadstep.mission.derived import ControllerSection, section_of
from quadstep.mission.own_controller import any_controller
from quadstep.vehicle.paper.state import State

USUAL_CONTROLLER = section_of(Backstepping)(type="backstepping")

if TYPE_CHECKING:
    AnyController = ControllerSection
else:
    AnyController = any_controller(State)
