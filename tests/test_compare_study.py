"""A study file: the runs it expands to, what every controller knows, and what is refused."""

from collections import Counter
from operator import itemgetter
from pathlib import Path

import numpy as np
import pytest

from quadstep import UserError
from quadstep.control.cascaded_pid import CascadedPid
from quadstep.control.registry import STOCK, names
from quadstep.export import arm
from quadstep.export.c.compiled import exported
from quadstep.export.law_sheet import CLOCKS, instructions
from quadstep.export.run import c99_files
from quadstep.interfaces.closed_loop import Clock
from quadstep.interfaces.controller import Measured
from quadstep.io.documents import read_json
from quadstep.numbers import flatten
from quadstep.studies.campaign.draws import draw
from quadstep.studies.campaign.planner import planner
from quadstep.studies.comparison import cost, robustness, schema, training
from quadstep.studies.comparison.cells import FIRST, Situation, read_study, shipped_study, together
from tests.commands import LINE, write
from tests.needs import CORTEX_M, needs
from tests.studies import BODY, HEAD, OPTIONAL, SMALL, TUNING, study

VEHICLE = "research-2.6kg"


def test_every_vehicle_path_and_scenario_that_suit_one_another_are_a_situation():
    text = SMALL.replace('["research-2.6kg"]', '["research-2.6kg", "crazyflie"]') + (
        '[paths.far]\nvehicles = ["crazyflie"]\nmission = { path = { type = "step", end = [1.0, 0.0, 0.3] } }\n'
        '[scenarios.storm]\npaths = ["up"]\nvehicles = ["research-2.6kg"]\n'
    )
    assert [tuple(one) for one in study(text).situations()] == [
        (VEHICLE, "up", "calm"),
        (VEHICLE, "up", "windy"),
        (VEHICLE, "up", "storm"),
        ("crazyflie", "up", "calm"),
        ("crazyflie", "up", "windy"),
        ("crazyflie", "far", "calm"),
        ("crazyflie", "far", "windy"),
    ]


def test_a_scenario_lies_on_top_of_the_path_and_that_on_top_of_what_is_common():
    lowest, middle, top = {"a": {"b": 1, "c": 2}, "d": [1]}, {"a": {"c": 3}}, {"d": [2], "e": 4}
    assert together(lowest, middle, top) == {"a": {"b": 1, "c": 3}, "d": [2], "e": 4}
    assert lowest == {"a": {"b": 1, "c": 2}, "d": [1]}


def test_every_controller_flies_the_same_draws_and_noise():
    one = study()
    there, entries = Situation(VEHICLE, "up", "windy"), one.file.controllers
    cells = [one.cell(there, name, entry.controller) for name, entry in entries.items()]
    values = [draw(cell.campaign.file, np.arange(FIRST, FIRST + 5))["vehicle.mass"].values for cell in cells]
    assert values[0].tolist() == values[1].tolist()
    assert len(set(values[0].tolist())) == 5
    plans = [planner(cell.campaign).plan({"vehicle.mass": 2.5}, FIRST) for cell in cells]
    assert flatten(plans[0].parameters.key) == flatten(plans[1].parameters.key)
    assert flatten(plans[0].parameters.wind) == flatten(plans[1].parameters.wind)


def test_a_controller_knows_the_vehicle_as_its_makers_do_whatever_the_scenario():
    one = study()
    table = one.knowing(VEHICLE, {"type": "geometric", "k_x": 3.0})
    assert (table["mass"], table["k_x"]) == (2.644, 3.0)
    cell = one.cell(Situation(VEHICLE, "up", "windy"), "firm", table)
    heavy, light = (planner(cell.campaign).plan({"vehicle.mass": mass}).parameters for mass in (2.9, 2.4))
    assert heavy.airframe.mass == 2.9
    assert flatten(heavy.gains) == flatten(light.gains)


def test_flights_that_are_reported_are_none_that_gains_were_tuned_on():
    one = study(SMALL.replace("[controllers.firm]", "[controllers.firm]\nvehicles = ['research-2.6kg']") + TUNING)
    assert one.file.tuning.seeds >= 64
    assert one.file.tuning.seeds < FIRST


