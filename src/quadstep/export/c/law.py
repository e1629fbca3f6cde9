"""A controller, and the actuators' response to its commands, recorded as C functions."""

from collections import namedtuple
from collections.abc import Callable, Mapping
from functools import partial
from math import isnan, prod
from typing import NamedTuple, cast

from quadstep.export.c.comments import NamedRecord
from quadstep.export.c.structs import StructOutput, as_array, as_struct, fields_of, from_struct, stored, structure_in_memory
from quadstep.export.c.writing import CWriter
from quadstep.interfaces.controller import Controller
from quadstep.interfaces.plant import Plant, Reference
from quadstep.numbers import Number, Structure, flatten
from quadstep.numbers.structure import replaced
from quadstep.program.assignments import INPUT

KEYWORDS = frozenset((
    "auto", "bool", "break", "case", "char", "const", "continue", "default", "do", "double", "else", "enum", "extern",
    "false", "float", "for", "goto", "if", "inline", "int", "long", "register", "restrict", "return", "short", "signed",
    "sizeof", "static", "struct", "switch", "true", "typedef", "union", "unsigned", "void", "volatile", "while", "real",
    "i", "j", "k", "l", "t", "period", "memory", "measured", "reference", "params", "command", "made", "NAN", "INFINITY",
    "int32_t", "uint32_t", "uint64_t", "y0", "y1", "yn", "j0", "j1", "jn", "gamma", "index", "signgam", "clock",
))  # fmt: skip
"""Names that no local may have."""


class Subject(NamedTuple):
    """What is exported. parameters: of the flight, without its gains; measured, reference: of the right structure."""

    controller: Controller
    gains: Structure
    plant: Plant
    parameters: Structure
    measured: Structure
    reference: Reference


class Code(NamedTuple):
    """A law in C. functions: the statements of each. reads: what each takes from memory. used: operations in them.

    memory, vehicle, command, made: the contents of C's structs; NamedTuples, perhaps empty. asked: a command as the
    law returns it. operations: of all functions, counting every turn of a loop.
    """

    functions: Mapping[str, list[str]]
    reads: Mapping[str, list[str]]
    used: frozenset[str]
    memory: Structure
    vehicle: Structure
    command: Structure
    made: Structure
    asked: Structure
    operations: int


