"""Another program in a controller's place: `type = "px4"` in [controller] names a table that an autopilot registers."""

from abc import abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

from quadstep.io.doors import Door
from quadstep.io.errors import UserError
from quadstep.mission.derived import ControllerSection

if TYPE_CHECKING:
    from quadstep.engines.fly import FlightPlan

SECTION = "quadstep.bridges.autopilot.controller:AutopilotSection"
AUTOPILOTS = Door("quadstep.autopilots", {"px4": SECTION, "ardupilot": SECTION})
"""Classes of `PilotedSection` by the `type` in [controller]."""

FIRST_WAIT = 60.0
"""How long an autopilot may take to connect [s]."""


class Matching(Protocol):
    """What an autopilot must be told of the vehicle that it flies. note: what that does not settle; may be empty."""

    @property
    def file(self) -> str: ...

    @property
    def note(self) -> str: ...

    def sentence(self) -> str:
        """All of it in one line."""
        ...

    def text(self) -> str:
        """The content of `file`, in the autopilot's own format."""
        ...


class PilotedSection(ControllerSection):
    """The table of an autopilot. connect: where it is listened for."""

    connect: str = ""

    @abstractmethod
    def matching(self, plan: "FlightPlan") -> Matching:
        """What the autopilot must be told of the plan's vehicle."""

    @abstractmethod
    def watch(self, told: Callable[[str], None], first_wait: float) -> None:
        """Tells what the next flight waits for; it waits so long for an autopilot to appear [s]."""


def piloted_section(name: str) -> type[PilotedSection]:
    """The table of an autopilot. Raises UserError."""
    found = AUTOPILOTS.load(name)
    if not (isinstance(found, type) and issubclass(found, PilotedSection)):
        raise UserError(f"{name}: what is registered for {AUTOPILOTS.group} should be a subclass of PilotedSection")
    return found
