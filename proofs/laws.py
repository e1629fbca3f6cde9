"""Learning, the command filter and the form of Theorem A: statements emitted from `control`."""

from proofs.statement import Statement, above, at_most, equal, matrix_of, state, vector_of
from proofs.terms import generalised, term, variable
from quadstep.control.filters import Filtered, command_filter
from quadstep.interfaces.learning import Net, weight_rate
from quadstep.numbers import Matrix, Vector, exp
from quadstep.proofs.theory.lyapunov import inner

NEURONS = 2
"""Of the statements; each holds neuron by neuron, and the test of random loops takes other numbers."""


def learning() -> list[Statement]:
    """T7 and T16."""
    ideal, error = matrix_of("w", NEURONS), matrix_of("e", NEURONS)
    weights, mu, r = matrix_of("w", NEURONS), vector_of("m", NEURONS), vector_of("r")
    rate, kappa, size, period, bound = (variable(name) for name in ("f", "kappa", "size", "period", "bound"))
    net = Net(Matrix([]), rate, kappa)
    change = weight_rate(net, weights, mu, period * r, period * size)
    after = weights + change
    return [
        state("T7", "tr(W~^T W^) <= |W~| |W| - |W~|^2, two neurons",
              at_most(inner(error, ideal - error), error.norm() * ideal.norm() - inner(error, error))),
        state("T16", "|W^| <= bound is kept by a sample of Eq. 54, bound >= sqrt(N) / kappa, F kappa |r| T <= 1, two neurons",
              at_most(inner(after, after), bound * bound),
              [above(kappa, 0.0), above(rate, 0.0), above(period, 0.0), at_most(0.0, size), above(bound, 0.0),
               at_most(float(NEURONS), kappa * bound * (kappa * bound)), at_most(rate * kappa * size * period, 1.0),
               at_most(inner(weights, weights), bound * bound), at_most(r @ r, size * size),
               *(at_most(0.0, entry) for entry in mu), *(at_most(entry, 1.0) for entry in mu)]),
    ]  # fmt: skip


def filtering() -> Statement:
    """T14: value' - command and y' - command, y = value + rate / frequency, for any decay."""
    x, rate, command, frequency, period = (variable(name) for name in ("x", "rate", "command", "w", "period"))
    decay = variable("decay")
    names = {term(exp(-(frequency * period))): term(decay)}
    after = command_filter(Filtered(Vector([x]), Vector([rate])), Vector([command]), frequency, period)
    value, speed = (generalised(part[0], names) for part in after)
    y = x + rate / frequency
    return state(
        "T14", "the sampled command filter is a chain of two lags",
        equal(Vector([value - term(command), value + speed / term(frequency) - term(command)]),  # type: ignore[list-item]
              Vector([decay * (x - command + frequency * period * (y - command)), decay * (y - command)])),
        [above(frequency, 0.0)],
    )  # fmt: skip


def statements() -> list[Statement]:
    """T7, T13, T14, T16."""
    x, y, z, k1, k2, l2, u = (variable(name) for name in ("x", "y", "z", "k1", "k2", "l2", "u"))
    p = 2.0 * l2 * k2
    form = k1 * x * x + p * l2 * y * y + k2 * z * z - u * x * y - p * y * z
    return [
        *learning(),
        filtering(),
        state("T13", "the form of Theorem A is not negative where u^2 < 4 k1 k2 l2^2", at_most(0.0, form),
              [above(k1, 0.0), above(k2, 0.0), above(l2, 0.0), above(4.0 * k1 * k2 * l2 * l2, u * u)]),
    ]  # fmt: skip
