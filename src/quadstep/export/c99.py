"""The folder of `--target c99`: header, source, parameters, a test with golden vectors, a build file, a data sheet."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from quadstep.engines.fly import FlightPlan
from quadstep.export.arm import InstructionCounts, Sizes, measured
from quadstep.export.c.compiler import BITS, WARNINGS
from quadstep.export.c.flight import exported
from quadstep.export.c.golden import golden, golden_header, test_source
from quadstep.export.c.interface import Exported, header, loops, title
from quadstep.export.c.literals import filled
from quadstep.export.c.source import parameters, source
from quadstep.io.errors import ToolError

TEMPLATES = Path(__file__).parent / "templates"


def c99_files(exported: Exported, plan: FlightPlan) -> dict[str, str]:
    """Name and text of every file but the data sheet. Raises UserError for a number that does not fit f32."""
    name = exported.name
    vectors = golden(exported, lambda t: plan.loop.wanted(t, plan.parameters))
    words = {
        "LABEL": title(exported),
        "LAW": name,
        "test_LAW": f"test_{name}",
        "BITS": " ".join(BITS),
        "WARNINGS": " ".join(WARNINGS),
    }
    return {
        f"{name}.h": header(exported),
        f"{name}.c": source(exported),
        f"{name}_params.c": parameters(exported),
        f"{name}_golden.h": golden_header(exported, vectors),
        f"test_{name}.c": test_source(exported),
        "CMakeLists.txt": filled(TEMPLATES / "CMakeLists.txt", words),
    }


def as_they_are(_: Exported, files: dict[str, str]) -> dict[str, str]:
    """The files of C99 itself."""
    return files


class Alone(NamedTuple):
    """law: in f32. folder: where it was built, as long as it is there."""

    law: Exported
    sizes: Sizes
    counted: InstructionCounts
    folder: Path

    @property
    def worst(self) -> dict[str, int]:
        """Instructions of each loop at worst."""
        return {name: self.counted.worst[name] for name in ("law", *loops(self.law))}


@contextmanager
def measured_alone(plan: FlightPlan, processor: str) -> Iterator[Alone]:
    """The law of a flight. Raises UserError where it cannot be exported, ToolError where a tool fails or bits differ."""
    law = exported(plan, precise=False)
    with tempfile.TemporaryDirectory() as place:
        folder, work = Path(place) / "c99", Path(place) / "build"
        folder.mkdir()
        work.mkdir()
        for name, text in c99_files(law, plan).items():
            (folder / name).write_text(text, encoding="utf-8")
        found = measured(law, folder, work, [processor])[processor]
        if not found.counted or not found.counted.same_bits:
            raise ToolError("QEMU did not give the same bits")
        (build,) = work.iterdir()
        yield Alone(law, found.sizes, found.counted, build)
