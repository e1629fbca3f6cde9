"""sin, cos, exp, sigmoid, log and atan2 written out in JavaScript from those of every engine, whose bits they give."""

from functools import lru_cache

from quadstep.numbers.script import Record
from quadstep.numbers.script_functions import ScriptSteps
from quadstep.page.writing import Output, Writer

FUNCTIONS = {"sin": "x", "cos": "x", "exp": "x", "sigmoid": "x", "log": "x", "atan2": "yx"}
"""Their arguments."""


@lru_cache(maxsize=1)
def library() -> str:
    """These functions in JavaScript; D and W: the bits of one number, as a double and as two words."""
    return "\n".join(
        ["const D=new Float64Array(1),W=new Int32Array(D.buffer);", *(function(*one) for one in FUNCTIONS.items())]
    )


def function(name: str, arguments: str) -> str:
    """One of them."""
    record = Record()
    result = getattr(ScriptSteps(), name)(*map(record.input, arguments))
    (text,) = Writer(record, ()).functions([Output("const result", result.place)])
    return f"function {name}({','.join(arguments)}){{{text}return result}}"
