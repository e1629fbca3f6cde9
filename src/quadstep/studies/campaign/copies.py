"""Campaigns whose flights are copies of one: they show nothing of other flights."""

from pathlib import Path

from quadstep.io.errors import UserError
from quadstep.mission.lagrange import LagrangeMission
from quadstep.mission.multirotor import MultirotorMission
from quadstep.studies.campaign.planner import planner
from quadstep.studies.campaign.schema import Campaign, read_campaign
from quadstep.world.air import DeclaredWind


def copies(campaign: Campaign) -> bool:
    """Whether the flights are known to be alike before they are flown: nothing varies, and nothing draws random numbers.

    Of plants, airs and functions of the user's own that shows only in flight.
    """
    if campaign.varies:
        return False
    mission = planner(campaign).mission({})
    if mission.noisy or mission.controller.controller.one_at_a_time:
        return False
    return isinstance(mission, LagrangeMission) or (
        isinstance(mission, MultirotorMission) and not isinstance(mission.wind.air, DeclaredWind)
    )


def refuse_copies(file: Path, option: str) -> None:
    """Raises UserError where an option asks of a campaign what copies of one flight cannot show."""
    if copies(read_campaign(file)):
        raise alike(file, option)


def alike(file: Path, option: str) -> UserError:
    """Why an option cannot be used with copies."""
    return UserError(
        f"{file}: {option}: its flights do not differ and show nothing of others; let something vary, or judge one with "
        "`quadstep fly --require`"
    )
