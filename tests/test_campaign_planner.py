"""From drawn values to flights: whatever varies, the flights of a batch are those built one by one, number by number."""

import copy
import json
import re

import numpy as np
import pytest

from quadstep.engines.engine import Engine
from quadstep.engines.scored import scored
from quadstep.io.errors import UserError
from quadstep.metrics.statistics import share
from quadstep.mission.read import check_mission
from quadstep.numbers import Table, flatten, leaf_names
from quadstep.numbers.noise import key
from quadstep.report import evidence
from quadstep.studies.campaign.draws import draw
from quadstep.studies.campaign.flyer import Flyer, planner
from quadstep.studies.campaign.report_text import opening
from quadstep.studies.campaign.schema import read_campaign
from quadstep.studies.campaign.store import opened
from quadstep.studies.campaign.summary import CampaignSummary
from tests.campaigns import NOISY, SHORT, campaign, fly, manifest, written

WAYPOINTS = """
[path]
type = "waypoints"
waypoints = [
  { t = 0.0, position = [0.0, 0.0, 0.0] },
  { t = 0.2, position = [0.1, 0.0, 0.1], yaw = 0.1 },
  { t = 0.4, position = [0.0, 0.1, 0.0] },
]
[simulation]
step = 0.004
control_period = 0.004
log_period = 0.02
"""
EVENTS = (
    NOISY
    + """
[[events]]
type = "payload"
time = 0.05
until = 0.2
mass = 0.5
position = [0.05, 0.0, -0.1]
[[events]]
type = "rotor"
time = 0.1
rotor = 2
efficiency = 0.85
"""
)
GUST = NOISY.replace("[wind]", "[wind]\ngust = { velocity = [0.0, 6.0, 0.0], start = 0.1, length = 0.1 }")
PLACED = NOISY.replace(
    'preset = "research-2.6kg"',
    'preset = "research-2.6kg"\n'
    "rotors = [{position=[0.2, 0.2, 0.0], spin='ccw'}, {position=[-0.2, 0.2, 0.0], spin='cw'},"
    " {position=[-0.2, -0.2, 0.0], spin='ccw'}, {position=[0.2, -0.2, 0.0], spin='cw'}]",
)


def with_controller(kind, mission=NOISY):
    return mission.replace('type = "geometric"', f'type = "{kind}"')


def set_in(content, dotted, value):
    """The key set in parsed TOML, apart from how the campaign does it."""
    content = copy.deepcopy(content)
    *way, last = [int(part) if part.isdigit() else part for part in dotted.split(".")]
    inside = content
    for part in way:
        inside = inside[part] if isinstance(part, int) else inside.setdefault(part, {})
    inside[last] = value
    return content


def alone(one, values, flight):
    """(loop, ticks, names, leaves) of a flight built by itself, with the noise of its number."""
    content = one.content
    for name, value in values.items():
        content = set_in(content, name, value)
    mission = check_mission(content, "m", one.folder)
    plan = mission.plan(one.folder)
    if hasattr(plan.parameters, "key"):
        plan = plan._replace(parameters=plan.parameters._replace(key=key(one.file.seed, flight)))
    period = one.file.score_period or mission.simulation.log_period
    loop, ticks = scored(plan.loop, plan.ticks, period, getattr(mission, "score_from", 0.0))
    return loop, ticks, leaf_names((plan.start, plan.parameters)), flatten((plan.start, plan.parameters))


def agree(one, numbers):
    """Every flight of these numbers is in one batch, and there it is what it is alone; how many batches."""
    numbers = np.asarray(numbers)
    drawn = draw(one.file, numbers)
    batches = list(planner(one).batches(numbers, drawn))
    assert sorted(np.concatenate([batch.members for batch in batches]).tolist()) == list(range(len(numbers)))
    for batch in batches:
        assert batch.rows.shape == (len(batch.members), len(batch.places))
        shape = (batch.start, batch.parameters)
        for member, row in zip(batch.members, batch.rows, strict=True):
            values = {name: column.at(member) for name, column in drawn.items()}
            loop, ticks, names, wanted = alone(one, values, int(numbers[member]))
            assert (batch.loop, batch.ticks) == (loop, ticks)
            assert leaf_names(shape) == names
            ours = flatten(shape)
            for place, value in zip(batch.places, row, strict=True):
                ours[place] = value
            for name, mine, theirs in zip(names, ours, wanted, strict=True):
                if isinstance(theirs, Table):
                    assert mine.values == theirs.values, name
                else:
                    assert float(mine) == float(theirs), (name, mine, theirs)
    return len(batches)


