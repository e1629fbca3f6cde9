"""`quadstep campaign --require SHARE`: how large a share of flights must succeed for sure."""

import math
from typing import NamedTuple

from quadstep.io.errors import UserError
from quadstep.metrics.judging.verdict import Case
from quadstep.metrics.statistics import LEVEL, Estimate


def parsed(text: str) -> float:
    """A share between 0 and 1. Raises UserError.

    1 is refused with 0: no number of flights shows that none fails, the other needs no flight at all.
    """
    try:
        least = float(text)
    except ValueError:
        least = math.nan
    if not 0.0 < least < 1.0:
        raise UserError(f"--require {text!r:.40}: should be a share of flights between 0 and 1, like 0.999")
    return least


class JudgedShare(NamedTuple):
    """least: what was required. success: share of flights with its interval, of which the lower end counts.

    flights: that were counted; None where the share was estimated in another way. doubt: why the interval is not reliable.
    """

    least: float
    success: Estimate
    flights: int | None = None
    doubt: str = ""

    @property
    def met(self) -> bool:
        """Whether the lower end of the interval reaches what is required, and can be relied on."""
        return self.success.low >= self.least and not self.doubt

    @property
    def case(self) -> Case:
        name = f"at least {self.least:.10g} of the flights succeed, with {100 * LEVEL:g} % confidence"
        failure = f"success rate should be at least {self.least:.10g}, but is only shown to be above {self.success.low:.10g}"
        needed = flights_needed(self.least)
        if self.success.low >= self.least:
            failure = f"the estimate is not reliable: {self.doubt}"
        elif self.flights is not None and self.flights < needed:
            failure += f"; {self.flights} flights cannot show more; {needed} could, if none fails"
        return Case(name, None if self.met else failure)

    def as_json(self) -> dict[str, object]:
        """For `--json`."""
        return {"least": self.least, "measured": self.success.low, "met": self.met}


def flights_needed(least: float) -> int:
    """The fewest flights whose interval reaches `least` if all succeed: (1 - LEVEL) / 2 = least^n."""
    return math.ceil(math.log(0.5 * (1.0 - LEVEL)) / math.log(least))
