"""What `quadstep replay` has found, for its readers, and its tables as CSV."""

import hashlib
import re
from collections.abc import Sequence
from html import escape
from pathlib import Path

import numpy as np

from quadstep.identify.filtered_logs import FIX_EVERY, FIX_NOISE, Estimated
from quadstep.identify.flown_setpoints import NEAR, QUICKER, FlightComparison, Tracking, of_thrust, of_wrong_thrust, ratios
from quadstep.identify.logs.flight import FlightRecord
from quadstep.identify.replay import ErrorTable, Replayed, ReplayRequest, why_unusable
from quadstep.identify.starts import GROUPS, HORIZONS
from quadstep.identify.vehicle_file import was_fitted_to
from quadstep.io import __version__
from quadstep.metrics.statistics import FEWEST, Estimate
from quadstep.mission.airframe import AirframeSection
from quadstep.report import markup
from quadstep.report.evidence import Evidence, Section, TableSection
from quadstep.report.publish import write_csv
from quadstep.report.units import counted, handy, interval, listed, number, percent, quantity, unit_suffix

UNIT = {"position": "m", "velocity": "m/s", "attitude": "°", "rates": "°/s"}
"""Units in which errors are drawn and said."""

FACTOR = {"position": 1.0, "velocity": 1.0, "attitude": 180.0 / np.pi, "rates": 180.0 / np.pi}
"""To these units."""


ESTIMATED = {"position": "m", "velocity": "m/s", "tilt": "°", "yaw": "°"}
"""What an estimate is off by."""

PREDICTED = (
    "roll rate", "pitch rate", "yaw rate", "rate residual", "x velocity", "y velocity", "z velocity", "velocity residual",
)  # fmt: skip
"""Panels of a flight's predictions over time."""

AHEAD = 50
"""Samples ahead, of which the summary speaks."""


TIMES = 2.0
"""From this ratio on it is said how many times."""

CONSTANT = "the error of assuming constant velocity and rates"

SI = UNIT | {"attitude": "rad", "rates": "rad/s"}


def identity(flights: Sequence[FlightRecord], request: ReplayRequest) -> str:
    """A digest of the logs and of what is asked of them."""
    digest = hashlib.sha256(f"{request!r} {[(one.name, one.period) for one in flights]}".encode())
    for flight in flights:
        for values in (flight.time, flight.motors, *flight.channels.values()):
            digest.update(values.tobytes())
    return f"replay-{digest.hexdigest()[:16]}"


def panels_of(request: ReplayRequest) -> dict[str, tuple[str, ...]]:
    """The figures of a replay, those of one kind under one name, and their panels."""
    again = {"again": tuple("xyz")} if request.controller else {}
    return {"errors": GROUPS, "predicted": PREDICTED, **again, **({"estimate": tuple(ESTIMATED)} if request.estimator else {})}


def write_tables(out: Path, result: Replayed) -> None:
    """What was found as CSV, in SI."""
    names = [f"{name}[{SI[group]}]" for group in GROUPS for name in (group, f"{group}_constant", f"{group}_zero_rate")]
    rows = error_rows(result.predictions[0].compared, result.period)
    write_csv(out / "prediction_errors.csv", ("flight", "samples_ahead", "ahead[s]", *names), rows)
    if result.flown:
        header = ("flight", "which", "rmse[m]", "lag[s]", "tilt[rad]", "rate[rad/s]")
        both = [(one.name, who, *of) for one in result.flown for who, of in (("real", one.real), ("simulated", one.simulated))]
        write_csv(out / "tracking.csv", header, both)
    if result.estimates:
        header = ("flight", "estimate", "position[m]", "velocity[m/s]", "tilt[rad]", "yaw[rad]")
        write_csv(out / "estimates.csv", header, [(one.name, *who) for one in result.estimates for who in estimators(one)])


