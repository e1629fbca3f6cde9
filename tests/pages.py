"""Pages for tests: their data read back, and their laws flown in Node.js as a browser would."""

import base64
import contextlib
import json
import re
import subprocess
import threading
from pathlib import Path
from typing import Any

import numpy as np

from quadstep.engines.fly import fly
from quadstep.mission.schema import Mission
from quadstep.page.build import fill, page_data
from quadstep.page.flights import ShownFlight
from quadstep.page.laws import Laws
from quadstep.studies.paper.cases import adaptive, nested
from tests.needs import NODE as NODE_JS
from tests.needs import needs, program

NODE = program("node")
needs_node = needs(NODE_JS)
CLIENT = Path(__file__).parent / "page_client.cjs"

STAND_IN = (
    "<!doctype html><title>quadstep</title>"
    '<script id="quadstep-data" type="application/json">{}</script><script id="quadstep-laws">0</script>'
)


def data_of(text: str) -> dict[str, Any]:
    """What a page is told, references resolved."""
    (content,) = re.findall(r'<script id="quadstep-data" type="application/json">(.*?)</script>', text, re.DOTALL)
    data = json.loads(content)

    def resolve(value: Any) -> Any:
        if isinstance(value, list):
            return [resolve(part) for part in value]
        if isinstance(value, dict):
            return data["shared"][value["$"]] if "$" in value else {key: resolve(part) for key, part in value.items()}
        return value

    return {**data, "flights": resolve(data["flights"])}


def run_node(script: str, *arguments: str, given: str = "") -> str:
    """What a script prints."""
    command = [NODE or "node", *(["-e", script] if script else []), *arguments]
    done = subprocess.run(command, input=given, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


def fly_page(path: Path, *requests: dict[str, Any]) -> list[dict[str, Any]]:
    """Flights of a page by its own laws, with the same bits by WebAssembly (`quick`) where it has that.

    A request names flight, controller (its place) and values of controls.
    """
    answers = json.loads(run_node("", str(CLIENT), str(path), given=json.dumps(requests)))
    for answer in answers:
        assert answer.setdefault("quick", None) is not False
        answer["parameters"] = np.frombuffer(base64.b64decode(answer["parameters"]))
        answer["values"] = np.frombuffer(base64.b64decode(answer["values"])).reshape(-1, len(answer["columns"]))
    return answers


SHORT = {"duration": 0.4}
TILTED = {"position": [0.5, -0.5, 0.0], "attitude": [0.1, 0.1, -0.1], "rates": [0.1, -0.2, 0.3]}
WAYPOINTS = {
    "type": "waypoints",
    "waypoints": [{"t": 0.0, "position": [0.0, 0.0, 0.0]}, {"t": 0.5, "position": [0.3, 0.0, 0.3], "yaw": 0.3},
        {"t": 1.0, "position": [0.5, 0.5, 0.0]}],
}  # fmt: skip
CIRCLE = {"type": "circle", "centre": [0.0, 0.0, 5.0], "radius": 3.0, "period": 8.0, "yaw_rate": 0.2, "ramp": 1.0}
UNEQUAL = {"inertia": [5.0, 6.0, 8.0]}


def mission(**sections):
    path = {"type": "minimum-jerk", "end": [4.0, 1.0, 2.0], "duration": 6.0}
    return Mission.model_validate({"path": path, "start": TILTED, "simulation": SHORT, **sections})


FLIGHTS = {
    "backstepping": mission(vehicle=UNEQUAL),
    "printed kinematics": mission(vehicle={**UNEQUAL, "kinematics": "printed"}),
    "rotor limits": mission(vehicle={"rotors": {"limits": [0.0, 12.0]}}),
    "late learning": mission(controller=adaptive(start=0.2)),
    "no nets": mission(controller=adaptive(enabled=False)),
    "completed": mission(vehicle=UNEQUAL, controller={"type": "completed-backstepping"}),
    "nested saturation": mission(vehicle=UNEQUAL, controller=nested()),
    "waypoints": mission(path=WAYPOINTS, simulation={"duration": 1.2}),
    "circle": mission(path=CIRCLE, start={}),
    "disturbed": mission(disturbance={"scale": 2.0, "force": [0.3, -0.2, 0.1], "torque": [0.1, 0.0, -0.2]}),
    "other clock": mission(simulation={"duration": 0.7, "step": 0.001, "control_period": 0.005, "log_period": 0.007}),
    "forty neurons": mission(controller=adaptive(neurons=40), simulation={"duration": 0.3}),
    "three neurons": mission(controller=adaptive(neurons=3)),
}


def flown(name, given, folder=Path(), log=None):
    plan = given.plan(folder)
    log = log or fly(plan)
    return ShownFlight(name.replace(" ", "-"), name, "Missions", given, plan, log, given.flight_metrics(log)[0], folder)


def write_page(path, *flights):
    laws = Laws()
    data = page_data("title", (), flights, (), (), laws)
    path.write_text(fill(STAND_IN, "title", data, laws.script()), encoding="utf-8")
    return path


def value_of(term, parameters):
    """A term of a condition on the page, worked out."""
    if isinstance(term, int | float):
        return term
    if "name" in term:
        return parameters[term["name"]]
    first, *others = [value_of(part, parameters) for part in term["of"]]
    if term["op"] == "where":
        return others[0] if first else others[1]
    for other in others:
        first = {
            ">": first > other,
            "+": first + other,
            "-": first - other,
            "*": first * other,
            "max": max(first, other),
            "min": min(first, other),
        }[term["op"]]
    return first


@contextlib.contextmanager
def serving(running):
    """The port of a server that answers while the block runs."""
    thread = threading.Thread(target=running.serve_forever, kwargs={"poll_interval": 0.02})
    thread.start()
    try:
        yield running.server_address[1]
    finally:
        running.shutdown()
        thread.join()
        running.server_close()
