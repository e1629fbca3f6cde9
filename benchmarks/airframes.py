"""Real vehicles with every effect and every sensor enabled, in many flights; and a controller that is not compiled."""

import os
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.flights import seconds
from quadstep.control.opaque import MeasuredArrays, ReferenceArrays, flying
from quadstep.engines.engine import Engine
from quadstep.engines.fly import FlightPlan, fly
from quadstep.engines.kernel import fly_lanes, host_width
from quadstep.engines.scored import scored
from quadstep.engines.sweep import Sweep, places
from quadstep.mission.multirotor import MultirotorMission
from quadstep.numbers.noise import key

NOISE = {"gyro_noise": 0.002, "position_noise": 0.002, "velocity_noise": 0.02, "attitude_noise": 0.005}
LATE = {"fix_period": 0.01, "latency": 0.02}
WIND = {"mean": [8.5, 0.0, 0.0]}
FULL: dict[str, Any] = {
    "vehicle": {"preset": "research-2.6kg"},
    "path": {
        "type": "figure-eight",
        "plane": "vertical",
        "length": 2.5,
        "width": 1.5,
        "period": 6.3,
        "turns": 50.0,
        "centre": [0.0, 0.0, 3.0],
    },
    "controller": {"type": "rotation-backstepping"},
    "wind": {**WIND, "turbulence": {"wind_20": 8.5, "height": 6.0}},
    "sensors": {**NOISE, **LATE},
    "simulation": {"duration": 10.0},
}
"""Drag, turning and accelerating rotors, turbulence at 100 Hz; gyro at 500 Hz, fixes at 100 Hz, 20 ms late; adaptive
backstepping with two nets of ten neurons, attitude loop at 500 Hz, position loop at 100 Hz; Runge-Kutta 4 at 2 ms."""

CALM = {**FULL, "wind": WIND, "sensors": LATE}
ESTIMATED = {**FULL, "sensors": {**FULL["sensors"], "accelerometer_noise": 0.02, "estimator": True}}

FLIGHTS, COMPARED = 512, 32
INSTRUCTIONS = {4: "SSE2", 8: "AVX2", 16: "AVX-512"}


def plans(content: dict[str, Any], count: int) -> list[FlightPlan]:
    """Flights that differ in their noise."""
    one = MultirotorMission.model_validate(content).plan()
    return [one._replace(parameters=one.parameters._replace(key=key(seed, 0))) for seed in range(count)]


def rate(content: dict[str, Any], double: bool) -> float:
    """Steps a second on all cores through lanes, noise of its own in every flight."""
    one = plans(content, 1)[0]
    loop, ticks = scored(one.loop, one.ticks, 1.0)
    words = places(one.start, one.parameters, [f"parameters.key.words.{i}" for i in range(4)])
    sweep = Sweep(loop, ticks, one.start, one.parameters, words, double)
    values = np.array([list(key(seed, 0).words) for seed in range(FLIGHTS)])
    if sweep.fly(values).outcome.any():
        raise RuntimeError("a flight of the benchmark was lost")
    return FLIGHTS * ticks.last / seconds(lambda: sweep.fly(values), 5)


def single_precision_error(content: dict[str, Any]) -> float:
    """Largest distance of a flight in f32 from the same one in f64 over 10 s; the median of some flights [m]."""
    flights = plans(content, COMPARED)
    first = flights[0]
    paths = []
    for double in (True, False):
        parameters, starts = [one.parameters for one in flights], [one.start for one in flights]
        logs = fly_lanes(first.loop, parameters, starts, first.ticks._replace(log=25), double=double)
        paths.append(np.array([log.table("x", "y", "z") for log in logs]))
    apart = np.linalg.norm(paths[0] - paths[1], axis=2).max(axis=1)
    return float(np.median(apart))


def airframes(name: str, content: dict[str, Any], target: str) -> tuple[str, str, str, str, str]:
    """A row: many flights of one kind."""
    single, double = rate(content, False), rate(content, True)
    width = host_width(False)
    return (
        name,
        f"{single:.2g} steps/s in f32 ({width} lanes of {INSTRUCTIONS.get(width, 'vectors')}, {os.cpu_count()} cores)",
        target,
        f"f64 {double:.2g} steps/s ({single / double:.1f} times less)",
        f"f32 to f64 over 10 s: {1e3 * single_precision_error(content):.2g} mm, median of {COMPARED} flights",
    )


def full_vehicle(_: Path) -> tuple[str, str, str, str, str]:
    """Everything that moves and is measured, under the full controller."""
    return airframes(f"{FLIGHTS} flights of a real vehicle, full controller", FULL, ">= 1e7 on two AVX-512 cores")


def calm_vehicle(_: Path) -> tuple[str, str, str, str, str]:
    """The same without noise and turbulence."""
    return airframes("the same without noise and turbulence", CALM, "-")


def estimated_vehicle(_: Path) -> tuple[str, str, str, str, str]:
    """The same on measurements only."""
    return airframes("the same with noise, turbulence and the estimator", ESTIMATED, "-")


def opaque_controller(_: Path) -> tuple[str, str, str, str, str]:
    """Any Python callable as the controller: what a step takes besides it."""
    inside, asked = 0.0, 0

    def controller(_: float, measured: MeasuredArrays, reference: ReferenceArrays) -> tuple[float, tuple[float, float, float]]:
        nonlocal inside, asked
        start = time.perf_counter()
        error, speed = reference.position - measured.position, reference.velocity - measured.velocity
        lean = 0.05 * (6.0 * error + 4.0 * speed + reference.acceleration)
        thrust = 2.644 * (9.81 + 6.0 * float(error[2]) + 4.0 * float(speed[2]))
        _, q_x, q_y, q_z = measured.attitude
        p, q, r = measured.rates
        torque = (
            0.03 * (-100.0 * (2.0 * q_x + lean[1]) - 15.0 * p),
            0.03 * (-100.0 * (2.0 * q_y - lean[0]) - 15.0 * q),
            0.05 * (-20.0 * q_z - 5.0 * r),
        )
        inside, asked = inside + time.perf_counter() - start, asked + 1
        return thrust, torque

    one = plans({**FULL, "wind": {}}, 1)[0]

    def besides(plan: FlightPlan) -> float:
        nonlocal inside, asked
        inside, asked = 0.0, 0
        start = time.perf_counter()
        fly(plan)
        return (time.perf_counter() - start - inside) / asked

    with flying(controller) as (law, gains):
        plan = one.with_controller(law, gains)
        fly(plan)
        took, own = min((besides(plan), inside / asked) for _ in range(5))
        short = plan._replace(ticks=plan.ticks._replace(last=500))
        lanes, floats = fly(short), fly(short, Engine.PYTHON)
        compiled = seconds(lambda: fly(one)) / one.ticks.last
    return (
        "a step with an opaque controller, besides it",
        f"{1e6 * took:.0f} us",
        "< 100 us",
        f"the controller itself {1e6 * own:.0f} us; a step with the full controller, compiled {1e6 * compiled:.1f} us",
        f"lanes to floats {np.abs(lanes.rows - floats.rows).max():.0e}",
    )
