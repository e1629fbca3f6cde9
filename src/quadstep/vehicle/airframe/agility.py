"""How fast the loops of a vehicle can be: from its rotors' lag and torque, and from all delay in its loop.

Gains over mass and inertia leave a loop that depends on time alone. With rotors of lag T and a delay D it is, about a
horizontal axis,

    gain / s^n  exp(-D s) / (1 + T s),

so gains in proportion to 1 / (T + `DELAYS` D), each to the power of its time unit, have like margins on all vehicles. Fixes of
position, velocity and attitude that are older than the gyro's samples by L do not delay the loop of the body rates, which only
has to stand two further delays; those around it are slower by the phase of L, 1 / all = 1 / rates + L / `AROUND`.

About the vertical axis rotors turn a vehicle twice: by their drag 2 k_m w_0 dw and, accelerating, by their own inertia,
J_r dw/dt:

    gain / s^n  exp(-D s) (1 + T_r s) / (1 + T s),    T_r = J_r / (2 k_m w_0),

which above 1 / T multiplies the loop by T_r / T.
"""

from typing import NamedTuple

from quadstep.numbers import Number, Vector, maximum, minimum, sqrt, total
from quadstep.vehicle.airframe.allocation import Allocation, allocate
from quadstep.vehicle.airframe.geometry import Geometry
from quadstep.vehicle.airframe.plant import Airframe

LIVELY = 60.0
"""Angular acceleration about a horizontal body axis that suffices for the default gains [rad/s^2]."""

DELAYS = 3.0
"""How much more a second of delay counts than one of lag: the margins asked for include two further delays."""

AGES, OLDEST = 0.7, 0.021
"""The same for a second by which fixes are older than the gyro's samples, in the loop of the body rates, and the largest
product of that age and `rates` [s]: of the pi/2 that this loop has, with a gain of 30 1/s, twice that age then takes 1.3.
"""

AROUND = 0.07
"""Age of fixes that halves the speed of loops around a loop of rates of speed 1 [s]."""

LATE = 0.001
"""Delay of the vehicle on which the default gains were found [s]: half of a sample of 2 ms."""

LAG = 0.04
"""Lag of its rotors [s]."""

TURNING = 0.02
"""Largest product of `yaw` and the sum of the delay times T_r / T and the age of fixes times its root [s]: with the largest
default gain on the yaw rate, 20 1/s, the loop of that rate then crosses at most 0.4 rad over the delay. Late fixes delay only
the heading, but two further delays, which that rate's loop has to stand, are longer the later they are.
"""


class Agility(NamedTuple):
    """Speeds of the loops relative to the vehicle on which the default gains were found, in (0, 1].

    all: of position, roll and pitch. rates: of the body rates within them. yaw: of the heading.
    """

    all: Number
    rates: Number
    yaw: Number


def agility(geometry: Geometry, airframe: Airframe, allocation: Allocation, delay: Number, stale: Number) -> Agility:
    """How fast the loops can be.

    delay: from a sample of the gyro to the rotors' command [s], half of the law's period included. stale: how much older
    position, velocity and attitude are [s].
    """
    weight, enough = airframe.mass * airframe.gravity, 1e3 * LIVELY
    turns = []
    for axis in range(2):
        torque = [0.0, 0.0, 0.0]
        torque[axis] = enough * airframe.inertia[axis]
        _, _, made = allocate(geometry, allocation, weight, Vector(torque))
        turns.append(made[axis] / airframe.inertia[axis])
    rotor = airframe.rotor
    lag, shortest = maximum(rotor.rise, rotor.fall), minimum(rotor.rise, rotor.fall)
    quick = (LAG + DELAYS * LATE) / (lag + DELAYS * delay + AGES * stale)
    quick = minimum(minimum(1.0, quick), OLDEST / maximum(stale, 1e-9))
    rates = minimum(quick, sqrt(minimum(*turns) / LIVELY))
    fast = rates / (1.0 + rates * stale / AROUND)
    speeds, _, _ = allocate(geometry, allocation, weight, Vector((0.0, 0.0, 0.0)))
    hover = total(speeds) / len(geometry.mounts)
    lead = maximum(1.0, rotor.inertia / (2.0 * rotor.torque * hover * shortest))
    return Agility(fast, rates, minimum(fast, TURNING / maximum(lead * delay + sqrt(lead) * stale, 1e-9)))
