"""One vehicle, scenario and controller: flown over many seeds, summarised with intervals."""

import math
from typing import Any, NamedTuple

import numpy as np

from quadstep.analysis.statistics import Estimate, mean, share
from quadstep.comparison.flights import FIRST_SEED, mission, scenarios
from quadstep.flight.closed_loop import Outcome
from quadstep.flight.engines import fly_all
from quadstep.mission.vehicle_list import load_preset
from quadstep.numbers import Vector


class Cell(NamedTuple):
    """Results. rmse: mean over completed flights [m], and its interval; largest: of all of these [m].

    activity: mean change of the rotors' thrusts a second over the weight [1/s]. saturated: mean share of time. lost: flights
    that did not complete, as a share with its exact interval.
    """

    vehicle: str
    scenario: str
    controller: str
    flights: int
    rmse: Estimate
    largest: float
    activity: float
    saturated: float
    lost: Estimate


NOTHING = Estimate(math.nan, math.nan, math.nan)


def scenario_table(vehicle: str) -> dict[str, dict[str, Any]]:
    """The scenarios of a vehicle, by name."""
    section = load_preset(vehicle)
    arm = max(Vector(mount.position).norm() for mount in section.geometry().mounts)
    return scenarios(section.mass, arm)


def fly_cell(vehicle: str, controller: str, name: str, scenario: dict[str, Any], seeds: int) -> Cell:
    """One scenario over the reported seeds."""
    missions = [mission(vehicle, controller, scenario, FIRST_SEED + i) for i in range(seeds)]
    logs = fly_all([one.plan() for one in missions])
    found = [one.flight_metrics(log)[0] for one, log in zip(missions, logs, strict=True) if log.outcome is Outcome.COMPLETED]
    lost = share(seeds - len(found), seeds)
    if not found:
        return Cell(vehicle, name, controller, seeds, NOTHING, math.nan, math.nan, math.nan, lost)
    weight = missions[0].vehicle.mass * missions[0].vehicle.gravity
    return Cell(
        vehicle=vehicle,
        scenario=name,
        controller=controller,
        flights=seeds,
        rmse=mean(np.array([metrics["position_rmse[m]"] for metrics in found])),
        largest=max(metrics["largest_error[m]"] for metrics in found),
        activity=float(np.mean([metrics["rotors"]["activity[N/s]"] for metrics in found])) / weight,
        saturated=float(np.mean([metrics["saturated_share"] for metrics in found])),
        lost=lost,
    )
