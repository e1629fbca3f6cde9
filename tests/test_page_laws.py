"""A flight in JavaScript is the flight of the Python engine."""

import numpy as np
import pytest

from quadstep.engines.eager import fly_floats
from quadstep.engines.fly import fly
from quadstep.interfaces.closed_loop import Outcome
from quadstep.numbers import Table, flatten
from quadstep.page.laws import NEURONS, Laws, neurons, widened
from quadstep.studies.paper.cases import adaptive, case_1, case_3, nested, stress
from tests.pages import FLIGHTS, flown, fly_page, mission, needs_node, write_page


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    flights = [flown(name, given) for name, given in FLIGHTS.items()]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("quadstep.page.laws.ROOM", 10**8)  # for the WebAssembly of all
        return write_page(tmp_path_factory.mktemp("page") / "page.html", *flights)


@pytest.fixture(scope="module")
def answers(page):
    return dict(zip(FLIGHTS, fly_page(page, *({"flight": name.replace(" ", "-")} for name in FLIGHTS)), strict=True))


def agree(answer, log):
    """Equal in every number."""
    assert (answer["code"], answer["rows"]) == (log.outcome, len(log.rows))
    assert answer["tick"] * answer["ticks"]["step"] == log.ended
    differing = (answer["values"] != log.rows).sum(axis=0)
    assert {name: count for name, count in zip(log.columns, differing, strict=True) if count} == {}


@needs_node
@pytest.mark.parametrize("name", FLIGHTS)
def test_javascript_flies_what_python_floats_fly(answers, name):
    plan = FLIGHTS[name].plan()
    log = fly_floats(plan.loop, plan.parameters, plan.start, plan.ticks)
    assert log.outcome is Outcome.COMPLETED
    agree(answers[name], log)
    assert answers[name]["quick"]
    assert [column for column, _ in answers[name]["columns"]] == list(plan.loop.columns)


@needs_node
def test_the_whole_of_case_1_is_the_same_in_every_column(tmp_path):
    given = case_1()
    plan = given.plan()
    (answer,) = fly_page(write_page(tmp_path / "page.html", flown("case1", given)), {"flight": "case1"})
    agree(answer, fly(plan))  # which flies what floats fly: test_engines_agreement


ENDS = {
    "spinning": stress(3.0, 1.0),
    "off the path": mission(path={"type": "minimum-jerk", "end": [20.0, 5.0, 10.0], "duration": 40.0},
                            start={}, simulation={"duration": 10.0}, disturbance={"scale": 0.0},
                            controller={"type": "backstepping", "Lambda2": 0.5, "K_r2": 6.0}),
    "singular": mission(start={"attitude": [0.0, 1.5, 0.0], "rates": [0.0, 20.0, 0.0]}),
    "no longer finite": mission(controller={**adaptive(), "filter_frequency": 1e9, "K_r2": 1e9, "Lambda2": 1e9}),
}  # fmt: skip


@needs_node
def test_a_diverging_flight_ends_as_in_python(tmp_path):
    path = write_page(tmp_path / "page.html", *(flown(name, given) for name, given in ENDS.items()))
    found = fly_page(path, *({"flight": name.replace(" ", "-")} for name in ENDS))
    outcomes = []
    for answer, given in zip(found, ENDS.values(), strict=True):
        plan = given.plan()
        log = fly(plan)
        assert (answer["code"], answer["tick"], answer["rows"]) == (
            log.outcome,
            round(log.ended / plan.ticks.step),
            len(log.rows),
        )
        assert answer["quick"] and np.isfinite(answer["values"]).all()
        outcomes.append(log.outcome)
    assert {Outcome.SPINNING, Outcome.OFF_PATH, Outcome.SINGULAR} <= set(outcomes)


@needs_node
def test_flights_leave_nothing_behind_for_the_next(page):
    requests = [{"flight": "backstepping"}, {"flight": "completed"}, {"flight": "backstepping", "values": {"K_r1": [9, 9, 9]}}]
    first, _, changed, again = fly_page(page, *requests, {"flight": "backstepping"})
    assert first["values"].tobytes() == again["values"].tobytes() != changed["values"].tobytes()


@needs_node
def test_the_other_controllers_fly_the_mission_too(page):
    found = fly_page(page, *({"flight": "backstepping", "controller": place} for place in range(3)))
    own, completed, nested_one = (answer["values"] for answer in found)
    assert [answer["code"] for answer in found] == [0, 0, 0]
    given = FLIGHTS["backstepping"]
    for values, kind in ((completed, "completed-backstepping"), (nested_one, "nested-saturation")):
        plan = given.model_copy(update={"controller": mission(controller={"type": kind}).controller}).plan()
        log = fly_floats(plan.loop, plan.parameters, plan.start, plan.ticks)
        np.testing.assert_array_equal(values, log.rows)
        assert np.abs(values - own).max() > 1e-3


def test_neurons_beyond_those_of_the_file_are_drawn_as_a_larger_net_would_draw_them():
    small, large = (mission(controller=adaptive(neurons=count, seed=5)).plan().parameters.gains for count in (4, NEURONS))
    assert flatten(widened(small, 5)) == flatten(large)


def test_each_neuron_knows_all_that_switches_it_off():
    plan = FLIGHTS["completed"].plan()
    laws = Laws()
    laws.add(plan)
    names = laws.laws["law0"].names
    listed = neurons(names)
    assert len(listed) == 10
    shown = [{names[place]: value for place, value in zip(*one.values(), strict=True)} for one in listed]
    assert shown[7]["gains.paper.force_net.input_weights.7.12"] == -1e4
    assert shown[7]["gains.paper.torque_net.input_weights.7.9"] == -1e4
    assert shown[7]["gains.paper.weights_2.7.2"] == 0.0
    assert len(shown[7]) == 13 + 10 + 6
    assert list(shown[7].values()).count(-1e4) == 2


def test_one_structure_is_compiled_once_and_a_path_by_its_size():
    laws = Laws()
    numbers = [
        laws.add(given.plan()) for given in (case_1(), case_1(duration=3.0), stress(6.0, 5.0, seed=9), case_3(nested()))
    ]
    assert [one.law for one in numbers] == ["law0", "law0", "law0", "law1"]
    assert numbers[0].overrides == ()
    assert [value for _, value in numbers[1].overrides] == [3.0]
    tables = [leaf for leaf in flatten(FLIGHTS["waypoints"].plan().parameters) if isinstance(leaf, Table)]
    laws.add(FLIGHTS["waypoints"].plan())
    again = laws.add(FLIGHTS["waypoints"].plan())
    assert again.law == "law2"
    assert len(again.tables) == len(tables) == len(laws.laws["law2"].tables)
    assert len(laws.tables) <= len(tables)  # equal ones are kept once
