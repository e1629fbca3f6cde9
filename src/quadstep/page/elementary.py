"""The elementary functions written out in JavaScript from those of every engine, whose bits they give."""

from functools import cache

from quadstep.numbers.operation import OPERATIONS, Operation
from quadstep.page.writing import Output, Writer
from quadstep.program.assignments import Record
from quadstep.program.recorded import RECORDED


def library() -> str:
    """These functions in JavaScript; D and W: the bits of one number, as a double and as two words."""
    return "\n".join(
        ["const D=new Float64Array(1),W=new Int32Array(D.buffer);", *(function(one) for one in OPERATIONS.values())]
    )


@cache
def function(operation: Operation) -> str:
    """One of them."""
    record = Record(inline=True)
    result = operation.steps(RECORDED, *map(record.input, operation.arguments))
    (text,) = Writer(record, ()).functions([Output("const result", record.at(result))])
    return f"function {operation.name}({','.join(operation.arguments)}){{{text}return result}}"
