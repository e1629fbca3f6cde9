"""The sensors of a vehicle as a whole: from its true motion to what its controller is told.

An IMU on board (gyro, accelerometer) is sampled at its own rate. A fix, a sample of position, velocity and attitude from a
camera system or a satellite receiver, comes at a slower rate, speaks of an instant some time ago, and is held until the next.
"""

from dataclasses import dataclass
from typing import NamedTuple, TypeAlias, cast

from quadstep.numbers import Number, Vector, sqrt, vector, where
from quadstep.numbers.noise import Key
from quadstep.sensing import estimator
from quadstep.sensing.delay import filled, passed, pushed
from quadstep.sensing.sensors import FIX, IMU, START, Navigation, Sensors, draws, fixed, navigation
from quadstep.vehicle.airframe.motion import Motion


class SuiteMemory(NamedTuple):
    """What the sensors remember; what a suite does not have is empty. Lines of samples are oldest first.

    biases: the true ones, of the gyro [rad/s] and of the accelerometer [m/s^2]. lagged: true states at the last samples of the
    IMU and at this one; queued: at the last fixes, a lag before each. filter: the estimator's. held: what is known without an
    estimator. board: what was known on board at the last samples of the IMU. force: the accelerometer's last sample, where it
    is asked for without an estimator. age: since the instant of which the held fix speaks [s], where that is asked for.
    """

    biases: tuple[Vector, ...]
    lagged: tuple[Navigation, ...]
    queued: tuple[Navigation, ...]
    filter: estimator.EstimatorMemory | tuple[()]
    held: Motion | tuple[()]
    board: "tuple[Board, ...]"
    force: Vector | tuple[()] = ()
    age: Number | tuple[()] = ()


Board: TypeAlias = tuple[Motion | Vector, Vector | tuple[()]]
"""What is known on board: the estimate, or the gyro's rates; and the accelerometer's sample."""


