"""A vehicle with equations of motion of its own: a planar quadrotor that floats (docs/own.md)."""

from typing import ClassVar

from quadstep.vehicle.planar import Planar


class Blimp(Planar):
    """As the planar quadrotor of the package, under another name."""

    name: ClassVar = "blimp"
    label: ClassVar = "blimp"
