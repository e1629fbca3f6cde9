"""The kinds of mission, one a plant: which one some content describes. Each is loaded when it is asked for."""

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from quadstep.mission.presets import is_airframe

if TYPE_CHECKING:
    from quadstep.mission.schema import Mission

PAPER, REAL = "lagrange.LagrangeMission", "multirotor.MultirotorMission"
"""Module and class within this package."""


def kind(place: str) -> "type[Mission]":
    """A kind of mission."""
    module, name = place.split(".")
    found: type[Mission] = getattr(import_module(f"quadstep.mission.{module}"), name)
    return found


def kind_of(content: object, folder: Path = Path()) -> "type[Mission]":
    """The kind of mission whose vehicle this content describes. folder: of the mission. Raises UserError."""
    vehicle = content.get("vehicle") if isinstance(content, dict) else None
    if isinstance(vehicle, dict) and isinstance(vehicle.get("type"), str):
        found: type[Mission] = import_module("quadstep.mission.declared").declared_kind(vehicle["type"], folder)
        return found
    return kind(REAL if is_airframe(vehicle) else PAPER)
