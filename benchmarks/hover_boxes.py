"""`python -m benchmarks.hover_boxes [LAW ...]`: the largest box of starts from which hover is proved to hold for ever.

The 2.6 kg vehicle at rest, rotors with lag, each law as declared, nets off: the table of `docs/prove.md`.
"""

import sys
import time
from typing import Any

from quadstep import Mission
from quadstep.control.registry import names
from quadstep.interfaces.controller import Measured
from quadstep.io.errors import UserError
from quadstep.proofs.prove.hold import Departure, described, invariant_set
from quadstep.proofs.prove.sampled import SampledLoop
from quadstep.proofs.prove.unknown import Unknown
from quadstep.report.units import rounded_down, rounded_up

PLACE = [0.0, 0.0, 5.0]


def hovering(law: str) -> Mission:
    """The vehicle of docs/linear.md, held in the air."""
    content: dict[str, Any] = {
        "vehicle": {"preset": "research-2.6kg"},
        "path": {"type": "step", "start": PLACE, "end": PLACE, "duration": 10.0},
        "controller": {"type": law},
    }
    mission = Mission.model_validate(content)
    if mission.controller.table is None:
        return mission
    return Mission.model_validate({**content, "controller": {"type": law, "nets": {"enabled": False}}})


def row(law: str) -> str:
    """A law, the box of starts, the set, or the one line why there is none."""
    begun = time.process_time()
    try:
        loop = SampledLoop(hovering(law).plan())
        found = invariant_set(loop, Unknown())
    except UserError as error:
        found = str(error)
    spent = f"{time.process_time() - begun:.0f} s"
    if isinstance(found, str):
        return f"| `{law}` | open | {found} | {spent} |"
    if isinstance(found, Departure):
        box = f"{1e3 * rounded_down(float(max(found.reach[:3])), 3):.3g} mm"
        return f"| `{law}` | disproved | flights leave a box of {box} within {found.seconds:.3g} s | {spent} |"
    reach = ", ".join(f"{rounded_up(1e3 * one, 3):.3g}" for one in found.reach[:3])
    rest = ", ".join(f"{name} {value}" for name, value in described(loop, found.reach))
    start = "" if found.own else " (all else as at rest)"
    return f"| `{law}` | {rounded_down(1e3 * found.found.start, 3):.3g} mm{start} | {reach} mm; {rest} | {spent} |"


def main() -> None:
    """Print the table."""
    print("| law | begins within, each axis | stays within | CPU |\n|---|---|---|---|")
    for law in sys.argv[1:] or names(Measured):
        print(row(law), flush=True)


if __name__ == "__main__":
    main()
