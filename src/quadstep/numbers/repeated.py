"""Laws that are called several times in a row, whose code need be emitted only once."""

from collections.abc import Callable
from typing import TypeVar

from quadstep.numbers.kinds import functions_of
from quadstep.numbers.structure import flatten

S = TypeVar("S")
T = TypeVar("T")


def repeated(law: Callable[[S], T]) -> Callable[[S], T]:
    """The same law. Compiled to vectors, it becomes a separate function that each call calls.

    Shorter code stays in the processor's cache. Values that the law captures must be the same in every call.
    """
    memory: dict[str, object] = {}

    def run(structure: S) -> T:
        call = getattr(functions_of(*flatten(structure)), "call", None)
        result: T = law(structure) if call is None else call(memory, law, structure)
        return result

    return run
