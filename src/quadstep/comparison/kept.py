"""What a study has worked out so far, kept by content: gains, flights, margins, linear loops and costs of computing.

Each is kept under a digest of all that decides it.

So a study that was interrupted goes on, and one that has grown works out only what is new.
"""

import contextlib
import hashlib
import json
import os
import shutil
from collections.abc import Iterable
from pathlib import Path

from quadstep import __version__
from quadstep.atomic import WRITING, replace_file
from quadstep.errors import UserError

FLIGHTS, GAINS, MARGINS, LINEAR, COSTS, JOURNALS = "flights", "gains", "margins", "linear", "costs", "journals"
"""Folders of results, and of what a search has flown so far."""

ENDINGS = {FLIGHTS: "parquet", GAINS: "json", MARGINS: "json", LINEAR: "json", COSTS: "json", JOURNALS: "jsonl"}
RUNNING = f"{WRITING}kept"
"""Where results are before the study is over; no result folder is taken for another's because of it."""


class Kept:
    """The results of a study in a folder: what an unfinished run left, and what a finished one published."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.running = folder, folder / RUNNING

    def path(self, kind: str, key: str) -> Path:
        """Where a new result goes."""
        return self.running / kind / f"{key}.{ENDINGS[kind]}"

    def find(self, kind: str, key: str) -> Path | None:
        """The file of a result; None where it is still to be worked out."""
        for path in (self.path(kind, key), self.folder / kind / f"{key}.{ENDINGS[kind]}"):
            if path.is_file():
                return path
        return None

    def add(self, kind: str, key: str, content: bytes) -> Path:
        """Keep a result. Raises UserError where the disk does not take it."""
        path = self.path(kind, key)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            replace_file(path, content, synced=True)
        except OSError as error:
            raise UserError(
                f"{self.folder}: cannot be written: {error.strerror or error}; finished results are kept"
            ) from None
        return path

    def publish(self, out: Path, wanted: Iterable[tuple[str, str]]) -> None:
        """Put these results, by kind and key, into the folder of a finished study; equal entrants share theirs."""
        for kind, key in dict.fromkeys(wanted):
            found = self.find(kind, key)
            assert found
            target = out / kind / found.name
            target.parent.mkdir(parents=True, exist_ok=True)
            try:
                os.link(found, target)
            except OSError:  # a file system without links
                shutil.copyfile(found, target)

    def remove(self) -> None:
        """The study is over, and published."""
        with contextlib.suppress(OSError):
            shutil.rmtree(self.running)


def key(*decisive: object) -> str:
    """A digest of all that decides a result, and of the version."""
    text = json.dumps([__version__, *decisive], sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:16]
