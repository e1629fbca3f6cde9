"""A flight's law measured on one processor, without keeping what is exported."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from quadstep.engines.fly import FlightPlan
from quadstep.export.arm import InstructionCounts, Sizes, measured
from quadstep.export.c.interface import Exported, loops
from quadstep.export.c.subject import exported
from quadstep.export.c99 import c99_files
from quadstep.io.errors import ToolError


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
