"""What a finished campaign has found, for the terminal, `--json` and JUnit."""

from pathlib import Path

from quadstep.engines.engine import Engine
from quadstep.io import __version__
from quadstep.io.errors import UserError
from quadstep.metrics.registry import SOUND
from quadstep.metrics.requirements import JudgedShare
from quadstep.metrics.verdict import Case
from quadstep.report import units
from quadstep.report.evidence import Evidence, TableSection
from quadstep.studies.campaign import run
from quadstep.studies.campaign.planner import is_random
from quadstep.studies.campaign.report_text import ENDING, ending, outcome_of
from quadstep.studies.campaign.run import FinishedCampaign
from quadstep.studies.campaign.schema import read_campaign
from quadstep.studies.campaign.single_flight import replay_command
from quadstep.studies.campaign.summary import as_json, sentences, within


def refuse_certain(file: Path, option: str, flights: int | None) -> None:
    """Raises UserError where an option asks of a campaign what its flights cannot show: nothing of them is drawn at random, or
    they fly some points of a grid more often than others. flights: instead of the file's.
    """
    campaign = read_campaign(file)
    count, grid = flights or campaign.flights, campaign.file.combinations
    if not is_random(campaign):
        raise nothing_shown(file, option, campaign.varies)
    if count % grid:
        uneven = f"{count} flights cannot cover the {grid} points of its grid equally often"
        raise UserError(f"{file}: {option}: {uneven}; --flights {grid * -(-count // grid)} can")


def nothing_shown(file: Path, option: str, grid: bool) -> UserError:
    """Why an option cannot be used. grid: whether the flights are points of one, else copies."""
    what = "are points of a grid, without noise," if grid else "do not differ"
    more = "let keys vary at random (docs/campaigns.md)" if grid else "let something vary"
    return UserError(
        f"{file}: {option}: its flights {what} and say nothing about others; {more}, or judge one: `fly --require`"
    )


def evidence(
    done: FinishedCampaign, file: Path, engine: Engine, least: float | None, decided: run.DecidedRun | None = None
) -> Evidence:
    """Judge a finished campaign. least: share of flights that must succeed, None if nothing is required. decided: what
    `--until` has shown, if it was given. Raises UserError where nothing is statistical but something is required.
    """
    summary, name, measured = done.summary, done.campaign.file.name, as_json(done.summary)
    if summary.flights > 1 and not summary.statistical and (decided or least is not None):
        raise nothing_shown(file, "--until" if decided else "--require", bool(done.campaign.varies) and not summary.copies)
    again = [replay_command(file, one.flight, done.folder) for one in summary.worst]
    record = {
        "version": __version__,
        "campaign": str(file),
        "name": name,
        "engine": engine.value,
        **measured,
        "worst": [{**one, "replay": line} for one, line in zip(measured["worst"], again, strict=True)],
        "set_up_each[s]": max(done.campaign.singly.values(), default=None),
        **({"until": run.decided_as_json(decided)} if decided else {}),
    }
    rows = [(str(one.flight), *ending(one, outcome_of(one, summary))) for one in summary.worst]
    found = sentences(summary)
    if summary.by and least is not None:
        did = "succeeded" if summary.limited else "reached the end"
        of_all = f"Of all {summary.flights:,} flights, which --require judges, {units.percent(summary.success.value)} {did}"
        found.insert(1, f"{of_all} (95 % interval {within(*summary.success[1:])}).".replace("\N{NO-BREAK SPACE}", " "))
    return Evidence(
        name=name,
        kind="Campaign",
        answer=found[0],
        sentences=[found[0], *(run.following(decided, file) if decided else ()), *found[1:]],
        record=record,
        sections=[TableSection(header=("flight", *ENDING), rows=rows, shown="The worst flights")],
        cases=(Case("flown"), *([until_case(decided)] if decided else [])),
        grade=summary.rest,
        told=summary.rest.get("grade") == SOUND,
        commands=[f"To replay one, here the first: {again[0]}"],
    ).required(None if least is None else JudgedShare(least, summary.success, summary.flights))


def until_case(decided: run.DecidedRun) -> Case:
    low, high = decided.seen[-1].rate[1:]
    name = f"fewer than {decided.target:g} of the flights fail{decided.done.summary.meaning}, with 95 % confidence"
    shown = "shown not to be so" if decided.above else "not shown"
    return Case(name, None if decided.below else f"{name}: {shown}; the probability is from {low:.3g} to {high:.3g}")
