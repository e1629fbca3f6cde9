"""Lanes: numbers whose operators emit LLVM vector instructions, one flight per lane.

Pass lanes to a law, and the result is its machine code. Constants fold (x * 0, x * 1, x + 0) and whatever has
been computed in a block is not computed again, so matrix notation costs nothing once compiled. Every operation is rounded by
itself, in the order of the law: nothing is fused or reassociated, so lanes on any processor agree with Python floats. NaN
and infinity keep their meaning, so that divergence is detected. The effect of folding on zeros and NaN is described in
docs/decisions/0012-equal-bits.md.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple, Protocol, TypeAlias, cast

from llvmlite import ir

from quadstep.numbers.functions import entry
from quadstep.numbers.kinds import Number
from quadstep.numbers.python_operators import CHOOSE, PythonOperators


class Stored(NamedTuple):
    """Where a number was loaded from. memory: its first address. scalar: whether one number there serves all lanes."""

    memory: ir.Value
    place: int
    scalar: bool = False


class Within(Protocol):
    """The function being written, if not the whole: a `lane_calls.Subroutine`."""

    def local(self, value: ir.Value) -> ir.Value:
        """A value of the surrounding code as the function sees it."""


class Emitter:
    """Where lanes put their instructions: a builder, the vector type, and what the current block already holds.

    One lane (width 1) means plain scalars, for a processor without vectors: a graphics processor.
    """

    def __init__(self, builder: ir.IRBuilder, element: ir.Type, width: int) -> None:
        self.builder = builder
        self.element = element
        self.width = width
        self.vector = self.many(element)
        self.double = isinstance(element, ir.DoubleType)
        self.whole = ir.IntType(64 if self.double else 32)
        self.wholes = self.many(self.whole)
        self.known: dict[tuple[str | int, ...], ir.Value] = {}
        self.subroutine: Within | None = None
        self.constants: dict[tuple[ir.Type, str], ir.Constant] = {}
        self.stored: dict[int, Stored] = {}  # by identity of what was loaded

    def many(self, element: ir.Type) -> ir.Type:
        """The type that holds one `element` per lane."""
        return element if self.width == 1 else ir.VectorType(element, self.width)

    def enter(self, block: ir.Block) -> None:
        """Continue at the end of `block`."""
        self.builder.position_at_end(block)
        self.known.clear()

    def constant(self, value: float) -> ir.Constant:
        """The same float in every lane."""
        return self.splat(self.vector, self.element, float(value))

    def whole_constant(self, value: int) -> ir.Constant:
        """The same integer in every lane."""
        return self.splat(self.wholes, self.whole, value)

    def splat(self, kind: ir.Type, element: ir.Type, value: float) -> ir.Constant:
        """A constant of this type, which holds one `element` per lane."""
        key = (kind, repr(value))  # as text, 0.0 and -0.0 differ
        if key not in self.constants:
            one = ir.Constant(element, value)
            self.constants[key] = one if self.width == 1 else ir.Constant(kind, [one] * self.width)
        return self.constants[key]

    def spread(self, scalar: ir.Value) -> ir.Value:
        """The same scalar in every lane."""
        if self.width == 1:
            return scalar
        nothing = ir.Constant(self.many(scalar.type), ir.Undefined)
        one = self.builder.insert_element(nothing, scalar, ir.IntType(32)(0))
        return self.builder.shuffle_vector(one, nothing, ir.Constant(self.many(ir.IntType(32)), [0] * self.width))

    def value(self, number: Operand) -> ir.Value:
        """The LLVM value of a lane or a Python number."""
        return number.value if isinstance(number, Lane) else self.constant(number)

    def here(self, value: ir.Value) -> ir.Value:
        """A value as the function being written sees it."""
        return value if self.subroutine is None else self.subroutine.local(value)

    def once(self, key: tuple[str | ir.Value, ...], emit: Callable[[], ir.Value]) -> ir.Value:
        """The result of `emit`, or its earlier result in this block for the same operation and operands."""
        name = tuple(part if isinstance(part, str) else id(part) for part in key)
        if name not in self.known:
            self.known[name] = emit()
        return self.known[name]

    def intrinsic(self, name: str, *values: ir.Value) -> ir.Value:
        """A call of an LLVM intrinsic on vectors."""
        full = f"llvm.{name}.{'' if self.width == 1 else f'v{self.width}'}f{64 if self.double else 32}"
        module = self.builder.module
        function = module.globals.get(full)
        if function is None:
            function = ir.Function(module, ir.FunctionType(self.vector, [self.vector] * len(values)), full)
        return self.once((full, *values), lambda: self.builder.call(function, values))


class Condition:
    """The result of comparing lanes: one bit per lane."""

    __slots__ = ("emitter", "given")

    def __init__(self, emitter: Emitter, value: ir.Value) -> None:
        self.emitter, self.given = emitter, value

    @property
    def value(self) -> ir.Value:
        """The LLVM value."""
        return self.emitter.here(self.given)

    @property
    def functions(self) -> object:
        """The functions of lanes (used by `where`)."""
        return Lane.functions

    def __and__(self, other: Condition) -> Condition:
        return Condition(self.emitter, self.emitter.builder.and_(self.value, other.value))

    def __or__(self, other: Condition) -> Condition:
        return Condition(self.emitter, self.emitter.builder.or_(self.value, other.value))

    def __invert__(self) -> Condition:
        return Condition(self.emitter, self.emitter.builder.not_(self.value))

    def __bool__(self) -> bool:
        raise TypeError(f"a lane cannot decide a branch: {CHOOSE}")


class Lane(PythonOperators):
    """One number in many flights at once."""

    __slots__ = ("emitter", "given")
    functions: ClassVar[object] = None  # set by quadstep.numbers.lane_functions

    def __init__(self, emitter: Emitter, value: ir.Value) -> None:
        self.emitter, self.given = emitter, value

    @property
    def value(self) -> ir.Value:
        """The LLVM value."""
        return self.emitter.here(self.given)

    def _binary(self, operation: str, a: Lane | float, b: Lane | float) -> Lane:
        emitter = self.emitter
        x, y = emitter.value(a), emitter.value(b)
        build = getattr(emitter.builder, operation)
        return Lane(emitter, emitter.once((operation, x, y), lambda: build(x, y)))

    def __add__(self, other: Operand) -> Operand:
        if not isinstance(other, OPERANDS):
            return NotImplemented
        return self if is_constant(other, 0) else self._binary("fadd", self, other)

    __radd__ = __add__

    def __sub__(self, other: Operand) -> Operand:
        if not isinstance(other, OPERANDS):
            return NotImplemented
        return self if is_constant(other, 0) else self._binary("fsub", self, other)

    def __rsub__(self, other: Operand) -> Operand:
        return -self if is_constant(other, 0) else self._binary("fsub", other, self)

    def __mul__(self, other: Operand) -> Operand:
        if not isinstance(other, OPERANDS):
            return NotImplemented
        if is_constant(other, 0):
            return 0.0
        if is_constant(other, 1):
            return self
        return -self if is_constant(other, -1) else self._binary("fmul", self, other)

    __rmul__ = __mul__

    def __truediv__(self, other: Operand) -> Operand:
        return self if is_constant(other, 1) else self._binary("fdiv", self, other)

    def __rtruediv__(self, other: Operand) -> Operand:
        return 0.0 if is_constant(other, 0) else self._binary("fdiv", other, self)

    def __neg__(self) -> Lane:
        emitter = self.emitter
        return Lane(emitter, emitter.once(("fneg", self.value), lambda: emitter.builder.fneg(self.value)))

    def __abs__(self) -> Lane:
        return Lane(self.emitter, self.emitter.intrinsic("fabs", self.value))

    def _compare(self, operation: str, other: Operand) -> Condition:
        emitter = self.emitter
        other_value = emitter.value(other)
        key = ("fcmp" + operation, self.value, other_value)
        compare = emitter.builder.fcmp_unordered if operation == "!=" else emitter.builder.fcmp_ordered
        return Condition(emitter, emitter.once(key, lambda: compare(operation, self.value, other_value)))

    def __lt__(self, other: Operand) -> Condition:
        return self._compare("<", other)

    def __le__(self, other: Operand) -> Condition:
        return self._compare("<=", other)

    def __gt__(self, other: Operand) -> Condition:
        return self._compare(">", other)

    def __ge__(self, other: Operand) -> Condition:
        return self._compare(">=", other)

    def __eq__(self, other: object) -> Any:
        return self._compare("==", cast(Operand, other))

    def __ne__(self, other: object) -> Any:
        return self._compare("!=", cast(Operand, other))

    __hash__ = None  # type: ignore[assignment]

    def __bool__(self) -> bool:
        raise TypeError(f"a lane has no truth value: {CHOOSE}")


OPERANDS = (Lane, float, int)
Operand: TypeAlias = Lane | float


def is_constant(other: object, value: int) -> bool:
    """Whether an operand is this Python number (a lane is never one)."""
    return isinstance(other, float | int) and other == value


class LaneTable:
    """A table in memory, looked up lane by lane."""

    def __init__(self, emitter: Emitter, pointer: ir.Value, size: int) -> None:
        self.emitter, self.given, self.size = emitter, pointer, size

    def at(self, index: Number) -> Lane:
        """The entry at a whole index, a separate load for each lane; see `entry`."""
        emitter, builder = self.emitter, self.emitter.builder
        wanted = emitter.value(entry(index, self.size))
        whole = emitter.once(("fptosi", wanted), lambda: builder.fptosi(wanted, emitter.wholes))
        if emitter.width == 1:
            return Lane(emitter, builder.load(builder.gep(emitter.here(self.given), [whole])))
        result = ir.Constant(emitter.vector, ir.Undefined)
        for lane in range(emitter.width):
            place = ir.Constant(ir.IntType(32), lane)
            address = builder.gep(emitter.here(self.given), [builder.extract_element(whole, place)])
            result = builder.insert_element(result, builder.load(address), place)
        return Lane(emitter, result)
