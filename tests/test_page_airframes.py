"""Missions for a real vehicle on the page: flown by JavaScript as by Python, with noise and all."""

import numpy as np
import pytest

from quadstep.engines.eager import fly_floats
from quadstep.interfaces.controller import Measured
from quadstep.mission.multirotor import MultirotorMission
from quadstep.mission.read import check_mission
from quadstep.numbers import Table, flatten
from quadstep.page.controllers import GHOSTS as EVERY_GHOST
from quadstep.page.laws import widened
from tests.pages import data_of, flown, fly_page, needs_node, write_page

GHOSTS = EVERY_GHOST[Measured]
GYRO = {"gyro_noise": 0.01, "gyro_bias": 0.01, "gyro_walk": 0.001}
FIXES = {"position_noise": 0.02, "velocity_noise": 0.02, "attitude_noise": 0.01, "fix_period": 0.01, "latency": 0.02}
NOISE = {**GYRO, "accelerometer_noise": 0.05, "accelerometer_bias": 0.1, **FIXES}
CIRCLE = {"type": "circle", "radius": 2.0, "period": 8.0, "centre": [0.0, 0.0, 5.0]}


def mission(name, **given):
    content = {"name": name, "vehicle": {"preset": "hummingbird"}, "path": CIRCLE, "simulation": {"duration": 0.2}, **given}
    found = check_mission(content, "test")
    assert isinstance(found, MultirotorMission)
    return found


FLIGHTS = {
    "geometric": {},
    "pid": {"controller": {"type": "pid"}},
    "lqr": {"controller": {"type": "lqr"}},
    "rotation-backstepping": {"controller": {"type": "rotation-backstepping"}, "vehicle": {"preset": "x500"}},
    "backstepping": {"controller": {"type": "backstepping"}, "vehicle": {"preset": "paper"}},
    "turbulent": {"wind": {"mean": [3.0, 0.0, 0.0], "turbulence": {"intensity": "light"}}, "seed": 12345678901},
    "noisy": {"sensors": NOISE},
    "estimator": {"sensors": {**NOISE, "estimator": True}},
    "crazyflie": {"vehicle": {"preset": "crazyflie"}},
    "indi": {"controller": {"type": "indi"}, "sensors": NOISE},
    "geometric-l1": {"controller": {"type": "geometric-l1"}},
    "geometric-adaptive": {"controller": {"type": "geometric-adaptive"}},
    "adrc": {"controller": {"type": "adrc"}},
    "super-twisting": {"controller": {"type": "super-twisting"}},
    "flatness": {"controller": {"type": "flatness"}},
    **{
        name: {"controller": {"type": name}, "simulation": {"duration": 0.1}}
        for name in ("nested-saturation", "hedged-backstepping", "hedged-inversion", "filtered-backstepping")
    },
    **{name: {"controller": {"type": name}, "simulation": {"duration": 0.1}} for name in ("planned-lqr", "mpc")},
    "predictor": {"controller": {"type": "flatness"}, "sensors": {**NOISE, "predictor": True}},
}


@pytest.fixture(scope="module")
def missions():
    return {name: mission(name, **given) for name, given in FLIGHTS.items()}


def floats(given):
    """On Python's floats, which need no compiler."""
    plan = given.plan()
    return fly_floats(plan.loop, plan.parameters, plan.start, plan.ticks)


@pytest.fixture(scope="module")
def logs(missions):
    return {name: floats(given) for name, given in missions.items()}


@pytest.fixture(scope="module")
def page(tmp_path_factory, missions, logs):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("quadstep.page.laws.ROOM", 10**8)
        patch.setattr("quadstep.page.controllers.ROOM_FOR_GHOSTS", 10**8)
        return write_page(
            tmp_path_factory.mktemp("page") / "page.html",
            *(flown(name, given, log=logs[name]) for name, given in missions.items()),
        )


@needs_node
@pytest.mark.parametrize("name", FLIGHTS)
def test_javascript_flies_what_python_floats_fly(page, logs, name):
    log = logs[name]
    (answer,) = fly_page(page, {"flight": name})
    assert answer["quick"]
    assert (answer["code"], answer["rows"]) == (log.outcome, len(log.rows))
    scale = np.maximum(np.abs(log.rows).max(axis=0), 1.0)
    assert (np.abs(answer["values"] - log.rows).max(axis=0) / scale).max() < 1e-10


