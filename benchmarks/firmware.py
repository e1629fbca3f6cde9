"""`python -m benchmarks.firmware`: the cost of exported laws on Cortex-M4F, the table of docs/export.md.

Of the Crazyflie on a circle, in f32: exact numbers, which no busy machine can blur. Needs `arm-none-eabi-gcc` and QEMU.
"""

from typing import NamedTuple

from quadstep.engines.fly import FlightPlan
from quadstep.export.arm import section
from quadstep.export.run import measured_standalone
from quadstep.io.errors import UserError
from quadstep.mission.multirotor import MultirotorMission

LAWS = ("rotation-backstepping", "backstepping", "pid", "geometric", "lqr", "raptor", "mpc", "mppi")

CLOCK, PER_CYCLE = 168e6, 0.7
"""Of the processor [Hz], and instructions that it does in a cycle."""

APART = r"\.(text|rodata)(?!\S*_(made|start|enter|reset)\b)\S*"
"""Sections of the law itself: without what limits say, and what is called once."""


def plan(law: str, **gains: float) -> FlightPlan:
    """The flight whose controller is exported. gains: other than its defaults."""
    path = {"type": "circle", "centre": [0.0, 0.0, 3.0], "radius": 1.0, "period": 4.0, "turns": 2.0}
    mission = {"vehicle": {"preset": "crazyflie"}, "path": path, "controller": {"type": law, **gains}}
    return MultirotorMission.model_validate(mission).plan()


class Cells(NamedTuple):
    """Of a law's row. code: all; alone: without `made`, `start`, `enter`, `reset`. worst: instructions of each loop, and the
    share of its own period that they take.
    """

    state: int
    code: int
    alone: int
    stack: int
    worst: dict[str, tuple[int, float]]

    @property
    def together(self) -> int:
        """Instructions where all loops are due."""
        return sum(count for count, _ in self.worst.values())

    @property
    def share(self) -> float:
        """Of 1 ms, where all loops are due."""
        return self.together / (PER_CYCLE * CLOCK * 1e-3)


def cells(law: str, **gains: float) -> Cells:
    """Measure a law, with gains other than its defaults. Raises UserError where a tool fails."""
    flight = plan(law, **gains)
    with measured_standalone(flight, "Cortex-M4F") as found:
        alone = section(found.folder / f"{found.law.name}.o", APART)
    periods = {task.name: every * flight.ticks.step for task, every in zip(flight.loop.tasks, flight.ticks.every, strict=True)}
    shares = {name: (count, count / (PER_CYCLE * CLOCK * periods[name])) for name, count in found.worst.items()}
    return Cells(found.sizes.state, found.sizes.code, alone, max(found.sizes.stack.values()), shares)


def row(law: str) -> str:
    """A law's numbers in a line."""
    one = cells(law)
    loads = ", ".join(f"{name} {count} ({share:.2%} of its period)" for name, (count, share) in one.worst.items())
    return (
        f"{law}: {one.state} B of state, {one.code} B of code, {one.alone} B without made, start, enter and reset, "
        f"{one.stack} B of stack; instructions at worst: {loads}; together {one.together}, {one.share:.2%} of 1 ms"
    )


if __name__ == "__main__":
    for kind in LAWS:
        try:
            print(row(kind), flush=True)
        except UserError as error:
            print(f"{kind}: {error}")