U = '{type="uniform", low=%g, high=%g}'
VARIED = {
    # the paper's plant
    "mass": (SHORT, '"vehicle.mass" = ' + U % (0.8, 1.2)),
    "a start": (SHORT, '"start.position.2" = ' + U % (-0.1, 0.1)),
    "an attitude": (SHORT, '"start.attitude.1" = ' + U % (-0.5, 0.5)),
    "one inertia, given nowhere": (SHORT.replace("[path]", "[vehicle]\ninertia=[5.0,5.0,5.0]\n[path]"),
                                   '"vehicle.inertia.0" = ' + U % (4, 6)),
    "three inertias": (SHORT.replace("[path]", "[vehicle]\ninertia=[5.0,5.0,5.0]\n[path]"),
                       "".join(f'"vehicle.inertia.{i}" = ' + U % (4, 6) + "\n" for i in range(3))),
    "all inertias by one number": (SHORT, '"vehicle.inertia" = ' + U % (4, 6)),
    "all inertias by one choice": (SHORT, '"vehicle.inertia" = {type="choice", values=[5.0]}'),
    "all inertias by a choice seldom taken": (
        SHORT, '"vehicle.inertia" = {type="choice", values=[5.0, 6.0], weights=[1e9, 1.0]}'),
    "gains by one number": (SHORT, 'controller.type = {type="choice", values=["backstepping"]}\n'
                            'controller.K_r1 = {type="grid", low=3.0, high=4.0, count=3}'),
    "whole lists": (SHORT, '"path.end" = {type="choice", values=[[0.1, 0.2, 0.3], [0.4, 0, 0.1]]}'),
    "whole numbers for a number": (SHORT, '"vehicle.mass" = {type="grid", values=[1, 2]}'),
    "whole numbers and others": (SHORT, '"vehicle.mass" = {type="grid", values=[1, 1.5]}'),
    "a word": (SHORT, '"vehicle.kinematics" = {type="grid", values=["standard", "printed", "rigid"]}'),
    "a truth": (SHORT, 'controller.type = {type="choice", values=["backstepping"]}\n'
                '"controller.nets.enabled" = {type="choice", values=[true, false]}'),
    "neurons": (SHORT, 'controller.type = {type="choice", values=["backstepping"]}\n'
                '"controller.nets.neurons" = {type="choice", values=[3, 5]}'),
    "a seed of the nets": (SHORT, 'controller.type = {type="choice", values=["backstepping"]}\n'
                           '"controller.nets.seed" = {type="grid", values=[1, 2, 3]}'),
    "tables": (SHORT, '"controller" = {type="choice", values=[{type="backstepping", K_r1=4.0}, {type="nested-saturation"}]}\n'
               '"vehicle.mass" = ' + U % (0.8, 1.2)),
    "a controller with its mass left out": (SHORT, '"controller" = {type="grid", values=[{type="backstepping"}]}\n'
                                            '"vehicle.mass" = ' + U % (0.8, 1.2)),
    "the path's duration": (SHORT, '"path.duration" = ' + U % (0.3, 0.4)),
    "the path's duration in a fixed flight": (SHORT.replace("[simulation]", "[simulation]\nduration = 0.4"),
                                              '"path.duration" = ' + U % (0.3, 0.4)),
    "the flight's duration": (SHORT, '"simulation.duration" = ' + U % (0.3, 0.4)),
    "durations to choose from": (SHORT, '"simulation.duration" = {type="grid", values=[0.2, 0.3, 0.4]}'),
    "the log period": (SHORT, '"simulation.log_period" = {type="grid", values=[0.02, 0.04]}'),
    "the step": (SHORT, '"simulation.step" = {type="grid", values=[0.002, 0.004]}'),
    "a waypoint": (WAYPOINTS, '"path.waypoints.1.position.0" = ' + U % (0, 0.2)),
    "a waypoint's time": (WAYPOINTS, '"path.waypoints.1.t" = {type="grid", values=[0.15, 0.2, 0.25]}'),
    "a whole path": (SHORT, '"path" = {type="choice", values=[{type="minimum-jerk", end=[0.1,0,0], duration=0.3},'
                     ' {type="step", end=[0.1,0,0], time=0.1, duration=0.3}]}'),
    "limits of the rotors": (SHORT.replace("[path]", "[vehicle]\nrotors.limits=[0.0, 10.0]\n[path]"),
                             '"vehicle.rotors.limits.1" = ' + U % (5, 10)),
    "rotors with limits or without": (SHORT, '"vehicle.rotors" = {type="grid", values=[{limits=[0.0, 9.0]}, {}]}'),
    "limits of the flight": (SHORT, '"limits.distance" = ' + U % (0.01, 10)),
    "disturbance": (SHORT.replace("[path]", "[disturbance]\nforce=[0.0,0.0,0.0]\n[path]"),
                    '"disturbance.scale" = {type="log-normal", median=1, sigma=0.3}\n"disturbance.force.1" = ' + U % (-1, 1)),
    "correlated": (SHORT, '[[correlated]]\nkeys = ["vehicle.mass", "vehicle.gravity"]\nmean = [1.0, 9.8]\n'
                   "covariance = [[0.0004, 0.0003], [0.0003, 0.0009]]"),
    "nothing": (SHORT, ""),
    "much": (SHORT.replace("[path]", "[vehicle]\ninertia=[5.0,5.0,5.0]\n[path]"),
             '"vehicle.mass" = ' + U % (0.8, 1.2) + '\n"vehicle.inertia.2" = ' + U % (4, 6) + '\n"path.end.0" = '
             + U % (-1, 1) + '\n"start.position.1" = ' + U % (-1, 1) + '\n"vehicle.gravity" = ' + U % (9, 10)
             + '\n"limits.rate" = ' + U % (9, 10) + '\n"path.yaw_end" = ' + U % (-1, 1)
             + '\n"vehicle.kinematics" = {type="choice", values=["standard", "rigid"]}'),
    # real vehicles
    "a real mass": (NOISY, '"vehicle.mass" = ' + U % (2.4, 2.9)),
    "a real inertia": (NOISY.replace('"research-2.6kg"', '"research-2.6kg"\ninertia=[0.04,0.04,0.06]'),
                       '"vehicle.inertia.1" = ' + U % (0.03, 0.05)),
    "a rotor's coefficient": (NOISY, '"vehicle.rotor.thrust_coefficient" = {type="normal", mean=3e-5, deviation=1e-6}'),
    "a rotor's times": (NOISY, '"vehicle.rotor.rise_time" = ' + U % (0.02, 0.08) + '\n"vehicle.rotor.fall_time" = '
                        + U % (0.02, 0.08)),
    "a rotor's place": (PLACED, '"vehicle.rotors.0.position.0" = ' + U % (0.18, 0.22)),
    "presets": (NOISY, '"vehicle.preset" = {type="grid", values=["research-2.6kg", "x500"]}'),
    "effects": (NOISY, '"vehicle.effects.drag" = {type="grid", values=[true, false]}'),
    "mean wind": (NOISY, '"wind.mean.0" = ' + U % (0.5, 8)),
    "turbulence": (NOISY, '"wind.turbulence.wind_20" = ' + U % (0.5, 8) + '\n"wind.turbulence.height" = ' + U % (4, 60)),
    "turbulence by its name": (NOISY, '"wind.turbulence" = {type="grid", values=[{intensity="light"}, {intensity="severe"}]}'),
    "all of the wind": (NOISY, '"wind" = {type="grid", values=[{}, {mean=[1.0,0.0,0.0]}]}'),
    "a gust": (GUST, '"wind.gust.velocity.1" = ' + U % (0, 8) + '\n"wind.gust.start" = ' + U % (0.05, 0.2)),
    "noise": (NOISY, '"sensors.position_noise" = ' + U % (0, 0.05)),
    "latency": (NOISY, '"sensors.latency" = {type="grid", values=[0.0, 0.01]}'),
    "latency that may be left out": (NOISY, '"sensors.latency" = {type="choice", values=[0.0, 0.01], weights=[1e9, 1.0]}'),
    "an estimator": (NOISY, '"sensors.estimator" = {type="grid", values=[true, false]}'),
    "a period of the sensors": (NOISY, '"sensors.fix_period" = {type="grid", values=[0.002, 0.01, 0.02]}'),
    "events": (EVENTS, '"events.0.mass" = ' + U % (0.1, 0.6) + '\n"events.0.position.0" = ' + U % (-0.05, 0.05)
               + '\n"events.0.time" = ' + U % (0.01, 0.1) + '\n"events.1.efficiency" = ' + U % (0.7, 1.0)),
    "which rotor": (EVENTS, '"events.1.rotor" = {type="grid", values=[1, 2, 3, 4]}'),
    "when on a real vehicle": (NOISY, '"path.time" = ' + U % (0.0, 0.2)
                               + '\n"path.duration" = {type="grid", values=[0.25, 0.3]}'),
    "real controllers": (NOISY, 'controller.type = {type="grid", values=["geometric", "pid", "lqr"]}\n'
                         '"vehicle.mass" = ' + U % (2.4, 2.9)),
    "what the controller believes": (NOISY, '"controller.mass" = ' + U % (2.4, 2.9)),
    "a gain of three axes": (NOISY, '"controller.k_x" = ' + U % (5, 7)),
    "gains of the LQR": (with_controller("lqr"), '"controller.integral_bound" = ' + U % (1, 2)
                         + '\n"vehicle.mass" = ' + U % (2, 3)),
    "only noise": (NOISY, ""),
    "a start on a real vehicle": (NOISY + "[start]\nposition=[0.0,0.0,0.0]\nattitude=[0.0,0.0,0.0]\n",
                                  '"start.position.2" = ' + U % (-0.1, 0.1) + '\n"start.attitude.0" = ' + U % (-3, 3)
                                  + '\n"start.hovering" = {type="grid", values=[true, false]}'),
}  # fmt: skip


