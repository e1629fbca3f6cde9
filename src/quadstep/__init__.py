"""quadstep: how well, and how surely, will this controller hold my vehicle on its path?

From Python: `fly(read_mission(path).plan(path.parent))` gives the log, `flight_metrics(log)` its numbers.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

__all__ = ["Engine", "Mission", "UserError", "airframe_metrics", "flight_metrics", "fly", "fly_all", "read_mission"]

if TYPE_CHECKING:
    from quadstep.analysis.airframe_metrics import airframe_metrics
    from quadstep.analysis.flight_metrics import flight_metrics
    from quadstep.errors import UserError
    from quadstep.flight.engine import Engine
    from quadstep.flight.engines import fly, fly_all
    from quadstep.mission.read import read_mission
    from quadstep.mission.schema import Mission

_PLACES = {
    "Engine": "quadstep.flight.engine",
    "Mission": "quadstep.mission.schema",
    "UserError": "quadstep.errors",
    "airframe_metrics": "quadstep.analysis.airframe_metrics",
    "flight_metrics": "quadstep.analysis.flight_metrics",
    "fly": "quadstep.flight.engines",
    "fly_all": "quadstep.flight.engines",
    "read_mission": "quadstep.mission.read",
}


def __getattr__(name: str) -> Any:
    """Load a name when it is first used, so that importing the package costs nothing."""
    if name not in _PLACES:
        raise AttributeError(f"module 'quadstep' has no attribute {name!r}")
    return getattr(import_module(_PLACES[name]), name)
