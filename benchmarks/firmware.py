"""`python -m benchmarks.firmware`: what exported laws take on Cortex-M4F, the table of docs/export.md.

Of the Crazyflie on a circle, in f32: exact numbers, which no busy machine can blur. Needs `arm-none-eabi-gcc` and QEMU.
"""

import tempfile
from pathlib import Path

from quadstep import Mission
from quadstep.c99.interface import loops
from quadstep.c99.subject import exported
from quadstep.errors import UserError
from quadstep.export.arm import measured, section
from quadstep.export.c99 import c99_files
from quadstep.flight.engines import FlightPlan

LAWS = ("rotation-backstepping", "backstepping", "pid", "geometric", "lqr", "raptor", "mpc", "mppi")

CLOCK, PER_CYCLE = 168e6, 0.7
"""Of the processor [Hz], and instructions that it does in a cycle."""

APART = r"\.(text|rodata)(?!\S*_(made|start|reset)\b)\S*"
"""Sections of the law itself: without what limits say, and what is called once."""


def plan(law: str) -> FlightPlan:
    """The flight whose controller is exported."""
    path = {"type": "circle", "centre": [0.0, 0.0, 3.0], "radius": 1.0, "period": 4.0, "turns": 2.0}
    return Mission(vehicle={"preset": "crazyflie"}, path=path, controller={"type": law}).plan()


def row(law: str) -> str:
    """A law's numbers in a line."""
    flight = plan(law)
    one = exported(flight, precise=False)
    with tempfile.TemporaryDirectory() as place:
        folder, work = Path(place) / "c99", Path(place) / "build"
        folder.mkdir()
        work.mkdir()
        for name, text in c99_files(one, flight).items():
            (folder / name).write_text(text, encoding="utf-8")
        found = measured(one, folder, work)["Cortex-M4F"]
        alone = section(work / "CortexM4F" / f"{one.name}.o", APART)
    assert found.counted
    assert found.counted.same_bits
    worst = {name: found.counted.worst[name] for name in ("law", *loops(one))}
    periods = {task.name: every * flight.ticks.step for task, every in zip(flight.loop.tasks, flight.ticks.every, strict=True)}
    shares = [f"{name} {count} ({count / (PER_CYCLE * CLOCK * periods[name]):.2%})" for name, count in worst.items()]
    return (
        f"{law}: {found.sizes.state} B of state, {found.sizes.code} B of code, {alone} B without made, start and reset, "
        f"{max(found.sizes.stack.values())} B of stack; instructions at worst, and share of the loop's own period: "
        f"{', '.join(shares)}; {sum(worst.values())} together ({sum(worst.values()) / (PER_CYCLE * CLOCK * 1e-3):.2%} of 1 ms)"
    )


if __name__ == "__main__":
    for kind in LAWS:
        try:
            print(row(kind), flush=True)
        except UserError as error:
            print(f"{kind}: {error}")
