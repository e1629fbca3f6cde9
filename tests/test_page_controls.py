"""A slider of the page does what the same key of a mission file does."""

import math
from typing import NamedTuple

import numpy as np
import pytest

from quadstep.control.registry import STOCK
from quadstep.engines.eager import fly_floats
from quadstep.mission.schema import Mission
from quadstep.numbers import Matrix, Table, Vector, flatten, leaf_names, vector
from quadstep.page.controllers import page_conditions, plain_sliders
from quadstep.page.laws import widened
from quadstep.proofs.certify.lyapunov import conditions
from quadstep.studies.paper.cases import adaptive, nested
from tests.pages import data_of, flown, fly_page, needs_node, value_of, write_page

LINE = {"type": "minimum-jerk", "end": [4.0, 1.0, 2.0], "duration": 6.0}
CIRCLE = {"type": "circle", "centre": [1.0, 0.0, 5.0], "radius": 3.0, "period": 8.0, "clockwise": True}
EIGHT = {"type": "figure-eight", "length": 6.0, "width": 3.0, "period": 9.0, "plane": "vertical"}
PAPER, COMPLETED = {"type": "backstepping"}, {"type": "completed-backstepping"}

# base mission, values of controls, the mission file that says the same
SAME = {
    "nothing": ({}, {}, {}),
    "gains": (
        {},
        {"K_r1": [4.0, 5.0, 6.0], "Lambda1": [0.9] * 3, "K_i1": [0.0, 0.1, 0.2], "K_r2": [200.0] * 3,
         "Lambda2": [9.0, 8.0, 7.0], "K_i2": [1.0, 2.0, 3.0], "filter_frequency": [60.0]},
        {"controller": {**PAPER, "K_r1": [4.0, 5.0, 6.0], "Lambda1": 0.9, "K_i1": [0.0, 0.1, 0.2], "K_r2": 200.0,
                        "Lambda2": [9.0, 8.0, 7.0], "K_i2": [1.0, 2.0, 3.0], "filter_frequency": 60.0}},
    ),
    "nets": (
        {},
        {"nets_start": [2.0], "F1": [1.0], "F2": [2.0], "kappa1": [0.1], "kappa2": [0.2]},
        {"controller": adaptive(start=2.0, F1=1.0, F2=2.0, kappa1=0.1, kappa2=0.2)},
    ),
    "nets off": ({}, {"nets": [0]}, {"controller": adaptive(enabled=False)}),
    "nets on": ({"controller": adaptive(enabled=False, start=1.5)}, {"nets": [1]}, {"controller": adaptive(start=1.5)}),
    "line": (
        {},
        {"target": [1.0, -2.0, 3.0], "t_f": [4.0], "yaw_end": [0.5]},
        {"path": {**LINE, "end": [1.0, -2.0, 3.0], "duration": 4.0, "yaw_end": 0.5}},
    ),
    "line, held": (
        {"simulation": {"duration": 9.0}},
        {"t_f": [4.0]},
        {"path": {**LINE, "duration": 4.0}, "simulation": {"duration": 7.0}},
    ),
    "circle": (
        {"path": CIRCLE},
        {"radius": [2.0], "period": [5.0]},
        {"path": {**CIRCLE, "radius": 2.0, "period": 5.0}},
    ),
    "circle of a given duration": (
        {"path": CIRCLE, "simulation": {"duration": 4.0}},
        {"period": [5.0]},
        {"path": {**CIRCLE, "period": 5.0}, "simulation": {"duration": 4.0}},
    ),
    "figure eight": (
        {"path": EIGHT},
        {"size": [8.0, 2.0], "period": [12.0]},
        {"path": {**EIGHT, "length": 8.0, "width": 2.0, "period": 12.0}},
    ),
    "mass and inertia": (
        {"controller": {**PAPER, "mass": 1.0}},
        {"mass": [1.3], "inertia": [0.8], "believed_mass": [0.9]},
        {"vehicle": {"mass": 1.3, "inertia": [4.0, 4.0, 4.0]}, "controller": {**PAPER, "mass": 0.9}},
    ),
    "rotor limits": (
        {"vehicle": {"rotors": {"limits": [0.0, 10.0]}}},
        {"limits": [0.5, 6.0]},
        {"vehicle": {"rotors": {"limits": [0.5, 6.0]}}},
    ),
    "disturbance": (
        {},
        {"disturbance": [3.0], "wind": [0.5, -0.2, 0.1], "torque": [0.1, 0.2, 0.3]},
        {"disturbance": {"scale": 3.0, "force": [0.5, -0.2, 0.1], "torque": [0.1, 0.2, 0.3]}},
    ),
    "start": (
        {},
        {"start": [0.5, -0.5, 0.25], "tilt": [0.3, 0.1, -0.1]},
        {"start": {"position": [0.5, -0.5, 0.25], "attitude": [0.3, 0.1, -0.1]}},
    ),
    "completed": (
        {"controller": COMPLETED},
        {"P": [1.0, 2.0, 3.0], "weight_bounds": [5.0, 6.0], "integral_bounds": [7.0, 8.0], "believed_inertia": [4.0, 5.0, 6.0],
         "K_r1": [4.0] * 3, "F2": [1.0]},
        {"controller": {**COMPLETED, "P": [1.0, 2.0, 3.0], "weight_bounds": [5.0, 6.0], "integral_bounds": [7.0, 8.0],
                        "inertia": [4.0, 5.0, 6.0], "K_r1": 4.0, "nets": {"F2": 1.0}}},
    ),
    "nested": (
        {"controller": nested()},
        {"a_z": [2.0, 0.4], "a_psi": [1.0, 0.1], "bounds": [4.0, 1.5, 0.5, 0.2], "believed_mass": [1.1],
         "believed_inertia": [4.0, 5.0, 6.0]},
        {"controller": nested(a_z=[2.0, 0.4], a_psi=[1.0, 0.1], bounds=[4.0, 1.5, 0.5, 0.2], mass=1.1,
                              inertia=[4.0, 5.0, 6.0])},
    ),
}  # fmt: skip


