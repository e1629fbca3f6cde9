"""Draws docs/paper.png, the picture of docs/paper.md: the loop, and what the study finds.

Run: python docs/paper.py [FOLDER]
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

from quadstep import flight_metrics, fly, read_mission
from quadstep.report.canvas import LINES, STYLE
from quadstep.studies.paper.cases import STRESS_TIMES, completed, stress

HERE = Path(__file__).parent
ROOT = HERE.parent

BOXES = (
    ("path", "minimum jerk, waypoints,\ncurves, recordings\nEqs 68-75"),
    ("position loop", "filtered error, desired\nforce, first net\nEqs 11-24"),
    ("inversion", "thrust, attitude,\ncommand filter\nEqs 40-52"),
    ("attitude loop", "filtered error, torque,\nsecond net\nEqs 27-35, 54"),
    ("rotors", "map, inverse,\nlimits\nEq. 5"),
    ("plant", "Lagrange form,\ndisturbance\nEqs 1-10, 66, 67"),
)


def chain(axes: Axes) -> None:
    """The loop as boxes."""
    axes.set_axis_off()
    axes.set(xlim=(0, len(BOXES)), ylim=(0, 1))
    for i, (name, text) in enumerate(BOXES):
        axes.text(i + 0.5, 0.72, name, ha="center", va="center", fontsize=10)
        axes.text(i + 0.5, 0.42, text, ha="center", va="center", fontsize=8)
        frame = FancyBboxPatch((i + 0.06, 0.2), 0.88, 0.68, boxstyle="round,pad=0,rounding_size=0.04", fill=False)
        axes.add_patch(frame)
        if i:
            axes.annotate("", (i + 0.05, 0.55), (i - 0.05, 0.55), arrowprops={"arrowstyle": "-|>", "color": "black"})
    back = {"arrowstyle": "-|>", "color": "0.4", "connectionstyle": "bar,fraction=-0.02"}
    axes.annotate("", (1.5, 0.16), (5.5, 0.16), arrowprops=back)
    axes.text(3.5, 0.03, "state, sampled", ha="center", va="center", fontsize=8, color="0.3")


def recorded_flight(axes: Axes) -> None:
    """Positions that a simulated Crazyflie's estimator logged, and the path made of them, flown."""
    mission = ROOT / "examples" / "recorded.toml"
    log = fly(read_mission(mission).plan(mission.parent))
    recorded = np.genfromtxt(mission.with_suffix(".csv"), delimiter=",", names=True)
    for name, style in zip("xy", LINES, strict=False):
        axes.plot(recorded["t"], recorded[f"{name}_m"], ".", color="0.7", markersize=4, label=f"{name} recorded")
        axes.plot(log.column("t"), log.column(name), label=f"{name} flown again", **style)
    axes.set(xlabel="time [s]", ylabel="[m]", ylim=(-1.2, 1.9), title="A recording, flown again")
    axes.legend(ncols=2, loc="upper center")


def envelope(axes: Axes) -> None:
    """RMSE over t_f with and without nets under the paper's disturbance."""
    for style, (nets, name) in zip(LINES, ((True, "nets on"), (False, "nets off")), strict=False):
        flown = {t: flight_metrics(fly(stress(t, 1.0, enabled=nets).plan())) for t in STRESS_TIMES}
        kept = {t: 1e3 * m["position_rmse[m]"] for t, m in flown.items() if completed(m)}
        axes.plot(list(kept), list(kept.values()), label=name, marker="o", markersize=4, **style)
        for t in set(flown) - set(kept):
            axes.plot([t], [3e3], marker="x", color=style["color"], markersize=8)
            axes.annotate(f"{name}: diverged", (t, 3e3), (t + 0.5, 2e3), fontsize=8)
    axes.set(xscale="log", yscale="log", xlabel="time to fly Case 1's path, t_f [s]", ylabel="position RMSE [mm]")
    axes.set_xticks(STRESS_TIMES, [f"{t:g}" for t in STRESS_TIMES])
    axes.yaxis.set_major_formatter("{x:g}")
    axes.minorticks_off()
    axes.set_title("What the nets buy, and where they cost")
    axes.legend()


def main(folder: Path = HERE) -> None:
    """Draw."""
    with rc_context(STYLE):
        figure = Figure(figsize=(11, 5.6), layout="constrained")
        FigureCanvasAgg(figure)
        mosaic = figure.subplot_mosaic([["chain", "chain"], ["flight", "envelope"]], height_ratios=[1, 1.9])
        chain(mosaic["chain"])
        recorded_flight(mosaic["flight"])
        envelope(mosaic["envelope"])
        figure.savefig(folder / "paper.png", dpi=110, metadata={"Software": None})


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
