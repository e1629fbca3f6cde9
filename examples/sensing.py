"""A sensor and an estimator in a file of your own, which missions of real vehicles name.

`fix = { type = "sensing.py:Beacon" }` and `estimator = { type = "sensing.py:Complementary" }` in `[sensors]`;
`LateVelocity` has a velocity like that of EKF2 in PX4's simulator (docs/export-px4.md).
"""

from typing import NamedTuple

from quadstep.own import (
    Estimator,
    Motion,
    Navigation,
    Number,
    Sensor,
    Sensors,
    Vector,
    conjugate,
    from_rotation_vector,
    gain,
    multiply,
    normalised,
    rotation_matrix,
    rotation_vector,
    vector,
)


class BeaconNumbers(NamedTuple):
    """A beacon, which sees less the farther the vehicle is."""

    place: Vector = gain((0.0, 0.0, 0.0), "m", "of the beacon", signed=True)
    near: Number = gain(0.002, "m", "standard deviation of the position next to it", zero=True)
    grows: Number = gain(0.01, "m/m", "by which it grows with the distance", zero=True)


class Beacon(Sensor):
    """Position with noise that grows with the distance; velocity and attitude are exact."""

    Numbers = BeaconNumbers
    draws = 1

    def sample(self, truth: Navigation, noise: list[Vector], p: Sensors) -> Navigation:
        """A fix."""
        size = p.fix.near + p.fix.grows * (truth.position - p.fix.place).norm()
        return truth._replace(position=truth.position + size * noise[0])


class ComplementaryNumbers(NamedTuple):
    """How much of what a fix says beyond the estimate is believed."""

    position: Number = gain(0.2, "-", "share of the position", high=1.0)
    velocity: Number = gain(0.1, "-", "share of the velocity", high=1.0)
    attitude: Number = gain(0.1, "-", "share of the attitude", high=1.0)


class Estimate(NamedTuple):
    """What it remembers: the estimate, and the last samples of gyro and accelerometer."""

    state: Navigation
    gyro: Vector
    accelerometer: Vector


class Complementary(Estimator):
    """A complementary filter: the IMU moves the estimate, and each fix pulls at it. It knows of no bias and no latency."""

    Numbers = ComplementaryNumbers

    def start(self, first: Navigation, rates: Vector, force: Vector, p: Sensors, lag: int, delay: int) -> Estimate:
        """At the first fix."""
        return Estimate(first, rates, vector(0.0, 0.0, p.gravity))

    def predict(self, memory: Estimate, gyro: Vector, force: Vector, p: Sensors, period: Number) -> Estimate:
        """As the samples say."""
        position, velocity, attitude = memory.state
        acceleration = rotation_matrix(attitude) @ force - vector(0.0, 0.0, p.gravity)
        turned = normalised(multiply(attitude, from_rotation_vector(period * gyro)))
        state = Navigation(position + period * velocity, velocity + period * acceleration, turned)
        return Estimate(state, gyro, force)

    def correct(self, memory: Estimate, fix: Navigation, p: Sensors) -> Estimate:
        """Towards the fix."""
        position, velocity, attitude = memory.state
        turn = rotation_vector(multiply(fix.attitude, conjugate(attitude)))
        state = Navigation(
            position + p.estimator.position * (fix.position - position),
            velocity + p.estimator.velocity * (fix.velocity - velocity),
            normalised(multiply(from_rotation_vector(p.estimator.attitude * turn), attitude)),
        )
        return memory._replace(state=state)

    def motion(self, memory: Estimate) -> Motion:
        """The estimate, with the gyro's rates."""
        return Motion(*memory.state, memory.gyro)

    def force(self, memory: Estimate) -> Vector:
        """The accelerometer's sample."""
        return memory.accelerometer


class LateNumbers(NamedTuple):
    """What is wrong with the velocity."""

    late: Number = gain(0.02, "s", "by how much it is late", zero=True)
    size: Number = gain(0.992, "-", "its size over the true one's", high=2.0)


class LateVelocity(Estimator):
    """The truth as of the last fix, but for the velocity: the one now, less the acceleration for that long, made smaller."""

    Numbers = LateNumbers

    def start(self, first: Navigation, rates: Vector, force: Vector, p: Sensors, lag: int, delay: int) -> Estimate:
        """At the first fix, at rest."""
        return Estimate(first, rates, vector(0.0, 0.0, p.gravity))

    def predict(self, memory: Estimate, gyro: Vector, force: Vector, p: Sensors, period: Number) -> Estimate:
        """The samples."""
        return memory._replace(gyro=gyro, accelerometer=force)

    def correct(self, memory: Estimate, fix: Navigation, p: Sensors) -> Estimate:
        """The fix, whose velocity becomes that of the past."""
        acceleration = rotation_matrix(fix.attitude) @ memory.accelerometer - vector(0.0, 0.0, p.gravity)
        velocity = p.estimator.size * (fix.velocity - p.estimator.late * acceleration)
        return memory._replace(state=fix._replace(velocity=velocity))

    def motion(self, memory: Estimate) -> Motion:
        """What the controller is told."""
        return Motion(*memory.state, memory.gyro)

    def force(self, memory: Estimate) -> Vector:
        """The accelerometer's last sample."""
        return memory.accelerometer
