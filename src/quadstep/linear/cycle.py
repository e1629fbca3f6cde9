"""What a flight of a loop that is unstable at rest does: it is lost, or swings."""

import numpy as np

from quadstep.engines.fly import fly
from quadstep.interfaces.closed_loop import Outcome
from quadstep.io.errors import UserError
from quadstep.linear.equilibrium import held, quiet
from quadstep.linear.states import Array
from quadstep.mission.schema import Mission
from quadstep.report.units import quantity

LONG, KICK, LEAST = 60.0, 1e-3, 1e-6
"""How long it is flown [s], the step along each axis that it begins with, and the least swing that counts [m]."""

STEADY = 0.5
"""Share by which the swing may change over the last half of the flight where it neither grows nor decays."""


def flown_from_rest(mission: Mission) -> str:
    """A sentence on a flight that is to stay where the path begins, without noise, gusts and events, after a small step."""
    path = mission.path.build(mission.folder)
    try:
        log = fly(quiet(held(mission, path.law.reference(0.0, path.parameters), LONG, KICK).plan(warn=False)))
    except UserError as error:  # a law of the user's own that fails there
        return f"It cannot be flown at rest: {error}."
    if log.outcome is not Outcome.COMPLETED:
        return f"Flown to rest there it is lost after {log.ended:.3g} s."
    t, half = log.column("t"), len(log.rows) // 2
    axes = {name: log.column(name)[half:] for name in ("x", "y", "z")}
    axis, values = max(axes.items(), key=lambda one: np.ptp(one[1]))
    first, last = np.ptp(values[: len(values) // 2]), np.ptp(values[len(values) // 2 :])
    if np.ptp(values) < 2.0 * LEAST:
        return f"Flown to rest there it stays within {quantity(LEAST, 'm')} for {LONG:g} s: it grows too slowly to be seen."
    trend = ", still growing" if last > (1.0 + STEADY) * first else ", decaying" if last < (1.0 - STEADY) * first else ""
    every = period(t[half:], values)
    swing = f"it swings by {quantity(0.5 * float(last), 'm')} along {axis}"
    about = f" every {quantity(every, 's')}" if every else ""
    return f"Flown to rest there it does not settle: {swing}{about}{trend}."


def period(t: Array, values: Array) -> float:
    """Mean time between upward crossings of the mean [s]; 0 where there are too few."""
    above = values > values.mean()
    crossings = t[1:][above[1:] & ~above[:-1]]
    return float(np.diff(crossings).mean()) if len(crossings) > 2 else 0.0
