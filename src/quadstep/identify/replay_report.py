"""What `quadstep replay` has found, for its readers; with --out its figures and tables too."""

import hashlib
from collections.abc import Sequence
from html import escape
from pathlib import Path

import numpy as np

from quadstep.identify import beside_page
from quadstep.identify.beside_page import flight_picture
from quadstep.identify.errors import GROUPS, HORIZONS
from quadstep.identify.estimator import FIX_EVERY, FIX_NOISE, Deviation, Estimated
from quadstep.identify.logs.flight import FlightRecord, Floats
from quadstep.identify.replay import Replayed, ReplayRequest
from quadstep.identify.table import ErrorTable, why_unusable
from quadstep.identify.vehicle_file import fitted_to
from quadstep.io.results.record import FIGURES
from quadstep.io.version import __version__
from quadstep.metrics.statistics import Estimate
from quadstep.report import page
from quadstep.report.axes import logarithmic, plain_decades
from quadstep.report.canvas import LINES, drawing, margins, new_figure
from quadstep.report.canvas import write as write_figure
from quadstep.report.drawing import FigureJob
from quadstep.report.evidence import Evidence, Figure, Section, Table
from quadstep.report.panel import Panel
from quadstep.report.publish import publishing
from quadstep.report.sheet import Sheet
from quadstep.report.tables import write_csv
from quadstep.report.units import counted, handy, interval, listed, number, percent, quantity

UNIT = {"position": "m", "velocity": "m/s", "attitude": "°", "rates": "rad/s"}
"""Units in which errors are drawn and said."""

FACTOR = {"position": 1.0, "velocity": 1.0, "attitude": 180.0 / np.pi, "rates": 1.0}
"""To these units."""


