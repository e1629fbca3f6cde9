"""Closed curves: circle and figure eight, as one harmonic an axis, entered smoothly."""

from dataclasses import dataclass
from typing import NamedTuple

from quadstep.interfaces.reference import Reference
from quadstep.numbers import Number, Vector, clip, cos, sin, where
from quadstep.world.guidance.minimum_jerk import blend, blend_bend


class OrbitParameters(NamedTuple):
    """Axis i follows centre_i + amplitude_i sin(frequency_i s + phase_i), s the time flown at full speed [s].

    centre, amplitude [m]; frequency [rad/s]; phase [rad]; yaw at the start [rad]; yaw_rate at full speed [rad/s];
    ramp: seconds over which the speed along the curve rises from rest (0: at full speed at once).
    """

    centre: Vector
    amplitude: Vector
    frequency: Vector
    phase: Vector
    yaw: Number
    yaw_rate: Number
    ramp: Number


def ramped_time(t: Number, ramp: Number) -> tuple[Number, Number, Number]:
    """Time along the curve [s] at clock time t [s], its rate (0 to 1) and the rate of that [1/s].

    The rate rises as the minimum-jerk blend, whose integral over the ramp T is T (5/2 w^4 - 3 w^5 + w^6), w = t / T.
    """
    length = where(ramp > 0.0, ramp, 1.0)
    w = clip(t / length, 0.0, 1.0)
    share, change, _ = blend(t, length)
    entering = length * (w * w * w * w * (2.5 + w * (w - 3.0)))
    s = where(t < length, entering, t - 0.5 * length)
    instant = ramp <= 0.0
    return where(instant, t, s), where(instant, 1.0, share), where(instant, 0.0, change)


def ramp_bend(t: Number, ramp: Number) -> tuple[Number, Number]:
    """Third [1/s^2] and fourth [1/s^3] rate of the time along the curve: second and third of the blend."""
    length = where(ramp > 0.0, ramp, 1.0)
    _, _, third = blend(t, length)
    fourth, _ = blend_bend(t, length)
    instant = ramp <= 0.0
    return where(instant, 0.0, third), where(instant, 0.0, fourth)


@dataclass(frozen=True)
class Orbit:
    """A circle (equal frequencies, phases a quarter turn apart) or a figure eight (one axis at twice the frequency).

    >>> from quadstep.world.guidance import Orbit, OrbitParameters
    >>> from quadstep.numbers import vector
    >>> zero, rate, quarter = vector(0.0, 0.0, 0.0), vector(0.5, 0.5, 0.5), vector(1.5707963267948966, 0.0, 0.0)
    >>> circle = OrbitParameters(zero, vector(2.0, 2.0, 0.0), rate, quarter, yaw=0.0, yaw_rate=0.0, ramp=0.0)
    >>> start = Orbit().reference(0.0, circle)
    >>> start.position, start.velocity[1]
    (Vector([2.0, 0.0, 0.0]), 1.0)
    """

    def reference(self, t: Number, parameters: OrbitParameters) -> Reference:
        """The wanted motion at time t [s], repeated for ever."""
        s, rate, change = ramped_time(t, parameters.ramp)
        third, fourth = ramp_bend(t, parameters.ramp)
        angle = s * parameters.frequency + parameters.phase
        sine, cosine = Vector(sin(a) for a in angle), Vector(cos(a) for a in angle)
        along = parameters.amplitude * parameters.frequency * cosine
        bend = -(parameters.amplitude * parameters.frequency * parameters.frequency * sine)
        squares = parameters.frequency * parameters.frequency
        back, over = -(squares * along), -(squares * bend)  # third and fourth rate along the curve
        return Reference(
            position=parameters.centre + parameters.amplitude * sine,
            velocity=rate * along,
            acceleration=(rate * rate) * bend + change * along,
            yaw=parameters.yaw + parameters.yaw_rate * s,
            yaw_rate=parameters.yaw_rate * rate,
            # chain rule for the third and fourth rate of a curve run through at a changing speed
            jerk=(rate * rate * rate) * back + (3.0 * rate * change) * bend + third * along,
            snap=(rate * rate * rate * rate) * over
            + (6.0 * rate * rate * change) * back
            + (3.0 * change * change + 4.0 * rate * third) * bend
            + fourth * along,
            yaw_acceleration=parameters.yaw_rate * change,
        )
