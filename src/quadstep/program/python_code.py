"""A law as one Python function over NumPy's scalars, of f64 or f32.

Every operation is written down where the law computes it and rounded once: none is folded, merged or left out. Scans, and what
is done to the rows of a matrix, are loops. So the function gives what the law gives number by number, to the sign of a zero,
and is much faster where loops have many turns. NumPy's warnings are best suppressed around it: infinities and NaN arise as in
IEEE 754.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple, TypeAlias, TypeVar, cast

import numpy as np

from quadstep.numbers.kinds import Number
from quadstep.numbers.scan import C, Rows, Step, matrices, same_shape, scan, shaped
from quadstep.numbers.structure import Table, flatten, rebuild
from quadstep.numbers.vectors import Matrix, Vector
from quadstep.program.operations import FORMS, WORDS
from quadstep.program.recorded import Operand, Recorded, RecordedNumber, RecordedTable, Recording
from quadstep.program.rows import FEWEST_ROWS

Scalar: TypeAlias = np.float64 | np.float32

REAL: dict[bool, type[Scalar]] = {True: np.float64, False: np.float32}
"""The kinds: f64 (True) and f32 (False)."""


class BitLayout(NamedTuple):
    """Of the bits of a number. whole: an integer of as many. mantissa: how many it has. exponent: all of its own set."""

    whole: type[np.uint64 | np.uint32]
    mantissa: int
    bias: int
    exponent: int


LAYOUTS = {True: BitLayout(np.uint64, 52, 1023, 0x7FF), False: BitLayout(np.uint32, 23, 127, 0xFF)}


def steps(precise: bool) -> dict[str, object]:
    """By name: `bit`, `power`, `fraction`, `exponent` of `Elementary`, `sqrt`; `word` and `real`, to and from an integer."""
    real, (whole, mantissa, bias, exponents) = REAL[precise], LAYOUTS[precise]
    below = (1 << mantissa) - 1

    def bits(x: Scalar) -> int:
        return int(x.view(whole))

    def of_bits(all_bits: int) -> Scalar:
        return cast(Scalar, whole(all_bits).view(real))

    return {
        "real": real,
        "sqrt": np.sqrt,
        "word": lambda x: int(x) if np.isfinite(x) else 0,
        "bit": lambda x, mask: bits(x) & mask != 0,
        "power": lambda m: of_bits((bits(m) + bias & exponents) << mantissa),
        "fraction": lambda x: of_bits(bits(x) & below | bias - 1 << mantissa),
        "exponent": lambda x: real((bits(x) >> mantissa & exponents) - bias + 1),
    }


S = TypeVar("S")

INDENT = "    "


def compiled(law: Callable[..., S], given: tuple[object, ...], precise: bool) -> Callable[..., S]:
    """The law as a function of structures like these, whose numbers it first rounds to its kind: f64 if precise, else f32."""
    code, arguments = PythonCode(precise), list[str]()
    result = law(*(entered(code, arguments, one) for one in given))
    run = code.function(arguments, [code.text(leaf) for leaf in flatten(result)])
    return lambda *structures: rebuild(result, iter(run(*passed(structures, precise))))


def entered(code: PythonCode, arguments: list[str], structure: S) -> S:
    """The structure as arguments, whose names are appended; a matrix of many rows is one."""

    def argument() -> str:
        arguments.append(f"x{len(arguments)}")
        return arguments[-1]

    result: object
    if isinstance(structure, tuple):
        fields = [entered(code, arguments, field) for field in structure]
        result = structure._make(fields) if hasattr(structure, "_make") else tuple(fields)
    elif isinstance(structure, Table):
        result = RecordedTable(code, argument(), structure.size)
    elif isinstance(structure, Matrix) and len(structure) >= FEWEST_ROWS:
        result = RowsInPython(code, argument(), (len(structure), len(structure.rows[0])))
    else:
        result = rebuild(structure, (RecordedNumber(code, argument()) for _ in flatten(structure)))
    return cast(S, result)


def passed(structure: object, precise: bool) -> list[object]:
    real = REAL[precise]
    if isinstance(structure, tuple):
        return [one for field in structure for one in passed(field, precise)]
    if isinstance(structure, Table):
        return [structure.values]
    if isinstance(structure, Matrix) and len(structure) >= FEWEST_ROWS:
        return [[[real(entry) for entry in row] for row in structure]]
    return [real(leaf) for leaf in flatten(structure)]


class PythonCode(Recording):
    """The statements so far. constants: names by their text."""

    folds = False

    def __init__(self, precise: bool) -> None:
        self.precise = precise
        self.lines: list[str] = []
        self.constants: dict[str, str] = {}
        self.depth, self.count = 1, 0

    def name(self) -> str:
        self.count += 1
        return f"v{self.count}"

    def line(self, text: str) -> None:
        self.lines.append(INDENT * self.depth + text)

    def assign(self, expression: str) -> str:
        """The variable to which a statement assigns the expression."""
        name = self.name()
        self.line(f"{name} = {expression}")
        return name

    def write(self, operation: str, *operands: Operand | Recorded) -> str:
        """The variable that has the result of an operation."""
        bits = operation == "bit" or operation in WORDS
        texts = [str(one) if bits and isinstance(one, int) else self.text(one) for one in operands]
        return self.assign(FORMS[operation].python.format(*texts))

    def text(self, operand: Operand | Recorded) -> str:
        """An operand in a statement; a Python number is a constant, rounded once."""
        if isinstance(operand, Recorded):
            return str(operand.place)
        return self.constants.setdefault(repr(float(operand)), f"k{len(self.constants)}")

    def scan(self, step: Step[C], carry: C, rows: Rows[Matrix], count: int, backwards: bool) -> tuple[C, Rows[Matrix]]:
        """A loop: the carry in variables, rows in tuples, what it makes in lists."""
        state = [self.assign(self.text(leaf)) for leaf in flatten(carry)]
        now = rebuild(carry, (RecordedNumber(self, name) for name in state))
        given = [self.in_memory(one) for one in matrices(rows)]
        start, index = len(self.lines), self.name()
        self.line(f"for {index} in {f'reversed(range({count}))' if backwards else f'range({count})'}:")
        self.depth += 1
        after, made = step(now, shaped(rows, iter([one.row(index) for one in given])))
        same_shape(after, len(state))
        kept = [RowsInPython(self, self.name(), (count, len(line))) for line in matrices(made)]
        for one, line in zip(kept, matrices(made), strict=True):
            self.line(f"{one.text}[{index}] = {listed(map(self.text, line))}")
        self.line(f"{listed(state)} = {listed(map(self.text, flatten(after)))}")
        self.depth -= 1
        self.lines[start:start] = [f"{INDENT * self.depth}{one.text} = [()] * {count}" for one in kept]
        return now, shaped(made, iter(kept))

    def in_memory(self, rows: Matrix) -> RowsInPython:
        """A matrix as rows of a variable."""
        if isinstance(rows, RowsInPython):
            return rows
        text = self.assign(listed(listed(map(self.text, row)) for row in rows))
        return RowsInPython(self, text, (len(rows), len(rows.rows[0])))

    def function(self, arguments: list[str], results: list[str]) -> Callable[..., tuple[object, ...]]:
        source = [f"def run({', '.join(arguments)}):", *self.lines, f"{INDENT}return {listed(results)}"]
        names = steps(self.precise) | {name: REAL[self.precise](float(text)) for text, name in self.constants.items()}
        exec(compile("\n".join(source), "<traced law>", "exec"), names)
        return cast("Callable[..., tuple[object, ...]]", names["run"])


class RowsInPython(Matrix):
    """A matrix, by the text that stands for its rows: what is done to each of them is a loop."""

    __slots__ = ("code", "shape", "text")

    def __init__(self, code: PythonCode, text: str, shape: tuple[int, int]) -> None:
        self.code, self.text, self.shape = code, text, shape

    @property
    def rows(self) -> tuple[Vector, ...]:  # type: ignore[override]
        return tuple(self.row(place) for place in range(self.shape[0]))

    def row(self, place: int | str) -> Vector:
        """The row of this number, or of the counter of this name."""
        return Vector(cast(Number, RecordedNumber(self.code, f"{self.text}[{place}][{i}]")) for i in range(self.shape[1]))

    def __len__(self) -> int:
        return self.shape[0]

    def __matmul__(self, other: Vector | Matrix) -> Vector | Matrix:  # type: ignore[override]
        return self.map_rows(lambda row: row @ other) if isinstance(other, Vector) else super().__matmul__(other)

    def map_rows(self, function: Callable[[Vector], Number]) -> Vector:
        _, made = scan(lambda _, row: ((), Vector([function(row)])), (), self)
        return Vector(row[0] for row in made)


def listed(texts: Iterable[str]) -> str:
    return f"({''.join(f'{text}, ' for text in texts)})"
