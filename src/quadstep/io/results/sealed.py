"""A manifest with its own digest: a JSON file whose last entry is the SHA-256 of all of it, with zeros in that place."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from quadstep.io import files
from quadstep.io.documents import parse_json
from quadstep.io.errors import UserError

SEAL = "sha256"
UNKNOWN = "0" * 64


def sealed(content: Mapping[str, object]) -> bytes:
    """A manifest as the content of a file."""
    text = json.dumps(
        {**{key: value for key, value in content.items() if key != SEAL}, SEAL: UNKNOWN}, indent=1, allow_nan=False
    )
    head, _, tail = f"{text}\n".rpartition(UNKNOWN)
    return f"{head}{hashlib.sha256(f'{head}{UNKNOWN}{tail}'.encode()).hexdigest()}{tail}".encode()


def read_sealed(path: Path) -> dict[str, Any]:
    """A manifest, with its seal, which those of earlier versions lack. Links are not followed.

    Raises UserError for a file that is none, or whose content is not what was written.
    """
    text = files.read_bytes(path, files.JSON, links=False)
    content = parse_json(text, str(path))
    if not isinstance(content, dict):
        raise UserError(f"{path}: is not a manifest written by quadstep")
    if SEAL in content and sealed(content) != text:
        raise UserError(f"{path}: was changed after quadstep wrote it")
    return content
