"""`quadstep campaign --rare`: from file to folder, with its report and figure."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from quadstep.io import __version__
from quadstep.io.run_record import FIGURES
from quadstep.metrics.requirements import JudgedShare
from quadstep.metrics.statistics import Estimate
from quadstep.metrics.verdict import Case
from quadstep.mission.distributions import Choice
from quadstep.mission.fields import label, words
from quadstep.mission.schema import Mission
from quadstep.report import markup, units
from quadstep.report.canvas import figure_at
from quadstep.report.colours import COLOURS
from quadstep.report.evidence import Evidence, Figure, Section, TableSection
from quadstep.report.progress import Count
from quadstep.report.screen import command
from quadstep.report.sheet import COLUMN, PHONE, Sheet
from quadstep.studies.campaign.pictures import logarithmic
from quadstep.studies.campaign.run import CampaignRequest
from quadstep.studies.campaign.schema import Campaign, read_campaign
from quadstep.studies.campaign.varied import text_of, variation_text
from quadstep.studies.rare.point_flyer import PointFlyer, check_space
from quadstep.studies.rare.replicates import PieceKind, fly_piece, pieces
from quadstep.studies.rare.run_folder import FinishedPiece, Nearest, RareRecord, opened
from quadstep.studies.rare.summary import HOW, RareSummary, as_json, sentences, summarise

LEVELS = f"{FIGURES}/levels"

REPLICATES = ("", "method", "probability", "flights")

SHOWN = (
    "How the estimates were steered to failure: each line is one of them, from all flights (1, at the left) down to the share "
    "that fails, marked ×. A dot is a step: the share of flights at least as near to failure as those that it kept."
)
OPINIONS = " Dashed blue: second opinions, by the other method."
UNDRAWN = " Not drawn: second opinions by another score, which do not tell kinds of failure apart."


def write_report(record: RareRecord, campaign: Campaign, summary: RareSummary, path: Path, sheet: Sheet) -> Evidence:
    """Write report.html and its figure; what they say. Raises UserError for a full disk."""
    found = evidence(record, campaign, summary, path)

    def write(out: Path) -> None:
        if found.figures:
            draw_levels(out / LEVELS, record.pieces, sheet.with_svg())
        found.write_report(out)

    record.report(write)
    return found


def evidence(record: RareRecord, campaign: Campaign, summary: RareSummary, path: Path) -> Evidence:
    """The estimate for its readers. path: of the campaign."""
    file = campaign.file
    flown = [
        ("campaign", f"{file.name}, {path}"),
        ("mission", f"{campaign.content.get('name', 'Flight')}, {campaign.source}"),
        ("a flight fails", campaign.failing),
        ("method", f"{file.rare.method.words}, {file.rare.flights} flights per step"),
        ("seed, precision", f"{file.seed}, {file.precision}"),
        ("quadstep", record.manifest["version"]),
    ]
    said = sentences(summary, file.rare.method, campaign.meaning)
    kinds = climbed(record.pieces)
    rows = [(one.kind, one.method.value, units.number(one.probability), f"{one.flights:,}") for one in record.pieces]
    about = {"version": __version__, "campaign": str(path), "name": file.name, "method": file.rare.method.value}
    return Evidence(
        name=file.name,
        kind="Rare failures",
        answer=said[0],
        sentences=said,
        record={**about, **as_json(summary)},
        figures=[Figure(LEVELS, SHOWN + dashed(record.pieces, kinds))] if kinds else [],
        sections=[
            TableSection("Replicates", "replicates", REPLICATES, rows),
            *[part for one in summary.nearest for part in nearest(one, campaign.mission, path)],
            TableSection("Settings", "flown", ("", ""), flown),
            TableSection(
                header=("what varies", "key", "how"), rows=[(words(key), key, variation_text(file, key)) for key in file.keys]
            ),
        ],
        cases=(Case("estimated"),),
        more=said[1:],
        warnings=summary.warnings,
        grade={} if any(isinstance(one, Choice) for one in file.vary.values()) else summary.rest,  # else of other loops, too
        fold=("replicates", "flown"),
    )


SEE_IT = "To fly it, put these lines in place of [vary] and [[correlated]] into a copy of the campaign file, and fly that."


def nearest(found: Nearest, mission: Mission, path: Path) -> list[Section]:
    """The values of the keys in the failure nearest to the median, the farthest out first, and how to fly them."""
    how = HOW.get(found.failure, found.failure)
    title, name_of = f"The most likely flight that {how}", how.split()[0]
    away, where = found.deviations_by_key, f"{found.deviations:.2f} standard deviations from the median"
    ordered = sorted(found.values.items(), key=lambda item: -abs(away.get(item[0], 0.0)))
    told = {name: f"{round(one, 2) + 0.0:+.2f}".replace("-", "−") for name, one in away.items()}
    rows = [(label(mission, name), text_of(value, 4), told.get(name, "–")) for name, value in ordered]
    header, text = ("key", "value", "deviations from the median"), f"Its values are {where}."
    table = TableSection(title, f"nearest-{name_of}", header, rows, text, shown=f"{title}: {where}")
    if any(isinstance(value, dict) for value in found.values.values()):
        return [table]
    lines = [f'{name} = {{ type = "grid", values = [{json.dumps(value)}] }}' for name, value in found.values.items()]
    copy = path.with_name(f"{path.stem}-{name_of}.toml")
    flown = markup.verbatim("\n".join(["[vary]", *lines])) + markup.verbatim(command("fly", copy, "--flight", 0))
    return [table, TableSection(text=SEE_IT + " Its noise is then another, so that it may succeed." * mission.noisy), flown]


OWN, OTHER = "black", COLOURS["blue"]


def climbed(pieces: Sequence[FinishedPiece]) -> list[str]:
    """The kinds of failure that replicates found by steps, so that there is something to draw: not so common ones."""
    own = [event for one in pieces if one.kind == PieceKind.REPLICATE.value for event in one.events if event.probability > 0.0]
    return [*dict.fromkeys(event.failure for event in own if any(score is not None for score, _ in event.levels))]


def dashed(pieces: Sequence[FinishedPiece], kinds: Sequence[str]) -> str:
    """Which second opinions are drawn: those of any failure have no panel where each kind of failure has its own."""
    drawn = [any(event.failure in kinds for event in one.events) for one in pieces if one.kind != PieceKind.REPLICATE.value]
    return OPINIONS * any(drawn) + UNDRAWN * (False in drawn)


def draw_levels(path: Path, pieces: Sequence[FinishedPiece], sheet: Sheet) -> None:
    """A panel for each kind of failure: the share of flights left after each step, in replicates and second opinions."""
    names = climbed(pieces)
    columns = sheet.side_by_side(len(names), 2.4)
    rows, width = -(-len(names) // columns), COLUMN if columns > 1 else PHONE
    sides = 0.75 / width, 0.17 / rows, 0.97, 1.0 - 0.1 / rows, 0.26, 0.3
    with figure_at(path, sheet, (width, 3.0 * rows), *sides) as figure:
        figure.subplots(rows, columns, squeeze=False, sharey=True)
        for place, axes in enumerate(figure.axes):
            if place >= len(names):
                axes.set_axis_off()
                continue
            draw_event(axes, names[place], pieces)
            logarithmic(axes, "y")
            axes.set_title(f"flights that {HOW.get(names[place], names[place])}")
            axes.set_ylabel("share of flights")
            axes.tick_params(labelleft=True)


def draw_event(axes: Axes, name: str, pieces: Sequence[FinishedPiece]) -> None:
    """One panel: a line for each estimate over its steps, from all flights to a cross for those that fail."""
    for kind, event in ((one.kind, event) for one in pieces for event in one.events if event.failure == name):
        own = kind == PieceKind.REPLICATE.value
        colour, line = (OWN, "-") if own else (OTHER, "--")
        shares = [1.0, *(share for threshold, share in event.levels if threshold is not None and share > 0.0)]
        axes.plot(range(len(shares)), shares, line, marker=".", markersize=4, color=colour, linewidth=0.8)
        if event.probability > 0.0:
            axes.plot(
                range(len(shares) - 1, len(shares) + 1), [shares[-1], event.probability], line, color=colour, linewidth=0.8
            )
            axes.plot([len(shares)], [event.probability], "x", color=colour)
    axes.xaxis.set_major_locator(MaxNLocator(6, integer=True))
    axes.set_xlabel("step")


class RareResult(NamedTuple):
    summary: RareSummary
    evidence: Evidence

    def judged(self, least: float | None) -> Evidence:
        """With the verdict on the share of flights that must succeed; None if nothing is required.

        It is met if the lower end of the interval reaches it and there is no warning against the estimate.
        """
        if least is None:
            return self.evidence.required(None)
        value, low, high = self.summary.probability
        doubt = next(iter(self.summary.warnings), "")
        return self.evidence.required(JudgedShare(least, Estimate(1.0 - value, 1.0 - high, 1.0 - low), doubt=doubt))


def estimate(request: CampaignRequest) -> RareResult:
    """Estimate the probability that a flight of a campaign fails, and write rare.json and a report.

    Raises UserError, and InterruptedRun on Ctrl-C; in both cases finished replicates are kept.
    """
    campaign = read_campaign(request.path)
    check_space(campaign.file, request.path)
    flights = PointFlyer(campaign)
    with opened(request.folder, campaign, request.resume, request.overwrite) as kept:
        all_of = list(pieces(campaign))
        for piece in all_of[len(kept.pieces) :]:
            over = sum(one.flights for one in kept.pieces)
            count = Count(request.progress, done=over, note=f"{piece.place + 1} of {len(all_of)}")
            kept.add(fly_piece(flights, piece, count.add))
        summary = summarise(kept.pieces)._replace(rest=request.grading(campaign.mission))
        evidence = write_report(kept, campaign, summary, request.path, request.sheet)
        kept.save(complete=True, summary=as_json(summary))
    return RareResult(summary, evidence)
