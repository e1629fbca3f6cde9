"""quadstep: how well, and how reliably, will this controller keep my vehicle on its path?

From Python: build or read a mission, fly it, and query the flight. See `docs/python.md`.

>>> import quadstep
>>> line = {"type": "minimum-jerk", "end": [1.0, 0.0, 2.0], "duration": 4.0}
>>> flight = quadstep.fly(quadstep.Mission(path=line))
>>> flight.outcome.name, flight.metrics()["position_rmse[m]"] < 0.001
('COMPLETED', True)

SI units and radians throughout; positions are in the world frame, z up.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from quadstep.io import __version__ as __version__

__all__ = ["Engine", "Flight", "Mission", "UserError", "flight_metrics", "fly", "fly_all", "read_mission"]

if TYPE_CHECKING:
    from quadstep.engines.engine import Engine
    from quadstep.io.errors import UserError
    from quadstep.metrics.registry import flight_metrics
    from quadstep.mission.read import read_mission
    from quadstep.mission.schema import Mission
    from quadstep.studies.interface import Flight, fly, fly_all

_PLACES = {
    "Engine": "quadstep.engines.engine",
    "Flight": "quadstep.studies.interface",
    "Mission": "quadstep.mission.schema",
    "UserError": "quadstep.io.errors",
    "flight_metrics": "quadstep.metrics.registry",
    "fly": "quadstep.studies.interface",
    "fly_all": "quadstep.studies.interface",
    "read_mission": "quadstep.mission.read",
}


def __getattr__(name: str) -> object:
    """Load a name when it is first used, so that importing the package costs nothing."""
    if name not in _PLACES:
        raise AttributeError(f"module 'quadstep' has no attribute {name!r}")
    return getattr(import_module(_PLACES[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
