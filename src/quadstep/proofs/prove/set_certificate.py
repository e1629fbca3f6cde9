"""The certificate of a set that no flight leaves: the mission, the unknowns, the rest, coordinates, radii, the starts."""

from __future__ import annotations

import json
from pathlib import Path
from typing import NamedTuple

from quadstep.io.atomic import write_beside
from quadstep.io.documents import read_json
from quadstep.io.errors import UserError
from quadstep.io.version import __version__
from quadstep.proofs.prove.certificate import LARGE, SMALL, read_unknown, table, unlike, written
from quadstep.proofs.prove.sampled import Array
from quadstep.proofs.prove.unknown import Unknown

FORMAT = "quadstep set 2"


class SetCertificate(NamedTuple):
    """mission: text of its file. states: names. rest: of these. live: which of them move; twins: which are always the same as
    another; unit: the first number of a quaternion of length one (-1: none).

    spread: the set is rest + spread z, |z_i| <= radii_i, columns i and i + 1 of `pairs` together. own: whether the starts are
    the mission's own but for the position, `start` [m] to either side; else those of the rest. position: how far each axis may
    be from its rest [m]. folder: the mission's, seen from the certificate's.
    """

    mission: str
    unknown: Unknown
    states: tuple[str, ...]
    rest: Array
    live: tuple[int, ...]
    twins: dict[int, int]
    unit: int
    spread: Array
    pairs: tuple[int, ...]
    radii: Array
    own: bool
    start: float
    position: Array
    folder: str = ""


def write_set(path: Path, found: SetCertificate) -> None:
    """Write the file. Raises UserError."""
    names = found.states
    content = {
        "format": FORMAT,
        "quadstep": __version__,
        "mission": found.mission,
        "folder": found.folder,
        "unknown": written(found.unknown),
        "states": list(names),
        "rest": found.rest.tolist(),
        "live": [names[place] for place in found.live],
        "twins": {names[place]: names[other] for place, other in found.twins.items()},
        "unit": names[found.unit] if found.unit >= 0 else "",
        "spread": found.spread.tolist(),
        "pairs": list(found.pairs),
        "radii": found.radii.tolist(),
        "own_start": found.own,
        "start[m]": found.start,
        "position[m]": found.position.tolist(),
    }
    write_beside(path, json.dumps(content, indent=None) + "\n", parents=True)


def is_set(path: Path) -> bool:
    """Whether a file claims to be such a certificate. Raises UserError."""
    content = read_json(path)
    return isinstance(content, dict) and content.get("format") == FORMAT


def read_set(path: Path) -> SetCertificate:
    """The content of the file. Raises UserError."""
    content = read_json(path)
    try:
        states = tuple(str(name) for name in content["states"])
        found = SetCertificate(
            mission=str(content["mission"]),
            unknown=read_unknown(content["unknown"]),
            states=states,
            rest=table(content["rest"], -LARGE, 0.0),
            live=tuple(states.index(name) for name in content["live"]),
            twins={states.index(name): states.index(other) for name, other in content["twins"].items()},
            unit=states.index("attitude.0") if content["unit"] == "attitude.0" else -1,
            spread=table(content["spread"], -LARGE),
            pairs=tuple(int(one) for one in content["pairs"]),
            radii=table(content["radii"], SMALL),
            own={True: True, False: False}[content["own_start"]],
            start=float(table(content["start[m]"], 0.0)),
            position=table(content["position[m]"], 0.0),
            folder=str(content.get("folder", "")),
        )
    except (KeyError, TypeError, ValueError, OverflowError, AttributeError, UserError) as error:
        raise unlike(path, error) from None
    count, moving = len(states), len(found.live)
    paired = [place for one in found.pairs for place in (one, one + 1)]
    shapes = found.rest.shape == (count,) and found.spread.shape == (moving, moving) and found.radii.shape == (moving,)
    sound = len(set(paired)) == len(paired) and all(0 <= one < moving for one in paired) and found.position.ndim == 1
    apart = len({*found.live, *found.twins}) == moving + len(found.twins) and set(found.twins.values()) <= set(found.live)
    if found.unit >= 0:
        turn = [f"attitude.{i}" for i in range(4)]
        apart = apart and list(states[found.unit : found.unit + 4]) == turn and found.unit not in {*found.live, *found.twins}
    if not (shapes and sound and apart and moving):
        raise UserError(f"{path}: not a certificate of `quadstep prove`: its tables do not fit each other")
    return found
