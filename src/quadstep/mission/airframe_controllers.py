"""The controllers that a mission for a real vehicle can name."""

from typing import TYPE_CHECKING

from quadstep.control.geometric import Geometric
from quadstep.interfaces.controller import Measured
from quadstep.mission.derived import ControllerSection, section_of
from quadstep.mission.own_controller import any_controller

USUAL_AIRFRAME_CONTROLLER = section_of(Geometric)(type="geometric")

if TYPE_CHECKING:
    AnyAirframeController = ControllerSection
else:
    AnyAirframeController = any_controller(Measured)
