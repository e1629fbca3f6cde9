"""The table `[margins]` of a mission: the stability margins that its loop should have."""

from typing import Annotated

from quadstep.metrics.margins import DELAYS, LEAST_GAIN, LEAST_PHASE
from quadstep.mission.fields import NonNegative, Quantity, Section


class MarginsSection(Section):
    """Least stability margins of a loop that is graded sound; they affect no flight."""

    gain: Annotated[NonNegative, Quantity("dB", "least gain margin, upwards and downwards")] = LEAST_GAIN
    phase: Annotated[NonNegative, Quantity("rad", "least phase margin")] = LEAST_PHASE
    delay: Annotated[
        NonNegative | None, Quantity("s", "least delay margin; default: twice the latency of sensors and commands")
    ] = None

    def least_delay(self, latency: float) -> float:
        """The delay margin [s] asked of a mission with this latency [s]."""
        return DELAYS * latency if self.delay is None else self.delay
