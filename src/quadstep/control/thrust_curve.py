"""The thrust of a motor over its command, as autopilots take it: part of it goes with the command, part with its square."""

from quadstep.numbers import Number, sqrt, where


def thrust_of_command(command: Number, factor: Number) -> Number:
    """factor c^2 + (1 - factor) c, of the largest thrust. factor: THR_MDL_FAC, MOT_THST_EXPO."""
    return factor * command * command + (1.0 - factor) * command


def command_of_thrust(thrust: Number, factor: Number) -> Number:
    """The command that makes a share of the largest thrust."""
    some = factor > 0.0
    a = where(some, factor, 1.0)
    half = (1.0 - a) / (2.0 * a)
    return where(some, sqrt(half * half + thrust / a) - half, thrust)
