"""Dryden turbulence at low altitude (MIL-F-8785C): gusts along the mean wind, across it and vertical.

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
from typing import NamedTuple

from quadstep.numbers import Number, Vector, exp, log, sqrt, vector, where

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
