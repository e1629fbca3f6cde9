"""The sensors of a mission: noise, rates, latency, and whether an estimator stands between them and the controller."""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, ClassVar, NamedTuple

from pydantic import PlainSerializer, SerializeAsAny, WrapValidator

from quadstep.control.predictor import NEEDS, predicting
from quadstep.interfaces.controller import Controller
from quadstep.io.doors import ESTIMATORS, SENSORS
from quadstep.io.errors import UserError
from quadstep.mission.fields import NonNegative, Positive, Quantity, Section
from quadstep.mission.own_thing import OwnSection, own_or
from quadstep.sensing.estimator import ErrorState
from quadstep.sensing.sensors import DeclaredEstimator, DeclaredSensor, Sensors
from quadstep.sensing.suite import LAST_SAMPLES, WHITE_FIX, Suite

MOST_SAMPLES = 250
"""How many samples may be on their way at once: each is kept for every flight."""

MOST_PREDICTED = 128
"""Through how many samples a predictor may have to go, each time that the controller is told anything."""


class BuiltSensors(NamedTuple):
    """suite: structure. sensors: numbers. imu_steps, fix_steps: integrator steps from one sample to the next. oldest: how old
    what is told of the motion can be [s].
    """

    suite: Suite
    sensors: Sensors
    imu_steps: int
    fix_steps: int
    oldest: float


MOST_DRAWS = 100
"""Vectors of noise in a sample of a sensor."""


class OwnFixSection(OwnSection):
    """Your own sensor, which supplies the fixes: its `type`, and a key for each of its numbers."""

    thing: ClassVar[DeclaredSensor]

    def model_post_init(self, context: object) -> None:
        count: object = self.thing.draws
        if not (type(count) is int and 1 <= count <= MOST_DRAWS):
            raise ValueError(f"{self.type}: `draws` should be a whole number from 1 to {MOST_DRAWS}, not {count!r:.60}")


class OwnEstimatorSection(OwnSection):
    """An estimator of the user's own: its `type`, and a key for each of its numbers."""

    thing: ClassVar[DeclaredEstimator]


def no_fix(value: object) -> None:
    """Refuses what is no sensor. Raises ValueError."""
    if value is not None:
        raise ValueError("should be a table whose `type` is a sensor in your own FILE.py:NAME")


if TYPE_CHECKING:
    AnyFix = OwnFixSection | None
    AnyEstimator = bool | OwnEstimatorSection
else:
    AnyFix = Annotated[
        SerializeAsAny[OwnFixSection | None], WrapValidator(own_or(DeclaredSensor, OwnFixSection, SENSORS, (), no_fix))
    ]
    AnyEstimator = Annotated[
        bool,
        WrapValidator(own_or(DeclaredEstimator, OwnEstimatorSection, ESTIMATORS)),
        PlainSerializer(lambda one: one if isinstance(one, bool) else one.model_dump()),
    ]