def recorded(subject: Subject, precise: bool, logged: bool = False) -> Code:
    """The functions start, enter where it is not start, guide, law and made. logged: whether commands have values for the log.

    Raises TypeError for a law that cannot be written in C.
    """
    controller, gains = subject.controller, subject.gains
    begun = controller.start(subject.measured, gains)
    memory = as_struct(begun, "memory")
    used: set[str] = set()
    functions: dict[str, list[str]] = {}
    reads: dict[str, list[str]] = {}
    operations: list[int] = []

    def write(name: str, law: Callable[[NamedRecord], list[tuple[str, Structure]]]) -> list[str]:
        record = NamedRecord()
        with record.listening():
            results = law(record)
        left = stored(record, results)
        writer = CWriter(record, precise, record.naming, KEYWORDS)
        functions[name] = writer.body(left)
        turns = {body.counter: body.rows for body in record.loops.values()}
        turns |= {scan.counter: scan.turns for scan in record.scans.values()}
        reached = reach(record, [*left.numbers, *left.arrays])
        used.update("sincos" if place in writer.halves else record.nodes[place].operation for place in reached)
        operations.append(sum(prod(turns[counter] for counter in record.turning[place]) for place in reached))
        reads[name] = [record.nodes[place].text for place in reached if record.nodes[place].operation == INPUT]
        return reads[name]

    def inputs_of(record: NamedRecord) -> tuple[Structure, Structure, Reference]:
        return (
            structure_in_memory(record, gains, "params->gains"),
            replaced(
                subject.measured, **fields_of(structure_in_memory(record, measured_part(subject.measured), "measured->"))
            ),
            cast(Reference, structure_in_memory(record, subject.reference, "reference->")),
        )

    def remembered(record: NamedRecord) -> Structure:
        return from_struct(structure_in_memory(record, memory, "memory->"), begun)

    def start(record: NamedRecord) -> list[tuple[str, Structure]]:
        own, measured, _ = inputs_of(record)
        return [("memory->", as_struct(controller.start(measured, own), "memory"))]

    def enter(record: NamedRecord) -> list[tuple[str, Structure]]:
        own, measured, reference = inputs_of(record)
        return [("memory->", as_struct(controller.enter(measured, reference, own), "memory"))]

    def slower(loop: str, record: NamedRecord) -> list[tuple[str, Structure]]:
        own, measured, reference = inputs_of(record)
        t, period = cast(Number, record.input("t")), cast(Number, record.input("period"))
        after = controller.slower(loop, remembered(record), measured, reference, own, t, period)
        return [("memory->", as_struct(after, "memory"))]

    def law(record: NamedRecord) -> list[tuple[str, Structure]]:
        own, measured, reference = inputs_of(record)
        t, period = cast(Number, record.input("t")), cast(Number, record.input("period"))
        command, after = controller.law(remembered(record), measured, reference, own, t, period)
        return [("command->", only(command, wanted)), ("memory->", as_struct(after, "memory"))]

    def made(record: NamedRecord) -> list[tuple[str, Structure]]:
        vehicle = structure_in_memory(record, parameters, "params->vehicle")
        return [
            ("made->", as_struct(subject.plant.actuate(vehicle, structure_in_memory(record, example, "command->")), "values"))
        ]

    parameters = replaced(subject.parameters, gains=())
    example, rest = like(subject)
    inputs = write("made", made)
    wanted = [name for name in fields_of(example) if logged or any(begins(text, f"command->{name}") for text in inputs)]
    write("start", start)
    if type(controller).enter is not Controller.enter and flatten(memory):
        write("enter", enter)
    for loop in controller.loops():
        write(loop, partial(slower, loop))
    write("law", law)
    vehicle = pruned(parameters, "params->vehicle", inputs)
    kept, values = only(example, wanted), as_struct(rest, "values")
    return Code(functions, reads, frozenset(used), memory, vehicle, kept, values, example, sum(operations))


def like(subject: Subject) -> tuple[Structure, Structure]:
    """A command and the actuators' response, as floats, from a sample of the law itself."""
    memory = subject.controller.start(subject.measured, subject.gains)
    given = subject.measured, subject.reference, subject.gains, 0.0, 0.01
    for loop in subject.controller.loops():
        memory = subject.controller.slower(loop, memory, *given)
    command, _ = subject.controller.law(memory, *given)
    return command, subject.plant.actuate(subject.parameters, command)


def measured_part(measured: Structure) -> Structure:
    """The fields that are measured, out of all that could be."""
    taken = [name for name, value in fields_of(measured).items() if flatten(value) and not all(map(isnan, flatten(value)))]
    return only(measured, taken)


def only(value: Structure, names: list[str]) -> Structure:
    return namedtuple("Part", names)(*(getattr(value, name) for name in names))


def begins(text: str, path: str) -> bool:
    """Whether a place in memory is this one or within it."""
    return text == path or text.startswith((f"{path}.", f"{path}["))


def pruned(value: Structure, path: str, inputs: list[str]) -> Structure:
    kept = {name: field for name, field in fields_of(value).items() if any(begins(text, f"{path}.{name}") for text in inputs)}
    inner = {
        name: field if as_array(field) or not hasattr(field, "_fields") else pruned(field, f"{path}.{name}", inputs)
        for name, field in kept.items()
    }
    return namedtuple("Vehicle", inner)(**inner)


def reach(record: NamedRecord, results: list[StructOutput]) -> list[int]:
    """Every number that results depend on, including those inside loops."""
    seen: set[int] = set()
    waiting = [one.place for one in results]
    while waiting:
        place = waiting.pop()
        if place in seen:
            continue
        seen.add(place)
        waiting += record.nodes[place].operands
        body = record.loops.get(place)
        if body:
            waiting += [*body.stored, *(term for terms in body.added for term in terms)]
        scan = record.scans.get(place)
        if scan:
            waiting += [one.place for one in (*scan.turn.numbers, *scan.turn.arrays)]
    return sorted(seen)
