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

import math
import reprlib
from collections.abc import Callable, Sequence
from threading import Lock
from typing import TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from quadstep.numbers.kinds import ARRAYS, FLOATS, Number, functions_of

Function: TypeAlias = Callable[[NDArray[np.float64]], object]

MOST_FUNCTIONS = 2**24
"""Integers below this are exact in f32."""

FUNCTIONS: dict[float, Function] = {}
PENDING: dict[float, BaseException] = {}
RELEASED: list[int] = []
LOCK = Lock()


def register(function: Function) -> int:
    """A handle by which laws call this function, until `release`."""
    with LOCK:
        if len(FUNCTIONS) == MOST_FUNCTIONS:
            raise ValueError(f"{MOST_FUNCTIONS} functions are registered; release some")
        handle = RELEASED.pop() if RELEASED else len(FUNCTIONS)
        FUNCTIONS[handle] = function
        PENDING.pop(handle, None)
    return handle


def release(handle: int) -> None:
    """Forget the function and its exception. The handle may be reused."""
    with LOCK:
        del FUNCTIONS[handle]
        PENDING.pop(handle, None)
        RELEASED.append(handle)


def raise_pending(handle: int) -> None:
    """Raise what the function raised since it was last asked, if anything: any exception, KeyboardInterrupt included.

    TypeError if it returned something other than the expected numbers, LookupError if no function has this handle.
    """
    error = PENDING.pop(handle, None)
    if error is not None:
        raise error


def answer(handle: float, inputs: NDArray[np.float64], outputs: int) -> list[float]:
    """The function's result; NaN if it fails, and the exception is then pending. Raises nothing."""
    if handle not in PENDING:
        try:
            if handle not in FUNCTIONS:
                raise LookupError(f"no function has the handle {handle:g}")  # noqa: TRY301 (it is to be pending)
            given = FUNCTIONS[handle](inputs)
            result = np.asarray(given)
            if result.shape == (outputs,) and result.dtype.kind in "fiu":
                return cast(list[float], result.astype(np.float64, copy=False).tolist())
            raise TypeError(f"an opaque function should return {outputs} numbers and returned {reprlib.repr(given)}")  # noqa: TRY301
        except BaseException as error:  # none may pass through compiled code
            PENDING[handle] = error
    return [math.nan] * outputs


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
