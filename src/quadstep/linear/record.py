"""An analysis for machines: numbers in SI units, gain margins in dB; missing values are null."""

import math

from quadstep.linear.analysis import Analysis
from quadstep.linear.grade import graded
from quadstep.linear.margins import Margins
from quadstep.linear.step import Step

MARGIN_COLUMNS = (
    "gain_up[dB]", "gain_down[dB]", "phase[rad]", "crossover[rad/s]", "delay[s]", "disk[-]", "sensitivity[-]",
    "complementary[-]",
)  # fmt: skip


def finite(value: float) -> float | None:
    """A number as JSON can represent it."""
    return value if math.isfinite(value) else None


def margin_numbers(one: Margins) -> list[float | None]:
    """The columns of `MARGIN_COLUMNS`."""
    gains = [20.0 * math.log10(gain) if 0.0 < gain < math.inf else None for gain in (one.gain_up, one.gain_down)]
    rest = one.phase, one.phase_at, one.delay, one.disk, one.sensitivity, one.complementary
    return [*gains, *map(finite, rest)]


def margin_record(one: Margins) -> dict[str, float | None]:
    """By name."""
    return dict(zip(MARGIN_COLUMNS, margin_numbers(one), strict=True))


def record(found: Analysis, steps: list[Step]) -> dict[str, object]:
    """The whole analysis."""
    period, grade, asked = found.loop.period, graded(found), found.limits
    return {
        "grade": grade.word,
        "why": grade.why,
        "limits": {"gain[dB]": asked.gain, "phase[rad]": asked.phase, "delay[s]": asked.delay},
        "stable": found.holds,
        "not_held": list(found.not_held),
        "period[s]": period.length,
        "states": list(period.names),
        "margins": {channel.name: margin_record(one) for channel, one in zip(found.channels, found.margins, strict=False)},
        "bends": list(found.bends),
        "bends_near": list(found.near),
        "sides_tried": found.tried,
        "poles[1/s]": [[pole.real, pole.imaginary] for pole in found.poles],
        "pole_states": [list(pole.states) for pole in found.poles],
        "steps": {step.name: {"overshoot[-]": step.overshoot, "settling[s]": finite(step.settling)} for step in steps},
    }
