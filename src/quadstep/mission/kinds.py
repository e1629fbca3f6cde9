"""The kinds of mission, one a plant: which one some content describes. Each is loaded when it is asked for."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from quadstep.mission.presets import is_airframe

if TYPE_CHECKING:
    from quadstep.mission.schema import Mission

PAPER, REAL = "lagrange.LagrangeMission", "multirotor.MultirotorMission"
"""Module and class within this package."""


def kind(place: str) -> "type[Mission]":
    """A kind of mission, a subclass of `Mission`."""
    module, name = place.split(".")
    found: type[Mission] = getattr(import_module(f"quadstep.mission.{module}"), name)
    return found


def kind_of(content: Any) -> "type[Mission]":
    """The kind of mission whose vehicle this content describes."""
    vehicle = content.get("vehicle") if isinstance(content, dict) else None
    return kind(REAL if is_airframe(vehicle) else PAPER)
