"""Tables as CSV files and in LaTeX."""

import csv
import math
from collections.abc import Collection, Iterable, Sequence
from pathlib import Path

from quadstep.interfaces.log import FlightLog

SPECIAL = {char: f"\\{char}" for char in "&%$#_{}"} | {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": "$<$",
    ">": "$>$",
    "\u2212": "$-$",
    "\u00b0": r"\textdegree{}",
    "\u00b5": r"\textmu{}",
    "\u00b2": "$^2$",
    "\u00b3": "$^3$",
    "\u00a0": "~",
}


def escaped(text: str) -> str:
    """Text that LaTeX sets as it is."""
    return "".join(SPECIAL.get(char, char) for char in text)


def booktabs(
    header: Sequence[str],
    groups: Sequence[Sequence[Sequence[str]]],
    comments: Sequence[str] = (),
    bold: Collection[tuple[int, int, int]] = (),
) -> str:
    """A tabular with its first column to the left and the others to the right.

    groups: rows of cells, each set apart by a rule. comments: what the table shows. bold: group, row, column of cells.
    """
    parts = [f"% {escaped(line)}" for line in comments] + [r"% needs \usepackage{booktabs}"]
    parts += [rf"\begin{{tabular}}{{l{'r' * (len(header) - 1)}}}", r"\toprule", line(map(escaped, header))]
    for g, group in enumerate(groups):
        parts.append(r"\midrule")
        for r, row in enumerate(group):
            cells = [rf"\textbf{{{escaped(cell)}}}" if (g, r, c) in bold else escaped(cell) for c, cell in enumerate(row)]
            parts.append(line(cells))
    return "\n".join([*parts, r"\bottomrule", r"\end{tabular}", ""])


def line(cells: Iterable[str]) -> str:
    """A row of cells that LaTeX sets."""
    return f"{' & '.join(cells)} \\\\"


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
