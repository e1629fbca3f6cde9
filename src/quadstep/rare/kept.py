"""The folder of a run: rare.json, rewritten with each piece that is finished, so that a run that was stopped can go on."""

import contextlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from quadstep import __version__
from quadstep.atomic import WRITING, replace_file
from quadstep.campaign import draws
from quadstep.campaign.manifest import machine
from quadstep.campaign.schema import Campaign
from quadstep.campaign.store import held
from quadstep.documents import read_json
from quadstep.errors import UserError
from quadstep.mission.read import check_mission

MANIFEST = "rare.json"


class Finished(BaseModel):
    """What a finished piece must hold; the rest is for readers."""

    model_config = ConfigDict(strict=True, extra="allow")
    kind: str
    method: str
    probability: Annotated[float, Field(ge=0.0)]
    flights: Annotated[int, Field(ge=1)]
    events: Annotated[list[dict[str, Any]], Field(min_length=1)]
    nearest: dict[str, Any] | None
    again: dict[str, int] | None


class Manifest(BaseModel):
    """What rare.json must hold for its run to be resumed."""

    model_config = ConfigDict(strict=True)
    name: str
    version: str
    decides: dict[str, Any]
    pieces: list[Finished]
    files: list[str] = []


class Kept:
    """The folder of one run, held by it. Made by `opened`."""

    def __init__(self, folder: Path, manifest: dict[str, Any]) -> None:
        self.folder, self.manifest = folder, manifest

    @property
    def pieces(self) -> list[dict[str, Any]]:
        """Those finished, in order."""
        done: list[dict[str, Any]] = self.manifest["pieces"]
        return done

    def add(self, piece: dict[str, Any]) -> None:
        """Keep one more. Raises UserError where the disk does not take it."""
        self.save(pieces=[*self.pieces, piece])

    def save(self, **more: Any) -> None:
        """Write rare.json. Raises UserError."""
        self.manifest |= more
        with self.explained():
            content = json.dumps(self.manifest, indent=1, allow_nan=False) + "\n"
            replace_file(self.folder / MANIFEST, content.encode(), synced=True)

    @contextlib.contextmanager
    def explained(self) -> Iterator[None]:
        """What a disk refuses, in one line."""
        try:
            yield
        except OSError as error:
            raise UserError(f"{self.folder}: cannot be written: {error.strerror or error}; --resume continues") from None


@contextlib.contextmanager
def opened(folder: Path, campaign: Campaign, resume: bool, overwrite: bool) -> Iterator[Kept]:
    """The folder of a run, made or resumed, and locked while the block runs.

    Raises UserError for a folder that holds something else, another run, or a run that another process is writing.
    """
    with held(folder, resume):
        yield prepared(folder, campaign, resume, overwrite)


def prepared(folder: Path, campaign: Campaign, resume: bool, overwrite: bool) -> Kept:
    """What is kept in a folder that is locked."""
    mine = new_manifest(campaign)
    found = read_manifest(folder)
    if found is None:
        if resume:
            raise UserError(f"{folder}: there is nothing to resume; leave out --resume to start")
        strange = [path.name for path in folder.iterdir() if not path.name.startswith(WRITING)]
        if strange:
            raise UserError(f"{folder}: holds files of another kind ({min(strange)}); choose another --out")
        kept = Kept(folder, mine)
        kept.save()
        return kept
    kept = Kept(folder, found)
    if resume:
        changed = "the campaign, its mission or a file it names has changed"
        if found["version"] != __version__:
            changed = f"it was flown by quadstep {found['version']}, this is {__version__}"
        elif found["decides"] == mine["decides"]:
            kept.save(complete=False)
            return kept
        raise UserError(f"{folder}: cannot be resumed: {changed}; choose another --out, or start over with --overwrite")
    if not overwrite and found["pieces"]:
        state = "complete" if found.get("complete") else f"{len(found['pieces'])} of {found['wanted']} replicates"
        raise UserError(
            f"{folder}: holds the estimate {found['name']!r} ({state}); continue with --resume, choose another --out, or "
            "replace it with --overwrite"
        )
    with kept.explained():
        for name in found.get("files", []):
            if not Path(name).is_absolute() and ".." not in Path(name).parts:
                (folder / name).unlink(missing_ok=True)
    kept = Kept(folder, mine)
    kept.save()
    return kept


def new_manifest(campaign: Campaign) -> dict[str, Any]:
    """rare.json before the first flight."""
    file = campaign.file
    rare = file.rare.model_dump(mode="json")
    return {
        "name": file.name,
        "version": __version__,
        "decides": {"fingerprint": campaign.fingerprint, "draws": draws.VERSION, "failure": dict(file.failure), "rare": rare},
        "seed": file.seed,
        "precision": file.precision,
        "campaign": campaign.text,
        "mission": check_mission(campaign.content, campaign.source, campaign.folder).name,
        "machine": machine(),
        "wanted": file.rare.replicates + file.rare.opinions,
        "complete": False,
        "pieces": [],
        "files": [],
    }


def read_manifest(folder: Path) -> dict[str, Any] | None:
    """rare.json of a folder, None where there is none. Raises UserError for one that cannot be read."""
    path = folder / MANIFEST
    if not path.exists():
        return None
    try:
        content = read_json(path)
        Manifest.model_validate(content)
    except (UserError, ValidationError):
        raise UserError(f"{path}: is not one of ours, or damaged; choose another --out") from None
    known: dict[str, Any] = content
    return known
