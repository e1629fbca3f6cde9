"""Script numbers: JavaScript gives what Python floats give."""

import json
import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadstep.numbers import (
    Table,
    absolute,
    atan2,
    clip,
    cos,
    exp,
    log,
    maximum,
    minimum,
    power,
    sigmoid,
    sin,
    sqrt,
    vector,
    where,
)
from quadstep.numbers.noise import key, normals, uniforms
from quadstep.numbers.operation import OPERATIONS
from quadstep.page.laws import library
from quadstep.page.writing import Output, Writer
from quadstep.program.assignments import CONSTANT, Record
from quadstep.program.operations import FORMS, constant_text
from quadstep.program.recorded import RecordedNumber
from tests.pages import needs_node, run_node
from tests.scripts import through_script, written

SPECIAL = [0.0, -0.0, 1.0, -1.0, 0.5, -2.5, 3.0, 1e-300, -1e300, 1e5, math.inf, -math.inf, math.nan]


def through_floats(law, *columns, table=None):
    def one(sample):
        try:
            results = law(*sample, *([] if table is None else [table]))
        except ZeroDivisionError:
            return None
        return results if isinstance(results, list) else [results]

    return [one(sample) for sample in np.array(np.broadcast_arrays(*columns), dtype=float).T.tolist()]


def agree(law, *columns, table=None):
    script, floats = through_script(law, *columns, table=table).T, through_floats(law, *columns, table=table)
    assert any(results is not None for results in floats)
    for got, wanted in zip(script, floats, strict=True):
        if wanted is not None:
            np.testing.assert_array_equal(got, wanted)


PAIRS = np.array([(a, b) for a in SPECIAL for b in SPECIAL]).T


@needs_node
def test_arithmetic_and_comparisons_are_those_of_floats_to_the_bit():
    def law(a, b):
        return [
            a + b, a - b, a * b, a / b, -a, 2.0 + a, 2.0 - a, 0.0 - b, 3.0 * a, 1.5 / b, a / 4.0,
            where(a < b, 1.0, 2.0), where(a <= b, 1.0, 2.0), where(a > b, a, b), where(a >= b, 1.0, 2.0),
            where(a == b, 1.0, 2.0), where(a != b, 1.0, 2.0), where((a < b) & (a > 0.0), 1.0, 2.0),
            where((a < b) | (b > 0.0), 1.0, 2.0), minimum(a, b), maximum(a, b), clip(a, -1.0, 2.0), absolute(a),
        ]  # fmt: skip

    agree(law, *PAIRS)


@needs_node
def test_not_of_a_condition():
    record = through_script(lambda a: where(~(a < 0.0), 1.0, 2.0), [-1.0, 0.0, math.nan])
    assert record[0].tolist() == [2.0, 1.0, 1.0]


@needs_node
def test_functions_are_those_of_floats():
    x = np.concatenate([np.random.default_rng(1).normal(size=400) * 10.0 ** np.arange(-5, 5).repeat(40), SPECIAL])
    agree(lambda a: [sin(a), cos(a), exp(a), sqrt(a), log(a), sigmoid(a), power(a, 0.5), power(-a, 1.7)], x)
    agree(atan2, *PAIRS)
    agree(lambda a, b: [atan2(1.0, a), atan2(b, 2.0)], *PAIRS)


@needs_node
def test_a_table_is_looked_up_by_a_computed_index():
    table = Table([3.0, math.inf, -2.0, 7.5])
    values = json.dumps([3.0, "Infinity", -2.0, 7.5])
    script = written(lambda a, t: [t.at(a + 1.0), t.at(0)], 1, table)
    script += f"const T=Float64Array.from({values},Number);console.log([0,1,2].map(i=>law([i],T).join()).join(';'))"
    assert run_node(script).strip() == "Infinity,3;-2,3;7.5,3"


@needs_node
def test_random_numbers_are_the_same():
    seeded = key(2**63 + 12345, 7)
    ticks = np.arange(50.0)

    def law(tick):
        return [*normals(seeded, 3, tick, 3), *uniforms(seeded, 9, tick, 3)]

    agree(law, ticks)

    def keyed(a, b, c, d, tick):
        return list(uniforms(seeded._replace(words=vector(a, b, c, d)), 0, tick, 4))

    agree(keyed, *(np.full(50, word) for word in seeded.words), ticks)


