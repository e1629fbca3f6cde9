"""report.html of an estimate, and its figure."""

from collections.abc import Sequence
from pathlib import Path

from quadstep.io.results.record import FIGURES
from quadstep.io.version import __version__
from quadstep.metrics.judging.verdict import Case
from quadstep.report import page, units
from quadstep.report.evidence import Evidence, Figure, Table
from quadstep.report.sheet import Sheet
from quadstep.studies.campaign.schema import Campaign
from quadstep.studies.campaign.varied import text_of, told
from quadstep.studies.rare.done import Done
from quadstep.studies.rare.kept import Kept
from quadstep.studies.rare.picture import draw_levels
from quadstep.studies.rare.summary import Summary, as_json, rounded, sentences

LEVELS = f"{FIGURES}/levels"

REPLICATES = ("", "method", "probability", "by failure and score", "flights")

SHOWN = (
    "The probability of reaching each score, level by level; at the right, ×, that of failing. Black and red: the replicates; "
    "blue: other methods and scores."
)

READING = (
    "A replicate steers flights towards failure in steps: each keeps the flights with the highest scores and flies more like "
    "them. Cross-entropy fits a mixture of normal distributions to the failures, draws new flights from it and weights each "
    "by its likelihood under the campaign; subset simulation multiplies the shares kept at each step. All replicates repeat "
    "this with different random numbers, and the interval comes from their scatter.",
    "The interval assumes log-normal replicates (Cox's interval for the mean, Student's quantile). It does not account for a "
    "failure mode that no replicate found: that is what the plain Monte Carlo flights and second opinions are for. Nor "
    "does it say whether the keys are distributed as in the campaign, and a small probability depends on the tails.",
    "Noise is redrawn: in subset simulation half of the candidates get new noise and the others keep their "
    "predecessor's; with cross-entropy every flight has its own. Unlike the keys, it is not steered towards failure.",
)


def write_report(kept: Kept, campaign: Campaign, summary: Summary, path: Path, sheet: Sheet) -> Evidence:
    """Write report.html and its figure; what they say. Raises UserError for a full disk."""
    found = evidence(kept, campaign, summary, path)

    def write(out: Path) -> None:
        draw_levels(out / LEVELS, kept.pieces, sheet.with_svg())
        found.write_report(out)

    kept.report(write)
    return found


def evidence(kept: Kept, campaign: Campaign, summary: Summary, path: Path) -> Evidence:
    """The estimate for its readers. path: of the campaign."""
    file = campaign.file
    limits = " or ".join(f"{campaign.thresholds[name]} above {limit:g}" for name, limit in file.failure.items())
    flown = [
        ("campaign", f"{file.name}, {path}"),
        ("mission", f"{campaign.content.get('name', 'Flight')}, {campaign.source}"),
        ("a flight fails", f"if it ends early{f', or {limits}' if limits else ''}"),
        ("method", f"{file.rare.method.words}, {file.rare.flights} flights per level"),
        ("seed, precision", f"{file.seed}, {file.precision}"),
        ("quadstep", kept.manifest["version"]),
    ]
    said = sentences(summary, file.rare.method)
    value, low, high = (units.number(part) for part in summary.probability)
    facts = [
        page.Fact("probability of failure", value, f"95 %: {low} to {high}"),
        page.Fact("flights", f"{summary.flights:,}", "in all"),
    ]
    if summary.one_by_one:
        facts.append(page.Fact("plain Monte Carlo", rounded(summary.one_by_one), "flights for the same accuracy"))
    about = {"version": __version__, "campaign": str(path), "name": file.name, "method": file.rare.method.value}
    return Evidence(
        name=file.name,
        kind="Rare failures",
        answer=said[0],
        sentences=said,
        record={**about, **as_json(summary)},
        facts=facts,
        figures=[Figure(LEVELS, SHOWN)],
        tables=[
            Table("Replicates", "replicates", REPLICATES, replicate_rows(kept.pieces)),
            nearest(summary),
            Table("Settings", "flown", ("", ""), flown),
            Table(header=("what varies", "how"), rows=[(key, told(file, key)) for key in file.keys]),
            Table("How to read this", "reading", text=READING[0]),
            *(Table(text=line) for line in READING[1:]),
        ],
        cases=(Case("estimated"),),
        more=said[1:],
        warnings=summary.warnings,
        grade=summary.rest,
    )


def replicate_rows(pieces: Sequence[Done]) -> list[tuple[str, ...]]:
    """One row per piece."""
    return [
        (
            one.kind,
            one.method.value,
            f"{one.probability:.3g}",
            "; ".join(f"{event.failure}: {event.probability:.3g}, {', '.join(event.score)}" for event in one.events),
            f"{one.flights:,}",
        )
        for one in pieces
    ]


def nearest(summary: Summary) -> Table:
    """The values of the keys in the failure nearest to the median, the farthest out first."""
    title, found = "The most likely failure found", summary.nearest
    if found is None:
        return Table(title, "nearest", text="No failure was found.")
    away, where = found.deviations_by_key, f"{found.deviations:.3g} standard deviations from the median"
    ordered = sorted(found.values.items(), key=lambda item: -abs(away[item[0]]))
    rows = [(name, text_of(value), f"{away[name]:+.2f}") for name, value in ordered]
    header, text = ("key", "value", "deviations from the median"), f"{where} of the distributions."
    return Table(title, "nearest", header, rows, text, shown=f"{title}, {where}")
