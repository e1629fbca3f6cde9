"""Certificate files: what was proved, and everything needed to check it.

Of a tube: mission, unknowns, flight, boxes. Of a set that no flight leaves: mission, unknowns, rest, coordinates, radii,
starts.
"""

from __future__ import annotations

import base64
import binascii
import os
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from quadstep.io import __version__
from quadstep.io.documents import read_json
from quadstep.io.errors import UserError
from quadstep.io.files import check_place, write_beside
from quadstep.io.parts import SEAL, read_sealed, sealed
from quadstep.numbers.affine import UP
from quadstep.proofs.prove.sampled import Array
from quadstep.proofs.prove.unknown import Unknown, refuse_out_of_range

FORMAT, SET_FORMAT = "quadstep tube 3", "quadstep set 2"
WHAT = "a certificate of `quadstep prove`"
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


def folder_from(certificate: Path, mission: Path) -> str:
    """The folder of a mission's file, in which the files that it names are, relative to that of a certificate."""
    return Path(os.path.relpath(mission.absolute().parent, certificate.absolute().parent)).as_posix()


def write_certificate(path: Path, proof: Certificate) -> None:
    """Write the file. Raises UserError."""
    proved: dict[str, object] = {"samples_per_block": proof.block, "position[m]": proof.position.tolist()}
    proved |= {"spread": proof.spread.tolist(), "boxes": proof.boxes.tolist(), "flown": packed(proof.flown)}
    write_file(path, FORMAT, proof, proved)


def write_file(path: Path, form: str, proof: Certificate | SetCertificate, proved: Mapping[str, object]) -> None:
    """Write a certificate of either form: its claim, then what proves it. Raises UserError."""
    claim = {"format": form, "quadstep": __version__, "mission": proof.mission, "folder": proof.folder}
    states = {"unknown": written(proof.unknown), "states": list(proof.states)}
    write_beside(path, sealed({**claim, **states, **proved}).decode(), parents=True)


def refuse_unsealed(path: Path, content: Mapping[str, object]) -> None:
    """Refuses a certificate without a digest, as those of earlier versions are. Raises UserError."""
    if SEAL not in content:
        raise UserError(f"{path}: has no digest of its content ({SEAL!r}), so it was changed or is old; prove it again")


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


def malformed(path: Path, error: Exception) -> UserError:
    """What is said of a file that is not as a certificate should be."""
    missing = " is missing" if isinstance(error, KeyError) else ""
    return UserError(f"{path}: not {WHAT}: {error}{missing}")


def read_certificate(path: Path) -> Certificate:
    """The content of the file. Raises UserError."""
    content = read_sealed(path, WHAT, links=True)
    if content.get("format") != FORMAT:
        raise UserError(f"{path}: not {WHAT}: this version does not write its format")
    refuse_unsealed(path, content)
    try:
        states = tuple(str(name) for name in content["states"])
        unknown = read_unknown(content["unknown"])
        flown = table(unpacked(content["flown"], len(states)), -LARGE, 0.0)
        spread, boxes = table(content["spread"], -LARGE), table(content["boxes"], 0.0)
        position, size = table(content["position[m]"], 0.0), int(content["samples_per_block"])
        mission = str(content["mission"])
    except (KeyError, TypeError, ValueError, OverflowError, UserError, zlib.error, binascii.Error) as error:
        raise malformed(path, error) from None
    blocks = -(-(len(flown) - 1) // size) if 0 < size <= MOST_SAMPLES else 0
    shapes = spread.shape == (len(states), len(states)) and boxes.shape == (blocks, len(states)) and position.ndim == 1
    if not shapes or blocks < 1:
        raise UserError(f"{path}: not {WHAT}: its tables do not agree")
    return Certificate(mission, unknown, states, flown, size, spread, boxes, position, str(content.get("folder", "")))


def off_path(off: Array, block: int, boxes: Array, position: Array) -> Array:
    """How far every flight stays from its path, for each axis [m]: in each block at most what its centre line is off it, and
    the less of the block's box and of what is claimed of the whole tube. off: (samples + 1, axes) [m].
    """
    bounds = np.minimum(boxes[:, : off.shape[1]], position)
    blocks = [off[block * place : block * (place + 1) + 1].max(axis=0) + bound for place, bound in enumerate(bounds)]
    return np.max(blocks, axis=0) * UP


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


def write_set(path: Path, proof: SetCertificate) -> None:
    """Write the file. Raises UserError."""
    names = proof.states
    proved = {
        "rest": proof.rest.tolist(),
        "live": [names[place] for place in proof.live],
        "twins": {names[place]: names[other] for place, other in proof.twins.items()},
        "unit": names[proof.unit] if proof.unit >= 0 else "",
        "spread": proof.spread.tolist(),
        "pairs": list(proof.pairs),
        "radii": proof.radii.tolist(),
        "own_start": proof.own,
        "start[m]": proof.start,
        "position[m]": proof.position.tolist(),
    }
    write_file(path, SET_FORMAT, proof, proved)


def read_set(path: Path) -> SetCertificate:
    """The content of the file. Raises UserError."""
    content = read_sealed(path, WHAT, links=True)
    refuse_unsealed(path, content)
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
        raise malformed(path, error) from None
    count, moving = len(states), len(found.live)
    paired = [place for one in found.pairs for place in (one, one + 1)]
    shapes = found.rest.shape == (count,) and found.spread.shape == (moving, moving) and found.radii.shape == (moving,)
    sound = len(set(paired)) == len(paired) and all(0 <= one < moving for one in paired) and found.position.ndim == 1
    apart = len({*found.live, *found.twins}) == moving + len(found.twins) and set(found.twins.values()) <= set(found.live)
    if found.unit >= 0:
        turn = [f"attitude.{i}" for i in range(4)]
        apart = apart and list(states[found.unit : found.unit + 4]) == turn and found.unit not in {*found.live, *found.twins}
    if not (shapes and sound and apart and moving):
        raise UserError(f"{path}: not {WHAT}: its tables do not agree")
    return found


FORMATS = tuple(one.rstrip("0123456789") for one in (FORMAT, SET_FORMAT))


def check_target(path: Path) -> None:
    """Refuses a place where no file can be written, and an existing file that is not a certificate. Raises UserError."""
    check_place(path, parents=True)
    if path.exists() and not is_certificate(path):
        raise UserError(f"{path}: exists and is not {WHAT}; choose another --out")


def is_certificate(path: Path) -> bool:
    """Whether a file claims to be one."""
    try:
        content = read_json(path)
    except UserError:
        return False
    return isinstance(content, dict) and str(content.get("format")).startswith(FORMATS)
