"""Finished cells of an unfinished study, from which the same command continues after an interruption."""

import contextlib
import hashlib
import json
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from quadstep import __version__
from quadstep.atomic import WRITING
from quadstep.comparison.cell import Cell
from quadstep.comparison.flights import FIRST_SEED, mission
from quadstep.errors import UserError
from quadstep.files import JSON, read_text

NAME = f"{WRITING}cells.jsonl"
CELL = TypeAdapter(Cell)


class Kept:
    """The cells in a folder, by `key`; a line of JSON each, appended as they come."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / NAME
        self.cells: dict[str, Cell] = {}
        with contextlib.suppress(UserError):  # there is none, or something else wrote it
            for line in read_text(self.path, JSON).splitlines():
                self.read(line)

    def read(self, line: str) -> None:
        """Take in one line; one that was cut short by a kill is ignored."""
        try:
            one = json.loads(line)  # with NaN, where no flight completed
            self.cells[str(one["key"])] = CELL.validate_python(one["cell"])
        except (ValueError, TypeError, KeyError, RecursionError):
            return

    def add(self, key: str, cell: Cell) -> None:
        """Keep one more."""
        self.cells[key] = cell
        with self.path.open("a", encoding="utf-8") as file:
            file.write("\n" + json.dumps({"key": key, "cell": cell._asdict()}) + "\n")

    def remove(self) -> None:
        """The study is over."""
        self.path.unlink(missing_ok=True)


def key(vehicle: str, controller: str, scenario: dict[str, Any], seeds: int) -> str:
    """A digest of everything that decides a cell: the whole first mission, how many seeds, and by which version."""
    first = mission(vehicle, controller, scenario, FIRST_SEED).model_dump_json()
    return hashlib.sha256(f"{__version__} {seeds} {first}".encode()).hexdigest()[:16]
