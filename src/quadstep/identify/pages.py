"""The pages of `replay` and `identify` with their figures, apart from the words because only they load Matplotlib."""

import math
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib import rcParams
from matplotlib.axes import Axes

from quadstep.identify.filtered_logs import Deviation, Estimated
from quadstep.identify.fit import Identified
from quadstep.identify.flown_setpoints import FlightComparison
from quadstep.identify.logs.flight import FlightRecord, Floats
from quadstep.identify.replay import ErrorTable, Replayed, ReplayRequest, ready
from quadstep.identify.replay_report import ESTIMATED, FACTOR, PREDICTED, identity, suited_unit, write_tables
from quadstep.identify.residual import Followed, followed
from quadstep.identify.run import Identification
from quadstep.identify.starts import GROUPS, HORIZONS
from quadstep.identify.uses import ENOUGH, NAMES, in_short, reach, within
from quadstep.io.files import write_beside
from quadstep.io.run_record import FIGURES
from quadstep.report import markup
from quadstep.report.axes import logarithmic, plain_decades
from quadstep.report.canvas import LINES, figure_at
from quadstep.report.colours import CURVES
from quadstep.report.drawing import FigureJob
from quadstep.report.evidence import Evidence, Figure
from quadstep.report.panel import SETPOINT, Panel
from quadstep.report.publish import publishing
from quadstep.report.sheet import COLUMN, Sheet
from quadstep.report.told import ToldPlace, tell
from quadstep.report.units import number, quantity

ERRORS = f"{FIGURES}/errors"
AGAINST_GUESSES = (
    "Mean prediction error against the time ahead, and that of two baselines without a model: velocity and rates stay "
    "constant, or the rates are zero. The model helps where its line is below both."
)

INTERVALS, REACH = f"{FIGURES}/intervals", 60.0
"""Of every parameter, up to so many per cent of its value."""

OF_INTERVALS = "The shorter the bar, the better the flights determine the parameter, with mass, k_f and J_z as given."
UNKNOWN = " Orange: not known to within 50 %."

AHEAD = 10
"""Samples ahead of which the figures of an identification's flights speak."""

SHOWN = 8.0
"""Longest part of a flight that is drawn [s]."""

SVG = Sheet(formats=("svg",))

AXES = ("roll", "pitch", "yaw")


def write_replay(
    folder: Path, flights: Sequence[FlightRecord], request: ReplayRequest, result: Replayed, evidence: Evidence,
    overwrite: bool, sheet: Sheet,
) -> None:  # fmt: skip
    """Write every file of the folder. evidence: what was found. Raises UserError."""
    with publishing(folder, identity(flights, request), overwrite) as out:
        (out / FIGURES).mkdir()
        write_tables(out, result)
        illustrated(evidence, result, out, sheet.with_svg(), least_predicted(flights, request, result)).write(out)


def least_predicted(flights: Sequence[FlightRecord], request: ReplayRequest, result: Replayed) -> list[FigureJob]:
    """The flight whose position is predicted worst, over time."""
    errors = result.predictions[0].compared
    name = worst_position(errors)
    numbers, guided = ready(flights, request.section, request.commands_only)
    one = followed(next(flight for flight in flights if flight.name == name), request.section, numbers, guided)
    kind = f"of {len(errors.names)} flights, the one whose position is predicted worst" * (len(errors.names) > 1)
    return [prediction_picture(one, 0, kind, errors.knows)] if one else []


def worst_position(errors: ErrorTable) -> str:
    """The flight whose position is predicted worst half a second ahead."""
    return errors.names[int(errors.predicted[errors.horizons.index(HORIZONS[-1]), 0].argmax())]


def illustrated(evidence: Evidence, result: Replayed, out: Path, sheet: Sheet, least: Sequence[FigureJob]) -> Evidence:
    """The same with its figures, which are drawn into a folder: errors and `least_predicted` at the top, a flight of the
    others with its table, the rest below.
    """
    groups = sheet.chosen(("errors", one, one) for one in GROUPS)
    top = [figure_of(out, job, sheet) for job in with_signals("predicted", least, sheet)]
    if groups:
        draw_errors(out / ERRORS, result.predictions[0].compared, result.period, sheet, groups)
        top = [Figure(ERRORS, AGAINST_GUESSES), *top]
    again = with_signals("again", [flight_picture(one, place) for place, one in enumerate(result.flown)], sheet)
    estimates = with_signals("estimate", [estimate_picture(one, place) for place, one in enumerate(result.estimates)], sheet)
    flown, estimated = ([figure_of(out, job, sheet) for job in jobs] for jobs in (again, estimates))
    rest = [*flown[1:], *estimated[1:]]
    several = "s" * (max(len(flown), len(estimated)) > 2)
    more = [markup.heading(f"The other flight{several}", "others")] if rest else []
    if not top:
        return evidence._replace(figures=[*flown[:1], *estimated[:1]], sections=[*evidence.sections, *more, *rest])
    beside = {"simulated": flown[:1], "estimates": estimated[:1]}
    told = with_figures(evidence, beside)
    return told._replace(figures=top, sections=[*told.sections, *more, *rest])