def test_every_controller_is_tuned_on_the_same_flights_with_the_same_objective_and_budget():
    text = HEAD + BODY + '[controllers.a]\ncontroller = "pid"\n[controllers.b]\ncontroller = "geometric"\n' + "[tuning]\n"
    one = study(text + 'budget = 100000\nflown = [{ path = "up", scenario = "windy" }, { path = "up", scenario = "calm" }]\n')
    tasks = [
        training.task(one, VEHICLE, name, entry, one.knowing(VEHICLE, entry.controller))
        for name, entry in one.controllers(VEHICLE).items()
    ]
    first, second = tasks
    assert (first.budget, first.seed) == (second.budget, second.seed)
    for ours, theirs in zip(first.missions, second.missions, strict=True):
        same = {key: value for key, value in ours.items() if key not in ("controller", "tune")}
        assert same == {key: value for key, value in theirs.items() if key not in ("controller", "tune")}
        assert {**ours["tune"], "gains": 0} == {**theirs["tune"], "gains": 0}
    assert [len(one.missions) for one in tasks] == [2, 2]
    assert [training.check_task(one) for one in tasks] == [12, 6]


def test_gains_of_unlike_parts_are_tuned_each_by_itself():
    one = study(SMALL)
    mission = one.nominal(VEHICLE, {"type": "lqr"})
    keys = list(training.ranges(one.file.controllers["firm"].model_copy(update={"frozen": None}), mission))
    assert keys[:3] == ["level.0", "level.1", "level.2"]
    mission = one.nominal(VEHICLE, {"type": "rotation-backstepping", "nets": {"enabled": False}})
    keys = list(training.ranges(one.file.controllers["firm"].model_copy(update={"frozen": None}), mission))
    assert not [key for key in keys if key.startswith("nets")]
    mission = one.nominal(VEHICLE, one.knowing(VEHICLE, {"type": "rotation-backstepping", "nets": {"kappa1": 0.02}}))
    keys = list(training.ranges(one.file.controllers["firm"].model_copy(update={"frozen": None}), mission))
    assert [key for key in keys if key.startswith("nets")] == ["nets.F1", "nets.F2", "nets.kappa1", "nets.kappa2"]
    assert mission.controller.nets.kappa1 == 0.02
    assert mission.controller.nets.F1 > 0.0


def test_what_keeps_the_adaptive_law_from_indi_is_asked_with_the_gains_of_the_study_that_ships():
    folder = Path(schema.__file__).parent / "studies"
    one = read_study(folder / "rotor-lag.toml")
    searches = read_json(folder / "controllers-gains.json")["gains"]
    laws = {"adaptive": "adaptive, nets"} | {law: law for law in ("adaptive, hedged", "NN inversion, hedged", "INDI")}
    for name, tuned in laws.items():
        table = one.controllers(VEHICLE)[name].controller
        best = min((each for each in searches if each["controller"] == f"{tuned} on {VEHICLE}"), key=itemgetter("objective"))
        for key, value in best["values"].items():
            found = table
            for part in key.removeprefix("controller.").split("."):
                found = found[int(part)] if isinstance(found, list) else found[part]
            assert found == value, key
    for situation in one.situations():
        for name, entry in one.controllers(VEHICLE).items():
            one.check_cell(one.cell(situation, name, one.knowing(VEHICLE, entry.controller)))


def test_the_study_that_ships_can_be_flown():
    one = shipped_study()
    assert one.file.seeds >= 500
    assert one.file.tuning.repeats >= 3
    assert one.file.tuning.constraints is None  # those of a sound loop
    assert list(one.file.vehicles) == [VEHICLE, "crazyflie"]
    for situation in one.situations():
        table = one.knowing(situation.vehicle, {"type": "pid"})
        one.check_cell(one.cell(situation, "PID", table))
    for name, entry in one.file.margins.items():
        for vehicle in one.file.vehicles:
            if entry.suits(vehicle):
                robustness.raised(one, vehicle, name, "PID", one.knowing(vehicle, {"type": "pid"}))


