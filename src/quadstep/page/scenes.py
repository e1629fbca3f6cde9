"""What the page draws of a flight: the vehicle, and plots by what the columns of its log are called."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from quadstep.flight.engines import FlightPlan
from quadstep.flight.log import FlightLog
from quadstep.page.model import Arrow, Line, Panel, RotorView, Scene
from quadstep.plants.lagrange import Lagrange
from quadstep.plants.multirotor import Multirotor

AXES, ANGLES = ("x", "y", "z"), ("psi", "theta", "phi")


def scene(plan: FlightPlan | None, log: FlightLog) -> Scene:
    """The scene of a flight; of an unknown vehicle a small quadrotor is drawn where its log says it is."""
    if plan is not None and isinstance(plan.loop.plant, Lagrange):
        return lagrange_scene(plan, log)
    return airframe_scene(plan, log)


def lagrange_scene(plan: FlightPlan, log: FlightLog) -> Scene:
    """The paper's vehicle: rotor 1 at -y, 2 at -x, 3 at +y, 4 at +x (docs/conventions.md)."""
    vehicle = plan.parameters.vehicle
    arm = float(vehicle.rotors.arm)
    places = ((0.0, -arm, 0.0), (-arm, 0.0, 0.0), (0.0, arm, 0.0), (arm, 0.0, 0.0))
    rotors = tuple(RotorView(place, 1 if i % 2 == 0 else -1, f"f{i + 1}", None) for i, place in enumerate(places))
    force = Arrow("steady force", "N", "force", None, ("disturbance.force.0", "disturbance.force.1", "disturbance.force.2"))
    return Scene(
        arm=arm,
        radius=0.6 * arm,
        rotors=rotors,
        hover=float(vehicle.mass * vehicle.gravity) / 4.0,
        position=AXES,
        wanted=("x_d", "y_d", "z_d"),
        attitude={"kind": "lagrange", "columns": list(ANGLES)},
        thrust="u",
        arrows=(force,),
        ground=lowest(log),
    )


def airframe_scene(plan: FlightPlan | None, log: FlightLog) -> Scene:
    """A real vehicle, its rotors where its geometry says."""
    columns = log.columns
    known_vehicle = plan is not None and isinstance(plan.loop.plant, Multirotor)
    airframe = plan.parameters.airframe if plan is not None and known_vehicle else None
    mounts = plan.loop.plant.geometry.mounts if plan is not None and known_vehicle else ()
    rotors = tuple(
        RotorView(
            (mount.position[0], mount.position[1], mount.position[2]),
            1 if mount.spin > 0 else -1,
            known(columns, f"f{i + 1}"),
            None,
        )
        for i, mount in enumerate(mounts)
    )
    if not rotors:
        corners = ((0.1, 0.1), (-0.1, 0.1), (-0.1, -0.1), (0.1, -0.1))
        rotors = tuple(RotorView((x, y, 0.0), 1 if i % 2 else -1, None, None) for i, (x, y) in enumerate(corners))
    arm = max(math.hypot(rotor.position[0], rotor.position[1]) for rotor in rotors)
    weight = float(airframe.mass * airframe.gravity) if airframe is not None else 1.0
    ground = float(airframe.ground) if airframe is not None and math.isfinite(float(airframe.ground)) else lowest(log)
    quaternion = ("q_w", "q_x", "q_y", "q_z")
    kind = "quaternion" if all(name in columns for name in quaternion) else "lagrange"
    wind = Arrow("wind", "m/s", "wind", ("wind_x", "wind_y", "wind_z"), None)
    return Scene(
        arm=arm,
        radius=0.6 * arm,
        rotors=rotors,
        hover=weight / len(rotors),
        position=AXES,
        wanted=("x_d", "y_d", "z_d"),
        attitude={"kind": kind, "columns": list(quaternion if kind == "quaternion" else ANGLES)},
        thrust=known(columns, "u_a") or known(columns, "u"),
        arrows=(wind,) if "wind_x" in columns else (),
        ground=max(ground, lowest(log)) if ground < lowest(log) - 10.0 else ground,
    )


def known(columns: Mapping[str, str], name: str) -> str | None:
    """The name, if there is such a column."""
    return name if name in columns else None


def lowest(log: FlightLog) -> float:
    """A height [m] below everything flown."""
    if not len(log.rows):
        return 0.0
    heights = [log.column(name).min() for name in ("z", "z_d") if name in log.columns]
    return float(np.floor(min([0.0, *heights])))


def group(panel: str, title: str, unit: str, names: Sequence[str], wanted: Sequence[str] = (), minus: bool = False) -> Panel:
    """A panel of columns, with what was wanted of each beside it, or with the error instead."""
    if minus:
        return Panel(panel, title, unit, tuple(Line(f"{d} - {n}", d, n) for n, d in zip(names, wanted, strict=True)))
    return Panel(panel, title, unit, (*(Line(n, n) for n in names), *(Line(d, d, dashed=True) for d in wanted)))


PANELS = (
    group("position", "Position", "m", AXES, ("x_d", "y_d", "z_d")),
    group("position-error", "Position error", "m", AXES, ("x_d", "y_d", "z_d"), minus=True),
    group("attitude", "Attitude against command", "rad", ANGLES, ("psi_d", "theta_d", "phi_d")),
    group("attitude-error", "Attitude error", "rad", ANGLES, ("psi_d", "theta_d", "phi_d"), minus=True),
    group("attitude", "Attitude against command", "rad", ("yaw", "pitch", "roll"), ("yaw_d", "pitch_d", "roll_d")),
    group("attitude-error", "Attitude error", "rad", ("yaw", "pitch", "roll"), ("yaw_d", "pitch_d", "roll_d"), minus=True),
    group("thrust", "Thrust", "N", ("u",)),
    group("thrust-made", "Thrust wanted and made", "N", ("u_a",), ("u",)),
    group("torque", "Torques", "N m", ("tau_psi", "tau_theta", "tau_phi")),
    group("torque", "Torques wanted and made", "N m", ("tau_x_a", "tau_y_a", "tau_z_a"), ("tau_x", "tau_y", "tau_z")),
    group("rotors", "Rotor forces", "N", tuple(f"f{i}" for i in range(1, 9))),
    group("estimate", "Estimated position less true", "m", AXES, ("x_m", "y_m", "z_m"), minus=True),
    group("wind", "Wind", "m/s", ("wind_x", "wind_y", "wind_z")),
    group("voltage", "Battery", "V", ("voltage",)),
    Panel("weights", "Norms of the weights", "-", (Line("|W1|", "norm_W1"), Line("|W2|", "norm_W2"))),
    Panel("lyapunov", "Lyapunov function without its weights (Eq. 55)", "J", (Line("L", "lyapunov"),), log=True),
    Panel("r1", "Filtered position error |r1|", "m/s", (Line("|r1|", "norm_r1"),), log=True),
    Panel("r2", "Filtered attitude error |r2|", "rad/s", (Line("|r2|", "norm_r2"),), log=True),
)
"""Every plot there may be, in order; a flight gets those whose first column its log has."""


def panels(columns: Mapping[str, str]) -> tuple[Panel, ...]:
    """The plots of a log with these columns."""
    found: dict[str, Panel] = {}
    for panel in PANELS:
        lines = tuple(line for line in panel.lines if line.column in columns and (line.minus is None or line.minus in columns))
        if lines and panel.id not in found and panel.lines[0] in lines:
            found[panel.id] = panel._replace(lines=lines)
    if "thrust-made" in found:
        found.pop("thrust", None)
    return tuple(found.values())
