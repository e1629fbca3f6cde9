"""The metrics that the package has of a flight, each declared once: of which quantity, reduced how, and what it means.

`REPORTED` are computed from a log, for `metrics.json`; `SCORED` are summed while flying, for campaigns. Those that a mission
names, the package's (`effort.py`) and a user's own, are classes of their own: `quadstep.interfaces.log`. `MARGINS` are those
of the loop at rest: `phase_margin` is the least over all channels, `phase_margin_roll` that of one.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple, TypeAlias, cast

from quadstep.interfaces.log import FlightLog
from quadstep.metrics import quantities
from quadstep.metrics.quantities import LoggedFlight, Quantity
from quadstep.metrics.reductions import (
    Largest,
    LargestLength,
    Reduction,
    Rms,
    RmsLength,
    Sums,
    Variation,
    activity,
    final,
    greatest,
    late_growth,
    least,
    length_of_mean,
    mean,
    overturned,
    rms_beyond_twice,
    rms_share,
    settling,
)  # fmt: skip

LEAST_GAIN, LEAST_PHASE, DELAYS = 6.0, math.radians(30.0), 2.0
"""Margins asked of a sound loop unless a mission says otherwise: of gain [dB], upwards and downwards, and of phase [rad], the
textbook's (Ogata, "Modern Control Engineering", 5th edition, section 7-7; for aircraft SAE AS94900 asks for 6 dB and 45
degrees); of delay, in multiples of the mission's latency.
"""

UNITS = {
    "gain_margin_up": "[dB]", "gain_margin_down": "[dB]", "phase_margin": "[rad]", "delay_margin": "[s]", "disk_margin": "",
    "sensitivity_peak": "",
}  # fmt: skip
"""Each kind, with its unit. gain_margin_down: how far the gain may fall, a number above 0."""

CHANNELS = "thrust", "roll", "pitch", "yaw"

LESS_IS_BETTER = "sensitivity_peak"

MARGINS = {f"{kind}{ending}": unit for kind, unit in UNITS.items() for ending in ("", *(f"_{name}" for name in CHANNELS))}
"""Units by name."""


AT_REST, SOUND, NO_REST, HELD = "margins_at_rest", "sound", "no rest found", "holds_a_point"
"""The key of "grade" and "why" of a loop at rest; the best grade, and that without rest; the key of a path that is a point."""

WRITTEN = "the loop of the mission as written"
"""Whose grade it is where a mission is varied."""

UNGRADED = "The loop at rest is not graded here; `quadstep linear` examines it."
"""Of a flight whose grade would take long."""


def rest_of(metrics: Mapping[str, object]) -> Mapping[str, str]:
    """The grade of the loop at rest and why, as a flight's metrics have it; empty where it is not known."""
    return cast(Mapping[str, str], metrics.get(AT_REST, {}))


def at_rest(rest: Mapping[str, str], whose: str = "the loop") -> str:
    """A grade beside other results, in words without a full stop; empty where none is known. It may come without why."""
    if not rest:
        return ""
    why = f": {rest['why']}" if "why" in rest else ""
    if rest["grade"] == NO_REST:
        return f"no rest was found for {whose}{why}"
    return f"hovering at the start of its path, {whose} is {rest['grade']}{why}"


def at_rest_sentences(rest: Mapping[str, str], whose: str = "the loop") -> list[str]:
    """The same as a sentence, if a grade is known."""
    text = at_rest(rest, whose)
    return [f"{text[0].upper()}{text[1:]}."] if text else []


def is_margin(name: str) -> bool:
    """Whether larger values of this metric are better."""
    return name in MARGINS and not name.startswith(LESS_IS_BETTER)


PAPER, REAL, OTHER = "paper", "real", "other"
"""Whose flights a metric is reported of: the paper's plant, real vehicles, any other plant."""

ALL = (PAPER, REAL, OTHER)


class LogMetric(NamedTuple):
    """name: its place in results, dots between levels, {} for the entry of its quantity. per: unit after that of the entry."""

    name: str
    meaning: str
    quantity: Quantity
    reduction: Reduction
    of: tuple[str, ...] = ALL
    unit: str | None = None

    def full_names(self, entries: Mapping[str, str]) -> list[str]:
        """With their units, of a quantity with these entries."""
        if "{}" not in self.name:
            entries = dict(list(entries.items())[:1])
        return [with_unit(self.name.format(name), self.unit or unit) for name, unit in entries.items()]


class SummedMetric(NamedTuple):
    """A metric summed while flying; as `LogMetric`. quantity: a name of `Scored.now`."""

    name: str
    meaning: str
    quantity: str
    sums: type[Sums]


def with_unit(name: str, unit: str) -> str:
    """`position_rmse[m]`."""
    return name if unit == "-" else f"{name}[{unit}]"


