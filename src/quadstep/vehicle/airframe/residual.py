"""A small network that adds to a vehicle's laws: accelerations that flights show and the laws do not explain."""

from typing import NamedTuple

from quadstep.numbers import Matrix, Number, Vector, sigmoid, total

INPUTS, OUTPUTS = 7, 6
"""Velocity through the air and rates in body axes, mean rotor speed; angular acceleration and acceleration in body axes."""


class Residual(NamedTuple):
    """One hidden layer: outputs @ sigmoid(inputs @ x + biases) + offsets, x in SI units.

    inputs: (hidden, 7). biases: (hidden). outputs: (6, hidden). offsets: (6). The first three outputs are an angular
    acceleration [rad/s^2], the others an acceleration [m/s^2].
    """

    inputs: Matrix
    biases: Vector
    outputs: Matrix
    offsets: Vector


def accelerations(net: Residual, air: Vector, rates: Vector, speeds: Vector) -> tuple[Vector, Vector]:
    """Angular acceleration [rad/s^2] and acceleration [m/s^2], body axes.

    air: velocity of the body through the air [m/s], rates [rad/s], both in body axes. speeds: of the rotors [rad/s].
    """
    mean: Number = total(speeds) * (1.0 / len(speeds))
    before = net.inputs @ Vector((*air, *rates, mean)) + net.biases
    found = net.outputs @ Vector(sigmoid(one) for one in before) + net.offsets
    return Vector(found[i] for i in range(3)), Vector(found[i] for i in range(3, 6))
