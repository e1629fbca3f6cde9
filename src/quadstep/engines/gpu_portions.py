"""The number of flights per launch: few enough for the memory and for Ctrl-C, which waits until a launch is over."""

import math

from quadstep.engines.cuda import PROCESSORS, Device, Kernel

SECONDS = 0.5
"""Target duration of a launch [s]; no launch can be shorter than one flight."""

SHARE = 0.8
"""Share of the free memory that a launch may take."""


class Portions:
    """The size of the next launch.

    A wave, as many flights as run at once, comes first; its duration determines how many whole waves come next. Each
    flight is a thread of its own, so its numbers do not depend on any of this.

    fixed: flights per launch instead, if that many fit into memory.
    """

    def __init__(self, device: Device, kernel: Kernel, threads: int, bytes_a_flight: int, fixed: int | None = None) -> None:
        self.threads, self.fixed = threads, fixed
        self.wave = device.attribute(PROCESSORS) * max(1, kernel.resident_blocks(threads)) * threads
        self.most = max(threads, int(SHARE * device.free_memory()) // bytes_a_flight)
        self.size = min(fixed or self.wave, self.most)

    def took(self, flights: int, seconds: float) -> None:
        """Learn from a launch that went well."""
        if not self.fixed:
            waves = math.floor(SECONDS * flights / max(seconds, 1e-9) / self.wave)
            self.size = min(max(1, waves) * self.wave, self.most)

    def smaller(self) -> bool:
        """Half as many from now on, because others use the memory; returns whether that is possible."""
        self.most = min(self.size, self.most) // 2
        self.size = self.most
        return self.most >= self.threads
