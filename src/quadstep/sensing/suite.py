"""The sensors of a vehicle as a whole: from its true motion to what its controller is told.

An IMU on board (gyro, accelerometer) is sampled at its own rate. A fix, a sample of position, velocity and attitude from a
camera system or a satellite receiver, comes at a slower rate, speaks of an instant some time ago, and is held until the next.
"""

from dataclasses import dataclass
from typing import NamedTuple, TypeAlias, cast

from quadstep.numbers import Number, Structure, Vector, sqrt, vector, where
from quadstep.numbers.noise import Key
from quadstep.numbers.structure import answered
from quadstep.sensing.sensors import (
    FIX,
    IMU,
    START,
    DeclaredEstimator,
    DeclaredSensor,
    LastSamples,
    Navigation,
    Sensors,
    draws,
    filled,
    fixed,
    navigation,
    passed,
    pushed,
)
from quadstep.vehicle.rigid_body import Motion


@dataclass(frozen=True)
class WhiteFix(DeclaredSensor):
    """A camera system, or a satellite receiver: white noise."""

    def sample(self, truth: Navigation, noise: list[Vector], p: Sensors) -> Navigation:
        return fixed(truth, p, noise)


LAST_SAMPLES, WHITE_FIX = LastSamples(), WhiteFix()


class SuiteMemory(NamedTuple):
    """What the sensors remember; what a suite does not have is empty. Lines of samples are oldest first.

    biases: the true ones, of the gyro [rad/s] and of the accelerometer [m/s^2]. lagged: true states at the last samples of the
    IMU and at this one; queued: at the last fixes, a lag before each. estimate: what the estimator remembers. board: what was
    known on board at the last samples of the IMU. age: since the instant of which the last fix speaks [s], where that is asked
    for.
    """

    biases: tuple[Vector, ...]
    lagged: tuple[Navigation, ...]
    queued: tuple[Navigation, ...]
    estimate: Structure
    board: "tuple[Board, ...]" = ()
    age: Number | tuple[()] = ()


Board: TypeAlias = tuple[Structure, Structure]
"""What is known on board and reaches the controller `imu_delay` samples later: of the motion, and the specific force, () where
nobody asks for it.
"""


