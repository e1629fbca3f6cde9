"""Theorem B in numbers: a sublevel set of L that the completed law does not leave, checked in exact rationals.

docs/theory.md has the proof. The norms s = (|r1|, |I1|, |e1|, |e2|, |r2|, |I2|, |a|, |b|, |a_c|, |b_c|) obey
L_dot <= -s^T Q s + d . s wherever L <= level; a, b and a_c, b_c are the errors of the two stages of the command filter and of
the counter-rate's. Where Q - rate M - diag(tau) is positive definite, L_dot <= -2 rate L + sum d^2 / (4 tau).
"""

from collections.abc import Callable, Sequence
from fractions import Fraction
from math import isqrt
from typing import NamedTuple

from quadstep.numbers.solve import solve_square

GRID = 2**40
"""Numbers are rounded to multiples of 1 over this, on the safe side, so that exact elimination stays quick."""


def above(x: Fraction) -> Fraction:
    return Fraction(-(-x.numerator * GRID // x.denominator), GRID)


def root_above(x: Fraction) -> Fraction:
    """A number not below sqrt(x), x >= 0."""
    scaled = above(x) * GRID * GRID
    return Fraction(isqrt(int(scaled)) + 1, GRID)


def positive_definite(matrix: Sequence[Sequence[Fraction]]) -> bool:
    """Whether x^T M x > 0 for every x != 0, M symmetric: every pivot of the elimination is positive. Exact."""
    rows = [list(row) for row in matrix]
    for i, pivot in enumerate(rows):
        if pivot[i] <= 0:
            return False
        for row in rows[i + 1 :]:
            factor = row[i] / pivot[i]
            for k in range(i, len(row)):
                row[k] -= factor * pivot[k]
    return True


def support(matrix: Sequence[Sequence[Fraction]], direction: Sequence[Fraction]) -> Fraction:
    """direction^T M^-1 direction, M positive definite: the square of the largest direction . x where x^T M x <= 1. Exact."""
    return sum((a * b for a, b in zip(direction, solve_square(matrix, direction), strict=True)), Fraction(0))


NORMS = ("r1", "I1", "e1", "e2", "r2", "I2", "a", "b", "a_c", "b_c")
R1, I1, E1, E2, R2, I2, A, B, AC, BC = range(len(NORMS))
SIZE = len(NORMS)

BENDING = Fraction("1.28")
"""|B_dot^T r| is at most so many times (|eta_f_dot| + |eta_dot|) |r|."""

Form = list[list[Fraction]]
Line = list[Fraction]


class Setting(NamedTuple):
    """The loop that the theorem is applied to; gains and inertia the same on every axis. Symbols of docs/theory.md, SI units.

    acceleration, jerk: largest of the path. yaw_rate: its largest [rad/s]. force, torque: bounds on the unknown ones [N],
    [N m]. bias: bound on a constant unknown force, which the integral takes over [N]; the weight of a wrong mass is one.
    """

    mass: Fraction
    gravity: Fraction
    slope_1: Fraction
    gain_1: Fraction
    integral_1: Fraction
    inertia: Fraction
    slope_2: Fraction
    gain_2: Fraction
    integral_2: Fraction
    coupling: Fraction
    filter_frequency: Fraction
    acceleration: Fraction
    jerk: Fraction
    yaw_rate: Fraction
    force: Fraction
    torque: Fraction
    bias: Fraction


class Shape(NamedTuple):
    """Weights of L: cross terms of the integrals, e1, the stages of the command filter and of the counter-rate's filter."""

    cross_1: Fraction
    cross_2: Fraction
    position: Fraction
    command_1: Fraction
    command_2: Fraction
    counter_1: Fraction
    counter_2: Fraction


class LevelBounds(NamedTuple):
    """Bounds that hold wherever L <= level. force: |F - m g e_z| [N]. thrust: most u [N]. vertical: least f_z [N].

    largest: of every norm. inertia: least and largest eigenvalue of J. columns: |B|. rates: |eta_dot| [rad/s].
    """

    force: Fraction
    thrust: Fraction
    vertical: Fraction
    largest: Line
    inertia: tuple[Fraction, Fraction]
    columns: Fraction
    rates: Fraction


class Region(NamedTuple):
    """A certificate. level [J]; rate [1/s]; ultimate: where L ends [J]; bounds inside; shape of L."""

    level: Fraction
    rate: Fraction
    ultimate: Fraction
    bounds: LevelBounds
    shape: Shape


SHAPE = Shape(*map(Fraction, ("0.065", "0.038", "0.52", "51", "61", "0.7", "0.66")))
"""Found by a search for the defaults; any other shape that passes is as good."""

LEVEL, RATE = Fraction("0.05"), Fraction("0.015")
SHARE = Fraction(1, 20)
"""Share of the diagonal of Q that is spent on external inputs to L."""


def line(**parts: Fraction) -> Line:
    """A bound that is linear in the norms, by their names."""
    row = [Fraction(0)] * SIZE
    for name, value in parts.items():
        row[NORMS.index(name)] += value
    return row


def plus(*lines: Line) -> Line:
    return [sum(column, Fraction(0)) for column in zip(*lines, strict=True)]


def times(factor: Fraction, row: Line) -> Line:
    return [factor * entry for entry in row]


def outer_form(s: Setting, shape: Shape) -> Form:
    """The part of 2 L in (r1, I1, e1), a lower bound."""
    cross = -shape.cross_1 * s.mass
    zero = Fraction(0)
    return [[s.mass, cross, zero], [cross, s.integral_1, zero], [zero, zero, shape.position]]


def bounds_of(s: Setting, shape: Shape, level: Fraction) -> LevelBounds | None:
    """The bounds that L <= level implies; None where it implies too little (falling, or a tilt whose sine exceeds 1)."""
    outer, twice, weight = outer_form(s, shape), 2 * level, s.mass * s.gravity
    if not positive_definite(outer):
        return None
    pull = [s.gain_1, s.integral_1, s.mass * s.slope_1**2]
    force = s.bias + s.mass * s.acceleration + root_above(twice * support(outer, pull))
    filters = (shape.command_1, shape.command_2, shape.counter_1, shape.counter_2)
    r1, i1, e1 = (root_above(twice * support(outer, [Fraction(int(i == k)) for i in range(3)])) for k in range(3))
    a, b, a_c, b_c = (root_above(twice / weight_of) for weight_of in filters)
    e2 = root_above(twice / s.coupling)
    sine = above(force / weight + a + b + e2)  # sin(x + y) <= sin x + y
    if sine >= 1:
        return None
    low, high = s.inertia * (1 - sine), s.inertia * (1 + sine)
    inner = [[low, -shape.cross_2 * high], [-shape.cross_2 * high, s.integral_2]]
    if not positive_definite(inner):
        return None
    r2, i2 = (root_above(twice * support(inner, [Fraction(int(i == k)) for i in range(2)])) for k in range(2))
    columns = root_above(1 + sine * e2 / 2)
    thrust = weight + force
    counter = columns * thrust * r1 / s.coupling + a_c + b_c
    rates = s.yaw_rate + s.filter_frequency * b + r2 + s.slope_2 * e2 + counter
    largest = [r1, i1, e1, e2, r2, i2, a, b, a_c, b_c]
    return LevelBounds(force, thrust, weight - force, largest, (low, high), columns, rates)


def decay(s: Setting, shape: Shape, bounds: LevelBounds, rounded: Callable[[Fraction], Fraction] = above) -> tuple[Form, Line]:
    """(Q, d) of L_dot <= -s^T Q s + d . s. Every line is a term of the proof in docs/theory.md.

    rounded: upwards, what is subtracted from Q.
    """
    u, column, r1 = bounds.thrust, bounds.columns, bounds.largest[R1]
    surplus = s.gain_1 - s.mass * s.slope_1
    w, high = s.filter_frequency, bounds.inertia[1]
    one = Fraction(1)
    lag = line(a=u, b=u)  # |delta_f|
    pushed = plus(lag, line(e2=u))
    speeding = times(1 / s.mass, plus(line(r1=surplus, I1=s.integral_1), pushed))  # |r1_dot|
    of_r1 = abs(s.integral_1 - s.mass * s.slope_1**2 - s.gain_1 * surplus / s.mass)
    changing = plus(
        line(r1=of_r1, e1=s.mass * s.slope_1**3, I1=s.gain_1 * s.integral_1 / s.mass), times(s.gain_1 / s.mass, pushed)
    )  # |F_dot|
    command = times(1 / bounds.vertical, changing)  # |d/dt (theta_d, phi_d)|
    turning = plus(line(b=2 * w, r2=one, e2=s.slope_2, a_c=one, b_c=one), line(r1=column * u / s.coupling))
    bending = BENDING * u * r1
    counter = times(
        1 / s.coupling, plus(times(column * r1, changing), times(bending, turning), times(column * u, speeding))
    )  # |d/dt c_raw|

    grown: Form = [[Fraction(0)] * SIZE for _ in range(SIZE)]

    def add(row: int, bound: Line) -> None:
        grown[row] = plus(grown[row], bound)

    add(R1, plus(lag, line(r1=shape.cross_1 * s.mass, I1=shape.cross_1 * surplus)))
    add(I1, times(shape.cross_1, pushed))
    add(E1, line(r1=shape.position))
    add(E2, line(a_c=s.coupling, b_c=s.coupling))
    add(R2, line(r2=shape.cross_2 * high))
    coriolis = s.inertia * Fraction(7072, 10000) * bounds.rates  # |C| <= Sigma / sqrt 2 |eta_dot|
    add(I2, times(shape.cross_2, line(r2=s.gain_2 + coriolis, e2=s.coupling)))
    add(A, plus(times(shape.command_1, command), line(b=shape.command_2 * w)))
    add(AC, plus(times(shape.counter_1, counter), line(b_c=shape.counter_2 * w)))
    damped = [
        surplus, shape.cross_1 * s.integral_1, shape.position * s.slope_1, s.coupling * s.slope_2, s.gain_2 - high * s.slope_2,
        shape.cross_2 * s.integral_2, shape.command_1 * w, shape.command_2 * w, shape.counter_1 * w, shape.counter_2 * w,
    ]  # fmt: skip
    q = [
        [(damped[i] if i == k else Fraction(0)) - rounded((grown[i][k] + grown[k][i]) / 2) for k in range(SIZE)]
        for i in range(SIZE)
    ]
    jerked = s.mass * s.jerk + s.gain_1 * s.force / s.mass
    driven = line(
        r1=s.force, I1=shape.cross_1 * s.force, r2=s.torque, I2=shape.cross_2 * s.torque,
        a=shape.command_1 * jerked / bounds.vertical,
        a_c=shape.counter_1 * column * (r1 * jerked + u * s.force / s.mass) / s.coupling,
    )  # fmt: skip
    return q, driven


def upper_form(s: Setting, shape: Shape, bounds: LevelBounds) -> Form:
    """M of 2 L <= s^T M s."""
    high = bounds.inertia[1]
    diagonal = [
        s.mass, s.integral_1, shape.position, s.coupling, high, s.integral_2,
        shape.command_1, shape.command_2, shape.counter_1, shape.counter_2,
    ]  # fmt: skip
    form = [[diagonal[i] if i == k else Fraction(0) for k in range(SIZE)] for i in range(SIZE)]
    form[R1][I1] = form[I1][R1] = shape.cross_1 * s.mass
    form[R2][I2] = form[I2][R2] = shape.cross_2 * high
    return form


def certify_region(s: Setting, shape: Shape = SHAPE, level: Fraction = LEVEL, rate: Fraction = RATE) -> Region | None:
    """The certificate, or None where it does not hold: then L <= level is not shown to be invariant."""
    bounds = bounds_of(s, shape, level)
    if bounds is None:
        return None
    q, driven = decay(s, shape, bounds)
    form = upper_form(s, shape, bounds)
    spent = [SHARE * q[i][i] if driven[i] else Fraction(0) for i in range(SIZE)]
    left = [[above(q[i][k] - rate * form[i][k] - (spent[i] if i == k else 0)) for k in range(SIZE)] for i in range(SIZE)]
    for i in range(SIZE):
        left[i][i] -= Fraction(SIZE, 2**39)  # what rounding up may have added
    if not positive_definite(left):
        return None
    ultimate = sum((d * d / (4 * t) for d, t in zip(driven, spent, strict=True) if d), Fraction(0)) / (2 * rate)
    return Region(level, rate, ultimate, bounds, shape) if ultimate < level else None
