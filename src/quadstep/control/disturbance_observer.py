"""What moves a vehicle beside what the model explains, by an observer of second order (Gao 2003)."""

from quadstep.numbers import Number, Vector


def observed(
    value: Vector, unexplained: Vector, measured: Vector, rate: Vector, bandwidth: Number, period: Number
) -> tuple[Vector, Vector]:
    """Estimates of a value and of what its rate has beside `rate`, one period [s] later: both poles at -bandwidth [1/s]."""
    error = measured - value
    value = value + period * (rate + unexplained + (2.0 * bandwidth) * error)
    return value, unexplained + (period * (bandwidth * bandwidth)) * error