def mission(sections):
    return Mission.model_validate({"name": "test", "path": LINE, **sections})


@pytest.fixture(scope="module")
def answers(tmp_path_factory):
    """What each change on the page comes to, its own values not flown for longer than needed."""
    path = tmp_path_factory.mktemp("page") / "page.html"
    write_page(path, *(flown(name, mission(base)) for name, (base, _, _) in SAME.items()))
    found = fly_page(path, *({"flight": slug(name), "values": values, "rows": False} for name, (_, values, _) in SAME.items()))
    return dict(zip(SAME, found, strict=True))


def slug(name):
    return name.replace(" ", "-")


@needs_node
@pytest.mark.parametrize("name", SAME)
def test_a_slider_does_what_the_mission_file_does(answers, name):
    base, _, changes = SAME[name]
    answer, wanted = answers[name], mission({**base, **changes})
    plan = wanted.plan()
    gains = plan.parameters.gains
    if hasattr(wanted.controller, "nets"):
        plan = plan._replace(parameters=plan.parameters._replace(gains=widened(gains, wanted.controller.nets.seed)))
        listed = without_further_neurons(answer, wanted.controller.nets.neurons)
    else:
        listed = answer["parameters"]
    numbers = np.array([float(leaf) for leaf in flatten(plan.parameters) if not isinstance(leaf, Table)])
    differing = {
        place: pair
        for place, *pair in zip(answer["names"], listed.tolist(), numbers.tolist(), strict=True)
        if pair[0] != pytest.approx(pair[1], rel=1e-15)
    }
    assert {place: pair for place, pair in differing.items() if not is_unused(place, wanted)} == {}
    np.testing.assert_allclose(answer["start"], np.array([float(leaf) for leaf in flatten(plan.start)]), rtol=0, atol=1e-15)
    assert answer["ticks"] == {**plan.ticks._asdict(), "every": list(plan.ticks.every)}


