"""The place of a certificate, checked before the proof, which may take minutes."""

from pathlib import Path

from quadstep.io.documents import read_json
from quadstep.io.errors import UserError
from quadstep.proofs.prove import certificate, set_certificate

FORMATS = tuple(one.FORMAT.rstrip("0123456789") for one in (certificate, set_certificate))


def check_target(path: Path) -> None:
    """Refuses a folder, a place that cannot be written, and an existing file that is not a certificate. Raises UserError."""
    try:
        if path.is_dir():
            raise UserError(f"{path}: is a folder; --out needs a file")
        parent = next(one for one in path.absolute().parents if one.exists())
        if not parent.is_dir():
            raise UserError(f"{path}: cannot be written: {parent} is not a folder")
        if path.exists() and not is_certificate(path):
            raise UserError(f"{path}: exists and is not a certificate of `quadstep prove`; choose another --out")
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror or error}") from None


def is_certificate(path: Path) -> bool:
    """Whether a file claims to be one."""
    try:
        content = read_json(path)
    except UserError:
        return False
    return isinstance(content, dict) and str(content.get("format")).startswith(FORMATS)
