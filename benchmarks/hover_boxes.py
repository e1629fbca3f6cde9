"""Prints the largest start boxes from which hover of the 2.6 kg vehicle is proved to stay near, under each of its laws.

    python -m benchmarks.hover_boxes [LAW ...]

Rotors with lag, 1 s, starts off by as much on each axis, all else as in the mission; each box is the first of STARTS that
`quadstep prove` closes.
"""

import sys
import tempfile
from pathlib import Path

from quadstep.control.registry import controllers
from quadstep.documents import parse_toml
from quadstep.errors import UserError
from quadstep.mission.read import check_mission
from quadstep.prove.run import Kind, prove_mission

STARTS = (3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5)
"""Tried one after another [m]."""

MISSION = """
name = "{law}"
vehicle = {{ preset = "research-2.6kg" }}
path = {{ type = "step", start = [0.0, 0.0, 2.0], end = [0.0, 0.0, 2.0], time = 0.0, duration = 1.0 }}
controller = {{ type = "{law}"{more} }}
"""


def row(law: str, more: str, folder: Path) -> str:
    """A line of the table."""
    path, said = folder / "hover.toml", ""
    path.write_text(MISSION.format(law=law, more=more))
    for start in STARTS:
        try:
            found = prove_mission(path, start=start)
        except UserError as error:
            said = str(error).removeprefix(f"{path}: ")
            continue
        if found.kind is Kind.PROVED:
            return f"{law:>28}  {1e3 * start:6g} mm  " + ", ".join(one[2] for one in found.rows)
        said = found.says[0]
    return f"{law:>28}  none       {said}"


def main() -> None:
    """Print."""
    known = controllers(check_mission(parse_toml(MISSION.format(law="pid", more=""), ""), "").measures)
    with tempfile.TemporaryDirectory() as folder:
        for law in sys.argv[1:] or known:
            print(row(law, "", Path(folder)), flush=True)


if __name__ == "__main__":
    main()
