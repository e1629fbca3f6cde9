"""Writing results so that a folder always holds a complete result, the new one or the one before."""

import contextlib
import json
from collections.abc import Iterator
from pathlib import Path

from quadstep.io.atomic import WRITING, WRITTEN
from quadstep.io.documents import parse_json
from quadstep.io.errors import UserError
from quadstep.io.files import JSON, PAGE
from quadstep.io.results.folder import Folder, names_in, opened
from quadstep.io.results.interrupts import signals_ignored

MANIFEST = "metrics.json"
"""The file that is moved last and identifies the results in a folder."""


OTHERS = {MANIFEST: "results of another kind", "export.json": "an exported law", "campaign.json": "a campaign",
          "rare.json": "an estimate of rare failures"}  # fmt: skip
"""What a folder holds by the file that identifies it."""


@contextlib.contextmanager
def publishing(path: Path, identity: str, overwrite: bool, name: str = MANIFEST) -> Iterator[Path]:
    """A temporary folder to write into, moved into the folder `path` when the block ends well, thrown away when it does not.

    identity: digest of what is being flown. name: of the file that is moved last and identifies the results. Raises UserError
    if the folder cannot be written or holds something else.
    """
    try:
        with opened(path) as folder, contextlib.ExitStack() as stack:
            with folder.locked():
                replaceable(folder, identity, overwrite, name)
                folder.sweep()
                draft = stack.enter_context(folder.draft())
            yield draft.path
            names = draft.files()
            content = json.loads(draft.read(name, PAGE))
            draft.write(name, as_text({**content, "fingerprint": identity, "files": names}), synced=False)
            with folder.locked(), signals_ignored():
                previous = replaceable(folder, identity, overwrite, name)  # another run may have finished meanwhile
                replace(folder, draft, names, previous, name, identity)
                WRITTEN.append(str(path))
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror or error}") from None


def replace(folder: Folder, draft: Folder, names: list[str], previous: list[str], last: str, identity: str) -> None:
    """Move files into place, remove those of the previous result, and move the manifest last.

    Meanwhile the folder's manifest names the files of both, so that after a kill the same command replaces all of them.
    """
    folder.check_free(names)
    meanwhile = {"fingerprint": identity, "files": sorted({*previous, *names})}
    folder.write(last, as_text(meanwhile), synced=False)
    folder.take(draft, [one for one in names if one != last], last)
    for one in sorted(set(previous) - set(names)):
        folder.remove(one)
    folder.take(draft, [last], last)


def files_to_replace(path: Path, identity: str, overwrite: bool, name: str = MANIFEST) -> list[str]:
    """The files of the result in the folder `path`. Raises UserError where it is none, or replacing it was not requested."""
    try:
        if not path.exists():
            return []
        with opened(path) as folder:
            return replaceable(folder, identity, overwrite, name)
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {error.strerror or error}") from None


def replaceable(folder: Folder, identity: str, overwrite: bool, name: str) -> list[str]:
    """The files of the result that a folder holds. Raises UserError where replacing it was not requested."""
    other = next((what for one, what in OTHERS.items() if one != name and folder.has(one)), "")
    if other:
        raise UserError(f"{folder.path}: holds {other}; choose another --out")
    content: dict[str, object] = {}
    says = ""
    if folder.has(name):
        text, says = folder.read(name, JSON), f", says {name}"
        try:
            loaded = parse_json(text, name)
            content = loaded if isinstance(loaded, dict) else {}
        except UserError as error:
            says = f" ({error})"
    found = any(not one.startswith(WRITING) for one in folder.names())
    if not overwrite and content.get("fingerprint") != identity and found:
        what = f"other results ({content['name']})" if content.get("name") else "other files"
        raise UserError(f"{folder.path}: holds {what}{says}; choose another --out, or replace them with --overwrite")
    return names_in(content.get("files"))


def write_json(path: Path, content: object) -> None:
    """JSON with a fixed order and no NaN."""
    path.write_bytes(as_text(content))


def as_text(content: object) -> bytes:
    return (json.dumps(content, indent=2, allow_nan=False) + "\n").encode()
