"""Flights as the page shows them: flown live where their laws allow it, as recorded where not."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from quadstep.engines.fly import FlightPlan, reason
from quadstep.interfaces.closed_loop import Outcome, Ticks
from quadstep.interfaces.log import LIMITS as LIMITS_PASSED
from quadstep.interfaces.log import REASONS, FlightLog
from quadstep.io.errors import UserError
from quadstep.metrics.registry import SOUND, Metrics, group, metric, rest_of
from quadstep.metrics.verdict import RULES, Rule, graded
from quadstep.mission.derived import ControllerSection
from quadstep.mission.lagrange import LagrangeMission
from quadstep.mission.schema import Mission
from quadstep.numbers import flatten, leaf_names
from quadstep.numbers.structure import from_fields
from quadstep.page.controllers import controllers, declared_controls, sliders_of
from quadstep.page.controls import LONGEST_TICKS, airframe_controls, shared_controls
from quadstep.page.laws import Laws
from quadstep.page.model import Cell, Control, ControllerData, FlightData, Rate, RecordedData, Summary, numbers_text
from quadstep.page.scenes import panels, scene
from quadstep.report import units
from quadstep.report.panels import left_path
from quadstep.vehicle.declared import DeclaredPlant

MOST_ROWS = 60_000
"""Rows of the longest log that the page flies."""

RECORDED_NUMBERS = 70_000
"""Numbers that the recordings of one page may hold together; longer ones are thinned."""


class ShownFlight(NamedTuple):
    """A flight to show. mission, plan: None where they are not known; metrics: of the log, as reported.

    folder: where the mission's files are. why_not: why it cannot be flown live, if that is known beforehand. called: what its
    controller is called, if not by its kind. rivals: controllers to be offered beside it, by what they are called; the
    package's if there are none. cell: its place where its group is a table. rate: of many flights like it.
    moved: gains that the page is about, by key, and what they may become. limits: above which it fails, by the metrics that
    the page sums up.
    """

    id: str
    name: str
    group: str
    mission: Mission | None
    plan: FlightPlan | None
    log: FlightLog
    metrics: Metrics
    folder: Path = Path()
    note: str = ""
    claims: tuple[int, ...] = ()
    warnings: tuple[str, ...] = ()
    why_not: str = ""
    called: str = ""
    rivals: Mapping[str, ControllerSection] = {}
    cell: Cell | None = None
    rate: Rate | None = None
    moved: Mapping[str, float] = {}
    limits: tuple[Rule, ...] = ()


def outcomes() -> list[dict[str, object]]:
    """What each outcome code means. limit: the one that was passed, with its parameter and the sentence with its number."""
    return [
        {
            "name": outcome.name.lower(),
            "text": words(outcome),
            "ended": outcome is not Outcome.COMPLETED,
            "limit": passed._asdict() if (passed := LIMITS_PASSED.get(outcome)) else None,
        }
        for outcome in Outcome
    ]


def rules(some: Sequence[Rule] = RULES) -> list[dict[str, object]]:
    """Rules, as those of `quadstep.metrics.verdict`, by the front end's names of their measures."""
    names = {metric: name for name, metric in SUMMED_UP.items()}
    return [{**rule._asdict(), "metric": names[rule.metric] if rule.measured else ""} for rule in some]


def words(outcome: Outcome) -> str:
    return REASONS.get(outcome, outcome.name.lower().replace("_", " "))


def outcome_data(flown: ShownFlight) -> dict[str, object]:
    """How a flight ended, and its grade."""
    log, grade = flown.log, graded(flown.metrics, flown.limits)
    lost = "" if log.outcome is Outcome.COMPLETED else reason(flown.plan, log) if flown.plan else words(log.outcome)
    text = f"lost at {log.ended:.4g} s: {lost}" if lost else f"completed {log.ended:g} s"
    return {"code": int(log.outcome), "ended": log.ended, "text": text, "why": lost, "grade": grade.grade.value,
            "reasons": list(grade.reasons), "left": bool(left_path(log, flown.metrics))}  # fmt: skip


def flight(flown: ShownFlight, laws: Laws, share: int = RECORDED_NUMBERS) -> FlightData:
    """One flight of the page. share: numbers its recording may hold, if it needs one."""
    plan, log = flown.plan, flown.log
    live, reason = Live((), ()), flown.why_not or "only its recording is available"
    if plan is not None:
        try:
            live, reason = fliers(flown, plan, laws), ""
        except UserError as error:
            reason = str(error)
    rest = {key: said.partition(";")[0] for key, said in rest_of(flown.metrics).items()}  # why: what is too small
    why_not = f"This flight is a recording; it cannot be flown in the page: {reason}." if reason else ""
    return from_fields(
        FlightData,
        flown,
        outcome=outcome_data(flown),
        facts=facts(flown.metrics),
        summary=summary(flown),
        whyNot=why_not,
        margins=SOUND if rest.get("grade") == SOUND else ", ".join(rest[key] for key in ("grade", "why") if key in rest),
        recorded=recorded(log, share) if why_not else None,
        controllers=live.controllers,
        controls=live.controls,
        ticks=plan.ticks._asdict() if plan else {"step": 0.01, "every": [1], "log": 1, "last": max(1, len(log.rows) - 1)},
        scene=scene(plan, log),
        panels=panels(log.columns),
        rate=flown.rate if live.controllers else None,
        limits=tuple(rules(flown.limits)),
    )