@pytest.mark.parametrize("name", VARIED)
def test_flights_of_a_batch_are_those_built_alone(name, tmp_path):
    mission, vary = VARIED[name]
    if '"controller" = ' not in vary and "nested" not in vary:
        mission = mission if "[controller]" in mission else mission + '[controller]\ntype = "backstepping"\n'
    one = campaign(tmp_path, vary, mission)
    agree(one, range(8))
    agree(one, range(70_000, 70_005))
    agree(one, [3])


IN_ONE_GO = {
    "mass": 1, "a start": 1, "three inertias": 1, "disturbance": 1, "tables": 2, "a word": 3, "nothing": 1, "correlated": 1,
    "a real mass": 1, "mean wind": 1, "turbulence": 1, "noise": 1, "latency": 2, "only noise": 1, "limits of the flight": 1,
    "the path's duration in a fixed flight": 1, "durations to choose from": 3, "a rotor's coefficient": 1,
    "all inertias by one number": 1, "a gain of three axes": 1,
}  # fmt: skip


@pytest.mark.parametrize("name", IN_ONE_GO)
def test_what_varies_smoothly_is_built_in_one_go(name, tmp_path):
    assert agree(campaign(tmp_path, VARIED[name][1], VARIED[name][0]), range(30)) == IN_ONE_GO[name]


