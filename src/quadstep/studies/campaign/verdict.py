"""The verdict on a campaign, for machines."""

from pathlib import Path

from quadstep.engines.engine import Engine
from quadstep.io.exit_codes import UNMET
from quadstep.io.results.record import REPORT
from quadstep.io.version import __version__
from quadstep.metrics.judging.share import JudgedShare
from quadstep.metrics.judging.verdict import Case, Verdict
from quadstep.studies.campaign import until
from quadstep.studies.campaign.copies import alike
from quadstep.studies.campaign.replay import replay_command
from quadstep.studies.campaign.run import Finished
from quadstep.studies.campaign.summary import as_json


def verdict(done: Finished, file: Path, engine: Engine, least: float | None, decided: until.Decided | None = None) -> Verdict:
    """Judge a finished campaign. least: share of flights that must succeed, None if nothing is required. decided: what
    `--until` has shown, if it was given. Raises UserError where the flights do not differ but something is required of them.
    """
    summary, name = done.summary, done.campaign.file.name
    if summary.copies and (decided or least is not None):
        raise alike(file, "--until" if decided else "--require")
    judged = None if least is None else JudgedShare(least, summary.success, summary.flights)
    cases = (Case("flown"), *([judged.case] if judged else []), *([asked(decided)] if decided else []))
    measured = as_json(summary)
    worst = [{**one, "replay": replay_command(file, one["flight"], done.folder)} for one in measured["worst"]]
    content = {
        "version": __version__,
        "campaign": str(file),
        "name": name,
        "engine": engine.value,
        "folder": str(done.folder),
        "report": str(done.folder / REPORT),
        **measured,
        "worst": worst,
        "set_up_each[s]": max(done.campaign.singly.values(), default=None),
        "requirement": judged.as_json() if judged else None,
        **({"until": until.as_json(decided)} if decided else {}),
    }
    return Verdict("campaign", name, cases, content, UNMET if any(case.failure for case in cases) else 0)


def asked(decided: until.Decided) -> Case:
    """The case that `--until` was to show."""
    low, high = decided.seen[-1].rate[1:]
    name = f"fewer than {decided.target:g} of the flights fail, with 95 % confidence"
    return Case(name, None if decided.below else f"{name}: not shown; the probability is from {low:.3g} to {high:.3g}")