def test_gains_of_three_searches_keep_the_margins_of_a_sound_loop():
    study = shipped_study()
    found = read_json(Path(schema.__file__).parent / "studies" / "controllers-gains.json")["gains"]
    entries = study.file.controllers
    tuned = [f"{name} on {vehicle}" for name, one in entries.items() if not one.frozen for vehicle in study.file.vehicles]
    assert Counter(one["controller"] for one in found) == dict.fromkeys(tuned, 3)
    short = {one["controller"] for one in found if one["violation"] > 0.0 or one["unconstrained"]}
    missing = {f"{law} on {vehicle}" for law in ("planned LQR", "MPPI") for vehicle in study.file.vehicles}
    assert short == missing | {f"nested saturations on {VEHICLE}"}
    assert all(one["margins"] or one["unconstrained"] for one in found)
    for law in ("PID", "geometric", "nested saturations"):
        best = next(one for one in found if one["controller"] == f"{law} on {VEHICLE}")
        table = study.with_gains(VEHICLE, study.knowing(VEHICLE, entries[law].controller), best["values"])
        asked = training.task(study, VEHICLE, law, entries[law], table)
        margins = training.stability(asked).margins({})
        assert margins == pytest.approx(best["margins"])
        assert training.stability(asked).missed(margins) == pytest.approx(best["violation"])
        assert (best["violation"] > 0.0) == (law == "nested saturations")


def test_every_controller_of_real_vehicles_takes_part_in_the_study_that_ships():
    entries = shipped_study().file.controllers
    assert {entry.controller["type"] for entry in entries.values()} == set(names(Measured)) - set(STOCK)
    assert [name for name, entry in entries.items() if entry.optional] == ["RAPTOR"]


MARGIN = '[margins.wind]\nkeys = ["wind.mean.0"]\npath = "up"\nscenario = "calm"\nhigh = 20.0\n'


@pytest.mark.parametrize(("text", "said"), [
    (SMALL.replace('["research-2.6kg"]', '["x5"]'), "vehicles: unknown vehicle 'x5'; did you mean x500? Allowed: crazyflie"),
    (SMALL.replace('["research-2.6kg"]', "[]"), "vehicles: should have at least 1 entry, not 0"),
    (SMALL.replace('["research-2.6kg"]', '["x500", "x500"]'), "vehicles: x500 is named twice"),
    (SMALL.replace("seeds = 12", "seeds = 1"), "seeds: should be greater than or equal to 2, not 1"),
    (SMALL.replace("[scenarios.calm]", "[scenarios.calm]\npaths = ['down']"), "unknown value 'down'; allowed: up"),
    (SMALL.replace("[scenarios.calm]", "[scenarios.calm]\nwind = 3"), "scenarios.calm.wind: unknown key"),
    (SMALL.replace("[scenarios.calm]", "[scenarios.calm]\nmission = { seed = 3 }"), "seed cannot be set here"),
    (SMALL.replace('path = { type = "step"', 'way = { type = "step"'), "mission.path is required"),
    (HEAD + BODY, "controllers is required"),
    (SMALL + MARGIN.replace("20.0", "-1.0"), "low = 0 must be below high = -1"),
    (SMALL + MARGIN.replace('"calm"', '"hail"'), "unknown value 'hail'; allowed: calm, windy"),
    (SMALL + TUNING.replace("budget = 4500", ""), "tuning.budget is required"),
    (SMALL + TUNING.replace("4500", "4500\nseeds = 8"), "tuning.seeds: should be greater than or equal to 16"),
    (SMALL + TUNING.replace('"windy"', '"hail"'), "tuning.flown[0].scenario: unknown value 'hail'"),
    (SMALL + "[controllers.x]\ncontroller = { k_x = 1.0 }\n", "controllers.x: controller.type is required"),
    (SMALL + OPTIONAL.replace("true", "3"), "controllers.policy.optional: should be true or false, not 3"),
    (SMALL.replace("vehicle.mass", "seed"), "seed"),
])  # fmt: skip
def test_what_a_study_cannot_say_is_refused_in_one_line(text, said):
    with pytest.raises(UserError) as error:
        one = study(text)
        for situation in one.situations():
            one.cell(situation, "firm", {"type": "geometric"})
    assert str(error.value).startswith("study.toml: ")
    assert said in str(error.value)


