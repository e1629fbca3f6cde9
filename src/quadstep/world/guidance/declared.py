"""A path in your own file, which missions name, with declared numbers.

    [path]
    type = "my_path.py:Lissajous"

Its numbers are a `NamedTuple` of declarations (`gain.py`), from which the keys of `[path]` follow, their units, ranges
and checks, and the page's sliders.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from quadstep.interfaces.reference import Reference
from quadstep.numbers import Number


@dataclass(frozen=True)
class DeclaredPath(ABC):
    """A `PathLaw`; structure only, so it has no fields. Numbers: declared, each with a default.

    >>> from typing import NamedTuple
    >>> from quadstep.interfaces.gain import gain
    >>> from quadstep.world.guidance import DeclaredPath, Reference
    >>> from quadstep.numbers import vector
    >>> class ClimbNumbers(NamedTuple):
    ...     speed: float = gain(0.5, "m/s", "how fast it climbs")
    ...     height: float = gain(10.0, "m", "how high")
    >>> class Climb(DeclaredPath):
    ...     Numbers = ClimbNumbers
    ...     def length(self, numbers):
    ...         return numbers.height / numbers.speed
    ...     def reference(self, t, numbers):
    ...         rest = vector(0.0, 0.0, 0.0)
    ...         return Reference(vector(0.0, 0.0, numbers.speed * t), vector(0.0, 0.0, numbers.speed), rest, 0.0, 0.0)
    >>> Climb().length(ClimbNumbers(0.5, 10.0))
    20.0
    """

    Numbers: ClassVar[type]

    @abstractmethod
    def length(self, numbers: object) -> Number:
        """How long the path takes [s]: the flight's duration, unless the mission says another."""

    @abstractmethod
    def reference(self, t: Number, numbers: object) -> Reference:
        """The wanted motion at time t [s], also after the path's end."""
