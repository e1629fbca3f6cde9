"""Golden vectors: samples of a law as computed by Python, and a test in C that requires the same bits.

The samples follow each other with one memory, over the whole path, at motions that deviate from it; the thrust and torque
given to the law are those that its own last command produced.
"""

from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple, cast

import numpy as np

from quadstep.export.c.header import Exported, head, loops
from quadstep.export.c.law import begins, measured_part, only
from quadstep.export.c.structs import TEXTS, fields_of, filled, has_numbers, number
from quadstep.interfaces.plant import Reference
from quadstep.numbers import Number, Structure, Table, Vector, flatten, rebuild
from quadstep.numbers.rotations import from_rotation_vector, multiply, normalised
from quadstep.numbers.structure import replaced
from quadstep.program.python_code import REAL, compiled

FEWEST_SAMPLES, SAMPLES = 8, 80
MOST_OPERATIONS = 600_000
"""Most operations of all samples: laws of more get fewer samples."""

STRAYING = {"position": 0.3, "velocity": 0.5, "rates": 1.0, "attitude": 0.3}
"""Deviation of a measurement's entries from the path; 0.2 for entries not listed."""

FAR, FARTHER = 4, 6.0
"""How often, in samples, attitude and rates deviate more, and by which factor."""


class Sample(NamedTuple):
    """One sample; its numbers are of either kind."""

    tick: int
    measured: Structure
    reference: Structure
    command: Structure
    made: Structure


class Golden(NamedTuple):
    """Samples, and the memory after the last of them. entered: the memory of a law that takes over at the last."""

    samples: list[Sample]
    memory: Structure
    entered: Structure


def golden(exported: Exported, path: Callable[[float], Reference]) -> Golden:
    """The vectors of a law. path: the reference at a time [s]."""
    with np.errstate(all="ignore"):
        return golden_samples(exported, path)