def test_a_gain_of_three_axes_gives_the_metrics_of_flights_set_up_one_by_one(tmp_path, caplog):
    direct, singly = (Flyer(campaign(tmp_path, '"controller.k_x" = ' + U % (5, 7), NOISY)) for _ in range(2))
    singly.planner.direct[()] = []  # as if no array fitted
    table = direct.fly(0, 40)
    assert direct.planner.direct[()] == ["controller.k_x"]
    assert len(set(table["position_rmse[m]"].to_pylist())) == 40
    assert singly.fly(0, 40).equals(table)
    assert not direct.planner.singly
    direct.rehearse()
    assert not caplog.messages


def test_keys_that_are_set_up_flight_by_flight_are_named_with_their_price(tmp_path, caplog):
    vary = '"simulation.duration" = ' + U % (0.3, 0.4) + '\n"vehicle.mass" = ' + U % (0.9, 1.1)
    path = written(tmp_path, vary)
    run = fly(path, tmp_path / "out", "--flights", "20", "--json")
    (line,) = caplog.messages
    assert re.fullmatch(
        r"quadstep: note: each flight is set up by itself, [0-9.e+]+ ms each, because simulation.duration cannot be "
        "set for many flights at once; a choice or a grid of few values would cost less",
        line,
    )
    found, kept = json.loads(run.out), manifest(tmp_path / "out")
    assert found["set_up_singly"] == kept["summary"]["set_up_singly"] == ["simulation.duration"]
    assert found["set_up_each[s]"] > 0.0
    assert "set_up_each[s]" not in kept["summary"]  # what is kept has no measured times
    summary = CampaignSummary(20, share(20, 20), {}, [], [], singly=("simulation.duration",))
    with opened(tmp_path / "out", read_campaign(path), 20, Engine.LANES, resume=True) as store:
        tables = [one for one in opening(store, read_campaign(path), summary, path) if isinstance(one, evidence.TableSection)]
    (words,) = [row[1] for one in tables for row in one.rows if row[0] == "set up one by one"]
    assert "each flight, because simulation.duration cannot be set for many flights at once" in words


