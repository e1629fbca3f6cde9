"""Names of margins as metrics: `phase_margin` is the least over all channels, `phase_margin_roll` that of one."""

import math
from collections.abc import Mapping
from typing import cast

LEAST_GAIN, LEAST_PHASE, DELAYS = 6.0, math.radians(30.0), 2.0
"""Margins asked of a sound loop unless a mission says otherwise: of gain [dB], upwards and downwards, and of phase [rad], the
textbook's (Ogata, "Modern Control Engineering", 5th edition, section 7-7; for aircraft SAE AS94900 asks for 6 dB and 45
degrees); of delay, in multiples of the mission's latency.
"""

UNITS = {
    "gain_margin_up": "[dB]",
    "gain_margin_down": "[dB]",
    "phase_margin": "[rad]",
    "delay_margin": "[s]",
    "disk_margin": "",
    "sensitivity_peak": "",
}
"""Each kind, with its unit. gain_margin_down: how far the gain may fall, a number above 0."""

CHANNELS = "thrust", "roll", "pitch", "yaw"

LESS_IS_BETTER = "sensitivity_peak"

MARGINS = {f"{kind}{ending}": unit for kind, unit in UNITS.items() for ending in ("", *(f"_{name}" for name in CHANNELS))}
"""Units by name."""


AT_REST, SOUND, NO_REST = "margins_at_rest", "sound", "no rest found"
"""The key of a result under which "grade" and "why" of its loop at rest are; the best grade, and that without rest."""

WRITTEN = "the loop of the mission as written"
"""Whose grade it is where a mission is varied."""


def rest_of(metrics: Mapping[str, object]) -> Mapping[str, str]:
    """The grade of the loop at rest and why, as a flight's metrics have it; empty where it is not known."""
    return cast(Mapping[str, str], metrics.get(AT_REST, {}))


def at_rest(rest: Mapping[str, str], whose: str = "its loop") -> str:
    """A grade beside other results, in words without a full stop; empty where none is known."""
    if not rest:
        return ""
    if rest["grade"] == NO_REST:
        return f"no rest was found for {whose}: {rest['why']}"
    return f"at rest {whose} is {rest['grade']}: {rest['why']}"


def at_rest_sentences(rest: Mapping[str, str], whose: str = "its loop") -> list[str]:
    """The same as a sentence, if a grade is known."""
    text = at_rest(rest, whose)
    return [f"{text[0].upper()}{text[1:]}."] if text else []


def is_margin(name: str) -> bool:
    """Whether larger values of this metric are better."""
    return name in MARGINS and not name.startswith(LESS_IS_BETTER)
