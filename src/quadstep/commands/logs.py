"""What commands that read logs share."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quadstep.errors import UserError
from quadstep.terminal.tables import show_table

if TYPE_CHECKING:
    from quadstep.identify.table import Compared
    from quadstep.mission.airframe import AirframeSection

LogsArgument = Annotated[list[Path], typer.Argument(metavar="LOG...", help="Logs of flights.", show_default=False)]
MappingOption = Annotated[
    str | None,
    typer.Option(help="Meaning of a CSV's columns: nanobench, crazypad, idsia, or a mapping file (TOML).", show_default=False),
]


def vehicle_of(given: str) -> "AirframeSection":
    """A vehicle by the name of a preset, or in a file. Raises UserError."""
    from quadstep.mission.vehicle_list import load_preset, preset_names, read_vehicle

    return load_preset(given) if given in preset_names() or not given.endswith(".toml") else read_vehicle(Path(given))


def check_names(logs: Sequence[Path]) -> None:
    """Refuses two logs of one name, which reports could not tell apart. Raises UserError."""
    seen: dict[str, Path] = {}
    for log in logs:
        if log.stem in seen:
            raise UserError(f"{log}: {seen[log.stem]} has the same name; flights are told apart by the names of their files")
        seen[log.stem] = log


def show_compared(title: str, found: "Compared") -> None:
    """The table of mean errors, and of their ratios to those of "constant" and of "zero rate"; it fits 80 columns."""
    from quadstep.identify.errors import GROUPS, HORIZONS, SHOWN, UNITS

    rows = []
    for horizon in HORIZONS:
        for group in GROUPS:
            error, constant, zero = (SHOWN[group] * one for one in found.means(horizon, group))
            ratio = found.ratio(horizon, group)
            beside = f"{found.ratio(horizon, group, 'zero').value:.2f}"
            shown = f"{ratio.value:.2f}"
            if math.isfinite(ratio.low):
                shown += f" ({ratio.low:.2f} to {ratio.high:.2f})"
            what = f"{group}, {horizon} [{UNITS[group]}]"
            rows.append((what, f"{error:.3g}", f"{constant:.3g}", f"{zero:.3g}", shown, beside))
    header = ("what, samples ahead", "error", "constant", "zero rate", "to constant (95 %)", "to zero")
    show_table(title, header, rows)
