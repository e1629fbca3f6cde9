"""Draws docs/envelope.png, where the paper's controller can fly, and prints what docs/envelope.md says of it.

Run: python docs/envelope.py [FOLDER]
"""

import pathlib
import shutil
import sys
import tempfile

import numpy as np

from quadstep.studies.envelope import Map
from quadstep.studies.envelope_request import request
from quadstep.studies.study import run

HERE = pathlib.Path(__file__).parent
ROOT = HERE.parent
MISSION = ROOT / "examples" / "case1.toml"
X, Y, BY = "path.duration=2:40:39", "disturbance.scale=0:5:26", "controller.nets.enabled=true,false"
FAILURE = "largest_error=1"


def main(folder: pathlib.Path = HERE) -> None:
    """Fly, draw, print."""
    asked = request(MISSION, X, Y, BY, [FAILURE])
    with tempfile.TemporaryDirectory() as temporary:
        out = pathlib.Path(temporary) / "out"
        found, evidence = run(Map(asked), out)
        shutil.copyfile(out / "envelope.png", folder / "envelope.png")
    print(*evidence.sentences)
    (with_nets, without), (rmse, bare) = found.cells.flyable, found.cells.rmse
    both = with_nets & without
    low, middle, high = np.quantile(bare[both] / rmse[both], [0.05, 0.5, 0.95])
    print(f"Flyable only with nets: {(with_nets & ~without).sum()} cells; only without: {(without & ~with_nets).sum()}.")
    print(f"Where both fly, the nets cut the RMSE {middle:.3g} times (median; {low:.3g} to {high:.3g} in 90 % of cells).")
    print(f"Cells in which nets make it worse: {(bare < rmse)[both].sum()} of {both.sum()}.")


if __name__ == "__main__":
    main(*map(pathlib.Path, sys.argv[1:]))
