"""A digest of every number that flights are set up with; run as a program it prints them, one a line, with its name: of every
third law on each preset, or of all with `every` behind it.
"""

import hashlib
import json
import sys
import tempfile
import tomllib
from pathlib import Path

import numpy as np

from quadstep.control.registry import STOCK, controllers
from quadstep.interfaces.controller import Measured
from quadstep.mission.airframe import LAYOUTS
from quadstep.mission.check import check
from quadstep.mission.listings import preset_names
from quadstep.mission.read import check_mission, plan_mission, read_mission, read_toml
from quadstep.numbers import Table, flatten
from quadstep.studies.campaign.draws import draw
from quadstep.studies.campaign.planner import planner
from quadstep.studies.campaign.schema import CampaignFile, campaign_of, read_campaign
from quadstep.studies.comparison.cells import shipped_study
from quadstep.studies.tuning.ground import tuning_request

EXAMPLES = Path(__file__).parent.parent / "examples"
CONTROLLERS = tuple(controllers(Measured))

PLACED = ("raptor", *STOCK)
"""Laws that ask how rotors lie and spin."""
STEP = {"type": "step", "end": [1.0, 0.0, 2.0], "duration": 3.0}
FLIGHTS = np.arange(40)

TILTED = [
    {"position": [0.21, 0.01, 0.03], "axis": [0.1, 0.0, 0.995], "spin": "ccw"},
    {"position": [0.11, 0.19, 0.0], "axis": [0.0, 0.1, 0.995], "spin": "cw"},
    {"position": [-0.12, 0.18, 0.01], "axis": [-0.1, 0.0, 0.995], "spin": "ccw"},
    {"position": [-0.2, -0.02, 0.0], "axis": [0.0, -0.1, 0.995], "spin": "cw"},
    {"position": [-0.1, -0.2, 0.0], "spin": "ccw"},
    {"position": [0.13, -0.17, -0.01], "spin": "cw"},
]

WIDE = """
mission = {}
[vary]
"vehicle.mass" = {type = "normal", mean = 2.6, deviation = 0.3, low = 1.7, high = 3.1}
"vehicle.rotor.torque_coefficient" = {type = "log-normal", median = 1e-7, sigma = 0.5, low = 2e-8}
"vehicle.rotor.rise_time" = {type = "log-normal", median = 0.03, sigma = 0.3}
"wind.mean.2" = {type = "normal", mean = -1.0, deviation = 0.2, low = -0.9}
"vehicle.inertia.2" = {type = "sobol", low = 0.03, high = 0.05}
"path.end.0" = {type = "sobol", low = -1.0, high = 1.0}
"path.end.1" = {type = "uniform", low = -1.0, high = 1.0}
"controller.k_x" = {type = "choice", values = [8.0, 9.0, 10.0], weights = [0.1, 0.7, 0.3]}
"path.end.2" = {type = "grid", low = 0.3, high = 1.9, count = 7}
[[correlated]]
keys = ["wind.mean.0", "wind.mean.1", "start.rates.0", "start.rates.1"]
mean = [1.0, 2.0, 0.1, 0.2]
deviations = [0.3, 0.7, 0.1, 0.2]
correlation = [[1.0, 0.3, 0.1, 0.2], [0.3, 1.0, 0.7, 0.1], [0.1, 0.7, 1.0, -0.3], [0.2, 0.1, -0.3, 1.0]]
"""


def digest(*numbers):
    """Of the bits of floats, arrays and tables."""
    found = hashlib.sha256()
    for one in numbers:
        found.update(np.asarray(one.array if isinstance(one, Table) else one, dtype=np.float64).tobytes())
    return found.hexdigest()


def of_plan(plan):
    """A flight's parameters and start."""
    return digest(*flatten((plan.start, plan.parameters)))


