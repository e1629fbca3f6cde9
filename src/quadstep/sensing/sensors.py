"""What the sensors make of the truth: white noise at every sample, and biases that start anywhere in their range and wander.

Sensor model: Woodman, "An introduction to inertial navigation" (2007): gyro = rates + b_g + n_g, accelerometer = specific
force + b_a + n_a. White noise of density N sampled every T has the standard deviation N / sqrt(T), a random walk of density W
moves by W sqrt(T) in T. A fix, a sample of position, velocity and attitude, has white noise only.

Latency is a shift register of whole samples: what is pushed in comes out a fixed number of pushes later. A line is a plain
tuple of samples, oldest first; its length is structure, so that an empty one costs nothing.

A sensor and an estimator of your own are classes in your file, which missions of real vehicles name:

    [sensors]
    fix = { type = "my_sensing.py:Beacon" }
    estimator = { type = "my_sensing.py:Complementary" }

Their numbers are a `NamedTuple` of declarations (`interfaces/gain.py`), from which the keys of these tables follow.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar, Generic, NamedTuple, cast

from typing_extensions import TypeVar

from quadstep.numbers import Number, Structure, Vector
from quadstep.numbers.noise import Key, normals
from quadstep.numbers.rotations import from_rotation_vector, multiply
from quadstep.vehicle.rigid_body import Motion

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


M = TypeVar("M", default=Any)
"""What an estimator remembers."""


@dataclass(frozen=True)
class DeclaredSensor(ABC):
    """What measures position, velocity and attitude; structure only, so it has no fields. Its numbers are `p.fix`.

    Numbers: declared, each with a default. draws: vectors of three independent normal numbers that a sample takes.
    """

    Numbers: ClassVar[type]
    draws: ClassVar[int] = 3

    @abstractmethod
    def sample(self, truth: Navigation, noise: list[Vector], p: Sensors) -> Navigation:
        """What it says of a true motion, a fix. noise: `draws` vectors."""


@dataclass(frozen=True)
class DeclaredEstimator(ABC, Generic[M]):
    """What puts samples of the IMU and fixes together; structure only, so it has no fields. Its numbers are `p.estimator`.

    What it remembers is any structure of numbers. Fixes speak of `delay` fixes and `lag` samples of the IMU ago, fewer than
    between two fixes. Numbers: declared, each with a default. feels: whether it uses the accelerometer; without it `force` is
    (). current: whether its motion is that of now, however old the last fix is.
    """

    Numbers: ClassVar[type]
    feels: ClassVar[bool] = True
    current: ClassVar[bool] = True

    @abstractmethod
    def start(self, first: Navigation, rates: Vector, force: Structure, p: Sensors, lag: int, delay: int) -> M:
        """The memory before the first sample, with a first fix, the true body rates [rad/s] and the force at rest [m/s^2]."""

    @abstractmethod
    def predict(self, memory: M, gyro: Vector, force: Structure, p: Sensors, period: Number) -> M:
        """After a sample of gyro [rad/s] and accelerometer [m/s^2], `period` [s] after the one before, 0 at the first."""

    @abstractmethod
    def correct(self, memory: M, fix: Navigation, p: Sensors) -> M:
        """After a fix."""

    @abstractmethod
    def motion(self, memory: M) -> Motion:
        """What the controller is told."""

    @abstractmethod
    def force(self, memory: M) -> Structure:
        """The specific force [m/s^2] that it is told where it asks for that."""

    def on_board(self, memory: M) -> Structure:
        """What reaches the controller as late as samples of the IMU do."""
        return self.motion(memory)

    def arrived(self, memory: M, board: Structure) -> Motion:
        """What the controller is told when that, from a while ago, has come."""
        assert isinstance(board, Motion)
        return board


class Samples(NamedTuple):
    """motion: of the last fix, with the gyro's rates. force: the accelerometer's, () where nobody asks for it."""

    motion: Motion
    force: Structure


@dataclass(frozen=True)
class LastSamples(DeclaredEstimator[Samples]):
    """The last fix is held until the next."""

    feels: ClassVar[bool] = False
    current: ClassVar[bool] = False

    def start(self, first: Navigation, rates: Vector, force: Structure, p: Sensors, lag: int, delay: int) -> Samples:
        return Samples(Motion(*first, rates), force)

    def predict(self, memory: Samples, gyro: Vector, force: Structure, p: Sensors, period: Number) -> Samples:
        return Samples(memory.motion._replace(rates=gyro), force)

    def correct(self, memory: Samples, fix: Navigation, p: Sensors) -> Samples:
        return memory._replace(motion=Motion(*fix, memory.motion.rates))

    def motion(self, memory: Samples) -> Motion:
        return memory.motion

    def force(self, memory: Samples) -> Structure:
        return memory.force

    def on_board(self, memory: Samples) -> Vector:
        """The gyro's sample: fixes have a latency of their own."""
        return memory.motion.rates

    def arrived(self, memory: Samples, board: Structure) -> Motion:
        return memory.motion._replace(rates=cast(Vector, board))
