"""The page flies as `quadstep fly` does, to the bit: random values of every control that a mission file can say too."""

import copy
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from quadstep.engines.fly import fly
from quadstep.io.errors import UserError
from quadstep.mission.schema import Mission
from tests.challenge.search import Attempt, Search
from tests.pages import data_of, flown, fly_page, write_page

Content = dict[str, Any]
Values = list[float]

LINE = {"type": "minimum-jerk", "end": [4.0, 1.0, 2.0], "duration": 3.0}
CIRCLE = {"type": "circle", "centre": [0.0, 0.0, 4.0], "radius": 3.0, "period": 9.0, "ramp": 1.0}
EIGHT = {"type": "figure-eight", "length": 6.0, "width": 3.0, "period": 9.0, "ramp": 1.0, "centre": [0.0, 0.0, 5.0]}
TURBULENT = {
    "mean": [6.0, 0.0, 0.0],
    "turbulence": {"wind_20": 8.0},
    "gust": {"velocity": [0.0, 2.0, 0.0], "start": 0.2, "length": 1.0},
}
STILL = {"mean": [0.0, 0.0, 0.0], "turbulence": {"wind_20": 5.0, "airspeed": 3.0}}
CARRIED = [
    {"type": "rotor", "rotor": 1, "time": 0.3, "efficiency": 0.9},
    {"type": "payload", "time": 0.2, "mass": 0.1, "position": [0.05, 0.0, -0.05]},
]
SHORT = {"simulation": {"duration": 1.5}}
X500, CRAZYFLIE = {"preset": "x500"}, {"preset": "crazyflie"}
START = {"position": [0.5, 0.0, 1.0], "attitude": [0.1, 0.1, -0.1]}

BASES: dict[str, Content] = {
    "paper": {"path": LINE, "controller": {"type": "backstepping", "mass": 1.0}, "start": START},
    "completed": {"path": LINE, "controller": {"type": "completed-backstepping", "mass": 1.0}, "start": START},
    "wind": {"vehicle": X500, "path": CIRCLE, "controller": {"type": "geometric"}, "wind": TURBULENT, **SHORT},
    "events": {"vehicle": X500, "path": EIGHT, "controller": {"type": "pid"}, "wind": STILL, "events": CARRIED, **SHORT},
    "small": {"vehicle": CRAZYFLIE, "path": CIRCLE, "controller": {"type": "indi"}, "wind": TURBULENT, **SHORT},
}  # fmt: skip


def put(content: Content, key: str, value: object) -> None:
    """Set a dotted key."""
    *levels, last = key.split(".")
    for level in levels:
        content = content[int(level)] if isinstance(content, list) else content.setdefault(level, {})
    content[last] = value


def lasts(content: Content, values: Values) -> None:
    put(content, "path.duration", values[0])


def moved(content: Content, values: Values) -> None:
    """The start, which the page moves from where the file has it."""
    at = content.get("start", {}).get("position") or [
        float(each) for each in Mission.model_validate(content).plan().start.position
    ]
    put(content, "start.position", [a + b if b else a for a, b in zip(at, values, strict=True)])


def one(key: str) -> Callable[[Content, Values], None]:
    return lambda content, values: put(content, key, values[0])


def all_of(key: str) -> Callable[[Content, Values], None]:
    return lambda content, values: put(content, key, list(values))


SAID: dict[str, Callable[[Content, Values], None]] = {
    "t_f": lasts, "target": all_of("path.end"), "yaw_end": one("path.yaw_end"), "period": one("path.period"),
    "radius": one("path.radius"), "start": moved, "tilt": all_of("start.attitude"), "gust": all_of("wind.gust.velocity"),
    "disturbance": one("disturbance.scale"), "torque": all_of("disturbance.torque"), "fault_1": one("events.0.efficiency"),
    "payload_1": one("events.1.mass"), "nets_start": one("controller.nets.start"),
}  # fmt: skip
"""How a mission file says what a control says; gains have their own names."""

NETS = ("F1", "F2", "kappa1", "kappa2")


def say(content: Content, control: dict[str, Any], values: Values, own: bool) -> bool:
    """Write what a control says into a mission's content; False where no key says it."""
    name = control["id"]
    if own and name in NETS:
        put(content, f"controller.nets.{name}", values[0])
    elif own and not name.startswith(("believed_", "neurons", "nets")):
        put(content, f"controller.{name}", values if len(values) > 1 else values[0])
    elif name == "size":
        put(content, "path.length", values[0])
        put(content, "path.width", values[1])
    elif name == "wind":
        put(content, "disturbance.force" if "wind" not in content else "wind.mean", list(values))
    elif name == "mass" and "preset" not in content.get("vehicle", {}):
        put(content, "vehicle.mass", values[0])
    elif name in SAID and not (name == "gust" and "gust" not in content["wind"]):
        SAID[name](content, values)
    else:
        return False
    return True


def drawn(random: np.random.Generator, control: dict[str, Any]) -> Values:
    """A value for each component: often zero or the file's, else anywhere on the slider."""

    def value(component: dict[str, Any]) -> float:
        which = random.random()
        if which < 0.1 and control["low"] <= 0.0 <= control["high"]:
            return 0.0
        if which < 0.2:
            return float(component["value"])
        low, high = control["min"], control["max"]
        if control["scale"] == "log":
            middle = float(component["value"])
            return float(min(max(middle * np.exp(random.uniform(-0.7, 0.7)), low), high))
        return float(random.uniform(low, high))

    return [value(component) for component in control["components"]]


def refused(content: Content) -> bool:
    """Whether a file cannot say this."""
    try:
        Mission.model_validate(content)
    except UserError:
        return True
    return False


def settings(seed: int) -> Iterator[Attempt]:
    random = np.random.default_rng(seed)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "page.html"
        write_page(path, *(flown(name, Mission.model_validate({**content, "name": name})) for name, content in BASES.items()))
        flights = {one["id"]: one for one in data_of(path.read_text())["flights"]}
        while True:
            asked, contents = [], []
            for name, base in BASES.items():
                content, values = copy.deepcopy(base), {}
                mine = flights[name]["controllers"][0]["controls"]
                for control in [*flights[name]["controls"], *mine]:
                    new, before = drawn(random, control), copy.deepcopy(content)
                    if control["kind"] == "number" and random.random() < 0.5 and say(content, control, new, control in mine):
                        if refused(content):  # a control's 0, say of a payload, is for the file no such event
                            content = before
                        else:
                            values[control["id"]] = new
                asked.append({"flight": name, "values": values})
                contents.append(content)
            for request, answer, content in zip(asked, fly_page(path, *asked), contents, strict=True):
                log = fly(Mission.model_validate(content).plan())
                ended = answer["tick"] * answer["ticks"]["step"]
                equal = ended == log.ended and np.array_equal(answer["values"], log.rows)  # but for the sign of a zero
                yield Attempt(0.0 if equal else 2.0, f"{request}")


SEARCHES = [
    Search("page against fly", "the page gives the numbers of `quadstep fly` for the same settings, to the bit", settings)
]
