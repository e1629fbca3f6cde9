"""What `quadstep replay` finds of logged flights: how well a vehicle predicts, simulates and estimates them."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from quadstep.identify.closed_loop import Beside, fly_again, hover_ratio, later_ratio
from quadstep.identify.errors import HORIZONS
from quadstep.identify.estimator import Estimated, estimate
from quadstep.identify.logs.flight import FlightRecord
from quadstep.identify.replay import ready
from quadstep.identify.table import ErrorTable, compare
from quadstep.mission.airframe import AirframeSection
from quadstep.report.units import counted

DRAWN_HORIZONS = (1, 2, 5, 10, 20, 50)
"""Samples ahead that a report shows; those of `HORIZONS` among them."""


class ReplayRequest(NamedTuple):
    """What is asked of some flights. vehicle: its name. controller: its keys. report: whether to find all that one shows."""

    vehicle: str
    section: AirframeSection
    controller: dict[str, object] | None
    estimator: bool
    commands_only: bool
    residual: bool
    report: bool


class Predictions(NamedTuple):
    """Errors of predictions; title: what they know."""

    title: str
    compared: ErrorTable


class Replayed(NamedTuple):
    """What is found. thrust: a sentence, or nothing. period: of the rows [s]."""

    period: float
    predictions: list[Predictions]
    thrust: str
    flown: list[Beside]
    estimates: list[Estimated]


def replayed(flights: Sequence[FlightRecord], asked: ReplayRequest) -> Replayed:
    """All that is asked; predictions where nothing else is, and for a report. Raises UserError."""
    estimates = [estimate(flight) for flight in flights] if asked.estimator else []
    flown = fly_again(list(flights), asked.section, asked.controller) if asked.controller else []
    if not asked.report and (asked.estimator or asked.controller):
        return Replayed(flights[0].period, [], "", flown, estimates)
    return Replayed(flights[0].period, predicted_errors(flights, asked), thrust(flights, asked.section), flown, estimates)


def predicted_errors(flights: Sequence[FlightRecord], asked: ReplayRequest) -> list[Predictions]:
    """Errors of the vehicle's predictions, and of those with its learned residual."""
    horizons = DRAWN_HORIZONS if asked.report else HORIZONS
    numbers, guided = ready(flights, asked.section, asked.commands_only)
    found = compare(flights, asked.section, numbers, guided, horizons)
    knows = "commands and setpoints" if guided else "commands alone"
    said = f"{found.starts} predictions of {counted(len(found.names), 'flight')} from {knows}"
    several = [Predictions(said, found)]
    if asked.residual:
        effects = asked.section.effects.model_copy(update={"residual": True})
        section = asked.section.model_copy(update={"effects": effects})
        numbers, guided = ready(flights, section, asked.commands_only)
        again = compare(flights, section, numbers, guided, horizons)
        several.append(Predictions(f"The same with the learned residual, from {knows}", again))
    return several


def thrust(flights: Sequence[FlightRecord], section: AirframeSection) -> str:
    """How far modelled and needed thrust differ."""
    ratios, later = (
        [one for one in (of(flight, section) for flight in flights) if math.isfinite(one)] for of in (hover_ratio, later_ratio)
    )
    if not ratios:
        return ""
    mean = sum(ratios) / len(ratios)
    said = f"Modelled thrust from the logged commands over the thrust needed: {mean:.3f}"
    if len(ratios) > 1:
        said += f" on average, {least_to_most(ratios)}"
    return said + f"; relative to that of a flight's first seconds {least_to_most(later)}" if later else said


def least_to_most(values: Sequence[float]) -> str:
    """The range of some numbers."""
    return " to ".join(dict.fromkeys(f"{one:.3f}" for one in (min(values), max(values))))