@needs_node
@pytest.mark.parametrize("longest", [1, 3, 7, 1000])
def test_a_law_cut_into_functions_is_the_same_law(monkeypatch, longest):
    library()  # its functions are not to be cut
    monkeypatch.setattr("quadstep.page.writing.LONGEST", longest)

    def law(a, b):
        chain = a * a  # of the fixed input: computed once
        other = b
        shown = []
        for i in range(12):
            chosen = other > chain
            chain, other = chain + sin(other) * 0.5, other - chain * 0.25 + where(chosen, float(i), 0.5 * b)
            shown += [chain, where(chosen, other, chain)]
        return [*shown, a, b, 4.0]

    rng = np.random.default_rng(2)
    agree(law, rng.normal(size=20), rng.normal(size=20))


@needs_node
def test_outputs_that_change_places_do_not_overwrite_each_other():
    record = Record()
    places = [record.input(f"C[{i}]") for i in range(3)]
    swapped = [Output(f"C[{i}]", record.at(number)) for i, number in enumerate([places[1], places[2], places[0] * 2.0])]
    (text,) = Writer(record, []).functions(swapped)
    assert run_node(f"const C=[1,2,3];{text}console.log(C.join())").strip() == "2,3,2"
    cycle = [Output(f"C[{(i + 1) % 3}]", record.at(number)) for i, number in enumerate(places)]
    (text,) = Writer(record, []).functions(cycle)
    assert run_node(f"const C=[1,2,3];{text}console.log(C.join())").strip() == "3,1,2"


@needs_node
def test_deep_brackets_are_cut():
    def law(a):
        value = a
        for _ in range(3000):
            value = 1.0 + value * 0.5
        return value

    agree(law, [0.3, 2.0])


def record_of(law, count=2):
    record = Record()
    result = law(*(record.input(f"A[{i}]") for i in range(count)))
    return record, result


def test_constants_fold():
    def law(a, b):
        minus = -a
        return [a * 0.0, a * 1.0, a + 0.0, 0.0 + a, a - 0.0, a / 1.0, 0.0 / a, -minus]

    record, results = record_of(law)
    assert [result if isinstance(result, float) else result.place for result in results] == [0.0, 0, 0, 0, 0, 0, 0.0, 0]
    assert [node.operation for node in record.nodes if node.operation not in ("input", "negative")] == []


def test_what_was_computed_is_not_computed_again():
    record, results = record_of(lambda a, b: [a * b + 1.0, b * a + 1.0, 1.0 + a * b])
    assert len({result.place for result in results}) == 1
    assert [node.operation for node in record.nodes] == ["input", "input", "*", CONSTANT, "+"]


def test_zero_and_minus_zero_are_different_constants():
    record = Record()
    assert record.at(0.0) != record.at(-0.0)
    assert record.at(1) == record.at(1.0)


@given(st.floats())
def test_a_constant_is_written_so_that_it_reads_back(value):
    text = constant_text(value).strip("()").replace("Infinity", "inf")
    assert math.isnan(value) == math.isnan(float(text))
    assert math.isnan(value) or (float(text), math.copysign(1.0, float(text))) == (value, math.copysign(1.0, value))


def test_a_law_cannot_branch():
    record = Record()
    a = record.input("A[0]")
    with pytest.raises(TypeError, match="where"):
        bool(a)
    with pytest.raises(TypeError, match="where"):
        bool(a < 1.0)
    with pytest.raises(TypeError):
        hash(a)
    assert isinstance(where(a < 1.0, a, 0.0), RecordedNumber)
    assert where(a < 1.0, a, a) is a


def test_no_name_from_outside_reaches_the_text():
    """Operations come from one table and names from places; nothing else is ever written."""
    text = written(lambda a, b: sin(a) * b + where(a > b, exp(b), log(a)), 2)
    text = re.sub(r"\b0x[\dA-F]+|[\d.]+e[-+]?\d+", "0", text)
    names = set(re.findall(r"[A-Za-z_$][\w$]*", text))
    frame = {"use", "strict", "const", "new", "function", "law", "return", "Array", "from", "Float64Array"}
    assert {name for name in names if not re.fullmatch(r"[vf]\d+|[ABDKTWX]|[xy]", name)} - frame == {
        *OPERATIONS, "Math", "abs", "result", "buffer", "Int32Array", "Infinity", "NaN"}  # fmt: skip
    assert all("{}" in form.javascript for form in FORMS.values())