RMSE, LARGEST = "position_rmse", "largest_error"
EFFORTS = "energy", "rotor_activity", "saturation"
"""What is measured beside tracking, where the vehicle has rotors of its own."""

DISTANCE = "root mean square of the distance from the path"
FARTHEST = "largest distance from the path"

REPORTED = (
    LogMetric("position.{}.rmse", "root mean square error along an axis", quantities.position_error, Rms.of),
    LogMetric("position.{}.largest", "largest error along an axis", quantities.position_error, Largest.of),
    LogMetric("position.{}.final", "error along an axis at the end", quantities.position_error, final),
    LogMetric(RMSE, DISTANCE, quantities.position_error, RmsLength.of),
    LogMetric(LARGEST, FARTHEST, quantities.position_error, LargestLength.of, (REAL, OTHER)),
    LogMetric("relative_error", "position RMSE relative to the path's size (see Grades)",
              quantities.error_against_path, rms_share),
    LogMetric("heading_error", "root mean square of the angle between yaw and the commanded "
                               "heading", quantities.heading_error, RmsLength.of),
    LogMetric("error_growth", "growth of the error: steady growth or growth at the end, whichever is larger (see "
           "Grades)", quantities.error_over_time, late_growth),
    LogMetric("rate_growth", "the same for the angular rates", quantities.rates_over_time, late_growth),
    LogMetric("measured_rmse", "distance between the measured position and the true "
                               "one", quantities.measuring_error, RmsLength.of),
    LogMetric("attitude.{}.rmse", "root mean square error of an angle", quantities.attitude_error, Rms.of),
    LogMetric("attitude.{}.largest", "largest error of an angle", quantities.attitude_error, Largest.of),
    LogMetric("attitude.{}.final", "error of an angle at the end", quantities.attitude_error, final),
    LogMetric("attitude.{}.error_settling", "when the error of an angle becomes and stays small", quantities.attitude_error,
           settling, unit="s"),
    LogMetric("attitude.{}.angle_settling", "when an angle last comes close to its final command",
              quantities.attitude_from_last, settling, unit="s"),
    LogMetric("largest_tilt", "largest angle between thrust and vertical", quantities.tilt, Largest.of),
    LogMetric("overturned", "largest tilt after the vehicle was first within 90 degrees of "
                            "upright", quantities.tilt, overturned),
    LogMetric("shaking", "root mean square wobble of the thrust axis in the second half that the path does not explain (see "
                         "Grades)", quantities.swings, rms_beyond_twice),
    LogMetric("{}.largest", "largest magnitude of an input", quantities.inputs, Largest.of),
    LogMetric("{}.total_variation", "total absolute change of an input from row to row", quantities.inputs, Variation.of),
    LogMetric("rotors.least", "smallest thrust of any rotor", quantities.rotors, least),
    LogMetric("rotors.largest", "largest thrust of any rotor", quantities.rotors, greatest),
    LogMetric("rotors.activity", "total absolute change of all rotor thrusts per second", quantities.rotors, activity,
              (REAL, OTHER), "N/s"),
    LogMetric("mean_thrust", "mean of the sum of the rotors' thrusts", quantities.total_thrust, mean, (REAL, OTHER)),
    LogMetric("saturated_share", "share of the rows at which the rotor limits reduced the command",
           quantities.saturation, mean),
    LogMetric("wind.mean", "length of the mean wind", quantities.wind, length_of_mean),
    LogMetric("largest_weight_norm.{}", "largest norm of a net's weights", quantities.weight_norms, Largest.of),
)  # fmt: skip
"""In the order of `metrics.json`. A flight has those whose quantity its log has."""

SCORED = (
    SummedMetric(RMSE, DISTANCE, "error", RmsLength),
    SummedMetric(LARGEST, FARTHEST, "error", LargestLength),
    SummedMetric("effort_{}", "root mean square of an input", "inputs", Rms),
    SummedMetric("variation_{}", "total absolute change of an input from sample to sample", "inputs", Variation),
    SummedMetric("largest_{}", "largest norm of a net's weights", "norms", Largest),
)
"""In the order of a campaign's columns."""


def score_names_of(efforts: Mapping[str, str], norms: Iterable[str]) -> tuple[str, ...]:
    """The names of `SCORED` with their units, of a plant with these inputs and nets."""
    entries = {"error": {"": "m"}, "inputs": efforts, "norms": dict.fromkeys(norms, "-")}
    return tuple(with_unit(one.name.format(name), unit) for one in SCORED for name, unit in entries[one.quantity].items())


Metrics: TypeAlias = dict[str, object]
"""Numbers and texts by name with unit, nested as in `metrics.json`."""


