"""The disturbance of a mission on the paper's plant."""

from typing import TYPE_CHECKING, Annotated, ClassVar

from pydantic import SerializeAsAny, WrapValidator

from quadstep.io.user_code.installed import DISTURBANCES
from quadstep.mission.fields import Finite, Quantity, Section, Triple
from quadstep.mission.own_thing import OwnSection, own_or
from quadstep.numbers import Vector
from quadstep.vehicle.paper import DeclaredDisturbance, Disturbance


class DisturbanceSection(Section):
    """The paper's disturbance (Eq. 67), plus constant force and generalised torque."""

    scale: Annotated[Finite, Quantity("times Eq. 67", "scale of the paper's disturbance; 0 for none")] = 1.0
    force: Annotated[Triple, Quantity("N", "constant force in world axes")] = (0.0, 0.0, 0.0)
    torque: Annotated[Triple, Quantity("N m", "constant torque on psi, theta, phi")] = (0.0, 0.0, 0.0)

    thing: ClassVar[None] = None
    """No law but the paper's."""

    def build(self) -> Disturbance:
        """Its numbers."""
        return Disturbance(self.scale, Vector(self.force), Vector(self.torque))


class OwnDisturbanceSection(OwnSection):
    """A disturbance of the user's own: its `type`, and a key for each of its numbers."""

    thing: ClassVar[DeclaredDisturbance]

    def build(self) -> object:
        """Its numbers."""
        return self.numbers()


if TYPE_CHECKING:
    AnyDisturbance = DisturbanceSection | OwnDisturbanceSection
else:
    AnyDisturbance = Annotated[
        SerializeAsAny[DisturbanceSection], WrapValidator(own_or(DeclaredDisturbance, OwnDisturbanceSection, DISTURBANCES))
    ]
