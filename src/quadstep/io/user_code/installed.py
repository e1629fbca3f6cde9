"""What installed packages bring: entry points, by which a mission names their things as it names the package's own."""

from quadstep.io import doors
from quadstep.io.user_code.places import Place, place

CONTROLLERS, PATHS, WINDS = "quadstep.controllers", "quadstep.paths", "quadstep.winds"
DISTURBANCES, METRICS, PLANTS, VEHICLES = "quadstep.disturbances", "quadstep.metrics", "quadstep.plants", "quadstep.vehicles"

GROUPS = (CONTROLLERS, PATHS, WINDS, DISTURBANCES, METRICS, PLANTS, VEHICLES)
"""Of entry points: what a name in such a group stands for."""


def own_place(kind: object, group: str) -> Place | None:
    """What a mission names: a thing of the user's own, or an entry point of this group; None where it is neither."""
    return place(kind) or (installed(group).get(kind) if isinstance(kind, str) else None)


def installed(group: str) -> dict[str, Place]:
    """The entry points of a group, by name."""
    found = {name: place(one.value) for name, one in doors.installed(group).items()}
    return {name: one._replace(entry=True) for name, one in found.items() if one}


def all_installed() -> dict[str, list[Place]]:
    """Those of all groups, by name."""
    found: dict[str, list[Place]] = {}
    for group in GROUPS:
        for name, one in installed(group).items():
            found.setdefault(name, []).append(one)
    return found
