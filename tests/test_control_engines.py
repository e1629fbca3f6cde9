"""Laws with loops, noise and policies fly alike on every engine, to the bit: arrays, lanes, JavaScript, PTX's program, f32."""

import numpy as np
import pytest

from quadstep.control.registry import BUILT_IN, STOCK
from quadstep.engines.eager import fly_floats
from quadstep.engines.gpu_sweep import GpuSweep, ptx
from quadstep.engines.kernel import fly_lanes
from quadstep.engines.scored import scored
from quadstep.engines.sweep import Sweep, places
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.controller import Measured
from quadstep.mission.read import check_mission
from tests.array_flights import fly_arrays
from tests.fake_driver import installed
from tests.needs import GRAPHICS, POLICY, needs, without
from tests.pages import flown, fly_page, needs_node, write_page
from tests.sweeps import table

PATH = {"type": "circle", "radius": 1.0, "period": 4.0, "centre": [0.0, 0.0, 5.0], "ramp": 1.0, "yaw": 0.3}
LAWS = ("mpc", "mppi", "raptor")
EVERY = pytest.mark.parametrize("law", LAWS)
STOCK_TOO = pytest.mark.parametrize("law", (*LAWS, *STOCK))
LARGEST = "ardupilot-cascade"
ONE_STOCK_TOO = pytest.mark.parametrize(
    "law", (*LAWS, *(pytest.param(one, marks=() if one == LARGEST else pytest.mark.thorough) for one in STOCK))
)
"""Arrays and lanes of autopilots' laws are flown in `tests/test_airframe_loop.py`."""


def mission(law, **content):
    if law == "raptor" and not POLICY.here():
        without(POLICY)
    start = {"position": [0.2, -0.1, 5.1], "velocity": [0.3, 0.0, -0.2], "attitude": [0.3, 0.1, -0.1]}
    content = {"simulation": {"duration": 0.05}} | content
    return check_mission(
        {
            "name": law,
            "vehicle": {"preset": "x500"},
            "path": PATH,
            "start": start,
            "controller": {"type": law},
            **content,
        },
        "test",
    )


@EVERY
def test_arrays_and_lanes_fly_what_floats_fly(law):
    plan = mission(law).plan()
    floats = fly_floats(plan.loop, plan.parameters, plan.start, plan.ticks)
    (arrays,) = fly_arrays(plan.loop, [plan.parameters], [plan.start], plan.ticks)
    (lanes,) = fly_lanes(plan.loop, [plan.parameters], [plan.start], plan.ticks)
    np.testing.assert_array_equal(arrays.rows, floats.rows)
    np.testing.assert_array_equal(lanes.rows, floats.rows)
    (single,) = fly_lanes(plan.loop, [plan.parameters], [plan.start], plan.ticks, double=False)
    np.testing.assert_allclose(single.rows, floats.rows, rtol=1e-3, atol=1e-2)


@needs_node
@STOCK_TOO
def test_javascript_flies_what_floats_fly(law, tmp_path, monkeypatch):
    monkeypatch.setattr("quadstep.page.controllers.ROOM_FOR_GHOSTS", 0)
    given = mission(law)
    plan = given.plan()
    (answer,) = fly_page(write_page(tmp_path / "page.html", flown(law, given)), {"flight": law})
    log = fly_floats(plan.loop, plan.parameters, plan.start, plan.ticks)
    said = [place for place, name in enumerate(plan.loop.columns) if name in log.columns]  # RAPTOR wants no attitude
    np.testing.assert_array_equal(answer["values"][:, said], log.rows)


def threads_and_lanes(content, rows, double=True):
    plan = content.plan()
    loop, ticks = scored(plan.loop, plan.ticks, 0.02)
    varying = places(plan.start, plan.parameters, ["start.position.0", "parameters.airframe.mass"])
    return [table(engine(loop, ticks, plan.start, plan.parameters, varying, double).fly(rows)) for engine in (GpuSweep, Sweep)]


@ONE_STOCK_TOO
def test_threads_of_a_graphics_processor_fly_what_lanes_fly(law, monkeypatch):
    driver = installed(monkeypatch)
    got, wanted = threads_and_lanes(mission(law), np.array([[0.1, 2.0], [0.3, 2.2], [-0.2, 1.9]]))
    np.testing.assert_array_equal(got, wanted)
    assert not driver.problems


WIND = {"mean": [4.0, 1.0, 0.0], "turbulence": {"intensity": "moderate", "height": 10.0}}
SENSORS = {"position_noise": 0.002, "gyro_noise": 0.002, "latency": 0.01}


@needs(GRAPHICS)
@pytest.mark.parametrize("law", BUILT_IN[Measured])
def test_a_graphics_processor_flies_what_lanes_fly(law):
    rows = np.random.default_rng(2).uniform((-0.3, 1.8), (0.3, 2.4), (256, 2))
    rows[7, 0] = 500.0  # lost: too far from the path
    given = mission(law, simulation={"duration": 2.0}, wind=WIND, sensors=SENSORS)
    for double in (True, False):
        got, wanted = threads_and_lanes(given, rows, double)
        np.testing.assert_array_equal(got, wanted)
        assert got[7, 0] != Outcome.COMPLETED


@ONE_STOCK_TOO
def test_loops_are_written_as_ptx(law):
    plan = mission(law).plan()
    text = ptx(scored(plan.loop, plan.ticks, 0.02)[0], plan.start, plan.parameters, frozenset(), double=True)
    assert ".target sm_90" in text