def golden_samples(exported: Exported, path: Callable[[float], Reference]) -> Golden:
    subject, precise, clocked = exported.subject, exported.precise, exported.clocked
    constant = subject.gains, subject.parameters, tuple(clocked.period(loop) for loop in (*loops(exported), "law"))
    draw, real = uniform(), REAL[precise]
    given = subject.measured, subject.gains
    memory, made = compiled(subject.controller.start, given, precise)(*given), cast(Structure, None)
    run = compiled(partial(once, exported), (memory, subject.measured, path(0.0), 0.0, *constant), precise)
    names = list(fields_of(exported.code.command))
    samples = []
    count = min(SAMPLES, max(FEWEST_SAMPLES, MOST_OPERATIONS // exported.code.operations))
    for place in range(count):
        tick = place * max(1, clocked.last // count // clocked.every["law"]) * clocked.every["law"]
        reference = path(tick * clocked.step)
        measured = fed_back(in_kind(near_reference(subject.measured, reference, draw, place % FAR == FAR - 1), precise), made)
        wanted, t = in_kind(reference, precise), real(float(tick)) * real(clocked.step)
        command, memory, made = run(memory, measured, wanted, t, *constant)
        samples.append(Sample(tick, measured, wanted, only(command, names), made))
    last = samples[-1].measured, samples[-1].reference, subject.gains
    return Golden(samples, memory, compiled(subject.controller.enter, last, precise)(*last))


def once(
    exported: Exported, memory: Structure, measured: Structure, reference: Reference, t: Number, gains: Structure,
    parameters: Structure, periods: tuple[Number, ...],
) -> tuple[Structure, Structure, Structure]:  # fmt: skip
    """One sample with every loop due: the command, the memory after it, and what the actuators make of the command."""
    law = exported.subject.controller
    for loop, period in zip(loops(exported), periods[:-1], strict=True):
        memory = law.slower(loop, memory, measured, reference, gains, t, period)
    command, memory = law.law(memory, measured, reference, gains, t, periods[-1])
    return command, memory, exported.subject.plant.actuate(parameters, command)


def in_kind(structure: Structure, precise: bool) -> Structure:
    """A structure of floats as one of these numbers."""
    leaves = (leaf if isinstance(leaf, Table) else REAL[precise](float(leaf)) for leaf in flatten(structure))
    return rebuild(structure, leaves)


def uniform() -> Iterator[float]:
    """Numbers from -1 to 1, always the same."""
    while True:
        raw = np.random.Philox(key=np.array([1, 1], dtype=np.uint64)).random_raw(4096)
        yield from (2.0 * (raw >> np.uint64(11)).astype(np.float64) * 2.0**-53 - 1.0).tolist()


def near_reference(measured: Structure, reference: Reference, draw: Iterator[float], far: bool) -> Structure:
    changed: dict[str, object] = {}
    for name, value in fields_of(measured).items():
        reach = STRAYING.get(name, 0.2) * (FARTHER if far and name in ("attitude", "rates") else 1.0)
        on_path = getattr(reference, name, None)
        near = on_path if isinstance(on_path, Vector) and isinstance(value, Vector) and len(on_path) == len(value) else value
        if isinstance(near, Vector) and name == "attitude" and len(near) == 4:
            turn = from_rotation_vector(Vector(reach * next(draw) for _ in range(3)))
            changed[name] = normalised(multiply(near, turn))
        else:
            changed[name] = rebuild(near, iter([leaf + reach * next(draw) for leaf in flatten(near)]))
    return replaced(measured, **changed)


def fed_back(measured: Structure, made: Structure) -> Structure:
    """The measurement with what the last command produced."""
    if made is None or not hasattr(made, "_fields"):
        return measured
    told = fields_of(measured)
    return replaced(measured, **{name: getattr(made, name) for name in ("thrust", "torque") if name in told})


# As C


def golden_header(exported: Exported, vectors: Golden) -> str:
    precise, clocked = exported.precise, exported.clocked

    def rows(name: str, structures: list[Structure]) -> str:
        leaves = [[number(float(leaf), precise) for leaf in flatten(one)] for one in structures]
        text = ",\n".join("    {" + ", ".join(row) + "}" for row in leaves)
        return f"static const real golden_{name}[{len(leaves)}][{len(leaves[0])}] =\n{{\n{text}\n}};"

    samples, measured = vectors.samples, list(fields_of(measured_part(exported.subject.measured)))
    parts = [
        head(exported, "Golden vectors, as quadstep computes them in Python."),
        f"#define GOLDEN_SAMPLES {len(samples)}",
        "static const uint32_t golden_tick[GOLDEN_SAMPLES] = {" + ", ".join(f"{one.tick}u" for one in samples) + "};",
        f"static const real golden_step = {number(clocked.step, precise)};",
        *(
            f"static const real golden_{loop}_period = {number(clocked.period(loop), precise)};"
            for loop in (*loops(exported), "law")
        ),
        rows("start", [in_kind(measured_part(exported.subject.measured), precise)]),
        rows("measured", [only(one.measured, measured) for one in samples]),
        rows("reference", [one.reference for one in samples]),
        rows("command", [one.command for one in samples]),
        rows("made", [one.made for one in samples]),
        *([rows("memory", [vectors.memory])] if flatten(vectors.memory) else []),
        *([rows("entered", [vectors.entered])] if flatten(vectors.memory) else []),
    ]
    return "\n\n".join(parts) + "\n"


def test_source(exported: Exported) -> str:
    """The test: the same bits as the vectors, except for a zero's sign, and the behaviour that the guards promise."""
    name, upper = exported.name, exported.name.upper()
    calls = [LOOP.replace("LOOP", loop).replace("NAME", name).replace("UPPER", upper) for loop in loops(exported)]
    words = {
        "NAME": name,
        "UPPER": upper,
        "LOOPS\n": "".join(calls),
        "ENTERED\n": ENTERED.replace("NAME", name).replace("UPPER", upper) if has_numbers(exported.code.memory) else "",
        "MEMORY\n": MEMORY if has_numbers(exported.code.memory) else "",
        "WORD": "uint64_t" if exported.precise else "uint32_t",
        "READ": str(first_read(exported)),
    }
    about = "A test of the law: golden vectors and guards. It prints what it found and returns 0 if all is well."
    return f"{head(exported, about)}\n\n{filled(TEXTS / 'test.c', words)}"


def first_read(exported: Exported) -> int:
    """The first number of the measurement that the law takes."""
    place = 0
    for field, value in fields_of(measured_part(exported.subject.measured)).items():
        if any(begins(text, f"measured->{field}") for text in exported.code.reads["law"]):
            return place
        place += len(flatten(value))
    return 0


LOOP = """        clock.period = golden_LOOP_period;
        failures += expect("LOOP", NAME_LOOP(&NAME_mission, &state, &measured, &reference, &clock) == UPPER_OK);
"""

ENTERED = """    failures += expect("enter", NAME_enter(&NAME_mission, &state, &measured, &reference) == UPPER_OK);
    failures += compare("memory after enter", last, &state.memory, golden_entered[0], sizeof golden_entered[0]);
"""

MEMORY = """    failures += compare("memory", GOLDEN_SAMPLES - 1, &state.memory, golden_memory[0], sizeof golden_memory[0]);
"""
