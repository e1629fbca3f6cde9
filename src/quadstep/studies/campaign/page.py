"""Pages on which the browser flies many flights, as a campaign does, and counts failures anew whenever a slider moves: a
campaign's page, and that of what-if.
"""

import base64
from collections.abc import Mapping
from pathlib import Path
from urllib.parse import quote

import numpy as np

from quadstep.engines.engine import Engine
from quadstep.engines.fly import fly
from quadstep.engines.scored import LARGEST, RMSE, names_without_units
from quadstep.engines.sweep import number_names
from quadstep.engines.sweep_trace import OUTCOME
from quadstep.engines.wasm import sweep_module
from quadstep.interfaces.controller import Controller
from quadstep.io.errors import UserError
from quadstep.metrics.verdict import Rule
from quadstep.mission.distributions import Normal
from quadstep.mission.fields import label, unit, words
from quadstep.mission.read import plan_mission
from quadstep.mission.schema import Grading, ungraded
from quadstep.numbers import Table, flatten
from quadstep.page.build import build_page, flown_mission
from quadstep.page.flights import ShownFlight
from quadstep.page.model import Link, Rate, numbers_text
from quadstep.report import units
from quadstep.report.evidence import Evidence
from quadstep.studies.campaign.draws import draw
from quadstep.studies.campaign.planner import PlannedBatch, planner
from quadstep.studies.campaign.schema import Campaign, campaign_of, read_campaign
from quadstep.studies.campaign.varied import variation_text
from quadstep.studies.tuning.ground import TuningRequest

MOST_FLIGHTS = 1000
"""Flights that the page flies for each setting: the first of the campaign."""

COUNTED = names_without_units((RMSE, LARGEST))
"""Metrics by which the page can tell a failure."""


def campaign_page(path: Path, engine: Engine = Engine.LANES, grading: Grading = ungraded) -> str:
    """The page of a campaign file. Raises UserError naming what of it a page cannot fly."""
    campaign = read_campaign(path)
    return build_page(campaign.file.name or campaign.mission.name, (), [shown_campaign(campaign, str(path), engine, grading)])


def shown_campaign(campaign: Campaign, source: str, engine: Engine = Engine.LANES, grading: Grading = ungraded) -> ShownFlight:
    """Its mission as a flight of a page, with the failure rate of its flights. source: for errors. Raises UserError."""
    found = rate(campaign, source)
    mission = campaign.mission
    plan = plan_mission(mission, campaign.folder / Path(campaign.source).name)
    log = fly(plan, engine)
    shown = flown_mission(mission, plan, log, campaign.folder, measured=mission.flight_metrics(log, grading))
    return judged(shown, campaign)._replace(rate=found)


def judged(shown: ShownFlight, campaign: Campaign) -> ShownFlight:
    """The same on a page that knows above which limits it fails, as `flyer.judged` does."""
    limits = tuple(limit(campaign.thresholds[name], most) for name, most in campaign.file.failure.items())
    return shown._replace(limits=limits)


def limit(metric: str, most: float) -> Rule:
    """Above which a flight fails, or that the page does not measure it."""
    name, unit = units.metric(metric)
    allowed = units.quantity(most, unit)
    if metric not in (RMSE, LARGEST):
        return Rule(metric, most, "", f"this page does not measure its {name} (limit {allowed})", measured=False)
    unit, factor = units.handy(unit, most)
    return Rule(metric, most, f"{name} {{}} {unit}, limit {allowed}", f"its {name} is {{}} {unit} (limit {allowed})", factor)


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
    names = number_names(batch.start, batch.parameters)
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
        keys=tuple(varied_text(campaign, key) for key in campaign.file.keys),
        random=tuple(campaign.mission.random),
    )  # fmt: skip


def varied_text(campaign: Campaign, key: str) -> str:
    """A key in words and how it varies, as in "mean wind along x, 6 ± 2 m/s (normal)"."""
    one = campaign.file.vary.get(key)
    if isinstance(one, Normal) and one.low is None and one.high is None:
        return f"{words(key)}, {one.mean:g} ± {one.deviation:g} {unit(campaign.mission, key)} (normal)".replace("  ", " ")
    return f"{label(campaign.mission, key)}: {variation_text(campaign.file, key)}"


ENDS = (
    "The marks on the sliders are the values before. The page does not compute margins or the step: the report has them for "
    "the values before and after."
)


def what_if_page(
    gusts: TuningRequest, seed: int, law: type[Controller], changes: Mapping[str, float], evidence: Evidence
) -> str:
    """The HTML. gusts, seed: the flights in gusts, with the values before. changes: of the parameters. Raises UserError."""
    content = {key: value for key, value in gusts.content.items() if key != "tune"}
    file = gusts.campaign(gusts.section.vary, seed=seed, flights=min(gusts.unseen, MOST_FLIGHTS))
    campaign = campaign_of(file, "", content, str(gusts.path), gusts.path.parent)
    shown = shown_campaign(campaign, str(gusts.path))
    after = [f"set={quote(f'{law.name}.{name}', safe='')}:{value!r}" for name, value in changes.items()]
    flight = f"#flight={quote(shown.id, safe='')}"
    links = [Link("before", flight), Link("after", "&".join([flight, *after])), Link("report", "report.html")]
    return build_page(evidence.name, [f"{evidence.answer} {ENDS}"], [shown._replace(moved=changes)], links=links)
