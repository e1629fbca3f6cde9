"""Mixers of autopilots: from shares of torques and thrust to thrusts of rotors, with the limits of each.

`tests/test_control_crazyflie.py`, `test_control_ardupilot.py` and `test_control_px4.py` compare them with the autopilots' own.

Crazyflie (bitcraze/crazyflie-firmware, 2026.08, platform cf2): commands are counts of 1/65535 of a rotor's largest thrust,
here not rounded to whole ones. ArduPilot: of Copter 4.6. PX4 (v1.15): the pseudo-inverse of the rotors' effects, normalised,
then sequential desaturation: what the rotors cannot make gives way in the order of `MC_AIRMODE`.
"""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple, Self

from quadstep.interfaces.gain import BELIEF, gain, given
from quadstep.interfaces.plant import Model
from quadstep.io.errors import UserError
from quadstep.numbers import Matrix, Number, Vector, absolute, clip, largest, maximum, minimum, smallest, sqrt, where


def quarters(model: Model, law: str) -> tuple[tuple[int, ...], bool]:
    """The vehicle's rotors front right, back right, back left, front left, and whether the first spins clockwise, seen from
    above. law: its `type`.

    Raises UserError for a vehicle that has not one in each quarter, spinning in turn.
    """
    _, about_x, about_y, about_z = model.mixing
    places = [(-pitch, roll) for roll, pitch in zip(about_x, about_y, strict=True)]  # forward, left [m]
    corners = ((1, -1), (-1, -1), (-1, 1), (1, 1))
    found = [[i for i, (x, y) in enumerate(places) if x * front > 0.0 and y * left > 0.0] for front, left in corners]
    rotors = tuple(one[0] for one in found if len(one) == 1)
    spins = [about_z[rotor] > 0.0 for rotor in rotors]
    if len(rotors) != 4 or len(places) != 4 or spins not in ([False, True] * 2, [True, False] * 2):
        raise UserError(
            f'controller.type = "{law}": flies four rotors, one in each quarter, neighbours spinning opposite ways'
        )
    return rotors, spins[0]


def thrust_of_command(command: Number, factor: Number) -> Number:
    """A motor's thrust, as PX4 and ArduPilot take it: factor c^2 + (1 - factor) c, of the largest.

    factor: THR_MDL_FAC, MOT_THST_EXPO.
    """
    return factor * command * command + (1.0 - factor) * command


def command_of_thrust(thrust: Number, factor: Number) -> Number:
    """The command that makes a share of the largest thrust."""
    some = factor > 0.0
    a = where(some, factor, 1.0)
    half = (1.0 - a) / (2.0 * a)
    return where(some, sqrt(half * half + thrust / a) - half, thrust)


@dataclass(frozen=True)
class OnQuarters:
    """A law of four rotors by their place. rotors: of the vehicle, as `quarters` gives them. mirrored: whether the first spins
    clockwise.
    """

    rotors: tuple[int, ...] = (0, 1, 2, 3)
    mirrored: bool = False

    name: ClassVar[str]

    @classmethod
    def for_vehicle(cls, model: Model) -> Self:
        """With its rotors in the firmware's order."""
        return cls(*quarters(model, cls.name))


COUNTS = 65535.0
"""Of a rotor at full command."""

FULL_SPEED = gain(
    lambda model: model.fastest,
    "rad/s",
    "speed of a rotor at full command; default: the vehicle's",
    tunable=False,
    group=BELIEF,
)

HOVER_SPEED = given(lambda model: sqrt(model.mass * model.gravity / (model.rotors * model.per_speed)))
"""Of a rotor that carries its share [rad/s]."""

FULL = gain(
    lambda model: model.per_speed * model.fastest * model.fastest,
    "N",
    "thrust of a rotor at full command; default: the vehicle's",
    tunable=False,
    group=BELIEF,
)
"""What a count means is the vehicle's, no parameter of the firmware."""


def crazyflie_thrusts(
    counts: tuple[Number, Number, Number, Number], rotors: tuple[int, ...], mirrored: bool, full: Number
) -> Vector:
    """The thrust of every rotor [N], in the vehicle's order, after the firmware's mixer and limits.

    counts: thrust, roll to the right, pitch nose up, yaw to the left. rotors, mirrored: of `quarters`. full: thrust at full
    command [N]. Where one rotor is asked for more than it has, all give up the excess, so that thrust goes before turning.
    """
    thrust, roll, pitch, turn = counts
    r, p, y = 0.5 * roll, 0.5 * pitch, -turn if mirrored else turn
    asked = (thrust - r + p - y, thrust - r - p + y, thrust + r - p - y, thrust + r + p + y)
    excess = maximum(largest(asked) - COUNTS, 0.0)
    made = {rotor: maximum(one - excess, 0.0) * (full / COUNTS) for rotor, one in zip(rotors, asked, strict=True)}
    return Vector(made[rotor] for rotor in sorted(made))


class ArduPilotMixed(NamedTuple):
    """thrusts: of the rotors, 0 to 1. The others are 1 or 0, whether roll and pitch, yaw, and throttle are at their limits."""

    thrusts: Vector
    tilting: Number
    turning: Number
    upper: Number
    lower: Number


def ardupilot_factors(model: Model) -> Matrix:
    """A row for each rotor: its factors of roll, pitch and yaw, the largest of each 0.5, as ArduPilot normalises a frame's."""
    columns = []
    for row in model.mixing[1:]:
        most = largest([absolute(one) for one in row])
        columns.append(Vector(0.5 * one / maximum(most, 1e-9) for one in row))
    return Matrix(columns).T


def ardupilot_mixed(factors: Matrix, torque: Vector, throttle: Number, average: Number, headroom: Number) -> ArduPilotMixed:
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
    return ArduPilotMixed(Vector(base + scale * part for part in parts), cut, maximum(short, cut), upper, lower)


TINY = 1.1920929e-7
"""Of a share, below which a torque counts as made: an f32's step at one."""

WEAK = 0.2
"""Of the mixer's entries: no rotor with a smaller one is used to leave a limit."""

YAW_REACH = 1.15
"""Of full output: how far yaw may ask beyond it; the thrust then gives way."""

COEFFICIENT = 6.5
"""Of a rotor's thrust in PX4's geometry, where `CA_ROTORn_CT` says nothing."""


class Px4Mixer(NamedTuple):
    """outputs: a row for each rotor, its output for a share of roll, pitch, yaw torque and of thrust. torques: what a rotor's
    output makes of them, shape (3, rotors).
    """

    outputs: Matrix
    torques: Matrix


def px4_mixer(model: Model) -> Px4Mixer:
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
    return Px4Mixer(Matrix(Vector(row) for row in zip(*columns, strict=True)), Matrix(torques))


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


def px4_mixed(by: Matrix, torque: Vector, thrust: Number, airmode: Number) -> Vector:
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


def px4_missed(by: Matrix, torque: Vector, outputs: Vector) -> Vector:
    """1 or -1 for each torque of which the rotors do not make all, by the sign of what is missing; 0 for the others."""
    short = torque - by @ outputs
    failed = short @ short >= 1e-6
    return Vector(where(failed, where(one > TINY, 1.0, where(one < -TINY, -1.0, 0.0)), 0.0) for one in short)
