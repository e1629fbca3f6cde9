"""What a proof shows: flights beside what is proved of them, as figures with captions."""

from __future__ import annotations

from itertools import product

import numpy as np

from quadstep.numbers import flatten, rebuild
from quadstep.proofs.prove.hold import Departure, Hold
from quadstep.proofs.prove.report import length
from quadstep.proofs.prove.sampled import Array, SampledLoop
from quadstep.report import units
from quadstep.report.drawing import FigureJob
from quadstep.report.panel import LOG, Panel

MOST = 150
"""Samples that are flown for a figure of a set."""


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
    return [FigureJob("tube", caption, time, panels, len(panels))]


def of_flight(t: Array, errors: Array, limit: float) -> list[FigureJob]:
    """How far the mission's own flight was from its path. errors: (samples, axes) [m]. limit: that ends it [m]."""
    far = np.linalg.norm(errors, axis=1)
    lines = {"the mission's flight": far, f"limit, {limit:g} m": np.full(len(t), limit)}
    last, at = units.quantity(float(far[-1]), "m", 4), units.quantity(float(t[-1]), "s")
    caption = (
        f"Distance of the mission's own flight from its path: {last} at its end, {at}. A flight that goes beyond the limit is "
        "lost. On this logarithmic scale, an error that doubles again and again rises along a straight line."
    )
    return [FigureJob("flight", caption, t, [Panel("distance", "m", lines, LOG)])]


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
    return [FigureJob("set", caption, time, panels, len(panels))]


def of_departure(loop: SampledLoop, leaves: Departure) -> list[FigureJob]:
    """The flight from the state that is proved to leave the box."""
    flown = loop.flown_from([*leaves.start[:, None]], 1, round(leaves.seconds / loop.period))[:, :, 0]
    moving = leaves.reach > 0.0
    off = np.abs(flown - leaves.rest)[:, moving] / leaves.reach[moving]
    share: Array = off.max(axis=1)
    time: Array = np.arange(len(flown), dtype=np.float64) * loop.period
    out = int(np.argmax(share > 1.0))
    caption = (
        "The flight from the state in the table, by the number that has used most of its half of the box. It crosses the edge "
        f"of the box after {time[out]:.3g} s; that it does within {leaves.seconds:.3g} s is proved."
    )
    lines = {"flown": share, "edge of the box": np.ones(len(flown))}
    return [FigureJob("departure", caption, time, [Panel("share of the box", "-", lines, LOG)])]