@dataclass(frozen=True)
class Suite:
    """Which sensors there are. At an instant at which all are due, call `sense`, then `fix`, then `measured`.

    noisy: whether they have noise and biases. estimator: what puts them together. sensor: what fixes come from where they are
    noisy. A fix speaks of `delay` fixes and `lag` samples of the IMU ago: divmod(n, m) for a latency of n samples and a fix
    every m (so a lag is fewer than m). imu_delay: samples of the IMU until the controller gets to know what is known on
    board. accelerometer: whether the controller asks for its samples. late: how old a fix is when it arrives [s], where the
    controller asks for its age.
    """

    noisy: bool = False
    estimator: DeclaredEstimator = LAST_SAMPLES
    sensor: DeclaredSensor = WHITE_FIX
    delay: int = 0
    lag: int = 0
    imu_delay: int = 0
    accelerometer: bool = False
    late: float | None = None

    def __post_init__(self) -> None:
        for name in ("delay", "lag", "imu_delay"):
            if getattr(self, name) < 0:
                raise ValueError(f"{name} is a number of samples, 0 or more")

    @property
    def feels(self) -> bool:
        return self.estimator.feels or self.accelerometer

    @property
    def on_board(self) -> int:
        """How many sensors of the IMU are used: the gyro, and the accelerometer if anything asks for it."""
        return 2 if self.feels else 1

    def start(self, motion: Motion, sensors: Sensors, key: Key) -> SuiteMemory:
        """The memory before the first sample of a flight that starts with this motion, as an estimator learns from a fix."""
        truth = first = navigation(motion)
        biases: tuple[Vector, ...] = ()
        if self.noisy:
            count = self.sensor.draws
            noise = draws(key, START, 0.0, count + self.on_board)
            first = answered(self.sensor.sample(truth, noise[:count], sensors), Navigation, "sample")
            starts = sensors.gyro_bias, sensors.accelerometer_bias
            biases = tuple(size * bias for size, bias in zip(starts, noise[count:], strict=False))
        force = vector(0.0, 0.0, sensors.gravity) if self.accelerometer else ()
        memory = SuiteMemory(
            biases=biases,
            lagged=filled(truth, self.lag + 1 if self.lag else 0),
            queued=filled(truth, self.delay),
            estimate=self.estimator.start(first, motion.rates, force, sensors, self.lag, self.delay),
            age=self._late,
        )
        return memory._replace(board=filled(self._on_board(memory), self.imu_delay))

    @property
    def _late(self) -> Number | tuple[()]:
        """How old a fix is when it arrives [s], where it grows older until the next and the controller asks."""
        return () if self.late is None or self.estimator.current else self.late

    def sense(
        self, memory: SuiteMemory, motion: Motion, specific_force: Vector, sensors: Sensors, key: Key,
        tick: Number, period: Number,
    ) -> SuiteMemory:  # fmt: skip
        """A sample of the IMU, every `period` [s] from tick 0 on.

        specific_force: acceleration of the body's origin less that of gravity, body axes [m/s^2].
        """
        memory = memory._replace(
            board=pushed(memory.board, self._on_board(memory)) if self.imu_delay else (),
            lagged=pushed(memory.lagged, navigation(motion)) if self.lag else (),
        )
        samples = [motion.rates, specific_force][: self.on_board]
        if self.noisy:
            sizes = [density / sqrt(period) for density in (sensors.gyro_noise, sensors.accelerometer_noise)]
            noise = draws(key, IMU, tick, self.on_board)
            samples = [
                sample + bias + size * white
                for sample, bias, size, white in zip(samples, memory.biases, sizes, noise, strict=False)
            ]
        gyro, force = samples[0], samples[1] if self.feels else ()
        ages = self._late != ()
        since = where(tick > 0.0, period, 0.0) if self.estimator.current or ages else 0.0  # none before the first
        return memory._replace(
            estimate=self.estimator.predict(memory.estimate, gyro, force, sensors, since),
            age=cast(Number, memory.age) + since if ages else (),
        )

    def fix(
        self, memory: SuiteMemory, motion: Motion, sensors: Sensors, key: Key, tick: Number, period: Number
    ) -> SuiteMemory:
        """A fix, every `period` [s] from tick 0 on, after the sample of the IMU at that instant. The biases wander here."""
        queued, fix = passed(memory.queued, memory.lagged[0] if self.lag else navigation(motion))
        memory = memory._replace(queued=queued)
        if self.noisy:
            count = self.sensor.draws
            noise = draws(key, FIX, tick, count + self.on_board)
            fix = answered(self.sensor.sample(fix, noise[:count], sensors), Navigation, "sample")
            steps = [walk * sqrt(period) for walk in (sensors.gyro_walk, sensors.accelerometer_walk)]
            biases = (bias + step * white for bias, step, white in zip(memory.biases, steps, noise[count:], strict=False))
            memory = memory._replace(biases=tuple(biases))
        estimate = self.estimator.correct(memory.estimate, fix, sensors)
        return memory._replace(estimate=estimate, age=self._late)

    def measured(self, memory: SuiteMemory) -> Motion:
        """What the controller gets to know now."""
        known, _ = self._arrived(memory)
        return self.estimator.arrived(memory.estimate, known)

    def more(self, memory: SuiteMemory) -> dict[str, object]:
        """What else the controller gets to know where it asks for it, as fields of `Measured`."""
        _, force = self._arrived(memory)
        return {"specific_force": force, "age": self.late if self.estimator.current else memory.age}

    def _arrived(self, memory: SuiteMemory) -> Board:
        """What has come from the board."""
        return memory.board[0] if self.imu_delay else self._on_board(memory)

    def _on_board(self, memory: SuiteMemory) -> Board:
        force = self.estimator.force(memory.estimate) if self.accelerometer else ()
        return self.estimator.on_board(memory.estimate), force
