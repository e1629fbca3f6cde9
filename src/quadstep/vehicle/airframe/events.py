"""Events during a flight: a payload is picked up or released, a rotor loses efficiency."""

from typing import NamedTuple

from quadstep.numbers import Matrix, Number, Vector, matrix, total, vector, where
from quadstep.vehicle.airframe.motion import MassProperties
from quadstep.vehicle.airframe.plant import Airframe


class Payload(NamedTuple):
    """A point mass fixed to the body. start, end [s]; mass [kg]; position: body axes, from its origin [m]."""

    start: Number
    end: Number
    mass: Number
    position: Vector


class RotorFault(NamedTuple):
    """From start [s] on a rotor (its index, from 0) gives `efficiency` times the thrust and torque of its speed."""

    start: Number
    rotor: Number
    efficiency: Number


class Events(NamedTuple):
    """All events of a flight."""

    payloads: tuple[Payload, ...] = ()
    faults: tuple[RotorFault, ...] = ()


def mass_properties(airframe: Airframe, events: Events, t: Number) -> MassProperties:
    """Mass, centre of gravity and inertia at time t [s], by the parallel-axis theorem; the bare vehicle's is the body's
    origin.
    """
    masses = [where(t >= p.start, where(t < p.end, p.mass, 0.0), 0.0) for p in events.payloads]
    x, y, z = airframe.inertia
    diagonal = matrix((x, 0.0, 0.0), (0.0, y, 0.0), (0.0, 0.0, z))
    if not masses:
        return MassProperties(airframe.mass, vector(0.0, 0.0, 0.0), diagonal)
    mass = airframe.mass + total(masses)
    moment = total(m * p.position for m, p in zip(masses, events.payloads, strict=True))
    offset = moment * (1.0 / mass)
    about_origin = diagonal + total(m * point_inertia(p.position) for m, p in zip(masses, events.payloads, strict=True))
    return MassProperties(mass, offset, about_origin - mass * point_inertia(offset))


def point_inertia(r: Vector) -> Matrix:
    """Inertia of a unit point mass at r about the origin: |r|^2 I - r r^T [m^2]."""
    x, y, z = r
    return matrix((y * y + z * z, -x * y, -x * z), (-x * y, x * x + z * z, -y * z), (-x * z, -y * z, x * x + y * y))


def efficiencies(events: Events, count: int, t: Number) -> Vector:
    """Each rotor's factor on thrust and torque at time t [s]."""
    result: list[Number] = [1.0] * count
    for fault in events.faults:
        result = [
            where(t >= fault.start, where(fault.rotor == float(i), factor * fault.efficiency, factor), factor)
            for i, factor in enumerate(result)
        ]
    return Vector(result)
