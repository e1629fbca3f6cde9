"""Laws evaluated in JavaScript."""

import json

import numpy as np

from quadstep.page.laws import library
from quadstep.page.writing import Output, Writer
from quadstep.program.assignments import ScriptRecord
from quadstep.program.operations import constant_text
from tests.pages import run_node


def written(law, count, table=None):
    """The law's results as one JavaScript function of an array, after constants that are kept aside."""
    record = ScriptRecord()
    numbers = [record.input(f"A[{i}]") for i in range(count)]
    if table is not None:
        numbers.append(record.table("T", table.size))
    results = law(*numbers)
    results = results if isinstance(results, list) else [results]
    outputs = [Output(f"B[{i}]", record.at(result)) for i, result in enumerate(results)]
    writer = Writer(record, ["A[0]"])
    writer.keep_steady(outputs)
    prepare, body = writer.preparation(), writer.functions(outputs)
    functions = [f"function f{i}(A,T){{{text}}}" for i, text in enumerate([*prepare, *body])]
    calls = "".join(f"f{i}(A,T);" for i in range(len(functions)))
    sizes = {"K": len(writer.kept), "X": writer.carried, "B": len(outputs)}
    arrays = "".join(f"const {name}=new Float64Array({size});" for name, size in sizes.items())
    arrays += writer.declarations()
    return f"'use strict';{library()}{arrays}{''.join(functions)}const law=(A,T)=>{{{calls}return Array.from(B)}};"


def through_script(law, *columns, table=None):
    """What the law gives in Node.js, an array of shape (results, samples)."""
    samples = np.array(np.broadcast_arrays(*columns), dtype=float).T
    text = json.dumps([[constant_text(value).strip("()") for value in sample] for sample in samples.tolist()])
    values = json.dumps([] if table is None else table.values)
    script = (
        written(law, len(columns), table)
        + f"const T=new Float64Array({values});"
        + f"console.log(JSON.stringify({text}.map(s=>law(s.map(Number),T).map(x=>Object.is(x,-0)?'-0':String(x)))))"
    )
    return np.array(
        json.loads(run_node(script).replace('"Infinity"', '"inf"').replace('"-Infinity"', '"-inf"')), dtype=float
    ).T