def error_rows(errors: ErrorTable, period: float) -> list[tuple[object, ...]]:
    """Mean errors of each flight at each horizon, in SI."""
    several = (errors.predicted, errors.constant, errors.zero)
    return [
        (name, horizon, horizon * period, *(float(one[h, g, i]) for g in range(len(GROUPS)) for one in several))
        for i, name in enumerate(errors.names)
        for h, horizon in enumerate(errors.horizons)
    ]


def numbers(errors: ErrorTable) -> dict[str, object]:
    """Mean errors over the flights, in SI, and their ratios to those of "constant"."""
    said: dict[str, object] = {"flights": len(errors.names), "predictions": errors.starts}
    for horizon in HORIZONS:
        for group in GROUPS:
            said[f"{group}_error_{horizon}_ahead[{SI[group]}]"] = errors.means(horizon, group)[0]
            said[f"{group}_error_{horizon}_ahead_to_constant"] = errors.ratio(horizon, group).value
    return said


METHOD = (
    "Two baselines need no model: “constant” assumes that velocity and rates do not change, “zero rate” that the velocity "
    "does not change and the rates are zero. Errors are averaged over all predictions of a flight, then over flights, and so "
    f"are their ratios to the baselines', with 95 % intervals where there are {FEWEST} flights or more."
)


DIVIDED = "÷: by the error of the better baseline, constant velocity and rates or zero rates"


def evidence(flights: Sequence[FlightRecord], request: ReplayRequest, result: Replayed, warnings: Sequence[str]) -> Evidence:
    """What was found, for its readers. warnings: where the logs contradict their mapping."""
    named = flights[0].name if len(flights) == 1 else counted(len(flights), "flight")
    vehicle, first = called(request.section), result.predictions[0].compared if result.predictions else None
    name = f"{vehicle} ({request.vehicle}) on {named}"
    method = f"Flights: {', '.join(flight.name for flight in flights)}. {METHOD}"
    sections: list[Section] = [TableSection("Predictions", "predictions", text=method, set_as=escape)] * bool(first)
    sections += [error_table(one.title, one.compared, result.period) for one in result.predictions]
    if result.flown and request.controller:
        sections.append(tracking_table(result.flown, str(request.controller["type"])))
    if result.estimates:
        sections.append(estimate_table(result.estimates))
    files = ["prediction_errors.csv", *["tracking.csv"] * bool(result.flown), *["estimates.csv"] * bool(result.estimates)]
    sections.append(markup.links([(one, one) for one in files], "Errors of every flight, in SI units:"))
    known = [flight.name for flight in flights if was_fitted_to(request.section, flight)]
    left = [flight for flight in flights if first and flight.name not in first.names]
    unseen = [f"Nothing is predicted for {listed([one.name for one in left])}: {why_unusable(left)}."] if left else []
    thrust = [f"{of_thrust(result.thrust)}."] if result.thrust and not of_wrong_thrust(result.thrust) else []
    said = " ".join([*no_test(known, len(flights)), *unseen, answer(result, not known)])
    return Evidence(
        name=name,
        kind="Replay",
        answer=said,
        sentences=[said, *thrust, *result.laws],
        record={"name": name, "version": __version__, **(numbers(first) if first else {})},
        facts=facts(first, result.period) if first else (),
        sections=sections,
        more=[*thrust, *result.laws],
        warnings=warnings,
        fold=("predictions", "estimates", "others"),
    )


def called(vehicle: AirframeSection) -> str:
    """What a vehicle is, in few words: the beginning of its description."""
    return re.split("[;,:]", vehicle.description)[0] or "Vehicle"


def answer(result: Replayed, tests: bool = True) -> str:
    """What was asked, a sentence each: predictions, simulated flights, estimates; after the first, a thrust that is wrong.
    tests: whether the flights are others than those that the vehicle was fitted to.
    """
    said = [f"The {predicting(one.compared, result.period, tests)}" for one in result.predictions[:1]]
    if result.flown:
        said.append(likeness(result.flown))
    if result.estimates:
        off = float(np.sqrt(np.mean([one.filter.position**2 for one in result.estimates])))
        said.append(f"The Kalman filter's position is off by {quantity(off, 'm')} (RMS).")
    first = bool(result.predictions)
    return " ".join([*said[:first], *of_wrong_thrust(result.thrust), *said[first:]])


