"""The vehicle model for controllers: the numbers from which default gains are computed."""

import math
from enum import StrEnum
from typing import NamedTuple

from quadstep.numbers import Number, Vector, vector

MARGIN = 0.85
"""Share of all rotors' thrust that a position loop may ask for; the rest is for turning."""


class Kinematics(StrEnum):
    """Which T_eta is meant. They differ only where the inertias are unequal.

    STANDARD: rows 2 and 3 hold theta and roll, as Newton-Euler demands for R = Rz(psi) Ry(theta) Rx(phi).
    PRINTED: they hold theta and yaw, as the paper prints.
    RIGID: of R = Rx(-phi) Ry(-theta) Rz(-psi), to which the paper's thrust direction (Eq. 7) belongs: with it, and only with
    it, the whole plant is a rigid body pushed along its own z axis. Holds theta and yaw.
    """

    STANDARD = "standard"
    PRINTED = "printed"
    RIGID = "rigid"

    @property
    def angle(self) -> int:
        """Place in eta = (psi, theta, phi) of the angle that T_eta holds beside theta."""
        return 2 if self is Kinematics.STANDARD else 0


class Model(NamedTuple):
    """A vehicle as its controller models it; SI units.

    mass [kg], inertia: diagonal [kg m^2], gravity [m/s^2]. most_thrust: the largest that a position loop may command [N];
    infinite if the rotors have no limits. agility: speed of the loops relative to the 2.6 kg vehicle, in (0, 1];
    rate_agility: of that of the body rates within them; yaw_agility: of the loop of the heading. rotors: their number.
    lag: the longer time constant of a rotor [s]. kinematics: T_eta of the paper's plant; that of a rigid body elsewhere.

    Of a real vehicle also: mixing: four rows, thrust [N] and torques about body x, y, z [N m] per newton of each rotor.
    shares: a row for each rotor, its thrust per unit of thrust and torques, of least norm. per_speed: k_f, a rotor's thrust
    over the square of its speed [N s^2]. slowest, fastest: of a rotor [rad/s]. drag: of all rotors as they turn in hover,
    along body x, y, z, over mass [1/s]. lift: the thrust that they gain by moving across the air, over mass and the square
    of the speed [1/m].
    """

    mass: Number
    inertia: Vector
    gravity: Number
    most_thrust: Number = math.inf
    agility: Number = 1.0
    rate_agility: Number = 1.0
    yaw_agility: Number = 1.0
    rotors: int = 4
    lag: Number = 0.0
    kinematics: Kinematics = Kinematics.RIGID
    mixing: tuple[Vector, ...] = ()
    shares: tuple[Vector, ...] = ()
    per_speed: Number = math.nan
    slowest: Number = math.nan
    fastest: Number = math.nan
    drag: Vector = vector(0.0, 0.0, 0.0)
    lift: Number = 0.0
