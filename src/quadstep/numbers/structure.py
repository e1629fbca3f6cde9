"""Frozen, named structures of numbers, and their flat form.

State, memory, gains and parameters are `NamedTuple`s whose fields are numbers, vectors, matrices, tables or further
structures. Engines see only the flat list of leaves; nothing else knows the layout.
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, TypeAlias, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from quadstep.numbers.functions import entry
from quadstep.numbers.kinds import Number
from quadstep.numbers.vectors import Matrix, Vector

S = TypeVar("S")

Structure: TypeAlias = object
"""A number, vector, or nested `NamedTuple` of them, whose type is known only to its creator: a state, a memory, gains, the
parameters of a flight. Code that looks into one first states its type.
"""


class Table:
    """A row of constants that a law looks up by a computed index (knots of a path, coefficients of its pieces).

    An index beyond either end gives the entry there.

    >>> from quadstep.numbers import Table
    >>> table = Table([1.0, 4.0, 9.0])
    >>> table.size, table.at(1.0), table.at(7.0)
    (3, 4.0, 9.0)
    """

    def __init__(self, values: Sequence[float] | NDArray[np.float64]) -> None:
        self.array = np.asarray(values, dtype=np.float64)
        self.values: list[float] = self.array.tolist()

    @property
    def size(self) -> int:
        return len(self.values)

    def at(self, index: Number) -> Number:
        """The entry at a whole `index`, a float or an array; see `entry`."""
        place: object = entry(index, self.size)
        if isinstance(place, np.ndarray):
            return cast(Number, self.array[place.astype(np.int64)])
        return self.values[int(cast(float, place))]


def flatten(structure: object) -> list[Any]:
    """The leaves of a structure (numbers and tables), depth first.

    >>> from quadstep.numbers import flatten, vector
    >>> flatten((1.0, vector(2.0, 3.0)))
    [1.0, 2.0, 3.0]
    """
    if isinstance(structure, Vector):
        return list(structure.entries)
    if isinstance(structure, Matrix):
        return [entry for row in structure for entry in row]
    if isinstance(structure, tuple):
        return [leaf for field in structure for leaf in flatten(field)]
    return [structure]


def answered(answer: S, kind: type[S], method: str) -> S:
    """What a user's own method returned. Raises TypeError, which names the method, if it is of another kind.

    >>> from quadstep.numbers.structure import answered
    >>> answered(3.0, tuple, "wind")
    Traceback (most recent call last):
    TypeError: `wind` should return a tuple, not a float
    """
    if not isinstance(answer, kind) or (isinstance(answer, Vector) and len(answer) != 3):
        what = f"a Vector of {len(answer)}" if isinstance(answer, Vector) else f"a {type(answer).__name__}"
        raise TypeError(f"`{method}` should return a {kind.__name__}{' of 3' * (kind is Vector)}, not {what}")
    return answer


def in_matrix(structure: object) -> list[bool]:
    """For each leaf, in the order of `flatten`, whether it is an entry of a matrix.

    >>> from quadstep.numbers import in_matrix, matrix
    >>> in_matrix((1.0, matrix((2.0, 3.0))))
    [False, True, True]
    """
    if isinstance(structure, tuple):
        return [answer for field in structure for answer in in_matrix(field)]
    return [isinstance(structure, Matrix)] * len(flatten(structure))


def rebuild(like: S, leaves: Iterator[object]) -> S:
    """A structure shaped as `like`, filled from `leaves` in the order of `flatten`.

    >>> from quadstep.numbers import rebuild, vector
    >>> rebuild((0.0, vector(0.0, 0.0)), iter([1.0, 2.0, 3.0]))
    (1.0, Vector([2.0, 3.0]))
    """
    result: object
    if isinstance(like, Vector):
        result = Vector([cast(Number, next(leaves)) for _ in like])
    elif isinstance(like, Matrix):
        result = Matrix([rebuild(row, leaves) for row in like])
    elif isinstance(like, tuple):
        fields = [rebuild(field, leaves) for field in like]
        result = like._make(fields) if hasattr(like, "_make") else tuple(fields)
    else:
        result = next(leaves)
    return cast(S, result)


def replaced(structure: S, **fields: object) -> S:
    """A `NamedTuple`, of whose type only the names of these fields are known, with other values in them.

    >>> from quadstep.numbers import vector
    >>> from quadstep.numbers.noise import Key
    >>> from quadstep.numbers.structure import replaced
    >>> replaced(Key(vector(1.0)), words=vector(2.0))
    Key(words=Vector([2.0]))
    """
    return getattr(structure, "_replace")(**fields)  # noqa: B009 (it has no other type)


def from_fields(kind: type[S], other: object, **fields: object) -> S:
    """A `NamedTuple` of these fields, the rest of them as another has them."""
    same = [name for name in getattr(kind, "_fields") if name not in fields]  # noqa: B009 (it has no other type)
    return kind(**{name: getattr(other, name) for name in same}, **fields)


def leaf_names(structure: object, prefix: str = "") -> list[str]:
    """A dotted name for each leaf, in the order of `flatten`: `vehicle.inertia.0`.

    >>> from quadstep.world.paths import StepParameters
    >>> from quadstep.numbers import leaf_names, vector
    >>> leaf_names(StepParameters(vector(0.0), vector(1.0), 2.0, 0.0))
    ['start.0', 'end.0', 'time', 'yaw']
    """
    if isinstance(structure, tuple):
        fields: Iterable[tuple[object, object]] = zip(
            getattr(structure, "_fields", range(len(structure))), structure, strict=True
        )
    elif isinstance(structure, Vector | Matrix):
        fields = enumerate(structure)
    else:
        return [prefix]
    return [name for key, field in fields for name in leaf_names(field, f"{prefix}.{key}" if prefix else str(key))]
