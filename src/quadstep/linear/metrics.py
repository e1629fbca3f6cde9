"""Margins as metrics of a mission at rest, each a finite number, so that they can be compared and searched."""

import math
from collections.abc import Iterable

from quadstep.linear.analysis import Analysis, least, studied
from quadstep.linear.margins import Margins
from quadstep.metrics.margins import LESS_IS_BETTER, MARGINS, UNITS
from quadstep.mission.schema import Mission

MOST = {"gain_margin_up": 60.0, "gain_margin_down": 60.0, "phase_margin": math.pi, "delay_margin": 10.0, "disk_margin": 2.0}
"""Finite stand-in for an infinite margin, in its unit."""

UNSTABLE = {**dict.fromkeys(MOST, 0.0), LESS_IS_BETTER: 1000.0}
"""Margin of a loop that is not stable."""


def margin_metrics(mission: Mission, names: Iterable[str]) -> dict[str, float]:
    """The metrics of these names, out of `MARGINS`. Raises UserError for a loop that cannot be linearised."""
    found = of_analysis(studied(mission).analysis)
    return {name: found[name] for name in names}


def of_analysis(found: Analysis) -> dict[str, float]:
    """All metrics by name; for a channel that the vehicle does not have, the stand-in for an infinite margin."""
    by_channel = {channel.name: one for channel, one in zip(found.channels, found.margins, strict=False)}
    if found.stable:
        by_channel[""] = least(found.margins)
    made = {}
    for name in MARGINS:
        kind = next(kind for kind in UNITS if name.startswith(kind))
        one = by_channel.get(name.removeprefix(kind).removeprefix("_"))
        endless = MOST.get(kind, 1.0)
        made[name] = (
            UNSTABLE[kind] if not found.stable else endless if one is None else min(sizes(one)[kind], MOST.get(kind, math.inf))
        )
    return made


def sizes(one: Margins) -> dict[str, float]:
    """By kind."""
    return {
        "gain_margin_up": one.up,
        "gain_margin_down": one.down,
        "phase_margin": one.phase,
        "delay_margin": one.delay,
        "disk_margin": one.disk,
        LESS_IS_BETTER: one.sensitivity,
    }
