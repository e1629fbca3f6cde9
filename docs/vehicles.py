"""Draws docs/vehicles.png, where each rotor is and how it turns, and prints the table of docs/vehicles.md.

Run: python docs/vehicles.py [FOLDER]
"""

import math
import pathlib
import sys

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch
from matplotlib.path import Path

from quadstep.mission.airframe import LAYOUTS, AirframeSection, laid_out
from quadstep.mission.listings import load_preset
from quadstep.mission.presets import preset_names
from quadstep.report.canvas import STYLE
from quadstep.vehicle.rigid_body import Geometry

HERE = pathlib.Path(__file__).parent
COLOURS = {1: "tab:blue", -1: "tab:red"}


def draw(axes: Axes, geometry: Geometry, name: str, below: str) -> None:
    """A vehicle from above, x up the page and y to the left."""
    reach = max(math.hypot(*mount.position) for mount in geometry.mounts)
    disc = 0.32 if len(geometry.mounts) <= 6 else 0.26
    axes.set_axis_off()
    axes.set_aspect("equal")
    axes.set(xlim=(-1.5, 1.5), ylim=(-1.62, 1.4))
    for number, mount in enumerate(geometry.mounts, start=1):
        x, y = -mount.position[1] / reach, mount.position[0] / reach
        axes.plot([0.0, 0.75 * x], [0.0, 0.75 * y], color="0.6", linewidth=2, zorder=0)
        axes.text(x, y, str(number), ha="center", va="center", fontsize=10, color=COLOURS[mount.spin])
        turn = [math.radians(90.0 + mount.spin * degrees) for degrees in range(-150, 121, 5)]  # ccw: angles grow
        circle = Path([(x + disc * math.cos(angle), y + disc * math.sin(angle)) for angle in turn])
        arrow = {"arrowstyle": "-|>", "mutation_scale": 13, "linewidth": 1.6, "color": COLOURS[mount.spin]}
        axes.add_patch(FancyArrowPatch(path=circle, **arrow))
    axes.annotate("", (0.0, 0.45), (0.0, 0.0), arrowprops={"arrowstyle": "-|>", "color": "black"})
    axes.annotate("", (-0.45, 0.0), (0.0, 0.0), arrowprops={"arrowstyle": "-|>", "color": "black"})
    axes.text(0.06, 0.42, "x", fontsize=8)
    axes.text(-0.45, 0.07, "y", fontsize=8)
    axes.set_title(name, fontsize=10)
    axes.text(0.0, -1.6, below, ha="center", fontsize=8, color="0.3")


def size(reach: float) -> str:
    """A length in words of its size."""
    return f"{100.0 * reach:.3g} cm from centre to rotor"


def table() -> str:
    """The presets side by side, Markdown."""
    head = (
        "| preset | mass [kg] | inertia [kg m²] | centre to rotor [m] | thrust-to-weight | rotor lag [s] | drag at 5 m/s [N] |"
    )
    rows = [head, "|---|---|---|---|---|---|---|"]
    for name in preset_names():
        vehicle = load_preset(name)
        inertia = ", ".join(f"{value:.3g}" for value in vehicle.inertia)
        rows.append(
            f"| `{name}` | {vehicle.mass:.4g} | {inertia} | {reach(vehicle):.3g} | {lift(vehicle):.2f} "
            f"| {vehicle.rotor.rise_time:.3g} | {drag(vehicle, 5.0):.2g} |"
        )
    return "\n".join(rows)


def reach(vehicle: AirframeSection) -> float:
    """From the centre to the farthest rotor [m]."""
    return max(math.hypot(*mount.position) for mount in vehicle.geometry().mounts)


def lift(vehicle: AirframeSection) -> float:
    """Greatest thrust over weight."""
    return len(vehicle.geometry().mounts) * vehicle.build().allocation.most / (vehicle.mass * vehicle.gravity)


def drag(vehicle: AirframeSection, speed: float) -> float:
    """Drag of the level vehicle along x with its rotors at hover speed [N]."""
    count = len(vehicle.geometry().mounts)
    hover = math.sqrt(vehicle.mass * vehicle.gravity / count / vehicle.rotor.thrust_coefficient)
    return count * hover * vehicle.drag.rotor[0] * speed + vehicle.drag.parasitic[0] * speed * speed


def main(folder: pathlib.Path = HERE) -> None:
    """Draw, and print the table."""
    presets = [(load_preset(name), f"preset {name}") for name in preset_names()]
    panels = [(vehicle.geometry(), name, size(reach(vehicle))) for vehicle, name in presets]
    panels += [(Geometry(laid_out(name, 1.0)), f"layout {name}", f"{count} rotors") for name, (count, _) in LAYOUTS.items()]
    with rc_context(STYLE):
        figure = Figure(figsize=(11, 8.6), layout="constrained")
        FigureCanvasAgg(figure)
        cells = figure.subplots(3, 4).ravel()
        for axes, (geometry, name, below) in zip(cells, panels, strict=False):
            draw(axes, geometry, name, below)
        key = cells[-1]
        key.set_axis_off()
        key.set(xlim=(-1.5, 1.5), ylim=(-1.75, 1.6))
        key.text(0.0, 0.5, "seen from above:\nx forward, y left, z towards you", ha="center", fontsize=9)
        key.text(0.0, -0.1, "counter-clockwise (ccw):\nthe body feels it clockwise", ha="center", fontsize=9, color=COLOURS[1])
        key.text(0.0, -0.7, "clockwise (cw): the body\nfeels it counter-clockwise", ha="center", fontsize=9, color=COLOURS[-1])
        figure.savefig(folder / "vehicles.png", dpi=100, metadata={"Software": None})
    print(table())


if __name__ == "__main__":
    main(*map(pathlib.Path, sys.argv[1:]))
