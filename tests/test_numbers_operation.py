"""A function of laws that is declared once, here, is known to every kind of number, engine and back end."""

import math
from fractions import Fraction

import numpy as np
import pytest
import sympy

from proofs.terms import coq, variable
from quadstep.numbers.affine import elementary_function
from quadstep.numbers.dual import Seeds
from quadstep.numbers.enclosure import Enclosure, ball
from quadstep.numbers.kinds import ARRAYS, FLOATS, functions_of
from quadstep.numbers.operation import KINDS, OPERATIONS, declare
from quadstep.program.python_code import compiled
from quadstep.proofs.prove.hover import ExactNumber
from quadstep.proofs.prove.jet import jets
from quadstep.proofs.prove.sampled import Influence
from tests.exports import COMPILERS, through_c
from tests.flights import through_lanes
from tests.needs import NODE, needs
from tests.scripts import through_script
from tests.single import Single

ARGUMENTS = np.array([-40.0, -3.0, -0.5, -1e-3, -0.0, 0.0, 1e-9, 0.25, 1.0, 2.5, 19.0, math.inf, math.nan])


def tanh(x):
    """Hyperbolic tangent."""
    return functions_of(x).tanh(x)


def tanh_steps(kind, x):
    part = kind.exp(-2.0 * abs(x))
    size = (1.0 - part) / (1.0 + part)
    return kind.where(x < 0.0, -size, size)


def tanh_enclosed(x: Enclosure) -> Enclosure:
    value = ARRAYS.tanh(x.centre)
    return elementary_function(x, value, 1.0 - value * value, 0.39 * x.tight * x.tight, 1e-15)


@pytest.fixture(scope="module", autouse=True)
def declared():
    declare(
        tanh,
        tanh_steps,
        tangents=(lambda t, _, value: t * (1.0 - value * value),),
        enclosure=tanh_enclosed,
        exact=lambda x: Fraction(0) if x == 0 else None,
    )
    yield
    del OPERATIONS["tanh"]
    for kind in KINDS:
        if "tanh" in vars(kind):
            del kind.tanh


def test_values_are_the_same_on_floats_arrays_lanes_and_in_python_code():
    floats = np.array([tanh(x) for x in ARGUMENTS.tolist()])
    np.testing.assert_allclose(floats, np.tanh(ARGUMENTS), rtol=0.0, atol=4e-16)
    np.testing.assert_array_equal(tanh(ARGUMENTS), floats)
    np.testing.assert_array_equal(through_lanes(tanh, ARGUMENTS), floats)
    np.testing.assert_array_equal(through_lanes(tanh, ARGUMENTS, width=1), floats)
    with np.errstate(all="ignore"):
        run = compiled(tanh, (0.0,), precise=True)
        np.testing.assert_array_equal([run(x) for x in ARGUMENTS], floats)


def test_values_are_the_same_in_f32():
    one_by_one = [float(tanh(Single(np.float32(x))).value) for x in ARGUMENTS]
    np.testing.assert_array_equal(through_lanes(tanh, ARGUMENTS, double=False), one_by_one)


@needs(NODE)
def test_javascript_is_generated_from_the_steps():
    np.testing.assert_array_equal(through_script(tanh, ARGUMENTS)[0], tanh(ARGUMENTS))


@pytest.mark.skipif(not COMPILERS, reason="no C compiler")
def test_c_is_generated_from_the_steps(tmp_path):
    np.testing.assert_array_equal(through_c(tmp_path, lambda x: [tanh(x)], ARGUMENTS)[0], tanh(ARGUMENTS))


def test_derivatives_follow_the_tangent():
    (x,) = Seeds(1, 1.0).seeded([0.5], 0)
    value = tanh(x)
    assert value.value == FLOATS.tanh(0.5)
    assert value.slopes[0] == pytest.approx(1.0 - math.tanh(0.5) ** 2, abs=1e-15)
    (jet,) = jets([0.5])
    slope = tanh(jet).slopes
    assert slope.low <= value.slopes[0] <= slope.high


def test_an_enclosure_has_every_value_of_its_numbers():
    box = tanh(ball(np.array([0.25]), 0.5))
    inside = np.tanh(np.linspace(-0.25, 0.75, 101))
    assert box.low <= inside.min()
    assert box.high >= inside.max()


def test_exact_numbers_dependence_symbols_and_proofs():
    assert tanh(ExactNumber(Fraction(0))).value == 0
    assert tanh(ExactNumber(Fraction(1))).value is None
    assert tanh(Influence(frozenset((3,)))).of == {3}
    assert tanh(sympy.Symbol("x")) == sympy.tanh(sympy.Symbol("x"))
    assert coq(tanh(variable("x"))) == "(tanh x)"
