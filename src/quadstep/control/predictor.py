"""A predictor for any controller: delayed measurements are carried forward to the present.

A fix speaks of an instant some time ago. Gyro and accelerometer have been sampled since, so attitude, velocity and position
now follow from it by dead reckoning, `age` [s] long:

    R_dot = R hat(W),    v_dot = R f - g e3,    p_dot = v
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from quadstep.interfaces.controller import NOTHING, Condition, Controller, Measured
from quadstep.interfaces.gain import cached_by_class
from quadstep.interfaces.plant import Model, Reference
from quadstep.numbers import Number, Vector, clip, minimum, vector
from quadstep.numbers.rotations import from_rotation_vector, multiply, rotate
from quadstep.numbers.scan import repeated

NEEDS = "specific_force", "age"
"""What the predictor measures, beside what the controller does."""


class ImuSample(NamedTuple):
    """Of gyro [rad/s] and accelerometer [m/s^2], body axes, told at a time [s]."""

    rates: Vector
    force: Vector
    time: Number


class PredictingMemory(NamedTuple):
    """law: of the controller. past: the samples that it was told at its last instants, oldest first."""

    law: object
    past: tuple[ImuSample, ...]


class MeasuredMotion(NamedTuple):
    """Position [m], velocity [m/s] in the world, attitude (quaternion)."""

    position: Vector
    velocity: Vector
    attitude: Vector


class ImuSpan(NamedTuple):
    """What is known at its beginning; rates [rad/s] and specific force [m/s^2] that are held; how long [s]."""

    known: MeasuredMotion
    rates: Vector
    force: Vector
    period: Number


def carried(span: ImuSpan, gravity: float) -> MeasuredMotion:
    """What follows for its end; the force acts in the attitude half-way. gravity [m/s^2]."""
    known, rates, force, period = span
    half = from_rotation_vector((0.5 * period) * rates)
    middle = multiply(known.attitude, half)
    acceleration = rotate(middle, force) - vector(0.0, 0.0, gravity)
    return MeasuredMotion(
        known.position + period * known.velocity + (0.5 * period * period) * acceleration,
        known.velocity + period * acceleration,
        multiply(middle, half),
    )


def predicted(
    past: Sequence[ImuSample], now: ImuSample, known: MeasuredMotion, age: Number, board_late: float, gravity: float
) -> MeasuredMotion:
    """What was known `age` [s] ago, carried forward to now: through the samples since, and the last `board_late` [s], of which
    none has come yet, with the newest. No further than to the start of the flight.
    """
    left = minimum(age, now.time)
    waiting = minimum(left, board_late)
    left = left - waiting
    spans: list[tuple[Vector, Vector, Number]] = []
    samples = (*past, now)
    for older, newer in zip(samples[-2::-1], samples[:0:-1], strict=True):  # newest first
        span = clip(left, 0.0, newer.time - older.time)
        spans.append((0.5 * (older.rates + newer.rates), 0.5 * (older.force + newer.force), span))
        left = left - span
    if board_late > 0.0:
        spans.insert(0, (now.rates, now.force, waiting))

    def step(span: ImuSpan) -> MeasuredMotion:
        return carried(span, gravity)

    later = repeated(step)
    for rates, force, span in reversed(spans):
        known = later(ImuSpan(known, rates, force, span))
    return known


@dataclass(frozen=True)
class Predicting(Controller[PredictingMemory, Measured, object, object]):
    """A controller that is told what is predicted for now.

    flown: the controller. samples: how many of those before now are kept. board_late: how late gyro and accelerometer are
    told [s]. gravity [m/s^2].
    """

    flown: Controller
    samples: int
    board_late: float
    gravity: float

    Flown: ClassVar[type[Controller]]

    @classmethod
    def loops(cls) -> tuple[str, ...]:
        return cls.Flown.loops()

    @property
    def unwrapped(self) -> Controller:
        return self.flown

    def instead(self, other: Controller) -> Controller:
        return predicting(type(other))(other, self.samples, self.board_late, self.gravity)

    def start(self, measured: Measured, gains: object) -> PredictingMemory:
        """The vehicle has been as it is."""
        begin = ImuSample(measured.rates, measured.specific_force, 0.0)
        return PredictingMemory(self.flown.start(self.stripped(measured), gains), (begin,) * self.samples)

    def slower(
        self, loop: str, memory: PredictingMemory, measured: Measured, reference: Reference, gains: object,
        t: Number, period: Number,
    ) -> PredictingMemory:  # fmt: skip
        told = self.now(memory, measured, t)
        return memory._replace(law=self.flown.slower(loop, memory.law, told, reference, gains, t, period))

    def law(
        self, memory: PredictingMemory, measured: Measured, reference: Reference, gains: object, t: Number, period: Number
    ) -> tuple[object, PredictingMemory]:
        command, law = self.flown.law(memory.law, self.now(memory, measured, t), reference, gains, t, period)
        past = (*memory.past, ImuSample(measured.rates, measured.specific_force, t))
        return command, PredictingMemory(law, past[1:])

    def now(self, memory: PredictingMemory, measured: Measured, t: Number) -> Measured:
        known = MeasuredMotion(measured.position, measured.velocity, measured.attitude)
        sample = ImuSample(measured.rates, measured.specific_force, t)
        known = predicted(memory.past, sample, known, measured.age, self.board_late, self.gravity)
        return self.stripped(measured)._replace(**known._asdict())

    def stripped(self, measured: Measured) -> Measured:
        """Without what the controller does not ask for. What it is told has no age."""
        also = self.flown.also_measures
        return measured._replace(
            specific_force=measured.specific_force if "specific_force" in also else NOTHING,
            age=0.0 if "age" in also else Measured._field_defaults["age"],
        )

    def prepare(self, gains: object, model: Model) -> object:
        return self.flown.prepare(gains, model)

    def before_flight(self, measured: Measured, gains: object) -> None:
        self.flown.before_flight(self.stripped(measured), gains)

    def after_flight(self, gains: object) -> None:
        self.flown.after_flight(gains)

    def conditions(self, gains: object, model: Model) -> Sequence[Condition]:
        return self.flown.conditions(gains, model)


@cached_by_class
def predicting(controller: type[Controller]) -> type[Predicting]:
    """The class of a controller that flies with a predictor."""
    known = {name: getattr(controller, name) for name in TAKEN}
    also = (*controller.also_measures, *(name for name in NEEDS if name not in controller.also_measures))
    named = {"__doc__": controller.__doc__, "__module__": controller.__module__}
    return type(controller.__name__, (Predicting,), {**named, **known, "Flown": controller, "also_measures": also})


TAKEN = "name", "label", "source", "Gains", "defaults", "measures", "commands", "preview", "rates", "one_at_a_time"
"""What is known of a controller whether it has a predictor or not."""
