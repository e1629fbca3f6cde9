"""ArduPilot's mixer of multirotors (Copter 4.6): from shares of torques and throttle to thrusts of rotors, with its limits.

`tests/test_control_ardupilot.py` compares it with the autopilot's.
"""

from typing import NamedTuple

from quadstep.interfaces.model import Model
from quadstep.numbers import Matrix, Number, Vector, absolute, clip, largest, maximum, minimum, smallest, where


class Mixed(NamedTuple):
    """thrusts: of the rotors, 0 to 1. The others are 1 or 0, whether roll and pitch, yaw, and throttle are at their limits."""

    thrusts: Vector
    tilting: Number
    turning: Number
    upper: Number
    lower: Number


def factors_of(model: Model) -> Matrix:
    """A row for each rotor: its factors of roll, pitch and yaw, the largest of each 0.5, as ArduPilot normalises a frame's."""
    columns = []
    for row in model.mixing[1:]:
        most = largest([absolute(one) for one in row])
        columns.append(Vector(0.5 * one / maximum(most, 1e-9) for one in row))
    return Matrix(columns).T


def mixed(factors: Matrix, torque: Vector, throttle: Number, average: Number, headroom: Number) -> Mixed:
    """Roll and pitch go before throttle, and throttle before yaw, which keeps a room of its own.

    throttle: wanted, 0 to 1. average: as far as it may be raised for the torques' sake. headroom: of yaw, MOT_YAW_HEADROOM.
    """
    rows = list(factors)
    lower = where(throttle <= 0.0, 1.0, 0.0)
    upper = where(throttle >= 1.0, 1.0, 0.0)
    wanted = clip(throttle, 0.0, 1.0)
    average = clip(average, wanted, 1.0)
    best = minimum(average, 0.5)
    tilting = [torque[0] * roll + torque[1] * pitch for roll, pitch, _ in rows]
    rooms: list[Number] = [1.0]
    for one, (_, _, yaw) in zip(tilting, rows, strict=True):
        room = where(torque[2] * yaw > 0.0, 1.0 - (best + one), best + one)
        some = absolute(yaw) > 0.0
        rooms.append(where(some, maximum(room, 0.0) / where(some, absolute(yaw), 1.0), 1.0))
    allowed = maximum(smallest(rooms), headroom)
    short = where(absolute(torque[2]) > allowed, 1.0, 0.0)
    turn = clip(torque[2], -allowed, allowed)
    parts = [one + turn * yaw for one, (_, _, yaw) in zip(tilting, rows, strict=True)]
    low, high = minimum(smallest(parts), 1.0), maximum(largest(parts), -1.0)
    span = high - low
    wide, under = span > 1.0, average + low < 0.0
    scale = where(wide, 1.0 / where(wide, span, 1.0), 1.0)
    scale = where(under, minimum(scale, -average / where(under, low, -1.0)), scale)
    cut = where(scale < 1.0, 1.0, 0.0)
    low, high = scale * low, scale * high
    raised = wanted + low
    room = 1.0 - (high - low)
    beyond = where(raised > room, 1.0, 0.0)
    added = where(cut > 0.5, 0.0, where(raised < 0.0, 0.0, where(beyond > 0.5, room, raised)))
    upper = where(cut > 0.5, where(raised > 0.0, 1.0, upper), where(raised < 0.0, upper, maximum(upper, beyond)))
    base = added - low
    return Mixed(Vector(base + scale * part for part in parts), cut, maximum(short, cut), upper, lower)
