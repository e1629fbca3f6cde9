"""Random data sheets of vehicles as they are built, and their hover under any law."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from quadstep.identify.datasheet.estimate import LOADED, RPM, estimate, vehicle_of
from quadstep.identify.datasheet.sheet import Datasheet
from quadstep.linear.grade import Grade, grade
from quadstep.mission.airframe import LAYOUTS
from quadstep.mission.read import check_mission
from quadstep.mission.schema import Mission

LIGHTEST, HEAVIEST = 0.05, 12.0
UNGRADED = ("mpc", "mppi", "raptor", "planned-lqr")
"""Laws without slopes (`mppi`), without gains (`raptor`, trained), whose loop takes minutes to grade (`planned-lqr`), or whose
default gains are known to lack margin (`mpc`): docs/controllers.md.
"""

HOVER = {"type": "step", "start": [0.0, 0.0, 2.0], "end": [0.0, 0.0, 2.0], "time": 0.0, "duration": 5.0}


def random_sheet(random: np.random.Generator) -> Datasheet:
    """Three to twenty inches, with what people know or leave out; it lifts 1.5 to 5 times its weight."""
    layout = str(random.choice(list(LAYOUTS)))
    inches = 3.0 * (20.0 / 3.0) ** random.random()
    diameter, count = 0.0254 * inches, LAYOUTS[layout][0]
    loading = 3.0 * 8.0 ** random.random()  # kg/m^2 of the discs
    mass = min(max(loading * count * math.pi / 4.0 * diameter**2, LIGHTEST), HEAVIEST)
    cells = int(random.integers(1, 13))
    lift = 1.5 + 3.5 * random.random()
    top = math.sqrt(lift * mass * 9.81 / count / (0.11 * 1.225 * diameter**4 / (4.0 * math.pi**2)))
    content: dict[str, Any] = {
        "name": f"{inches:.3g} inches, {mass:.3g} kg, {layout}",
        "mass": mass,
        "layout": layout,
        "wheelbase": diameter * (1.2 if count == 4 else 2.0) * (1.2 + random.random()),
        "kv": min(top / (LOADED * RPM * 4.2 * cells), 1e5),
        "cells": cells,
        "propeller": {"inches": [inches, 0.5 * inches]},
    }
    if random.random() < 0.3:
        content["rise_time"] = 0.015 * 6.0 ** random.random()
    if random.random() < 0.3:
        content["motor_mass"] = (0.2 + 0.3 * random.random()) * mass / count
    if random.random() < 0.3:
        content["propeller"]["mass"] = 0.16 * diameter**2 * (0.7 + 0.8 * random.random())
    return Datasheet.model_validate(content)


def vehicle(sheet: Datasheet) -> dict[str, Any]:
    """The vehicle table of a mission."""
    return vehicle_of(sheet, estimate(sheet)).model_dump(mode="json", exclude_none=True)


def hover(table: dict[str, Any], law: str, **more: Any) -> Mission:
    """The vehicle at rest under a law with its default gains and no nets."""
    mission = check_mission({"vehicle": table, "path": HOVER, "controller": {"type": law}, **more}, "hover", Path())
    nets = mission.controller.table
    if nets is None:
        return mission
    off = mission.controller.model_copy(update={"nets": nets.model_copy(update={"enabled": False})})
    return mission.model_copy(update={"controller": off})


def hover_grade(table: dict[str, Any], law: str, **more: Any) -> Grade:
    """How the loop at rest is graded."""
    return grade(hover(table, law, **more))