def without_further_neurons(answer, count):
    """The parameters; neurons beyond `count` must be off."""
    values = dict(zip(answer["names"], answer["parameters"].tolist(), strict=True))
    for name, value in values.items():
        parts = name.split(".")
        if ("input_weights" in parts or parts[-3:-2] in (["weights_1"], ["weights_2"])) and int(parts[-2]) >= count:
            assert value in (0.0, -1e4), name
    return np.array(list(values.values()))


def is_unused(name, given):
    parts = name.split(".")
    return "input_weights" in parts and int(parts[-2]) >= given.controller.nets.neurons


@needs_node
@pytest.mark.parametrize("count", [1, 8, 10, 16])
def test_the_number_of_neurons_is_data_and_exact(tmp_path, count):
    base = {"simulation": {"duration": 0.5}, "start": {"attitude": [0.0, 0.2, 0.1]}}
    path = write_page(tmp_path / "page.html", flown("ten", mission({**base, "controller": adaptive(seed=3)})),
                      flown("other", mission({**base, "controller": adaptive(seed=3, neurons=count)})))  # fmt: skip
    moved, drawn = fly_page(path, {"flight": "ten", "values": {"neurons": [count]}}, {"flight": "other"})
    assert moved["values"].tobytes() == drawn["values"].tobytes()
    plan = mission({**base, "controller": adaptive(seed=3, neurons=count)}).plan()
    wanted = fly_floats(plan.loop, plan.parameters, plan.start, plan.ticks).rows
    np.testing.assert_allclose(moved["values"], wanted, rtol=1e-12, atol=1e-12)
    ten = fly_page(path, {"flight": "ten"})[0]
    assert (ten["values"].tobytes() == drawn["values"].tobytes()) == (count == 10)


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "page.html"
    return data_of(write_page(path, *(flown(name, mission(base)) for name, (base, _, _) in SAME.items())).read_text())


def test_every_control_is_within_its_bounds_and_acts_on_what_there_is(data):
    for flight in data["flights"]:
        for controller in flight["controllers"]:
            law = data["laws"][controller["law"]]
            known = {"parameter": law["names"], "start": law["starts"], "duration": [""]}
            controls = [*flight["controls"], *controller["controls"]]
            assert len({control["id"] for control in controls}) == len(controls)
            for control in controls:
                values = [component["value"] for component in control["components"]]
                assert control["low"] <= control["min"] < control["max"] <= control["high"], control["id"]
                assert all(control["min"] <= value <= control["max"] for value in values), control["id"]
                assert control["scale"] == "linear" or control["min"] > 0
                assert control["step"] > 0
                for component in control["components"]:
                    assert all(effect["name"] in known[effect["what"]] for effect in component["sets"]), control["id"]
                    assert component["sets"] or control["kind"] == "neurons"


def test_a_page_has_every_slider_the_issue_names(data):
    flight = data["flights"][0]
    shared = {control["id"] for control in flight["controls"]}
    assert {"t_f", "target", "mass", "inertia", "disturbance", "wind", "start", "tilt"} <= shared
    own = {control["id"] for control in flight["controllers"][0]["controls"]}
    assert {"Lambda1", "K_r1", "K_i1", "Lambda2", "K_r2", "K_i2", "filter_frequency", "nets", "neurons", "F1", "F2", "kappa1",
            "kappa2", "believed_mass"} <= own  # fmt: skip
    hints = {control["id"]: control["hint"] for control in flight["controllers"][0]["controls"]}
    assert hints["F1"] == "Learning rate of net 1 (Eq. 54)." and hints["kappa2"].startswith("Damping of the weights of net 2")
    assert len(flight["controllers"]) == 3


GAIN_SETS = {
    "the study's": {},
    "K_r1 too small": {"K_r1": [3.0, 0.9, 3.0]},
    "K_r2 too small": {"K_r2": [250.0, 140.0, 250.0]},
    "Lambda2 of one axis": {"Lambda2": [15.0, 15.0, 26.0]},
    "the printed conditions only": {"Lambda2": 0.5, "K_r2": 6.0},
}


