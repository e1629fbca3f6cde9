"""Names of a law's numbers as it is recorded; units, frames and meanings of what goes in and out, as comments of a header."""

import linecache
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from types import FrameType

from quadstep.export.c.branches import ScanRecord
from quadstep.export.c.expressions import Naming
from quadstep.export.c.structs import as_structs, fields_of, parts_of
from quadstep.interfaces.controller import Controller
from quadstep.interfaces.gain import Gain
from quadstep.io.errors import one_line
from quadstep.numbers import Matrix, Structure, Vector
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
                line = file, number = frame.f_code.co_filename, frame.f_lineno
                if line not in self.lines:  # with its text, in a form allowed in a C comment
                    self.lines[line] = remark(f"{Path(file).name}:{number}: {linecache.getline(file, number).strip()}")
                self.naming.origins[place] = self.lines[line]
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


def remark(text: str) -> str:
    """A text that is safe inside a C comment: without anything that ends it or begins another."""
    safe = one_line(text).replace("*/", "* /").replace("/*", "/ *").replace("//", "/ /").replace("??", "? ?")
    return safe.encode("ascii", "backslashreplace").decode().rstrip("\\")


WORDS = {
    "values": "what the actuators are told, as the plant takes it",
    "allocation": "of a command to the rotors",
    "airframe": "of the vehicle",
    "rotor": "of each of its rotors",
    "vehicle": "of the plant",
}
"""What no docstring says."""

MEASURED_WORDS = {"thrust": "N, as last returned by made()", "torque": "N m, as last returned by made()"}
"""Of what a law measures, in an export."""

MODEL_WORDS = {
    "gravity": "m/s^2",
    "most_thrust": "N, of all rotors together",
    "lag": "s, time constant of rotor thrust",
    "slowest": "rad/s, of a rotor",
    "fastest": "rad/s, of a rotor",
}
"""Quantities without a key that a law takes from the vehicle."""


SENTENCE = re.compile(r"(?<=\.)(?<!Eq\.)(?<!Eqs\.) ")
"""Where one ends in a docstring."""

UNKNOWN = "unit and meaning as in the law"


def of_gains(controller: Controller, gains: Structure) -> Callable[[str], str]:
    """Unit and meaning of a gain, as declared by its law; for computed gains, as declared by these."""
    declared = type(controller).declarations()
    known = {name: unit_and_meaning(one) for name, one in declared.items() if isinstance(one, Gain)}
    return of_structure(gains, {**MODEL_WORDS, **known})


def of_structure(value: Structure, words: Mapping[str, str]) -> Callable[[str], str]:
    """Comments on its members by dotted name: as declared, from a table by the end of the name, or from a docstring."""

    def comment(name: str) -> str:
        holder, field = member_of(value, name)
        declaration = getattr(type(holder), "_field_defaults", {}).get(field)
        if isinstance(declaration, Gain):
            return unit_and_meaning(declaration) or UNKNOWN
        parts = name.split(".")
        ends = [".".join(parts[i:]) for i in range(len(parts))]
        inner = as_structs(fields_of(holder).get(field, ()))
        return next((words[end] for end in ends if end in words), "") or described(holder, field) or first(inner) or UNKNOWN

    return comment


def unit_and_meaning(gain: Gain) -> str:
    return ", ".join(part for part in (gain.unit if gain.unit != "-" else "", gain.meaning) if part)


def member_of(value: Structure, name: str) -> tuple[Structure, str]:
    """The structure that holds a member, by dotted name, and the name of its field."""
    *places, last = name.split(".")
    for place in places:
        value = as_structs(parts_of(value)[place])[0]
    return value, last if last in fields_of(value) else re.sub(r"_\d+$", "", last)


def sentences(structure: Structure) -> list[str]:
    text = " ".join((type(structure).__doc__ or "").partition(">>>")[0].split())
    return [] if text.startswith(f"{type(structure).__name__}(") else SENTENCE.split(text)


def described(structure: Structure, field: str) -> str:
    """What a docstring says of a field: the text after `field [unit]:`, or the sentence that explains it among others."""
    named = [one for one in sentences(structure) if re.search(rf"(?<![\w`(]){field}( \[|[:,;.]| and | \()", one)]
    if not named:
        return ""
    sentence = max(named, key=lambda one: ":" in one.partition(field)[2])
    alone = re.fullmatch(rf"{field}(?: \[([^]]*)\])?: (.*?)\.?", sentence)
    return remark(", ".join(filter(None, alone.groups())) if alone else sentence.rstrip("."))


def first(structures: tuple[Structure, ...]) -> str:
    """What the first of these says of itself."""
    return remark(next((one.rstrip(".") for structure in structures[:1] for one in sentences(structure)), ""))
