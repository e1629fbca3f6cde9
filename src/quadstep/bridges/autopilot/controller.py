"""An autopilot at the other end of a socket as a controller: `type = "px4"` or `type = "ardupilot"` in a mission."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, ClassVar, Literal, NamedTuple, Self

from pydantic import AfterValidator

from quadstep.bridges.autopilot import ardupilot, px4
from quadstep.bridges.autopilot.ardupilot import ArduPilot
from quadstep.bridges.autopilot.link import Address, AutopilotLink, Piloted, address, sample_of
from quadstep.bridges.autopilot.matching import MATCHING, Matching
from quadstep.bridges.autopilot.px4 import Px4
from quadstep.control.opaque import NoGains, Opaque
from quadstep.engines.fly import FlightPlan
from quadstep.interfaces.controller import Controller, Measured, RotorSpeeds
from quadstep.interfaces.model import Model
from quadstep.interfaces.reference import Reference
from quadstep.io.errors import UserError
from quadstep.mission.derived import BuiltController, Modelled
from quadstep.mission.fields import Quantity
from quadstep.mission.own_controller import FIRST_WAIT, PilotedSection
from quadstep.numbers import Number, Vector
from quadstep.numbers.opaque import call, raise_pending, register
from quadstep.vehicle.plants.multirotor import Multirotor


class AutopilotKind(NamedTuple):
    """An autopilot that is spoken to. link: waits for it somewhere, so long [s]; port: where it is expected."""

    link: Callable[[Address, float], AutopilotLink]
    port: int


KINDS = {"px4": AutopilotKind(Px4, px4.PORT), "ardupilot": AutopilotKind(ArduPilot, ardupilot.PORT)}


class PilotedGains(NamedTuple):
    """handle: of the connection. fastest: the rotors' speed at full output [rad/s]. lift: the weight over the largest thrust
    of one rotor.
    """

    handle: Number
    fastest: Number
    lift: Number


@dataclass(frozen=True)
class PilotedLaw(Opaque[PilotedGains, RotorSpeeds]):
    """Asks the autopilot how fast the rotors should turn. rotors: how many."""

    rotors: int = 4

    name = "autopilot"
    label = "an autopilot through its simulator's interface"
    nature = "another program"
    Gains = NoGains
    commands = RotorSpeeds
    also_measures = ("specific_force",)
    one_at_a_time = True

    @classmethod
    def for_vehicle(cls, model: Model) -> Self:
        return cls(model.rotors)

    def law(
        self, memory: tuple[()], measured: Measured, reference: Reference, gains: PilotedGains, t: Number, period: Number
    ) -> tuple[RotorSpeeds, tuple[()]]:
        shares = call(gains.handle, sensed(t, measured), self.rotors)
        return RotorSpeeds(Vector(gains.fastest * share for share in shares)), memory

    def before_flight(self, measured: Measured, gains: PilotedGains) -> None:
        """Connect, and wait until the autopilot takes off. Raises UserError where none comes, or it does not."""
        first = sample_of([float(one) for one in sensed(0.0, measured)])
        CONNECTIONS[int(gains.handle)].begin(first, self.rotors, float(gains.lift))

    def landed(self, gains: PilotedGains) -> None:
        """Hang up; raises what the connection raised."""
        CONNECTIONS[int(gains.handle)].end()
        raise_pending(int(gains.handle))

    def why_lost(self, gains: PilotedGains) -> str:
        """Why the autopilot did not finish the last flight."""
        return CONNECTIONS[int(gains.handle)].lost


def sensed(t: Number, measured: Measured) -> list[Number]:
    """What an autopilot is told, in our axes."""
    motion = (measured.position, measured.velocity, measured.attitude, measured.rates, measured.specific_force)
    return [t, *(entry for vector in motion for entry in vector)]


CONNECTIONS: dict[int, Piloted] = {}
"""By handle; they are never forgotten."""


@cache
def connection(autopilot: str, where: Address) -> int:
    """The handle of the connection to an autopilot, the same for all flights."""
    piloted = Piloted(lambda wait: KINDS[autopilot].link(where, wait))
    handle = register(piloted)
    CONNECTIONS[handle] = piloted
    return handle


def checked_address(text: str) -> str:
    """Refuses what is no address. Raises ValueError."""
    try:
        address(text, 1)
    except UserError as error:
        raise ValueError(str(error)) from None
    return text


class AutopilotSection(PilotedSection):
    """An autopilot that its user starts, in lockstep through the interface of its simulators."""

    controller: ClassVar[type[Controller]] = PilotedLaw

    type: Literal["px4", "ardupilot"]
    connect: Annotated[
        str, AfterValidator(checked_address), Quantity("", "where to listen, [HOST:]PORT; 127.0.0.1 and its usual port")
    ] = ""

    def matching(self, plan: FlightPlan) -> Matching:
        plant = plan.loop.plant
        assert isinstance(plant, Multirotor)
        return MATCHING[self.type](plan.parameters, plant.geometry)

    def watch(self, told: Callable[[str], None], first_wait: float = FIRST_WAIT) -> None:
        for one in CONNECTIONS.values():
            one.told, one.first_wait = told, first_wait

    def build(self, vehicle: Modelled, folder: Path) -> BuiltController:
        """The law, and where its autopilot is."""
        model = vehicle.model()
        handle = connection(self.type, address(self.connect, KINDS[self.type].port))
        lift = model.mass * model.gravity / (model.per_speed * model.fastest * model.fastest)
        return BuiltController(PilotedLaw(model.rotors), PilotedGains(float(handle), model.fastest, lift))