def with_signals(kind: str, jobs: Sequence[FigureJob], sheet: Sheet) -> list[FigureJob]:
    """Figures of one kind with the sheet's signals; those without any are left out."""
    chosen = [job._replace(panels=sheet.chosen((kind, panel.label, panel) for panel in job.panels)) for job in jobs]
    return [job for job in chosen if job.panels]


def draw_errors(path: Path, errors: ErrorTable, period: float, sheet: Sheet, groups: Sequence[str] = GROUPS) -> None:
    """Mean errors of the predictions and of the two guesses over the time ahead."""
    ahead = period * np.array(errors.horizons)
    columns = 1 if len(groups) % 2 else sheet.side_by_side(2)
    rows = len(groups) // columns
    size = 8.0, 3.1, 1.45 * rows + 0.35 * (rows == 1)
    with figure_at(path, sheet, size, 0.09, 0.15, 0.98, 0.9, 0.24, 0.22) as figure:
        panels = figure.subplots(rows, columns, sharex=True, squeeze=False)
        for group, axes in zip(groups, panels.flat, strict=True):
            means = np.array([errors.means(horizon, group) for horizon in errors.horizons]).T * FACTOR[group]
            unit, factor = suited_unit(group, float(means.max()))
            for style, name, row in zip(LINES, ("predicted", "constant", "zero rate"), factor * means, strict=False):
                axes.plot(ahead, row, label=name, marker="o", markersize=3, **style)
            axes.set_xscale("log")
            logarithmic(axes, list(factor * means))
            axes.set_ylabel(f"{group} [{unit}]")
            plain_decades(axes.xaxis)
        for axes in panels[-1]:
            axes.set_xlabel("time ahead [s]")
        panels[0, 0].legend(
            loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.1, ncols=3, handlelength=2.2, columnspacing=1.2
        )


def estimate_picture(one: Estimated, place: int) -> FigureJob:
    """Errors of the filter and of the log's own estimate over time. place: of the flight among the others."""
    several = {"filter": sizes(one.filter_deviation)}
    if one.own_deviation:
        several["estimate in the log"] = sizes(one.own_deviation)
    known = np.logical_and.reduce([np.isfinite(values) for parts in several.values() for values in parts])
    panels = [
        Panel(name, unit, {who: parts[i][known] for who, parts in several.items()})
        for i, (name, unit) in enumerate(ESTIMATED.items())
    ]
    off = [f"{who} {quantity(of.position, 'm')}" for who, of in (("filter", one.filter), ("log's own", one.own)) if of]
    caption = f"{one.name}: how far estimates are from the truth; position, RMS: {', '.join(off)}."
    return FigureJob(f"{FIGURES}/estimate{place}", caption, one.time[known], panels, 2)


def sizes(one: Deviation) -> tuple[Floats, ...]:
    """How large each part is [m, m/s, °, °]."""
    lengths = [np.linalg.norm(values, axis=1) for values in (one.position, one.velocity)]
    return (*lengths, np.degrees(one.tilt), np.degrees(np.abs(one.yaw)))


def flight_picture(one: FlightComparison, place: int) -> FigureJob:
    lines = {SETPOINT: one.setpoint, "real": one.real_position, "simulated": one.flown_position}
    reach = max(float(np.abs(values).max(initial=0.0)) for values in lines.values())
    panels = [
        Panel(name, "m", {key: values[:, i] for key, values in lines.items()}, reach=reach) for i, name in enumerate("xyz")
    ]
    apart = f"the simulation was lost: {one.lost}"
    if not one.lost:
        apart = f"real and simulated differ by {quantity(one.apart, 'm')} (RMS)"
    return FigureJob(
        f"{FIGURES}/again{place}", f"{one.name}: setpoint, real and simulated position; {apart}.", one.time, panels, 3
    )


def figure_of(out: Path, job: FigureJob, sheet: Sheet) -> Figure:
    """A figure in the folder of a report. Its caption has names of files, not symbols."""
    job.draw(out, sheet)
    return Figure(job.name, job.caption, set_as=escape)


