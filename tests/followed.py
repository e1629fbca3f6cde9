"""Paths that laws of real vehicles are flown along, and such flights, scored once the start is forgotten."""

from quadstep import Mission, fly
from quadstep.interfaces.closed_loop import Outcome

EIGHT = {"type": "figure-eight", "plane": "vertical", "length": 2.5, "width": 1.5, "period": 6.2832, "centre": [0.0, 0.0, 5.0]}
FAST = {"type": "circle", "radius": 2.0, "period": 4.0, "centre": [0.0, 0.0, 5.0], "turns": 5.0, "yaw_rate": 0.3}
HERE = {"type": "step", "start": [0.0, 0.0, 5.0], "end": [0.0, 0.0, 5.0], "duration": 8.0}


def followed(kind, path, preset="research-2.6kg", gains=None, **parts):
    """A flight that does not diverge."""
    controller = {"type": kind, **(gains or {})}
    flight = fly(Mission(vehicle={"preset": preset}, path=path, controller=controller, **{"score_from": 3.0, **parts}))
    assert flight.outcome is Outcome.COMPLETED
    return flight


def error(*given, **parts):
    """Its error of position, root of the mean square [m]."""
    return followed(*given, **parts).metrics()["position_rmse[m]"]
