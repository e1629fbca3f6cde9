"""CSV files."""

import csv
import math
from collections.abc import Iterable, Sequence
from pathlib import Path

from quadstep.flight.log import FlightLog


def write_csv(path: Path, header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write rows under a header; numbers read back exactly, missing values (None, NaN, infinity) are empty."""
    write_rows(path, header, (tuple(map(cell, row)) for row in rows))


def write_log(path: Path, log: FlightLog) -> None:
    """Write one row per sample, units in brackets in the header."""
    write_rows(path, [f"{name}[{unit}]" for name, unit in log.columns.items()], log.rows.tolist())


def write_rows(path: Path, header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write the lines."""
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(header)
        table.writerows(rows)


def cell(value: object) -> object:
    """A value as it stands in the file."""
    if isinstance(value, bool):
        return str(value).lower()
    return None if isinstance(value, float) and not math.isfinite(value) else value
