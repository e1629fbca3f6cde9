"""What installed packages bring: entry points, by which a mission names their things as it names the package's own."""

from functools import cache
from importlib.metadata import entry_points

from quadstep.io.user_code.places import Place, place

CONTROLLERS, PATHS, WINDS = "quadstep.controllers", "quadstep.paths", "quadstep.winds"
DISTURBANCES, METRICS, PLANTS, VEHICLES = "quadstep.disturbances", "quadstep.metrics", "quadstep.plants", "quadstep.vehicles"

GROUPS = (CONTROLLERS, PATHS, WINDS, DISTURBANCES, METRICS, PLANTS, VEHICLES)
"""Of entry points: what a name in such a group stands for."""


def own_place(kind: object, group: str) -> Place | None:
    """What a mission names: a thing of the user's own, or an entry point of this group; None where it is neither."""
    return place(kind) or (installed(group).get(kind) if isinstance(kind, str) else None)


@cache
def installed(group: str) -> dict[str, Place]:
    """The entry points of a group, by name. To look for them takes longer than to check a mission, so it is done once."""
    found = {one.name: place(one.value) for one in entry_points(group=group)}
    return {name: one._replace(entry=True) for name, one in found.items() if one}


def all_installed() -> dict[str, list[Place]]:
    """Those of all groups, by name."""
    found: dict[str, list[Place]] = {}
    for group in GROUPS:
        for name, one in installed(group).items():
            found.setdefault(name, []).append(one)
    return found
