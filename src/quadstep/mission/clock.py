"""The clock of a mission: how long, in which steps, and how often each sampled law runs."""

from collections.abc import Sequence
from typing import Annotated

from pydantic import Field

from quadstep.interfaces.closed_loop import Ticks
from quadstep.io.errors import UserError
from quadstep.mission.fields import Positive, Quantity, Section

PERIODS = {"law": "control_period", "guide": "guidance_period"}
"""Keys that say how often a method of a controller runs, where a kind of mission has them."""

STEP = 0.002
"""Of the integrator, unless a controller has a loop that is faster [s]."""

MOST_ROWS = 500_000
MOST_STEPS = 200_000_000


class ClockSection(Section):
    """Clock of the flight; every `..._period` is a whole multiple of step."""

    duration: Annotated[Positive | None, Quantity("s", "duration of the flight; default: the path's")] = None
    step: Annotated[Positive, Quantity("s", "integrator step (RK4); every period is a multiple of it")] = STEP
    log_period: Annotated[Positive, Quantity("s", "sampling period of the log")] = 0.01
    loop_periods: Annotated[
        dict[str, Positive], Quantity("s", "periods of a controller's further loops, by name; default: as declared")
    ] = Field(default={}, max_length=16)

    def model_post_init(self, context: object) -> None:
        said = {key: getattr(self, key) for key in type(self).model_fields if key.endswith("_period")}
        said |= {f"loop_periods.{name}": period for name, period in self.loop_periods.items()}
        wrong = [f"{key} = {period:g} s" for key, period in said.items() if not is_multiple(period, self.step)]
        if wrong:
            must = "must be a whole multiple" if len(wrong) == 1 else "must be whole multiples"
            raise ValueError(f"{' and '.join(wrong)} {must} of step = {self.step:g} s")

    def check_loops(self, loops: Sequence[str]) -> None:
        """Refuses a period of a loop that the controller does not have. Raises ValueError."""
        known = [name for name in loops if PERIODS.get(name) not in type(self).model_fields]
        for name in self.loop_periods.keys() - set(known):
            allowed = ", ".join(known) or "none"
            raise ValueError(f"simulation: loop_periods.{name}: the controller has no such loop; allowed: {allowed}")

    def period_of(self, loop: str) -> float:
        """From sample to sample of a controller's `law`, or of one of its loops [s]."""
        key = PERIODS.get(loop, "")
        return getattr(self, key) if key in type(self).model_fields else self.loop_periods[loop]

    def clock(self, length: float, periods: Sequence[float]) -> Ticks:
        """The clock of a flight along a path of `length` [s], its tasks due every so many seconds.

        Raises UserError for a flight too long or too short.
        """
        duration = self.duration or length
        steps, rows = round(duration / self.step), duration / self.log_period
        log = round(self.log_period / self.step)
        if not (log <= steps <= MOST_STEPS and rows <= MOST_ROWS):
            raise UserError(
                f"simulation.duration: {duration:g} s make {steps:.6g} steps and {rows:.6g} log rows; "
                f"allowed: 1 to {MOST_ROWS} rows and at most {MOST_STEPS} steps"
            )
        beyond = MOST_STEPS + 1  # due once, at the start
        return Ticks(self.step, tuple(min(round(period / self.step), beyond) for period in periods), log, steps)


def is_multiple(period: float, step: float) -> bool:
    """Whether a period is a whole multiple of the step."""
    ratio = period / step
    return round(ratio) >= 1 and abs(ratio - round(ratio)) <= 1e-6