def test_recordings_to_choose_from(tmp_path):
    for name, far in (("a.csv", 0.1), ("b.csv", 0.3)):
        lines = [f"{0.05 * i:g},{far * i / 10:g},0,0" for i in range(11)]
        (tmp_path / name).write_text("t,x,y,z\n" + "\n".join(lines), encoding="utf-8")
    mission = SHORT.replace('type = "minimum-jerk"', 'type = "recorded"\nfile = "a.csv"').replace(
        "end = [0.4, 0.1, 0.2]\nduration = 0.4\n", ""
    )
    one = campaign(
        tmp_path, '"path.file" = {type="grid", values=["a.csv", "b.csv"]}\n"vehicle.mass" = ' + U % (0.9, 1.1), mission
    )
    assert agree(one, range(10)) == 2


def test_flights_do_not_depend_on_who_is_flown_with_them_or_before(tmp_path):
    """The very same batch however the span is cut, so that the same program flies it."""
    one = campaign(tmp_path, VARIED["real controllers"][1] + '\n"wind.mean.0" = ' + U % (0.1, 5), NOISY)

    def plans(spans):
        builder, found = planner(one), {}
        for numbers in spans:
            for batch in builder.batches(numbers, draw(one.file, numbers)):
                for member, row in zip(batch.members, batch.rows, strict=True):
                    constants = [
                        leaf for i, leaf in enumerate(flatten((batch.start, batch.parameters))) if i not in batch.places
                    ]
                    found[int(numbers[member])] = (batch.loop, batch.ticks, batch.places, row.tolist(), constants)
        return found

    whole = plans([np.arange(64)])
    assert plans([np.arange(60, 64), np.arange(0, 5), np.arange(5, 60)]) == whole
    assert plans([np.arange(i, i + 1) for i in reversed(range(64))]) == whole


# Refused values


