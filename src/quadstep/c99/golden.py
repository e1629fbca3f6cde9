"""Golden vectors: samples of a law as Python computes them, and a test in C that asks for the same bits.

The samples follow each other on one memory, over the whole path, at motions that stray from it; thrust and torque that the
law is told are those that its own last command made.
"""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple, cast

import numpy as np

from quadstep.c99.law import begins, only
from quadstep.c99.source import Exported, guided, head
from quadstep.c99.structs import Structure, fields_of, number
from quadstep.flight.eager import always
from quadstep.guidance.reference import Reference
from quadstep.numbers import Number, Table, Vector, flatten, rebuild
from quadstep.numbers.rotations import from_rotation_vector, multiply, normalised
from quadstep.numbers.single import Single

SAMPLES = 80
STRAYING = {"position": 0.3, "velocity": 0.5, "rates": 1.0, "attitude": 0.3}
"""How far entries of a measurement are from the path; of others 0.2."""

FAR, FARTHER = 4, 6.0
"""Every so many samples, attitude and rates stray so much more."""


class Sample(NamedTuple):
    """One sample; what the numbers are made of depends on the kind."""

    tick: int
    measured: Structure
    reference: Structure
    command: Structure
    made: Structure


class Golden(NamedTuple):
    """Samples, and the memory after the last of them."""

    samples: list[Sample]
    memory: Structure


def golden(exported: Exported, path: Callable[[float], Reference]) -> Golden:
    """The vectors of a law. path: the reference at a time [s]."""
    with np.errstate(all="ignore"):
        return sampled(exported, path)


