"""The page of a campaign: its mission and the failure rate of its flights, flown in the browser as the campaign flies them."""

import base64
from pathlib import Path

import numpy as np

from quadstep.engines.engine import Engine
from quadstep.engines.fly import fly
from quadstep.engines.scored import LARGEST, RMSE, bare
from quadstep.engines.sweep import given_names, sweep_module
from quadstep.engines.sweep_trace import OUTCOME
from quadstep.io.errors import UserError
from quadstep.mission.read import plan_mission
from quadstep.mission.schema import Grading, ungraded
from quadstep.numbers import Table, flatten
from quadstep.page.build import build_page, flown_mission
from quadstep.page.flights import ShownFlight
from quadstep.page.model import Rate, numbers_text
from quadstep.studies.campaign.draws import draw
from quadstep.studies.campaign.planner import PlannedBatch, planner
from quadstep.studies.campaign.schema import Campaign, read_campaign

MOST_FLIGHTS = 1000
"""Flights that the page flies for each setting: the first of the campaign."""

COUNTED = bare((RMSE, LARGEST))
"""Metrics by which the page can tell a failure."""


def campaign_page(path: Path, engine: Engine = Engine.LANES, grading: Grading = ungraded) -> str:
    """The page of a campaign file. Raises UserError naming what of it a page cannot fly."""
    campaign = read_campaign(path)
    return build_page(campaign.file.name or campaign.mission.name, "", [shown_campaign(campaign, str(path), engine, grading)])


def shown_campaign(campaign: Campaign, source: str, engine: Engine = Engine.LANES, grading: Grading = ungraded) -> ShownFlight:
    """Its mission as a flight of a page, with the failure rate of its flights. source: for errors. Raises UserError."""
    found = rate(campaign, source)
    mission = campaign.mission
    plan = plan_mission(mission, campaign.folder / Path(campaign.source).name)
    log = fly(plan, engine)
    shown = flown_mission(mission, plan, log, campaign.folder, measured=mission.flight_metrics(log, grading))
    return shown._replace(rate=found)


def rate(campaign: Campaign, source: str) -> Rate:
    """What the page needs to fly the campaign's flights. Raises UserError."""
    unknown = [name for name in campaign.file.failure if name not in COUNTED]
    if unknown:
        raise UserError(f"{source}: failure.{unknown[0]}: a page counts failures by {' and '.join(COUNTED)} only")
    flights = np.arange(min(campaign.flights, MOST_FLIGHTS))
    batches = list(planner(campaign).batches(flights, draw(campaign.file, flights)))
    if len(batches) > 1 or batches[0].loop.loop.controller.one_at_a_time:
        raise UserError(
            f"{source}: a page flies only flights that differ in numbers alone; vary no choice of another structure"
        )
    (batch,) = batches
    return of_batch(batch, campaign)


def of_batch(batch: PlannedBatch, campaign: Campaign) -> Rate:
    leaves = flatten((batch.start, batch.parameters))
    names = given_names(batch.start, batch.parameters)
    order = np.argsort(batch.places)
    varies = sorted(batch.places)
    module = sweep_module(batch.loop, batch.start, batch.parameters, frozenset(varies), campaign.double)
    return Rate(
        module=base64.b64encode(module).decode("ascii"),
        double=campaign.double,
        flights=len(batch.rows),
        constants=tuple(
            name for place, (name, leaf) in enumerate(zip(names, leaves, strict=True))
            if place not in varies and not isinstance(leaf, Table)
        ),
        varies=tuple(names[place] for place in varies),
        rows=numbers_text(batch.rows[:, order].T),
        every=batch.ticks.every,
        results=OUTCOME + len(flatten(batch.loop.start(batch.start, batch.parameters).score)),
        failure={name: float(most) for name, most in campaign.file.failure.items()},
        keys=tuple(campaign.file.keys),
    )  # fmt: skip