def no_test(names: Sequence[str], flights: int) -> list[str]:
    """What comes before all else where a vehicle was fitted to these of the flights, or to parts of them."""
    if not names:
        return []
    these = listed(names) if len(names) < flights else "this flight" if flights == 1 else "these flights"
    known = f"The vehicle was identified from the recording of {these}, so this does not test it"
    return [f"{known}: replay a flight that it was not fitted to."]


def predicting(compared: ErrorTable, period: float, tests: bool = True) -> str:
    """How well the position is predicted and, if that tests the vehicle, what is predicted better than without a model."""
    return (
        f"position predicted {in_time(AHEAD, period)} ahead from {compared.knows} is off by {off_by(compared)} on average, "
        f"{share(compared.ratio(AHEAD, 'position'), CONSTANT)}{f': {verdict(compared)}' if tests else ''}."
    )


def better_than_none(compared: ErrorTable) -> str:
    """What is predicted better or worse than by the better of the two baselines."""
    kinds: dict[str, list[str]] = {}
    for group in GROUPS:
        ratio = to_better_guess(compared, group)
        low, high = (ratio.low, ratio.high) if ratio.bounded else (ratio.value, ratio.value)
        other = "worse than the better one" if low > 1.0 else "not demonstrably better than the better one"
        kinds.setdefault("better than both baselines" if high < 1.0 else other, []).append(group)
    first, *rest = [f"{listed(groups)} {how}" for how, groups in kinds.items()]
    but = f", but {listed(rest)}" if rest else ""
    return first.replace("better one", "better baseline") + but


def verdict(compared: ErrorTable) -> str:
    """The same, as a clause that says of which flights it is true."""
    flights = len(compared.names)
    these = f"these {flights} flights" if flights > 1 else "this flight"
    where = "" if compared.ratio(AHEAD, "position").bounded else f"on {these}, "
    return f"{where}the model predicts {better_than_none(compared)}"


def off_by(compared: ErrorTable) -> str:
    """Mean error of the position `AHEAD`."""
    return quantity(compared.means(AHEAD, "position")[0], "m")


def share(ratio: Estimate, of: str) -> str:
    """A ratio to something, with its interval: 23 % of it, or 39 times it."""
    several = ratio.value >= TIMES
    return f"{interval(*ratio)} times {of}" if several else f"{percent(ratio.value, ratio.low, ratio.high)} of {of}"


def to_better_guess(compared: ErrorTable, group: str) -> Estimate:
    """The ratio to the better of "constant" and "zero rate"."""
    return max((compared.ratio(AHEAD, group, to) for to in ("constant", "zero")), key=lambda one: one.value)


def suited_unit(group: str, largest: float) -> tuple[str, float]:
    """In which errors are said, and the factor to it: metres become millimetres, speeds stay m/s."""
    return handy(UNIT[group], largest) if group == "position" else (UNIT[group], 1.0)


def facts(compared: ErrorTable, period: float) -> list[markup.Fact]:
    """Errors `AHEAD`, as shares of those of the better guess."""
    shown = []
    for group in GROUPS:
        error = FACTOR[group] * compared.means(AHEAD, group)[0]
        unit, factor = suited_unit(group, error)
        more = share(to_better_guess(compared, group), "the better baseline's error")
        shown.append(
            markup.Fact(f"{group} error after {in_time(AHEAD, period)}", number(factor * error) + unit_suffix(unit), more)
        )
    return shown


def in_time(horizon: int, period: float) -> str:
    return f"{horizon * period:.2g}\u00a0s"