def write_identification(
    path: Path, evidence: Evidence, run: Identification, period: float, found: Sequence[Followed]
) -> None:
    """Write the page. found: `followers`; the figures show that whose position is predicted worst. Raises UserError."""
    named = worst_position(run.commands) if run.commands else ""
    shown = [one for one in found if one.name == named] or found[:1]
    with TemporaryDirectory() as folder:
        out = Path(folder)
        (out / FIGURES).mkdir()
        draw_intervals(out / INTERVALS, run.found)
        beside = {
            "left": [
                figure_of(out, prediction_picture(one, i, run.kind, "commands alone"), SVG) for i, one in enumerate(shown)
            ]
        }
        if run.commands:
            draw_errors(out / ERRORS, run.commands, period, SVG)
            beside["held-out"] = [Figure(ERRORS, AGAINST_GUESSES)]
        unknown = any(ENOUGH < max(reach(run.found, key)) < math.inf for key in NAMES)
        said = Figure(INTERVALS, OF_INTERVALS + UNKNOWN * unknown)
        text = with_figures(evidence._replace(figures=[said]), beside).html(out)
    write_beside(path, text)


def draw_intervals(path: Path, fit: Identified) -> None:
    """That of every parameter, in two panels; a triangle where it goes on."""
    rows = -(-len(NAMES) // 2)
    high = 0.19 * rows + 0.62
    with figure_at(path, SVG, (COLUMN, high), 0.235, 0.5 / high, 0.985, 1.0 - 0.12 / high, 1.08) as figure:
        for names, axes in zip((NAMES[:rows], NAMES[rows:]), figure.subplots(1, 2), strict=True):
            for place, key in enumerate(names):
                draw_interval(axes, place, key, fit)
            axes.set_yticks(range(len(names)), list(map(in_short, names)))
            axes.tick_params("y", length=0.0)
            axes.grid(visible=False, axis="y")
            axes.set(xlim=(-REACH, REACH), ylim=(rows - 0.4, -0.6), xlabel="95 % interval [% of the value]")


def draw_interval(axes: Axes, place: int, key: str, fit: Identified) -> None:
    low, top = (100.0 * one for one in reach(fit, key))
    if low == math.inf:
        looks = {"color": "0.45", "fontsize": rcParams["legend.fontsize"]}
        axes.text(0.0, place, within(fit, key), looks, ha="center", va="center", bbox={"pad": 1.0, "color": "white"})
        return
    ends, colour = np.clip([-low, top], -REACH, REACH), CURVES[int(max(low, top) > 100.0 * ENOUGH)]
    axes.plot(ends, [place, place], color=colour, linewidth=3.0, solid_capstyle="butt")
    for end, shape in zip(ends, "<>", strict=True):
        if abs(end) == REACH:
            axes.plot(end, place, marker=shape, color=colour, markersize=6.0, clip_on=False)
    said = [("95 % interval", f"{number(-low, 2)} to {number(top, 2)} %")]
    tell(axes, ToldPlace(float(ends[0]), float(ends[1]), place - 0.4, place + 0.4, in_short(key), said))


def with_figures(evidence: Evidence, beside: Mapping[str, Sequence[Figure]]) -> Evidence:
    """The same with figures after tables, by their anchors."""
    return evidence._replace(
        sections=[part for one in evidence.sections for part in (one, *beside.get(getattr(one, "anchor", ""), ()))]
    )


def prediction_picture(one: Followed, place: int, kind: str, knows: str) -> FigureJob:
    """Measured and predicted signals, and the residuals, around the largest error of the position half a second ahead. place:
    of the flight among the others; kind: of flight; knows: what predictions were made from.
    """
    states = one.predicted[HORIZONS[-1]].position - one.measured[HORIZONS[-1]].position
    off = np.linalg.norm(states, axis=1)
    worst, time = int(off.argmax()), one.time + AHEAD * one.period
    begin = min(max(time[0], time[worst] - 0.5 * SHOWN), max(time[0], time[-1] - SHOWN))
    kept = (time >= begin) & (time <= begin + SHOWN)
    panels, earlier = [], f"predicted {AHEAD * one.period:.2g} s earlier"
    labels = iter(PREDICTED)
    for names, unit, field in ((AXES, "rad/s", "rates"), ("xyz", "m/s", "velocity")):
        real, made = (getattr(states[AHEAD], field)[kept] for states in (one.measured, one.predicted))
        lines = [{"measured": before, earlier: after} for before, after in zip(real.T, made.T, strict=True)]
        panels += [Panel(next(labels), unit, both) for both in lines]
        panels.append(Panel(next(labels), unit, dict(zip(names, (made - real).T, strict=True))))
    caption = (
        f"{one.name}{f' ({kind})' if kind else ''}: measured, and {earlier} from {knows}. The largest error of the position "
        f"{HORIZONS[-1] * one.period:.2g} s ahead, {quantity(float(off[worst]), 'm')}, is that of the prediction made at "
        f"{one.time[worst]:.1f} s. The residuals are what the "
        "model does not explain: a slow wave is a missing force, a burst at each manoeuvre a wrong inertia, lag or delay."
    )
    return FigureJob(f"{FIGURES}/predicted{place}", caption, time[kept], panels, 2)
