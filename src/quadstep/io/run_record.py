"""The folder of a run that can be resumed: files as they are finished, and a manifest that lists them.

A file appears whole or not at all, and counts once the manifest, which has a digest of itself, names it. So however a run is
killed, what is finished can be read, and the run can be resumed.
"""

import contextlib
import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, ClassVar, TypeVar

from pydantic import BaseModel, ValidationError

from quadstep.io.errors import UserError, interruptible
from quadstep.io.files import WRITING
from quadstep.io.parts import SEAL, read_sealed, sealed
from quadstep.io.results_folder import Folder, alone_in, names_in

REPORT, FIGURES = "report.html", "figures"

R = TypeVar("R", bound="RunRecord")


class RunRecord:
    """The folder of one run, which has it for itself. Made by `opened`. A subclass says what kind of run it is.

    NAME: of the manifest's file; SCHEMA: what that must hold. WHAT: the run in a word; ITEMS: what it finishes
    one by one, in words. INNER: the folders of its files.
    """

    NAME: ClassVar[str]
    SCHEMA: ClassVar[type[BaseModel]]
    WHAT: ClassVar[str]
    ITEMS: ClassVar[str]
    INNER: ClassVar[tuple[str, ...]] = ()

    def __init__(self, files: Folder, manifest: dict[str, Any]) -> None:
        self.files, self.folder, self.manifest = files, files.path, manifest

    @property
    def finished(self) -> int:
        raise NotImplementedError

    @property
    def count(self) -> int:
        raise NotImplementedError

    @property
    def names(self) -> list[str]:
        return names_in(self.manifest.get("files"))

    @property
    def progress(self) -> str:
        """How many are finished, in words."""
        return f"{self.finished} of {self.count} {self.ITEMS}"

    @property
    def resume_hint(self) -> str:
        """What an interrupted run leaves, and how to go on."""
        return f"{self.progress} are kept in {self.folder}; continue with --resume"

    def save(self, **more: object) -> None:
        """Write the manifest. Raises UserError."""
        self.manifest |= more
        with self.explained():
            self.files.write(self.NAME, sealed(self.manifest))

    @contextlib.contextmanager
    def explained(self) -> Iterator[None]:
        """Turns an error of the disk into a UserError of one line."""
        try:
            yield
        except OSError as error:
            raise self.files.unwritable(error, f"{self.progress} are kept, --resume continues from there") from None

    def report(self, write: Callable[[Path], None]) -> None:
        """Have the report written into a temporary folder, and move it into place. Raises UserError."""
        with self.explained(), self.files.draft() as draft:
            (draft.path / FIGURES).mkdir()
            write(draft.path)
            names, before = draft.files(), names_in(self.manifest.get("files"))
            self.save(files=sorted({*before, *names}))  # so that files left by a killed run are known to be ours
            self.files.check_free(names)
            self.files.take(draft, names, REPORT)
            for name in set(before) - set(names):
                if name.startswith(f"{FIGURES}/"):
                    self.files.remove(name)
            self.manifest["files"] = names


def read_manifest(path: Path, schema: type[BaseModel], overwrite: bool = False) -> dict[str, Any] | None:
    """A manifest, or None where there is no such file. overwrite: any version's will do, if it is as it was written. Raises
    UserError for one that cannot be read.
    """
    if not os.path.lexists(path):
        return None
    try:
        content = read_sealed(path)
        if not (overwrite and SEAL in content):
            schema.model_validate(content)
    except UserError as error:
        raise UserError(f"{error}; choose another --out") from None
    except ValidationError:
        raise damaged(path) from None
    return content


def damaged(path: Path) -> UserError:
    """Why a manifest is not read."""
    return UserError(f"{path}: is damaged, or was not written by quadstep; choose another --out")


@contextlib.contextmanager
def opened(
    kind: type[R], path: Path, mine: dict[str, object], changed: Callable[[Mapping[str, object]], list[str]], resume: bool,
    overwrite: bool,
) -> Iterator[tuple[R, bool]]:  # fmt: skip
    """The folder of a run, made or resumed, and locked while the block runs; whether it is resumed.

    mine: the manifest of a new run. changed: why a run with another manifest cannot be resumed, in sentences. Raises UserError
    for a folder that holds something else, or into which another run is writing; InterruptedRun on Ctrl-C.
    """
    if resume and not path.exists():
        raise nothing_there(kind, path)
    record: R | None = None
    with alone_in(path) as inside, interruptible(lambda: record.resume_hint if record else ""):
        try:
            record, resumed = prepared(kind, inside, mine, changed, resume, overwrite and not resume)
            try:
                if not resumed:
                    record.save()
                yield record, resumed
            except KeyboardInterrupt:
                record.save()  # names every file: the last one may just have been written
                raise
        finally:
            inside.sweep(*kind.INNER)  # Ctrl-C may have come between making a file and guarding it


def prepared(
    kind: type[R], inside: Folder, mine: dict[str, object], changed: Callable[[Mapping[str, object]], list[str]], resume: bool,
    overwrite: bool,
) -> tuple[R, bool]:  # fmt: skip
    """The record in a folder that is locked, not yet saved where it is new; and whether it is resumed."""
    folder = inside.path
    manifest = read_manifest(folder / kind.NAME, kind.SCHEMA, overwrite)
    inside.sweep(*kind.INNER)
    if manifest is None:
        if resume:
            raise nothing_there(kind, folder)
        empty = [name for name in kind.INNER if inside.is_folder(name) and not inside.names(name)]
        strange = [name for name in inside.names() if not name.startswith(WRITING) and name not in empty]
        if strange:
            raise UserError(f"{folder}: contains other files ({min(strange)}); choose another --out")
    else:
        try:
            record = kind(inside, manifest)
        except (KeyError, TypeError):
            raise damaged(folder / kind.NAME) from None
        reasons = [] if overwrite else [*changed(manifest), *([] if SEAL in manifest else ["its manifest has changed"])]
        if resume:
            if reasons:
                raise UserError(
                    f"{folder}: cannot be resumed: {reasons[0]}; choose another --out, or start over with --overwrite"
                )
            return record, True
        if not overwrite and (record.finished or record.names):
            state = "complete" if record.finished == record.count else record.progress
            how = f"cannot be resumed: {reasons[0]};" if reasons else "continue with --resume,"
            raise UserError(
                f"{folder}: holds the {kind.WHAT} {manifest['name']!r} ({state}); {how} choose another "
                "--out, or replace it with --overwrite"
            )
        with record.explained():
            for name in (kind.NAME, *record.names):
                inside.remove(name)
    return kind(inside, mine), False


def nothing_there(kind: type[RunRecord], folder: Path) -> UserError:
    """Why a run cannot be resumed."""
    return UserError(f"{folder}: there is no {kind.WHAT} to resume; leave out --resume to start one")