REFUSED = {
    "a mass below zero": (SHORT, '"vehicle.mass" = {type="normal", mean=0.15, deviation=0.1}', "vehicle.mass"),
    "inertia of no body": (SHORT.replace("[path]", "[vehicle]\ninertia=[5.0,5.0,5.0]\n[path]"),
        "".join(f'"vehicle.inertia.{i}" = ' + U % (2.2, 6) + "\n" for i in range(3)), "triangle"),
    "upside down": (SHORT, '"start.attitude.1" = ' + U % (-1.7, 1.7), "theta"),
    "a step after the end": (NOISY, '"path.time" = ' + U % (0.1, 0.5), "before duration"),
    "a step after one of two ends": (NOISY, '"path.duration" = {type="grid", values=[2, 1]}\n"path.time" = ' + U % (0.5, 1.5),
        "before duration"),
    "a period between two": (SHORT, '"simulation.control_period" = {type="grid", values=[0.004, 0.006, 0.008]}',
        "whole multiple"),
    "a flight of no length": (SHORT, '"simulation.duration" = {type="grid", values=[0.4, 0.001]}', "simulation.duration"),
    "an unknown word": (SHORT, '"vehicle.kinematics" = {type="grid", values=["standard", "other"]}', "kinematics"),
    "a list too short": (SHORT, '"path.end" = {type="choice", values=[[1.0, 2.0, 3.0], [1.0, 2.0]]}', "path.end"),
    "no neurons": (SHORT + '[controller]\ntype = "backstepping"\n', '"controller.nets.neurons" = {type="grid", values=[5, 0]}',
        "neurons"),
    "a file that is not there": (SHORT + '[controller]\ntype = "backstepping"\n',
        '"controller.nets.weights" = {type="choice", values=["none.json"]}', "none.json"),
    "an event after the end": (EVENTS, '"events.1.time" = ' + U % (0.1, 0.9), "event"),
    "text for a number": (SHORT, '"vehicle.mass" = {type="grid", values=[1.0, "heavy"]}', "vehicle.mass"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_values_that_no_mission_takes_are_one_line_naming_flight_and_key(name, tmp_path):
    mission, vary, part = REFUSED[name]
    one = campaign(tmp_path, vary, mission)
    with pytest.raises(UserError) as caught:
        list(planner(one).batches(np.arange(64), draw(one.file, np.arange(64))))
    text = str(caught.value)
    assert part in text
    assert "flight " in text
    assert "mission.toml" in text


@pytest.mark.parametrize("name", ["a mass below zero", "inertia of no body", "upside down"])
def test_the_flight_that_is_named_is_the_first_that_is_refused(name, tmp_path):
    mission, vary, _ = REFUSED[name]
    for seed in range(1, 20):
        one = campaign(tmp_path, vary, mission, head=f"seed = {seed}")
        drawn = draw(one.file, np.arange(64))
        ill = [i for i in range(64) if not flies(one, {key: column.at(i) for key, column in drawn.items()})]
        first = min(ill, default=0)
        if first > 1:
            break
    assert first > 1
    with pytest.raises(UserError, match=rf"flight {first} \("):
        list(planner(one).batches(np.arange(64), drawn))
    agree(one, range(first))


def test_values_are_looked_at_in_every_span(tmp_path):
    one = campaign(tmp_path, '"vehicle.mass" = {type="normal", mean=0.2, deviation=0.1}')
    masses = draw(one.file, np.arange(4000))["vehicle.mass"].values
    ill = int(np.argmax(masses <= 0.0))
    assert ill > 0
    builder = planner(one)
    for first, past in ((0, ill), (ill, ill + 20)):
        numbers = np.arange(first, past)
        batches = builder.batches(numbers, draw(one.file, numbers))
        if first:
            with pytest.raises(UserError, match=rf"flight {ill} \("):
                list(batches)
        else:
            assert sum(len(batch.members) for batch in batches) == ill


def flies(one, values):
    """Whether the mission takes the values."""
    try:
        alone(one, values, 0)
    except UserError:
        return False
    return True


def test_values_in_corners_that_no_flight_has_harm_nobody(tmp_path):
    """Strongly correlated inertias: every flight is of a body, but the corners of the box around them are not."""
    vary = '[[correlated]]\nkeys = ["vehicle.inertia.0", "vehicle.inertia.1"]\nmean = [9.0, 9.0]\n'
    vary += "deviations = [3.0, 3.0]\ncorrelation = [[1.0, 0.999], [0.999, 1.0]]\n"
    agree(campaign(tmp_path, vary, SHORT.replace("[path]", "[vehicle]\ninertia=[9.0,9.0,1.0]\n[path]")), range(12))


def test_too_many_structures_are_one_line(tmp_path):
    vary = '"controller.nets.neurons" = {type="grid", values=NUMBERS}\n'.replace("NUMBERS", str([*range(1, 65)]))
    vary += '"vehicle.kinematics" = {type="grid", values=["standard", "printed", "rigid"]}\n'
    vary += '"vehicle.rotors" = {type="grid", values=[{limits=[0.0, 9.0]}, {}]}\n'
    one = campaign(tmp_path, vary, SHORT + '[controller]\ntype = "backstepping"\n')
    with pytest.raises(UserError, match="structure of the flight more than 200 times"):
        list(planner(one).batches(np.arange(400), draw(one.file, np.arange(400))))


# Flown


def test_noise_differs_from_flight_to_flight_and_is_the_same_alone(tmp_path):
    one = campaign(tmp_path, "", NOISY)
    table = Flyer(one).fly(0, 20)
    errors = table["position_rmse[m]"].to_pylist()
    assert len(set(errors)) == 20
    for flight in (0, 7):
        assert Flyer(one).fly(flight, flight + 1)["position_rmse[m]"].to_pylist() == [errors[flight]]
    assert Flyer(campaign(tmp_path, "", NOISY, head="seed = 2")).fly(0, 1)["position_rmse[m]"].to_pylist() != errors[:1]
