"""Energy, rotor activity and saturation, against the log and the battery of the same flight."""

import numpy as np
import pytest

from quadstep import Mission, UserError, fly
from quadstep.engines.scored import metrics, scored
from quadstep.engines.sweep import Sweep
from quadstep.metrics.effort import EFFORT
from quadstep.numbers import flatten
from quadstep.studies.campaign.draws import draw
from quadstep.studies.campaign.planner import planner
from quadstep.studies.comparison.cells import Situation
from tests.quick_gains import QUICK
from tests.studies import study

UP = {"type": "step", "end": [0.5, 0.0, 1.0], "time": 0.2, "duration": 1.5}


def mission(**more):
    return Mission(
        vehicle={"preset": "research-2.6kg"}, path=UP, metrics=list(EFFORT),
        controller={"type": "pid", **QUICK["pid"]}, **more,
    )  # fmt: skip


@pytest.fixture(scope="module")
def flight():
    return fly(mission(simulation={"log_period": 0.002}))


def test_energy_is_what_the_battery_gave(flight):
    found = flight.metrics()["energy[J]"]
    battery = mission().modelled.airframe.battery
    forces = flight.table("f1", "f2", "f3", "f4")
    rotor = mission().modelled.airframe.rotor
    power = rotor.torque / battery.efficiency * ((forces / rotor.thrust) ** 1.5).sum(axis=1)
    assert found == pytest.approx(np.trapezoid(power, flight.column("t")), rel=1e-9)
    hover = 1.5 * power[0]
    assert 0.9 * hover < found < 1.5 * hover


def test_activity_is_the_rotors_changes_a_second(flight):
    forces = flight.table("f1", "f2", "f3", "f4")
    assert flight.metrics()["rotor_activity[N/s]"] == pytest.approx(np.abs(np.diff(forces, axis=0)).sum() / 1.5)


def test_saturation_is_where_less_is_made_than_wanted(flight):
    wanted, made = flight.table("u", "tau_x", "tau_y", "tau_z"), flight.table("u_a", "tau_x_a", "tau_y_a", "tau_z_a")
    missing = (np.abs(wanted - made) * [1.0, 10.0, 10.0, 10.0]).max(axis=1) > 1e-3 * 2.644 * 9.81
    assert 0.0 < missing.mean() < 1.0
    assert flight.metrics()["saturation"] == pytest.approx(missing.mean())


def test_without_a_log_the_same_is_summed_while_flying(flight):
    one = mission(simulation={"log_period": 0.002})
    plan = one.plan()
    loop, ticks = scored(plan.loop, plan.ticks, 0.002, 0.0, one.own_metrics)
    swept = Sweep(loop, ticks, plan.start, plan.parameters, (), double=True).fly(np.zeros((1, 0)))
    found = dict(zip(one.scores, metrics(swept.score)[0], strict=True))
    for name in ("energy[J]", "rotor_activity[N/s]", "saturation"):
        assert found[name] == pytest.approx(flight.metrics()[name], rel=1e-9)


def test_only_what_is_scored_counts(flight):
    late = fly(mission(simulation={"log_period": 0.002}, score_from=1.0))
    early = fly(mission(simulation={"log_period": 0.002, "duration": 1.0}))
    parts = late.metrics()["energy[J]"] + early.metrics()["energy[J]"]
    assert parts == pytest.approx(flight.metrics()["energy[J]"], rel=1e-9)


def test_a_vehicle_without_rotors_of_its_own_is_refused():
    with pytest.raises(UserError, match="energy: only for real vehicles"):
        Mission(path=UP, metrics=["energy"])


def test_a_campaign_that_varies_the_vehicle_is_built_in_one_go_whatever_is_measured():
    one = study()
    cell = one.cell(Situation("research-2.6kg", "up", "windy"), "firm", one.knowing("research-2.6kg", {"type": "geometric"}))
    there = planner(cell.campaign)
    (batch,) = there.batches(np.arange(8), draw(cell.campaign.file, np.arange(8)))
    assert there.direct[()] == ["vehicle.mass"]
    assert len(set(batch.rows[:, batch.places.index(mass_place(there))].tolist())) == 8


def mass_place(there):
    """Where a plan's leaves hold the vehicle's mass."""
    plan = there.plan({"vehicle.mass": 2.5})
    return next(i for i, leaf in enumerate(flatten((plan.start, plan.parameters))) if leaf == 2.5)
