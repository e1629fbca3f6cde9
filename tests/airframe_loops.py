"""Plans of real vehicles for tests of their closed loop, and a controller that shows what it is told."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from quadstep.control.registry import controllers
from quadstep.engines.engine import Engine
from quadstep.engines.fly import fly
from quadstep.engines.kernel import fly_lanes
from quadstep.interfaces.controller import Command, Controller, Measured
from quadstep.mission.multirotor import MultirotorMission
from quadstep.numbers import Number, Vector, vector, where

CONTROLLERS = tuple(name for name in controllers(Measured) if name != "raptor")  # whose 10 ms do not suit this latency
NEAR = {"adrc": 2e-5, "state-space-backstepping": 2e-5}
"""How near single precision stays to double where observers or differences are fast; 1e-5 elsewhere."""

ESTIMATED = ("geometric", "backstepping", "rotation-backstepping", "indi")
SENSORS = {
    "gyro_noise": 0.002, "gyro_bias": 0.005, "gyro_walk": 1e-4, "accelerometer_noise": 0.02, "accelerometer_bias": 0.05,
    "accelerometer_walk": 1e-3, "position_noise": 0.002, "velocity_noise": 0.02, "attitude_noise": 0.005, "fix_period": 0.01,
    "latency": 0.022, "imu_latency": 0.002,
}  # fmt: skip
EVERYTHING = {
    "seed": 3,
    "vehicle": {"preset": "research-2.6kg", "ground": 0.0, "effects": {"battery": True, "ground": True}},
    "path": {"type": "figure-eight", "length": 2.0, "width": 1.0, "period": 6.0, "ramp": 1.0, "centre": [0.0, 0.0, 1.0],
        "yaw": 0.4, "yaw_rate": 0.2},
    "wind": {"mean": [4.0, 1.0, 0.0], "swing": [1.0, 0.0, 0.5], "swing_frequency": 9.0,
        "gust": {"velocity": [0.0, 3.0, 0.0], "start": 0.1, "length": 0.4}, "turbulence": {"wind_20": 4.0, "height": 6.0}},
    "sensors": SENSORS,
    "events": [{"type": "payload", "time": 0.2, "mass": 0.3, "position": [0.0, 0.02, -0.05]},
        {"type": "centre-of-gravity", "time": 0.1, "until": 0.35, "shift": [0.005, 0.0, 0.0]},
        {"type": "rotor", "time": 0.3, "rotor": 2, "efficiency": 0.9}],
    "simulation": {"duration": 0.5},
}  # fmt: skip
STILL = {"type": "step", "start": [0.0, 0.0, 5.0], "end": [0.0, 0.0, 5.0], "time": 0.001, "duration": 0.3}
PLAIN = {"vehicle": {"preset": "research-2.6kg", "effects": {"drag": False, "gyroscopic": False}}, "path": STILL}
MASS, GRAVITY = 2.644, 9.81


def plan(base=PLAIN, **changes):
    return MultirotorMission.model_validate({**base, **changes}).plan()


def everything(controller, estimator=False, **changes):
    return plan(EVERYTHING, controller={"type": controller}, sensors={**SENSORS, "estimator": estimator}, **changes)


def on_lanes(plans, double=True):
    """The logs of plans of one structure."""
    first = plans[0]
    return fly_lanes(first.loop, [one.parameters for one in plans], [one.start for one in plans], first.ticks, double=double)


def on_floats(one):
    return fly(one, Engine.PYTHON)


class SpyGains(NamedTuple):
    """What the spy asks for, and from when on it asks for `broken` instead."""

    thrust: Number = MASS * GRAVITY
    torque: Vector = vector(0.0, 0.0, 0.0)
    breaks: Number = math.inf
    broken: Number = math.nan


class SpyMemory(NamedTuple):
    """How often each of its loops was asked, when the position loop was last, and what that was told."""

    guided: Number
    asked: Number
    guided_at: Number
    told: Vector


def tally(memory, measured):
    """How often each loop was asked, and when the position loop was."""
    return vector(memory.guided, memory.asked, memory.guided_at)


@dataclass(frozen=True)
class Spy(Controller):
    """Asks for the same all the time; what it `shows` stands in the log as yaw_d, pitch_d, roll_d."""

    shows: Callable[[SpyMemory, Measured], Vector] = tally

    def start(self, measured, gains):
        return SpyMemory(0.0, 0.0, -1.0, measured.position)

    def guide(self, memory, measured, reference, gains, t, period):
        return memory._replace(guided=memory.guided + 1.0, guided_at=t, told=measured.position)

    def law(self, memory, measured, reference, gains, t, period) -> tuple[Command, Any]:
        memory = memory._replace(asked=memory.asked + 1.0)
        thrust = where(t >= gains.breaks, gains.broken, gains.thrust)
        return Command(thrust, gains.torque, desired_attitude=self.shows(memory, measured)), memory


def spied(shows=tally, gains=None, base=PLAIN, **changes):
    """A plan flown by the spy."""
    return plan(base, **changes).with_controller(Spy(shows), gains or SpyGains())


def shown(log):
    return log.table("yaw_d", "pitch_d", "roll_d")


def ticks_of(log, step=0.002):
    return np.round(log.column("t") / step).astype(int)
