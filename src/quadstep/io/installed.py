"""What installed packages bring: entry points, by which a mission names their things as it names the package's own."""

from collections.abc import Iterable
from contextlib import suppress
from typing import TYPE_CHECKING

from quadstep.io import doors
from quadstep.io.errors import UserError
from quadstep.io.places import Place, place

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

CONTROLLERS, PATHS, WINDS = "quadstep.controllers", "quadstep.paths", "quadstep.winds"
DISTURBANCES, METRICS, PLANTS, VEHICLES = "quadstep.disturbances", "quadstep.metrics", "quadstep.plants", "quadstep.vehicles"
SENSORS, ESTIMATORS = "quadstep.sensors", "quadstep.estimators"

GROUPS = (CONTROLLERS, PATHS, WINDS, DISTURBANCES, METRICS, PLANTS, VEHICLES, SENSORS, ESTIMATORS)
"""Of entry points: what a name in such a group stands for."""

OWN = "your own FILE.py:NAME"
"""How a user's own thing is named."""


def own_place(kind: object, group: str) -> Place | None:
    """What a mission names: a thing of the user's own, or an entry point of this group; None where it is neither.

    Raises UserError where two distributions register it, and where it is not what an entry point should be.
    """
    if isinstance(kind, str) and not place(kind) and kind in doors.registered(group):
        return registered_place(doors.installed(group, kind))
    return place(kind)


def registered_place(one: "EntryPoint") -> Place:
    """What an entry point stands for. Raises UserError for one that names neither a class nor a function of a module."""
    known, origin = place(one.value), doors.origin(one)
    if known is None:
        raise UserError(f"{one.name}, which {origin} registers for {one.group}: should be module:name, not {one.value!r:.80}")
    return known._replace(origin=origin)


def installed(group: str) -> dict[str, Place]:
    """The entry points of a group, by name, without those that `own_place` refuses."""
    found: dict[str, Place] = {}
    for name in doors.registered(group):
        with suppress(UserError):
            found[name] = registered_place(doors.installed(group, name))
    return found


def named(own: Iterable[str], group: str) -> tuple[str, ...]:
    """The names that a mission may use beside `OWN`: the package's, and those that installed packages bring."""
    names = tuple(own)
    return *names, *sorted(installed(group).keys() - set(names))


def all_installed() -> dict[str, list[Place]]:
    """Those of all groups, by name."""
    found: dict[str, list[Place]] = {}
    for group in GROUPS:
        for name, one in installed(group).items():
            found.setdefault(name, []).append(one)
    return found
