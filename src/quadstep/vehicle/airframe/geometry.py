"""The positions of a vehicle's rotors, and the effects that are computed: structure, known when a flight is compiled."""

from dataclasses import dataclass
from functools import cached_property

from quadstep.numbers import Matrix, matrix, vector


@dataclass(frozen=True)
class Mount:
    """A rotor's mount: position of its hub [m], and axis, the unit vector along which it pushes; body axes.

    spin: +1 turns counter-clockwise seen against its axis (right-handed about it), -1 clockwise; the reaction is opposite.
    """

    position: tuple[float, float, float]
    axis: tuple[float, float, float]
    spin: int

    @cached_property
    def frame(self) -> Matrix:
        """The rotor's own axes as rows, its axis last: frame @ body = rotor. The unit matrix for a rotor that pushes along
        z.
        """
        x, y, z = self.axis
        flat = vector(y, z).norm()
        if flat > 0.5:  # the first in the plane of the axis and body x
            return matrix((flat, -x * y / flat, -x * z / flat), (0.0, z / flat, -y / flat), (x, y, z))
        flat = vector(x, z).norm()
        return matrix((z / flat, 0.0, -x / flat), (-x * y / flat, flat, -y * z / flat), (x, y, z))


@dataclass(frozen=True)
class Geometry:
    """The rotors, four to eight of them, in order."""

    mounts: tuple[Mount, ...]


@dataclass(frozen=True)
class Effects:
    """battery: sag. ground: its cushion. gyroscopic: torques of turning and accelerating rotors. drag: of body and rotors."""

    battery: bool = False
    ground: bool = False
    gyroscopic: bool = True
    drag: bool = True
