"""A mission whose controller is an autopilot at the other end of a socket."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from typing import ClassVar, NamedTuple, Self

import numpy as np

from quadstep.autopilot import ardupilot, px4
from quadstep.autopilot.address import address
from quadstep.autopilot.ardupilot import ArduPilot
from quadstep.autopilot.link import Link, Piloted, sample_of
from quadstep.autopilot.px4 import Px4
from quadstep.control.commands import RotorSpeeds
from quadstep.control.controller import Measured
from quadstep.control.model import Model
from quadstep.control.opaque import NoGains, Opaque
from quadstep.errors import UserError
from quadstep.flight.engines import FlightPlan
from quadstep.guidance.reference import Reference
from quadstep.mission.derived import section_of
from quadstep.mission.multirotor import MultirotorMission
from quadstep.mission.schema import Mission
from quadstep.numbers import Number, Structure, Vector
from quadstep.numbers.opaque import call
from quadstep.numbers.registered import raise_pending, register, release


class Autopilot(StrEnum):
    """Those that are spoken to."""

    PX4 = "px4"
    ARDUPILOT = "ardupilot"


class PilotedGains(NamedTuple):
    """handle: of the link."""

    handle: Number


@dataclass(frozen=True)
class PilotedLaw(Opaque):
    """Asks the autopilot how fast the rotors should turn. rotors: how many."""

    rotors: int = 4

    name = "autopilot"
    label = "an autopilot through its simulator's interface"
    Gains = NoGains
    commands = RotorSpeeds
    also_measures = ("specific_force",)
    handle: ClassVar[list[float]] = []
    """Of the link of the flight that is being prepared."""

    @classmethod
    def for_vehicle(cls, model: Model) -> Self:
        """For its rotors."""
        return cls(model.rotors)

    def prepare(self, gains: NoGains, model: Model) -> PilotedGains:
        """The link's handle."""
        return PilotedGains(self.handle[-1])

    def law(
        self, memory: tuple[()], measured: Measured, reference: Reference, gains: Structure, t: Number, period: Number
    ) -> tuple[Structure, tuple[()]]:
        """One sample."""
        return RotorSpeeds(Vector(call(gains.handle, sensed(t, measured), self.rotors))), memory

    def landed(self, gains: Structure) -> None:
        """Raises what the link raised."""
        raise_pending(int(gains.handle))


def sensed(t: Number, measured: Measured) -> list[Number]:
    """What an autopilot is told, in our axes."""
    motion = (measured.position, measured.velocity, measured.attitude, measured.rates, measured.specific_force)
    return [t, *(entry for vector in motion for entry in vector)]


def meet(link: Link, plan: FlightPlan) -> None:
    """Wait for the autopilot, with the vehicle at the start of its flight. Raises UserError where none comes."""
    loop = plan.loop
    link.meet(sample_of(np.array(sensed(0.0, loop.told(loop.start(plan.start, plan.parameters), plan.parameters)))))


def opened(autopilot: str, connect: str | None) -> Link:
    """A link. Raises UserError."""
    if autopilot not in list(Autopilot):
        raise UserError(f"--autopilot {autopilot}: is not known; allowed: {', '.join(Autopilot)}")
    if autopilot == Autopilot.PX4:
        return Px4(address(connect or "", px4.PORT))
    return ArduPilot(address(connect or "", ardupilot.PORT))


class UnderAutopilot(NamedTuple):
    """mission: the same, its controller the autopilot. piloted: knows why a flight was lost."""

    mission: Mission
    piloted: Piloted


@contextmanager
def under(link: Link, mission: Mission) -> Iterator[UnderAutopilot]:
    """The mission under the autopilot, to be flown inside the block. Raises UserError for a plant that no autopilot flies."""
    try:
        if not isinstance(mission, MultirotorMission):
            raise UserError("--autopilot: needs a mission for a real vehicle (docs/vehicles.md)")
        vehicle = mission.modelled
        piloted = Piloted(link, len(vehicle.geometry.mounts), float(vehicle.airframe.rotor.fastest))
        handle = register(piloted)
        PilotedLaw.handle.append(float(handle))
        try:
            section = section_of(PilotedLaw)(type=PilotedLaw.name)
            yield UnderAutopilot(mission.model_copy(update={"controller": section}), piloted)
        finally:
            PilotedLaw.handle.pop()
            release(handle)
    finally:
        link.close()
