"""Names of margins as metrics: `phase_margin` is the least over all channels, `phase_margin_roll` that of one."""

import math

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


def is_margin(name: str) -> bool:
    """Whether larger values of this metric are better."""
    return name in MARGINS and not name.startswith(LESS_IS_BETTER)
