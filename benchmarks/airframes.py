"""The full vehicle with the full controller through lanes, and any Python callable as its controller."""

import os
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.flights import seconds
from quadstep.control.opaque import flying
from quadstep.flight.engines import FlightPlan, fly
from quadstep.flight.lanes import fly_lanes
from quadstep.flight.log import FlightLog
from quadstep.mission.airframe_mission import AirframeMission

FULL: dict[str, Any] = {
    "vehicle": {"preset": "research-2.6kg"},
    "path": {"type": "figure-eight", "plane": "vertical", "length": 2.5, "width": 1.5, "period": 6.28, "turns": 3},
    "controller": {"type": "rotation-backstepping"},
    "wind": {"mean": [8.5, 0.0, 0.0], "turbulence": {"wind_20": 8.5, "height": 6.0}},
    "sensors": {"gyro_noise": 0.002, "position_noise": 0.002, "attitude_noise": 0.005, "fix_period": 0.01, "latency": 0.02},
}
FLIGHTS, STEPS = 256, 8000


def plan(**changes: Any) -> FlightPlan:
    """The full vehicle at 500 Hz, position loop and turbulence at 100 Hz."""
    return AirframeMission.model_validate({**FULL, **changes}).plan()


def steps_a_second(one: FlightPlan, double: bool) -> float:
    """Closed-loop steps a second of many flights, almost without rows."""
    ticks = one.ticks._replace(last=STEPS, log=STEPS)

    def batch() -> list[FlightLog]:
        return fly_lanes(one.loop, [one.parameters] * FLIGHTS, [one.start] * FLIGHTS, ticks, double=double)

    return FLIGHTS * STEPS / seconds(batch, 3)


def full_vehicle(_: Path) -> tuple[str, str, str, str, str]:
    """f32 beside f64, and beside the same without noise and turbulence."""
    one, calm = plan(), plan(sensors={}, wind={"mean": [8.5, 0.0, 0.0]})
    single, double, quiet = steps_a_second(one, False), steps_a_second(one, True), steps_a_second(calm, False)
    short = one.ticks._replace(last=5000)
    near, exact = (fly_lanes(one.loop, [one.parameters], [one.start], short, double=kind)[0] for kind in (False, True))
    apart = np.abs(near.table("x", "y", "z") - exact.table("x", "y", "z")).max()
    return (
        f"full vehicle and controller, {os.cpu_count()} cores",
        f"f32 {single:.2g} steps/s",
        "1e7 (f32)",
        f"f64 {double:.2g}; f32 without noise and turbulence {quiet:.2g}",
        f"f32 to f64 over 10 s: {1e6 * apart:.2g} um",
    )


def opaque_step(_: Path) -> tuple[str, str, str, str, str]:
    """A step of the full vehicle whose controller is a Python callable that does nothing."""
    one = plan()
    one = one._replace(ticks=one.ticks._replace(last=2000))
    with flying(lambda *_: (26.0, (0.0, 0.0, 0.0))) as (law, gains):
        asked = one.with_controller(law, gains)
        took, compiled = seconds(lambda: fly(asked), 3), seconds(lambda: fly(one), 3)
    return (
        "any Python callable as controller",
        f"{1e6 * took / 2000:.0f} us a step",
        "< 100 us",
        f"compiled controller {1e6 * compiled / 2000:.1f} us a step",
        "-",
    )
