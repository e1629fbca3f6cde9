"""What the Crazyflie's stock controllers share: their parameters, and how they turn counts into thrust of four rotors.

Facts of the firmware of August 2026 (bitcraze/crazyflie-firmware, 2026.08, platform cf2): its documentation, parameters and
behaviour, which `tests/test_control_crazyflie.py` compares with the firmware itself. Commands are counts of 1/65535 of a
rotor's largest thrust; here they are not rounded to whole ones.
"""

from quadstep.interfaces.gain import BELIEF, gain
from quadstep.numbers import Number, Vector, largest, maximum

COUNTS = 65535.0
"""Of a rotor at full command."""

FULL = gain(
    lambda model: model.per_speed * model.fastest * model.fastest,
    "N",
    "thrust of a rotor at full command; default: the vehicle's",
    tunable=False,
    group=BELIEF,
)
"""What a count means is the vehicle's, no parameter of the firmware."""


def rotor_thrusts(
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
