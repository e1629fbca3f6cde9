"""What a flight draws at random is what its mission says: `Nothing else varies but the turbulence` has to be true."""

import ast
import sys
from pathlib import Path

import pytest

import quadstep
from quadstep import Mission
from quadstep.engines.eager import fly_floats
from quadstep.numbers import noise

SOURCE = Path(quadstep.__file__).parent

SOURCES = {
    "world/air.py": ("the turbulence", {"wind": {"turbulence": {"wind_20": 8.0, "height": 6.0}}}),
    "sensing/sensors.py": ("the sensors' noise", {"sensors": {"gyro_noise": 0.01}}),
    "control/mppi.py": ("the law's samples", {"controller": {"type": "mppi"}}),
}
"""What draws in flight, how a mission calls it, and what switches it on."""

BETWEEN = {"studies/campaign/draws.py", "studies/rare/mixture.py", "own.py"}
"""What draws between flights, and what only hands on the function to a user's own code."""


def test_whatever_can_draw_is_known():
    drawing = {
        path.relative_to(SOURCE).as_posix()
        for path in SOURCE.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.ImportFrom) and {"draw", "normals", "uniforms"} & {one.name for one in node.names}
        and node.module in ("quadstep.numbers.noise", "quadstep.numbers")
    }  # fmt: skip
    assert drawing == {*SOURCES, *BETWEEN}


@pytest.mark.parametrize("there", [[], *([file] for file in SOURCES), [*SOURCES]])
def test_a_mission_names_what_its_flight_draws(there, monkeypatch):
    files, plain = set(), noise.draw

    def draw(*given):
        frame = sys._getframe(1)
        while frame.f_code.co_filename == noise.__file__:
            frame = frame.f_back
        files.add(Path(frame.f_code.co_filename).relative_to(SOURCE).as_posix())
        return plain(*given)

    monkeypatch.setattr(noise, "draw", draw)
    tables = {key: table for file in there for key, table in SOURCES[file][1].items()}
    path = {"type": "step", "end": [0.0, 0.0, 1.0], "time": 0.01, "duration": 0.03}
    mission = Mission(vehicle={"preset": "research-2.6kg"}, path=path, **{"controller": {"type": "geometric"}, **tables})
    plan = mission.plan()
    fly_floats(plan.loop, plan.parameters, plan.start, plan.ticks)
    assert files == set(there)
    assert mission.random == [SOURCES[file][0] for file in there]
