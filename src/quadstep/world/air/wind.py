"""The wind a vehicle flies in: steady, swinging, in a gust, turbulent."""

import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from quadstep.interfaces.closed_loop import Clock
from quadstep.numbers import Number, Vector, clip, cos, sin, sqrt, vector, where
from quadstep.numbers.noise import Key, normals
from quadstep.world.air.dryden import DRAWS, Dryden, Turbulence, gusts, start_turbulence, turbulence_step

__all__ = ["DRAWS", "Dryden", "MovingAir", "Turbulence", "Wind", "start_turbulence", "turbulence_step", "wind_at"]

TURBULENCE_STREAM = 0


class Wind(NamedTuple):
    """The mean, what is added to it at known times, and turbulence; velocities of the air in world axes.

    mean [m/s]. swing [m/s], times the sine of swing_frequency [rad/s] times t. gust: peak [m/s] of a 1-cosine gust, which
    begins at gust_start [s] and is over gust_length [s] later. turbulence: its field, with the mean's direction.
    """

    mean: Vector
    swing: Vector
    swing_frequency: Number
    gust: Vector
    gust_start: Number
    gust_length: Number
    turbulence: Dryden


def wind_at(wind: Wind, memory: Turbulence, t: Number) -> Vector:
    """Velocity of the air at time t [s] [m/s], world axes.

    Of the turbulence (u, v, w) u blows along the level part of the mean wind, along x where there is none, v to the left of
    it and w up.
    """
    since = clip((t - wind.gust_start) / wind.gust_length, 0.0, 1.0)
    gust = 0.5 * (1.0 - cos(2.0 * math.pi * since))
    steady = wind.mean + sin(wind.swing_frequency * t) * wind.swing + gust * wind.gust
    x, y = direction(wind.mean)
    u, v, w = gusts(memory)
    return steady + vector(x * u - y * v, y * u + x * v, w)


def field(wind: Wind) -> Dryden:
    """The field of gusts, which the mean wind carries past the vehicle if nothing else is said."""
    stated = wind.turbulence.airspeed
    return wind.turbulence._replace(airspeed=where(stated > 0.0, stated, wind.mean.norm()))


def direction(mean: Vector) -> Vector:
    """Unit vector (x, y) of the level part of the mean wind; x where there is none."""
    x, y, _ = mean
    level = sqrt(x * x + y * y)
    windy = level > 0.0
    over = 1.0 / where(windy, level, 1.0)
    return vector(where(windy, over * x, 1.0), over * y)


class Windy(Protocol):
    """A flight's parameters with wind and the key of its noise."""

    @property
    def wind(self) -> Wind: ...
    @property
    def key(self) -> Key: ...


@dataclass(frozen=True)
class MovingAir:
    """The wind of a flight: its numbers are `p.wind`, its noise comes from `p.key`. stirs: whether it is turbulent."""

    stirs: bool = False

    def start(self) -> Turbulence:
        """Calm."""
        return start_turbulence()

    def stir(self, air: Turbulence, p: Windy, clock: Clock) -> Turbulence:
        """The turbulence one period later."""
        return turbulence_step(air, field(p.wind), normals(p.key, TURBULENCE_STREAM, clock.tick, DRAWS), clock.period)

    def wind(self, air: Turbulence, p: Windy, time: Number) -> Vector:
        """The wind [m/s] at time t [s], world axes."""
        return wind_at(p.wind, air, time)
