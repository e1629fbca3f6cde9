"""Where the vehicle should be: paths over time, from the paper's minimum jerk (Eqs 68-75) to recorded flights.

A path is a `PathLaw`: from a time [s] and its parameters it computes a `Reference` in the world frame, z up. Missions name
paths in `[path]`; here they are laws over numbers, to evaluate, plot, or fly in your own plan.

>>> from quadstep.world.guidance import MinimumJerk, MinimumJerkParameters
>>> from quadstep.numbers import vector
>>> up = MinimumJerkParameters(vector(0.0, 0.0, 0.0), vector(0.0, 0.0, 2.0), yaw_start=0.0, yaw_end=0.0, duration=4.0)
>>> [MinimumJerk().reference(t, up).position[2] for t in (0.0, 2.0, 4.0, 9.0)]
[0.0, 1.0, 2.0, 2.0]
"""

from quadstep.interfaces.reference import PathLaw, Reference
from quadstep.world.guidance.declared import DeclaredPath
from quadstep.world.guidance.minimum_jerk import MinimumJerk, MinimumJerkParameters
from quadstep.world.guidance.orbit import Orbit, OrbitParameters
from quadstep.world.guidance.piecewise import (
    Piecewise,
    PiecewiseParameters,
    near_recording,
    piecewise_parameters,
    through_waypoints,
)
from quadstep.world.guidance.setpoints import Step, StepParameters

__all__ = [
    "DeclaredPath",
    "MinimumJerk",
    "MinimumJerkParameters",
    "Orbit",
    "OrbitParameters",
    "PathLaw",
    "Piecewise",
    "PiecewiseParameters",
    "Reference",
    "Step",
    "StepParameters",
    "near_recording",
    "piecewise_parameters",
    "through_waypoints",
]
