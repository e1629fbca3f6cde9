"""What the sensors make of the truth: white noise at every sample, and biases that start anywhere in their range and wander.

Sensor model: Woodman, "An introduction to inertial navigation" (2007): gyro = rates + b_g + n_g, accelerometer = specific
force + b_a + n_a. White noise of density N sampled every T has the standard deviation N / sqrt(T), a random walk of density W
moves by W sqrt(T) in T. A fix, a sample of position, velocity and attitude, has white noise only.

Latency is a shift register of whole samples: what is pushed in comes out a fixed number of pushes later. A line is a plain
tuple of samples, oldest first; its length is structure, so that an empty one costs nothing.
"""

from typing import NamedTuple, TypeVar

from quadstep.numbers import Number, Vector
from quadstep.numbers.noise import Key, normals
from quadstep.numbers.rotations import from_rotation_vector, multiply
from quadstep.vehicle.airframe.motion import Motion

S = TypeVar("S")


def filled(sample: S, count: int) -> tuple[S, ...]:
    """A line of `count` samples that has seen only this one. A sample is any structure of numbers."""
    return (sample,) * count


def pushed(line: tuple[S, ...], sample: S) -> tuple[S, ...]:
    """The line one sample later; its oldest is gone."""
    return (*line, sample)[1:]


def passed(line: tuple[S, ...], sample: S) -> tuple[tuple[S, ...], S]:
    """The line one sample later, and the sample that comes out: the one pushed `len(line)` pushes ago."""
    return pushed(line, sample), (*line, sample)[0]


IMU = 16
"""Stream of the samples of the IMU: three numbers for the gyro, then three for the accelerometer."""

FIX = 17
"""Stream of the fixes: three numbers each for position, velocity, attitude, steps of the gyro's and accelerometer's biases."""

START = 18
"""Stream of the start: nine numbers for the first fix, three each for both biases. Streams below 16 are the air's."""


class Sensors(NamedTuple):
    """Sizes of the noise of every sensor, the same for its three axes.

    gyro_noise: density [rad/s/sqrt(Hz)]. gyro_bias: standard deviation of its start [rad/s]. gyro_walk: density of its random
    walk [rad/s^2/sqrt(Hz)]. accelerometer_noise [m/s^2/sqrt(Hz)], accelerometer_bias [m/s^2], accelerometer_walk
    [m/s^3/sqrt(Hz)]: likewise. position_noise [m], velocity_noise [m/s], attitude_noise (a small turn about body axes) [rad]:
    standard deviation in one fix. gravity: what the estimator takes for it [m/s^2]. fix, estimator: numbers of a sensor and an
    estimator of the user's own.
    """

    gyro_noise: Number
    gyro_bias: Number
    gyro_walk: Number
    accelerometer_noise: Number
    accelerometer_bias: Number
    accelerometer_walk: Number
    position_noise: Number
    velocity_noise: Number
    attitude_noise: Number
    gravity: Number
    fix: object = ()
    estimator: object = ()

    @property
    def sizes(self) -> tuple[Number, ...]:
        return self[:9]

    @property
    def densities(self) -> tuple[Number, Number]:
        """Of the white noise of gyro and accelerometer."""
        return self.gyro_noise, self.accelerometer_noise

    @property
    def biases(self) -> tuple[Number, Number]:
        """What gyro and accelerometer start from, standard deviations."""
        return self.gyro_bias, self.accelerometer_bias

    @property
    def walks(self) -> tuple[Number, Number]:
        """Densities of the random walk of both biases."""
        return self.gyro_walk, self.accelerometer_walk


class Navigation(NamedTuple):
    """A navigation state: what a fix measures, and what an estimator estimates.

    position [m], velocity [m/s]: world. attitude: unit quaternion (w, x, y, z), body to world.
    """

    position: Vector
    velocity: Vector
    attitude: Vector


def navigation(motion: Motion) -> Navigation:
    return Navigation(motion.position, motion.velocity, motion.attitude)


def draws(key: Key, stream: int, tick: Number, count: int) -> list[Vector]:
    """`count` vectors of three independent normal numbers; asking for fewer gives the first of them.

    All that is drawn at once comes from one stream, because the generator makes its numbers in pairs.
    """
    numbers = normals(key, stream, tick, 3 * count).entries
    return [Vector(numbers[place : place + 3]) for place in range(0, 3 * count, 3)]


def fixed(truth: Navigation, sensors: Sensors, noise: list[Vector]) -> Navigation:
    """A fix, from three vectors of normal numbers."""
    position, velocity, attitude = noise
    return Navigation(
        truth.position + sensors.position_noise * position,
        truth.velocity + sensors.velocity_noise * velocity,
        multiply(truth.attitude, from_rotation_vector(sensors.attitude_noise * attitude)),
    )
