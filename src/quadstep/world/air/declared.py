"""A wind in your own file, which missions of real vehicles name.

    [wind]
    type = "my_wind.py:Thermal"

Its numbers are a `NamedTuple` of declarations (`interfaces/gain.py`), from which the keys of `[wind]` follow.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from quadstep.interfaces.closed_loop import Clock
from quadstep.numbers import Number, Vector


@dataclass(frozen=True)
class DeclaredWind(ABC):
    """An `Air`; structure only, so it has no fields. Its numbers are `p.wind`, the words of its noise `p.key`.

    Numbers: declared, each with a default. stirs: whether it has a state, such as that of a
    noise filter.

    >>> from types import SimpleNamespace
    >>> from typing import NamedTuple
    >>> from quadstep.world.air.declared import DeclaredWind
    >>> from quadstep.interfaces.gain import gain
    >>> from quadstep.numbers import vector
    >>> class ThermalNumbers(NamedTuple):
    ...     strength: float = gain(2.0, "m/s", "how fast it rises")
    >>> class Thermal(DeclaredWind):
    ...     Numbers = ThermalNumbers
    ...     def wind(self, air, p, time):
    ...         return vector(0.0, 0.0, p.wind.strength)
    >>> Thermal().wind((), SimpleNamespace(wind=ThermalNumbers(3.0)), 0.0)
    Vector([0.0, 0.0, 3.0])
    """

    Numbers: ClassVar[type]
    stirs: ClassVar[bool] = False

    def start(self) -> object:
        """Its state before the first tick."""
        return ()

    def stir(self, air: object, p: object, clock: Clock) -> object:
        """Its state one `simulation.air_period` later; only called if it stirs."""
        return air

    @abstractmethod
    def wind(self, air: object, p: object, time: Number) -> Vector:
        """The wind [m/s] at time t [s], world axes."""
