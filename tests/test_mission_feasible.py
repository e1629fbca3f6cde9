"""What is said of missions that ask for what no vehicle can do, or that are written in other units."""

import re

import numpy as np
import pytest

from quadstep import Engine, Mission, UserError
from quadstep.engines.fly import fly
from quadstep.page.build import flown_files
from tests.commands import write

CIRCLE = {"type": "circle", "centre": [0.0, 0.0, 4.0], "radius": 3.0, "period": 9.0}
HOVER = {"type": "step", "end": [0.0, 0.0, 1.0], "duration": 3.0}


def warnings(path):
    return Mission(vehicle={"preset": "x500"}, path=path).plan().warnings


def test_a_path_that_takes_more_thrust_than_there_is_is_named():
    (said,) = warnings({**CIRCLE, "radius": 5000.0})
    # centripetal acceleration 4 pi^2 r / T^2 = 2437 m/s^2 on 2.28 kg, speed 2 pi r / T = 3491 m/s
    assert said.startswith("path: this vehicle cannot fly it: at ")
    assert "it takes 5,560 N" in said
    assert " of thrust, and all rotors together give at most 48.5 N; the path's greatest speed is 3,490 m/s" in said


def test_a_path_three_times_too_fast_is_named_and_one_that_can_be_flown_is_not():
    assert warnings({**CIRCLE, "period": 1.5})
    assert not warnings(CIRCLE)
    assert not warnings(HOVER)


@pytest.mark.parametrize("seed", range(20))
def test_a_path_below_the_ground_is_named_where_its_flight_goes_there(seed):
    random = np.random.default_rng(seed)
    ground, end, duration = (float(random.uniform(low, high)) for low, high in ((-3.0, 2.0), (-3.0, 3.0), (2.0, 6.0)))
    path = {"type": "minimum-jerk", "start": [0.0, 0.0, 2.0], "end": [1.0, 0.0, end], "duration": 5.0}
    content = {"path": path, "simulation": {"duration": duration}}
    said = Mission(vehicle={"preset": "x500", "ground": ground}, **content).plan().warnings
    low = fly(Mission(vehicle={"preset": "x500"}, **content).plan()).column("z_d").min()
    named = [re.fullmatch(r"path: it goes down to z = (\S+) m, below the ground at (\S+) m", one) for one in said]
    found = [tuple(map(float, one.groups())) for one in named if one]
    assert found == ([(pytest.approx(low, abs=0.01), pytest.approx(ground, abs=1e-5))] if low < ground else [])


def test_the_rest_of_a_path_that_is_not_flown_is_named_unless_it_goes_round():
    late = {**HOVER, "time": 2.0, "end": [3.0, 4.0, 0.0]}
    cut = Mission(vehicle={"preset": "x500"}, path=late, simulation={"duration": 1.5})
    said = "path: the flight ends at 1.5 s (simulation.duration), the path at 3 s, 5 m farther on"
    assert cut.plan().warnings == (said,)
    for path, duration in ((late, 2.5), (late, 3.0), (late, 9.0), (CIRCLE, 5.0)):
        assert not Mission(vehicle={"preset": "x500"}, path=path, simulation={"duration": duration}).plan().warnings


def test_the_paper_vehicle_is_judged_by_the_limits_of_its_rotors():
    fast = {"type": "minimum-jerk", "end": [20.0, 0.0, 0.0], "duration": 1.0}
    assert not Mission(path=fast).plan().warnings
    limited = Mission(path=fast, vehicle={"rotors": {"limits": [0.0, 5.0]}}).plan().warnings
    assert any("cannot fly it" in one for one in limited)


@pytest.mark.parametrize("vehicle", [{}, {"vehicle": {"preset": "x500"}}])
def test_attitudes_in_degrees_are_refused(vehicle):
    with pytest.raises(
        UserError, match=r"start\.attitude: angles are in rad, and 90 is more than a turn; 90 degrees are 1\.571"
    ):
        Mission(**vehicle, path=HOVER, start={"attitude": [90.0, 0.0, 0.0]})


def test_two_missions_of_one_name_are_told_apart(tmp_path):
    text = 'name = "Same"\n[path]\ntype = "step"\nend = [0.0, 0.0, 1.0]\nduration = 1.5\n'
    paths = [write(tmp_path, text, f"{name}.toml") for name in ("first", "second")]
    assert [one.name for one in flown_files(paths, Engine.LANES)] == ["Same (first)", "Same (second)"]
    assert [one.name for one in flown_files(paths[:1], Engine.LANES)] == ["Same"]
