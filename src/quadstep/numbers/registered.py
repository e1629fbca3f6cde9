"""The Python functions that laws may call (`opaque.py`), by handle, and the exceptions they have raised."""

import math
import reprlib
from collections.abc import Callable
from threading import Lock
from typing import TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

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
