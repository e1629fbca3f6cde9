"""Single flights of a campaign, flown again with their full logs."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from quadstep.engines.fly import FlightPlan
from quadstep.io.documents import read_toml
from quadstep.io.doors import needed_by
from quadstep.io.errors import UserError
from quadstep.io.run_record import read_manifest
from quadstep.mission.read import MISSION, look
from quadstep.mission.schema import Mission
from quadstep.report.screen import command
from quadstep.studies.campaign import MOST_FLIGHTS
from quadstep.studies.campaign.draws import draw
from quadstep.studies.campaign.manifest import MANIFEST, CampaignManifest, differences, other_draws
from quadstep.studies.campaign.planner import planner
from quadstep.studies.campaign.schema import Campaign, read_campaign


class Replay(NamedTuple):
    """A flight. values: as drawn, by key. mission: with these values. plan: of the flight, with its own noise."""

    values: dict[str, object]
    mission: Mission
    plan: FlightPlan


def replay(campaign: Campaign, flight: int) -> Replay:
    drawn = draw(campaign.file, np.arange(flight, flight + 1))
    values = {name: column.at(0) for name, column in drawn.items()}
    builder = planner(campaign)
    mission = builder.mission(values, flight)
    named = mission.model_copy(update={"name": f"{mission.name}, flight {flight}"})
    return Replay(values, named, builder.plan(values, flight))


def replay_of(path: Path, flight: int, results: Path | None = None) -> tuple[Campaign, Replay]:
    """A campaign file and one of its flights. results: the campaign's folder, if not the default. Raises UserError."""
    if look(read_toml(path)) == MISSION:
        raise UserError(f"--flight: needs a campaign, and {path} looks like a mission")
    campaign = read_campaign(path)
    flights, warning = check_replay(campaign, results or Path("out") / path.stem, results is not None)
    if not 0 <= flight < flights:
        raise UserError(f"--flight: should be from 0 to {flights - 1}, the last flight of {path}, not {flight}")
    with needed_by("`quadstep fly --flight`"):
        found = replay(campaign, flight)
    plan = found.plan
    return campaign, found._replace(plan=plan._replace(warnings=(*plan.warnings, warning)) if warning else plan)


def check_replay(campaign: Campaign, folder: Path, named: bool) -> tuple[int, str]:
    """How many flights a campaign may have, and a warning where one might differ from that in `folder`.

    named: whether the user has named the folder, so that the campaign must be there. Raises UserError, also for draws of
    another version.
    """
    try:
        found = read_manifest(folder / MANIFEST, CampaignManifest)
    except UserError:
        if named:
            raise
        found = None
    if named and found is None:
        raise UserError(f"--results: {folder}: there is no campaign here")
    same = found if found is not None and found.get("campaign") == campaign.text else {}
    other = other_draws(same) if same else ""
    if other:
        raise UserError(
            f"{folder}: cannot be replayed: {other}; replay it with that version, or fly the campaign again with --overwrite"
        )
    others = differences(same, campaign) if same else []
    warning = f"this flight may differ from that in {folder}, since {others[0]}" if others else ""
    bounded = campaign.file.flights or campaign.file.combinations > 1  # else the command line says how many
    return max(campaign.flights if bounded else MOST_FLIGHTS, found["flights"] if found else 0), warning


def replay_command(file: Path, flight: int, folder: Path) -> str:
    """The command that flies one flight of the campaign in `folder` again."""
    elsewhere = [] if folder == Path("out") / file.stem else ["--results", folder]
    return command("fly", file, "--flight", flight, *elsewhere)
