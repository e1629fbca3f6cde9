"""Flights that nobody would call as asked, on paths and vehicles drawn at random: what does their grade say?"""

import math
from collections.abc import Iterable

import numpy as np

from quadstep.engines.fly import fly
from quadstep.interfaces.closed_loop import Outcome
from quadstep.metrics.verdict import FlightGrade, graded
from quadstep.mission.schema import Mission
from tests.challenge.search import Attempt, Search

VEHICLES = ("x500", "crazyflie", "hummingbird", "research-2.6kg")


def verdict(content: dict[str, object], case: str) -> Attempt:
    """Whether a flight that reaches its end is called as asked."""
    mission = Mission.model_validate(content)
    log = fly(mission.plan())
    if log.outcome is not Outcome.COMPLETED:
        return Attempt(0.0, case)
    found = graded(mission.flight_metrics(log)[0])
    return Attempt(2.0 if found.grade is FlightGrade.AS_ASKED else 0.0, f"{case}: {found.grade.value} {found.reasons}")


def lost_rotors(seed: int) -> Iterable[Attempt]:
    """A rotor stops 0.1 to 3 s before the end of a flight around a circle or in a hover, calm or in wind."""
    random = np.random.default_rng(seed)
    while True:
        vehicle, radius = str(random.choice(VEHICLES)), float(random.choice([0.0, 1.0, 3.0]))
        duration, late = float(random.uniform(5.0, 20.0)), float(0.1 * 30.0 ** random.uniform())
        circle = {"type": "circle", "centre": [0.0, 0.0, 9.0], "radius": radius, "period": 3.0 + 4.0 * radius, "ramp": 2.0}
        hover = {"type": "step", "start": [0.0, 0.0, 9.0], "end": [0.0, 0.0, 9.0], "duration": 2.0}
        speed = float(random.choice([0.0, 3.0]))
        content = {
            "vehicle": {"preset": vehicle},
            "path": circle if radius else hover,
            "wind": {"mean": [speed, 0.0, 0.0]},
            "simulation": {"duration": duration},
            "events": [{"type": "rotor", "time": duration - late, "rotor": int(random.integers(1, 5)), "efficiency": 0.0}],
        }
        yield verdict(
            content, f"{vehicle}, radius {radius:g} m, wind {speed:g} m/s, {duration:.6g} s, lost {late:.6g} s before"
        )


def far_off(seed: int) -> Iterable[Attempt]:
    """A straight path of 50 m to 2 km, flown by gains so low that wind holds the vehicle more than 3 m off."""
    random = np.random.default_rng(seed)
    while True:
        length, speed = float(50.0 * 40.0 ** random.uniform()), float(random.uniform(6.0, 12.0))
        gain, heading = float(random.uniform(0.03, 0.3)), float(random.uniform(-math.pi, math.pi))
        duration = max(20.0, length / 10.0)
        content = {
            "vehicle": {"preset": "x500"},
            "path": {"type": "minimum-jerk", "start": [0.0, 0.0, 50.0], "end": [length, 0.0, 50.0], "duration": duration},
            "wind": {"mean": [speed * math.cos(heading), speed * math.sin(heading), 0.0]},
            "controller": {"type": "pid", "velocity_integral": 0.0, "position": gain},
        }
        mission = Mission.model_validate(content)
        log = fly(mission.plan())
        metrics, _ = mission.flight_metrics(log)
        off = float(str(metrics["position_rmse[m]"]))
        asked = graded(metrics).grade is FlightGrade.AS_ASKED
        where = f"{length:.6g} m, wind {speed:.6g} m/s at {heading:.6g} rad, gain {gain:.6g}"
        yield Attempt(off / 3.0 if asked else 0.0, f"{where}: {off:.3g} m off")


SEARCHES = [
    Search("as asked, a lost rotor", "no flight that loses a rotor 0.1 s before its end or earlier is as asked", lost_rotors),
    Search("as asked, far off", "no flight that is off its path by more than 3 m on average is as asked", far_off, bound=True),
]
