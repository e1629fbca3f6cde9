"""The vehicles, controllers and scenarios of the study, as missions."""

import math
from typing import Any

from quadstep.mission.multirotor import MultirotorMission
from quadstep.numbers import vector

VEHICLES = ("crazyflie", "hummingbird", "x500", "research-2.6kg", "paper")

CONTROLLERS: dict[str, dict[str, Any]] = {
    "adaptive, nets": {"type": "rotation-backstepping"},
    "adaptive, no nets": {"type": "rotation-backstepping", "nets": {"enabled": False}},
    "paper's law": {"type": "backstepping"},
    "geometric": {"type": "geometric"},
    "PID": {"type": "pid"},
}
"""All with the gains of `quadstep.mission`, found with the same budget on the 2.6 kg vehicle and seeds below 200."""

FIRST_SEED = 1001
"""Seeds from here on are reported; none of them was used to find a gain."""

SENSORS = {
    "gyro_noise": 0.002,
    "position_noise": 0.002,
    "velocity_noise": 0.02,
    "attitude_noise": 0.005,
    "fix_period": 0.004,
    "latency": 0.02,
}
"""Noise and latency of every flight: about those of a motion-capture system, 20 ms late, with a gyro on board."""

WINDS = {"0": (0.0, 0.0), "4.2": (4.2, 0.0), "8.5": (8.5, 0.0), "12.1": (12.1, 0.0), "8.5 + 2.4 sin t": (8.5, 2.4)}
"""Mean wind and its swing at 1 rad/s along x [m/s], as in the published flights of the vertical figure eight."""

PUBLISHED = {
    "nonlinear baseline": (11.7, 10.5, 16.1, 24.1, 31.3),
    "INDI": (7.4, 6.4, 8.5, 10.8, 11.3),
    "L1": (4.5, 5.8, 11.9, 22.5, 13.1),
    "Neural-Fly": (3.1, 4.1, 5.8, 9.3, 7.7),
}
"""Position RMSE [cm] of real flights at `WINDS` (O'Connell et al. 2022)."""

SPEEDS = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
LENGTH, WIDTH = 10.0, 5.0
"""Of the level figure eight [m]."""

SETTLING, GROUND_CLEARANCE = 3.0, 5.0
RAMP = 3.0


def eight(speed: float) -> dict[str, Any]:
    """A level figure eight flown at `speed` [m/s] through its middle, where it is fastest; scored once at full speed."""
    period = 2.0 * math.pi * vector(0.5 * LENGTH, WIDTH).norm() / speed
    path = {"type": "figure-eight", "length": LENGTH, "width": WIDTH, "period": period, "turns": 50.0, "ramp": RAMP}
    duration = round(RAMP + max(20.0, period), 1)
    return {"path": {**path, "centre": [0.0, 0.0, GROUND_CLEARANCE]}, "simulation": {"duration": duration}, "score_from": RAMP}


def hover() -> dict[str, Any]:
    """Twenty seconds in one place."""
    place = [0.0, 0.0, GROUND_CLEARANCE]
    return {"path": {"type": "step", "start": place, "end": place, "duration": 20.0}, "score_from": SETTLING}


def step() -> dict[str, Any]:
    """The commanded position jumps by 5 m."""
    start, end = [0.0, 0.0, GROUND_CLEARANCE], [5.0, 0.0, GROUND_CLEARANCE]
    return {"path": {"type": "step", "start": start, "end": end, "time": 1.0, "duration": 10.0}}


def vertical_eight(mean: float, swing: float) -> dict[str, Any]:
    """x = 1.25 sin t, z = 0.75 sin 2t in wind along x with Dryden turbulence of that wind, scored from 15 s on."""
    path = {"type": "figure-eight", "plane": "vertical", "length": 2.5, "width": 1.5, "period": 2.0 * math.pi, "turns": 50.0}
    wind: dict[str, Any] = {"mean": [mean, 0.0, 0.0]}
    if swing:
        wind |= {"swing": [swing, 0.0, 0.0], "swing_frequency": 1.0}
    if mean:
        wind["turbulence"] = {"wind_20": mean, "height": 6.0}
    simulation = {"duration": 40.0}
    return {"path": {**path, "centre": [0.0, 0.0, 3.0]}, "wind": wind, "simulation": simulation, "score_from": 15.0}


def scenarios(mass: float, arm: float) -> dict[str, dict[str, Any]]:
    """Every scenario for a vehicle of this mass [kg] and arm [m]."""
    payload = {"type": "payload", "time": 5.0, "mass": 0.3 * mass, "position": [0.0, 0.0, -0.25 * arm]}
    fault = {"type": "rotor", "time": 5.0, "rotor": 1, "efficiency": 0.8}
    return {
        "hover": hover(),
        **{f"eight {speed:g} m/s": eight(speed) for speed in SPEEDS},
        "step 5 m": step(),
        **{f"vertical eight, wind {name}": vertical_eight(*wind) for name, wind in WINDS.items()},
        "mass +30 %": {**eight(2.0), "events": [payload]},
        "rotor 1 at 80 %": {**eight(2.0), "events": [fault]},
    }


def mission(vehicle: str, controller: str, scenario: dict[str, Any], seed: int) -> MultirotorMission:
    """One flight."""
    content = {
        "name": vehicle,
        "seed": seed,
        "vehicle": {"preset": vehicle, "ground": 0.0},
        "controller": CONTROLLERS[controller],
        "sensors": SENSORS,
        "limits": {"distance": 20.0, "rate": 60.0},
        **scenario,
    }
    return MultirotorMission.model_validate(content)
