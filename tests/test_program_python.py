"""A law compiled to a Python function gives what it gives number by number, to the sign of a zero, in f64 and f32."""

import math

import numpy as np
import pytest

from quadstep.engines.eager import always
from quadstep.export.c.compiled import exported
from quadstep.export.c.golden import golden, golden_header
from quadstep.numbers import (
    Matrix,
    Table,
    atan2,
    cos,
    exp,
    flatten,
    log,
    matrix,
    rebuild,
    scan,
    sigmoid,
    sin,
    sqrt,
    vector,
    where,
)
from quadstep.numbers.noise import Key, normals
from quadstep.program.python_code import compiled
from tests.exports import paper_mission, plane_mission, real_mission
from tests.needs import POLICY, needs
from tests.single import Single

NUMBERS = (0.0, -0.0, 1.0, -2.0, 0.3, 1e-30, -1e5, 3.1, 1e30, math.inf, -math.inf, math.nan)


def one_by_one(law, given, precise):
    """The law on Python's floats, or one f32 after the other, in place of `compiled`."""
    kind = float if precise else Single

    def run(*structures):
        leaves = (leaf if isinstance(leaf, Table) else kind(float(leaf)) for leaf in flatten(structures))
        return always(law)(*rebuild(structures, leaves))

    return run


def bits(structure):
    """The numbers, each as it prints: zeros with their signs."""
    return [repr(float(leaf)) for leaf in flatten(structure)]


def agree(law, *given):
    with np.errstate(all="ignore"):
        for precise in (True, False):
            assert bits(compiled(law, given, precise)(*given)) == bits(one_by_one(law, given, precise)(*given))


@pytest.mark.parametrize("function", [sin, cos, exp, sigmoid, log, sqrt, abs])
def test_functions(function):
    for value in NUMBERS:
        agree(lambda x: (function(x), function(0.5 * x)), value)


@pytest.mark.filterwarnings("ignore:Bitwise inversion")  # Python's, of True and False
def test_operations_are_neither_folded_nor_rounded_twice():
    def law(x, y):
        chosen = where((x < y) & ~(x == 0.0) | (y >= 3.0), x, 1.0 - y)
        return (
            x * 0.0,
            0.0 - x,
            x - 0.0,
            -x,
            0.1 * x + 1,
            x / y,
            2.0 / y,
            atan2(y, x),
            atan2(1.0, x),
            chosen,
            where(x != y, 1, 2),
        )

    for x in NUMBERS:
        for y in NUMBERS:
            agree(law, x, y)


def test_scans_products_and_noise():
    def law(a, net, rows):
        def step(carry, row):
            last, drawn = carry
            here, planned = row

            def inner(count, weights):
                return count + weights @ planned, vector(count, last)

            count, made = scan(inner, last, net, backwards=True)
            noise = normals(Key(vector(a, 2.0 * a, a, a)), 3, drawn, 3)
            return (0.1 * count, drawn + 1.0), (here + made.map_rows(lambda one: one.norm())[0] * noise, vector(drawn))

        seen = (net @ vector(a, 1.0, 2.0)).map(sigmoid)
        return *scan(step, (a, 5.0 * a), (rows, rows * a)), seen, net.T @ seen, net @ (rows.T)

    net = Matrix([vector(0.1 * i, -0.2, 0.3 / (i + 1.0)) for i in range(6)])
    agree(law, 1.0, net, matrix((1.0, 2.0, 3.0), (0.1, 0.2, -0.3)))


def test_entries_of_a_table_are_rounded_before_they_are_used():
    def law(index, table):
        return table.at(index) * table.at(index + 4.0), table.at(0.0), table.at(0.0 * (index / 0.0))

    given = 1.0, Table([0.1, 0.2, 0.3])
    for precise, real in ((True, np.float64), (False, np.float32)):
        with np.errstate(all="ignore"):
            assert compiled(law, given, precise)(*given) == (real(0.2) * real(0.3), real(0.1), real(0.3))


def test_a_number_that_is_being_traced_decides_nothing():
    for law in (lambda x: 1.0 if x < 2.0 else 0.0, lambda x: x and 1.0, lambda x: x**2.0, float):
        with pytest.raises(TypeError):
            compiled(law, (1.0,), True)


MISSIONS = {
    "pid": real_mission({"type": "pid"}),
    "rotation-backstepping": real_mission({"type": "rotation-backstepping", "nets": {"neurons": 10}}),
    "mpc": real_mission({"type": "mpc"}),
    "mppi": real_mission({"type": "mppi"}),
    "raptor": real_mission({"type": "raptor"}) if POLICY.here() else None,
    "paper's": paper_mission({"type": "completed-backstepping"}),
    "planar": plane_mission({"type": "planar-linearisation"}),
}


@pytest.mark.parametrize("precise", [True, False], ids=["f64", "f32"])
@pytest.mark.parametrize("name", [pytest.param(name, marks=needs(POLICY) if name == "raptor" else ()) for name in MISSIONS])
def test_golden_vectors_are_those_of_the_law_number_by_number(monkeypatch, name, precise):
    monkeypatch.setattr("quadstep.control.mppi.SAMPLES", 3)
    monkeypatch.setattr("quadstep.export.c.golden.MOST_OPERATIONS", 100_000)
    plan = MISSIONS[name].plan()
    law = exported(plan, precise)
    texts = []
    for way in (compiled, one_by_one):
        monkeypatch.setattr("quadstep.export.c.golden.compiled", way)
        texts.append(golden_header(law, golden(law, lambda t: plan.loop.reference(t, plan.parameters))))
    assert texts[0] == texts[1]
