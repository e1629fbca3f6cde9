"""Enclosures contain a law's values on a box: every function, every law, in f64 and in exact arithmetic."""

from fractions import Fraction

import mpmath
import numpy as np
import pytest

from quadstep import Mission
from quadstep import numbers as n
from quadstep.control.registry import controllers
from quadstep.numbers.affine import HALF_UNIT, MOST_SUMMED, UP
from quadstep.numbers.enclosure import ENCLOSURES, Enclosure, UndefinedError
from quadstep.numbers.functions import sinc
from quadstep.proofs.prove.sampled import SampledLoop
from quadstep.proofs.prove.unknown import seeded
from quadstep.vehicle.paper import State
from tests.enclosures import outside, spread, states

CENTRES = np.array([[0.3, -1.2, 2.5, 40.0], [0.7, 0.9, 1e-3, 3.0]])
RADII = np.array([1e-6, 1e-3, 0.05, 0.2])


def square(x):
    """Its product with itself."""
    return x * x


FUNCTIONS = {
    "sum": lambda a, b: a + b - 3.0 * a,
    "product": lambda a, b: a * b,
    "square": lambda a, b: a * a,
    "quotient": lambda a, b: b / (a * a + 2.0),
    "sin": lambda a, b: n.sin(a),
    "cos": lambda a, b: n.cos(a),
    "exp": lambda a, b: n.exp(0.1 * a),
    "sigmoid": lambda a, b: n.sigmoid(a),
    "sinc": lambda a, b: sinc(a - 0.3),
    "log": lambda a, b: n.log(a * a + 1.0),
    "sqrt": lambda a, b: n.sqrt(a * a + b * b),
    "atan2": lambda a, b: n.atan2(a, b + 1.0),
    "abs": lambda a, b: n.absolute(b - 0.01),
    "clip": lambda a, b: n.clip(a, -1.2, 2.5),
    "where": lambda a, b: n.where(b < 0.7, a, b * b),
    "minimum": n.minimum,
    "maximum, undecided": lambda a, b: n.maximum(a, CENTRES[0] + 0.3 * (b - CENTRES[1])),
    "minimum, undecided": lambda a, b: n.minimum(a, CENTRES[0] + 0.3 * (b - CENTRES[1])),
    "quotient by a maximum": lambda a, b: b / n.maximum(n.absolute(a - CENTRES[0]), 1e-3),
    "sums and multiples of squares": lambda a, b: 1.0 / (2.0 * square(a - CENTRES[0]) + 1e-4 + square(b)),
}

EXACT = {
    "sin": mpmath.sin, "cos": mpmath.cos, "sigmoid": lambda x: 1 / (1 + mpmath.exp(-x)), "exp": lambda x: mpmath.exp(x / 10),
}  # fmt: skip


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_stays_in_its_enclosure(name):
    most, _ = outside(lambda x: [FUNCTIONS[name](*x)], CENTRES, RADII, points=200)
    assert most <= 0.0


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_stays_in_its_enclosure_of_second_order(name):
    """Where products of directions have directions of their own, what is of third order is left to the rest."""
    count, rng = len(CENTRES), np.random.default_rng(3)
    found = FUNCTIONS[name](*seeded(CENTRES, spread(CENTRES, RADII), spare=count * count + 4, second=count))
    others = found.rest + np.abs(found.parts[count + count * count :]).sum(axis=0)
    rounding = 1e-15 * (np.abs(found.centre) + np.abs(found.parts).sum(axis=0))
    for trial in range(200):
        e = rng.uniform(-1.0, 1.0, CENTRES.shape)
        e = np.sign(e) if trial % 2 else e
        powers = np.concatenate([e, (e[:, None] * e).reshape(count * count, -1)])
        parabola = found.centre + (found.parts[: len(powers)] * powers).sum(axis=0)
        assert (np.abs(FUNCTIONS[name](*(CENTRES + RADII * e)) - parabola) <= others + rounding).all()


@pytest.mark.parametrize("name", EXACT)
def test_a_box_without_width_holds_the_exact_value_and_the_one_that_flies(name):
    """Two roundings apart at most: the rest is a few units in the last place."""
    numbers = seeded(CENTRES, spread(CENTRES, 0.0))
    found: Enclosure = FUNCTIONS[name](*numbers)
    with mpmath.workdps(40):
        for i, x in enumerate(CENTRES[0]):
            true = EXACT[name](mpmath.mpf(float(x)) if name != "exp" else mpmath.mpf(0.1) * mpmath.mpf(float(x)) * 10)
            assert abs(true - mpmath.mpf(float(found.centre[i]))) <= found.rest[i] < 1e-12 * (1.0 + abs(true))