def test_a_budget_too_small_for_its_gains_says_how_much_is_needed():
    one = study(SMALL + TUNING.replace("4500", "2000"))
    task = training.task(one, VEHICLE, "PID", one.file.controllers["PID"], one.knowing(VEHICLE, {"type": "pid"}))
    said = "2000 flights are too few for the 2 gains of PID on research-2[.]6kg; at least 2464 are needed"
    with pytest.raises(UserError, match=said):
        training.check_task(task)


def test_a_margin_of_an_unknown_key_is_refused_before_anything_flies():
    one = study(SMALL + MARGIN.replace("wind.mean.0", "wind.men"))
    with pytest.raises(UserError, match=r"margins.wind: firm on research-2.6kg: .*men: unknown key"):
        robustness.raised(one, VEHICLE, "wind", "firm", {"type": "geometric"})


def test_a_campaign_or_a_lone_mission_is_told_from_a_study(tmp_path):
    with pytest.raises(UserError, match="looks like a mission, not a study; name two or more missions"):
        read_study(write(tmp_path, LINE))
    with pytest.raises(UserError, match="looks like a campaign"):
        read_study(write(tmp_path, 'mission = "m.toml"\n'))


def test_what_surrounds_a_law_costs_nothing_of_the_law(monkeypatch):
    """Two loops are timed, one of them without the law: so the second must not ask it, and neither evaluates the path."""
    plan = study(SMALL).nominal(VEHICLE, {"type": "pid"}).plan()
    asked = []
    law = CascadedPid.law
    monkeypatch.setattr(CascadedPid, "law", lambda *given: asked.append(1) or law(*given))
    for idle in (False, True):
        loop = cost.law_alone(plan, idle).loop
        cycle = loop.start(plan.start, plan.parameters)
        asked.clear()
        with monkeypatch.context() as patch:
            patch.setattr(type(loop.path), "reference", lambda *_: pytest.fail("a path is no part of a law"))
            for task in loop.tasks:
                task.run(cycle, plan.parameters, Clock(0.0, 0, 0.002))
            moved = loop.advance(cycle, plan.parameters, Clock(0.0, 0, 0.002))
        assert all(one != other for one, other in zip(flatten(cycle.air), flatten(moved.air), strict=True))
        assert (len(asked), loop.late) == (0 if idle else 1, 0)


def test_a_cost_that_cannot_be_is_shown_and_not_called_nothing(monkeypatch):
    monkeypatch.setattr(cost, "nanoseconds", lambda *_: [44.0, 62.0])
    assert cost.cost(study(SMALL).nominal(VEHICLE, {"type": "pid"}).plan()).nanoseconds == -18.0


@needs(CORTEX_M)
def test_instructions_are_those_of_the_data_sheet(tmp_path, monkeypatch):
    monkeypatch.setattr(cost, "nanoseconds", lambda *_: [62.0, 44.0])
    plan = study(SMALL).nominal(VEHICLE, {"type": "pid"}).plan()
    found, law = cost.cost(plan), exported(plan, precise=False)
    for name, text in c99_files(law, plan).items():
        (tmp_path / name).write_text(text)
    work = tmp_path / "work"
    work.mkdir()
    counted = arm.instruction_counts(law, tmp_path, work)["Cortex-M4F"]
    assert ("all but made due at once", f"{found.instructions} instructions") in [
        (name, said.partition(",")[0]) for name, said in instructions(law, counted, *CLOCKS["Cortex-M4F"])
    ]
    assert found.instructions == counted.counted.worst["law"] + counted.counted.worst["guide"]
    assert cost.from_json(cost.as_json(found)) == found


def test_where_instructions_cannot_be_counted_it_says_why(monkeypatch):
    monkeypatch.setattr(cost, "nanoseconds", lambda *_: [62.0, 44.0])
    monkeypatch.setattr(cost, "missing_programs", lambda: ["arm-none-eabi-gcc"])
    found = cost.cost(study(SMALL).nominal(VEHICLE, {"type": "pid"}).plan())
    assert (found.nanoseconds, found.instructions, found.uncounted) == (18.0, None, "arm-none-eabi-gcc not found")
    assert cost.from_json(cost.as_json(found)) == found