def draw_errors(path: Path, found: ErrorTable, period: float, sheet: Sheet) -> None:
    """Mean errors of the predictions and of the two guesses over the time ahead."""
    ahead = period * np.array(found.horizons)
    columns = sheet.side_by_side(2)
    with drawing(sheet):
        figure = new_figure(sheet, 8.0, 4.6, 1.45 * len(GROUPS) / columns)
        margins(figure, sheet, 0.09, 0.1, 0.98, 0.92, 0.24, 0.2)
        panels = figure.subplots(len(GROUPS) // columns, columns, sharex=True, squeeze=False)
        for group, axes in zip(GROUPS, panels.flat, strict=True):
            rows = np.array([found.means(horizon, group) for horizon in found.horizons]).T * FACTOR[group]
            unit, factor = handy(UNIT[group], float(rows.max()))
            for style, name, row in zip(LINES, ("predicted", "constant", "zero rate"), factor * rows, strict=False):
                axes.plot(ahead, row, label=name, marker="o", markersize=3, **style)
            axes.set_xscale("log")
            logarithmic(axes, list(factor * rows))
            axes.set_ylabel(f"{group} [{unit}]")
            plain_decades(axes.xaxis)
        for axes in panels[-1]:
            axes.set_xlabel("time ahead [s]")
        panels[0, 0].legend(
            loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.1, ncols=3, handlelength=2.2, columnspacing=1.2
        )
        write_figure(figure, path, sheet)


def estimate_picture(one: Estimated, place: int) -> FigureJob:
    """Errors of the filter and of the log's own estimate over time. place: of the flight among the others."""
    several = {"filter": sizes(one.filter_deviation)}
    if one.own_deviation:
        several["estimate in the log"] = sizes(one.own_deviation)
    known = np.logical_and.reduce([np.isfinite(values) for parts in several.values() for values in parts])
    panels = [
        Panel(name, unit, {who: parts[i][known] for who, parts in several.items()})
        for i, (name, unit) in enumerate((("position", "m"), ("velocity", "m/s"), ("tilt", "°"), ("yaw", "°")))
    ]
    caption = f"{one.name}: how far estimates are from the truth."
    return FigureJob(f"{FIGURES}/estimate{place}", caption, one.time[known], panels, 2)


def sizes(one: Deviation) -> tuple[Floats, ...]:
    """How large each part is [m, m/s, °, °]."""
    lengths = [np.linalg.norm(values, axis=1) for values in (one.position, one.velocity)]
    return (*lengths, np.degrees(one.tilt), np.degrees(np.abs(one.yaw)))


AHEAD = 50
"""Samples ahead, of which the summary speaks."""

ERRORS = f"{FIGURES}/errors"

TIMES = 2.0
"""From this ratio on it is said how many times."""

SI = {"position": "m", "velocity": "m/s", "attitude": "rad", "rates": "rad/s"}


def identity(flights: Sequence[FlightRecord], asked: ReplayRequest) -> str:
    """A digest of the logs and of what is asked of them."""
    digest = hashlib.sha256(f"{asked!r} {[(one.name, one.period) for one in flights]}".encode())
    for flight in flights:
        for values in (flight.time, flight.motors, *flight.channels.values()):
            digest.update(values.tobytes())
    return f"replay-{digest.hexdigest()[:16]}"


def write(
    folder: Path, flights: Sequence[FlightRecord], asked: ReplayRequest, found: Replayed, told: Evidence, overwrite: bool,
    sheet: Sheet,
) -> None:  # fmt: skip
    """Write every file of the folder. told: what was found. Raises UserError."""
    with publishing(folder, identity(flights, asked), overwrite) as out:
        (out / FIGURES).mkdir()
        write_tables(out, found)
        illustrated(told, found, out, sheet.with_svg()).write(out)


def write_tables(out: Path, found: Replayed) -> None:
    """What was found as CSV, in SI."""
    names = [f"{name}[{SI[group]}]" for group in GROUPS for name in columns(group)]
    rows = error_rows(found.predictions[0].compared, found.period)
    write_csv(out / "prediction_errors.csv", ("flight", "samples_ahead", "ahead[s]", *names), rows)
    if found.flown:
        header = ("flight", "which", "rmse[m]", "lead[s]", "tilt[rad]", "rate[rad/s]")
        both = [(one.name, who, *of) for one in found.flown for who, of in (("real", one.real), ("simulated", one.simulated))]
        write_csv(out / "tracking.csv", header, both)
    if found.estimates:
        header = ("flight", "estimate", "position[m]", "velocity[m/s]", "tilt[rad]", "yaw[rad]")
        write_csv(out / "estimates.csv", header, [(one.name, *who) for one in found.estimates for who in estimators(one)])


def columns(group: str) -> tuple[str, str, str]:
    """Names of a group's errors in the table."""
    return group, f"{group}_constant", f"{group}_zero_rate"


def error_rows(found: ErrorTable, period: float) -> list[tuple[object, ...]]:
    """Mean errors of each flight at each horizon, in SI."""
    several = (found.predicted, found.constant, found.zero)
    return [
        (name, horizon, horizon * period, *(float(one[h, g, i]) for g in range(len(GROUPS)) for one in several))
        for i, name in enumerate(found.names)
        for h, horizon in enumerate(found.horizons)
    ]


def numbers(found: ErrorTable) -> dict[str, object]:
    """Mean errors over the flights, in SI, and their ratios to those of "constant"."""
    said: dict[str, object] = {"flights": len(found.names), "predictions": found.starts}
    for horizon in HORIZONS:
        for group in GROUPS:
            said[f"{group}_error_{horizon}_ahead[{SI[group]}]"] = found.means(horizon, group)[0]
            said[f"{group}_error_{horizon}_ahead_to_constant"] = found.ratio(horizon, group).value
    return said


METHOD = (
    "Means over all predictions of a flight, then over flights. “Constant”: velocity and rates stay what they are; "
    "“zero rate”: velocity stays and the rates are zero. The ratios are means of those of the flights, with 95 % "
    "intervals where there are several."
)


def evidence(flights: Sequence[FlightRecord], asked: ReplayRequest, found: Replayed, warnings: Sequence[str]) -> Evidence:
    """What was found, for its readers. warnings: where the logs contradict their mapping."""
    named = flights[0].name if len(flights) == 1 else counted(len(flights), "flight")
    name, first = f"{asked.vehicle}, {named}", found.predictions[0].compared if found.predictions else None
    sections: list[Section] = [page.paragraph(f"Flights: {', '.join(flight.name for flight in flights)}.", escape)]
    sections += [page.heading("Predictions", "predictions"), page.paragraph(METHOD)] if first else []
    sections += [error_table(one.title, one.compared, found.period) for one in found.predictions]
    sections += [page.paragraph(found.thrust)] if found.thrust else []
    if found.flown and asked.controller:
        sections.append(beside_page.table(found.flown, str(asked.controller["type"])))
    if found.estimates:
        sections.append(estimate_table(found.estimates))
    known = [flight.name for flight in flights if flight.name in fitted_to(asked.section)]
    left = [flight for flight in flights if first and flight.name not in first.names]
    unseen = [f"Of {listed([one.name for one in left])} nothing is predicted: {why_unusable(left)}."] if left else []
    said = " ".join([*no_test(known, len(flights)), *unseen, answer(found)])
    return Evidence(
        name=name,
        kind="Replay",
        answer=said,
        sentences=[said, *filter(None, [found.thrust])],
        record={"name": name, "version": __version__, **(numbers(first) if first else {})},
        facts=facts(first, found.period) if first else (),
        sections=sections,
        warnings=warnings,
    )


def illustrated(told: Evidence, found: Replayed, out: Path, sheet: Sheet) -> Evidence:
    """The same with its figures, which are drawn into a folder: one of each kind at the top, the others below."""
    draw_errors(out / ERRORS, found.predictions[0].compared, found.period, sheet)
    flown = [beside_page.drawn(out, flight_picture(one, place), sheet) for place, one in enumerate(found.flown)]
    estimated = [beside_page.drawn(out, estimate_picture(one, place), sheet) for place, one in enumerate(found.estimates)]
    caption = "Mean error of predictions over the time ahead: the vehicle helps where its line is below those of both guesses."
    rest = [*flown[1:], *estimated[1:]]
    more = [page.heading("The other flights", "others")] if rest else []
    figures = [Figure(ERRORS, caption), *flown[:1], *estimated[:1]]
    return told._replace(figures=figures, sections=[*told.sections, *more, *rest])


def answer(found: Replayed) -> str:
    """What was asked, in a sentence: predictions, simulated flights, estimates."""
    said = [predicting(found.predictions[0].compared, found.period)] if found.predictions else []
    if found.flown:
        said.append(beside_page.answer(found.flown).rstrip("."))
    if found.estimates:
        said.append(f"The Kalman filter's position is off by {quantity(filtered(found.estimates), 'm')} (RMS)")
    first, *rest = said
    return "; ".join([first, *(one[0].lower() + one[1:] for one in rest)]) + "."


def no_test(known: Sequence[str], flights: int) -> list[str]:
    """What comes before all else where a vehicle was fitted to some of the flights, by these names."""
    if not known:
        return []
    these = listed(known) if len(known) < flights else "this flight" if flights == 1 else "these flights"
    return [f"Going by names, the vehicle was identified from {these}: no test of it."]


def predicting(compared: ErrorTable, period: float) -> str:
    """How well the position is predicted, and what of the rest is not."""
    error, ratio = compared.means(AHEAD, "position")[0], compared.ratio(AHEAD, "position")
    low, high = ends(ratio)
    than = "predicts better" if high < 1.0 else "predicts worse" if low > 1.0 else "is not shown to predict better"
    worse = [group for group in GROUPS[1:] if ends(compared.ratio(AHEAD, group))[1] >= 1.0]
    flights = len(compared.names)
    who = "The" if ratio.bounded else f"In {f'these {flights} flights' if flights > 1 else 'this flight'} the"
    return (
        f"{who} vehicle {than} than no model: {in_time(AHEAD, period)} ahead the predicted position is off by "
        f"{quantity(error, 'm')} on average, {share(ratio, 'the error')} if velocity and rates stayed constant"
        f"{f' (not so {listed(worse)})' if worse and high < 1.0 else ''}"
    )


def ends(ratio: Estimate) -> tuple[float, float]:
    """Of its interval, or itself where it has none."""
    return (ratio.low, ratio.high) if ratio.bounded else (ratio.value, ratio.value)


def share(ratio: Estimate, of: str) -> str:
    """A ratio to something, with its interval: 23 % of it, or 39 times it."""
    several = ratio.value >= TIMES
    return f"{interval(*ratio)} times {of}" if several else f"{percent(ratio.value, ratio.low, ratio.high)} of {of}"


def filtered(found: Sequence[Estimated]) -> float:
    """RMS of the filter's position errors over flights [m]."""
    return float(np.sqrt(np.mean([one.filter.position**2 for one in found])))


def facts(compared: ErrorTable, period: float) -> list[page.Fact]:
    """Errors half a second ahead."""
    shown = []
    for group in GROUPS:
        ratio = compared.ratio(AHEAD, group)
        error = quantity(FACTOR[group] * compared.means(AHEAD, group)[0], UNIT[group])
        more = f"{in_time(AHEAD, period)} ahead: {share(ratio, 'constant')}"
        shown.append(page.Fact(group, error, more))
    return shown


def said(ratio: Estimate) -> str:
    """A ratio with its interval, if it has one."""
    return number(ratio.value) if np.isnan(ratio.low) else interval(*ratio)


def in_time(horizon: int, period: float) -> str:
    return f"{horizon * period:.2g}\u00a0s"


def error_table(title: str, found: ErrorTable, period: float) -> Table:
    """Mean errors at each of `HORIZONS`."""
    rows: list[Sequence[page.Cell]] = []
    for group in GROUPS:
        for horizon in HORIZONS:
            means = [FACTOR[group] * one for one in found.means(horizon, group)]
            unit, factor = handy(UNIT[group], max(means))
            texts = [number(factor * one) for one in means]
            to_zero = number(found.ratio(horizon, group, "zero").value)
            rows.append((f"{group}, {horizon} [{unit}]", *texts, said(found.ratio(horizon, group)), to_zero))
    header = ("what, samples ahead", "error", "constant", "zero rate", "to constant (95 %)", "to zero")
    return Table("", "", header, rows, f"{title}; a sample is {quantity(period, 's')}.", shown=title)


def estimators(one: Estimated) -> list[tuple[str, float, float, float, float]]:
    """Each estimate that there is of a flight, and its errors."""
    return [(who, *of) for who, of in (("filter", one.filter), ("the log's own", one.own)) if of]


def estimate_table(found: Sequence[Estimated]) -> Table:
    rows = []
    for one in found:
        for who, position, velocity, tilt, yaw in estimators(one):
            angles = [quantity(np.degrees(angle), "°") for angle in (tilt, yaw)]
            rows.append((f"{one.name}, {who}", quantity(position, "m"), quantity(velocity, "m/s"), *angles))
    sensors = (
        f"RMS errors; the filter gets gyro, accelerometer, and a position at {1.0 / FIX_EVERY:.0f} Hz with "
        f"{quantity(FIX_NOISE, 'm', 1)} noise"
    )
    header = ("flight, estimate", "position", "velocity", "tilt", "yaw")
    return Table("Estimates", "estimates", header, rows, f"{sensors}.", escape, shown=sensors)
