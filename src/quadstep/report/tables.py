"""A log as CSV."""

from pathlib import Path

from quadstep.flight.log import FlightLog


def write_csv(path: Path, log: FlightLog) -> None:
    """One row a sample, header with units in brackets, numbers that read back exactly."""
    header = ",".join(f"{name}[{unit}]" for name, unit in log.columns.items())
    rows = "\n".join(",".join(map(repr, row)) for row in log.rows.tolist())
    path.write_text(f"{header}\n{rows}\n", encoding="utf-8")