@needs_node
def test_sliders_do_what_the_mission_file_does(page):
    values = {"wind": [1.0, 2.0, -0.5], "mass": [0.6], "period": [6.0], "radius": [1.5], "start": [0.1, 0.2, 0.3],
              "k_x": [5.0, 6.0, 7.0], "believed_mass": [0.7]}  # fmt: skip
    (answer,) = fly_page(page, {"flight": "geometric", "values": values, "rows": False})
    plan = mission(
        "geometric",
        path={**CIRCLE, "period": 6.0, "radius": 1.5},
        wind={"mean": [1.0, 2.0, -0.5]},
        controller={"type": "geometric", "mass": 0.7, "k_x": [5.0, 6.0, 7.0]},
    ).plan()
    parameters = plan.parameters._replace(airframe=plan.parameters.airframe._replace(mass=0.6))
    numbers = [float(leaf) for leaf in flatten(parameters) if not isinstance(leaf, Table)]
    found = dict(zip(answer["names"], answer["parameters"].tolist(), strict=True))
    wanted = dict(zip(answer["names"], numbers, strict=True))
    differing = {name for name in found if found[name] != wanted[name]}
    assert differing == set()
    assert answer["start"][:3] == pytest.approx([1.6, 0.2, 5.3])


@needs_node
@pytest.mark.parametrize("name", ["rotation-backstepping", "backstepping"])
def test_the_number_of_neurons_is_data(tmp_path, missions, logs, name):
    kept = missions[name].controller.nets
    nets = {"neurons": 4, "kappa1": kept.kappa1, "kappa2": kept.kappa2}
    other = mission("other", **{**FLIGHTS[name], "controller": {"type": name, "nets": nets}})
    ten = flown("ten", missions[name], log=logs[name])
    path = write_page(tmp_path / "page.html", ten, flown("other", other, log=floats(other)))
    moved, drawn = fly_page(path, {"flight": "ten", "values": {"neurons": [4]}}, {"flight": "other"})
    assert moved["values"].tobytes() == drawn["values"].tobytes()
    gains = other.plan().parameters.gains
    assert flatten(widened(gains, 1)) == flatten(widened(missions[name].plan().parameters.gains, 1))


def test_what_the_page_is_told_of_a_real_vehicle(page):
    flights = {flight["id"]: flight for flight in data_of(page.read_text())["flights"]}
    assert [flight["whyNot"] for flight in flights.values()] == [""] * len(FLIGHTS)
    for name, flight in flights.items():
        kinds = [controller["id"] for controller in flight["controllers"]]
        assert len(kinds) == len(set(kinds))
        if name == "planned-lqr":  # it plans in a loop that no other controller has
            assert kinds == [name]
            continue
        assert len(kinds) >= len(GHOSTS)
        assert set(GHOSTS) <= {*kinds, FLIGHTS[name].get("controller", {}).get("type")}
        own = [control for one in flight["controllers"] for control in one["controls"]]
        assert all(len(control["hint"]) > 5 for control in (*flight["controls"], *own))
        scene = flight["scene"]
        assert scene["attitude"] == {"kind": "quaternion", "columns": ["q_w", "q_x", "q_y", "q_z"]}
        assert [rotor["force"] for rotor in scene["rotors"]] == ["f1", "f2", "f3", "f4"]
        assert sum(rotor["spin"] for rotor in scene["rotors"]) == 0
        assert scene["arrows"][0]["columns"] == ["wind_x", "wind_y", "wind_z"]
        assert {"position", "attitude", "thrust-made", "torque", "rotors", "wind"} <= {
            panel["id"] for panel in flight["panels"]
        }
    paper = flights["backstepping"]["controllers"][0]
    assert {condition["source"] for condition in paper["conditions"]} == {"Theorem 5.1", "repaired theorem (at hover)"}
    names = set(data_of(page.read_text())["laws"][paper["law"]]["names"])

    def named(term):
        return {term["name"]} if isinstance(term, dict) and "name" in term else set().union(
            *(named(part) for part in term["of"])) if isinstance(term, dict) else set()  # fmt: skip

    assert all(named(condition["left"]) | named(condition["right"]) <= names for condition in paper["conditions"])


@needs_node
@pytest.mark.parametrize("mean", [[8.0, 0.0, 0.0], [1.25, -3.3, -1.91], [0.0, 0.0, 0.0]])
def test_turbulence_follows_the_wind_that_carries_it(tmp_path, mean):
    wind = {"mean": [6.0, 0.0, 0.0], "turbulence": {"wind_20": 8.0}}
    path = write_page(tmp_path / "page.html", flown("windy", mission("windy", wind=wind)))
    (answer,) = fly_page(path, {"flight": "windy", "values": {"wind": mean}})
    np.testing.assert_array_equal(answer["values"], floats(mission("windy", wind={**wind, "mean": mean})).rows)