def error_table(title: str, errors: ErrorTable, period: float) -> TableSection:
    """Mean errors at the longer of `HORIZONS`, and those `AHEAD` over the better baseline's."""
    rows: list[Sequence[markup.Cell]] = []
    for group in GROUPS:
        means = [FACTOR[group] * errors.means(horizon, group)[0] for horizon in HORIZONS[1:]]
        unit, factor = suited_unit(group, max(means))
        ratio = interval(*to_better_guess(errors, group))
        rows.append((f"{group} [{unit}]", *(number(factor * one) for one in means), ratio))
    ahead = [in_time(horizon, period) for horizon in HORIZONS[1:]]
    known = " (95 %)" if errors.ratio(AHEAD, GROUPS[0]).bounded else ""
    header = ("mean error after", *ahead, f"÷ better baseline{known}")
    text = f"{title}: {errors.starts:,} starting points in {counted(len(errors.names), 'flight')}; ratios after {ahead[-1]}."
    return TableSection("", "", header, rows, text, escape, shown=f"{title}; {DIVIDED}")


def estimators(one: Estimated) -> list[tuple[str, float, float, float, float]]:
    """Each estimate that there is of a flight, and its errors."""
    return [(who, *of) for who, of in (("filter", one.filter), ("the log's own", one.own)) if of]


def estimate_table(estimates: Sequence[Estimated]) -> TableSection:
    rows = []
    for one in estimates:
        for who, position, velocity, tilt, yaw in estimators(one):
            angles = [quantity(np.degrees(angle), "°") for angle in (tilt, yaw)]
            rows.append((f"{one.name}, {who}", quantity(position, "m"), quantity(velocity, "m/s"), *angles))
    sensors = (
        f"RMS errors; the filter gets gyro, accelerometer, and a position at {1.0 / FIX_EVERY:.0f} Hz with "
        f"{quantity(FIX_NOISE, 'm', 1)} noise"
    )
    header = ("flight, estimate", "position", "velocity", "tilt", "yaw")
    return TableSection("Estimates", "estimates", header, rows, f"{sensors}.", escape, shown=sensors)


TRACKING = ("real / simulated", "RMSE [mm]", "lag [ms]", "tilt, 99 % [°]", "mean rate [°/s]", "lost")


def likeness(comparisons: Sequence[FlightComparison]) -> str:
    """How similar they are, in a sentence: equal errors need not be the same ones, so how far apart the flights are too."""
    near = sum(1.0 / NEAR <= one <= NEAR for one in ratios(comparisons, "rmse"))
    apart = [one.apart for one in comparisons if not one.lost]
    said = f"The simulated RMSE is within a factor of two of the real one in {near} of {counted(len(comparisons), 'flight')}"
    if not apart:
        return f"{said}: all simulated flights were lost."
    away = " to ".join(dict.fromkeys(quantity(one, "m") for one in (min(apart), max(apart))))
    lost = f"; {len(comparisons) - len(apart)} were lost" if len(apart) < len(comparisons) else ""
    turned = ratios(comparisons, "rate")
    said = f"{said}, and the simulated position is {away} from the real one (RMS){lost}."
    if not (turned[0] < 1.0 / QUICKER or turned[-1] > QUICKER):
        return said
    times = " to ".join(dict.fromkeys(number(one, 2) for one in (turned[0], turned[-1])))
    quick = f"turn {times} times as fast as the real ones (mean rate)"
    return f"{said} But simulated flights {quick}: the loop that flew is not the simulated one."


def tracking_table(comparisons: Sequence[FlightComparison], controller: str) -> TableSection:
    """How each flight, and its simulation, follows its setpoints."""
    rows = [
        (one.name, *map(" / ".join, zip(tracked(one.real), tracked(one.simulated), strict=True)), one.lost)
        for one in comparisons
    ]
    title = f"Logged setpoints simulated with {controller}"
    text = f"{title}, starting from the measured state."
    return TableSection("Real and simulated flights", "simulated", TRACKING, rows, text, escape, shown=title)


def tracked(one: Tracking) -> tuple[str, str, str, str]:
    """How a flight follows its setpoints, as text."""
    mm, ms, tilt, rate = map(number, (1e3 * one.rmse, 1e3 * one.lag, np.degrees(one.tilt), np.degrees(one.rate)))
    return mm, ms, tilt, rate
