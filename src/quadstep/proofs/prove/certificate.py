"""The certificate file: what was proved, and everything needed to check it: mission, unknowns, flight, boxes."""

from __future__ import annotations

import base64
import binascii
import json
import os
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from quadstep.io.atomic import write_beside
from quadstep.io.documents import read_json
from quadstep.io.errors import UserError
from quadstep.io.version import __version__
from quadstep.proofs.prove.sampled import Array
from quadstep.proofs.prove.unknown import Unknown, refuse_out_of_range

FORMAT = "quadstep tube 3"
LARGEST = 2**28
"""Most bytes of a flight."""

SMALL, LARGE = 1e-100, 1e100
"""Magnitudes of a certificate's numbers other than zero, so that products of a few neither overflow nor underflow."""

MOST_SAMPLES = 100
"""Of a block, whose sums are then short enough for the check's allowance for rounding."""


class Certificate(NamedTuple):
    """mission: text of its file. states: names. flown: (samples + 1, states), the centre line. block: samples of each.
    spread: the coordinates in which `boxes` (blocks, states) are half widths. position: the claimed bound of each axis [m].
    folder: the mission's, seen from the certificate's.
    """

    mission: str
    unknown: Unknown
    states: tuple[str, ...]
    flown: Array
    block: int
    spread: Array
    boxes: Array
    position: Array
    folder: str = ""


def seen_from(certificate: Path, mission: Path) -> str:
    """The folder of a mission's file, in which the files that it names are, relative to that of a certificate."""
    return Path(os.path.relpath(mission.absolute().parent, certificate.absolute().parent)).as_posix()


def write_certificate(path: Path, found: Certificate) -> None:
    """Write the file. Raises UserError."""
    content = {
        "format": FORMAT,
        "quadstep": __version__,
        "mission": found.mission,
        "folder": found.folder,
        "unknown": written(found.unknown),
        "states": list(found.states),
        "samples_per_block": found.block,
        "position[m]": found.position.tolist(),
        "spread": found.spread.tolist(),
        "boxes": found.boxes.tolist(),
        "flown": packed(found.flown),
    }
    write_beside(path, json.dumps(content, indent=None) + "\n", parents=True)


def packed(flown: Array) -> str:
    """The flight, state by state, as second differences of the numbers' bits, which are small: half as long, and exact."""
    bits = np.ascontiguousarray(flown.T, "<f8").view("<u8")
    for _ in range(2):
        bits = np.diff(bits, axis=1, prepend=np.zeros((len(bits), 1), "<u8"))
    return base64.b64encode(zlib.compress(bits.tobytes(), 6)).decode()


def unpacked(text: str, states: int) -> Array:
    """The flight (samples + 1, states) from its packed form. Raises ValueError, TypeError, zlib.error or binascii.Error."""
    content = zlib.decompressobj().decompress(base64.b64decode(text, validate=True), LARGEST)
    bits = np.frombuffer(content, "<u8").reshape(states, -1)
    for _ in range(2):
        bits = np.cumsum(bits, axis=1, dtype="<u8")
    return np.ascontiguousarray(bits.view("<f8").T, dtype=np.float64)


UNITS = dict(zip(Unknown._fields, ("N", "N m", "-", "-", "m", "m/s", "rad", "rad/s"), strict=True))


def written(unknown: Unknown) -> dict[str, float]:
    """The unknowns as stored in a certificate, with their units."""
    return {f"{name}[{unit}]": value for (name, unit), value in zip(UNITS.items(), unknown, strict=True)}


def read_unknown(content: Mapping[str, float]) -> Unknown:
    """The unknowns read back. Raises KeyError, TypeError, ValueError, OverflowError or UserError."""
    found = Unknown(*(float(content[f"{name}[{unit}]"]) for name, unit in UNITS.items()))
    refuse_out_of_range(found, "{}")
    return found


def table(content: object, least: float, small: float = SMALL) -> Array:
    """An array of numbers that are zero or of a magnitude from `small` to `LARGE`, and not below `least`.

    Raises TypeError, ValueError, OverflowError.
    """
    found = np.array(content, dtype=np.float64)
    size = np.abs(found)
    if not np.all(((size == 0.0) | (size >= small)) & (size <= LARGE) & (found >= least)):
        raise ValueError(f"a number is not zero or from {small:g} to {LARGE:g} in size, or is below {least:g}")
    return found


def unlike(path: Path, error: Exception) -> UserError:
    """What is said of a file that is not as a certificate should be."""
    missing = " is missing" if isinstance(error, KeyError) else ""
    return UserError(f"{path}: not a certificate of `quadstep prove`: {error}{missing}")


def read_certificate(path: Path) -> Certificate:
    """The content of the file. Raises UserError."""
    content = read_json(path)
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise UserError(f"{path}: not a certificate of `quadstep prove`: its format is none that this version writes")
    try:
        states = tuple(str(name) for name in content["states"])
        unknown = read_unknown(content["unknown"])
        flown = table(unpacked(content["flown"], len(states)), -LARGE, 0.0)
        spread, boxes = table(content["spread"], -LARGE), table(content["boxes"], 0.0)
        position, size = table(content["position[m]"], 0.0), int(content["samples_per_block"])
        mission = str(content["mission"])
    except (KeyError, TypeError, ValueError, OverflowError, UserError, zlib.error, binascii.Error) as error:
        raise unlike(path, error) from None
    blocks = -(-(len(flown) - 1) // size) if 0 < size <= MOST_SAMPLES else 0
    shapes = spread.shape == (len(states), len(states)) and boxes.shape == (blocks, len(states)) and position.ndim == 1
    if not shapes or blocks < 1:
        raise UserError(f"{path}: not a certificate of `quadstep prove`: its tables do not fit each other")
    return Certificate(mission, unknown, states, flown, size, spread, boxes, position, str(content.get("folder", "")))
