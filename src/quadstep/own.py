"""What a user's own controller, plant, path, wind, disturbance, metric, sensor or estimator is made of (docs/extending.md).

>>> from typing import NamedTuple
>>> from quadstep.own import Wind, gain, sin, vector
>>> class SwellNumbers(NamedTuple):
...     speed: float = gain(2.0, "m/s", "largest speed of the air")
>>> class Swell(Wind):
...     Numbers = SwellNumbers
...     def wind(self, air, p, time, truth):
...         return vector(p.wind.speed * sin(time), 0.0, 0.0)
"""

from quadstep.control.opaque import MeasuredArrays, ReferenceArrays
from quadstep.control.vectoring import desired_attitude, project, up_axis, vee_error
from quadstep.interfaces.closed_loop import Clock, Outcome, finite
from quadstep.interfaces.controller import BodyRates, Command, Condition, Controller, Measured, RotorSpeeds, RotorThrusts
from quadstep.interfaces.gain import believed, from_gains, gain, given, usual
from quadstep.interfaces.log import Metric
from quadstep.interfaces.plant import Drawn, Model, Reference, Rotor
from quadstep.io.errors import UserError
from quadstep.numbers import (
    Matrix,
    Number,
    Table,
    Vector,
    absolute,
    atan2,
    clip,
    cos,
    exp,
    log,
    matrix,
    maximum,
    minimum,
    outer,
    power,
    scan,
    sigmoid,
    sin,
    sqrt,
    total,
    vector,
    where,
)
from quadstep.numbers.noise import normals
from quadstep.numbers.rotations import (
    conjugate,
    cross,
    from_rotation_vector,
    multiply,
    normalised,
    quaternion_of,
    rotation_matrix,
    rotation_vector,
    yaw_pitch_roll,
)
from quadstep.sensing.sensors import DeclaredEstimator as Estimator
from quadstep.sensing.sensors import DeclaredSensor as Sensor
from quadstep.sensing.sensors import Navigation, Sensors
from quadstep.vehicle.declared import DeclaredPlant as Plant
from quadstep.vehicle.declared import PlantParameters
from quadstep.vehicle.paper import DeclaredDisturbance as Disturbance
from quadstep.vehicle.paper import State
from quadstep.vehicle.rigid_body import Motion
from quadstep.world.air import DeclaredWind as Wind
from quadstep.world.paths import DeclaredPath as Path

__all__ = [
    "BodyRates", "Clock", "Command", "Condition", "Controller", "Disturbance", "Drawn", "Estimator", "Matrix",
    "Measured", "MeasuredArrays", "Metric", "Model", "Motion", "Navigation", "Number", "Outcome", "Path", "Plant",
    "PlantParameters", "Reference", "ReferenceArrays", "Rotor", "RotorSpeeds", "RotorThrusts", "Sensor", "Sensors",
    "State", "Table", "UserError", "Vector", "Wind", "absolute", "atan2", "believed", "clip", "conjugate", "cos",
    "cross", "desired_attitude", "exp", "finite", "from_gains", "from_rotation_vector", "gain", "given", "log",
    "matrix", "maximum", "minimum", "multiply", "normalised", "normals", "outer", "power", "project",
    "quaternion_of", "rotation_matrix", "rotation_vector", "scan", "sigmoid", "sin", "sqrt", "total", "up_axis",
    "usual", "vector", "vee_error", "where", "yaw_pitch_roll",
]  # fmt: skip
