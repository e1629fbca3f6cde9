"""Rotations as unit quaternions (w, x, y, z) and as matrices. An attitude turns body vectors into world vectors."""

from quadstep.numbers.elementary import atan2, cos, sin
from quadstep.numbers.functions import absolute, sqrt, where
from quadstep.numbers.kinds import Number, functions_of
from quadstep.numbers.vectors import Matrix, Vector, either, matrix, vector

IDENTITY = vector(1.0, 0.0, 0.0, 0.0)


def cross(a: Vector, b: Vector) -> Vector:
    (a1, a2, a3), (b1, b2, b3) = a, b
    return vector(a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1)


def multiply(a: Vector, b: Vector) -> Vector:
    """Hamilton product: the rotation b, then a."""
    (a0, a1, a2, a3), (b0, b1, b2, b3) = a, b
    return vector(
        a0 * b0 - a1 * b1 - a2 * b2 - a3 * b3,
        a0 * b1 + a1 * b0 + a2 * b3 - a3 * b2,
        a0 * b2 - a1 * b3 + a2 * b0 + a3 * b1,
        a0 * b3 + a1 * b2 - a2 * b1 + a3 * b0,
    )


def conjugate(q: Vector) -> Vector:
    """The inverse rotation."""
    w, x, y, z = q
    return vector(w, -x, -y, -z)


def normalised(v: Vector) -> Vector:
    """v at length one. A zero vector gives non-finite entries."""
    return v * (1.0 / v.norm())


def rotation_matrix(q: Vector) -> Matrix:
    """R, shape (3, 3), with R @ body = world."""
    w, x, y, z = q
    return matrix(
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
    )


def quaternion_of(r: Matrix) -> Vector:
    """The quaternion of a rotation matrix, with w >= 0.

    The diagonal gives the squares of all four components; the largest is taken and the others follow from it (Shepperd 1978).
    """
    squares = (
        1.0 + r[0, 0] + r[1, 1] + r[2, 2],
        1.0 + r[0, 0] - r[1, 1] - r[2, 2],
        1.0 - r[0, 0] + r[1, 1] - r[2, 2],
        1.0 - r[0, 0] - r[1, 1] + r[2, 2],
    )
    a, b, c = r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]
    d, e, f = r[1, 0] + r[0, 1], r[0, 2] + r[2, 0], r[2, 1] + r[1, 2]
    columns = ((squares[0], a, b, c), (a, squares[1], d, e), (b, d, squares[2], f), (c, e, f, squares[3]))
    best, column = squares[0], Vector(columns[0])
    for square, other in zip(squares[1:], columns[1:], strict=True):
        better = square > best
        column = either(better, Vector(other), column)
        best = where(better, square, best)
    return column * (where(column[0] < 0.0, -1.0, 1.0) / column.norm())


def rotate(q: Vector, v: Vector) -> Vector:
    """A body vector in world axes."""
    return rotation_matrix(q) @ v


def unrotate(q: Vector, v: Vector) -> Vector:
    """A world vector in body axes."""
    return rotation_matrix(q).T @ v


def quaternion_rate(q: Vector, rates: Vector) -> Vector:
    """q_dot [1/s] of a body turning at `rates` [rad/s] about its own axes."""
    return 0.5 * multiply(q, Vector((0.0, *rates)))


def from_rotation_vector(v: Vector) -> Vector:
    """The quaternion of a turn by |v| [rad] about v."""
    cosine, ratio = half_turn(v @ v)
    return Vector((cosine, *(ratio * v)))


def half_turn(angle_squared: Number) -> tuple[Number, Number]:
    """cos(a / 2) and sin(a / 2) / a of an angle a [rad]; a kind of number may provide better ones."""
    own = getattr(functions_of(angle_squared), "half_turn", None)
    found: tuple[Number, Number] | None = own(angle_squared) if own is not None else None
    if found is not None:
        return found
    small = angle_squared < 1e-8
    angle = sqrt(where(small, 1.0, angle_squared))
    ratio = where(small, 0.5 - angle_squared / 48.0, sin(0.5 * angle) / angle)
    return where(small, 1.0 - angle_squared / 8.0, cos(0.5 * angle)), ratio


def rotation_vector(q: Vector) -> Vector:
    """The turn of at most pi [rad] that a quaternion stands for: its axis times its angle."""
    w, *axis = q
    sign = where(w < 0.0, -1.0, 1.0)
    part = sign * Vector(axis)
    return turn_ratio(part @ part, absolute(w)) * part


def turn_ratio(sine_squared: Number, cosine: Number) -> Number:
    """a / s of a turn by a [rad] whose half has the sine s and this cosine; a kind of number may provide
    a better one.
    """
    own = getattr(functions_of(sine_squared, cosine), "turn_ratio", None)
    found: Number | None = own(sine_squared, cosine) if own is not None else None
    if found is not None:
        return found
    small = sine_squared < 1e-10
    sine = sqrt(where(small, 1.0, sine_squared))
    return where(small, 2.0 + sine_squared / 3.0, 2.0 * atan2(sine, cosine) / sine)


def yaw_pitch_roll(q: Vector) -> Vector:
    """(yaw, pitch, roll) [rad] with R = Rz(yaw) Ry(pitch) Rx(roll), right-handed; for display, not for control.

    At pitch +-pi/2 yaw and roll turn about the same axis, and their values are meaningless.
    """
    r = rotation_matrix(q)
    level = sqrt(r[2, 1] * r[2, 1] + r[2, 2] * r[2, 2])
    return vector(atan2(r[1, 0], r[0, 0]), atan2(-r[2, 0], level), atan2(r[2, 1], r[2, 2]))


def from_yaw_pitch_roll(angles: Vector) -> Vector:
    """The quaternion of Rz(yaw) Ry(pitch) Rx(roll), angles [rad]."""
    yaw, pitch, roll = 0.5 * angles
    turns = (
        vector(cos(yaw), 0.0, 0.0, sin(yaw)),
        vector(cos(pitch), 0.0, sin(pitch), 0.0),
        vector(cos(roll), sin(roll), 0.0, 0.0),
    )
    return multiply(multiply(turns[0], turns[1]), turns[2])


def heading(q: Vector) -> Number:
    """Yaw alone [rad]."""
    return yaw_pitch_roll(q)[0]
