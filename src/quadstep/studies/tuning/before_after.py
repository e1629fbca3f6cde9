"""One flight with the current gains laid under the same flight with the tuned ones."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from quadstep.engines.fly import fly_all
from quadstep.interfaces.closed_loop import Outcome
from quadstep.metrics.quantities import position_axes
from quadstep.report.drawing import FigureJob
from quadstep.report.panels import grade_of, track_of
from quadstep.report.units import quantity
from quadstep.studies.tuning.ground import UNSEEN, CandidateFlyer
from quadstep.studies.tuning.objective import CandidateFlights

PICTURE, RMSE = "before_after", "a position RMSE of "


def typical(present: CandidateFlights, tuned: CandidateFlights) -> int:
    """The place of the flight whose error is the median with the current gains, of those completed with both; of all where
    none is.
    """
    both = np.flatnonzero(present.completed & tuned.completed)
    both = both if len(both) else np.arange(len(present.ended))
    return int(both[np.argsort(present.metric("position_rmse")[both], kind="stable")[(len(both) - 1) // 2]])


def picture(
    ground: CandidateFlyer, gains: Sequence[Mapping[str, float]], flown: Sequence[CandidateFlights]
) -> tuple[FigureJob, tuple[str, ...]] | None:
    """Of the present and the tuned gains, and what the flight lacks with these; None for a plant without a path in space."""
    place = typical(*flown)
    drawn = ground.draws(UNSEEN + place).at(0)
    planner, varied = ground.flyer.planner, [{**drawn, **values} for values in gains]
    plans = [planner.plan(values, UNSEEN + place) for values in varied]
    before, after = fly_all(plans)
    if not position_axes(after) or min(len(before.rows), len(after.rows)) < 2:
        return None
    begin, many = ground.asked.mission.scored_from, len(flown[0].ended) > 1
    which = "Of the unseen flights, the one with the median error with the current gains" if many else "The one flight"
    shaded = f" Shaded: before {begin:g} s, where errors do not count." * (begin > 0.0)
    first, last = (
        f"lost at {one.ended:.4g} s"
        if one.outcome is not Outcome.COMPLETED
        else f"{RMSE}{quantity(float(each.metric('position_rmse')[place]), 'm')}"
        for one, each in zip((before, after), flown, strict=True)
    )
    last = last.removeprefix(RMSE) if first.startswith(RMSE) else last
    track = replace(track_of(after, begin), before=track_of(before, begin))
    longer = max((before, after), key=lambda one: len(one.rows)).column("t")
    told = f"{which}: {first} with them, {last} with the tuned ones.{shaded}"
    lacking = grade_of(after, planner.mission(varied[-1]).flight_metrics(after)[0]).labels
    return FigureJob(PICTURE, told, longer, [], track=track), lacking
