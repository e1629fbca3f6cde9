"""Finished cells of a study that is not over, so that after an interruption the same command goes on from them."""

import hashlib
import json
from pathlib import Path
from typing import Any

from quadstep import __version__
from quadstep.analysis.statistics import Estimate
from quadstep.comparison.cell import Cell
from quadstep.comparison.flights import FIRST_SEED, mission
from quadstep.report.publish import WRITING

NAME = f"{WRITING}cells.jsonl"
MOST_BYTES = 10_000_000
"""A larger file was written by something else."""


class Kept:
    """The cells in a folder, by `key`; a line of JSON each, appended as they come."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / NAME
        self.cells: dict[str, Cell] = {}
        if self.path.is_file() and self.path.stat().st_size <= MOST_BYTES:
            for line in self.path.read_text(encoding="utf-8", errors="replace").splitlines():
                self.read(line)

    def read(self, line: str) -> None:
        """Take in one line; one that was cut short by a kill counts for nothing."""
        try:
            one = json.loads(line)
            values = {**one["cell"], "rmse": Estimate(*one["cell"]["rmse"]), "lost": Estimate(*one["cell"]["lost"])}
            self.cells[one["key"]] = Cell(**values)
        except (ValueError, TypeError, KeyError):
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
