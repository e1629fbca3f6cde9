"""Scans as LLVM: an LLVM loop around a step that is traced once.

The carry and all rows are in memory, one vector per number. Loaded numbers are remembered with their place, so that
a matrix that is already in memory is scanned where it is: the output of another scan, or a matrix of the
flight's parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

from llvmlite import ir

from quadstep.numbers.kinds import Number
from quadstep.numbers.scan import C, Rows, Step, matrices, same_shape, shaped
from quadstep.numbers.structure import flatten, rebuild
from quadstep.numbers.vectors import Matrix, Vector
from quadstep.program.instructions import Instructions, Stored
from quadstep.program.recorded import Operand, RecordedNumber

PLACE = ir.IntType(64)


def scan(
    emitter: Instructions, step: Step[C], carry: C, rows: Rows[Matrix], count: int, backwards: bool
) -> tuple[C, Rows[Matrix]]:
    """See `quadstep.numbers.scan`."""
    builder = emitter.builder
    given = flatten(carry)
    sources = [(in_memory(emitter, one), len(one.rows[0])) for one in matrices(rows)]
    slots = room(emitter, len(given))
    store(emitter, given, slots, PLACE(0))
    with builder.goto_entry_block():
        counter = builder.alloca(PLACE)
    builder.store(PLACE(count - 1 if backwards else 0), counter)
    known = dict(emitter.known)
    body, over = (builder.function.append_basic_block(name) for name in ("turn", "turned"))
    builder.branch(body)
    builder.position_at_end(body)  # values known before the loop are known in each turn

    place = builder.load(counter)
    now = rebuild(carry, iter(loaded(emitter, slots, len(given))))
    taken = [row(emitter, source, place, columns) for source, columns in sources]
    after, made = step(now, shaped(rows, iter(taken)))
    same_shape(after, len(given))
    kept = [(room(emitter, count * len(one)), len(one)) for one in matrices(made)]
    for one, (memory, columns) in zip(matrices(made), kept, strict=True):
        store(emitter, cast(list[Operand], list(one)), memory, builder.mul(place, PLACE(columns)))
    store(emitter, flatten(after), slots, PLACE(0))
    builder.store(builder.add(place, PLACE(-1 if backwards else 1)), counter)
    builder.cbranch(builder.icmp_unsigned("==", place, PLACE(0 if backwards else count - 1)), over, body)

    builder.position_at_end(over)
    emitter.known = known
    last = rebuild(carry, iter(loaded(emitter, slots, len(given))))
    return last, shaped(made, iter([matrix(emitter, memory, count, columns) for memory, columns in kept]))


def room(emitter: Instructions, size: int) -> ir.Value:
    """Memory for this many numbers, allocated once for the whole function."""
    with emitter.builder.goto_entry_block():
        memory: ir.Value = emitter.builder.alloca(emitter.vector, size=max(size, 1))
    return memory


def store(emitter: Instructions, numbers: Sequence[Operand], memory: ir.Value, place: ir.Value) -> None:
    """Write numbers consecutively, the first to this place."""
    builder = emitter.builder
    address = builder.gep(memory, [place])
    for offset, number in enumerate(numbers):
        builder.store(emitter.value(number), builder.gep(address, [PLACE(offset)]))


def loaded(emitter: Instructions, memory: ir.Value, size: int) -> list[RecordedNumber]:
    """All numbers of a piece of memory, each remembered with its place."""
    lanes = []
    for place in range(size):
        value = emitter.builder.load(emitter.builder.gep(memory, [PLACE(place)]))
        emitter.stored[id(value)] = Stored(memory, place)
        lanes.append(RecordedNumber(emitter, value))
    return lanes


def matrix(emitter: Instructions, memory: ir.Value, count: int, columns: int) -> Matrix:
    """A matrix that is in memory row by row."""
    lanes = cast(list[Number], loaded(emitter, memory, count * columns))
    return Matrix(Vector(lanes[place * columns : (place + 1) * columns]) for place in range(count))


def row(emitter: Instructions, source: Stored, place: ir.Value, columns: int) -> Vector:
    """The row of this place."""
    builder = emitter.builder
    address = builder.gep(source.memory, [builder.add(builder.mul(place, PLACE(columns)), PLACE(source.place))])
    entries: list[RecordedNumber] = []
    for column in range(columns):
        value = builder.load(builder.gep(address, [PLACE(column)]))
        entries.append(RecordedNumber(emitter, emitter.spread(value) if source.scalar else value))
    return Vector(cast(list[Number], entries))


def in_memory(emitter: Instructions, rows: Matrix) -> Stored:
    """The memory that holds a matrix row by row: its origin, else a copy."""
    entries = flatten(rows)
    places = [emitter.stored.get(id(emitter.value(number))) for number in entries]
    first = places[0]
    if first is not None and all(one == first._replace(place=first.place + i) for i, one in enumerate(places)):
        return first
    memory = room(emitter, len(entries))
    store(emitter, entries, memory, PLACE(0))
    return Stored(memory, 0)
