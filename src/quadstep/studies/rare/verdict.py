"""The verdict on an estimate, for machines."""

from pathlib import Path

from quadstep.io.exit_codes import UNMET
from quadstep.io.results.record import REPORT
from quadstep.io.version import __version__
from quadstep.metrics.judging.verdict import Case, Verdict
from quadstep.metrics.statistics import Estimate
from quadstep.studies.rare.run import Found
from quadstep.studies.rare.summary import as_json


def verdict(found: Found, file: Path, least: float | None) -> Verdict:
    """Judge an estimate. least: share of flights that must succeed; None if nothing is required.

    It is met if the lower end of the interval reaches it and there is no warning against the estimate.
    """
    summary, name = found.summary, found.campaign.file.name
    probability = summary.probability
    success = Estimate(*(1.0 - part for part in (probability.value, probability.high, probability.low)))
    met = least is None or (success.low >= least and not summary.warnings)
    cases = [Case("estimated")]
    if least is not None:
        failure = None
        if success.low < least:
            failure = f"success rate should be at least {least:.10g}, but is only shown to be above {success.low:.10g}"
        elif summary.warnings:
            failure = f"the estimate is not reliable: {summary.warnings[0]}"
        cases.append(Case(f"at least {least:.10g} of the flights succeed, with 95 % confidence", failure))
    content = {
        "version": __version__,
        "campaign": str(file),
        "name": name,
        "method": found.campaign.file.rare.method.value,
        "folder": str(found.folder),
        "report": str(found.folder / REPORT),
        **as_json(summary),
        "requirement": None if least is None else {"least": least, "measured": success.low, "met": met},
    }
    return Verdict("campaign --rare", name, tuple(cases), content, 0 if met else UNMET)
