"""The folder of a run: rare.json, rewritten after each finished piece, so that an interrupted run can be resumed."""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from pydantic import BaseModel, ConfigDict, ValidationError

from quadstep.io.atomic import WRITING
from quadstep.io.errors import UserError
from quadstep.io.results.folder import Folder, names_in
from quadstep.io.results.sealed import read_sealed, sealed
from quadstep.io.version import __version__
from quadstep.studies.campaign import draws
from quadstep.studies.campaign.manifest import OTHERS, cannot_continue, identity, machine
from quadstep.studies.campaign.schema import Campaign
from quadstep.studies.campaign.store import held
from quadstep.studies.rare.done import Done

MANIFEST = "rare.json"


class Manifest(BaseModel):
    """rare.json. decides: everything that determines a result; wanted: number of pieces; files: of the report."""

    model_config = ConfigDict(extra="forbid")
    name: str
    version: str
    decides: dict[str, object]
    seed: int
    precision: str
    campaign: str
    mission: str
    machine: dict[str, object]
    wanted: int
    complete: bool = False
    pieces: list[Done] = []
    summary: dict[str, object] | None = None
    files: list[str] = []
    sha256: str = ""


class Kept:
    """The folder of one run, locked by it. Made by `opened`."""

    def __init__(self, files: Folder, manifest: Manifest) -> None:
        self.files, self.folder, self.manifest = files, files.path, manifest

    @property
    def pieces(self) -> list[Done]:
        """The finished pieces, in order."""
        return self.manifest.pieces

    def add(self, piece: Done) -> None:
        """Keep one more. Raises UserError if it cannot be written."""
        self.manifest.pieces.append(piece)
        self.save()

    def save(self) -> None:
        """Write rare.json. Raises UserError."""
        with self.explained():
            self.files.write(MANIFEST, sealed(self.manifest.model_dump(mode="json")))

    @contextlib.contextmanager
    def explained(self) -> Iterator[None]:
        """Turns an error of the disk into a UserError of one line."""
        try:
            yield
        except OSError as error:
            raise UserError(f"{self.folder}: cannot be written: {error.strerror or error}; --resume continues") from None


@contextlib.contextmanager
def opened(folder: Path, campaign: Campaign, resume: bool, overwrite: bool) -> Iterator[Kept]:
    """The folder of a run, made or resumed, and locked while the block runs.

    Raises UserError for a folder that holds something else, another run, or a run that another process is writing.
    """
    with held(folder, resume) as inside:
        yield prepared(inside, campaign, resume, overwrite)


def prepared(inside: Folder, campaign: Campaign, resume: bool, overwrite: bool) -> Kept:
    """The content of a locked folder."""
    folder = inside.path
    mine = new_manifest(campaign)
    found = read_manifest(folder)
    if found is None:
        if resume:
            raise UserError(f"{folder}: nothing to resume; leave out --resume to start")
        strange = [name for name in inside.names() if not name.startswith(WRITING)]
        if strange:
            raise UserError(f"{folder}: contains other files ({min(strange)}); choose another --out")
        kept = Kept(inside, mine)
        kept.save()
        return kept
    kept = Kept(inside, found)
    if resume:
        changed = cannot_continue({**found.decides, "version": found.version}, campaign)
        if found.decides != mine.decides or not found.sha256:
            changed.append(OTHERS["fingerprint"])
        if changed:
            raise UserError(f"{folder}: cannot be resumed: {changed[0]}; choose another --out, or start over with --overwrite")
        found.complete = False
        kept.save()
        return kept
    if not overwrite and found.pieces:
        state = "complete" if found.complete else f"{len(found.pieces)} of {found.wanted} replicates"
        raise UserError(
            f"{folder}: holds the estimate {found.name!r} ({state}); continue with --resume, choose another --out, or "
            "replace it with --overwrite"
        )
    with kept.explained():
        for name in names_in(found.files):
            inside.remove(name)
    kept = Kept(inside, mine)
    kept.save()
    return kept


def new_manifest(campaign: Campaign) -> Manifest:
    """rare.json before the first flight."""
    file = campaign.file
    rare = file.rare.model_dump(mode="json")
    return Manifest(
        name=file.name,
        version=__version__,
        decides={**identity(campaign), "draws": draws.VERSION, "failure": dict(file.failure), "rare": rare},
        seed=file.seed,
        precision=file.precision,
        campaign=campaign.text,
        mission=str(campaign.defaults["name"]),
        machine=machine(),
        wanted=file.rare.replicates + file.rare.opinions,
    )


def read_manifest(folder: Path) -> Manifest | None:
    """rare.json of a folder, or None. Raises UserError for one that cannot be read."""
    path = folder / MANIFEST
    if not os.path.lexists(path):
        return None
    try:
        return Manifest.model_validate(read_sealed(path))
    except (UserError, ValidationError):
        raise UserError(f"{path}: is damaged, or was not written by quadstep; choose another --out") from None
