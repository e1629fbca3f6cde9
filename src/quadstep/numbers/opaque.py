"""A Python function as part of a law: opaque to the compiler, which only calls it.

A law passes on a handle, a number like any other, so that one compiled program serves every function:

    handle = register(function)              # before the flight; function(inputs: float64 array) gives `outputs` numbers
    force = call(handle, inputs, outputs=3)  # in the law
    raise_pending(handle)                    # after the flight
    release(handle)

No exception of a function passes through compiled code. Its outputs become NaN and it is not called again until
`raise_pending` raises the exception; on floats and arrays too, so that such a flight ends alike on every engine. Each array
element and each lane is a separate call, in order, whether its flight has ended or not: a function with memory must fly alone.
"""

from collections.abc import Sequence
from typing import cast

import numpy as np

from quadstep.numbers.kinds import ARRAYS, FLOATS, Number, functions_of
from quadstep.numbers.registered import answer


def call(handle: Number, inputs: Sequence[Number], outputs: int) -> list[Number]:
    """The result of the function with this handle for these inputs: `outputs` numbers. It is called each time this is reached.

    Keep the handle among a law's parameters: on Python numbers alone the call would be made once, while the law is compiled.
    """
    functions: object = functions_of(handle, *inputs)
    if functions is FLOATS:
        return answer(handle, np.array(inputs, dtype=np.float64), outputs)
    if functions is ARRAYS:
        given = np.stack(np.broadcast_arrays(handle, *inputs), axis=-1).astype(np.float64)
        answers = np.empty((*given.shape[:-1], outputs))
        for place in np.ndindex(given.shape[:-1]):
            answers[place] = answer(float(given[place][0]), given[place][1:], outputs)
        return cast(list[Number], list(np.moveaxis(answers, -1, 0)))
    own = getattr(functions, "opaque", None)
    if own is None:
        raise TypeError("an opaque function takes floats, arrays and lanes; it has no equations")
    result: list[Number] = own(handle, inputs, outputs)
    return result
