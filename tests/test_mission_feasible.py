"""What is said of missions that ask for what no vehicle can do, or that are written in other units."""

import pytest

from quadstep import Engine, Mission, UserError
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
    assert "it takes 5560 N" in said
    assert " of thrust, and all rotors together give at most 48.5 N; the path's greatest speed is 3.49e+03 m/s" in said


def test_a_path_three_times_too_fast_is_named_and_one_that_can_be_flown_is_not():
    assert warnings({**CIRCLE, "period": 1.5})
    assert not warnings(CIRCLE)
    assert not warnings(HOVER)


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
