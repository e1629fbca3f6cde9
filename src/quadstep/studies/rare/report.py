"""report.html of an estimate, and its figure."""

from collections.abc import Sequence
from pathlib import Path

from quadstep.io.results.record import FIGURES, REPORT
from quadstep.report import page, units
from quadstep.report.sheet import Sheet
from quadstep.studies.campaign.schema import Campaign
from quadstep.studies.campaign.varied import text_of, told
from quadstep.studies.rare.done import Done
from quadstep.studies.rare.kept import Kept
from quadstep.studies.rare.picture import draw_levels
from quadstep.studies.rare.summary import Summary, rounded, sentences

LEVELS = "levels"

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


def write_report(kept: Kept, campaign: Campaign, summary: Summary, path: Path, sheet: Sheet) -> None:
    """Write report.html and its figure. Raises UserError for a full disk."""

    def write(out: Path) -> None:
        draw_levels(out / FIGURES / LEVELS, kept.pieces, sheet.with_svg())
        page.write_page(
            out / REPORT, campaign.file.name, sections(kept, campaign, summary, path, out / FIGURES), "Rare failures"
        )

    kept.report(write)


def sections(kept: Kept, campaign: Campaign, summary: Summary, path: Path, figures: Path) -> list[str]:
    """The body of the page."""
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
    answer, *more = sentences(summary, file.rare.method)
    value, low, high = (units.number(part) for part in summary.probability)
    facts = [
        page.Fact("probability of failure", value, f"95 %: {low} to {high}"),
        page.Fact("flights", f"{summary.flights:,}", "in all"),
    ]
    if summary.one_by_one:
        facts.append(page.Fact("plain Monte Carlo", rounded(summary.one_by_one), "flights for the same accuracy"))
    return [
        page.summary(answer, facts, [page.figure(figures / f"{LEVELS}.svg", SHOWN)]),
        *(page.paragraph(line) for line in more),
        *(page.paragraph(f"Warning: {line}") for line in summary.warnings),
        page.heading("Replicates", "replicates"),
        page.table(("", "method", "probability", "by failure and score", "flights"), replicate_rows(kept.pieces)),
        page.heading("The most likely failure found", "nearest"),
        *nearest(summary),
        page.heading("Settings", "flown"),
        page.table(("", ""), flown),
        page.table(("what varies", "how"), [(key, told(file, key)) for key in file.keys]),
        page.heading("How to read this", "reading"),
        *(page.paragraph(line) for line in READING),
    ]


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


def nearest(summary: Summary) -> list[str]:
    """The values of the keys in the failure nearest to the median."""
    if summary.nearest is None:
        return [page.paragraph("No failure was found.")]
    return [
        page.paragraph(f"{summary.nearest.deviations:.3g} standard deviations from the median of the distributions."),
        page.table(("key", "value", "deviations from the median"), nearest_rows(summary)),
    ]


def nearest_rows(summary: Summary) -> list[tuple[str, str, str]]:
    """Key, value, and deviations of its normal number; the farthest out first."""
    if summary.nearest is None:
        return []
    away = summary.nearest.deviations_by_key
    ordered = sorted(summary.nearest.values.items(), key=lambda item: -abs(away[item[0]]))
    return [(name, text_of(value), f"{away[name]:+.2f}") for name, value in ordered]