def recording(folder):
    """An uneven recording with a gap."""
    random = np.random.default_rng(3)
    t = np.cumsum(random.uniform(0.001, 0.02, 900)) + np.where(np.arange(900) < 500, 0.0, 4.0)
    columns = [t, np.sin(t), np.cos(0.7 * t), 0.1 * t, (2.0 * t + 3.0) % 6.283 - 3.1415]
    rows = [",".join(map(repr, map(float, row))) for row in zip(*(np.round(one, 6) for one in columns), strict=True)]
    (folder / "recording.csv").write_text("\n".join(["t,x,y,z,psi", *rows]))
    return {"type": "recorded", "file": "recording.csv"}


def waypoints():
    """Two hundred of them, unevenly apart."""
    random = np.random.default_rng(4)
    t = np.round(np.concatenate([[0.0], np.cumsum(random.uniform(0.05, 3.0, 199))]), 3).tolist()
    places = np.round(random.normal(size=(200, 4)), 3).tolist()
    rows = [{"t": at, "position": place[:3], "yaw": place[3]} for at, place in zip(t, places, strict=True)]
    return {"type": "waypoints", "waypoints": rows}


def missions(folder, every):
    """Missions by name, and where the files are that they name. every: each law on each preset."""
    yield "recorded", {"path": recording(folder)}, folder
    yield "waypoints", {"path": waypoints()}, folder
    for place, name in enumerate(preset_names()):
        laws = [one for one in CONTROLLERS if one not in PLACED]
        for kind in [*(laws if every else laws[place % 3 :: 3]), *(STOCK if name == "crazyflie" else ())]:
            yield f"{name}, {kind}", {"vehicle": {"preset": name}, "path": STEP, "controller": {"type": kind}}, folder
    for name in LAYOUTS:
        vehicle = {"preset": "x500", "layout": name, "arm": 0.27}
        yield f"layout {name}", {"vehicle": vehicle, "path": STEP, "controller": {"type": "backstepping"}}, folder
    tilted = {"preset": "research-2.6kg", "rotors": TILTED}
    yield "tilted rotors", {"vehicle": tilted, "path": STEP, "controller": {"type": "lqr"}}, folder


def campaigns(folder):
    """Campaigns by name."""
    for path in sorted(EXAMPLES.glob("*.toml")):
        if "mission" in read_toml(path):
            yield path.stem, read_campaign(path)
    content = {"vehicle": {"preset": "research-2.6kg"}, "path": STEP, "wind": {"mean": [1.0, 1.0, 1.0]}}
    file = check(CampaignFile, tomllib.loads(WIDE), "wide")
    yield "every distribution", campaign_of(file, "", content, "wide", folder)


def digests(every):
    """By name."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for path in sorted(EXAMPLES.glob("*.toml")):
            content = read_toml(path)
            if "path" in content and content["path"]["type"] != "recorded":  # one of ours is below
                yield f"example {path.stem}", of_plan(plan_mission(read_mission(path), path))
            if "tune" in content:
                tuned = tuning_request(path, "", content, path.parent)
                places = np.linspace(0.0, 1.0, 23)
                values = [gain.range.value(place) for gain in tuned.gains for place in places]
                yield f"candidates of {path.stem}", digest(values, tuned.start)
        study = shipped_study()
        for situation in study.situations():
            content = study.content(situation, {"type": "rotation-backstepping"})
            yield f"study, {situation.label}", of_plan(check_mission(content, "study").plan())
        for one, content, beside in missions(folder, every):
            yield one, of_plan(check_mission(content, one, beside).plan(beside))
        for one, campaign in campaigns(folder):
            drawn = draw(campaign.file, FLIGHTS)
            yield f"draws of {one}", digest(*(column.values for column in drawn.values()))
            for place, batch in enumerate(planner(campaign).batches(FLIGHTS, drawn)):
                yield f"flights of {one}, {place}", digest(batch.rows, *flatten((batch.start, batch.parameters)))
    matrix = np.random.default_rng(5).normal(size=(40, 40))
    yield "BLAS", digest(matrix @ matrix)
    yield "NumPy's exp", digest(np.exp(np.linspace(-20.0, 20.0, 20_001)))


if __name__ == "__main__":
    print(json.dumps(dict(digests("every" in sys.argv))))  # noqa: T201 (it is what this program does)
