"""PX4's mixer of multirotors (v1.15): from shares of torques and thrust to outputs of rotors, and to motors' commands.

The pseudo-inverse of the rotors' effects, normalised, then sequential desaturation: what the rotors cannot make gives way in
the order of `MC_AIRMODE`. `tests/test_control_px4.py` compares it with the autopilot's.
"""

from typing import NamedTuple

from quadstep.interfaces.model import Model
from quadstep.numbers import Matrix, Number, Vector, absolute, clip, largest, maximum, smallest, sqrt, where

TINY = 1.1920929e-7
"""Of a share, below which a torque counts as made: an f32's step at one."""

WEAK = 0.2
"""Of the mixer's entries: no rotor with a smaller one is used to leave a limit."""

YAW_REACH = 1.15
"""Of full output: how far yaw may ask beyond it; the thrust then gives way."""

COEFFICIENT = 6.5
"""Of a rotor's thrust in PX4's geometry, where `CA_ROTORn_CT` says nothing."""


class Mixer(NamedTuple):
    """outputs: a row for each rotor, its output for a share of roll, pitch, yaw torque and of thrust. torques: what a rotor's
    output makes of them, shape (3, rotors).
    """

    outputs: Matrix
    torques: Matrix


def mixer_of(model: Model) -> Mixer:
    """As PX4 normalises the pseudo-inverse of the rotors' effects: roll and pitch alike, so that two of four rotors at full
    output make a share of one; yaw by its largest entry; thrust by the mean.
    """
    lift, roll, pitch, yaw = ([row[i] / COEFFICIENT for row in model.shares] for i in range(4))
    tilting = maximum(*(half_norm(column) for column in (roll, pitch)))
    turning = largest([-one for one in yaw])
    rising = sum((absolute(one) for one in lift), start=0.0) / len(lift)
    scales = (tilting, tilting, turning, rising)
    columns = [[cut(one / scale) for one in column] for column, scale in zip((roll, pitch, yaw, lift), scales, strict=True)]
    torques = [COEFFICIENT * scale * row for row, scale in zip(model.mixing[1:], scales, strict=False)]
    return Mixer(Matrix(Vector(row) for row in zip(*columns, strict=True)), Matrix(torques))


def half_norm(column: list[Number]) -> Number:
    """The square root of twice the mean square of what is not nothing."""
    count = sum((where(absolute(one) > 1e-3, 1.0, 0.0) for one in column), start=0.0)
    square = sum((one * one for one in column), start=0.0)
    return sqrt(square / (0.5 * maximum(count, 1.0)))


def cut(entry: Number) -> Number:
    """Nothing where it is next to nothing."""
    return where(absolute(entry) < 1e-3, 0.0, entry)


def away(outputs: list[Number], along: list[Number], most: float) -> Number:
    """How far to go along a direction so that outputs leave what is below 0 and above `most`: as far as any one needs, less
    what another needs the other way.
    """
    needs: list[Number] = [0.0]
    for output, part in zip(outputs, along, strict=True):
        weak = absolute(part) < WEAK
        bound = where(output < 0.0, 0.0, most)
        out = where(weak, 0.0, where(output < 0.0, 1.0, where(output > most, 1.0, 0.0)))
        needs.append(where(out > 0.5, (bound - output) / where(weak, 1.0, part), 0.0))
    return smallest(needs) + largest(needs)


def moved(outputs: list[Number], along: list[Number], used: Number, most: float = 1.0, down: Number = 0.0) -> list[Number]:
    """Outputs nearer their limits: all the way, then half of what remains. used, down: 1 or 0, whether at all, and whether
    only downwards.
    """
    first = away(outputs, along, most)
    used = where(down > 0.5, where(first > 0.0, 0.0, used), used)
    for share in (1.0, 0.5):
        step = where(used > 0.5, share * away(outputs, along, most), 0.0)
        outputs = [output + step * part for output, part in zip(outputs, along, strict=True)]
    return outputs


def mixed(by: Matrix, torque: Vector, thrust: Number, airmode: Number) -> Vector:
    """The outputs of all rotors, 0 to 1. Yaw gives way first, then thrust, then roll and pitch.

    airmode: MC_AIRMODE, 0: thrust never grows for a torque; 1: it may for roll and pitch; 2: for yaw too.
    """
    roll, pitch, yaw, lift = (list(column) for column in by.T)
    for_yaw = where(airmode > 1.5, 1.0, 0.0)
    plain = where(airmode < 0.5, 1.0, 0.0)
    turn = [torque[2] * one for one in yaw]
    outputs = [
        torque[0] * r + torque[1] * p + for_yaw * y + thrust * t for r, p, y, t in zip(roll, pitch, turn, lift, strict=True)
    ]
    outputs = moved(outputs, lift, 1.0, down=plain)
    outputs = moved(moved(outputs, roll, plain), pitch, plain)
    outputs = [output + (1.0 - for_yaw) * y for output, y in zip(outputs, turn, strict=True)]
    outputs = [
        where(for_yaw > 0.5, whole, part)
        for whole, part in zip(
            moved(outputs, yaw, 1.0), moved(moved(outputs, yaw, 1.0, YAW_REACH), lift, 1.0, down=1.0), strict=True
        )
    ]
    return Vector(clip(output, 0.0, 1.0) for output in outputs)


def missed_torques(by: Matrix, torque: Vector, outputs: Vector) -> Vector:
    """1 or -1 for each torque of which the rotors do not make all, by the sign of what is missing; 0 for the others."""
    short = torque - by @ outputs
    failed = short @ short >= 1e-6
    return Vector(where(failed, where(one > TINY, 1.0, where(one < -TINY, -1.0, 0.0)), 0.0) for one in short)
