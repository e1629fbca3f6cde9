"""A user's controller, in a file beside its mission, flies and gets its page; what it does not report appears nowhere."""

import csv
import json
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from quadstep import Mission, flight_metrics, fly, read_mission
from quadstep.control.nested_saturation import NestedSaturation
from quadstep.engines.engine import Engine
from quadstep.interfaces.controller import Command, Controller
from quadstep.interfaces.gain import gain, given
from quadstep.mission.derived import section_of
from quadstep.page.build import flown_mission, missions_page
from quadstep.page.controllers import in_common
from quadstep.report.panels import flight_jobs
from quadstep.vehicle.paper import State

ROOT = Path(__file__).parent.parent
MISSION = """
name = "Own"
[path]
type = "minimum-jerk"
end = [2.0, 0.5, 1.0]
duration = 4.0
[controller]
type = "cascaded_pd.py:CascadedPD"
k_r = 5000.0
"""


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """The results of a mission that names a controller beside it, as the README says."""
    folder = tmp_path_factory.mktemp("own")
    law = (ROOT / "examples" / "own_controller.py").read_text()
    silent = law.replace("Command(thrust, torque, desired)", "Command(thrust, torque)")
    assert silent != law
    (folder / "cascaded_pd.py").write_text(silent)
    (folder / "own.toml").write_text(MISSION)
    run = subprocess.run(
        [sys.executable, "-m", "quadstep", "fly", "own.toml", "--out", "out"],
        cwd=folder, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    assert "Completed 4 s" in run.stdout
    return folder / "out"


def test_it_flies_from_a_mission_file(flown):
    metrics = json.loads((flown / "metrics.json").read_text())
    assert metrics["mission"]["controller"]["k_r"] == 5000.0
    assert 0.0 < metrics["position_rmse[m]"] < 0.05


def test_its_page_flies_it_with_a_slider_for_each_gain(flown):
    page = (flown / "page.html").read_text()
    assert '"label":"cascaded PD"' in page
    for label, value, unit in (("k_p", 2, "1/s^2"), ("k_v", 3, "1/s"), ("k_r", 5000, "N m"), ("k_w", 300, "N m s")):
        assert re.search(rf'"label":"{label}","unit":"{re.escape(unit)}".{{0,400}}"value":{value}\b', page), label


def test_an_attitude_that_it_does_not_say_is_nowhere(flown):
    with (flown / "flight.csv").open() as file:
        header = next(csv.reader(file))
    assert "theta[rad]" in header
    assert not {"psi_d[rad]", "theta_d[rad]", "phi_d[rad]"} & set(header)
    assert "attitude" not in json.loads((flown / "metrics.json").read_text())
    assert "Attitude error" not in (flown / "page.html").read_text().partition("<script")[0]
    assert (flown / "figures" / "attitude.svg").exists()


@dataclass(frozen=True)
class Hover(Controller):
    """Gives the weight and nothing else."""

    def start(self, measured, gains):
        return ()

    def law(self, memory, measured, reference, gains, t, period):
        return Command(gains[0], 0.0 * measured.rates), ()


def on_a_real_vehicle(engine):
    mission = Path(ROOT / "examples" / "wind_tunnel.toml")
    plan = read_mission(mission).plan(mission.parent).with_controller(Hover(), (25.0,))
    return fly(plan._replace(ticks=plan.ticks._replace(last=200)), engine)


FUNCTION = """
from quadstep.control.vectoring import invert_force
from quadstep.numbers import vector


def controller(t, measured, reference):
    offset, drift = reference.position - measured.position, reference.velocity - measured.velocity
    wanted = 1.0 * (reference.acceleration + 2.0 * offset + 3.0 * drift + [0.0, 0.0, 9.81])
    thrust, theta_d, phi_d = invert_force(vector(*map(float, wanted)))
    return thrust, 5000.0 * ([reference.yaw, theta_d, phi_d] - measured.attitude) - 300.0 * measured.rates
"""


@pytest.mark.parametrize("engine", [Engine.LANES, Engine.PYTHON])
def test_a_function_flies_the_papers_plant_as_the_law_that_it_repeats(tmp_path, engine):
    (tmp_path / "function.py").write_text(FUNCTION)
    (tmp_path / "cascaded_pd.py").write_text((ROOT / "examples" / "own_controller.py").read_text())
    function = MISSION.replace("cascaded_pd.py:CascadedPD", "function.py:controller").replace("k_r = 5000.0", "")
    logs = []
    for name, text in (("law", MISSION), ("function", function)):
        (tmp_path / f"{name}.toml").write_text(text)
        logs.append(fly(read_mission(tmp_path / f"{name}.toml"), engine=engine))
    law, own = logs
    same = [name for name in own.columns if name in law.columns]
    assert {"x", "psi", "theta", "phi", "u"} <= set(same)
    np.testing.assert_array_equal(own.table(*same), law.table(*same))


@pytest.mark.parametrize("engine", [Engine.LANES, Engine.PYTHON])
def test_nor_on_a_real_vehicle(engine):
    log = on_a_real_vehicle(engine)
    assert log.rows.shape[1] == len(log.columns)
    assert np.isfinite(log.rows).all()
    assert len(log.rows) > 20
    assert {"yaw", "pitch", "roll", "heading_d", "x_d"} <= set(log.columns)
    assert not {"yaw_d", "pitch_d", "roll_d"} & set(log.columns)
    drawn = {name for job in flight_jobs(log, "") for panel in job.panels for name in panel.lines}
    assert "roll" in drawn
    assert "roll_d" not in drawn
    np.testing.assert_allclose(log.column("v_x"), log.table("v_x")[:, 0])


def test_what_a_law_says_is_there():
    mission = Mission.model_validate({"path": {"type": "minimum-jerk", "end": [1.0, 0.0, 0.0], "duration": 1.0}})
    log = fly(mission.plan())
    assert {"psi_d", "theta_d", "phi_d"} <= set(log.columns)
    assert "attitude" in flight_metrics(log)
    assert any("theta_d" in panel.lines for job in flight_jobs(log, "") for panel in job.panels)


def test_metrics_of_any_log():
    log = on_a_real_vehicle(Engine.LANES)
    assert "position_rmse[m]" in flight_metrics(log)
    with pytest.raises(KeyError, match="no column 'psi'; it has t, x, y, z"):
        log.column("psi")


class OtherGains(NamedTuple):
    mass: float = gain(1.0, "t", "of the cargo")
    weight: float = given(lambda model: model.mass * model.gravity)


@dataclass(frozen=True)
class Steady(Controller):
    """The weight as thrust."""

    name = "steady"
    Gains = OtherGains
    measures = State

    def law(self, memory, measured, reference, gains, t, period):
        return Command(gains.weight, 0.0 * measured.rates), ()


def test_a_controller_beside_whose_keys_mean_something_else_gets_its_page():
    mission = Mission.model_validate({"path": {"type": "minimum-jerk", "end": [0.1, 0.0, 0.0], "duration": 1.0}})
    own = mission.model_copy(update={"controller": section_of(Steady).model_validate({"type": "steady", "mass": 3.0})})
    plan = own.plan()
    page = missions_page([flown_mission(own, plan, fly(plan), Path())])
    assert '"label":"steady"' in page
    assert list(in_common(own.controller, NestedSaturation)) == []
    assert in_common(mission.controller.model_copy(), NestedSaturation) == {}


def test_the_example_says_how_well_it_flies_beside_the_papers():
    run = subprocess.run([sys.executable, "examples/own_controller.py"], cwd=ROOT, check=True, capture_output=True, text=True)
    errors = [float(re.search(r"RMSE ([0-9.e+-]+) mm", line)[1]) for line in run.stdout.splitlines()]
    assert len(errors) == 2
    assert max(errors) < 50.0
