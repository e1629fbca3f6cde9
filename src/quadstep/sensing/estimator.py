"""Error-state Kalman filter: position, velocity, attitude, gyro's and accelerometer's biases, from an IMU and from fixes.

Solà, "Quaternion kinematics for the error-state Kalman filter" (2017), angular errors in world axes as in his section 7:
R_true = exp(dtheta) R. How errors grow from one instant to another then depends on two sums over the samples in between alone,

    dp' = dp + dt dv,    dv' = dv - [sum T R f]x dtheta - (sum T R) da_b,    dtheta' = dtheta - (sum T R) dw_b,

and both follow from the estimates at the two ends. So the state moves at the rate of the IMU, the covariance at that of fixes.
(What an error of the gyro's bias does to the velocity before the next fix, of second order in dt, is left out.)

Fixes arrive late. The filter proper lives in the past: its covariance is of the estimate at the instant of which the last fix
spoke. A fix is compared with the estimate of its own instant, and the correction is carried forward through the estimates
since then by the same transition. So it is the Kalman filter of the fixes, followed by a prediction over the latency.

The covariance of a state, kept as its upper triangle, and the two things a Kalman filter does to it.

Only the triangle is computed, so it stays symmetric. Every change is elementary: a shear adds three states, times a matrix, to
three others; an observation measures one state alone. A sparse transition is a product of shears, and no matrix is inverted.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple, TypeAlias, cast

from quadstep.numbers import Matrix, Number, Structure, Vector, maximum, total, vector
from quadstep.numbers.rotations import (
    conjugate,
    cross,
    from_rotation_vector,
    multiply,
    normalised,
    rotation_matrix,
    rotation_vector,
)
from quadstep.sensing.sensors import DeclaredEstimator, Navigation, Sensors, filled, passed
from quadstep.vehicle.rigid_body import Motion

Triangle: TypeAlias = tuple[Vector, ...]
"""Row i holds the entries (i, i) ... (i, n - 1) of a symmetric matrix."""


def diagonal(variances: Vector) -> Triangle:
    count = len(variances)
    return tuple(Vector((variance, *[0.0] * (count - 1 - place))) for place, variance in enumerate(variances))


def entry(p: Triangle, i: int, j: int) -> Number:
    """Entry (i, j), from whichever side of the diagonal."""
    return p[i][j - i] if i <= j else p[j][i - j]


def widened(p: Triangle, variances: Vector) -> Triangle:
    """After independent noise of these variances has been added to the states."""
    return tuple(Vector((row[0] + variance, *row.entries[1:])) for row, variance in zip(p, variances, strict=True))


def sheared(p: Triangle, target: int, source: int, g: Matrix) -> Triangle:
    """After x[target : target + 3] += g @ x[source : source + 3], two groups that do not overlap.

    With M_t = P_t + g P_s for the rows t, s of target and source: P'_tk = M_tk, and P'_tt = M_tt + M_ts g^T.
    """
    count = len(p)
    rows = [[entry(p, i, j) for j in range(count)] for i in range(count)]
    moved = [
        [rows[target + a][k] + total(g[a, b] * rows[source + b][k] for b in range(3)) for k in range(count)] for a in range(3)
    ]
    for a in range(3):
        for k in range(count):
            rows[target + a][k] = rows[k][target + a] = moved[a][k]
    for a in range(3):
        for c in range(a, 3):
            back = total(moved[a][source + b] * g[c, b] for b in range(3))
            rows[target + a][target + c] = moved[a][target + c] + back
    return tuple(Vector(row[place:]) for place, row in enumerate(rows))


def observed(p: Triangle, place: int, variance: Number) -> tuple[Vector, Triangle]:
    """After state `place` has been measured with an error of this positive variance: the gain, shape (n), and the covariance.

    P' = P - K P_place with K = P_place / (P_pp + r). The row of the state itself is P_place r / (P_pp + r), so that it stays
    positive however small the error is.
    """
    count = len(p)
    row = [entry(p, place, k) for k in range(count)]
    scale = 1.0 / (row[place] + variance)
    gain = [scale * value for value in row]
    kept = scale * variance

    def after(i: int, j: int) -> Number:
        return kept * entry(p, i, j) if place in {i, j} else entry(p, i, j) - gain[i] * row[j]

    return Vector(gain), tuple(Vector(after(i, j) for j in range(i, count)) for i in range(count))


POSITION, VELOCITY, ATTITUDE, ACCELEROMETER_BIAS, GYRO_BIAS = 0, 3, 6, 9, 12
"""Where the errors of each part start among the fifteen."""

LEAST = Sensors(1e-5, 1e-4, 1e-6, 1e-4, 1e-3, 1e-5, 1e-4, 1e-4, 1e-4, 0.0)
"""The filter takes no sensor to be better than this: a perfect one would make its covariance singular."""

ZERO = vector(0.0, 0.0, 0.0)


class Instant(NamedTuple):
    """An estimate in a row of them. since: time from the one before [s]."""

    state: Navigation
    since: Number


class EstimatorMemory(NamedTuple):
    """What the filter remembers.

    now: the latest estimate. gyro_bias [rad/s], accelerometer_bias [m/s^2]: estimated. gyro, accelerometer: the last samples.
    recent: estimates at the last samples of the IMU, without `now`; older: at the last fixes, a lag before each; oldest first.
    elapsed: time from the last of `older` to the oldest in `recent` [s]. settled: the estimate that the covariance is of.
    covariance: of the errors (dp, dv, dtheta, da_b, dw_b), dtheta in world axes.
    """

    now: Instant
    gyro_bias: Vector
    accelerometer_bias: Vector
    gyro: Vector
    accelerometer: Vector
    recent: tuple[Instant, ...]
    older: tuple[Instant, ...]
    elapsed: Number
    settled: Navigation
    covariance: Triangle


class Transition(NamedTuple):
    """How errors grow from one instant to another. elapsed: dt [s]. gained: sum of T R f [m/s]. turned: sum of T R [s]."""

    elapsed: Number
    gained: Vector
    turned: Matrix


def believed(sensors: Sensors) -> Sensors:
    """The sensors as the filter sees them."""
    sizes = (maximum(size, least) for size, least in zip(sensors.sizes, LEAST.sizes, strict=True))
    return sensors._replace(**dict(zip(Sensors._fields, sizes, strict=False)))


def variances(*sizes: Number) -> Vector:
    """Of groups of three errors with these standard deviations."""
    return Vector(size * size for size in sizes for _ in range(3))


def fix_variances(sensors: Sensors) -> Vector:
    """The variances of a fix, shape (9): position, velocity, attitude."""
    sizes = believed(sensors)
    return variances(sizes.position_noise, sizes.velocity_noise, sizes.attitude_noise)


def start(first: Navigation, gyro: Vector, sensors: Sensors, lag: int, delay: int) -> EstimatorMemory:
    """The filter that knows one fix. Later ones speak of `delay` fixes and `lag` samples ago, fewer than between two fixes."""
    sizes, instant = believed(sensors), Instant(first, 0.0)
    biases = variances(sizes.accelerometer_bias, sizes.gyro_bias)
    return EstimatorMemory(
        now=instant,
        gyro_bias=ZERO,
        accelerometer_bias=ZERO,
        gyro=gyro,
        accelerometer=ZERO,
        recent=filled(instant, lag),
        older=filled(instant, delay),
        elapsed=0.0,
        settled=first,
        covariance=diagonal(Vector((*fix_variances(sensors), *biases))),
    )


def predict(memory: EstimatorMemory, gyro: Vector, accelerometer: Vector, gravity: Number, period: Number) -> EstimatorMemory:
    """The estimate `period` [s] later, when these samples come in: midpoint rule with the mean of each pair of samples."""
    rates = 0.5 * (memory.gyro + gyro) - memory.gyro_bias
    force = 0.5 * (memory.accelerometer + accelerometer) - memory.accelerometer_bias
    position, velocity, attitude = memory.now.state
    half_turn = from_rotation_vector((0.5 * period) * rates)
    middle = multiply(attitude, half_turn)
    acceleration = rotation_matrix(middle) @ force - vector(0.0, 0.0, gravity)
    state = Navigation(
        position=position + period * (velocity + (0.5 * period) * acceleration),
        velocity=velocity + period * acceleration,
        attitude=normalised(multiply(middle, half_turn)),
    )
    line = (*memory.recent, memory.now, Instant(state, period))[1:]
    return memory._replace(
        now=line[-1], gyro=gyro, accelerometer=accelerometer, recent=line[:-1], elapsed=memory.elapsed + line[0].since
    )


def transition(before: Navigation, after: Instant, gravity: Number) -> Transition:
    """From an estimate to the next: sum T R f is the velocity gained, and lost to gravity; sum T R by the trapezoidal rule."""
    elapsed = after.since
    gained = after.state.velocity - before.velocity + vector(0.0, 0.0, gravity * elapsed)
    turned = (0.5 * elapsed) * (rotation_matrix(before.attitude) + rotation_matrix(after.state.attitude))
    return Transition(elapsed, gained, turned)


def carried(error: Vector, step: Transition) -> Vector:
    """The errors, shape (15), after a transition."""
    dp, dv, dtheta, da, dw = parts(error)
    later = dv - cross(step.gained, dtheta) - step.turned @ da
    return Vector((*(dp + (0.5 * step.elapsed) * (dv + later)), *later, *(dtheta - step.turned @ dw), *da, *dw))


def propagated(p: Triangle, step: Transition, sensors: Sensors) -> Triangle:
    """The covariance after a transition: that of `carried`, and the noise of the IMU."""
    sizes, (x, y, z), half = believed(sensors), step.gained, 0.5 * step.elapsed
    drift = Matrix([vector(half, 0.0, 0.0), vector(0.0, half, 0.0), vector(0.0, 0.0, half)])
    tilt = Matrix([vector(0.0, z, -y), vector(-z, 0.0, x), vector(y, -x, 0.0)])
    noise = variances(0.0, sizes.accelerometer_noise, sizes.gyro_noise, sizes.accelerometer_walk, sizes.gyro_walk)
    p = sheared(p, POSITION, VELOCITY, drift)
    p = sheared(p, VELOCITY, ATTITUDE, tilt)
    p = sheared(p, VELOCITY, ACCELEROMETER_BIAS, -1.0 * step.turned)
    p = sheared(p, ATTITUDE, GYRO_BIAS, -1.0 * step.turned)
    return sheared(widened(p, step.elapsed * noise), POSITION, VELOCITY, drift)


def innovation(fix: Navigation, estimate: Navigation) -> Vector:
    """What a fix says beyond an estimate, shape (9): position [m], velocity [m/s], and the turn in world axes [rad]."""
    turn = rotation_vector(multiply(fix.attitude, conjugate(estimate.attitude)))
    return Vector((*(fix.position - estimate.position), *(fix.velocity - estimate.velocity), *turn))


def parts(error: Vector) -> tuple[Vector, ...]:
    """(dp, dv, dtheta, da_b, dw_b)."""
    return tuple(Vector(error.entries[place : place + 3]) for place in range(0, 15, 3))


def moved(state: Navigation, error: Vector) -> Navigation:
    dp, dv, dtheta, _, _ = parts(error)
    return Navigation(
        state.position + dp, state.velocity + dv, normalised(multiply(from_rotation_vector(dtheta), state.attitude))
    )


def correct(memory: EstimatorMemory, fix: Navigation, sensors: Sensors) -> EstimatorMemory:
    """The filter after a fix, whose nine numbers are taken in one by one.

    The estimates in `recent` stay as they are: none will be compared with a fix, as the lag is shorter than to the next one.
    """
    line, gravity = (*memory.recent, memory.now), sensors.gravity
    older, seen = passed(memory.older, line[0]._replace(since=memory.elapsed))
    covariance = propagated(memory.covariance, transition(memory.settled, seen, gravity), sensors)
    error = Vector([0.0] * 15)
    for place, (surprise, variance) in enumerate(zip(innovation(fix, seen.state), fix_variances(sensors), strict=True)):
        gain, covariance = observed(covariance, place, variance)
        error = error + (surprise - error[place]) * gain

    _, _, _, da, dw = parts(error)
    last = (memory.now._replace(since=total(instant.since for instant in line[1:])),) if memory.recent else ()
    chain, states = (seen, *older, *last), [moved(seen.state, error)]
    for before, after in pairwise(chain):
        error = carried(error, transition(before.state, after, gravity))
        states.append(moved(after.state, error))
    return memory._replace(
        now=memory.now._replace(state=states[-1]),
        gyro_bias=memory.gyro_bias + dw,
        accelerometer_bias=memory.accelerometer_bias + da,
        older=tuple(instant._replace(state=state) for instant, state in zip(older, states[1:], strict=False)),
        elapsed=0.0,
        settled=states[0],
        covariance=covariance,
    )


@dataclass(frozen=True)
class ErrorState(DeclaredEstimator[EstimatorMemory]):
    """The filter as an estimator of a flight."""

    def start(self, first: Navigation, rates: Vector, force: Structure, p: Sensors, lag: int, delay: int) -> EstimatorMemory:
        return start(first, rates, p, lag, delay)

    def predict(self, memory: EstimatorMemory, gyro: Vector, force: Structure, p: Sensors, period: Number) -> EstimatorMemory:
        return predict(memory, gyro, cast(Vector, force), p.gravity, period)

    def correct(self, memory: EstimatorMemory, fix: Navigation, p: Sensors) -> EstimatorMemory:
        return correct(memory, fix, p)

    def motion(self, memory: EstimatorMemory) -> Motion:
        return Motion(*memory.now.state, memory.gyro - memory.gyro_bias)

    def force(self, memory: EstimatorMemory) -> Vector:
        return memory.accelerometer - memory.accelerometer_bias
