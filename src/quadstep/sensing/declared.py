"""A sensor and an estimator in your own file, which missions of real vehicles name.

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
from quadstep.sensing.sensors import Navigation, Sensors
from quadstep.vehicle.airframe.motion import Motion

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
