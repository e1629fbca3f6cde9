"""The kinds of mission, one a plant: the one place that knows which there are. Each is loaded when it is asked for."""

from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from quadstep.mission.presets import is_airframe

if TYPE_CHECKING:
    from quadstep.mission.schema import Mission


class Kind(NamedTuple):
    """A kind of mission whose vehicle has no `type`.

    place: module and class within this package. needs: what is said of its tables in a mission of another kind.
    """

    place: str
    needs: str

    def load(self) -> "type[Mission]":
        module, name = self.place.split(".")
        loaded: type[Mission] = getattr(import_module(f"quadstep.mission.{module}"), name)
        return loaded


PAPER = Kind(
    "lagrange.LagrangeMission",
    "needs the paper's plant, but [vehicle] describes a real vehicle: leave out preset, file, layout and rotor",
)
REAL = Kind(
    "multirotor.MultirotorMission",
    'needs a real vehicle, but [vehicle] names none: give preset = "x500" (`quadstep vehicles` lists the presets), '
    'or file = "my.toml"',
)
KINDS = REAL, PAPER


def kind_of(vehicle: object, folder: Path = Path()) -> "type[Mission]":
    """The kind of mission that flies the vehicle of this table. folder: of the mission. Raises UserError."""
    if isinstance(vehicle, Mapping) and isinstance(vehicle.get("type"), str):
        declared: type[Mission] = import_module("quadstep.mission.declared").declared_kind(vehicle["type"], folder)
        return declared
    return (REAL if is_airframe(vehicle) else PAPER).load()
