"""LLVM instructions with everything that a law may contain: loops, functions within, and calls of Python."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from quadstep.numbers.kinds import Number
from quadstep.numbers.scan import C, Rows, Step
from quadstep.numbers.vectors import Matrix
from quadstep.program import llvm_opaque, llvm_scan, subroutine
from quadstep.program.instructions import Instructions

S = TypeVar("S")
T = TypeVar("T")


class Emitter(Instructions):
    """Where lanes put their instructions."""

    def scan(self, step: Step[C], carry: C, rows: Rows[Matrix], count: int, backwards: bool) -> tuple[C, Rows[Matrix]]:
        return llvm_scan.scan(self, step, carry, rows, count, backwards)

    def call(self, memory: dict[str, object], law: Callable[[S], T], structure: S) -> T:
        return subroutine.call(self, memory, law, structure)

    def opaque(self, handle: Number, inputs: Sequence[Number], outputs: int) -> list[Number]:
        return llvm_opaque.emit(self, handle, inputs, outputs)