def sampled(exported: Exported, path: Callable[[float], Reference]) -> Golden:
    """The same, by the numbers' own rules."""
    subject, precise, clocked = exported.subject, exported.precise, exported.clocked
    law, gains, parameters = subject.controller, in_kind(subject.gains, precise), in_kind(subject.parameters, precise)
    draw = uniform()
    start = in_kind(subject.measured, precise)
    memory = always(law.start)(start, gains)
    step, made = kind(clocked.step, precise), cast(Structure, None)
    names = list(fields_of(exported.code.command))
    samples = []
    for place in range(SAMPLES):
        tick = place * max(1, clocked.last // SAMPLES // clocked.law) * clocked.law
        reference = path(tick * clocked.step)
        measured = fed_back(in_kind(strayed(subject.measured, reference, draw, place % FAR == FAR - 1), precise), made)
        wanted, t = in_kind(reference, precise), kind(float(tick), precise) * step
        if guided(exported):
            period = kind(clocked.step * clocked.guide, precise)
            memory = always(law.guide)(memory, measured, wanted, gains, t, period)
        command, memory = always(law.law)(memory, measured, wanted, gains, t, kind(clocked.step * clocked.law, precise))
        made = always(subject.plant.actuate)(parameters, command)
        samples.append(Sample(tick, measured, wanted, only(command, names), made))
    return Golden(samples, memory)


def kind(value: float, precise: bool) -> Number:
    """A float as the numbers of this kind."""
    return value if precise else cast(Number, Single(value))


def in_kind(structure: Any, precise: bool) -> Any:
    """A structure of floats as one of these numbers."""
    leaves = (leaf if isinstance(leaf, Table) else kind(float(leaf), precise) for leaf in flatten(structure))
    return rebuild(structure, leaves)


def uniform() -> Iterator[float]:
    """Numbers from -1 to 1, always the same."""
    while True:
        raw = np.random.Philox(key=np.array([1, 1], dtype=np.uint64)).random_raw(4096)
        yield from (2.0 * (raw >> np.uint64(11)).astype(np.float64) * 2.0**-53 - 1.0).tolist()


def strayed(measured: Any, reference: Reference, draw: Iterator[float], far: bool) -> Any:
    """A measurement near the path."""
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
    return measured._replace(**changed)


def fed_back(measured: Any, made: Any) -> Any:
    """The measurement, told what the last command made."""
    if made is None or not hasattr(made, "_fields"):
        return measured
    return measured._replace(**{name: getattr(made, name) for name in ("thrust", "torque") if name in measured._fields})


# As C


def golden_header(exported: Exported, vectors: Golden) -> str:
    """The vectors as constants of C."""
    precise, clocked = exported.precise, exported.clocked

    def rows(name: str, structures: list[Structure]) -> str:
        leaves = [[number(float(leaf), precise) for leaf in flatten(one)] for one in structures]
        text = ",\n".join("    {" + ", ".join(row) + "}" for row in leaves)
        return f"static const real golden_{name}[{len(leaves)}][{len(leaves[0])}] =\n{{\n{text}\n}};"

    samples = vectors.samples
    parts = [
        head(exported, "Golden vectors, as quadstep computes them in Python."),
        f"#define GOLDEN_SAMPLES {len(samples)}",
        "static const uint32_t golden_tick[GOLDEN_SAMPLES] = {" + ", ".join(f"{one.tick}u" for one in samples) + "};",
        f"static const real golden_step = {number(clocked.step, precise)};",
        f"static const real golden_law_period = {number(clocked.step * clocked.law, precise)};",
        *(
            [f"static const real golden_guide_period = {number(clocked.step * clocked.guide, precise)};"]
            if guided(exported)
            else []
        ),
        rows("start", [in_kind(exported.subject.measured, precise)]),
        rows("measured", [one.measured for one in samples]),
        rows("reference", [one.reference for one in samples]),
        rows("command", [one.command for one in samples]),
        rows("made", [one.made for one in samples]),
        *([rows("memory", [vectors.memory])] if flatten(vectors.memory) else []),
    ]
    return "\n\n".join(parts) + "\n"


def test_source(exported: Exported) -> str:
    """The test: the same bits as the vectors, a zero's sign apart, and what the guards promise."""
    name, upper = exported.name, exported.name.upper()
    text = TEST.replace("NAME", name).replace("UPPER", upper)
    text = text.replace("GUIDE\n", GUIDE.replace("NAME", name).replace("UPPER", upper) if guided(exported) else "")
    has_memory = bool(fields_of(exported.code.memory))
    text = text.replace("MEMORY\n", MEMORY if has_memory else "")
    word = "uint64_t" if exported.precise else "uint32_t"
    return f"{head(exported, 'A test of the law: golden vectors and guards. It prints what it found and returns 0 if all is well.')}\n\n{text}".replace(
        "WORD", word
    ).replace("READ", str(first_read(exported)))


def first_read(exported: Exported) -> int:
    """The first number of the measurement that the law takes."""
    place = 0
    for field, value in fields_of(exported.subject.measured).items():
        if any(begins(text, f"measured->{field}") for text in exported.code.reads["law"]):
            return place
        place += len(flatten(value))
    return 0


GUIDE = """        clock.period = golden_guide_period;
        failures += expect("guide", NAME_guide(&NAME_mission, &state, &measured, &reference, &clock) == UPPER_OK);
"""

MEMORY = """    failures += compare("memory", GOLDEN_SAMPLES - 1, &state.memory, golden_memory[0], sizeof golden_memory[0]);
"""

TEST = """#include "NAME.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "NAME_golden.h"

/* Compares numbers bit for bit; -0 and 0 count as equal. */
static int compare(const char *what, int sample, const void *found, const real *wanted, size_t size)
{
    int failures = 0;
    for (size_t i = 0u; i < size / sizeof(real); ++i)
    {
        real value;
        WORD found_bits;
        WORD wanted_bits;
        memcpy(&value, (const unsigned char *)found + i * sizeof(real), sizeof value);
        memcpy(&found_bits, &value, sizeof found_bits);
        memcpy(&wanted_bits, &wanted[i], sizeof wanted_bits);
        if ((found_bits != wanted_bits) && (((found_bits | wanted_bits) << 1) != 0u))
        {
            if (failures == 0)
            {
                printf("sample %d, %s[%d]: %.17g instead of %.17g\\n", sample, what, (int)i, (double)value, (double)wanted[i]);
            }
            ++failures;
        }
    }
    return failures;
}

static int expect(const char *what, int holds)
{
    if (!holds)
    {
        printf("%s: not the status that was expected\\n", what);
    }
    return holds ? 0 : 1;
}

static NAME_state state;
static NAME_measured measured;
static NAME_reference reference;
static NAME_command command;
static NAME_actuators made;

int main(void)
{
    int failures = 0;
    NAME_clock clock = {0};
    clock.step = golden_step;
    clock.period = golden_law_period;

    memcpy(&measured, golden_start[0], sizeof measured);
    memcpy(&reference, golden_reference[0], sizeof reference);
    NAME_reset(&state);
    failures += expect("law before start", NAME_law(&NAME_mission, &state, &measured, &reference, &clock, &command) == UPPER_NOT_STARTED);
    failures += expect("start", NAME_start(&NAME_mission, &state, &measured) == UPPER_OK);
    for (int i = 0; i < GOLDEN_SAMPLES; ++i)
    {
        memcpy(&measured, golden_measured[i], sizeof measured);
        memcpy(&reference, golden_reference[i], sizeof reference);
        clock.tick = golden_tick[i];
GUIDE
        clock.period = golden_law_period;
        failures += expect("law", NAME_law(&NAME_mission, &state, &measured, &reference, &clock, &command) == UPPER_OK);
        (void)NAME_made(&NAME_mission, &command, &made);
        failures += compare("command", i, &command, golden_command[i], sizeof golden_command[i]);
        failures += compare("made", i, &made, golden_made[i], sizeof golden_made[i]);
    }
MEMORY
    {
        const NAME_state before = state;
        const int last = GOLDEN_SAMPLES - 1;
        NAME_command after = command;
        real *const entry = &((real *)(void *)&measured)[READ];
        const real kept = *entry;
        *entry = (real)NAN;
        failures += expect("NaN", NAME_law(&NAME_mission, &state, &measured, &reference, &clock, &after) == UPPER_NOT_FINITE);
        failures += compare("command after NaN", last, &after, golden_command[last], sizeof golden_command[last]);
        *entry = kept;
        clock.age = (real)1000.0;
        failures += expect("old", NAME_law(&NAME_mission, &state, &measured, &reference, &clock, &after) == UPPER_STALE);
        failures += compare("command after an old sample", last, &after, golden_command[last], sizeof golden_command[last]);
        failures += expect("memory is kept", memcmp(&before, &state, sizeof state) == 0);
    }
    printf(failures == 0 ? "%d samples: the same bits\\n" : "%d samples: differences\\n", GOLDEN_SAMPLES);
    return failures == 0 ? 0 : 1;
}
"""
