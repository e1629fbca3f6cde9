"""Shared by the tests of comparisons: a small study of short flights, and the content of a folder of results."""

import csv
from concurrent.futures import Future
from contextlib import contextmanager
from pathlib import Path

from quadstep.studies.comparison.cells import study_of
from quadstep.studies.comparison.cost import counted
from tests.commands import replace, write

HEAD = """
name = "Small"
vehicles = ["research-2.6kg"]
seeds = 12
"""
CALM = """
[common]
limits = { distance = 5.0, rate = 60.0 }
sensors = { position_noise = 0.005, gyro_noise = 0.01 }
simulation = { control_period = 0.004, guidance_period = 0.004 }

[paths.up.mission]
path = { type = "step", end = [0.2, 0.0, 0.3], time = 0.1, duration = 0.6 }

[scenarios.calm]
"""
WINDY = """[scenarios.windy]
mission = { wind = { mean = [4.0, 0.0, 0.0], turbulence = { wind_20 = 8.0, height = 6.0 } } }
vary = { "vehicle.mass" = { type = "uniform", low = 2.4, high = 2.9 } }
"""
BODY = CALM + WINDY
CONTROLLERS = """
[controllers.soft]
controller = { type = "geometric", k_x = 3.0, k_v = 1.0 }
frozen = "far too soft"
[controllers.firm]
controller = "geometric"
frozen = "as shipped"
"""
TUNING = """
[controllers.PID]
controller = "pid"
ranges = { position = {}, velocity = { low = 1.0, high = 20.0 } }
[tuning]
budget = 4500
repeats = 1
constraints = {}
flown = [{ path = "up", scenario = "windy" }]
"""
OPTIONAL = """
[controllers.policy]
controller = "raptor"
frozen = "as published"
optional = true
"""
SMALL = HEAD + BODY + CONTROLLERS
SMALLEST = HEAD + CALM + CONTROLLERS
"""One situation: half the code to compile."""


def study(text=SMALL, folder=None):
    """A study as read."""
    return study_of(text, "study.toml", folder or Path())


def written(folder, text=SMALL):
    """A study's file."""
    folder.mkdir(parents=True, exist_ok=True)
    return write(folder, text, "study.toml")


def rows(folder, name):
    """The rows of a CSV."""
    with (folder / name).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


class Here:
    """A pool that works at once, in this process."""

    def submit(self, function, *arguments):
        future = Future()
        try:
            future.set_result(function(*arguments))
        except BaseException as error:
            future.set_exception(error)
        return future


@contextmanager
def here(_workers=None):
    yield Here()


def counted_once(plan):
    """The instructions of a law, which is compiled for an emulated processor the first time only, whatever it flies then."""
    key = repr(plan.loop.controller)
    if key not in COUNTED:
        COUNTED[key] = counted(plan)
    return COUNTED[key]


COUNTED = {}


def studies_in_this_process(monkeypatch):
    """Processes of their own cost seconds, as does measuring often, where they are not the point."""
    replace(monkeypatch, "quadstep.studies.comparison.jobs.drawing_pool", here)
    monkeypatch.setattr("quadstep.studies.comparison.cost.REPEATS", 1)
    replace(monkeypatch, "quadstep.studies.comparison.cost.counted", counted_once)