@pytest.mark.parametrize("name", GAIN_SETS)
def test_the_badge_says_what_the_mission_warns_of(data, name):
    given = mission({"controller": {**PAPER, **GAIN_SETS[name]}})
    plan = given.plan()
    parameters = dict(zip(leaf_names(plan.parameters), flatten(plan.parameters), strict=True))
    found = page_conditions(plan.loop.controller, plan, given.vehicle.model())
    broken = [one for one in found if not value_of(one.left, parameters) > value_of(one.right, parameters)]
    of_theorem = [one for one in broken if one.source == "Theorem 5.1"]
    assert len(of_theorem) == len(plan.warnings)
    assert len(found) == 7
    assert (len(broken) > len(of_theorem)) == (name != "the study's")


def test_the_coupling_condition_is_that_of_the_certificate():
    given = mission({"controller": {**PAPER, "Lambda2": 0.5, "K_r2": 6.0}})
    plan = given.plan()
    parameters = dict(zip(leaf_names(plan.parameters), flatten(plan.parameters), strict=True))
    coupling = page_conditions(plan.loop.controller, plan, given.vehicle.model())[-1]
    assert math.sqrt(value_of(coupling.left, parameters)) == pytest.approx(2 * 0.5 * math.sqrt(2.0 * 1.0))
    assert math.sqrt(value_of(coupling.right, parameters)) == pytest.approx(9.81)


def test_conditions_are_those_of_the_vehicle_whose_mass_the_controller_gets_wrong():
    given = mission({"vehicle": {"mass": 2.0}, "controller": {**PAPER, "mass": 1.0, "K_r1": 3.0, "Lambda1": 2.0}})
    plan = given.plan(warn=False)
    parameters = dict(zip(leaf_names(plan.parameters), flatten(plan.parameters), strict=True))
    first, *_ = page_conditions(plan.loop.controller, plan, given.vehicle.model())
    still = np.array([np.eye(3)])
    surplus = conditions(plan, still, np.array([9.81])).position[0]  # K_r1 - m Lambda1: 3 - 2 * 2
    assert value_of(first.left, parameters) - value_of(first.right, parameters) == pytest.approx(surplus) == -1.0


class Unknown(NamedTuple):
    """Gains that declare nothing."""

    k_p: Vector
    most_speed: float
    table: Matrix


def test_gains_of_an_unknown_controller_get_plain_sliders():
    gains = Unknown(vector(1.0, 2.0, 3.0), 4.0, Matrix([vector(1.0, 2.0)]))
    found = {control.id: control for control in plain_sliders(gains)}
    assert set(found) == {"k_p", "most_speed"}
    assert [one.sets[0].name for one in found["k_p"].components] == ["gains.k_p.0", "gains.k_p.1", "gains.k_p.2"]
    assert (found["k_p"].label, found["most_speed"].label) == ("k_p", "most speed")
    zeros = plain_sliders(gains._replace(k_p=vector(0.0, 1.0, 2.0)))
    assert next(control for control in zeros if control.id == "k_p").min < 0.0


@pytest.mark.parametrize("name", STOCK)
def test_parameters_of_an_autopilot_that_contradict_each_other_are_broken_conditions(name):
    given = Mission(vehicle={"preset": "crazyflie"}, path=LINE, controller={"type": name})
    plan = given.plan(warn=False)
    parameters = dict(zip(leaf_names(plan.parameters), flatten(plan.parameters), strict=True))
    law = plan.loop.controller
    found = page_conditions(law, plan, given.vehicle.model())
    assert len(found) == len(law.ordered)
    for one, text in zip(found, law.ordered, strict=True):
        lower, _, upper = (law.by_key()[key][0] if key in law.by_key() else key for key in text.split())

        def holds(least, most, one=one, lower=f"gains.{lower}", upper=f"gains.{upper}"):
            values = {**parameters, lower: least, upper: most}
            sides = value_of(one.left, values), value_of(one.right, values)
            return sides[0] >= sides[1] if one.orEqual else sides[0] > sides[1]

        assert holds(1.0, 2.0)
        assert not holds(2.0, 1.0)
        assert holds(2.0, 0.0)  # 0 is off
        assert holds(2.0, 2.0) == ("<=" in text)
