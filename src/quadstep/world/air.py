"""The wind a vehicle flies in: steady, swinging, in a gust, turbulent.

Turbulence is Dryden's at low altitude (MIL-F-8785C): gusts along the mean wind, across it and vertical.
At height h [ft]: lengths L_w = h, L_u = L_v = h / (0.177 + 0.000823 h)^1.2, standard deviations sigma_w = 0.1 W_20,
sigma_u = sigma_v = sigma_w / (0.177 + 0.000823 h)^0.4. A field frozen in space passes at V, so with tau = L / V the spectra,
one-sided over angular frequency w, are

    u:        sigma^2 (2 tau / pi) / (1 + (tau w)^2)
    v and w:  sigma^2 (tau / pi) (1 + 3 (tau w)^2) / (1 + (tau w)^2)^2,

those of white noise through sqrt(2 tau) / (1 + tau s) and sqrt(tau) (1 + sqrt(3) tau s) / (1 + tau s)^2.

In time t / tau both are made of z1' = -z1 + noise, z2' = -z2 + z1: u is sigma sqrt(2) z1, and v and w are
sigma (sqrt(3) z1 + (1 - sqrt(3)) z2). A step solves these exactly over its period, noise and all, so that neither variance nor
spectrum depends on the period; the first step draws the state from its stationary distribution.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, NamedTuple, Protocol

from quadstep.interfaces.closed_loop import Clock
from quadstep.numbers import Number, Vector, absolute, clip, cos, exp, log, sin, sqrt, total, vector, where
from quadstep.numbers.kinds import Condition
from quadstep.numbers.noise import Key, normals
from quadstep.numbers.scan import shortcut

FEET = 1.0 / 0.3048
"""In a metre."""

DRAWS = 5
"""Normal numbers a step takes: one for u, two each for v and w."""

FOR_EVER = 50.0
"""Time over tau after which nothing is left of a state."""


class Dryden(NamedTuple):
    """wind_20: W_20, speed of the mean wind at 20 ft [m/s]. height: h [m]. airspeed: V, at which the field passes [m/s]; in
    a `Wind`, 0 stands for the speed of its mean.
    """

    wind_20: Number
    height: Number
    airspeed: Number


class Turbulence(NamedTuple):
    """begun: 0 before the first step, then 1. along: z1 of u [m/s]. across, vertical: (z1, z2) of v and w [m/s]."""

    begun: Number
    along: Number
    across: Vector
    vertical: Vector


def start_turbulence() -> Turbulence:
    """Calm; the first step draws a state."""
    return Turbulence(0.0, 0.0, vector(0.0, 0.0), vector(0.0, 0.0))


def scales(dryden: Dryden) -> tuple[Vector, Vector]:
    """((L_u, L_v, L_w) [m], (sigma_u, sigma_v, sigma_w) [m/s])."""
    shape = log(0.177 + 0.000823 * FEET * dryden.height)
    length = dryden.height * exp(-1.2 * shape)
    vertical = 0.1 * dryden.wind_20
    level = vertical * exp(-0.4 * shape)
    return vector(length, length, dryden.height), vector(level, level, vertical)


def turbulence_step(memory: Turbulence, dryden: Dryden, draws: Vector, period: Number) -> Turbulence:
    """The state `period` [s] later. draws: `DRAWS` independent normal numbers."""
    lengths, sigmas = scales(dryden)
    path = period * dryden.airspeed
    h_u, h_v, h_w = (where(memory.begun > 0.0, path / length, FOR_EVER) for length in lengths)
    u, v1, v2, w1, w2 = draws
    return Turbulence(
        begun=1.0,
        along=second_order(vector(memory.along, 0.0), h_u, sigmas[0] * vector(u, 0.0))[0],
        across=second_order(memory.across, h_v, sigmas[1] * vector(v1, v2)),
        vertical=second_order(memory.vertical, h_w, sigmas[2] * vector(w1, w2)),
    )


def second_order(z: Vector, h: Number, draws: Vector) -> Vector:
    """(z1, z2) after the time h = T / tau; draws: two independent normal numbers times sigma.

    Transition e^-h [[1, 0], [h, 1]]; the noise has the covariances q11 = P(1, 2h) / 2, q12 = P(2, 2h) / 4, q22 = P(3, 2h) / 4
    and is drawn by their Cholesky factor.
    """
    first, second, third = gamma_tails(2.0 * h)
    l11 = sqrt(0.5 * first)
    l21 = 0.25 * second / where(h > 0.0, l11, 1.0)
    square = 0.25 * third - l21 * l21
    l22 = sqrt(where(square > 0.0, square, 0.0))
    decay = exp(-h)
    z1, z2 = z
    return vector(decay * z1 + l11 * draws[0], decay * (h * z1 + z2) + (l21 * draws[0] + l22 * draws[1]))


def gamma_tails(x: Number) -> tuple[Number, Number, Number]:
    """P(n, x) = e^-x (x^n / n! + x^(n+1) / (n+1)! + ...) for n = 1, 2, 3: the regularised incomplete gamma functions, x >= 0.

    For small x, where 1 - e^-x (1 + x + x^2 / 2) would lose its digits, the third is summed.
    """
    decay = exp(-x)
    rest = 1.0
    for k in range(11, 3, -1):
        rest = 1.0 + rest * x * (1.0 / k)
    third = where(x < 0.25, decay * (x * x * x * (1.0 / 6.0)) * rest, 1.0 - decay * (1.0 + x + 0.5 * x * x))
    second = third + decay * (0.5 * x * x)
    return second + decay * x, second, third


def gusts(memory: Turbulence) -> Vector:
    """(u, v, w): along the mean wind, to its left, up [m/s]."""
    root = math.sqrt(3.0)
    shape = vector(root, 1.0 - root)
    return vector(math.sqrt(2.0) * memory.along, shape @ memory.across, shape @ memory.vertical)


@dataclass(frozen=True)
class DeclaredWind(ABC):
    """An `Air` in your own file; structure only, so it has no fields. Its numbers are `p.wind`, the words of its
    noise `p.key`.

        [wind]
        type = "my_wind.py:Thermal"

    Numbers: a `NamedTuple` of declarations (`interfaces/gain.py`), each with a default, from which the keys of `[wind]`
    follow. stirs: whether it has a state, such as that of a
    noise filter.

    >>> from types import SimpleNamespace
    >>> from typing import NamedTuple
    >>> from quadstep.world.air import DeclaredWind
    >>> from quadstep.interfaces.gain import gain
    >>> from quadstep.numbers import vector
    >>> class ThermalNumbers(NamedTuple):
    ...     strength: float = gain(2.0, "m/s", "how fast it rises")
    >>> class Thermal(DeclaredWind):
    ...     Numbers = ThermalNumbers
    ...     def wind(self, air, p, time, truth):
    ...         return vector(0.0, 0.0, p.wind.strength)
    >>> Thermal().wind((), SimpleNamespace(wind=ThermalNumbers(3.0)), 0.0, None)
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
    def wind(self, air: object, p: object, time: Number, truth: object) -> Vector:
        """The wind [m/s] at time t [s], world axes. truth: the vehicle's motion, of which `position` [m] says where."""


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
    still = shortcut((wind, t), steady, untroubled)
    x, y = direction(wind.mean)
    u, v, w = gusts(memory)
    return still + vector(x * u - y * v, y * u + x * v, w)


def untroubled(given: tuple[Wind, Number]) -> Vector:
    """The same without turbulence: mean, swing and gust."""
    wind, t = given
    since = clip((t - wind.gust_start) / wind.gust_length, 0.0, 1.0)
    gust = 0.5 * (1.0 - cos(2.0 * math.pi * since))
    return wind.mean + sin(wind.swing_frequency * t) * wind.swing + gust * wind.gust


def steady(given: tuple[Wind, Number]) -> tuple[Condition, Vector]:
    """What is left of it without swing and gust."""
    wind, t = given
    changing = total(absolute(one) for one in (*wind.swing, *wind.gust))
    return (changing <= 0.0) & (absolute(wind.swing_frequency * t) < 1e4) & (wind.gust_length > 0.0), wind.mean


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
        return start_turbulence()

    def stir(self, air: Turbulence, p: Windy, clock: Clock) -> Turbulence:
        return turbulence_step(air, field(p.wind), normals(p.key, TURBULENCE_STREAM, clock.tick, DRAWS), clock.period)

    def wind(self, air: Turbulence, p: Windy, time: Number, truth: object) -> Vector:
        """The wind [m/s] at time t [s], world axes; the same everywhere."""
        return wind_at(p.wind, air, time)
