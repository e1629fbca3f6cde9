"""CSV files."""

import csv
import math
from collections.abc import Iterable, Sequence
from pathlib import Path

from quadstep.interfaces.log import FlightLog


def write_csv(path: Path, header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write rows under a header; numbers read back exactly, missing values (None, NaN, infinity) are empty."""
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(header)
        table.writerows(tuple(map(cell, row)) for row in rows)


def write_log(path: Path, log: FlightLog) -> None:
    """Write one row per sample, units in brackets in the header."""
    line = ",".join(["%r"] * len(log.columns)) + "\n"  # what `csv` would write, in two thirds of the time
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerow([f"{name}[{unit}]" for name, unit in log.columns.items()])
        file.writelines(line % tuple(row) for row in log.rows.tolist())


def cell(value: object) -> object:
    """A value as it stands in the file."""
    if isinstance(value, bool):
        return str(value).lower()
    return None if isinstance(value, float) and not math.isfinite(value) else value
