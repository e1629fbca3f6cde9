"""The controllers that a mission for a real vehicle can name."""

from typing import TYPE_CHECKING, Annotated

from pydantic import SerializeAsAny, WrapValidator

from quadstep.control.controller import Measured
from quadstep.control.geometric import Geometric
from quadstep.mission.derived import ControllerSection, any_section, section_of
from quadstep.mission.own_controller import own_or

USUAL_AIRFRAME_CONTROLLER = section_of(Geometric)(type="geometric")

if TYPE_CHECKING:
    AnyAirframeController = ControllerSection
else:
    AnyAirframeController = Annotated[SerializeAsAny[any_section(Measured)], WrapValidator(own_or(Measured))]
