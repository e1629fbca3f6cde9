"""Random vehicles, from data sheets as they are built and from numbers alone, and their hover under any law."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from quadstep.identify.datasheet import Datasheet
from quadstep.identify.vehicle_estimate import LOADED, RPM, estimate, vehicle_of
from quadstep.linear.grade import Grade, grade
from quadstep.mission.airframe import LAYOUTS
from quadstep.mission.read import check_mission
from quadstep.mission.schema import Mission

LIGHTEST, HEAVIEST = 0.05, 12.0
UNGRADED = ("mppi", "raptor", "planned-lqr")
"""Laws without slopes (`mppi`), without gains (`raptor`, trained), or whose loop takes minutes to grade (`planned-lqr`):
docs/controllers.md.
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


def random_vehicle(random: np.random.Generator) -> dict[str, Any]:
    """A vehicle table of any numbers that a body and its rotors can have: a third of them without drag, the others with a
    hundredth to ten times the drag that data sheets take as usual, at hover 0.3 1/s.
    """
    layout = str(random.choice(list(LAYOUTS)))
    count = LAYOUTS[layout][0]
    arm = 0.03 * 30.0 ** random.random()
    mass = 8.0 * arm**1.5 * 4.0 ** (random.random() - 0.5)
    level = mass * (arm * (0.3 + 0.5 * random.random())) ** 2
    hover = 250.0 * 10.0 ** random.random()  # rad/s
    k_f = mass * 9.81 / count / hover**2
    k_m = k_f * arm * 10.0 ** (random.random() - 1.7)
    rise = 0.008 * 20.0 ** random.random()
    drag = mass * 0.3 / (count * hover) * 1e3 ** (random.random() - 2.0 / 3.0) if random.random() < 2.0 / 3.0 else 0.0
    return {
        "mass": mass,
        "inertia": [level, level * (0.6 + 0.8 * random.random()), level * (1.0 + 0.5 * random.random())],
        "layout": layout,
        "arm": arm,
        "rotor": {
            "thrust_coefficient": k_f,
            "torque_coefficient": k_m,
            "inertia": k_m * hover * 0.4 * random.random() ** 2,
            "rise_time": rise,
            "fall_time": rise * (0.7 + 0.8 * random.random()),
            "slowest": 0.1 * hover,
            "fastest": hover * math.sqrt(1.5 + 3.5 * random.random()),
            "radius": 0.4 * arm,
        },
        "drag": {"rotor": [drag, drag, drag * random.random()]},
        "command": {"speed": 3.0 * hover, "delay": 0.015 * random.random()},
    }


def any_vehicle(random: np.random.Generator) -> dict[str, Any]:
    """A vehicle from a data sheet, the same without drag, or one from numbers alone."""
    kind = random.integers(3)
    if kind == 0:
        return random_vehicle(random)
    table = vehicle(random_sheet(random))
    return table if kind == 1 else {**table, "effects": {"drag": False}}


def hover(table: dict[str, Any], law: str, learning: bool = False, **more: Any) -> Mission:
    """The vehicle at rest under a law with its default gains. learning: with its nets, if it has any, as missions fly it."""
    mission = check_mission({"vehicle": table, "path": HOVER, "controller": {"type": law}, **more}, "hover", Path())
    nets = mission.controller.table
    if nets is None or learning:
        return mission
    off = mission.controller.model_copy(update={"nets": nets.model_copy(update={"enabled": False})})
    return mission.model_copy(update={"controller": off})


def hover_grade(table: dict[str, Any], law: str, learning: bool = False, **more: Any) -> Grade:
    """How the loop at rest is graded."""
    return grade(hover(table, law, learning, **more))