@dataclass(frozen=True)
class Suite:
    """Which sensors there are. At an instant at which all are due, call `sense`, then `fix`, then `measured`.

    noisy: whether they have noise and biases. estimator: whether an error-state Kalman filter puts them together; without it
    the controller gets the gyro and the last fix as they are. A fix speaks of `delay` fixes and `lag` samples of the IMU ago:
    divmod(n, m) for a latency of n samples and a fix every m (so a lag is fewer than m). imu_delay: samples of the IMU until
    the controller gets to know the estimate, or without an estimator the IMU. accelerometer: whether the controller asks for
    its samples. late: how old a fix is when it arrives [s], where the controller asks for its age.
    """

    noisy: bool = False
    estimator: bool = False
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
        """Whether the accelerometer is used."""
        return self.estimator or self.accelerometer

    @property
    def on_board(self) -> int:
        """How many sensors of the IMU are used: the gyro, and the accelerometer if anything asks for it."""
        return 2 if self.feels else 1

    def start(self, motion: Motion, sensors: Sensors, key: Key) -> SuiteMemory:
        """The memory before the first sample of a flight that starts with this motion, as an estimator learns from a fix."""
        truth = first = navigation(motion)
        biases: tuple[Vector, ...] = ()
        if self.noisy:
            noise = draws(key, START, 0.0, 3 + self.on_board)
            first = fixed(truth, sensors, noise[:3])
            biases = tuple(size * bias for size, bias in zip(sensors.biases, noise[3:], strict=False))
        memory = SuiteMemory(
            biases=biases,
            lagged=filled(truth, self.lag + 1 if self.lag else 0),
            queued=filled(truth, self.delay),
            filter=estimator.start(first, motion.rates, sensors, self.lag, self.delay) if self.estimator else (),
            held=() if self.estimator else Motion(*first, motion.rates),
            board=(),
            force=() if self.estimator or not self.accelerometer else vector(0.0, 0.0, sensors.gravity),
            age=() if self.estimator or self.late is None else self.late,
        )
        return memory._replace(board=filled(self._on_board(memory), self.imu_delay))

    def sense(
        self,
        memory: SuiteMemory,
        motion: Motion,
        specific_force: Vector,
        sensors: Sensors,
        key: Key,
        tick: Number,
        period: Number,
    ) -> SuiteMemory:
        """A sample of the IMU, every `period` [s] from tick 0 on.

        specific_force: acceleration of the body's origin less that of gravity, body axes [m/s^2].
        """
        memory = memory._replace(
            board=pushed(memory.board, self._on_board(memory)) if self.imu_delay else (),
            lagged=pushed(memory.lagged, navigation(motion)) if self.lag else (),
        )
        samples = [motion.rates, specific_force][: self.on_board]
        if self.noisy:
            sizes = [density / sqrt(period) for density in sensors.densities]
            noise = draws(key, IMU, tick, self.on_board)
            samples = [
                sample + bias + size * white
                for sample, bias, size, white in zip(samples, memory.biases, sizes, noise, strict=False)
            ]
        if not self.estimator:
            return memory._replace(
                held=cast(Motion, memory.held)._replace(rates=samples[0]),
                force=samples[1] if self.accelerometer else (),
                age=() if self.late is None else cast(Number, memory.age) + passed_by(tick, period),
            )
        gyro, force = samples
        known = cast(estimator.EstimatorMemory, memory.filter)
        return memory._replace(filter=estimator.predict(known, gyro, force, sensors.gravity, passed_by(tick, period)))

    def fix(
        self, memory: SuiteMemory, motion: Motion, sensors: Sensors, key: Key, tick: Number, period: Number
    ) -> SuiteMemory:
        """A fix, every `period` [s] from tick 0 on, after the sample of the IMU at that instant. The biases wander here."""
        queued, fix = passed(memory.queued, memory.lagged[0] if self.lag else navigation(motion))
        memory = memory._replace(queued=queued)
        if self.noisy:
            noise = draws(key, FIX, tick, 3 + self.on_board)
            fix = fixed(fix, sensors, noise[:3])
            steps = [walk * sqrt(period) for walk in sensors.walks]
            biases = (bias + step * white for bias, step, white in zip(memory.biases, steps, noise[3:], strict=False))
            memory = memory._replace(biases=tuple(biases))
        if self.estimator:
            return memory._replace(filter=estimator.correct(cast(estimator.EstimatorMemory, memory.filter), fix, sensors))
        return memory._replace(held=Motion(*fix, cast(Motion, memory.held).rates), age=() if self.late is None else self.late)

    def measured(self, memory: SuiteMemory) -> Motion:
        """What the controller gets to know now."""
        known, _ = self._arrived(memory)
        return known if isinstance(known, Motion) else cast(Motion, memory.held)._replace(rates=known)

    def more(self, memory: SuiteMemory) -> dict[str, object]:
        """What else the controller gets to know where it asks for it, as fields of `Measured`."""
        _, force = self._arrived(memory)
        return {"specific_force": force, "age": self.late if self.estimator else memory.age}

    def _arrived(self, memory: SuiteMemory) -> Board:
        """What has come from the board."""
        return memory.board[0] if self.imu_delay else self._on_board(memory)

    def _on_board(self, memory: SuiteMemory) -> Board:
        """What is known on board and reaches the controller `imu_delay` samples later: the estimate, or the gyro's rates; and
        the accelerometer's sample, () where nobody asks for it.
        """
        if not self.estimator:
            return cast(Motion, memory.held).rates, memory.force
        known = cast(estimator.EstimatorMemory, memory.filter)
        force = known.accelerometer - known.accelerometer_bias if self.accelerometer else ()
        return Motion(*known.now.state, known.gyro - known.gyro_bias), force


def passed_by(tick: Number, period: Number) -> Number:
    """Time since the sample before [s]; none has passed before the first."""
    return where(tick > 0.0, period, 0.0)
