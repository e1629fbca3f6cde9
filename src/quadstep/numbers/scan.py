"""A loop in a law: one step, written once, that runs a fixed number of times.

On floats and arrays it runs as written. Where a law is compiled (lanes, PTX, JavaScript) the step is traced once and a real
loop is emitted around it, so that the code does not grow with the number of turns. For SymPy symbols and other kinds of
code the turns are unrolled. The bits are the same everywhere.

What a law rarely needs, such as a limit: where it is compiled to vectors, in a branch for all lanes together.

A Python function as part of a law: opaque to the compiler, which only calls it.

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
from collections.abc import Callable, Iterator, Sequence
from threading import Lock
from typing import TypeAlias, TypeVar, Union, cast, overload

import numpy as np
from numpy.typing import NDArray

from quadstep.numbers.kinds import ARRAYS, FLOATS, Condition, Number, functions_of
from quadstep.numbers.structure import flatten
from quadstep.numbers.vectors import Matrix, Vector

S = TypeVar("S")

C = TypeVar("C")

T = TypeVar("T", Matrix, Vector)
V = TypeVar("V", Matrix, Vector)
R = TypeVar("R")
W = TypeVar("W")

Rows: TypeAlias = Union[T, "tuple[Rows[T], ...]"]
"""A matrix, or a tuple of matrices with as many rows each, or of such tuples; () for none. Of a single turn: vectors."""

Step: TypeAlias = Callable[[C, Rows[Vector]], tuple[C, Rows[Vector]]]


@overload
def scan(
    step: Callable[[C, Vector], tuple[C, Vector]], carry: C, rows: Matrix, times: int | None = None, backwards: bool = False
) -> tuple[C, Matrix]: ...


@overload
def scan(
    step: Callable[[C, Vector], tuple[C, tuple[Vector, ...]]], carry: C, rows: Matrix, times: int | None = None,
    backwards: bool = False,
) -> tuple[C, tuple[Matrix, ...]]: ...  # fmt: skip


@overload
def scan(
    step: Callable[[C, R], tuple[C, Vector]], carry: C, rows: tuple[Rows[Matrix], ...] = (),
    times: int | None = None, backwards: bool = False,
) -> tuple[C, Matrix]: ...  # fmt: skip


@overload
def scan(
    step: Callable[[C, R], tuple[C, tuple[Vector, ...]]], carry: C, rows: tuple[Rows[Matrix], ...] = (),
    times: int | None = None, backwards: bool = False,
) -> tuple[C, tuple[Matrix, ...]]: ...  # fmt: skip


def scan(
    step: Callable[[C, R], tuple[C, W]], carry: C, rows: Rows[Matrix] = (), times: int | None = None,
    backwards: bool = False,
) -> tuple[C, Rows[Matrix]]:  # fmt: skip
    """`carry, made = step(carry, row)` for each row in turn: the last carry, and the outputs as matrices, one row per turn.

    carry: a structure of numbers of constant shape. rows: matrices whose rows are passed turn by turn. times: number of turns
    if there are no rows. backwards: from the last row to the first; the output for a row is in that row either way.

    A loop is emitted if a number in `carry` or `rows` is traced; with Python numbers alone the turns are computed directly. A
    step may use any number of its surroundings and may scan itself. It has no side effects. Raises ValueError if rows differ
    in number, TypeError if the carry changes its shape.

    >>> from quadstep.numbers import matrix, scan, vector
    >>> scan(lambda last, row: (last + row[0], vector(last)), 0.0, matrix((1.0,), (2.0,), (3.0,)))
    (6.0, Matrix([[0.0], [1.0], [3.0]]))
    """
    counts: set[int | None] = {len(one) for one in matrices(rows)} or {times}
    (count,) = counts if len(counts) == 1 else (None,)
    if not count or times not in (None, count):
        raise ValueError("a scan needs one number of turns, 1 or more")
    traced = getattr(functions_of(*flatten((carry, rows))), "scan", None)
    return (traced or turn_by_turn)(cast("Step[C]", step), carry, rows, count, backwards)


def turn_by_turn(step: Step[C], carry: C, rows: Rows[Matrix], count: int, backwards: bool) -> tuple[C, Rows[Matrix]]:
    made: list[Rows[Vector]] = [()] * count
    shape = len(flatten(carry))
    for place in reversed(range(count)) if backwards else range(count):
        carry, made[place] = step(carry, row_of(rows, place))
        same_shape(carry, shape)
    return carry, stacked(made)


def same_shape(carry: object, leaves: int) -> None:
    """Raises TypeError for a carry with another number of leaves."""
    if len(flatten(carry)) != leaves:
        raise TypeError(f"a scan's carry had {leaves} numbers and has {len(flatten(carry))} after a turn")


def matrices(rows: Rows[T]) -> list[T]:
    """The matrices of a structure, in order."""
    return [one for part in rows for one in matrices(part)] if isinstance(rows, tuple) else [rows]


def row_of(rows: Rows[Matrix], place: int) -> Rows[Vector]:
    return shaped(rows, iter([one.rows[place] for one in matrices(rows)]))


def stacked(made: list[Rows[Vector]]) -> Rows[Matrix]:
    """Vectors of each turn as matrices."""
    turns = [matrices(one) for one in made]
    return shaped(made[0], iter([Matrix(vectors) for vectors in zip(*turns, strict=True)]))


def shaped(like: Rows[T], parts: Iterator[V]) -> Rows[V]:
    """A structure of rows shaped as `like`, of these parts."""
    if not isinstance(like, tuple):
        return next(parts)
    inner = [shaped(part, parts) for part in like]
    return cast("Rows[V]", like._make(inner) if hasattr(like, "_make") else tuple(inner))


def repeated(law: Callable[[S], R]) -> Callable[[S], R]:
    """The same law. Compiled to vectors, it becomes a separate function that each call calls.

    Shorter code stays in the processor's cache. Values that the law captures must be the same in every call.
    """
    memory: dict[str, object] = {}

    def run(structure: S) -> R:
        call = getattr(functions_of(*flatten(structure)), "call", None)
        return law(structure) if call is None else call(memory, law, structure)

    return run


def shortcut(structure: S, quick: Callable[[S], tuple[Condition, R]], law: Callable[[S], R]) -> R:
    """`law(structure)`, where `quick` has a condition that suffices for its other result to be the same, to the bit.

    Compiled to vectors, the law is in a branch, taken where the condition fails in any lane. All else ignores `quick`.

    >>> from quadstep.numbers import minimum, shortcut
    >>> shortcut(0.5, lambda x: (x < 1.0, x), lambda x: minimum(x, 1.0))
    0.5
    """
    own = getattr(functions_of(*flatten(structure)), "shortcut", None)
    return law(structure) if own is None else own(quick, law, structure)


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
    functions = functions_of(handle, *inputs)
    if functions is FLOATS:
        return answer(handle, np.array(inputs, dtype=np.float64), outputs)
    if functions is ARRAYS:
        given = np.stack(np.broadcast_arrays(handle, *inputs), axis=-1).astype(np.float64)
        answers = np.empty((*given.shape[:-1], outputs))
        for place in np.ndindex(given.shape[:-1]):
            answers[place] = answer(float(given[place][0]), given[place][1:], outputs)
        return cast(list[Number], list(np.moveaxis(answers, -1, 0)))
    return functions.opaque(handle, inputs, outputs)
