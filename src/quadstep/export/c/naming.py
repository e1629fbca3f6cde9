"""Names that a law gives its numbers while it is recorded, and the lines on which it computes them."""

import linecache
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from types import FrameType

from quadstep.export.c.branches import ScanRecord
from quadstep.export.c.expressions import Naming
from quadstep.io.errors import one_line
from quadstep.numbers import Matrix, Vector
from quadstep.program.assignments import CONSTANT, INPUT
from quadstep.program.recorded import RecordedCondition, RecordedNumber
from quadstep.program.rows import RowMatrix, RowVector

HERE = Path(__file__).parent
SILENT = (*(str(HERE.parent.parent / room) for room in ("numbers", "program")), str(HERE))
"""Code whose lines say nothing about a law."""

RECORDER = str(HERE / "law.py")
"""Calls laws."""

GIVEN = frozenset(("self", "memory", "measured", "reference", "gains", "t", "period"))
"""Parameters of a law, which have names already."""


class NamedRecord(ScanRecord):
    """A record that notes the line of the law from which each number came."""

    def __init__(self) -> None:
        super().__init__()
        self.naming = Naming({}, {})
        self.lines: dict[tuple[str, int], str] = {}

    def place(self, operation: str, *operands: int, text: str = "", turning: frozenset[str] = frozenset()) -> int:
        before = len(self.nodes)
        place = super().place(operation, *operands, text=text, turning=turning)
        if place == before and operation not in (CONSTANT, INPUT):
            frame = lawful(sys._getframe(1))
            if frame:
                line = frame.f_code.co_filename, frame.f_lineno
                self.naming.origins[place] = self.lines.get(line) or self.lines.setdefault(line, line_of(*line))
        return place

    @contextmanager
    def listening(self) -> Iterator[None]:
        """A block in which the locals of laws name their numbers."""

        def returned(frame: FrameType, event: str, _argument: object) -> None:
            if event == "return" and not frame.f_code.co_name.startswith("<") and not silent(frame.f_code.co_filename):
                for name, value in frame.f_locals.items():
                    if name not in GIVEN:
                        self.label(name, value)

        before = sys.getprofile()
        sys.setprofile(returned)
        try:
            yield
        finally:
            sys.setprofile(before)

    def label(self, name: str, value: object) -> None:
        """Name the numbers that a local holds after it, unless they have a name."""
        if isinstance(value, RecordedNumber | RecordedCondition):
            if value.record is self and self.nodes[value.place].operation not in (CONSTANT, INPUT):
                self.naming.names.setdefault(value.place, name)
        elif isinstance(value, RowVector | RowMatrix):
            if value.record is self and value.array is not None and value.array in self.loops:
                self.naming.names.setdefault(value.array, name)
        elif isinstance(value, Vector):
            for i, entry in enumerate(value.entries):
                self.label(f"{name}_{i}", entry)
        elif isinstance(value, Matrix):
            for i, row in enumerate(value.rows):
                self.label(f"{name}_{i}", row)
        elif isinstance(value, tuple) and hasattr(value, "_fields"):
            for field in value._fields:
                self.label(f"{name}_{field}", getattr(value, field))


@cache
def silent(file: str) -> bool:
    """Whether a file's lines say nothing about a law; asked of every number."""
    return file.startswith(SILENT)


def lawful(frame: FrameType | None) -> FrameType | None:
    """The innermost frame of a law; None if the recording code is not called from a law."""
    while frame and silent(frame.f_code.co_filename):
        frame = None if frame.f_code.co_filename == RECORDER else frame.f_back
    return frame


def line_of(file: str, number: int) -> str:
    """File, line and text, in a form allowed in a C comment."""
    return remark(f"{Path(file).name}:{number}: {linecache.getline(file, number).strip()}")


def remark(text: str) -> str:
    """A text that is safe inside a C comment: without anything that ends it or begins another."""
    safe = one_line(text).replace("*/", "* /").replace("/*", "/ *").replace("//", "/ /").replace("??", "? ?")
    return safe.encode("ascii", "backslashreplace").decode().rstrip("\\")
