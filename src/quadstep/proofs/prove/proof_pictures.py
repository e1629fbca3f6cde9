"""What a proof shows: flights beside what is proved of them, as figures with captions."""

from __future__ import annotations

from itertools import product

import numpy as np

from quadstep.engines.fly import FlightPlan
from quadstep.io.errors import UserError
from quadstep.linear.equilibrium import GROWING, KICK, stepped
from quadstep.mission.schema import Mission
from quadstep.numbers import flatten, rebuild
from quadstep.proofs.prove.hold import Hold
from quadstep.proofs.prove.report import length
from quadstep.proofs.prove.sampled import Array, SampledLoop
from quadstep.report import units
from quadstep.report.drawing import FigureJob
from quadstep.report.panel import LOG, Panel

MOST, NEAR = 150, 0.01
"""Samples that are flown for a figure of a set; share of the limit from which on it is drawn."""


def of_tube(loop: SampledLoop, error: Array, bound: Array) -> list[FigureJob]:
    """A tube as far as it is closed. error: flown less desired position, and bound: of every flight about the flown one,
    (samples + 1, axes) [m].
    """
    axes, reach = loop.loop.plant.axes, float((np.abs(error) + bound).max())
    unit, factor = ("mm", 1e3) if reach < 1.0 else ("m", 1.0)
    time: Array = np.arange(len(bound), dtype=np.float64) * loop.period
    panels = [
        Panel(f"error in {axis}", unit, {"the mission's flight": off}, reach=factor * reach, band=(off - half, off + half))
        for axis, off, half in zip(axes, factor * error.T, factor * bound.T, strict=True)
    ]
    most, widest = [length(one) for one in bound.max(axis=0).tolist()], length(float(bound.max()))
    at = float(time[np.argmax(bound.max(axis=1))])
    along = [axis for axis, one in zip(axes, most, strict=True) if one == widest]
    caption = (
        "Line: how far the mission's own flight is from its path. Band: where every other flight is proved to be. It is "
        f"widest along {units.listed(along)}, {widest} to each side at {units.quantity(at, 's')}; "
        "where no band is seen, it is thinner than the line."
    )
    return [FigureJob("tube", caption, time, panels)]


def of_flight(t: Array, errors: Array, limit: float, whose: str = "the mission's own flight from its path") -> list[FigureJob]:
    """How far a flight was from where it should be. errors: (samples, axes) [m]. limit: that ends it [m]."""
    far = np.linalg.norm(errors, axis=1)
    lines = {"flown": far} | ({f"limit, {limit:g} m": np.full(len(t), limit)} if far[-1] > NEAR * limit else {})
    last, at = units.quantity(float(far[-1]), "m", 4), units.quantity(float(t[-1]), "s")
    caption = f"Distance of {whose}: {last} at {at}. {GROWING}"
    return [FigureJob("flight", caption, t, [Panel("distance", "m", lines, LOG)])]


def of_instability(mission: Mission, plan: FlightPlan, at: float) -> list[FigureJob]:
    """A flight that is to hover where its path is at a time [s], after a small step; none if that fails."""
    try:
        _, t, errors = stepped(mission, plan.loop.path.reference(at, plan.parameters.path))
    except UserError:  # of a law of the user's own
        return []
    whose = f"a flight that begins {1e3 * KICK:g} mm from that hover along each axis"
    return of_flight(t, errors, plan.parameters.limits.distance, whose)


def of_set(loop: SampledLoop, kept: Hold, position: Array) -> list[FigureJob]:
    """Flights from the corners of the box of starts, beside the set that none leaves. position: its extent [m]."""
    axes, start = loop.loop.plant.axes, kept.found.start
    corners = start * np.array(list(product((-1.0, 1.0), repeat=len(axes)))).T
    begun: list[Array | float] = kept.at.state.tolist()
    if kept.own:
        first = flatten(loop.plan.start)
        leaves = [*(one + way for one, way in zip(first, corners, strict=False)), *first[len(axes) :]]
        cycle = flatten(loop.loop.start(rebuild(loop.plan.start, iter(leaves)), loop.parameters))
        begun = [cycle[place] for place in loop.places]
    else:
        begun = [*(one + way for one, way in zip(kept.at.state, corners, strict=False)), *begun[len(axes) :]]
    flown = np.abs(loop.flown_from(begun, 0, MOST)[1:, : len(axes)] - kept.at.state[: len(axes), None]).max(axis=2)
    time: Array = np.arange(1, len(flown) + 1, dtype=np.float64) * loop.period
    panels = [
        Panel(f"{axis} off rest", "m", {"flown": off, "proved": np.full(len(off), bound)})
        for axis, off, bound in zip(axes, flown.T, position, strict=True)
    ]
    share = float((flown.max(axis=0) / position).max())
    nearest = ", and none goes farther along any axis than it starts" if (flown.max(axis=0) <= start).all() else ""
    caption = (
        f"Flown from the {corners.shape[1]} corners of the box of starts: the farthest of these flights from the loop's rest, "
        f"at each sample of the first {time[-1]:g} s, within what is proved for every start in the box and all later samples. "
        f"They reach up to {100.0 * share:.0f} % of the bound{nearest}."
    )
    return [FigureJob("set", caption, time, panels)]
