"""Effects of moving air: drag of body and rotors, translational lift, flapping, and ground effect.

The formulas are those of RotorPy 3.0.0 (Folk, Paulos and Kumar 2023), but flapping has the opposite sign: there a positive
coefficient tips a vehicle towards where it flies.
"""

from typing import NamedTuple

from quadstep.numbers import Matrix, Number, Vector, maximum


class Drag(NamedTuple):
    """Coefficients.

    parasitic: C, on the square of the airspeed, along body axes [N s^2/m^2]. rotor: (k_d, k_d, k_z) of one rotor, in its disc
    and along its axis [N s^2/(m rad)]. flapping: k_flap [N m s^2/(m rad)]. translational_lift: k_h [N s^2/m^2].
    """

    parasitic: Vector
    rotor: Vector
    flapping: Number
    translational_lift: Number


def parasitic_drag(drag: Drag, air: Vector) -> Vector:
    """Force on the body [N]: -|v| C v, v its velocity through the air `air` [m/s]; body axes."""
    return drag.parasitic * (-air.norm() * air)


def hub_drag(drag: Drag, frame: Matrix, flow: Vector) -> Vector:
    """Force on a rotor's hub [N]: -K w v, with K = diag(k_d, k_d, k_z) in the rotor's axes; body axes.

    frame: the rotor's axes as rows. flow: w v, the rotor's speed times the velocity of its hub through the air [m rad/s^2].
    """
    return -(frame.T @ (drag.rotor * (frame @ flow)))


def translational_lift(drag: Drag, frame: Matrix, air: Vector) -> Number:
    """Thrust that a rotor gains by moving across the air [N]: k_h (v_x^2 + v_y^2), v in the rotor's axes.

    frame: these as rows. air: v, velocity of the hub through the air [m/s], body axes.
    """
    x, y, _ = frame @ air
    return drag.translational_lift * (x * x + y * y)


def ground_effect(height: Number, radius: Number) -> Number:
    """Thrust over thrust far from the ground: 1 / (1 - (R / 4z)^2) (Cheeseman and Bennett 1955), z held above R / 2.

    height: of the rotor above the ground [m]. The ratio is 4/3 at most and fades as z^-2: 1.016 at 2 R, 1.0006 at 10 R.
    """
    held = maximum(height, 0.5 * radius)
    square = 16.0 * (held * held)
    return square / (square - radius * radius)