class SensorsSection(Section):
    """The sensors, their noise and latency. Without this table the controller knows the true state without delay.

    A fix is a sample of position, velocity and attitude. Periods are multiples of simulation.step; latencies a whole number of
    samples of the IMU. Any controller can be given the predictor.
    """

    gyro_noise: Annotated[NonNegative, Quantity("rad/s/sqrt(Hz)", "density of the gyro's white noise")] = 0.0
    gyro_bias: Annotated[NonNegative, Quantity("rad/s", "standard deviation of the initial bias")] = 0.0
    gyro_walk: Annotated[NonNegative, Quantity("rad/s^2/sqrt(Hz)", "random walk of the bias")] = 0.0
    accelerometer_noise: Annotated[NonNegative, Quantity("m/s^2/sqrt(Hz)", "density of white noise")] = 0.0
    accelerometer_bias: Annotated[NonNegative, Quantity("m/s^2", "standard deviation of the initial bias")] = 0.0
    accelerometer_walk: Annotated[NonNegative, Quantity("m/s^3/sqrt(Hz)", "random walk of the bias")] = 0.0
    position_noise: Annotated[NonNegative, Quantity("m", "standard deviation per fix")] = 0.0
    velocity_noise: Annotated[NonNegative, Quantity("m/s", "standard deviation per fix")] = 0.0
    attitude_noise: Annotated[NonNegative, Quantity("rad", "standard deviation per fix")] = 0.0
    imu_period: Annotated[Positive | None, Quantity("s", "sampling period of the IMU; default: the control period")] = None
    fix_period: Annotated[Positive | None, Quantity("s", "time between fixes; default: imu_period")] = None
    latency: Annotated[NonNegative, Quantity("s", "age of a fix when it arrives")] = 0.0
    imu_latency: Annotated[NonNegative, Quantity("s", "delay of the IMU's samples")] = 0.0
    fix: AnyFix = None
    estimator: Annotated[AnyEstimator, Quantity("", "fuse the sensors in an error-state Kalman filter")] = False
    predictor: Annotated[bool, Quantity("", "propagate late fixes to the present with gyro and accelerometer")] = False

    def model_post_init(self, context: object) -> None:
        if self.imu_period and self.fix_period:
            multiple(self.fix_period, self.imu_period, "fix_period", "imu_period")

    @property
    def noisy(self) -> bool:
        """Whether any sensor has noise or a bias."""
        return self.fix is not None or any(size > 0.0 for size in self.numbers(gravity=0.0).sizes)

    @property
    def law(self) -> DeclaredEstimator:
        if isinstance(self.estimator, bool):
            return ErrorState() if self.estimator else LAST_SAMPLES
        return self.estimator.thing

    @property
    def age(self) -> float:
        """Of the oldest measurement that nothing makes up for [s]."""
        return self.imu_latency if self.estimator or self.predictor else max(self.latency, self.imu_latency)

    def numbers(self, gravity: float) -> Sensors:
        """The sizes of all noise; gravity [m/s^2] is the value that the estimator assumes."""
        return self.as_numbers(
            Sensors,
            gravity=gravity,
            fix=self.fix.numbers() if self.fix else (),
            estimator=() if isinstance(self.estimator, bool) else self.estimator.numbers(),
        )

    def check(self, duration: float) -> None:
        """Raises ValueError for a latency that outlasts a flight of `duration` [s]."""
        for key, latency in (("latency", self.latency), ("imu_latency", self.imu_latency)):
            if latency >= duration:
                raise ValueError(f"sensors.{key}: {latency:g} s is not shorter than the flight of {duration:g} s")

    def build(self, step: float, control_period: float, gravity: float, columns: Sequence[str] = ()) -> BuiltSensors:
        """The sensors of a flight with integrator steps of `step` [s]. Raises ValueError for periods that do not fit.

        columns: what the controller measures beside the motion, fields of `Measured`.
        """
        imu = self.imu_period or control_period
        fix = self.fix_period or imu
        imu_steps = multiple(imu, step, "sensors.imu_period", "simulation.step")
        every = multiple(fix, imu, "sensors.fix_period", "sensors.imu_period")
        late = samples(self.latency, imu, "sensors.latency")
        board_late = samples(self.imu_latency, imu, "sensors.imu_latency")
        delay, lag = divmod(late, every)
        columns = (*columns, *NEEDS) if self.predictor else columns
        suite = Suite(
            noisy=self.noisy,
            estimator=self.law,
            sensor=self.fix.thing if self.fix else WHITE_FIX,
            delay=delay,
            lag=lag,
            imu_delay=board_late,
            accelerometer="specific_force" in columns,
            late=(self.imu_latency if self.estimator else self.latency) if "age" in columns else None,
        )
        oldest = self.imu_latency if self.estimator else self.latency + fix - imu
        return BuiltSensors(suite, self.numbers(gravity), imu_steps, imu_steps * every, oldest)

    def fitted(self, law: Controller, periods: Mapping[str, float], oldest: float, gravity: float) -> Controller:
        """The controller with a predictor, if there is one.

        periods: of its loops [s], by name. oldest: see `BuiltSensors`. Raises UserError for one that would have to keep too
        many samples.
        """
        if not self.predictor:
            return law
        board_late = min(self.imu_latency, oldest)
        spans = [(oldest - board_late) / periods["law"], *(periods[name] / periods["law"] for name in law.loops())]
        between = any(abs(span - round(span)) > 1e-6 for span in spans[1:])
        count = math.ceil(spans[0] - 1e-6) + (1 if between and spans[0] > 0.0 else 0)
        if count > MOST_PREDICTED:
            raise UserError(
                f"sensors.predictor: a fix can be {oldest:g} s old, which is {count} controller samples; "
                f"allowed: at most {MOST_PREDICTED}"
            )
        return predicting(type(law))(law, count, board_late, gravity)


def multiple(period: float, unit: float, key: str, of: str) -> int:
    """How many times `unit` goes into `period`. Raises ValueError unless it does so a whole number of times."""
    ratio = period / unit
    if round(ratio) < 1 or abs(ratio - round(ratio)) > 1e-6 * ratio:
        raise ValueError(f"{key} = {period:g} s must be a whole multiple of {of} = {unit:g} s")
    return round(ratio)


def samples(latency: float, imu: float, key: str) -> int:
    """A latency [s] as a number of samples of the IMU. Raises ValueError unless it is a whole number, and not too many."""
    if latency == 0.0:
        return 0
    count = multiple(latency, imu, key, "sensors.imu_period")
    if count > MOST_SAMPLES:
        raise ValueError(f"{key} = {latency:g} s is {count} samples of the IMU; allowed: at most {MOST_SAMPLES}")
    return count