@pytest.mark.parametrize(("function", "true", "x"), [
    (n.sigmoid, EXACT["sigmoid"], -600.3),
    (n.sin, mpmath.sin, 355.0),
    (n.cos, mpmath.cos, 1.5707963267948966),
    (n.sin, mpmath.sin, 1e5 * np.pi),
])  # fmt: skip
def test_what_is_off_beside_one_and_not_beside_the_value_is_held_too(function, true, x):
    found = function(seeded(np.array([[x]]), np.zeros((1, 1)))[0])
    with mpmath.workdps(60):
        assert abs(true(mpmath.mpf(float(x))) - mpmath.mpf(float(found.centre[0]))) <= found.rest[0] < 1e-12


def test_the_larger_of_two_is_never_below_either():
    a = seeded(np.array([[0.0]]), np.array([[1.0]]))[0]
    found = n.maximum(a, 1e-3)
    assert found.low[0] >= 1e-3
    assert found.tight[0] < 0.76  # |0.5 a| and a quarter of what the two are apart
    assert (1.0 / found).high[0] <= 1001.0
    assert n.absolute(a).low[0] == 0.0


def test_a_number_is_not_below_itself():
    a, b = seeded(CENTRES, spread(CENTRES, 0.1))
    same = wide = a * b
    assert not np.any((wide < same).holds)
    assert not np.any((wide <= same).fails)
    assert not np.any((wide > same).holds)
    assert not np.any((wide >= same).fails)


def test_what_is_linear_cancels():
    a, b = seeded(CENTRES, spread(CENTRES, 0.1))
    assert np.all((a + b - a - b).tight < 1e-12)


@pytest.mark.parametrize(("law", "text"), [
    (lambda a, b: 1.0 / (a - 0.3), "a division by a number that may be zero"),
    (lambda a, b: n.sqrt(b - 0.7), "a square root of a number that may be negative"),
    (lambda a, b: n.log(b - 0.7), "a logarithm of a number that may be zero or negative"),
    (lambda a, b: n.atan2(a - 0.3, b - 0.7), "of a point that may be the origin"),
    (lambda a, b: n.atan2(a - 0.3, -b), "an angle across its jump"),
])  # fmt: skip
def test_a_singularity_in_the_box_is_named_with_its_place(law, text):
    with pytest.raises(UndefinedError, match=text) as caught:
        law(*seeded(CENTRES[:, :1], spread(CENTRES[:, :1], 0.1)))
    assert "test_prove_enclosures.py, line" in str(caught.value)


@pytest.mark.parametrize("name", ["sqrt", "log"])
def test_a_floor_above_the_centre_leaves_the_form_right(name):
    centre, radius = np.array([0.01, -0.2, 0.5]), np.array([1.0, 0.9, 0.1])
    floor = np.array([0.3, 0.1, 0.45])
    x = Enclosure(centre, radius[None], np.zeros(3), radius, None, floor)
    found = getattr(ENCLOSURES, name)(x)
    for e in np.linspace(-1.0, 1.0, 41):
        value = centre + radius * e
        off = np.abs(getattr(np, name)(np.maximum(value, floor)) - (found.centre + found.parts[0] * e)) - found.rest
        assert np.all((value < floor) | (off <= 1e-14))


def test_a_sum_of_squares_may_vanish():
    a, b = seeded(CENTRES[:, :1], spread(CENTRES[:, :1], 0.1))
    length = n.vector(a - 0.3, b - 0.7).norm()
    assert length.low[0] > -1e-9
    assert np.sqrt(2.0) * 0.1 <= length.high[0] < 0.1415


def test_the_allowance_for_rounding_covers_the_sums_that_lose_most():
    """Each is half a unit of the sum so far, or a little more: all that is added is lost, or as much again won."""
    for each in (HALF_UNIT, 1.001 * HALF_UNIT):
        numbers = np.full(MOST_SUMMED, each)
        numbers[0] = 1.0
        exact, found = sum(map(Fraction, numbers.tolist())), Fraction(float(np.cumsum(numbers)[-1]))
        assert abs(exact - found) > found * Fraction(HALF_UNIT) * MOST_SUMMED * 9 / 10
        assert exact < found * Fraction(UP) < exact * (1 + Fraction(1, 10**10))


LAWS = {name: {} for name in controllers(State)}


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("size", [1e-6, 1e-3])
def test_a_sample_of_every_law_of_the_papers_plant_stays_in_its_enclosure(name, size):
    path = {"type": "minimum-jerk", "end": [1.0, 0.5, 2.0], "duration": 3.0}
    loop = SampledLoop(Mission(path=path, controller={"type": name}).plan())
    centres, ticks = states(loop, 3, 1e-2)
    most, rest = outside(lambda x: loop.step(x, ticks), centres, size, points=6)
    assert most <= 0.0
    assert rest.max() < 200.0 * size * size + 1e-12  # nearly linear: what is left is of second order
