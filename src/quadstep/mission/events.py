"""The events of a mission: changes to a vehicle in flight."""

from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import Field, model_validator

from quadstep.mission.fields import NonNegative, Positive, Quantity, Section, Share, Triple
from quadstep.numbers import Vector
from quadstep.vehicle.airframe.plant import Events, Payload, RotorFault

NEVER = 1e9
"""A time that no flight reaches [s]."""


class LastingSection(Section):
    """Something that lasts for a time."""

    time: Annotated[NonNegative, Quantity("s", "start of the event")]
    until: Annotated[Positive | None, Quantity("s", "end of the event; default: never")] = None

    @model_validator(mode="after")
    def _ordered(self) -> "LastingSection":
        if self.until is not None and self.until <= self.time:
            raise ValueError(f"until = {self.until:g} s must be after time = {self.time:g} s")
        return self

    @property
    def end(self) -> float:
        """When it is over [s]."""
        return NEVER if self.until is None else self.until


class PayloadSection(LastingSection):
    """A point mass: it adds weight and inertia, and moves the centre of gravity."""

    type: Literal["payload"]
    mass: Annotated[Positive, Quantity("kg", "mass of the payload, a point mass")]
    position: Annotated[Triple, Quantity("m", "position of the payload in body axes")] = (0.0, 0.0, 0.0)

    def payloads(self, mass: float) -> list[Payload]:
        """The payload, on a vehicle of `mass` [kg]."""
        return [Payload(self.time, self.end, self.mass, Vector(self.position))]


class CentreSection(LastingSection):
    """The centre of gravity moves; the mass and the inertia about it stay the same.

    It is as if the whole vehicle but its rotors were moved: its mass is taken from the body's origin and put at `shift`.
    """

    type: Literal["centre-of-gravity"]
    shift: Annotated[Triple, Quantity("m", "shift of the centre of gravity in body axes")]

    def payloads(self, mass: float) -> list[Payload]:
        """Two payloads that move `mass` [kg]."""
        return [
            Payload(self.time, self.end, -mass, Vector((0.0, 0.0, 0.0))),
            Payload(self.time, self.end, mass, Vector(self.shift)),
        ]


class RotorFaultSection(Section):
    """A rotor that makes less thrust and torque than its speed should."""

    type: Literal["rotor"]
    time: Annotated[NonNegative, Quantity("s", "start of the event")]
    rotor: Annotated[int, Field(ge=1), Quantity("", "number of the rotor, counted from 1")]
    efficiency: Annotated[Share, Quantity("", "remaining share of thrust and torque")]


AnyEvent = Annotated[PayloadSection | CentreSection | RotorFaultSection, Field(discriminator="type")]


def check_events(events: Sequence[AnyEvent], rotors: int, duration: float) -> None:
    """Raises ValueError for an event that this vehicle of `rotors` rotors, or a flight of `duration` [s], does not have."""
    for place, event in enumerate(events):
        if event.time >= duration:
            raise ValueError(f"events[{place}].time: {event.time:g} s is not before the flight's end at {duration:g} s")
        if isinstance(event, RotorFaultSection) and event.rotor > rotors:
            raise ValueError(f"events[{place}].rotor: {event.rotor} is not one of the vehicle's rotors, 1 to {rotors}")


def build_events(events: Sequence[AnyEvent], mass: float) -> Events:
    """The events as numbers, for a vehicle of `mass` [kg]."""
    payloads = [payload for event in events if not isinstance(event, RotorFaultSection) for payload in event.payloads(mass)]
    faults = [
        RotorFault(event.time, float(event.rotor - 1), event.efficiency)
        for event in events
        if isinstance(event, RotorFaultSection)
    ]
    return Events(payloads=tuple(payloads), faults=tuple(faults))


def event_warnings(events: Sequence[AnyEvent], places: Sequence[tuple[float, float, float]]) -> list[str]:
    """Events that no controller could fly with: a centre of gravity beyond all rotors. places: of the rotors [m]."""
    reach = max(Vector(place).norm() for place in places)
    return [
        f"events[{place}].shift: {Vector(event.shift).norm():g} m is beyond the rotors, at {reach:g} m"
        for place, event in enumerate(events)
        if isinstance(event, CentreSection) and Vector(event.shift).norm() >= reach
    ]
