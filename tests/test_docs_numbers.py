"""Numbers of single flights that docs/controllers.md quotes."""

from pathlib import Path

import numpy as np
import pytest

from quadstep import fly, read_mission

PAGE = Path("docs/controllers.md").read_text(encoding="utf-8")
HOVER = {"type": "step", "start": [0.0, 0.0, 5.0], "end": [0.0, 0.0, 5.0], "duration": 10.0}
TURNING = {"type": "circle", "radius": 2.0, "period": 10.0, "turns": 1.0, "ramp": 0.0, "yaw_rate": np.pi / 4}


@pytest.fixture(scope="module")
def eight():
    """Lesson 10's mission under the cascaded PID, in still air, with nothing late."""
    changes = {"controller": {"type": "pid"}, "sensors": {}, "wind": {}, "path.turns": 2.0}
    return read_mission("docs/lessons/10-real.toml").with_(changes)


@pytest.mark.parametrize(("sensors", "row", "still", "windy"), [
    ({}, "not late", "18", "140"),
    ({"latency": 0.02, "predictor": True}, "20 ms late, with a predictor", "18", "140"),
    ({"latency": 0.02}, "20 ms late, without one", "27", "430"),
])  # fmt: skip
def test_what_a_predictor_saves(sensors, row, still, windy, eight):
    wind = {"mean": [12.0, 0.0, 0.0], "turbulence": {"wind_20": 12.0, "height": 6.0}}
    found = [fly(eight.with_({"sensors": sensors, "wind": air})).metrics()["position_rmse[m]"] for air in ({}, wind)]
    assert [float(f"{1000.0 * one:.2g}") for one in found] == [float(still), float(windy)]
    (line,) = (one for one in PAGE.splitlines() if one.startswith(f"| {row}"))
    assert line.endswith(f" | {still} mm | {windy} mm |")


def test_the_errors_that_nested_saturations_leave(eight):
    nested = eight.with_({"controller": {"type": "nested-saturation"}})
    flight = fly(nested.with_({"path": HOVER, "wind": {"mean": [3.0, 0.0, 0.0]}}))
    off = flight.column("x")[-1] - flight.column("x_d")[-1]
    assert f"({round(1000.0 * off, -1):.0f} mm in a wind of 3 m/s on the 2.6 kg" in PAGE
    rmse = []
    for radius in (1.0, 2.0):
        circle = {"type": "circle", "radius": radius, "period": 2 * np.pi * np.sqrt(radius / 4.905), "turns": 6.0}
        rmse.append(fly(nested.with_({"path": circle})).metrics()["position_rmse[m]"])
    assert f"radius at 0.5 g the error is {round(1000.0 * rmse[0], -1):.0f} and {round(1000.0 * rmse[1], -1):.0f} mm" in PAGE


def test_how_far_a_turning_heading_lags(eight):
    for law, said in (("lqr", "`lqr` 6.3"), ("ardupilot-cascade", "`ardupilot-cascade` 3.6")):
        changes = {"vehicle": {"preset": "x500"}, "path": TURNING, "controller": {"type": law}}
        flight = fly(eight.with_(changes))
        lag = np.degrees(np.unwrap(flight.column("heading_d") - flight.column("yaw")))
        mean = float(np.mean((lag[len(lag) // 2 :] + 180.0) % 360.0 - 180.0))
        assert f"`{law}` {mean:.1f}" == said
        assert said in PAGE
