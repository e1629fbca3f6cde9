"""The lab's baseline: a spring and a damper to the path, and to the attitude."""

from dataclasses import dataclass
from typing import NamedTuple

from quadstep.own import (
    Command,
    Controller,
    Measured,
    Number,
    Vector,
    believed,
    desired_attitude,
    gain,
    given,
    rotation_matrix,
    up_axis,
    vector,
    vee_error,
)


class Gains(NamedTuple):
    """What a mission may say of it."""

    mass: Number = believed("mass")
    inertia: Vector = believed("inertia")
    gravity: Number = given(lambda model: model.gravity)
    k_p: Number = gain(6.0, "1/s^2", "position")
    k_v: Number = gain(4.0, "1/s", "velocity")


@dataclass(frozen=True)
class Hold(Controller):
    """No memory: the same error gives the same command."""

    name = "hold"
    Gains = Gains
    measures = Measured

    def start(self, measured, gains):
        """Nothing to remember."""
        return ()

    def law(self, memory, measured, reference, gains, t, period):
        """One sample."""
        zero, rotation = vector(0.0, 0.0, 0.0), rotation_matrix(measured.attitude)
        pull = gains.k_p * (reference.position - measured.position) + gains.k_v * (reference.velocity - measured.velocity)
        force = gains.mass * (reference.acceleration + pull + vector(0.0, 0.0, gains.gravity))
        attitude = desired_attitude(force, zero, zero, reference.yaw, 0.0).rotation
        torque = gains.inertia * (-120.0 * vee_error(attitude, rotation) - 18.0 * measured.rates)
        return Command(force @ up_axis(rotation), torque), memory
