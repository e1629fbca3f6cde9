"""What a finished campaign has found, for the terminal, `--json` and JUnit; what makes all its flights the same."""

from pathlib import Path

from quadstep.engines.engine import Engine
from quadstep.io.errors import UserError
from quadstep.io.version import __version__
from quadstep.metrics.judging.share import JudgedShare
from quadstep.metrics.judging.verdict import Case
from quadstep.mission.lagrange import LagrangeMission
from quadstep.mission.multirotor import MultirotorMission
from quadstep.report.evidence import Evidence, Table
from quadstep.studies.campaign import until
from quadstep.studies.campaign.planner import planner
from quadstep.studies.campaign.replay import replay_command
from quadstep.studies.campaign.run import Finished
from quadstep.studies.campaign.schema import Campaign, read_campaign
from quadstep.studies.campaign.summary import as_json, sentences
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


WORST = ("flight", "outcome", "ended [s]", "RMSE [m]", "largest error [m]")


def evidence(
    done: Finished, file: Path, engine: Engine, least: float | None, decided: until.Decided | None = None
) -> Evidence:
    """Judge a finished campaign. least: share of flights that must succeed, None if nothing is required. decided: what
    `--until` has shown, if it was given. Raises UserError where the flights do not differ but something is required of them.
    """
    summary, name, measured = done.summary, done.campaign.file.name, as_json(done.summary)
    if summary.copies and (decided or least is not None):
        raise alike(file, "--until" if decided else "--require")
    again = [replay_command(file, one.flight, done.folder) for one in summary.worst]
    record = {
        "version": __version__,
        "campaign": str(file),
        "name": name,
        "engine": engine.value,
        **measured,
        "worst": [{**one, "replay": line} for one, line in zip(measured["worst"], again, strict=True)],
        "set_up_each[s]": max(done.campaign.singly.values(), default=None),
        **({"until": until.as_json(decided)} if decided else {}),
    }
    rows = [
        (str(one.flight), one.outcome, *("-" if x is None else f"{x:.4g}" for x in (one.time, one.rmse, one.largest)))
        for one in summary.worst
    ]
    found = sentences(summary)
    return Evidence(
        name=name,
        kind="Campaign",
        answer=found[0],
        sentences=[*(until.sentences(decided, file) if decided else ()), *found],
        record=record,
        sections=[Table(header=WORST, rows=rows, shown="The worst flights")],
        cases=(Case("flown"), *([until_case(decided)] if decided else [])),
        commands=["To replay each of them, with its full log:", *(f"  {line}" for line in again)],
    ).required(None if least is None else JudgedShare(least, summary.success, summary.flights))


def until_case(decided: until.Decided) -> Case:
    """The case that `--until` was to show."""
    low, high = decided.seen[-1].rate[1:]
    name = f"fewer than {decided.target:g} of the flights fail, with 95 % confidence"
    return Case(name, None if decided.below else f"{name}: not shown; the probability is from {low:.3g} to {high:.3g}")
