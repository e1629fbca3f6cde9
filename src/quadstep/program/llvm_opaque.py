"""Opaque functions as LLVM: compiled code passes its inputs to Python on its stack and finds the outputs there.

Run such code outside the main thread, as the engines do: Python delivers Ctrl-C to the main thread, where one that arrives
while compiled code is just calling would be reported and lost.
"""

import ctypes
import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from llvmlite import binding as llvm
from llvmlite import ir

from quadstep.numbers.kinds import Number
from quadstep.numbers.registered import answer
from quadstep.program.instructions import Instructions
from quadstep.program.recorded import Operand, RecordedNumber

SYMBOL = "quadstep_call"
COUNT = ir.IntType(64)
BYTES = ir.IntType(8).as_pointer()


def dispatch(source: int, target: int, inputs: int, outputs: int, width: int, size: int) -> None:
    """Call a function for each of `width` lanes of numbers of `size` bytes.

    source: the address of a vector of handles and of `inputs` vectors after it. target: of `outputs` vectors, to be filled.
    """
    cell, kind = (ctypes.c_double, np.float64) if size == 8 else (ctypes.c_float, np.float32)
    given: Any = (cell * ((1 + inputs) * width)).from_address(source)
    lanes = np.frombuffer(given, kind).reshape(1 + inputs, width).T.astype(np.float64, order="C")
    taken = (cell * (outputs * width)).from_address(target)
    for lane in range(width):
        taken[lane::width] = answer(float(lanes[lane, 0]), lanes[lane, 1:], outputs)


DISPATCH = ctypes.CFUNCTYPE(None, *[ctypes.c_size_t] * 2, *[ctypes.c_int64] * 4)(dispatch)


@lru_cache(maxsize=1)
def link() -> None:
    """Let compiled code find `dispatch`. Needed once in each process that loads such code; tracing it does so."""
    llvm.add_symbol(SYMBOL, ctypes.cast(DISPATCH, ctypes.c_void_p).value)


def emit(emitter: Instructions, handle: Number, inputs: Sequence[Number], outputs: int) -> list[Number]:
    """Instructions that call the function. They name it only by its handle, so that compiled code can be kept between runs."""
    given: list[Operand] = [handle, *inputs]
    link()
    builder = emitter.builder
    with builder.goto_entry_block():  # on the stack once, not once per turn of the loop
        source, target = (builder.alloca(emitter.vector, size=size) for size in (len(given), outputs))
    for place, number in enumerate(given):
        builder.store(emitter.value(number), builder.gep(source, [COUNT(place)]))
    places = [builder.gep(target, [COUNT(place)]) for place in range(outputs)]
    for place in places:
        builder.store(emitter.constant(math.nan), place)  # stays if the call is aborted
    function = builder.module.globals.get(SYMBOL)
    if function is None:
        kind = ir.FunctionType(ir.VoidType(), [BYTES] * 2 + [COUNT] * 4)
        function = ir.Function(builder.module, kind, SYMBOL)
    sizes = [len(inputs), outputs, emitter.width, 8 if emitter.precise else 4]
    builder.call(function, [builder.bitcast(source, BYTES), builder.bitcast(target, BYTES), *map(COUNT, sizes)])
    return [RecordedNumber(emitter, builder.load(place)) for place in places]  # type: ignore[misc]