def flight_metrics(log: FlightLog, since: float = 0.0, efforts: Mapping[str, str] | None = None, arm: float = 0.0) -> Metrics:
    """Everything reported of a flight of any plant, with units in the keys; `quadstep.metrics.registry` says what each means.

    Always: "outcome", "ended[s]"; where there are two rows or more: "position" by axis, "position_rmse[m]", and what the
    columns of the log allow. since: errors of position and heading count from then on [s]. efforts: columns of the inputs of a
    plant that declares itself, and their units. arm: from the vehicle's centre to its farthest rotor [m], 0 if not known.

    >>> from quadstep import Mission, flight_metrics, fly
    >>> metrics = flight_metrics(fly(Mission(path={"type": "step", "end": [0.0, 0.0, 1.0], "duration": 2.0})))
    >>> metrics["ended[s]"], round(metrics["position"]["z"]["largest[m]"], 3), metrics["largest_tilt[rad]"] < 0.01
    (2.0, 1.0, True)
    >>> step = {"type": "step", "end": [0.0, 0.0, 0.5], "duration": 4.0}
    >>> flight = fly(Mission(vehicle={"preset": "crazyflie"}, path=step))
    >>> flight_metrics(flight)["largest_error[m]"], flight_metrics(flight, since=3.5)["largest_error[m]"] < 0.1
    (0.5, True)
    """
    result: Metrics = {"outcome": log.outcome.name.lower(), "ended[s]": log.ended}
    t = log.column("t")
    if len(t) < 2 or t[-1] <= since:
        return result
    kind = REAL if "q_w" in log.columns else PAPER if "psi" in log.columns else OTHER
    seen = LoggedFlight(log, since, efforts or {}, arm)
    result |= {HELD: True} if seen.holds else {}
    reported = [metric for metric in REPORTED if kind in metric.of]
    measured = {quantity: quantity(seen) for quantity in {metric.quantity for metric in reported}}
    for metric in reported:
        if (found := measured[metric.quantity]) is not None:
            for name, value in zip(metric.full_names(found.entries), metric.reduction(found.values, found.t), strict=True):
                place(result, name, value)
    return result


LOWEST, FULL = "lowest_thrust_share", "full_thrust_share"


def rotor_metrics(log: FlightLog, asked: quantities.Numbers, least: float, most: float) -> Metrics:
    """What a flight uses of rotors with limits [N]. asked: the thrusts of a command, before its limits or after."""
    if not len(log.rows):
        return {}
    cut, tiny = quantities.saturation(quantities.LoggedFlight(log)), 1e-9 * most
    sides = (asked <= least + tiny).any(axis=1), (asked >= most - tiny).any(axis=1)
    at = sides[0] | sides[1] if cut is None else cut.values[:, 0] > 0.0
    shares = {name: float((at & side).mean()) for name, side in zip((LOWEST, FULL), sides, strict=True)}
    used = float(quantities.rotor_thrusts(log).sum(axis=1).max()) / (most * asked.shape[1])
    return {"saturated_share": float(at.mean()), **shares, **({"largest_thrust_share": used} if len(log.rows) > 1 else {})}


def of_saturation(metrics: Metrics, text: Callable[[float], str]) -> str:
    """How much of the time rotors were at a limit, by which limit. text: of a share."""
    named = (("the lowest", metrics.get(LOWEST)), ("full", metrics.get(FULL)))
    sides = [f"by {side} thrust {text(share)}" for side, share in named if isinstance(share, float) and share]
    return f"of the time{': ' * bool(sides)}{', '.join(sides)}"


def warned(metrics: Metrics) -> tuple[Metrics, list[str]]:
    """With a warning of saturation, where there was any."""

    def text(share: float) -> str:
        return f"{100 * share:.3g} %"

    share = cast(float, metrics.get("saturated_share", 0.0))
    return metrics, [f"the rotors were saturated {text(share)} {of_saturation(metrics, text)}"] if share else []


def place(result: Metrics, name: str, value: float | None) -> None:
    """Put a number where its dotted name says."""
    *levels, last = name.split(".")
    for level in levels:
        result = cast(Metrics, result.setdefault(level, {}))
    result[last] = value


def metric(metrics: Mapping[str, object], *names: str) -> float:
    """A number of the metrics, by the names on the way to it. Raises KeyError where it is not there.

    >>> from quadstep.metrics.registry import metric
    >>> metric({"position": {"z": {"rmse[m]": 0.25}}}, "position", "z", "rmse[m]")
    0.25
    """
    found: object = metrics
    for name in names:
        found = cast(Metrics, found)[name]
    return cast(float, found)


def group(metrics: Mapping[str, object], name: str) -> dict[str, dict[str, float]]:
    """The numbers of each axis or angle; empty where there are none."""
    return cast("dict[str, dict[str, float]]", metrics.get(name, {}))
