"""Writing results so that a folder always holds a complete result, the new one or the one before."""

import contextlib
import errno
import fcntl
import hashlib
import json
import os
import secrets
import shutil
from collections.abc import Iterator
from pathlib import Path

from quadstep.atomic import WRITING
from quadstep.documents import read_json
from quadstep.errors import UserError
from quadstep.flight.engines import FlightPlan
from quadstep.numbers import Table, flatten
from quadstep.report.interrupts import signals_ignored

MANIFEST = "metrics.json"
"""The file that is moved last and identifies the results in a folder."""


OTHERS = {MANIFEST: "results of another kind", "export.json": "an exported law", "campaign.json": "a campaign",
          "rare.json": "an estimate of rare failures"}  # fmt: skip
"""What a folder holds by the file that identifies it."""


def fingerprint(plans: list[FlightPlan]) -> str:
    """A digest of everything that decides the flights: laws, every number, clock and start."""
    digest = hashlib.sha256()
    for plan in plans:
        leaves = flatten((plan.parameters, plan.start, plan.ticks))
        numbers = [leaf.values if isinstance(leaf, Table) else leaf for leaf in leaves]
        digest.update(f"{plan.loop!r} {numbers!r}\n".encode())
    return digest.hexdigest()[:16]


@contextlib.contextmanager
def publishing(folder: Path, identity: str, overwrite: bool, name: str = MANIFEST) -> Iterator[Path]:
    """A temporary folder to write into, moved into `folder` when the block ends well, thrown away when it does not.

    identity: digest of what is being flown. name: of the file that is moved last and identifies the results. Raises UserError
    if `folder` cannot be written or holds something else.
    """
    made: list[Path] = []
    temporary = folder / f"{WRITING}{secrets.token_hex(8)}"  # named before it is made: Ctrl-C may come at any moment
    try:
        files_to_replace(folder, identity, overwrite, name)
        made = [path for path in (folder, *folder.parents) if not path.exists()]
        folder.mkdir(parents=True, exist_ok=True)
        temporary.mkdir(mode=0o700)
        yield temporary
        manifest = temporary / name
        files = sorted(path.relative_to(temporary) for path in temporary.rglob("*") if path.is_file())
        content = json.loads(manifest.read_text(encoding="utf-8"))
        write_json(manifest, {**content, "fingerprint": identity, "files": [path.as_posix() for path in files]})
        with locked(folder):
            previous = files_to_replace(folder, identity, overwrite, name)  # another run may have finished meanwhile
            move(temporary, folder, files, previous, name)
    except OSError as error:
        raise UserError(f"{folder}: cannot be written: {error.strerror or error}") from None
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
        discard(made)


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """One run at a time between the last look at a folder and the last file moved into it."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def discard(made: list[Path]) -> None:
    """Remove the folders that were made for this result, innermost first, as far as they are empty."""
    for path in made:
        with contextlib.suppress(OSError):
            path.rmdir()


def files_to_replace(folder: Path, identity: str, overwrite: bool, name: str = MANIFEST) -> list[Path]:
    """The files of the result that `folder` holds. Raises UserError where replacing it was not requested."""
    if not folder.exists():
        return []
    if not folder.is_dir():
        raise UserError(f"{folder}: is a file; --out needs a folder")
    other = next((what for one, what in OTHERS.items() if one != name and (folder / one).is_file()), "")
    if other:
        raise UserError(f"{folder}: holds {other}; choose another --out")
    content: dict[str, object] = {}
    with contextlib.suppress(UserError):
        loaded = read_json(folder / name)
        content = loaded if isinstance(loaded, dict) else {}
    found = any(not path.name.startswith(WRITING) for path in folder.iterdir())
    if not overwrite and content.get("fingerprint") != identity and found:
        what = f"other results ({content['name']})" if content.get("name") else "other files"
        raise UserError(f"{folder}: holds {what}; choose another --out, or replace them with --overwrite")
    listed = content.get("files")
    names = [Path(one) for one in listed if isinstance(one, str)] if isinstance(listed, list) else []
    return [one for one in names if not one.is_absolute() and ".." not in one.parts]


def move(temporary: Path, folder: Path, files: list[Path], previous: list[Path], name: str = MANIFEST) -> None:
    """Move files into place, the manifest last, and remove those of the previous result; Ctrl-C waits for the end."""
    for path in files:
        if (folder / path).is_dir():
            raise IsADirectoryError(errno.EISDIR, f"{path} is a folder")
    with signals_ignored():
        for path in sorted(files, key=lambda path: path.name == name):
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (temporary / path).replace(folder / path)
        for path in set(previous) - set(files):
            (folder / path).unlink(missing_ok=True)
            discard([folder / parent for parent in path.parents if parent != Path()])


def write_json(path: Path, content: object) -> None:
    """JSON with a fixed order and no NaN."""
    path.write_text(json.dumps(content, indent=2, allow_nan=False) + "\n", encoding="utf-8")
