"""The controllers that a mission on the paper's plant can name."""

from typing import TYPE_CHECKING, Annotated

from pydantic import SerializeAsAny, WrapValidator

from quadstep.control.backstepping import Backstepping
from quadstep.mission.derived import ControllerSection, any_section, section_of
from quadstep.mission.own_controller import own_or
from quadstep.vehicle.state import State

USUAL_CONTROLLER = section_of(Backstepping)(type="backstepping")

if TYPE_CHECKING:
    AnyController = ControllerSection
else:
    AnyController = Annotated[SerializeAsAny[any_section(State)], WrapValidator(own_or(State))]