def controls(mission: Mission, plan: FlightPlan) -> list[Control]:
    """What of a mission its sliders move, beside the controller's gains."""
    if isinstance(plan.loop.plant, DeclaredPlant):
        return declared_controls(mission, plan)
    return shared_controls(mission, plan) if isinstance(mission, LagrangeMission) else airframe_controls(mission, plan)


class Live(NamedTuple):
    """What flies a flight in the page, and the sliders that all controllers share."""

    controllers: tuple[ControllerData, ...]
    controls: tuple[Control, ...]


def fliers(flown: ShownFlight, plan: FlightPlan, laws: Laws) -> Live:
    """The laws of a flight. Raises UserError where the page cannot fly it."""
    check_length(plan.ticks)
    if flown.mission is not None:
        found = controllers(flown.mission, plan, flown.folder, laws, flown.called, flown.rivals)
        found[0] = found[0]._replace(controls=foremost(found[0].controls, flown.moved))
        return Live(tuple(found), tuple(controls(flown.mission, plan)))
    sliders = tuple(sliders_of(plan.parameters.gains))  # nothing but the numbers of its plan is known
    return Live((ControllerData("own", type(plan.loop.controller).__name__, *laws.add(plan, quick=True), sliders, ()),), ())


def foremost(controls: tuple[Control, ...], moved: Mapping[str, float]) -> tuple[Control, ...]:
    """The sliders with those that are moved before all others, and as long as it takes. moved: by id, to where."""
    reaching = [
        one._replace(min=min(one.min, moved[one.id]), max=max(one.max, moved[one.id])) for one in controls if one.id in moved
    ]
    return (*reaching, *(one for one in controls if one.id not in moved))


def check_length(ticks: Ticks) -> None:
    """Refuses what would keep a browser busy for seconds, or fill its memory. Raises UserError."""
    rows = ticks.last // ticks.log + 1
    if ticks.last > LONGEST_TICKS or rows > MOST_ROWS:
        raise UserError(
            f"it has {ticks.last} steps and {rows} log rows; the page flies at most {LONGEST_TICKS} steps and {MOST_ROWS} rows"
        )


def recorded(log: FlightLog, share: int) -> RecordedData:
    """The log as flown, thinned to its share of numbers."""
    width = len(log.columns)
    every = max(1, -(-len(log.rows) * width // max(share, width)))
    rows = log.rows[::every]
    times = rows[:, list(log.columns).index("t")]
    period = float(times[1] - times[0]) if len(rows) > 1 else 1.0
    return RecordedData(tuple(log.columns.items()), numbers_text(rows), "f64", len(rows), period)


SUMMED_UP = {
    "rmse": "position_rmse[m]", "largest": "largest_error[m]", "tilt": "largest_tilt[rad]", "share": "largest_thrust_share",
    "relative": "relative_error", "heading": "heading_error[rad]", "growth": "error_growth", "rateGrowth": "rate_growth",
    "overturned": "overturned[rad]", "shaking": "shaking[rad]", "saturated": "saturated_share",
}  # fmt: skip
"""The front end's name of each number that it sums a flight up with, and the metric that it equals."""

LIMITS = ("allocation.most", "vehicle.rotors.maximum")
"""Parameters that hold a rotor's greatest thrust [N], on real vehicles and on the paper's plant."""


UNLIMITED = 1e9
"""A greatest thrust [N] that stands for none."""


def summary(flown: ShownFlight) -> Summary:
    """What the page needs to sum up a flight as `quadstep fly` does."""
    numbers = dict(zip(leaf_names(flown.plan.parameters), flatten(flown.plan.parameters), strict=True)) if flown.plan else {}
    limit = next((name for name in LIMITS if name in numbers and numbers[name] < UNLIMITED), None)
    least = limit if limit is None else limit.replace(".maximum", ".minimum").replace(".most", ".least")
    arm, cut = (flown.mission.arm, flown.mission.cut) if flown.mission else (0.0, "")
    geometry = getattr(flown.plan and flown.plan.loop.plant, "geometry", None)
    upward = sum(float(mount.axis[2]) for mount in geometry.mounts) if geometry else 4.0
    return Summary(float(getattr(flown.mission, "scored_from", 0.0)), limit, least, upward, arm, cut, filed(flown.metrics))


def filed(metrics: Metrics) -> dict[str, float]:
    """The metrics that the page sums up, by the front end's names."""
    return {name: float(value) for name, given in SUMMED_UP.items() if isinstance(value := metrics.get(given), int | float)}


def facts(metrics: Metrics) -> tuple[tuple[str, str], ...]:
    found = []
    if "position_rmse[m]" in metrics:
        found.append(("position RMSE", units.quantity(metric(metrics, "position_rmse[m]"), "m")))
    for axis, values in group(metrics, "position").items():
        found.append((f"largest error in {axis}", units.quantity(values["largest[m]"], "m")))
    if "largest_tilt[rad]" in metrics:
        found.append(("largest tilt", f"{math.degrees(metric(metrics, 'largest_tilt[rad]')):.3g}°"))
    if "u" in metrics:
        found.append(("largest thrust", f"{metric(metrics, 'u', 'largest[N]'):.4g} N"))
    torques = [
        metric(metrics, f"tau_{angle}", "largest[N m]") for angle in ("psi", "theta", "phi") if f"tau_{angle}" in metrics
    ]
    if torques:
        found.append(("largest torque", f"{max(torques):.3g} N m"))
    if rest := rest_of(metrics):
        found.append(("loop at rest", f"{rest['grade']}: {rest['why']}"))
    return tuple(found)
