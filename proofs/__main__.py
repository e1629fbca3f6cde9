"""Emit the statements, let Coq check their proofs and what these assume, ask Gappa and exact rationals for the bounds.

make proofs                     # installs Coq and Gappa where they are missing (Debian), then everything below
python -m proofs                # exit code 1 where something is not proved
python -m proofs --list         # what is stated, without proving it
"""

import resource
import sys
import tempfile
from pathlib import Path

from proofs import decrease, geometry, inertia, laws, lines, turning
from proofs.approximation import largest_error
from proofs.coq_run import UnprovedError, prove
from proofs.kernels import KERNELS
from proofs.rounding import proved
from proofs.statement import Stated
from quadstep.numbers.affine import ELEMENTARY, REDUCED

MODULES = (geometry, turning, inertia, laws, decrease, lines)


def all_statements() -> list[Stated]:
    """Everything that Coq is to prove."""
    return [statement for module in MODULES for statement in module.statements()]


PART = 0.25
"""Of what enclosures allow for an elementary function (`ELEMENTARY`), its polynomial may use so much, rounding included."""


def functions() -> list[str]:
    """The bounds of the elementary functions, a line each. Raises UnprovedError for more than enclosures allow for."""
    approximation = {(k.name, double): float(largest_error(k, double)) for double in (True, False) for k in KERNELS}
    lines = []
    for bound in proved():
        kind, polynomial = "f64" if bound.double else "f32", approximation.get((bound.name, bound.double))
        of_polynomial = f", polynomial {polynomial:.2e}" if polynomial is not None else ""
        if bound.double and bound.error + (polynomial or 0.0) > (PART * ELEMENTARY if polynomial is not None else REDUCED):
            raise UnprovedError(f"{bound.name}: {bound.error:.2e} is more than enclosures allow for (numbers/affine.py)")
        lines.append(f"  {bound.name:6} {kind}  rounding {bound.error:.2e}{of_polynomial}")
    return lines


def main(arguments: list[str]) -> int:
    """Run; the exit code."""
    statements = all_statements()
    for statement in statements:
        print(f"{statement.name:16} {statement.says}")
    if "--list" in arguments:
        return 0
    try:
        with tempfile.TemporaryDirectory() as folder:
            assumed = prove(statements, Path(folder))
        print(f"Coq: {len(statements)} statements proved, none admitted; assumed: {', '.join(sorted(assumed))}")
        print("Gappa and exact rationals, largest error (sin and atan: relative to r):", *functions(), sep="\n")
    except UnprovedError as error:
        print(f"Not proved: {error}")
        return 1
    used = resource.getrusage(resource.RUSAGE_CHILDREN), resource.getrusage(resource.RUSAGE_SELF)
    print(f"{sum(part.ru_utime + part.ru_stime for part in used):.0f} s of CPU")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
