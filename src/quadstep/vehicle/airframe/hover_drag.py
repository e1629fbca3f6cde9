"""Drag of the rotors at hover speed."""

from quadstep.numbers import Vector, vector
from quadstep.vehicle.airframe.aerodynamics import hub_drag
from quadstep.vehicle.airframe.allocation import Allocation, allocate
from quadstep.vehicle.airframe.geometry import Geometry
from quadstep.vehicle.airframe.plant import Airframe

NO_DRAG = vector(0.0, 0.0, 0.0)


def hover_drag(geometry: Geometry, airframe: Airframe, allocation: Allocation) -> Vector:
    """Along body x, y, z, over speed along each and mass [1/s]: the rotors of a vehicle that hovers level."""
    speeds, _, _ = allocate(geometry, allocation, airframe.mass * airframe.gravity, NO_DRAG)
    found = []
    for axis in range(3):
        along = Vector(1.0 if i == axis else 0.0 for i in range(3))
        force = NO_DRAG
        for mount, speed in zip(geometry.mounts, speeds, strict=True):
            force = force + hub_drag(airframe.drag, mount.frame, speed * along)
        found.append((0.0 - force[axis]) / airframe.mass)
    return Vector(found)
