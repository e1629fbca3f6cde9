"""No estimator: the controller is told the last samples of the sensors as they are."""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple, cast

from quadstep.numbers import Number, Structure, Vector
from quadstep.sensing.declared import DeclaredEstimator
from quadstep.sensing.sensors import Navigation, Sensors
from quadstep.vehicle.airframe.motion import Motion


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
